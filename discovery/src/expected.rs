//! Recorded winch forces without what of their white error can be told from them.
//!
//! A model that is driven by forces with an error moves by that error, and whatever a parameter does in proportion to the
//! force, or to what it moves, looks like it: parameters fitted so are wrong (errors in variables), and where nothing is
//! missing a mass or an inertia seems to be. The forces that are to be expected, given those recorded, are a Wiener filter
//! away (N. Wiener, Extrapolation, Interpolation, and Smoothing of Stationary Time Series, 1949); fitting with them in
//! place of those recorded is regression calibration (R. J. Carroll et al., Measurement Error in Nonlinear Models, 2006).
//! What is left of the error has memory, and no part in the expected forces: the filter estimates it as it does latent
//! forces.

use nalgebra::{DMatrix, DVector};

use crate::data::Trial;
use crate::data::clean::median;
use crate::randomness::Expected;

/// Samples of the recording on each side that a sample's error is told from.
const REACH: usize = 25;
/// Most that is taken off a sample, in standard deviations of the error: a step of the force is no error.
const MOST: f64 = 3.0;
/// Shortest memory of what is left (sampling intervals): as good as none.
const SHORTEST: f64 = 0.1;

/// Sets of recordings with the winch forces that are to be expected where those recorded have a white error of this standard
/// deviation (N), and what is left of it.
pub(crate) fn expected_forces<const SETS: usize>(sets: [&[Trial]; SETS], error: f64) -> ([Vec<Trial>; SETS], Expected) {
    let all = || sets.iter().flat_map(|trials| trials.iter());
    let interval = median(all().map(Trial::interval).collect());
    let series: Vec<Vec<f64>> = all().flat_map(|trial| (0..trial.cables()).map(|i| recorded(trial, i))).collect();
    let filter = Filter::new(&series, error);
    let of = |trial: &Trial| {
        let mut expected = trial.clone();
        for i in 0..trial.cables() {
            for (inputs, error) in expected.inputs.iter_mut().zip(filter.errors(&recorded(trial, i))) {
                inputs.winch_force[i] -= error;
            }
        }
        expected
    };
    (sets.map(|trials| trials.iter().map(of).collect()), what_is_left(filter.left(), interval))
}

/// The recorded forces of winch `i`.
fn recorded(trial: &Trial, i: usize) -> Vec<f64> {
    trial.inputs.iter().map(|inputs| inputs.winch_force[i]).collect()
}

/// What is left, by the share of the error's variance: where the force does most, at low frequency, as dense as the error
/// itself, for nothing of that can be told from it.
fn what_is_left(variance: f64, interval: f64) -> Expected {
    let decay = (1.0 - variance) / (1.0 + variance);
    let time = if decay > 0.0 { -interval / decay.ln() } else { 0.0 };
    Expected { share: variance.sqrt(), time: time.max(SHORTEST * interval) }
}

/// What is to be expected of the white error of a sample, from the samples around it.
///
/// With the covariance `R` of these samples it is `σ² R⁻¹ e` times them, `e` the unit vector of the one in the middle.
struct Filter {
    /// Weights of the samples around one; empty where there are too few to tell.
    weights: Vec<f64>,
    /// Most that is taken off.
    most: f64,
}

impl Filter {
    /// By what the series have in common, so that its scatter is small.
    fn new(series: &[Vec<f64>], deviation: f64) -> Self {
        let none = Self { weights: Vec::new(), most: 0.0 };
        let taps = 2 * REACH + 1;
        let samples: usize = series.iter().map(Vec::len).sum();
        if series.iter().any(|series| series.len() < 2 * taps) {
            return none;
        }
        let covariance: Vec<f64> = (0..taps)
            .map(|lag| {
                let products = series.iter().map(|series| {
                    let mean = mean(series);
                    series.iter().zip(&series[lag..]).map(|(a, b)| (a - mean) * (b - mean)).sum::<f64>()
                });
                // By the pairs that there are: a taper would spread what is slow over all frequencies.
                products.sum::<f64>() / (samples - lag * series.len()) as f64
            })
            .collect();
        let matrix = DMatrix::from_fn(taps, taps, |r, c| covariance[r.abs_diff(c)]);
        let eigen = matrix.symmetric_eigen();
        // At half of all frequencies forces hardly move: the error is no larger than what is random there.
        let variance = deviation.powi(2).min(median(eigen.eigenvalues.iter().copied().collect()));
        if variance.is_nan() || variance <= 0.0 {
            return none;
        }
        let middle: DVector<f64> = eigen.eigenvectors.row(REACH).transpose();
        let weighed = middle.zip_map(&eigen.eigenvalues, |v, value| v * variance / value.max(variance));
        let weights = (&eigen.eigenvectors * weighed).iter().copied().collect();
        Self { weights, most: MOST * deviation }
    }

    /// Share of the error's variance that is left.
    fn left(&self) -> f64 {
        self.weights.get(REACH).map_or(1.0, |weight| (1.0 - weight).clamp(0.0, 1.0))
    }

