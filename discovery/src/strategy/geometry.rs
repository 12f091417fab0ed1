//! Whether the geometry is off: whether errors of the survey promise to explain what laws leave.

use cdpr::effect::EffectSpec;

use crate::filter::error::FitError;
use crate::filter::estimate::Fit;
use crate::filter::kalman::Randomness;
use crate::hypothesis::extension::count_in_use;
use crate::hypothesis::parameter::free_parameters;
use crate::hypothesis::survey::{is_zero, survey_errors, with_errors};
use crate::instruments::{self, less_drifts_of_lengths};
use crate::strategy::context::Context;
use crate::strategy::fitted::Fitted;
use crate::strategy::standing::Standing;
use crate::weigh::criterion::EVIDENCE;
use crate::weigh::proposal::{Promise, promises};
use crate::weigh::regression::ladder;

/// What errors of the survey, if they may be added, promise to gain (fall of the criterion) where they explain what stands leaves to
/// forces at random; none where they do not. They are asked for where something is left, or where so many laws stand that these
/// are as much to ask.
pub(crate) fn survey_gains(context: &Context<'_>, standing: &Standing) -> Result<Option<f64>, FitError> {
    if !context.geometry_may_be_off {
        return Ok(None);
    }
    let asked = promised_gain(context, standing);
    let asked = context.journal.or_remark("Whether the geometry is off could not be asked", asked)?;
    Ok(asked.flatten())
}

/// Whether errors of the survey, if they may be added, promise to make the data likelier than drifts of lengths do that the instruments of
/// `better` have: a length that counts from another zero drifts nowhere, but a drift stands for it.
pub(crate) fn instead_of_drifts(context: &Context<'_>, better: &Fitted) -> Result<bool, FitError> {
    if !context.geometry_may_be_off {
        return Ok(false);
    }
    let asked = promise_more_than_drifts(context, better);
    let asked =
        context.journal.or_remark("Whether the geometry is off could not be asked in the place of drifts", asked)?;
    Ok(asked.unwrap_or(false))
}

fn promise_more_than_drifts(context: &Context<'_>, better: &Fitted) -> Result<bool, FitError> {
    let (fit, trials) = (&better.train, &context.evidence.train);
    let errors = survey_errors(&fit.model, trials);
    // Of a model that has been calibrated the zeros are known: what drifts there drifts.
    let zeros_may_be_off = errors.iter().any(is_zero);
    let without = less_drifts_of_lengths(&fit.randomness, trials).filter(|_| zeros_may_be_off);
    let Some(without) = without else { return Ok(false) };
    let mut steady = fit.clone();
    steady.randomness = without;
    steady.smooth(trials)?;
    let Some((promise, _)) = promised(context, &steady, &errors)? else { return Ok(false) };
    let of_errors = promise.price_of_survey(&with_errors(&fit.model, &errors));
    let cost = |fit: &Fit| context.penalty.of_parameters(instruments::parameters(&fit.randomness));
    let (of_drifts, of_steady) = (cost(fit), cost(&steady));
    let with_drifts = fit.minus_two_log_likelihood(trials, &fit.randomness) + of_drifts;
    Ok(promise.minus_two_log_likelihood + of_steady + of_errors < with_drifts - EVIDENCE)
}

fn promised_gain(context: &Context<'_>, standing: &Standing) -> Result<Option<f64>, FitError> {
    let policy = context.policy;
    let explained = standing.fit.gap[0] <= policy.nothing_left && standing.count() < policy.several_laws;
    let trials = &context.evidence.train;
    let fit = &standing.fit.train;
    // What was found may be such an error itself.
    let errors = if explained { Vec::new() } else { survey_errors(&fit.model, trials) };
    if errors.is_empty() {
        return Ok(None);
    }
    let Some((promise, size)) = promised(context, fit, &errors)? else { return Ok(None) };
    let explained = fit.minus_two_log_likelihood(trials, &fit.randomness) - promise.minus_two_log_likelihood;
    let price = context.penalty.of_parameters(errors.iter().map(|error| error.values.len()).sum());
    let needless = saved_by_needless(context, &promise, &fit.model.effects);
    let gain = explained + needless - price;
    let forces = |randomness: &Randomness| randomness.force.hypot(randomness.winch);
    // Where forces at random are as small as they are looked for there are none.
    let none = forces(&fit.randomness.without_latents());
    let instead = forces(&size) <= none.max(policy.survey_leaves * forces(&fit.randomness));
    Ok((gain > EVIDENCE && instead).then_some(gain))
}

