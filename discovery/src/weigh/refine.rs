//! Parameters of a model's effects, refined by Gauss-Newton on the innovations.

use std::ops::RangeInclusive;

use cdpr::model_file::Model;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::data::Trial;
use crate::filter::error::FitError;
use crate::filter::estimate::{Fit, Look, for_trial};
use crate::filter::kalman::Randomness;
use crate::filter::whiten::{Normal, whiten};
use crate::hypothesis::along::Along;
use crate::hypothesis::correction::smallest;
use crate::hypothesis::friction::is_friction;
use crate::hypothesis::parameter::{Free, free_parameters, parameter_step, range_of_shape};
use crate::hypothesis::signature::{Varied, sensitivities};
use crate::hypothesis::survey::regularise;
use crate::hypothesis::term;
use crate::instruments::clocks::Clocks;
use crate::model::examined::Examined;
use crate::model::sizes::Sizes;
use crate::weigh::regression::ladder;
use crate::weigh::solve::{solve, solve_within};

/// Fall of `-2 log L` below which a refinement has settled: a third of a standard error.
const SETTLED: f64 = 0.1;
/// Most moves of a trajectory of friction before its parameters are moved.
const FIRST_MOVES: usize = 3;
/// Most further moves of a trajectory that overshoots.
const MOST_MOVES: usize = 8;
/// Factor beyond what is met in practice by which shapes are searched for.
const FROM_TYPICAL: f64 = 10.0;
/// Share of its promise that a proposal must keep to be taken without looking at others.
const KEPT_PROMISE: f64 = 0.5;

/// Models with each free parameter moved by its step, away from its bounds.
pub(crate) fn varied_models(model: &Model, free: &[Free]) -> Vec<Option<Varied>> {
    free.iter()
        .map(|f| {
            let step = parameter_step(model, *f);
            [step, -step].into_iter().find_map(|step| {
                let mut varied = model.clone();
                let moved = term::values(&model.effects[f.effect])[f.parameter] + step;
                varied.effects[f.effect] = term::with_value(&model.effects[f.effect], f.parameter, moved);
                varied.effects[f.effect].check().ok()?;
                let effect = varied.effects[f.effect].id.clone();
                Some(Varied { examined: Examined::new(&varied).ok()?, effect, size: step })
            })
        })
        .collect()
}

/// The normal equations of the free parameters at one size of the latent disturbances, solved.
struct Proposal {
    randomness: Randomness,
    normal: Normal,
    step: Vec<f64>,
    covariance: DMatrix<f64>,
    /// `-2 log L` that the step, the best within the bounds of the parameters, would reach if the model were linear in them.
    promise: f64,
}

impl Proposal {
    /// The same of a share of the step.
    fn promise_of(&self, share: f64) -> f64 {
        let part: Vec<f64> = self.step.iter().map(|step| share * step).collect();
        self.promise + self.normal.drop(&self.step) - self.normal.drop(&part)
    }
}

