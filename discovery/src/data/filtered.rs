//! Readings that were low-pass filtered before they were written. Their noise ends far below half of the sampling rate, so rows next to each
//! other repeat it: differences find next to none, and whoever takes it for that finds all models wrong. They are taken as often as they
//! tell something new: with a sampling rate of twice the filter's cutoff what is left of the noise is white.

use std::collections::BTreeSet;

use rustfft::FftPlanner;
use rustfft::num_complex::Complex64;

use super::clean::{median, white_noise};
use super::device::Device;
use super::{Channel, Trial};

/// How much more noise differences find in every second reading where a filter left next to none in all of them. Noise that remembers makes
/// it √2 at most (a random walk), noise summed twice √8.
const STEEP: f64 = 2.0;
/// Share of the density below the cutoff that is left in the upper third of the frequencies: of white noise all of it.
const LEFT: f64 = 0.01;
/// How far the density is from its median, as a factor, over the octave below the cutoff. How a platform answers forces falls by 16 in one.
const FLAT: f64 = 4.0;
/// Share of the variance of a channel that its noise is at most: what is larger is motion.
const NOISE: f64 = 0.1;
/// Share by which recordings that were sampled alike differ in their steps, and a stretch is longer than its steps.
const SAME: f64 = 0.05;
/// Bins of the spectrum that the octave below the cutoff has at least.
const FEWEST_BINS: usize = 4;
/// Most readings of a stretch of which a spectrum is taken.
const LONGEST: usize = 512;
/// Least readings of one.
const SHORTEST: usize = 64;
/// Stretches, half over one another, in a recording that has them all of its own.
const STRETCHES: usize = 7;

/// Readings of one device that were filtered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Filtered {
    pub(crate) device: Device,
    /// Above it (Hz) there is no noise.
    pub(crate) cutoff: f64,
}

/// Makes gaps of the readings of each device that repeat the noise of others, where most of its channels are such. Returns what was filtered,
/// and the time (s) from one reading that is left to the next: the same for all, so that they stand in the same rows.
pub(crate) fn thin_filtered(trials: &mut [&mut Trial]) -> (Vec<Filtered>, f64) {
    let of_device = |device: Device| {
        let channels = trials.iter().flat_map(|trial| trial.channels.clone());
        let channels: BTreeSet<Channel> = channels.filter(|channel| Device::of(*channel) == device).collect();
        let series = |channel: Channel| {
            let of_trial = |trial: &&mut Trial| {
                let j = trial.channels.iter().position(|c| *c == channel)?;
                let known = (0..trial.len()).filter(|k| trial.measured[*k][j].is_finite());
                Some(known.map(|k| (trial.time[k], trial.measured[k][j])).unzip())
            };
            trials.iter().filter_map(of_trial).collect::<Vec<Series>>()
        };
        let found: Vec<f64> = channels.iter().filter_map(|channel| cutoff(&series(*channel))).collect();
        // The lowest: readings that are taken too seldom tell a little less, and those taken too often repeat their noise.
        let cutoff = found.iter().copied().fold(f64::INFINITY, f64::min);
        (2 * found.len() > channels.len()).then_some(Filtered { device, cutoff })
    };
    let filtered: Vec<Filtered> = Device::ALL.into_iter().filter_map(of_device).collect();
    let apart = filtered.iter().map(|filtered| 0.5 / filtered.cutoff).fold(0.0, f64::max);
    for Filtered { device, .. } in &filtered {
        for trial in trials.iter_mut() {
            thin(trial, *device, apart);
        }
    }
    (filtered, apart)
}

/// Leaves of a device the readings of one row in each such time (s): of the first in which it has any.
fn thin(trial: &mut Trial, device: Device, apart: f64) {
    let of_device: Vec<usize> =
        (0..trial.channels.len()).filter(|j| Device::of(trial.channels[*j]) == device).collect();
    // Whole rows, so that they are as far from each other throughout where stamps do not jitter.
    let interval = trial.interval();
    let rows = (apart / interval).ceil();
    let mut last = f64::NEG_INFINITY;
    for (time, row) in trial.time.iter().zip(&mut trial.measured) {
        let own = ((time - trial.time[0]) / (rows * interval) + 0.5 / rows).floor();
        if own > last && of_device.iter().any(|j| row[*j].is_finite()) {
            last = own;
        } else {
            of_device.iter().for_each(|j| row[*j] = f64::NAN);
        }
    }
}

/// Times and readings of a channel in one recording.
type Series = (Vec<f64>, Vec<f64>);