/// Whether fewer errors of the survey than laws that are as much to ask would do in the place of all that are free in what stands, each as a
/// law of its own: the length of one cable that counts from another zero spread over the places of all.
pub(crate) fn few_errors_would_do(context: &Context<'_>, standing: &Standing) -> bool {
    let errors = context.free_from..context.given;
    if errors.is_empty() {
        return false;
    }
    let (fit, trials) = (&standing.fit.train, &context.evidence.train);
    let free = free_parameters(&fit.model, context.free_from);
    let promised = promises(fit, trials, &free, std::slice::from_ref(&fit.randomness));
    let Some(promise) = promised.first() else { return false };
    let price = promise.price_of_survey(&fit.model);
    let laws =
        |left: &[usize]| left.iter().map(|at| context.penalty.of(fit.model.effects[*at].values.len())).sum::<f64>();
    let mut left: Vec<usize> = errors.collect();
    let mut gone = Vec::new();
    while left.len() > 1 {
        let loss = |at: &usize| promise.loss_without(&[&gone[..], &[*at]].concat());
        let losses = left.iter().map(loss).enumerate();
        let Some((next, loss)) = losses.min_by(|a, b| a.1.total_cmp(&b.1)) else { break };
        gone.push(left.remove(next));
        if left.len() < context.policy.several_laws && loss + laws(&left) < price - EVIDENCE {
            return true;
        }
    }
    false
}

/// What errors of the survey promise beside a fit, and the forces at random that are best beside them.
fn promised(
    context: &Context<'_>,
    fit: &Fit,
    errors: &[EffectSpec],
) -> Result<Option<(Promise, Randomness)>, FitError> {
    let trials = &context.evidence.train;
    let beside = Fit::new(&with_errors(&fit.model, errors), trials, &fit.randomness, Some(fit))?;
    let free = free_parameters(&beside.model, context.free_from);
    let sizes = ladder(&fit.randomness);
    let promised = promises(&beside, trials, &free, &sizes).into_iter().zip(sizes);
    Ok(promised.min_by(|a, b| a.0.minus_two_log_likelihood.total_cmp(&b.0.minus_two_log_likelihood)))
}

/// What the criterion would fall by without the laws found, `effects` from those given on, that stood for errors of the survey:
/// all that explain less beside these than they cost, the most needless first.
fn saved_by_needless(context: &Context<'_>, promise: &Promise, effects: &[EffectSpec]) -> f64 {
    let price = |at: &usize| context.penalty.of(count_in_use(&effects[*at]).max(1));
    let saved = |gone: &[usize]| gone.iter().map(price).sum::<f64>() - promise.loss_without(gone);
    let (mut gone, mut most): (Vec<usize>, f64) = (Vec::new(), 0.0);
    loop {
        let left = (context.given..effects.len()).filter(|at| !gone.contains(at));
        let next = left.map(|at| [&gone[..], &[at]].concat()).map(|gone| (saved(&gone), gone));
        match next.max_by(|a, b| a.0.total_cmp(&b.0)) {
            Some((saved, with_next)) if saved > most => (most, gone) = (saved, with_next),
            _ => return most,
        }
    }
}

#[cfg(test)]
mod tests {
    use cdpr::model_file::Model;

    use super::*;
    use crate::data::recording::record;
    use crate::filter::estimate::noise_of_data;
    use crate::strategy::fitted::Evidence;
    use crate::strategy::fixture::{begun, effect, evidence, with};
    use crate::strategy::instruments::with_instruments;

