//! Recorded winch forces without what of their white error can be told from them.
//!
//! A model that is driven by forces with an error moves by that error, and whatever a parameter does in proportion to the
//! force, or to what it moves, looks like it: parameters fitted so are wrong (errors in variables), and where nothing is
//! missing a mass or an inertia seems to be. The forces that are to be expected, given those recorded, are a Wiener filter
//! away (N. Wiener, Extrapolation, Interpolation, and Smoothing of Stationary Time Series, 1949); fitting with them in
//! place of those recorded is regression calibration (R. J. Carroll et al., Measurement Error in Nonlinear Models, 2006).
//! What is left of the error has memory, and no part in the expected forces: the filter estimates it as it does latent
//! forces.

use std::sync::Arc;

use rustfft::num_complex::Complex64;
use rustfft::{Fft, FftPlanner};

use rayon::prelude::*;

use crate::data::Trial;
use crate::data::clean::median;
use crate::filter::estimate::{Fit, for_trial};
use crate::filter::kalman::{Keep, Run, STRETCH, filter};
use crate::filter::path::LinearTrial;
use crate::model::examined::WRENCH;
use crate::model::randomness::{Expected, Randomness};

/// Share of a frequency over which power is averaged on each side of it.
const RELATIVE_WIDTH: f64 = 0.1;
/// Fewest frequencies over which it is averaged on each side: with four winches a scatter of an eighth.
const LEAST_WIDTH: usize = 8;
/// Standard deviations of an average by which it may exceed the power of the error by chance.
const BY_CHANCE: f64 = 3.0;
/// Fewest samples of a recording whose error can be told from it.
const FEWEST: usize = 101;
/// Most that is taken off a sample, in standard deviations of the error: a step of the force is no error.
const MOST: f64 = 3.0;
/// Shortest and longest memory of what is left (sampling intervals): as good as none, and no error that is left.
const SHORTEST: f64 = 0.1;
const LONGEST: f64 = 1e6;
/// Halvings of the ratio between these by which it is found, to a rounding error.
const HALVINGS: usize = 60;

/// Sets of recordings with the winch forces that are to be expected where those recorded have a white error of this standard
/// deviation (N), and what is left of it.
pub(crate) fn expected_forces<const SETS: usize>(sets: [&[Trial]; SETS], error: f64) -> ([Vec<Trial>; SETS], Expected) {
    let errors = sets.map(|trials| of_trials(trials, error));
    let all = || sets.iter().flat_map(|trials| trials.iter());
    let expected = what_is_left(all(), errors.iter().flatten());
    let mut at = 0;
    let sets = sets.map(|trials| {
        let corrected = trials.iter().zip(&errors[at]).map(|(trial, errors)| {
            let mut trial = trial.clone();
            for (i, errors) in errors.of_series.iter().enumerate() {
                let forces = trial.inputs.iter_mut().map(|inputs| &mut inputs.winch_force[i]);
                forces.zip(errors).for_each(|(force, error)| *force -= error);
            }
            trial.taken_off.clone_from(&errors.of_series);
            trial
        });
        at += 1;
        corrected.collect()
    });
    (sets, expected)
}

/// The largest white error (N) of recorded winch forces by which no more than a `share` of what they do, by its variance, was
/// not recorded: more than that, the error would move the machine, and the recordings would not.
pub(crate) fn largest_error(trials: &[Trial], share: f64) -> f64 {
    let of = |trial: &Trial| {
        let series: Vec<Vec<f64>> = (0..trial.cables()).map(|i| recorded(trial, i)).collect();
        let hidden = if trial.len() < FEWEST { 0.0 } else { median(power_of(&Sines::over(trial.len()).of(&series))) };
        (hidden + share / (1.0 - share) * varies(&series)) * trial.len() as f64
    };
    let sum: f64 = trials.par_iter().map(of).sum();
    (sum / trials.iter().map(Trial::len).sum::<usize>().max(1) as f64).sqrt()
}

