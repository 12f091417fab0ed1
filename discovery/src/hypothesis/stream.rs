//! Signatures of columns made of variations, formed stretch by stretch along a trajectory: all of them at once would take far
//! more room than the recordings.

use std::ops::Range;

use cdpr::effect::EffectSpec;
use rayon::prelude::*;

use crate::data::Trial;
use crate::filter::error::FitError;
use crate::filter::estimate::{Fit, for_trial};
use crate::filter::kalman::{Randomness, STRETCH};
use crate::filter::whiten::{Acting, Forcing, Normal, Products, Whitening};
use crate::hypothesis::along::Along;
use crate::hypothesis::candidates::Combination;
use crate::hypothesis::ends::Ends;
use crate::hypothesis::signature::{Follower, Single};

/// Variations, and columns as weighted sums of them.
pub(crate) type Columns<'a> = (&'a [EffectSpec], &'a [Combination]);

/// The signatures of columns on their way along a trajectory. A column of which a variation cannot be simulated, or is no
/// plant at all, says nothing.
pub(crate) struct Stream<'a> {
    along: &'a Along<'a>,
    columns: &'a [Combination],
    /// Of a variation that cannot be simulated, why not.
    followers: Vec<Result<Follower, FitError>>,
    /// Of each batch of variations, the shares that they have in columns: column, place in the batch, weight.
    shares: Vec<Vec<(usize, usize, f32)>>,
    next: usize,
}

/// Variations that are followed together.
const BATCH: usize = 32;
/// Rows that are done at a time, so that they stay near.
const ROWS: usize = 16;

impl<'a> Stream<'a> {
    pub(crate) fn new(along: &'a Along<'a>, (variations, columns): Columns<'a>) -> Self {
        let followers = variations.par_iter().map(|spec| Follower::new(along, spec)).collect();
        let mut shares = vec![Vec::new(); variations.len().div_ceil(BATCH)];
        for (c, combination) in columns.iter().enumerate() {
            for (at, weight) in combination {
                shares[at / BATCH].push((c, at % BATCH, *weight as f32));
            }
        }
        Self { along, columns, followers, shares, next: 0 }
    }

    /// The samples that come next.
    pub(crate) fn stretch(&self) -> Option<Range<usize>> {
        let end = self.along.linear.len.min(self.next + STRETCH);
        (self.next < end).then_some(self.next..end)
    }

    /// The signatures over the samples up to `end`.
    pub(crate) fn advance(&mut self, end: usize) -> Forcing {
        let Self { along, columns, followers, shares, next } = self;
        let samples = std::mem::replace(next, end)..end;
        let ends = Ends::new(along, &samples);
        let Single { step, sensor } = Single::nothing(along, &samples);
        let (mut step, mut sensor) = (vec![0.0; step.len() * columns.len()], vec![0.0; sensor.len() * columns.len()]);
        for (followers, shares) in followers.chunks_mut(BATCH).zip(shares) {
            let follow = |follower: &mut Result<Follower, FitError>| {
                let advanced = follower.as_mut().ok()?.advance(along, &samples, &ends);
                advanced.map_err(|error| *follower = Err(error)).ok()
            };
            let singles: Vec<Option<Single>> = followers.par_iter_mut().map(follow).collect();
            let values = |of: fn(&Single) -> &[f32]| -> Vec<&[f32]> {
                singles.iter().map(|single| single.as_ref().map_or(&[][..], of)).collect()
            };
            add_beside(&mut step, columns.len(), &values(|single| &single.step), shares);
            add_beside(&mut sensor, columns.len(), &values(|single| &single.sensor), shares);
        }
        Forcing { first: samples.start, columns: columns.len(), step, sensor }
    }

    /// The columns that say nothing: a variation of them could not be simulated up to here.
    pub(crate) fn silent(&self) -> Vec<usize> {
        let fails = |column: &usize| self.columns[*column].iter().any(|(at, _)| self.followers[*at].is_err());
        (0..self.columns.len()).filter(fails).collect()
    }

    /// The variations that could not be simulated up to here, and why.
    pub(crate) fn failures(self) -> impl Iterator<Item = (usize, FitError)> {
        self.followers.into_iter().enumerate().filter_map(|(at, follower)| Some((at, follower.err()?)))
    }
}

/// Adds variations to columns, which stand beside each other by rows: each share is a column, a variation and its weight in
/// it. A variation without values adds nothing.
fn add_beside(out: &mut [f32], columns: usize, variations: &[&[f32]], shares: &[(usize, usize, f32)]) {
    out.par_chunks_mut(ROWS * columns.max(1)).enumerate().for_each(|(block, target)| {
        for (c, at, weight) in shares {
            let values = variations[*at].iter().skip(block * ROWS);
            for (row, value) in target.chunks_exact_mut(columns).zip(values) {
                row[*c] += value * weight;
            }
        }
    });
}

/// The signatures over a whole trial.
pub(crate) fn forcing(along: &Along<'_>, columns: Columns<'_>) -> Forcing {
    let mut stream = Stream::new(along, columns);
    let mut forcing = stream.advance(along.linear.len);
    for column in stream.silent() {
        for values in [&mut forcing.step, &mut forcing.sensor] {
            values.iter_mut().skip(column).step_by(forcing.columns).for_each(|value| *value = 0.0);
        }
    }
    forcing
}