    #[test]
    fn errors_of_the_survey_are_asked_for_where_they_would_explain_what_is_left() {
        let anchors: Vec<_> = (1..=4).map(|cable| effect("anchor_offset", Some(cable), &[0.1, -0.05])).collect();
        for (hidden, asked) in [(anchors, true), (Vec::new(), false)] {
            let evidence = evidence(&hidden, 81);
            let (mut context, standing) = begun(&evidence, &Model::default());
            assert!(survey_gains(&context, &standing).expect("a fit").is_none());
            context.geometry_may_be_off = true;
            assert_eq!(survey_gains(&context, &standing).expect("a fit").is_some(), asked);
        }
    }

    /// Lengths that counted from other zeros had drifts of 4 mm each, beside which a bias of four winches came out as five laws.
    #[test]
    fn zeros_that_are_off_are_no_drifts_and_drifts_no_zeros() {
        let promise = |wanders: bool| {
            let recorded = |duration: f64, seed: u64| {
                let mut trial = record(&[], duration, seed);
                trial.channels.drain(..3);
                let last = trial.time[trial.len() - 1];
                for (row, time) in trial.measured.iter_mut().zip(&trial.time) {
                    row.drain(..3);
                    let share = if wanders { (std::f64::consts::PI * time / last).sin() } else { 1.0 };
                    row[0] += 0.3 * share;
                }
                vec![trial]
            };
            let (train, holdout) = (recorded(40.0, 86), recorded(30.0, 87));
            let noise = noise_of_data(&train);
            let evidence = Evidence::new(train, holdout, noise);
            let (mut context, standing) = begun(&evidence, &Model::default());
            let better = with_instruments(&context, &standing.fit, 0.0).expect("a fit").expect("drifts");
            assert!(less_drifts_of_lengths(&better.train.randomness, &evidence.train).is_some());
            assert!(!instead_of_drifts(&context, &better).expect("a fit"));
            context.geometry_may_be_off = true;
            instead_of_drifts(&context, &better).expect("a fit")
        };
        assert_eq!([promise(false), promise(true)], [true, false]);
    }

    /// A length that counts from another zero was spread over the places of all cables, and nobody was told of which.
    #[test]
    fn one_zero_that_is_off_would_do_in_the_place_of_all_errors() {
        let anchors: Vec<_> = (1..=4).map(|cable| effect("anchor_offset", Some(cable), &[0.1, -0.05])).collect();
        let zero = effect("length_sensor_bias", Some(1), &[-0.03]);
        for (hidden, few) in [(vec![zero], true), (anchors, false)] {
            let evidence = evidence(&hidden, 84);
            let errors = survey_errors(&Model::default(), &evidence.train);
            let joint = with_errors(&Model::default(), &errors);
            let off = Context::begin(&evidence, &joint, 0..errors.len(), &|_, _| {});
            let (context, base) = off.expect("a fit");
            assert_eq!(few_errors_would_do(&context, &Standing::new(&context, base)), few);
            let (context, standing) = begun(&evidence, &Model::default());
            assert!(!few_errors_would_do(&context, &standing));
        }
    }

    /// Anchors that are off were explained by a bias of the pose and an error of one anchor: errors of all cost more beside
    /// these than they explain, and less in their place.
    #[test]
    fn a_law_that_stood_for_errors_of_the_survey_pays_for_them() {
        let anchors: Vec<_> = (1..=4).map(|cable| effect("anchor_offset", Some(cable), &[0.1, -0.05])).collect();
        let bias = effect("pose_sensor_bias", None, &[-0.1, 0.05, 0.0]);
        for (hidden, saves) in [(anchors, true), (vec![effect("winch_force_gain", Some(2), &[0.02])], false)] {
            let evidence = evidence(&hidden, 83);
            let (context, standing) = begun(&evidence, &Model::default());
            let law = if saves { bias.clone() } else { hidden[0].clone() };
            let standing = with(&context, standing, vec![(law, Vec::new())]);
            let fit = &standing.fit.train;
            let errors = survey_errors(&fit.model, &evidence.train);
            let (promise, _) = promised(&context, fit, &errors).expect("a fit").expect("a size");
            let saved = saved_by_needless(&context, &promise, &fit.model.effects);
            let price = context.penalty.of(3);
            assert!(if saves { saved > 0.5 * price && saved <= price } else { saved == 0.0 }, "{saved} of {price}");
        }
    }
}