impl Fit {
    /// Where the recorded forces have an error, with those in their place that are to be expected.
    pub(crate) fn minus_two_log_likelihood(&self, trials: &[Trial], randomness: &Randomness) -> f64 {
        if randomness.white_input() > 0.0 {
            return of_expected(self, trials, randomness);
        }
        self.filter(trials, randomness, Keep::Likelihood).iter().map(|f| f.minus_two_log_likelihood).sum()
    }

    /// By how much `-2 log L` is above what is to be expected where the model is right and the instruments have white noise alone, without
    /// latent forces: white innovations of the variance that the filter gives them. What else instruments have may stand for a law.
    pub(crate) fn beyond_noise(&self, trials: &[Trial]) -> f64 {
        let (linear, without) = (self.linear(trials), self.randomness.with_white_noise().without_latents());
        let of_trial = |(linear, trial): (&LinearTrial, &Trial)| {
            let randomness = for_trial(&without, trial);
            let mut run = Run::new(linear, &randomness);
            let (mut found, mut beyond) = (0.0, 0.0);
            for end in (STRETCH..linear.len + STRETCH).step_by(STRETCH) {
                let filtered = run.advance(end.min(linear.len), Keep::Innovations);
                found = filtered.minus_two_log_likelihood;
                beyond += filtered.whitened.iter().filter(|e| e.is_finite()).map(|e| e * e - 1.0).sum::<f64>();
            }
            found - beyond
        };
        let if_right: f64 = linear.par_iter().zip(trials).map(of_trial).sum();
        (self.minus_two_log_likelihood(trials, &self.randomness) - if_right).max(0.0)
    }
}

/// `-2 log L` of a fit along the recorded forces, with those in their place that are to be expected where they have the white
/// error of `randomness`, to first order.
fn of_expected(fit: &Fit, trials: &[Trial], randomness: &Randomness) -> f64 {
    let (linear, randomness) = along_expected(fit, trials, randomness);
    let of_trial = |(linear, trial): (&LinearTrial, &Trial)| {
        filter(linear, &for_trial(&randomness, trial), Keep::Likelihood).minus_two_log_likelihood
    };
    linear.par_iter().zip(trials).map(of_trial).sum()
}

/// The linear models of a fit along the winch forces that are to be expected where those recorded have the white error of
/// `randomness`, to first order, and what is random there.
pub(super) fn along_expected(fit: &Fit, trials: &[Trial], randomness: &Randomness) -> (Vec<LinearTrial>, Randomness) {
    let errors = of_trials(trials, randomness.input);
    let expected = Some(what_is_left(trials.iter(), errors.iter()));
    let linear = fit.linear(trials);
    let linear = linear.par_iter().zip(&errors).map(|(linear, errors)| without_errors(linear, errors)).collect();
    (linear, Randomness { expected, ..randomness.clone() })
}

/// A linear model with errors taken off the winch forces: its steps end elsewhere.
fn without_errors(linear: &LinearTrial, errors: &Errors) -> LinearTrial {
    let n = linear.states;
    let mut without = linear.clone();
    for (k, defect) in without.defect.chunks_exact_mut(n).enumerate() {
        for (i, errors) in errors.of_series.iter().enumerate() {
            let acts = linear.column(k, n + WRENCH + i);
            defect.iter_mut().zip(acts).for_each(|(slot, by)| *slot -= errors[k] * by);
        }
    }
    without
}

/// The expected errors of each trial.
fn of_trials(trials: &[Trial], error: f64) -> Vec<Errors> {
    let of = |trial: &Trial| {
        let recorded: Vec<Vec<f64>> = (0..trial.cables()).map(|i| recorded(trial, i)).collect();
        expected_errors(&recorded, error)
    };
    trials.par_iter().map(of).collect()
}

/// The recorded forces of winch `i`.
fn recorded(trial: &Trial, i: usize) -> Vec<f64> {
    trial.inputs.iter().map(|inputs| inputs.winch_force[i]).collect()
}

