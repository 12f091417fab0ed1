//! Where a model's parameters would go if it were linear in them: the normal equations of the innovations, solved.

use std::ops::RangeInclusive;

use cdpr::model_file::Model;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::data::Trial;
use crate::filter::estimate::{Fit, for_trial};
use crate::filter::kalman::Randomness;
use crate::filter::whiten::{Normal, whiten};
use crate::hypothesis::along::Along;
use crate::hypothesis::parameter::{Free, free_values, parameter_step, range_of_change};
use crate::hypothesis::signature::Varied;
use crate::hypothesis::survey::{self, regularise};
use crate::hypothesis::term;
use crate::instruments::clocks::Clocks;
use crate::model::examined::Examined;
use crate::weigh::lost::lost;
use crate::weigh::solve::{solve, solve_within};

/// Models with each free parameter moved by its step, away from its bounds.
pub(crate) fn varied_models(model: &Model, free: &[Free]) -> Vec<Option<Varied>> {
    free.iter().map(|f| varied_by(model, *f, parameter_step(model, *f))).collect()
}

/// The free parameters that can be moved, and models with each of them moved by its step.
pub(crate) fn varied(model: &Model, free: &[Free]) -> (Vec<Free>, Vec<Varied>) {
    free.iter().zip(varied_models(model, free)).filter_map(|(free, varied)| Some((*free, varied?))).unzip()
}

/// A model with a free parameter moved by a step, forth or back as its bounds allow; none where neither is one.
pub(crate) fn varied_by(model: &Model, free: Free, step: f64) -> Option<Varied> {
    [step, -step].into_iter().find_map(|step| {
        let mut varied = model.clone();
        let moved = term::values(&model.effects[free.effect])[free.parameter] + step;
        varied.effects[free.effect] = term::with_value(&model.effects[free.effect], free.parameter, moved);
        varied.effects[free.effect].check().ok()?;
        let effect = varied.effects[free.effect].id.clone();
        Some(Varied { examined: Examined::new(&varied).ok()?, effect, size: step })
    })
}

/// The normal equations of the free parameters at one size of the latent disturbances, solved.
pub(super) struct Proposal {
    pub(super) randomness: Randomness,
    pub(super) normal: Normal,
    pub(super) step: Vec<f64>,
    covariance: DMatrix<f64>,
    /// `-2 log L` that the step, the best within the bounds of the parameters, would reach if the model were linear in them.
    pub(super) promise: f64,
}

impl Proposal {
    /// The same of a share of the step.
    pub(super) fn promise_of(&self, share: f64) -> f64 {
        let part: Vec<f64> = self.step.iter().map(|step| share * step).collect();
        self.promise + self.normal.drop(&self.step) - self.normal.drop(&part)
    }
}

/// Proposals at every size of `sizes`, and the indices of the free parameters that can be varied; the clocks come after them.
pub(super) fn proposals(
    fit: &Fit,
    trials: &[Trial],
    free: &[Free],
    clocks: &Clocks,
    sizes: &[Randomness],
) -> (Vec<Proposal>, Vec<usize>) {
    let varied = varied_models(&fit.model, free);
    let usable: Vec<usize> = (0..free.len()).filter(|i| varied[*i].is_some()).collect();
    let varied: Vec<Varied> = varied.into_iter().flatten().collect();
    let linear = fit.linear(trials);
    let parts: Vec<Vec<Normal>> = (0..trials.len())
        .into_par_iter()
        .map(|t| {
            let forcing = clocks.after(&Along::new(fit, &linear, trials, t), &varied);
            let whitened = sizes.par_iter().map(|randomness| {
                let randomness = for_trial(randomness, &trials[t]);
                whiten(&linear[t], &randomness, &forcing)
            });
            whitened.collect()
        })
        .collect();
    let changes = usable.iter().map(|at| range_of_change(&fit.model, free[*at]));
    let any = f64::NEG_INFINITY..=f64::INFINITY;
    let ranges: Vec<RangeInclusive<f64>> = changes.chain(std::iter::repeat_n(any, clocks.count())).collect();
    let solved = sizes.iter().enumerate().map(|(level, randomness)| {
        let mut normal = Normal::empty(usable.len() + clocks.count());
        parts.iter().for_each(|part| normal.add(&part[level]));
        regularise(&mut normal, &fit.model, usable.iter().map(|at| Some(free[*at])));
        let (free, covariance) = solve(&normal);
        let step = solve_within(&normal, &free, &ranges);
        let promise = normal.minus_two_log_likelihood - normal.drop(&step);
        Proposal { randomness: randomness.clone(), normal, step, covariance, promise }
    });
    (solved.collect(), usable)
}

