//! Readings of a position that jump away and back again, as of a tracker that takes something else for its target for a while.
//!
//! A position does not jump. Where one does within a sample, by far more than what its changes do before, between and after, and
//! back again to where it would have been, what was shown between was not measured there.

use super::clean::median;
use super::counts::smallest_step;
use super::{Channel, Trial};

/// How many times as large as the changes of its rate around it a jump is.
const BEYOND: f64 = 6.0;
/// Changes of the rate that are looked at before the jump away and behind the one back.
const AROUND: usize = 5;
/// Longest time between the two (s): later a straight line does not tell where it would have been.
const LONGEST: f64 = 2.0;
/// Share of the jump by which a position may be off the straight line from before to behind it.
const OFF: f64 = 0.3;

/// Makes gaps of what positions showed between jumps away and back; returns how many readings that were.
pub(crate) fn remove_bursts(trial: &mut Trial) -> usize {
    let mut removed = 0;
    for j in (0..trial.channels.len()).filter(|j| !matches!(trial.channels[*j], Channel::Tension(_))) {
        let known: Vec<usize> = (0..trial.len()).filter(|k| trial.measured[*k][j].is_finite()).collect();
        let time: Vec<f64> = known.iter().map(|k| trial.time[*k]).collect();
        let value: Vec<f64> = known.iter().map(|k| trial.measured[*k][j]).collect();
        for at in bursts(&time, &value, smallest_step(trial, j)) {
            trial.measured[known[at]][j] = f64::NAN;
            removed += 1;
        }
    }
    removed
}

/// The readings between jumps away and back, where two different ones are one `step` apart at least.
fn bursts(time: &[f64], value: &[f64], step: f64) -> Vec<usize> {
    let mut out = Vec::new();
    if value.len() < 2 * AROUND + 4 {
        return out;
    }
    // From each reading to the next, less what goes on anyway.
    let change: Vec<f64> = value.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let bend: Vec<f64> = change.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
    // By a count or two the rate of an instrument that counts changes all the time.
    let usual = (1.4826 * median(bend.clone())).max(step);
    let mut k = AROUND + 1;
    while k + AROUND + 2 < change.len() {
        // Jumps stand out in the changes of the rate on both of their sides.
        let away = change[k] - 0.5 * (change[k - 1] + change[k + 1]);
        let back =
            (bend[k - 1] > BEYOND * usual && bend[k] > BEYOND * usual).then(|| end(time, &change, &bend, k, away));
        match back.flatten() {
            Some(back) => {
                out.extend(k + 1..=back);
                k = back + 1;
            }
            None => k += 1,
        }
    }
    out
}

/// The change by which a position is back that jumped `away` by change `k`.
fn end(time: &[f64], change: &[f64], bend: &[f64], k: usize, away: f64) -> Option<usize> {
    let quiet = |bends: &[f64]| bends.iter().all(|bend| away.abs() > BEYOND * bend);
    let latest = time.partition_point(|t| *t - time[k] <= LONGEST).min(change.len() - AROUND - 1);
    let returns = |back: &usize| {
        let behind = change[*back] - 0.5 * (change[back - 1] + change[back + 1]);
        // Where it would have been by the rates before and behind.
        let rate =
            |at: usize| (change[at - 1] + change[at + 1]) / (time[at + 2] - time[at - 1] - (time[at + 1] - time[at]));
        let gone: f64 = change[k..=*back].iter().sum();
        let on = 0.5 * (rate(k) + rate(*back)) * (time[back + 1] - time[k]);
        (away + behind).abs() < OFF * away.abs() && (gone - on).abs() < OFF * away.abs()
    };
    let back = (k + 2..latest).find(|back| bend[back - 1] * BEYOND > away.abs())?;
    let around = quiet(&bend[k - AROUND..k - 1]) && quiet(&bend[back + 1..back + AROUND]);
    (around && quiet(&bend[k + 1..back - 1]) && returns(&back)).then_some(back)
}

#[cfg(test)]
mod tests {
    use super::super::recording::record;
    use super::*;

    /// A tracker that is off by half a metre for a while, and lengths that are not.
    #[test]
    fn what_jumps_away_and_back_was_not_measured() {
        let clean = record(&[], 40.0, 4);
        let mut trial = clean.clone();
        for k in (40..52).chain(150..155) {
            trial.measured[k][0] += 0.8;
            trial.measured[k][1] -= 0.5;
        }
        assert_eq!(remove_bursts(&mut trial), 2 * (12 + 5));
        for (k, (row, of_clean)) in trial.measured.iter().zip(&clean.measured).enumerate() {
            let gone = (40..52).contains(&k) || (150..155).contains(&k);
            assert!((0..2).all(|j| if gone { row[j].is_nan() } else { row[j] == of_clean[j] }), "{k}");
            assert_eq!(row[2..], of_clean[2..]);
        }
    }

    /// Motion itself, one that goes there and back within a second, a step that stays, and counts of a machine that moves and of one that
    /// goes forth and back by one of them: of a real log 78 readings were taken out.
    #[test]
    fn motion_steps_and_counts_are_measured() {
        let clean = record(&[], 40.0, 4);
        let [mut quick, mut stays, mut counts] = [0; 3].map(|_| clean.clone());
        let mut slow = clean.clone();
        slow.measured.iter_mut().enumerate().for_each(|(k, row)| row[4] = 900.0 + 0.01 * (k / 20 % 2) as f64);
        for k in 100..=110 {
            let share = (k - 100) as f64 / 10.0;
            quick.measured[k][0] += 4.0 * (std::f64::consts::PI * share).sin().powi(2);
        }
        stays.measured[200..].iter_mut().for_each(|row| row[0] += 2.0);
        counts.measured.iter_mut().for_each(|row| row[3] = (row[3] / 0.1).round() * 0.1);
        for trial in [clean, quick, stays, counts, slow] {
            let mut kept = trial.clone();
            assert_eq!(remove_bursts(&mut kept), 0);
            assert_eq!(kept.measured, trial.measured);
        }
    }
}