/// The frequency (Hz) above which a channel has no noise; none where it has some up to half of the sampling rate, or motion is all it has.
fn cutoff(recordings: &[Series]) -> Option<f64> {
    let (times, _) = recordings.iter().max_by_key(|(times, _)| times.len())?;
    let interval = step(times);
    // Those that were sampled alike.
    let alike = |(times, _): &&Series| (step(times) / interval - 1.0).abs() < SAME;
    let recordings: Vec<&Series> = recordings.iter().filter(alike).collect();
    let by_differences = |stride: usize| -> f64 {
        let of = |(times, values): &&Series| {
            let every = |series: &[f64]| series.iter().copied().step_by(stride).collect::<Vec<f64>>();
            white_noise(&every(times), &every(values))
        };
        recordings.iter().map(of).filter(|noise| noise.is_finite()).sum()
    };
    let [all, every_second] = [1, 2].map(by_differences);
    // Counts at rest have none at all.
    if all == 0.0 || every_second < STEEP * all {
        return None;
    }
    let length = LONGEST.min(2 * times.len() / (STRETCHES + 1)) / 2 * 2;
    if length < SHORTEST {
        return None;
    }
    let density = density(&recordings, length, interval);
    let (last, variance) = (density.len() - 1, density.iter().sum::<f64>());
    let left = median(density[2 * density.len() / 3..].to_vec());
    // The highest octave below a cutoff: what is flat above it may be the digits of a file.
    let is_noise = |top: &usize| {
        let octave = &density[top / 2..=*top];
        let level = median(octave.to_vec());
        octave.iter().all(|density| *density < FLAT * level && FLAT * *density > level)
            && left <= LEFT * level
            && level * *top as f64 <= NOISE * variance
    };
    let top = (2 * FEWEST_BINS..=last).rev().find(is_noise)?;
    let level = median(density[top / 2..=top].to_vec());
    // Where half of it is left.
    let at = (2..=top).rev().find(|k| density[k - 1] + density[*k] > level)?;
    Some(at as f64 / (length as f64 * interval))
}

/// The usual time from one reading to the next (s).
fn step(times: &[f64]) -> f64 {
    median(times.windows(2).map(|pair| pair[1] - pair[0]).collect())
}