/// What a model would come to if it were linear in its parameters that are free and its clocks.
pub(crate) struct Promise {
    pub(crate) minus_two_log_likelihood: f64,
    /// What each free parameter that can be varied would be.
    values: Vec<(Free, f64)>,
    /// Of these, in their order.
    covariance: DMatrix<f64>,
}

impl Promise {
    /// What the errors of the survey among the parameters of `model` cost.
    pub(crate) fn price_of_survey(&self, model: &Model) -> f64 {
        let free: Vec<Free> = self.values.iter().map(|(free, _)| *free).collect();
        survey::price(model, &free, &self.covariance)
    }

    /// By how much `-2 log L` would be larger without some of the effects.
    pub(crate) fn loss_without(&self, effects: &[usize]) -> f64 {
        let gone = || (0..self.values.len()).filter(|at| effects.contains(&self.values[*at].0.effect));
        let at: Vec<usize> = gone().collect();
        let values = DVector::from_iterator(at.len(), at.iter().map(|at| self.values[*at].1));
        let covariance = DMatrix::from_fn(at.len(), at.len(), |r, c| self.covariance[(at[r], at[c])]);
        covariance.cholesky().map_or(f64::INFINITY, |cholesky| values.dot(&cholesky.solve(&values)))
    }
}

/// What each of `sizes` promises.
pub(crate) fn promises(fit: &Fit, trials: &[Trial], free: &[Free], sizes: &[Randomness]) -> Vec<Promise> {
    let clocks = Clocks::set(&fit.randomness, trials);
    let (proposals, usable) = proposals(fit, trials, free, &clocks, sizes);
    let of = |proposal: Proposal| {
        let value = |(at, step): (&usize, &f64)| {
            let free = free[*at];
            (free, term::values(&fit.model.effects[free.effect])[free.parameter] + step)
        };
        Promise {
            minus_two_log_likelihood: proposal.promise,
            values: usable.iter().zip(&proposal.step).map(value).collect(),
            covariance: proposal.covariance,
        }
    };
    proposals.into_iter().map(of).collect()
}

/// How certain the sizes of effects are.
pub(crate) struct Certainty {
    /// How many times the variance that the model says the innovations have, one at least.
    pub(crate) spread: f64,
    /// Wald statistic of each effect by white noise of that spread: how far its size is from zero, as a chi-square. None (NaN)
    /// of effects that were not free and of those that have no size.
    pub(crate) wald: Vec<f64>,
    /// The same of how far what recorded forces lose with their error may move the size.
    pub(crate) lost: Vec<f64>,
}

/// How certain the sizes of the effects from `first` on are in a fit, the numbers of terms outside the catalogue among them.
pub(crate) fn certainty(fit: &Fit, trials: &[Trial], first: usize) -> Certainty {
    let free = free_values(&fit.model, first);
    let clocks = Clocks::set(&fit.randomness, trials);
    let (proposals, usable) = proposals(fit, trials, &free, &clocks, std::slice::from_ref(&fit.randomness));
    let (model, Proposal { normal, covariance, .. }) = (&fit.model, &proposals[0]);
    let spread = (normal.total / normal.count.max(1) as f64).max(1.0);
    let values = |at: usize| term::values(&model.effects[free[at].effect])[free[at].parameter];
    let lost = lost(fit, trials, &free);
    let moves = |at: usize| lost.as_ref().map_or(0.0, |lost| lost.moves(free[at]));
    let statistic = |effect: usize, of: &dyn Fn(usize) -> f64| {
        // The parameters that are zero when the effect is absent carry its size; shapes do not.
        let slots: Vec<(usize, f64)> = usable
            .iter()
            .enumerate()
            .filter(|(_, at)| {
                free[**at].effect == effect && !term::is_shape(&model.effects[effect], free[**at].parameter)
            })
            .map(|(slot, at)| (slot, of(*at)))
            .filter(|(slot, _)| covariance[(*slot, *slot)].is_finite())
            .collect();
        if slots.is_empty() {
            return f64::NAN;
        }
        let v = DMatrix::from_fn(slots.len(), slots.len(), |r, c| covariance[(slots[r].0, slots[c].0)]);
        let x = DVector::from_fn(slots.len(), |r, _| slots[r].1);
        v.clone().try_inverse().map_or(f64::NAN, |i| (x.transpose() * i * &x)[(0, 0)]) / spread
    };
    let of_each = |of: &dyn Fn(usize) -> f64| (0..model.effects.len()).map(|effect| statistic(effect, of)).collect();
    Certainty { spread, wald: of_each(&values), lost: of_each(&moves) }
}
