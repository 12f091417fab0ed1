//! How far a difference of `-2 log L` may be trusted where what is left is not quite white.

use rayon::prelude::*;

use crate::data::Trial;
use crate::filter::estimate::{Fit, for_trial};
use crate::filter::kalman::{Keep, filter};
use crate::filter::path::LinearTrial;

/// Blocks of time over all trials.
const BLOCKS: usize = 24;

/// How many times the difference of `-2 log L` of two fits scatters more than that of models whose innovations are white.
///
/// With the whitened innovations `ν` of one and `e` the difference to those of the other, the difference is
/// `Σ 2 ν e + e²`. Where the first is right the sums of `ν e` over blocks of time have the variance `Σ e²`; where a model is
/// not quite right, or the noise not quite as it is taken to be, they have more, and the evidence counts for as much less
/// (R. W. M. Wedderburn, Biometrika 61 (1974), 439). At least one.
pub(crate) fn overdispersion(one: &Fit, other: &Fit, trials: &[Trial]) -> f64 {
    let total: usize = trials.iter().map(Trial::len).sum();
    let linear = [one, other].map(|fit| fit.linear(trials));
    let parts: Vec<(f64, f64, usize)> = (0..trials.len())
        .into_par_iter()
        .map(|t| {
            let whitened = |fit: &Fit, linear: &[LinearTrial]| {
                filter(&linear[t], &for_trial(&fit.randomness, &trials[t]), Keep::Innovations).whitened
            };
            let (ours, theirs) = (whitened(one, &linear[0]), whitened(other, &linear[1]));
            let blocks = (BLOCKS * trials[t].len() / total).max(1);
            let rows = trials[t].len().div_ceil(blocks) * trials[t].channels.len();
            let sums = ours.chunks(rows).zip(theirs.chunks(rows)).map(|(ours, theirs)| {
                let both = ours.iter().zip(theirs).filter(|(a, b)| a.is_finite() && b.is_finite());
                both.fold((0.0, 0.0), |(product, square), (a, b)| (product + a * (b - a), square + (b - a).powi(2)))
            });
            sums.fold((0.0, 0.0, 0), |(a, b, n), (product, square)| (a + product * product, b + square, n + 1))
        })
        .collect();
    let (products, squares) = parts.iter().fold((0.0, 0.0), |sum, part| (sum.0 + part.0, sum.1 + part.1));
    if squares > 0.0 { (products / squares).max(1.0) } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use cdpr::effect::EffectSpec;

    use super::*;
    use crate::data::recording::{fitted, noise, record};

    /// Overdispersion of drag against nothing, where the angle wanders by so much (rad) beside its white noise.
    fn where_the_angle_wanders(size: f64) -> f64 {
        let trials = [41, 42].map(|seed| {
            let mut trial = record(&[], 60.0, seed);
            let mut wander = 0.0;
            for (row, step) in trial.measured.iter_mut().zip(noise(trial.time.len(), seed)) {
                wander = 0.95 * wander + 0.31 * size * step;
                row[2] += wander;
            }
            trial
        });
        let drag = EffectSpec::new("platform_rotational_damping", None, &[2e5]).expect("an effect");
        let without_latents = |effects: &[EffectSpec]| {
            let mut fit = fitted(effects, &trials);
            fit.randomness = fit.randomness.without_latents();
            fit.settle(&trials, 10).expect("a trajectory");
            fit
        };
        overdispersion(&without_latents(&[]), &without_latents(&[drag]), &trials)
    }

    #[test]
    fn evidence_counts_for_less_where_what_is_left_has_memory() {
        let (white, coloured) = (where_the_angle_wanders(0.0), where_the_angle_wanders(2e-4));
        assert!(white < 2.0 && coloured > 2.0 * white, "{white} {coloured}");
    }
}
