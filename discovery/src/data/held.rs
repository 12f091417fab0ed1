//! Readings that a device shows again while the machine moves on: of a sensor that is slower than the log, or of one that has lost sight
//! of what it measures. They were not measured when their row says.

use super::Trial;
use super::clean::noise_by_differences;
use super::device::Device;

/// Steps between different readings by which one must have moved on after it was shown again: by one or two an instrument moves that counts.
const BEYOND_COUNTS: f64 = 3.0;
/// Deviations of its noise by which another device must have moved meanwhile: the machine is not at rest.
const MOVES: f64 = 6.0;

/// Readings of one device that were shown again, made gaps.
#[derive(Debug, PartialEq)]
pub(crate) struct Held {
    pub(crate) device: Device,
    /// Rows in which it showed what it had shown before.
    pub(crate) rows: usize,
}

/// Makes gaps of what devices showed again while the machine moved on: all their channels, to the last digit.
pub(crate) fn leave_out_held(trial: &mut Trial) -> Vec<Held> {
    let noise: Vec<f64> = (0..trial.channels.len()).map(|j| noise_by_differences(trial, j)).collect();
    let channels = |device: Device| -> Vec<usize> {
        (0..trial.channels.len()).filter(|j| Device::of(trial.channels[*j]) == device).collect()
    };
    let devices = Device::ALL.map(|device| (device, channels(device)));
    let held = devices.map(|(device, channels)| (device, held_rows(trial, &channels, &noise), channels));
    let mut out = Vec::new();
    for (device, rows, channels) in held.into_iter().filter(|(_, rows, _)| !rows.is_empty()) {
        for (k, j) in rows.iter().flat_map(|k| channels.iter().map(move |j| (*k, *j))) {
            trial.measured[k][j] = f64::NAN;
        }
        out.push(Held { device, rows: rows.len() });
    }
    out
}

/// Rows in which the channels of a device are what they were in the row before, as far as that is no rest and no counting.
fn held_rows(trial: &Trial, device: &[usize], noise: &[f64]) -> Vec<usize> {
    if device.is_empty() {
        return Vec::new();
    }
    let value = |k: usize, j: usize| trial.measured[k][j];
    let again = |k: usize| device.iter().all(|j| value(k, *j) == value(k - 1, *j));
    let counts: Vec<f64> = device.iter().map(|j| smallest_step(trial, *j)).collect();
    let others: Vec<usize> = (0..trial.channels.len()).filter(|j| !device.contains(j)).collect();
    let (mut out, mut repeated) = (Vec::new(), Vec::new());
    let mut k = 1;
    while k < trial.len() {
        let first = k;
        while k < trial.len() && again(k) {
            k += 1;
        }
        // Shown first before `first`, and again in the rows before `k`.
        repeated.extend(first..k);
        if k > first && k < trial.len() {
            let moved_on = |(j, count): (&usize, &f64)| (value(k, *j) - value(first, *j)).abs() > BEYOND_COUNTS * count;
            let moves = |j: &usize| (value(k - 1, *j) - value(first - 1, *j)).abs() > MOVES * noise[*j];
            if device.iter().zip(&counts).any(moved_on) && others.iter().any(moves) {
                out.extend(first..k);
            }
        }
        k += 1;
    }
    // Where most is such, the rest is as well: the machine was too slow there to tell.
    if out.len() > repeated.len() / 2 { repeated } else { out }
}

/// The smallest step between different readings that follow each other.
fn smallest_step(trial: &Trial, j: usize) -> f64 {
    let steps = trial.measured.windows(2).map(|rows| (rows[1][j] - rows[0][j]).abs());
    steps.filter(|step| *step > 0.0).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::super::recording::record;
    use super::*;

    /// A tracker of 10 Hz in a log of 50 Hz: four of five rows show what the one before did.
    #[test]
    fn a_slow_sensor_has_one_reading_of_each() {
        let clean = record(&[], 20.0, 4);
        let mut held = clean.clone();
        for k in 0..held.len() {
            let shown = clean.measured[k / 5 * 5][..3].to_vec();
            held.measured[k][..3].copy_from_slice(&shown);
        }
        let found = leave_out_held(&mut held);
        let rows = clean.len() - clean.len().div_ceil(5);
        assert_eq!(found, [Held { device: Device::Pose, rows }]);
        for (row, of_clean) in held.measured.iter().zip(&clean.measured) {
            assert_eq!(row[3..], of_clean[3..]);
            assert!(row[0].is_nan() == row[2].is_nan());
        }
        assert!((0..held.len()).step_by(5).all(|k| held.measured[k] == clean.measured[k]));
    }

    /// Counts of which slow motion makes one in some rows, and a machine that stands still.
    #[test]
    fn counts_and_rest_are_readings() {
        let mut counted = record(&[], 20.0, 4);
        for row in &mut counted.measured {
            row[3..].iter_mut().for_each(|length| *length = (*length / 0.05).round() * 0.05);
        }
        let mut resting = record(&[], 20.0, 4);
        for k in 40..140 {
            let still = resting.measured[40].clone();
            resting.measured[k] = still;
        }
        for trial in [counted, resting] {
            let mut kept = trial.clone();
            assert_eq!(leave_out_held(&mut kept), []);
            assert_eq!(kept.measured, trial.measured);
        }
    }

    /// What was a gap stays one, and shows nothing again.
    #[test]
    fn gaps_are_no_readings() {
        let mut trial = record(&[], 20.0, 4);
        trial.measured[30..60].iter_mut().for_each(|row| row[..3].fill(f64::NAN));
        assert_eq!(leave_out_held(&mut trial), []);
    }
}
