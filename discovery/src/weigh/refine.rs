//! Parameters of a model's effects, refined by Gauss-Newton on the innovations.

use crate::data::Trial;
use crate::filter::error::FitError;
use crate::filter::estimate::{Fit, Look};
use crate::hypothesis::parameter::{Free, free_parameters, move_parameter};
use crate::instruments::clocks::Clocks;
use crate::weigh::proposal::{Proposal, proposals};
use crate::weigh::regression::ladder;

/// Fall of `-2 log L` below which a refinement has settled: a third of a standard error.
const SETTLED: f64 = 0.1;
/// Moves of a trajectory that a refinement would leave where the model cannot make it: along one that has not settled nothing has a
/// likelihood, and a step seems worse than the start, or a law better than it is.
const MOVES: usize = 10;
/// Share of its promise that a proposal must keep to be taken without looking at others.
const KEPT_PROMISE: f64 = 0.5;

/// Refines the parameters of the effects from `first` on by Gauss-Newton on the innovations, in fewer than `rounds` moves.
///
/// Parameters and the size of the latent disturbances are chosen together: what the parameters will explain, the latents
/// need not carry, and only with small latents are the parameters sharp. The delays of clocks that were found late are
/// among the parameters: set beside a model that lacks an effect, they stand for some of it. Given a `-2 log L` to be
/// `aimed` at, it ends early where that is out of reach. Returned is why it ended where no step that was promised could be taken.
pub(crate) fn refine(
    fit: &mut Fit,
    trials: &[Trial],
    first: usize,
    rounds: usize,
    aim: Option<f64>,
) -> Result<Option<FitError>, FitError> {
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
) -> Result<Option<FitError>, FitError> {
    let mut stuck: Option<FitError> = None;
    // Once is enough: what does not settle by so many moves goes back and forth.
    let mut may_settle = true;
    for round in 1..rounds {
        let settled = !may_settle || fit.has_settled();
        let clocks = Clocks::set(&fit.randomness, trials);
        let (mut proposals, usable) = proposals(fit, trials, free, &clocks, &ladder(&fit.randomness));
        let start = proposals[0].normal.minus_two_log_likelihood;
        // The present size is the fall-back.
        proposals.iter_mut().skip(1).for_each(|p| p.promise += SETTLED);
        proposals.sort_by(|a, b| a.promise.total_cmp(&b.promise));
        let last = proposals.iter().position(|p| p.randomness.same_latents(&fit.randomness)).unwrap_or(0);
        let parameters = Parameters { free, usable: &usable, clocks: &clocks };
        let (best, failed) = step(fit, trials, &parameters, start, &proposals[..=last], settled);
        stuck = failed;
        let Some((look, next)) = best else {
            if settled {
                break;
            }
            fit.settle(trials, MOVES)?;
            may_settle = false;
            continue;
        };
        let reached = look.value;
        *fit = next;
        // Smaller latents are among the proposals.
        fit.enlarge_randomness(trials, look);
        // The first rounds gain little where the trajectory is still another law's.
        let left = 3.0 * (start - reached) * (rounds - round) as f64;
        if round >= 3 && aim.is_some_and(|aim| reached - left > aim) {
            return Ok(None);
        }
        if start - reached < SETTLED {
            break;
        }
    }
    if may_settle && !fit.has_settled() {
        fit.settle(trials, MOVES)?;
    }
    Ok(stuck)
}

/// The best of the steps along `proposals`, which stand in the order of what they promise, that is better than the `start`, with how
/// likely it is; without one, why none could be taken, if that is known. From a start that has not `settled` a second one is not worth
/// trying.
fn step(
    fit: &Fit,
    trials: &[Trial],
    parameters: &Parameters,
    start: f64,
    proposals: &[Proposal],
    settled: bool,
) -> (Option<(Look, Fit)>, Option<FitError>) {
    let mut best: Option<(Look, Fit)> = None;
    let mut failed: Option<FitError> = None;
    'tries: for proposal in proposals {
        for damping in [1.0, 0.3, 0.09] {
            // Of a step with other latent forces a part may promise less than there is.
            if start - proposal.promise_of(damping) < SETTLED {
                break;
            }
            let next = match moved(fit, trials, parameters, proposal, damping) {
                Ok(next) => next,
                Err(error) => {
                    failed = Some(error);
                    continue;
                }
            };
            let look = next.look(trials, next.randomness.clone());
            let reached = look.value;
            let kept = start - reached >= KEPT_PROMISE * (start - proposal.promise);
            if reached < best.as_ref().map_or(start, |b| b.0.value) {
                best = Some((look, next));
            }
            // A proposal far off what it promises is not linear enough; one with larger latents is.
            if kept || !settled {
                break 'tries;
            }
            if reached < start || start - proposal.promise < 10.0 * SETTLED {
                break;
            }
        }
    }
    let failed = failed.filter(|_| best.is_none());
    (best, failed)
}