/// The normal equations of columns along a fit at each of `sizes`; of some entries of the Gram matrix alone where `pairs` are
/// given.
pub(crate) fn normals(
    fit: &Fit,
    trials: &[Trial],
    columns: Columns<'_>,
    sizes: &[Randomness],
    pairs: Option<&[(usize, usize)]>,
) -> Vec<Normal> {
    normals_of_parts(fit, trials, columns, sizes, pairs, 1, |forcing, _| Box::new(forcing))
}

/// As [`normals`] of each column taken apart into `parts` that follow one another, as `apart` does with the signatures over some
/// samples of a trial.
pub(crate) fn normals_of_parts(
    fit: &Fit,
    trials: &[Trial],
    columns: Columns<'_>,
    sizes: &[Randomness],
    pairs: Option<&[(usize, usize)]>,
    parts: usize,
    apart: impl Fn(Forcing, usize) -> Box<dyn Acting> + Sync,
) -> Vec<Normal> {
    let (linear, count) = (fit.linear(trials), columns.1.len() * parts);
    let of_trial = |t: usize| -> Vec<Normal> {
        let along = Along::new(fit, &linear, trials, t);
        let sizes: Vec<Randomness> = sizes.iter().map(|size| for_trial(size, &trials[t])).collect();
        let mut stream = Stream::new(&along, columns);
        let at_size = |size| (Whitening::new(along.linear, size, count), Products::new(count, pairs));
        let mut levels: Vec<(Whitening<'_>, Products<'_>)> = sizes.iter().map(at_size).collect();
        while let Some(samples) = stream.stretch() {
            let acting = apart(stream.advance(samples.end), t);
            levels.par_iter_mut().for_each(|(whitening, products)| {
                whitening.advance(&*acting, samples.end, |_, innovation, e| products.push(e, innovation));
            });
        }
        let own = |column: usize| column * parts..(column + 1) * parts;
        let silent: Vec<usize> = stream.silent().into_iter().flat_map(own).collect();
        let normal = |(whitening, products): (Whitening<'_>, Products<'_>)| {
            let mut normal = products.normal(whitening.minus_two_log_likelihood());
            normal.silence(&silent);
            normal
        };
        levels.into_iter().map(normal).collect()
    };
    let of_trials: Vec<Vec<Normal>> = (0..trials.len()).into_par_iter().map(of_trial).collect();
    let sum = |level: usize| {
        of_trials.iter().fold(Normal::empty(count), |mut sum, one| {
            sum.add(&one[level]);
            sum
        })
    };
    (0..sizes.len()).map(sum).collect()
}

#[cfg(test)]
mod tests {
    use cdpr::effect::EffectSpec;

    use super::*;
    use crate::data::recording::{fitted, record};
    use crate::filter::whiten::whiten;

    fn effect(id: &str, cable: Option<usize>, values: &[f64]) -> EffectSpec {
        EffectSpec::new(id, cable, values).expect("an effect")
    }

    /// Laws of every kind: by rates, with states, late, of sensors, simulated.
    #[test]
    fn stretch_by_stretch_signatures_are_those_of_the_whole() {
        let trials = [record(&[], 60.0, 2)];
        assert!(trials[0].len() > STRETCH);
        let fit = fitted(&[], &trials);
        let variations = [
            effect("platform_linear_drag", None, &[60.0]),
            effect("cable_creep", Some(2), &[3e8, 2.0]),
            effect("winch_lag", None, &[0.2]),
            effect("winch_delay", Some(3), &[0.15]),
            effect("length_sensor_scale", Some(4), &[1e-5]),
            effect("cable_transverse_mode", Some(1), &[0.2]),
        ];
        let single = (0..variations.len()).map(|at| vec![(at, 1.0)]);
        let columns: Vec<Combination> = single.chain([vec![(0, 2.0), (2, -1.0)]]).collect();
        let linear = fit.linear(&trials);
        let along = Along::new(&fit, &linear, &trials, 0);
        let whole =
            whiten(along.linear, &for_trial(&fit.randomness, &trials[0]), &forcing(&along, (&variations, &columns)));
        let sizes = [fit.randomness.clone(), fit.randomness.without_latents()];
        let all = normals(&fit, &trials, (&variations, &columns), &sizes, None);
        assert_eq!((&all[0].gram, &all[0].right), (&whole.gram, &whole.right));
        assert_eq!(all[0].minus_two_log_likelihood, whole.minus_two_log_likelihood);
        assert!((0..columns.len()).all(|c| all[1].gram[c * columns.len() + c] > 0.0), "each says something");
    }

    #[test]
    fn a_column_that_cannot_be_simulated_says_nothing() {
        let trials = [record(&[], 10.0, 3)];
        let fit = fitted(&[], &trials);
        // A mass below zero.
        let mut none = effect("platform_mass", None, &[10.0]);
        none.values[0] = f64::NAN;
        let variations = [effect("platform_linear_drag", None, &[60.0]), none];
        let columns = [vec![(0, 1.0)], vec![(1, 1.0)], vec![(0, 1.0), (1, 1.0)]];
        let normal = &normals(&fit, &trials, (&variations, &columns), std::slice::from_ref(&fit.randomness), None)[0];
        assert!(normal.gram[0] > 0.0);
        assert!(normal.gram[1..].iter().chain(&normal.right[1..]).all(|value| *value == 0.0), "{normal:?}");
    }
}