/// What is left, by the share of the error's variance: where the force does most, at low frequency, as dense as the error
/// itself, for nothing of that can be told from it.
fn what_is_left<'a>(trials: impl Iterator<Item = &'a Trial>, errors: impl Iterator<Item = &'a Errors>) -> Expected {
    let (intervals, lengths): (Vec<f64>, Vec<f64>) = trials.map(|trial| (trial.interval(), trial.len() as f64)).unzip();
    let errors: Vec<&Errors> = errors.collect();
    let mean = |of: fn(&Errors) -> f64| {
        let sum: f64 = errors.iter().zip(&lengths).map(|(errors, len)| of(errors) * len).sum();
        sum / lengths.iter().sum::<f64>()
    };
    Expected {
        unrecorded: mean(|errors| errors.unrecorded),
        ..with_memory(mean(|errors| errors.left), median(intervals))
    }
}

/// An error of second order with this share of the variance of a white one, and its density at frequency zero; one time
/// constant is half of the other.
pub(crate) fn with_memory(variance: f64, interval: f64) -> Expected {
    // Its parts: what is left of each after an interval, what the white noise gives it, and their covariances.
    let parts = |time: f64| {
        let time = [time, 0.5 * time];
        let decay = time.map(|time| (-interval / time).exp());
        let gain = [2.0 * (1.0 - decay[0]), decay[1] - 1.0];
        let covariance = |a: usize, b: usize| gain[a] * gain[b] / (1.0 - decay[a] * decay[b]);
        (time, [covariance(0, 0), covariance(1, 1)], covariance(0, 1))
    };
    // The longer it remembers the smaller it is.
    let (mut shortest, mut longest) = (SHORTEST * interval, LONGEST * interval);
    for _ in 0..HALVINGS {
        let time = (shortest * longest).sqrt();
        let (_, variances, covariance) = parts(time);
        let larger = variances.iter().sum::<f64>() + 2.0 * covariance > variance;
        *(if larger { &mut shortest } else { &mut longest }) = time;
    }
    let (time, variances, covariance) = parts(shortest);
    Expected { share: variances.map(f64::sqrt), covariance, time, unrecorded: 0.0 }
}

/// What is to be expected of the white errors of series that were recorded together.
struct Errors {
    of_series: Vec<Vec<f64>>,
    /// Share of the errors' variance that is left.
    left: f64,
    /// See [`Expected::unrecorded`].
    unrecorded: f64,
}

/// Of each frequency the share of the error in its power, averaged over the series and over frequencies near to it.
///
/// A series less the straight line through its ends is a sum of sines that end with it. These reach over all of it: what is
/// slow is kept to as many parts as it has power over the error, which weights of the samples near one cannot do.
fn expected_errors(series: &[Vec<f64>], deviation: f64) -> Errors {
    let len = series.first().map_or(0, Vec::len);
    if len < FEWEST {
        return Errors { of_series: vec![vec![0.0; len]; series.len()], left: 1.0, unrecorded: 0.0 };
    }
    let inner = len - 2;
    let transform = Sines::over(len);
    let sines = transform.of(series);
    let power = power_of(&sines);
    // At half of all frequencies forces hardly move: the error is no larger than what is random there.
    let variance = deviation.powi(2).min(median(power.clone()));
    // Where there is no more than chance makes of the error there is nothing else: the cables' own modes would tell it.
    let share_of = |(k, power): (usize, &f64)| {
        let (first, end) = near(k, inner);
        let scatter = (2.0 / ((end - first) * series.len()) as f64).sqrt();
        match power / variance {
            _ if variance == 0.0 => 0.0,
            ratio if ratio < 1.0 + BY_CHANCE * scatter => 1.0,
            ratio => 1.0 / ratio,
        }
    };
    let share: Vec<f64> = power.iter().enumerate().map(share_of).collect();
    let most = MOST * deviation;
    let of_series = sines.into_iter().map(|mut sines| {
        sines.iter_mut().zip(&share).for_each(|(sine, share)| *sine *= share);
        transform.turn(&mut sines);
        let within = sines.into_iter().map(|error| error.clamp(-most, most));
        std::iter::once(0.0).chain(within).chain(std::iter::once(0.0)).collect()
    });
    let unrecorded = deviation.powi(2) - variance;
    let known = variance / deviation.powi(2) * share.iter().sum::<f64>() / inner as f64;
    Errors { of_series: of_series.collect(), left: 1.0 - known, unrecorded: unrecorded / (unrecorded + varies(series)) }
}

