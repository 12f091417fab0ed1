//! Clocks that were set during a recording.

use crate::data::Trial;
use crate::data::clean::noise_by_differences;

/// A step of time so many times the usual one is a jump.
const JUMP: f64 = 10.0;
/// Samples before a jump that say how far a channel moves in a step.
const BEFORE: usize = 5;
/// Multiples of the noise, and of what a step may be off, by which a channel must move to tell.
const TOLD: f64 = 10.0;

/// Looks for jumps of the clock.
pub(super) fn check(trial: &Trial) -> Result<(), String> {
    let usual = trial.interval();
    let jumps = |k: &usize| trial.time[*k] - trial.time[k - 1] > JUMP * usual;
    if let Some(k) = (1..trial.len()).filter(jumps).find(|k| was_set(trial, *k, usual)) {
        let [before, after] = [trial.time[k - 1], trial.time[k]];
        return Err(format!(
            "the clock jumps by {:.3} s at {before:.3} s (sample {}), while the platform goes on as in one step of {usual} s. \
             Cut the recording there into two.",
            after - before,
            k + 1
        ));
    }
    Ok(())
}

/// Whether all channels are at sample `k` where they would be after one step, and one that moves would be far from there after
/// a longer time.
fn was_set(trial: &Trial, k: usize, usual: f64) -> bool {
    if k < 2 * BEFORE {
        return false;
    }
    let mut told = false;
    for j in 0..trial.channels.len() {
        let noise = noise_by_differences(trial, j).max(trial.channels[j].noise_floor());
        let value = |back: usize| trial.measured[k - back][j];
        let change = |from: usize, to: usize| (value(to) - value(from)) / (from - to) as f64;
        // In one step: by the last samples, and how much that differs from the ones before.
        let (step, earlier) = (change(1 + BEFORE, 1), change(1 + 2 * BEFORE - 1, 1 + BEFORE));
        let gone = (value(0) - value(1)).abs();
        if !(gone.is_finite() && step.is_finite() && earlier.is_finite()) {
            continue;
        }
        let allowed = TOLD * noise + 2.0 * step.abs() + 2.0 * (step - earlier).abs();
        if gone > allowed {
            return false;
        }
        let column = || trial.measured.iter().map(|row| row[j]).filter(|v| v.is_finite());
        let range = column().fold(f64::NEG_INFINITY, f64::max) - column().fold(f64::INFINITY, f64::min);
        let steps = (trial.time[k] - trial.time[k - 1]) / usual;
        told |= range.min(step.abs() * steps) > TOLD * allowed;
    }
    told
}