/// Proposals at every size of `sizes`, and the indices of the free parameters that can be varied; the clocks come after them.
fn proposals(
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
            let forcing = sensitivities(&Along::new(fit, &linear, trials, t), &varied);
            let forcing = clocks.beside(forcing, &linear[t], &trials[t]);
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

/// The `-2 log L` that each of `sizes` would reach if the model were linear in its parameters that are `free` and its clocks.
pub(crate) fn promises(fit: &Fit, trials: &[Trial], free: &[Free], sizes: &[Randomness]) -> Vec<f64> {
    let clocks = Clocks::set(&fit.randomness, trials);
    let (proposals, _) = proposals(fit, trials, free, &clocks, sizes);
    proposals.iter().map(|proposal| proposal.promise).collect()
}

/// Refines the parameters of the effects from `first` on by Gauss-Newton on the innovations, in fewer than `rounds` moves.
///
/// Parameters and the size of the latent disturbances are chosen together: what the parameters will explain, the latents
/// need not carry, and only with small latents are the parameters sharp. The delays of clocks that were found late are
/// among the parameters: set beside a model that lacks an effect, they stand for some of it. Given a `-2 log L` to be
/// `aimed` at, it ends early where that is out of reach.
pub(crate) fn refine(
    fit: &mut Fit,
    trials: &[Trial],
    first: usize,
    rounds: usize,
    aim: Option<f64>,
) -> Result<(), FitError> {
    let free = free_parameters(&fit.model, first);
    refine_free(fit, trials, &free, rounds, aim)
}

/// The same of the parameters that are `free`.
pub(crate) fn refine_free(
    fit: &mut Fit,
    trials: &[Trial],
    free: &[Free],
    rounds: usize,
    aim: Option<f64>,
) -> Result<(), FitError> {
    if !fit.has_settled() && fit.model.effects.iter().any(is_friction) {
        // Else it is no likelihood yet, and better than any to come.
        fit.settle(trials, FIRST_MOVES)?;
    }
    for round in 1..rounds {
        let clocks = Clocks::set(&fit.randomness, trials);
        let (mut proposals, usable) = proposals(fit, trials, free, &clocks, &ladder(&fit.randomness));
        let start = proposals[0].normal.minus_two_log_likelihood;
        // The present size is the fall-back.
        proposals.iter_mut().skip(1).for_each(|p| p.promise += SETTLED);
        proposals.sort_by(|a, b| a.promise.total_cmp(&b.promise));
        if start - proposals[0].promise < SETTLED {
            break;
        }
        let last = proposals.iter().position(|p| p.randomness.same_latents(&fit.randomness)).unwrap_or(0);
        let mut best: Option<(Look, Fit)> = None;
        'tries: for proposal in &proposals[..=last] {
            for damping in [1.0, 0.3, 0.09] {
                // Of a step with other latent forces a part may promise less than there is.
                if start - proposal.promise_of(damping) < SETTLED {
                    break;
                }
                let parameters = Parameters { free, usable: &usable, clocks: &clocks };
                let Some(next) = moved(fit, trials, &parameters, proposal, damping) else { continue };
                let look = next.look(trials, next.randomness.clone());
                let reached = look.value;
                let kept = start - reached >= KEPT_PROMISE * (start - proposal.promise);
                if reached < best.as_ref().map_or(start, |b| b.0.value) {
                    best = Some((look, next));
                }
                // A proposal far off what it promises is not linear enough; one with larger latents is.
                if kept {
                    break 'tries;
                }
                if reached < start || start - proposal.promise < 10.0 * SETTLED {
                    break;
                }
            }
        }
        let Some((look, next)) = best else { break };
        let reached = look.value;
        *fit = next;
        // Smaller latents are among the proposals.
        fit.enlarge_randomness(trials, look);
        let settled = start - reached < SETTLED;
        // The first rounds gain little where the trajectory is still another law's.
        let left = 3.0 * (start - reached) * (rounds - round) as f64;
        let hopeless = round >= 3 && aim.is_some_and(|aim| reached - left > aim);
        if settled || hopeless {
            break;
        }
    }
    Ok(())
}

/// What a proposal moves, in its order.
struct Parameters<'a> {
    free: &'a [Free],
    /// Places in `free` of those that can be varied.
    usable: &'a [usize],
    clocks: &'a Clocks,
}

/// `fit` with its parameters moved along a proposal, on the trajectory that belongs to them.
fn moved(fit: &Fit, trials: &[Trial], parameters: &Parameters, proposal: &Proposal, damping: f64) -> Option<Fit> {
    let steps: Vec<f64> = proposal.step.iter().map(|step| damping * step).collect();
    let (of_effects, of_clocks) = steps.split_at(parameters.usable.len());
    let mut model = fit.model.clone();
    for (at, step) in parameters.usable.iter().zip(of_effects) {
        move_parameter(&mut model, parameters.free[*at], *step);
    }
    model.check().ok()?;
    let mut randomness = proposal.randomness.clone();
    parameters.clocks.move_by(of_clocks, &mut randomness);
    let mut next = Fit::new(&model, trials, &randomness, Some(fit)).ok()?;
    // The trajectory gets better with the parameters, and the signatures with the trajectory.
    next.smooth(trials).ok()?;
    if next.overshoots() && model.effects.iter().any(is_friction) {
        // Else it is no likelihood yet.
        next.settle(trials, MOST_MOVES).ok()?;
    }
    Some(next)
}

/// Moves one parameter within its bounds.
fn move_parameter(model: &mut Model, free: Free, change: f64) {
    let range = range_of_move(model, free);
    let spec = &mut model.effects[free.effect];
    let moved = between(term::values(spec)[free.parameter] + change, *range.start(), *range.end());
    *spec = term::with_value(spec, free.parameter, moved);
}