/// What makes sums of sines of series, and series of them.
struct Sines(Arc<dyn Fft<f64>>);

impl Sines {
    /// Over series of so many samples.
    fn over(len: usize) -> Self {
        Self(FftPlanner::new().plan_fft_forward(2 * (len - 1)))
    }

    /// What series less the straight lines through their ends are.
    fn of(&self, series: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let of = |series: &Vec<f64>| {
            let last = series.len() - 1;
            let slope = (series[last] - series[0]) / last as f64;
            let mut sines: Vec<f64> = (1..last).map(|k| series[k] - series[0] - slope * k as f64).collect();
            self.turn(&mut sines);
            sines
        };
        series.iter().map(of).collect()
    }

    /// Forth or back, which is the same but for a factor, whose root makes both keep the power.
    fn turn(&self, values: &mut [f64]) {
        let half = values.len() + 1;
        let mut odd = vec![Complex64::ZERO; 2 * half];
        for (k, value) in values.iter().enumerate() {
            (odd[k + 1].re, odd[2 * half - 1 - k].re) = (*value, -value);
        }
        self.0.process(&mut odd);
        // Twice the sums of sines, below zero.
        let scale = -(0.5 / half as f64).sqrt();
        values.iter_mut().zip(&odd[1..]).for_each(|(value, sum)| *value = scale * sum.im);
    }
}

/// Mean power of series by frequency, from their sines, averaged over frequencies near to each.
fn power_of(sines: &[Vec<f64>]) -> Vec<f64> {
    let of = |k: usize| sines.iter().map(|s| s[k] * s[k]).sum::<f64>() / sines.len() as f64;
    averaged(&(0..sines.first().map_or(0, Vec::len)).map(of).collect::<Vec<f64>>())
}

/// Mean variance of series.
fn varies(series: &[Vec<f64>]) -> f64 {
    let of = |series: &Vec<f64>| {
        let mean = series.iter().sum::<f64>() / series.len() as f64;
        series.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / series.len() as f64
    };
    series.iter().map(of).sum::<f64>() / series.len() as f64
}

/// The frequencies near one of so many, that one among them.
fn near(k: usize, of: usize) -> (usize, usize) {
    let width = LEAST_WIDTH.max((RELATIVE_WIDTH * (k + 1) as f64) as usize);
    (k.saturating_sub(width), (k + width + 1).min(of))
}

/// Power by frequency, each averaged with those near to it.
fn averaged(power: &[f64]) -> Vec<f64> {
    let sums: Vec<f64> = std::iter::once(0.0)
        .chain(power.iter().scan(0.0, |sum, power| {
            *sum += power;
            Some(*sum)
        }))
        .collect();
    let of = |k: usize| {
        let (first, end) = near(k, power.len());
        (sums[end] - sums[first]) / (end - first) as f64
    };
    (0..power.len()).map(of).collect()
}

#[cfg(test)]
mod tests {
    use cdpr::effect::EffectSpec;
    use cdpr::model_file::Model;

    use super::*;
    use crate::data::recording::{noise, record};
    use crate::filter::estimate::noise_of_data;
    use crate::filter::kalman::Randomness;
    use crate::strategy::fitted::Evidence;
    use crate::strategy::fixture::begun;
    use crate::weigh::criterion::EVIDENCE;

    fn smooth(n: usize) -> Vec<f64> {
        (0..n).map(|k| 20e3 + 3e3 * (0.013 * k as f64).sin() + 500.0 * (0.05 * k as f64 + 1.0).sin()).collect()
    }

    fn rms(values: impl Iterator<Item = f64>) -> f64 {
        let (sum, count) = values.fold((0.0, 0.0), |(sum, count), v| (sum + v * v, count + 1.0));
        f64::sqrt(sum / count)
    }

    /// A smooth force, recorded with an error: what is expected of the error, and the error.
    fn recorded_with(error: f64, truth: &[f64]) -> (Errors, Vec<f64>) {
        let errors: Vec<f64> = noise(truth.len(), 3).map(|e| error * e).collect();
        let series: Vec<f64> = truth.iter().zip(&errors).map(|(force, error)| force + error).collect();
        (expected_errors(&[series], 50.0), errors)
    }

