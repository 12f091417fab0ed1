//! Readings that a device shows again while the machine moves on, or which noise would not show twice: of a sensor that is slower than the
//! log, or of one that has lost sight of what it measures. They were not measured when their row says.

use std::collections::BTreeSet;
use std::f64::consts::PI;
use std::ops::Range;

use statrs::distribution::{DiscreteCDF, Poisson};

use super::Trial;
use super::clean::{noise_by_differences, white_noise};
use super::counts::smallest_step;
use super::device::Device;

/// Steps between different readings by which one must have moved on after it was shown again: by one or two an instrument moves that counts.
const BEYOND_COUNTS: f64 = 3.0;
/// Deviations of its noise by which another device must have moved meanwhile: the machine is not at rest.
const MOVES: f64 = 6.0;
/// Share of the repetitions that may be chance where noise never shows the same twice.
const BY_CHANCE: f64 = 0.1;
/// How likely as many may be by chance: in a recording of nine channels, of which there are some, one is no finding.
const UNLIKELY: f64 = 1e-4;

/// Readings of one device that were shown again, made gaps.
#[derive(Debug, PartialEq)]
pub(crate) struct Held {
    pub(crate) device: Device,
    /// Rows in which some of its channels showed what they had shown before.
    pub(crate) rows: usize,
}

/// Makes gaps of what devices showed again, to the last digit: all their channels while the machine moved on, and all or one of them
/// where the noise of what is measured anew would hardly ever have shown the same.
pub(crate) fn leave_out_held(trial: &mut Trial) -> Vec<Held> {
    let channels = |device: Device| -> Vec<usize> {
        (0..trial.channels.len()).filter(|j| Device::of(trial.channels[*j]) == device).collect()
    };
    let devices = Device::ALL.map(|device| (device, channels(device)));
    let mut held: Vec<BTreeSet<(usize, usize)>> = Vec::new();
    for (_, channels) in &devices {
        let again = Again::new(trial, channels);
        let rows = again.while_moving(trial).into_iter().chain(again.against_noise(trial));
        let mut readings: BTreeSet<_> = rows.flat_map(|k| channels.iter().map(move |j| (k, *j))).collect();
        for j in channels {
            // As of encoders that are asked in turn.
            let again = Again::new(trial, std::slice::from_ref(j));
            readings.extend(again.against_noise(trial).into_iter().map(|k| (k, *j)));
        }
        held.push(readings);
    }
    held.iter().flatten().for_each(|(k, j)| trial.measured[*k][*j] = f64::NAN);
    let counted = devices.iter().zip(held).map(|((device, _), readings)| {
        let rows: BTreeSet<usize> = readings.into_iter().map(|(k, _)| k).collect();
        Held { device: *device, rows: rows.len() }
    });
    counted.filter(|held| held.rows > 0).collect()
}

/// Rows in which some channels show, all of them, what they did in the row before.
struct Again<'a> {
    channels: &'a [usize],
    /// The smallest step of each between different readings.
    steps: Vec<f64>,
    runs: Vec<Range<usize>>,
}

impl<'a> Again<'a> {
    fn new(trial: &Trial, channels: &'a [usize]) -> Self {
        let same = |k: usize| k > 0 && channels.iter().all(|j| trial.measured[k][*j] == trial.measured[k - 1][*j]);
        let mut runs: Vec<Range<usize>> = Vec::new();
        for k in (0..trial.len()).filter(|k| !channels.is_empty() && same(*k)) {
            match runs.last_mut() {
                Some(run) if run.end == k => run.end = k + 1,
                _ => runs.push(k..k + 1),
            }
        }
        Self { channels, steps: channels.iter().map(|j| smallest_step(trial, *j)).collect(), runs }
    }

    fn rows(&self) -> Vec<usize> {
        self.runs.iter().cloned().flatten().collect()
    }

    /// Those after which they had moved on by more than counts do, while others moved by more than their noise; where most are
    /// such, all of them: the machine was too slow there to tell.
    fn while_moving(&self, trial: &Trial) -> Vec<usize> {
        let value = |k: usize, j: usize| trial.measured[k][j];
        let others: Vec<usize> = (0..trial.channels.len()).filter(|j| !self.channels.contains(j)).collect();
        let noise: Vec<f64> = others.iter().map(|j| noise_by_differences(trial, *j)).collect();
        let moving = |run: &&Range<usize>| {
            let (first, end) = (run.start, run.end);
            let moved_on = |(j, step): (&usize, &f64)| (value(end, *j) - value(first, *j)).abs() > BEYOND_COUNTS * step;
            let moves = |(j, noise): (&usize, &f64)| (value(end - 1, *j) - value(first - 1, *j)).abs() > MOVES * noise;
            end < trial.len()
                && self.channels.iter().zip(&self.steps).any(moved_on)
                && others.iter().zip(&noise).any(moves)
        };
        let rows: Vec<usize> = self.runs.iter().filter(moving).cloned().flatten().collect();
        let all = self.rows();
        if rows.len() > all.len() / 2 { all } else { rows }
    }