    /// The expected errors of a series.
    fn errors(&self, series: &[f64]) -> Vec<f64> {
        let (n, mean) = (series.len(), mean(series));
        // Beyond an end the series goes on as its reflection in its last value.
        let at = |k: isize| {
            let last = n as isize - 1;
            match k {
                ..0 => 2.0 * series[0] - series[(-k).min(last) as usize],
                _ if k > last => 2.0 * series[n - 1] - series[(2 * last - k).max(0) as usize],
                _ => series[k as usize],
            }
        };
        let error = |k: usize| {
            let first = k as isize - REACH as isize;
            let taps = self.weights.iter().enumerate();
            let sum: f64 = taps.map(|(tap, weight)| weight * (at(first + tap as isize) - mean)).sum();
            sum.clamp(-self.most, self.most)
        };
        (0..n).map(error).collect()
    }
}

fn mean(series: &[f64]) -> f64 {
    series.iter().sum::<f64>() / series.len() as f64
}

#[cfg(test)]
mod tests {
    use cdpr::effect::EffectSpec;
    use cdpr::model_file::Model;

    use super::*;
    use crate::data::recording::{noise, record};
    use crate::estimate::noise_of_data;
    use crate::fitted::Evidence;
    use crate::kalman::Randomness;
    use crate::search::{EVIDENCE, ROUNDS, Search};

    fn smooth(n: usize) -> Vec<f64> {
        (0..n).map(|k| 20e3 + 3e3 * (0.013 * k as f64).sin() + 500.0 * (0.05 * k as f64 + 1.0).sin()).collect()
    }

    fn rms(values: impl Iterator<Item = f64>) -> f64 {
        let (sum, count) = values.fold((0.0, 0.0), |(sum, count), v| (sum + v * v, count + 1.0));
        f64::sqrt(sum / count)
    }

    /// A smooth force, recorded with an error: the filter of the recording, what it expects, and the error.
    fn recorded_with(error: f64, truth: &[f64]) -> (Filter, Vec<f64>, Vec<f64>) {
        let errors: Vec<f64> = noise(truth.len(), 3).map(|e| error * e).collect();
        let series: Vec<f64> = truth.iter().zip(&errors).map(|(force, error)| force + error).collect();
        let filter = Filter::new(std::slice::from_ref(&series), 50.0);
        let expected = filter.errors(&series);
        (filter, expected, errors)
    }

    /// As much is left as the filter says, and of that as much at frequency zero as there is of the error.
    #[test]
    fn most_of_a_white_error_on_a_smooth_force_is_known() {
        let (filter, expected, errors) = recorded_with(50.0, &smooth(20_000));
        let left = rms(expected.iter().zip(&errors).map(|(expected, error)| error - expected));
        assert!(left < 15.0 && (left / (50.0 * filter.left().sqrt()) - 1.0).abs() < 0.25, "{left} {}", filter.left());
        let Expected { share, time } = what_is_left(filter.left(), 0.02);
        let decay = (-0.02 / time).exp();
        assert!((share * share * (1.0 + decay) / (1.0 - decay) - 1.0).abs() < 1e-9, "{share} {time}");
    }

    /// Of a force that is white itself only the share of the error is taken off.
    #[test]
    fn a_force_that_shakes_is_kept() {
        let shaken: Vec<f64> = smooth(4000).iter().zip(noise(4000, 4)).map(|(force, e)| force + 200.0 * e).collect();
        let (filter, expected, _) = recorded_with(0.0, &shaken);
        let taken_off = rms(expected.into_iter());
        assert!((taken_off / (200.0 * (50.0_f64 / 200.0).powi(2)) - 1.0).abs() < 0.3, "{taken_off}");
        assert!(filter.left() > 0.9, "{}", filter.left());
        let exact = rms(recorded_with(0.0, &smooth(4000)).1.into_iter());
        assert!(exact < 10.0, "{exact}");
    }

    #[test]
    fn a_step_is_no_error() {
        let stepped: Vec<f64> = (0..2000).map(|k| if k < 1000 { 20e3 } else { 26e3 }).collect();
        let (_, expected, _) = recorded_with(50.0, &stepped);
        assert!(expected.iter().all(|error| error.abs() <= 150.0));
        assert!(recorded_with(50.0, &stepped[..100]).1.iter().all(|error| *error == 0.0));
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

    /// How much `effect` explains where `hidden` acts and the forces are those to be expected, and its size.
    fn explained(hidden: &[EffectSpec], effect: &EffectSpec) -> (f64, f64) {
        let train: Vec<Trial> = [31, 32].map(|seed| recorded_badly(hidden, seed)).into();
        let holdout = vec![recorded_badly(hidden, 33)];
        let noise = noise_of_data(&[&train[..], &holdout[..]].concat());
        let first = crate::estimate::first_randomness(&Model::default(), &train, &noise);
        let evidence = Evidence { train, holdout, noise, instruments: None };
        let evidence = evidence.with_expected_forces(Randomness { input: 100.0, ..first });
        let mut search = Search::new(&evidence, 0, &|_, _| {});
        let base = search.base(&Model::default()).expect("a fit");
        let model = Model { effects: vec![effect.clone()], ..Model::default() };
        let next = search.fit(&model, &base, ROUNDS).expect("a fit");
        (base.score - next.score, next.train.model.effects[0].values[0])
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
