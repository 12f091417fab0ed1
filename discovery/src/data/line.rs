//! Straight lines through measurements: where a channel is, and how fast it moves.

use std::ops::Range;

use super::Trial;
use super::clean::noise_by_differences;
use super::counts::least_noise;

/// Half of the longest stretch of time that is taken for straight (s).
const LONGEST: f64 = 0.25;
/// Deviation from a straight line, in multiples of the noise, up to which a stretch is taken for straight: of what bends no more than that
/// the middle is off by less.
const STRAIGHT: f64 = 2.0;

/// Value and rate, at row `k`, of a straight line through the numbers of channel `j` in some rows; none where they are too few.
pub(crate) fn line(trial: &Trial, j: usize, rows: Range<usize>, k: usize) -> Option<(f64, f64)> {
    let (mut s, mut st, mut stt, mut sv, mut stv) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for i in rows {
        let v = trial.measured[i][j];
        if v.is_finite() {
            let t = trial.time[i] - trial.time[k];
            s += 1.0;
            st += t;
            stt += t * t;
            sv += v;
            stv += t * v;
        }
    }
    let determinant = s * stt - st * st;
    (s >= 3.0 && determinant > 0.0).then(|| ((stt * sv - st * stv) / determinant, (s * stv - st * sv) / determinant))
}

/// Rows on each side of one that span a quarter of a second of channel `j`, or the three numbers that a straight line takes, which a slow
/// channel has some rows apart.
pub(crate) fn longest(trial: &Trial, j: usize) -> usize {
    (2 * trial.stride(j)).max((LONGEST / trial.interval()).round() as usize)
}

/// Rows on each side of one between which channel `j` moves on a straight line but for its noise, at most a quarter of a second.
///
/// A platform of a small robot swings in a tenth of a second: a line over half of one was 15 mm off where sensors were good to 0.2 mm.
pub(crate) fn straight(trial: &Trial, j: usize) -> usize {
    let least = 2 * trial.stride(j);
    let noise = noise_by_differences(trial, j);
    let noise = noise.max(least_noise(std::slice::from_ref(trial), trial.channels[j], noise));
    let mut half = longest(trial, j);
    while half > least && bend(trial, j, half) > STRAIGHT * noise {
        half = least.max(half / 2);
    }
    half
}

/// Root mean square of what is left of channel `j` by straight lines through stretches of so many rows on each side.
fn bend(trial: &Trial, j: usize, half: usize) -> f64 {
    let (mut sum, mut count) = (0.0, 0);
    for k in (half..trial.len().saturating_sub(half)).step_by(2 * half + 1) {
        let rows = k - half..k + half + 1;
        let Some((value, rate)) = line(trial, j, rows.clone(), k) else { continue };
        let off = rows.map(|i| trial.measured[i][j] - value - rate * (trial.time[i] - trial.time[k]));
        for off in off.filter(|off| off.is_finite()) {
            sum += off * off;
            count += 1;
        }
    }
    (sum / f64::from(count.max(1))).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::recording::{Bench, noise, record_on};

    /// Of a slow motion a quarter of a second, of a fast one less, and there the line is no further off than the noise.
    #[test]
    fn what_is_taken_for_straight_is_so_but_for_the_noise() {
        let mut trial = record_on(&Bench::laboratory(), &[], 10.0, 3);
        let quarter = (0.25 / trial.interval()).round() as usize;
        for (speed, whole) in [(0.5, true), (12.0, false)] {
            let errors = noise(trial.len(), 4);
            for ((row, t), error) in trial.measured.iter_mut().zip(&trial.time).zip(errors) {
                row[0] = 0.05 * (speed * t).sin() + 2e-4 * error;
            }
            let half = straight(&trial, 0);
            assert_eq!(half == quarter, whole, "{speed}: {half}");
            let (value, rate) = line(&trial, 0, 100 - half..101 + half, 100).unwrap();
            let angle = speed * trial.time[100];
            let off = [value - 0.05 * angle.sin(), rate - 0.05 * speed * angle.cos()];
            assert!(off[0].abs() < 6e-4 && off[1].abs() < 0.02, "{speed}: {off:?}");
        }
    }
}