/// The changes of a parameter that a move may make, nothing among them.
fn range_of_change(model: &Model, free: Free) -> RangeInclusive<f64> {
    let (range, before) = (range_of_move(model, free), term::values(&model.effects[free.effect])[free.parameter]);
    (range.start() - before).min(0.0)..=(range.end() - before).max(0.0)
}

/// Where a move may lead a parameter. Sizes enter the model nearly linearly and move as far as they like; a shape changes at most
/// fourfold, and an angle by half a radian.
fn range_of_move(model: &Model, free: Free) -> RangeInclusive<f64> {
    let sizes = Sizes::of(&model.parameters);
    let spec = &model.effects[free.effect];
    let all = f64::NEG_INFINITY..=f64::INFINITY;
    if spec.expression.is_some() {
        return all;
    }
    let Ok(info) = spec.info() else { return all };
    let parameter = &info.parameters[free.parameter];
    let (typical, before) = (parameter.typical, spec.values[free.parameter]);
    let (mut low, mut high) = (smallest(parameter, &sizes), parameter.max);
    let mut within = |one: f64, other: f64| {
        (low, high) = (between(one.min(other), low, high), between(one.max(other), low, high));
    };
    if parameter.unit == "rad" {
        within(before - 0.5, before + 0.5);
    }
    if parameter.shape {
        if typical.0 > 0.0 {
            within(0.25 * before, 4.0 * before);
        }
        // Shapes stay where the law is itself.
        let (least, most) = range_of_shape(parameter, &sizes, FROM_TYPICAL);
        within(least, most);
    } else if parameter.min == 0.0 {
        within(1e-6 * before.max(0.05 * typical.1), f64::INFINITY);
    }
    low..=high
}

/// The value nearest to `value` between two bounds in any order: those of a parameter below zero come the other way round.
fn between(value: f64, one: f64, other: f64) -> f64 {
    if value.is_nan() { value } else { value.max(one.min(other)).min(one.max(other)) }
}

/// How certain the sizes of effects are.
pub(crate) struct Certainty {
    /// How many times the variance that the model says the innovations have, one at least.
    pub(crate) spread: f64,
    /// Wald statistic of each effect by white noise of that spread: how far its size is from zero, as a chi-square. None (NaN)
    /// of effects that were not free and of those that have no size.
    pub(crate) wald: Vec<f64>,
}

/// How certain the sizes of the effects from `first` on are in a fit.
pub(crate) fn certainty(fit: &Fit, trials: &[Trial], first: usize) -> Certainty {
    let free = free_parameters(&fit.model, first);
    let clocks = Clocks::set(&fit.randomness, trials);
    let (proposals, usable) = proposals(fit, trials, &free, &clocks, std::slice::from_ref(&fit.randomness));
    let (model, Proposal { normal, covariance, .. }) = (&fit.model, &proposals[0]);
    let spread = (normal.total / normal.count.max(1) as f64).max(1.0);
    let wald = (0..model.effects.len())
        .map(|effect| {
            // The parameters that are zero when the effect is absent carry its size; shapes do not.
            let slots: Vec<(usize, f64)> = usable
                .iter()
                .enumerate()
                .filter(|(_, at)| {
                    free[**at].effect == effect && !term::is_shape(&model.effects[effect], free[**at].parameter)
                })
                .map(|(slot, at)| (slot, term::values(&model.effects[effect])[free[*at].parameter]))
                .filter(|(slot, _)| covariance[(*slot, *slot)].is_finite())
                .collect();
            if slots.is_empty() {
                return f64::NAN;
            }
            let v = DMatrix::from_fn(slots.len(), slots.len(), |r, c| covariance[(slots[r].0, slots[c].0)]);
            let x = DVector::from_fn(slots.len(), |r, _| slots[r].1);
            v.clone().try_inverse().map_or(f64::NAN, |i| (x.transpose() * i * &x)[(0, 0)]) / spread
        })
        .collect();
    Certainty { spread, wald }
}

#[cfg(test)]
mod tests {
    use cdpr::effect::EffectSpec;

    use super::*;
    use crate::data::Channel;
    use crate::data::recording::record;
    use crate::filter::estimate::noise_of_data;
    use crate::instruments::latents::first_randomness;
    use crate::verdict::by_block::ByBlock;