/// What a proposal moves, in its order.
struct Parameters<'a> {
    free: &'a [Free],
    /// Places in `free` of those that can be varied.
    usable: &'a [usize],
    clocks: &'a Clocks,
}

/// `fit` with its parameters moved along a proposal, on the trajectory that belongs to them.
fn moved(
    fit: &Fit,
    trials: &[Trial],
    parameters: &Parameters,
    proposal: &Proposal,
    damping: f64,
) -> Result<Fit, FitError> {
    let steps: Vec<f64> = proposal.step.iter().map(|step| damping * step).collect();
    let (of_effects, of_clocks) = steps.split_at(parameters.usable.len());
    let mut model = fit.model.clone();
    for (at, step) in parameters.usable.iter().zip(of_effects) {
        move_parameter(&mut model, parameters.free[*at], *step);
    }
    model.check().map_err(|error| FitError::Model(error.to_string()))?;
    let mut randomness = proposal.randomness.clone();
    parameters.clocks.move_by(of_clocks, &mut randomness);
    let mut next = Fit::new(&model, trials, &randomness, Some(fit))?;
    // The trajectory gets better with the parameters, and the signatures with the trajectory.
    next.smooth(trials)?;
    Ok(next)
}

#[cfg(test)]
mod tests {
    use cdpr::effect::EffectSpec;
    use cdpr::model_file::Model;

    use super::*;
    use crate::data::Channel;
    use crate::data::recording::{Bench, fitted_on, record, record_on};
    use crate::filter::estimate::noise_of_data;
    use crate::filter::kalman::Randomness;
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

    /// On a log of a real robot no step of a friction could be taken, and it stayed on the trajectory of the model without it, which it
    /// cannot make: by 5267 better than none, where it is by 2178.
    #[test]
    fn what_was_refined_is_on_a_trajectory_that_the_model_can_make() {
        let friction = EffectSpec::new("winch_coulomb_friction", Some(2), &[300.0, 0.05]).unwrap();
        let trials = [record(&[], 30.0, 12)];
        let randomness = first_randomness(&Model::default(), &trials, &noise_of_data(&trials));
        let mut before = Fit::new(&Model::default(), &trials, &randomness, None).unwrap();
        before.settle(&trials, 10).unwrap();
        let model = Model { effects: vec![friction], ..Model::default() };
        let carried = Fit::new(&model, &trials, &randomness, Some(&before)).unwrap();
        assert!(!carried.has_settled());
        // Nothing is free, as where no step can be taken.
        for free in [free_parameters(&model, 0), Vec::new()] {
            let mut fit = carried.clone();
            refine_free(&mut fit, &trials, &free, 2, None).unwrap();
            assert!(fit.has_settled(), "{free:?}");
        }
    }

    #[test]
    fn why_a_step_cannot_be_taken_is_told() {
        let gain = EffectSpec::new("winch_force_gain", Some(2), &[0.01]).unwrap();
        let trials = [record(std::slice::from_ref(&gain), 10.0, 12)];
        let fit = crate::data::recording::fitted(&[gain], &trials);
        let (free, clocks) = (free_parameters(&fit.model, 0), Clocks::set(&fit.randomness, &trials));
        let (mut proposals, usable) = proposals(&fit, &trials, &free, &clocks, std::slice::from_ref(&fit.randomness));
        let parameters = Parameters { free: &free, usable: &usable, clocks: &clocks };
        assert!(moved(&fit, &trials, &parameters, &proposals[0], 1.0).is_ok());
        proposals[0].step[0] = f64::NAN;
        let Err(error) = moved(&fit, &trials, &parameters, &proposals[0], 1.0) else { panic!("no number") };
        assert!(error.to_string().contains("winch_force_gain"), "{error}");
    }

    /// By slopes at two places of each interval the speed over which this friction turns its sign, a fifth of what a winch gains in a
    /// sample, came out as 1.4 mm/s, 120 of its errors off, on a trajectory that did not settle.
    #[test]
    fn errors_hold_where_friction_turns_its_sign_within_a_sample() {
        let bench = Bench::ringing();
        let friction = |values: &[f64]| EffectSpec::new("winch_coulomb_friction", None, values).expect("an effect");
        let truth = [3.0, 0.002];
        let trials = [record_on(&bench, &[friction(&truth)], 12.0, 8)];
        let mut fit = fitted_on(&bench, &[friction(&[2.0, 0.005])], &trials);
        refine(&mut fit, &trials, 0, 8, None).unwrap();
        assert!(fit.has_settled());
        let errors = ByBlock::new(&fit, &trials, 0).standard_errors(&fit.model);
        for ((value, (_, error)), truth) in fit.model.effects[0].values.iter().zip(errors).zip(truth) {
            assert!((value - truth).abs() < 4.0 * error && error < 0.02 * truth, "{value} +- {error}, {truth}");
        }
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
}
