//! Whether the geometry is off: whether errors of the survey promise to explain what laws leave.

use cdpr::effect::EffectSpec;

use crate::filter::error::FitError;
use crate::filter::estimate::Fit;
use crate::filter::kalman::Randomness;
use crate::hypothesis::extension::count_in_use;
use crate::hypothesis::parameter::free_parameters;
use crate::hypothesis::survey::{survey_errors, with_errors};
use crate::strategy::context::Context;
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

fn promised_gain(context: &Context<'_>, standing: &Standing) -> Result<Option<f64>, FitError> {
    let policy = context.policy;
    let explained = standing.fit.gap[0] <= policy.nothing_left && standing.accepted.len() < policy.several_laws;
    let trials = &context.evidence.train;
    let fit = &standing.fit.train;
    // What was found may be such an error itself.
    let errors = if explained { Vec::new() } else { survey_errors(&fit.model, trials) };
    if errors.is_empty() {
        return Ok(None);
    }
    let Some((promise, size)) = promised(context, fit, &errors)? else { return Ok(None) };
    let explained = fit.minus_two_log_likelihood(trials, &fit.randomness) - promise.minus_two_log_likelihood;
    let parameters = errors.iter().map(|error| error.values.len()).sum();
    let needless = saved_by_needless(context, &promise, &fit.model.effects);
    let gain = explained + needless - context.penalty.of_parameters(parameters);
    let forces = |randomness: &Randomness| randomness.force.hypot(randomness.winch);
    // Where forces at random are as small as they are looked for there are none.
    let none = ladder(&fit.randomness).last().map_or(0.0, forces);
    let instead = forces(&size) <= none.max(policy.survey_leaves * forces(&fit.randomness));
    Ok((gain > EVIDENCE && instead).then_some(gain))
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
    use crate::strategy::fixture::{begun, effect, evidence, with};

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