    /// Those in which others show something new, where chance would have shown far fewer: what shows nothing new at all may be at rest.
    /// Where most are such, all of them.
    fn against_noise(&self, trial: &Trial) -> Vec<usize> {
        let others: Vec<usize> = (0..trial.channels.len()).filter(|j| !self.channels.contains(j)).collect();
        let new = |k: &usize, j: &usize| {
            let [before, now] = [*k - 1, *k].map(|k| trial.measured[k][*j]);
            now.is_finite() && now != before
        };
        let all = self.rows();
        let rows: Vec<usize> = all.iter().copied().filter(|k| others.iter().any(|j| new(k, j))).collect();
        let expected = trial.len() as f64 * self.chance(trial);
        let by_chance =
            rows.is_empty() || expected >= BY_CHANCE * rows.len() as f64 || as_many(expected, rows.len()) > UNLIKELY;
        if by_chance {
            return Vec::new();
        }
        if rows.len() > all.len() / 2 { all } else { rows }
    }

    /// How likely noise shows the same twice in all channels at rest: two readings that differ by white noise fall on one of its steps.
    fn chance(&self, trial: &Trial) -> f64 {
        let again: BTreeSet<usize> = self.rows().into_iter().collect();
        let of_channel = |(j, step): (&usize, &f64)| {
            let known = (0..trial.len()).filter(|k| !again.contains(k) && trial.measured[*k][*j].is_finite());
            let (times, values): (Vec<f64>, Vec<f64>) = known.map(|k| (trial.time[k], trial.measured[k][*j])).unzip();
            (step / (2.0 * PI.sqrt() * white_noise(&times, &values))).min(1.0)
        };
        self.channels.iter().zip(&self.steps).map(of_channel).product()
    }
}

/// How likely at least so many are where so many are expected and one has nothing to do with the other.
fn as_many(expected: f64, count: usize) -> f64 {
    // None is expected where no chance shows the same twice, or nothing is known of it.
    Poisson::new(expected).map_or(0.0, |poisson| poisson.sf(count as u64 - 1))
}

#[cfg(test)]
mod tests {
    use super::super::recording::{noise, record};
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

    /// Encoders that are asked in turn, every fourth row the same one.
    #[test]
    fn sensors_that_are_read_in_turn_have_one_reading_of_each() {
        let clean = record(&[], 80.0, 4);
        let mut held = clean.clone();
        for k in 0..held.len() {
            for j in 3..7 {
                held.measured[k][j] = clean.measured[k.saturating_sub((k + j) % 4)][j];
            }
        }
        let [found] = leave_out_held(&mut held).try_into().expect("one device");
        assert_eq!((found.device, found.rows), (Device::UnstretchedLengths, clean.len() - 1));
        for (k, row) in held.measured.iter().enumerate().skip(4) {
            assert!((3..7).all(|j| if (k + j) % 4 == 0 { row[j] == clean.measured[k][j] } else { row[j].is_nan() }));
        }
    }

    /// Lengths of a machine at rest, each shown twice: noise tells that, and counts that are larger do not.
    #[test]
    fn noise_does_not_show_the_same_twice() {
        for (count, told) in [(1e-9, true), (1e-2, false)] {
            let mut trial = record(&[], 20.0, 4);
            let (start, channels) = (trial.measured[0].clone(), trial.channels.len());
            let read: Vec<f64> = noise(trial.len() * channels, 5).map(|noise| 2e-3 * noise).collect();
            for (k, row) in trial.measured.iter_mut().enumerate() {
                for j in 0..channels {
                    let shown = if j < 3 { k } else { k / 2 * 2 };
                    let step = if j < 3 { 1e-9 } else { count };
                    row[j] = step * ((start[j] + read[shown * channels + j]) / step).round();
                }
            }
            let held = Held { device: Device::UnstretchedLengths, rows: trial.len() / 2 };
            assert_eq!(leave_out_held(&mut trial), if told { vec![held] } else { Vec::new() });
        }
    }

    /// Of 4000 rows one that shows the same again was "a sensor that is slower than the log", where one in 80 000 does so by chance.
    #[test]
    fn one_reading_that_is_the_same_by_chance_is_a_reading() {
        assert!(
            as_many(0.05, 1) > UNLIKELY
                && as_many(0.05, 4) < UNLIKELY
                && as_many(0.0, 1) == 0.0
                && as_many(1e-6, 1) < UNLIKELY
        );
        let mut trial = record(&[], 200.0, 4);
        // Of 2000 rows 0.07 by chance.
        for (row, white) in trial.measured.iter_mut().zip(noise(2000, 5)) {
            row[3] = 900.0 + 1e-6 * (8000.0 * white).round();
        }
        for (rows, held) in [(1, 0), (4, 4)] {
            let mut again = trial.clone();
            (1..=rows).for_each(|row| again.measured[100 * row][3] = again.measured[100 * row - 1][3]);
            let left_out: usize = leave_out_held(&mut again).iter().map(|held| held.rows).sum();
            assert_eq!(left_out, held);
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