    /// As much is left as is said, and of that as much at frequency zero as there is of the error.
    #[test]
    fn most_of_a_white_error_on_a_smooth_force_is_known() {
        let (expected, errors) = recorded_with(50.0, &smooth(20_000));
        let left = rms(expected.of_series[0].iter().zip(&errors).map(|(expected, error)| error - expected));
        assert!(left < 15.0 && (left / (50.0 * expected.left.sqrt()) - 1.0).abs() < 0.25, "{left} {}", expected.left);
        let Expected { share, covariance, time, .. } = with_memory(expected.left, 0.02);
        let variance = share[0].powi(2) + share[1].powi(2) + 2.0 * covariance;
        assert!((variance / expected.left - 1.0).abs() < 1e-9, "{variance} {}", expected.left);
        // The density at frequency zero is the sum of the covariances over all lags: of a pair of parts both ways.
        let sums = time.map(|time| 1.0 / (1.0 - (-0.02 / time).exp()));
        let of = |part: usize| share[part].powi(2) * (2.0 * sums[part] - 1.0) + 2.0 * covariance * (sums[part] - 0.5);
        assert!((of(0) + of(1) - 1.0).abs() < 1e-9, "{}", of(0) + of(1));
    }

    /// White noise of 50 N in the recordings, and a share of all else that nobody recorded.
    #[test]
    fn the_largest_error_is_what_recordings_have_of_it_and_a_share_of_what_they_do() {
        let mut trial = record(&[], 60.0, 7);
        let clean = trial.clone();
        let mut errors = noise(4 * trial.len(), 5);
        for inputs in &mut trial.inputs {
            inputs.winch_force.iter_mut().for_each(|force| *force += 50.0 * errors.next().unwrap_or(0.0));
        }
        let series = |trial: &Trial| (0..4).map(|i| recorded(trial, i)).collect::<Vec<_>>();
        for share in [0.0, 0.1] {
            let hidden = share / (1.0 - share) * varies(&series(&trial));
            let expected = (2500.0 + hidden).sqrt();
            let found = largest_error(std::slice::from_ref(&trial), share);
            assert!((found / expected - 1.0).abs() < 0.1, "{share}: {found} {expected}");
        }
        assert!(largest_error(&[clean], 0.0) < 5.0);
    }

    /// A filter of the samples around one took 0.24 % off a force that moves at 1 rad/s: a mass error where nothing is missing.
    #[test]
    fn a_slow_force_stays_as_large_as_it_is() {
        let slow: Vec<f64> = (0..4000).map(|k| 20e3 + 600.0 * (0.02 * k as f64).sin()).collect();
        let (expected, _) = recorded_with(13.0, &slow);
        let moved = |k: usize| slow[k] - 20e3;
        let taken_off: f64 = (0..4000).map(|k| expected.of_series[0][k] * moved(k)).sum();
        let share = taken_off / (0..4000).map(|k| moved(k).powi(2)).sum::<f64>();
        assert!(share.abs() < 3e-4, "{share}");
    }

    /// Of a force that is white itself only the share of the error is taken off.
    #[test]
    fn a_force_that_shakes_is_kept() {
        let shaken: Vec<f64> = smooth(4000).iter().zip(noise(4000, 4)).map(|(force, e)| force + 200.0 * e).collect();
        let (expected, _) = recorded_with(0.0, &shaken);
        let taken_off = rms(expected.of_series[0].iter().copied());
        assert!((taken_off / (200.0 * (50.0_f64 / 200.0).powi(2)) - 1.0).abs() < 0.3, "{taken_off}");
        assert!(expected.left > 0.9, "{}", expected.left);
        let exact = rms(recorded_with(0.0, &smooth(4000)).0.of_series[0].iter().copied());
        assert!(exact < 10.0, "{exact}");
    }