/// Density of the variance of a channel over frequency, up to half of the sampling rate, by its readings in stretches of so many
/// that lie half over one another and have none missing, each less a straight line and faded in and out (P. D. Welch, IEEE Transactions on
/// Audio and Electroacoustics 15, 1967).
fn density(recordings: &[&Series], length: usize, interval: f64) -> Vec<f64> {
    let fft = FftPlanner::new().plan_fft_forward(length);
    let window = |k: usize| (std::f64::consts::PI * (k as f64 + 0.5) / length as f64).sin().powi(2);
    let mut sum = vec![0.0; length / 2 + 1];
    for (times, values) in recordings {
        for from in (0..(values.len() + 1).saturating_sub(length)).step_by(length / 2) {
            let span = times[from + length - 1] - times[from];
            if span > (1.0 + SAME) * (length - 1) as f64 * interval {
                continue;
            }
            let stretch = &values[from..from + length];
            let centre = 0.5 * (length as f64 - 1.0);
            let mean = stretch.iter().sum::<f64>() / length as f64;
            let (mut rise, mut run) = (0.0, 0.0);
            for (k, value) in stretch.iter().enumerate() {
                rise += (k as f64 - centre) * (value - mean);
                run += (k as f64 - centre).powi(2);
            }
            let line = |k: usize| mean + rise / run * (k as f64 - centre);
            let faded = |(k, value): (usize, &f64)| Complex64::new(window(k) * (value - line(k)), 0.0);
            let mut waves: Vec<Complex64> = stretch.iter().enumerate().map(faded).collect();
            fft.process(&mut waves);
            sum.iter_mut().zip(&waves).for_each(|(sum, wave)| *sum += wave.norm_sqr());
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::super::recording::{Bench, noise, record, record_on};
    use super::*;

    /// Forth and back through a filter of second order (S. Butterworth 1930) with this cutoff, as a share of half the sampling rate.
    fn forth_and_back(values: &mut [f64], cutoff: f64) {
        let w = (0.5 * std::f64::consts::PI * cutoff).tan();
        let (b, a1) =
            (w * w / (1.0 + w * 2.0_f64.sqrt() + w * w), 2.0 * (w * w - 1.0) / (1.0 + w * 2.0_f64.sqrt() + w * w));
        let a2 = (1.0 - w * 2.0_f64.sqrt() + w * w) / (1.0 + w * 2.0_f64.sqrt() + w * w);
        for _ in 0..2 {
            let start = values[0];
            let (mut x, mut y) = ([start; 2], [start; 2]);
            for value in values.iter_mut() {
                let out = b * (*value + 2.0 * x[0] + x[1]) - a1 * y[0] - a2 * y[1];
                (x, y) = ([*value, x[0]], [out, y[0]]);
                *value = out;
            }
            values.reverse();
        }
    }

    fn filter_columns(trial: &mut Trial, columns: std::ops::Range<usize>, cutoff: f64) {
        for j in columns {
            let mut column: Vec<f64> = trial.measured.iter().map(|row| row[j]).collect();
            forth_and_back(&mut column, cutoff);
            trial.measured.iter_mut().zip(column).for_each(|(row, value)| row[j] = value);
        }
    }

    /// The noise of what is left is as large as it is below the cutoff, and white.
    #[test]
    fn filtered_readings_are_taken_as_often_as_they_tell_something_new() {
        for cutoff in [0.2, 0.3, 0.4] {
            let mut bench = Bench::large();
            bench.noise = [2e-2, 2e-2, 5e-4, 2e-3];
            let mut trial = record_on(&bench, &[], 200.0, 4);
            filter_columns(&mut trial, 0..3, cutoff);
            let before = white_noise_of(&trial, 0);
            // A row that lacks one of its readings is as far from the others as each.
            trial.measured[3][1] = f64::NAN;
            let (found, apart) = thin_filtered(&mut [&mut trial]);
            let [Filtered { device: Device::Pose, cutoff: at }] = found[..] else { panic!("{cutoff}: {found:?}") };
            let every = (apart / trial.interval()).ceil();
            let kept: Vec<usize> = (0..trial.len()).filter(|k| trial.measured[*k][0].is_finite()).collect();
            assert!(kept.iter().enumerate().all(|(at, k)| *k == at * every as usize), "{kept:?}");
            assert!((0.6..1.4).contains(&(at / (5.0 * cutoff))), "{cutoff}: {at} Hz");
            assert!((0.7..1.6).contains(&(every * cutoff)), "{cutoff}: {every}");
            let left = white_noise_of(&trial, 0);
            let kept = 2e-2 * cutoff.sqrt();
            assert!((0.6..1.5).contains(&(left / kept)) && before < 0.3 * kept, "{cutoff}: {before}, {left} of {kept}");
            assert!(trial.measured.iter().all(|row| row[3].is_finite()));
        }
    }

    fn white_noise_of(trial: &Trial, j: usize) -> f64 {
        super::super::clean::noise_by_differences(trial, j)
    }

    /// White noise, noise that remembers, counts, and readings without any noise, of robots that swing slowly and fast.
    #[test]
    fn other_readings_are_left_as_they_are() {
        let large = record(&[], 100.0, 4);
        let laboratory = record_on(&Bench::laboratory(), &[], 20.0, 4);
        let mut bench = Bench::laboratory();
        bench.noise = [0.0; 4];
        let exact = record_on(&bench, &[], 20.0, 4);
        let [mut remembers, mut counts] = [0; 2].map(|_| large.clone());
        let mut error = 0.0;
        for (row, white) in remembers.measured.iter_mut().zip(noise(large.len(), 5)) {
            error = 0.98 * error + 0.01 * white;
            row.iter_mut().for_each(|value| *value += error);
        }
        for row in &mut counts.measured {
            row.iter_mut().for_each(|value| *value = (*value / 0.02).round() * 0.02);
        }
        // Waves as strong at all frequencies up to one, as a machine that follows such a path without noise.
        let mut waves = exact.clone();
        for (k, row) in waves.measured.iter_mut().enumerate() {
            let wave = |w: usize| (TAU * 0.05 * w as f64 * k as f64 * 0.01 + (w * w) as f64).sin();
            row[..3].fill((1..=60).map(wave).sum());
        }
        // A drive that counts, and rests for most of the time.
        let mut rests = counts.clone();
        let still = rests.measured[100].clone();
        rests.measured.iter_mut().skip(100).step_by(2).for_each(|row| row.clone_from(&still));
        rests.measured[100..800].iter_mut().for_each(|row| row.clone_from(&still));
        for (name, trial) in [
            ("white", large),
            ("rests", rests),
            ("laboratory", laboratory),
            ("exact", exact),
            ("remembers", remembers),
            ("counts", counts),
            ("waves", waves),
        ] {
            let mut thinned = trial.clone();
            assert_eq!(thin_filtered(&mut [&mut thinned]).0, [], "{name}");
        }
    }
}