    /// Lengths one sample late. Their clock had been set beside a model without the gain, which it stood for in part.
    #[test]
    fn a_clock_set_beside_a_model_that_lacks_an_effect_is_set_again_with_it() {
        let gain = EffectSpec::new("winch_force_gain", Some(2), &[0.01]).unwrap();
        let mut trial = record(std::slice::from_ref(&gain), 60.0, 12);
        let before = trial.measured.clone();
        for (row, earlier) in trial.measured.iter_mut().skip(1).zip(before) {
            row[3..].copy_from_slice(&earlier[3..]);
        }
        let trials = [trial];
        let model = Model { effects: vec![gain], ..Model::default() };
        let noise = noise_of_data(&trials);
        let mut randomness = first_randomness(&model, &trials, &noise).without_latents();
        let clocks = randomness.late.iter_mut().zip(Channel::all(trials[0].cables()));
        clocks
            .filter(|(_, channel)| matches!(channel, Channel::UnstretchedLength(_)))
            .for_each(|(late, _)| *late = 0.12);
        let mut fit = Fit::new(&model, &trials, &randomness, None).unwrap();
        fit.settle(&trials, 10).unwrap();
        refine(&mut fit, &trials, 0, 8, None).unwrap();
        let late = fit.randomness.late.iter().copied().fold(0.0, f64::max);
        assert!((late - trials[0].interval()).abs() < 1e-3, "{late}");
        let (_, error) = ByBlock::new(&fit, &trials, 0).standard_errors(&fit.model)[0];
        let factor = fit.model.effects[0].values[0];
        assert!((factor - 0.01).abs() < 4.0 * error, "{factor} {error}");
    }

    /// Beside jitter the right law left a real drive less likely by 870 than it was without it.
    #[test]
    fn a_refinement_beside_jitter_makes_the_data_likelier_round_by_round() {
        let drag = EffectSpec::new("platform_linear_drag", None, &[60.0]).unwrap();
        let trials = [record(std::slice::from_ref(&drag), 40.0, 15)];
        let (model, noise) = (Model::default(), noise_of_data(&trials));
        let marred = Randomness { jitter: 5e-3, ..first_randomness(&model, &trials, &noise) };
        let mut fit = Fit::new(&model, &trials, &marred, None).unwrap();
        fit.settle(&trials, 10).unwrap();
        fit.fit_randomness(&trials, &noise, true);
        assert!(fit.randomness.jitter > 0.0);
        let weak = EffectSpec::new("platform_linear_drag", None, &[1.0]).unwrap();
        let mut fit = Fit::new(&Model { effects: vec![weak], ..model }, &trials, &fit.randomness, Some(&fit)).unwrap();
        let mut last = fit.minus_two_log_likelihood(&trials, &fit.randomness);
        for _ in 0..6 {
            refine(&mut fit, &trials, 0, 2, None).unwrap();
            let value = fit.minus_two_log_likelihood(&trials, &fit.randomness);
            assert!(value < last + 1.0, "{value} {last} {:?}", fit.randomness);
            last = value;
        }
        assert!((fit.model.effects[0].values[0] / 60.0 - 1.0).abs() < 0.1, "{:?}", fit.model.effects);
    }

    /// The angle by which a drum of 0.3 m turns over 900 m changes by 3 rad where the radius does by a thousandth.
    #[test]
    fn a_drum_is_not_varied_by_a_turn() {
        let drum = EffectSpec::new("winch_drum_eccentricity", Some(1), &[0.01, 0.3, 0.4]).unwrap();
        let model = Model { effects: vec![drum], ..Model::default() };
        let step = parameter_step(&model, Free { effect: 0, parameter: 1 });
        assert!(step > 0.0 && step * 900.0 / (0.3 * 0.3) < 0.1, "{step}");
    }

    /// Where all forces push, so do the limits of a winch's force, and four times such a limit lies below a quarter of it.
    #[test]
    fn a_shape_below_zero_moves_within_its_bounds() {
        let limits = EffectSpec::new("winch_saturation", None, &[-25e3, -15e3]).unwrap();
        let mut model = Model { effects: vec![limits], ..Model::default() };
        move_parameter(&mut model, Free { effect: 0, parameter: 1 }, -100.0);
        let moved = model.effects[0].values[1];
        assert!(moved.is_finite(), "{moved}");
        assert_eq!(between(5.0, 2.0, -1.0), 2.0);
        assert_eq!(between(-5.0, 2.0, -1.0), -1.0);
    }
}