    /// On a real robot an error of 118 N was found on forces of 30 N, and nothing was said to be missing.
    #[test]
    fn an_error_that_the_forces_have_no_room_for_was_not_recorded() {
        let (room, _) = recorded_with(50.0, &smooth(4000));
        let (none, _) = recorded_with(0.0, &smooth(4000).iter().map(|force| 0.02 * force).collect::<Vec<_>>());
        assert!(room.unrecorded < 1e-3, "{}", room.unrecorded);
        // They vary by 42 N, root mean square.
        assert!(
            (none.unrecorded - 50.0_f64.powi(2) / (50.0_f64.powi(2) + varies(&[smooth(4000)]) * 4e-4)).abs() < 0.01
        );
        assert!(none.unrecorded > 0.5, "{}", none.unrecorded);
    }

    #[test]
    fn a_step_is_no_error() {
        let stepped: Vec<f64> = (0..2000).map(|k| if k < 1000 { 20e3 } else { 26e3 }).collect();
        let (expected, _) = recorded_with(50.0, &stepped);
        assert!(expected.of_series[0].iter().all(|error| error.abs() <= 150.0));
        let (short, _) = recorded_with(50.0, &stepped[..100]);
        assert!(short.left == 1.0 && short.of_series[0].iter().all(|error| *error == 0.0));
    }

    /// A recording with `hidden` effects whose recorded forces have an error of 100 N.
    fn recorded_badly(hidden: &[EffectSpec], seed: u64) -> Trial {
        let mut trial = record(hidden, 60.0, seed);
        let mut errors = noise(4 * trial.len(), 90 + seed);
        for force in trial.inputs.iter_mut().flat_map(|inputs| inputs.winch_force.iter_mut()) {
            *force += 100.0 * errors.next().unwrap_or(0.0);
        }
        trial
    }

    /// Recordings with `hidden` effects, with the forces to be expected in the place of those recorded with an error.
    fn recorded_with_expected_forces(hidden: &[EffectSpec]) -> Evidence {
        let train: Vec<Trial> = [31, 32].map(|seed| recorded_badly(hidden, seed)).into();
        let holdout = vec![recorded_badly(hidden, 33)];
        let noise = noise_of_data(&[&train[..], &holdout[..]].concat());
        let first = crate::instruments::latents::first_randomness(&Model::default(), &train, &noise);
        let evidence = Evidence::new(train, holdout, noise);
        evidence.with_expected_forces(Randomness { input: 100.0, ..first })
    }

    /// How much `effect` explains where `hidden` acts and the forces are those to be expected, and its size.
    fn explained(hidden: &[EffectSpec], effect: &EffectSpec) -> (f64, f64) {
        let evidence = recorded_with_expected_forces(hidden);
        let (context, standing) = begun(&evidence, &Model::default());
        let base = standing.base;
        let model = Model { effects: vec![effect.clone()], ..Model::default() };
        let next = context.fit(&model, &base).expect("a fit");
        (base.score - next.score, next.train.model.effects[0].values[0])
    }

    /// A twentieth of the error was left at high frequency, where a smooth force has nothing: it shook the cables' own modes.
    #[test]
    fn where_there_is_nothing_but_error_nothing_of_it_is_left() {
        let (expected, errors) = recorded_with(50.0, &smooth(4000));
        let left: Vec<f64> =
            expected.of_series[0].iter().zip(&errors).map(|(expected, error)| error - expected).collect();
        let changes = |values: &[f64]| rms(values.windows(2).map(|two| two[1] - two[0]));
        assert!(changes(&left) < 0.05 * changes(&errors), "{} of {}", changes(&left), changes(&errors));
    }

    /// With the forces as recorded an inertia of the drums explained more than chance does, where nothing is hidden.
    #[test]
    fn no_inertia_stands_for_an_error_of_the_forces() {
        let inertia = EffectSpec::new("winch_drum_inertia", None, &[50.0]).expect("an effect");
        let (explained_by_it, size) = explained(&[], &inertia);
        assert!(explained_by_it < EVIDENCE, "{explained_by_it} {size}");
        let drag = EffectSpec::new("platform_linear_drag", None, &[60.0]).expect("an effect");
        let (explained_by_it, size) = explained(std::slice::from_ref(&drag), &drag);
        assert!(explained_by_it > EVIDENCE && (size / 60.0 - 1.0).abs() < 0.15, "{explained_by_it} {size}");
    }
}
