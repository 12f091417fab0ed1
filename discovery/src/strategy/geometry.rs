//! Whether the geometry is off: whether errors of the survey promise to explain what laws leave.

use crate::filter::error::FitError;
use crate::filter::estimate::Fit;
use crate::filter::kalman::Randomness;
use crate::hypothesis::parameter::free_parameters;
use crate::hypothesis::survey::{survey_errors, with_errors};
use crate::strategy::context::Context;
use crate::strategy::standing::Standing;
use crate::weigh::criterion::EVIDENCE;
use crate::weigh::refine::promises;
use crate::weigh::regression::ladder;

/// Whether errors of the survey promise to explain what stands leaves to forces at random. They are asked for where something
/// is left, or where so many laws stand that these are as much to ask.
pub(crate) fn is_survey(context: &Context<'_>, standing: &Standing) -> Result<bool, FitError> {
    let policy = context.policy;
    let explained = standing.fit.gap[0] <= policy.nothing_left && standing.accepted.len() < policy.several_laws;
    let trials = &context.evidence.train;
    let fit = &standing.fit.train;
    // What was found may be such an error itself.
    let errors = if explained { Vec::new() } else { survey_errors(&fit.model, trials) };
    if errors.is_empty() {
        return Ok(false);
    }
    let first = fit.model.effects.len();
    let beside = Fit::new(&with_errors(&fit.model, &errors), trials, &fit.randomness, Some(fit))?;
    let free = free_parameters(&beside.model, context.free_from);
    let sizes = ladder(&fit.randomness);
    let promised = promises(&beside, trials, &free, &sizes).into_iter().zip(&sizes);
    let Some((promised, size)) = promised.min_by(|a, b| a.0.total_cmp(&b.0)) else { return Ok(false) };
    let gain = fit.minus_two_log_likelihood(trials, &fit.randomness) - promised;
    let parameters = free.iter().filter(|free| free.effect >= first).count();
    let pays = gain > context.penalty.of_parameters(parameters) + EVIDENCE;
    let forces = |randomness: &Randomness| randomness.force.hypot(randomness.winch);
    // Where forces at random are as small as they are looked for there are none.
    let none = sizes.last().map_or(0.0, forces);
    Ok(pays && forces(size) <= none.max(policy.survey_leaves * forces(&fit.randomness)))
}

#[cfg(test)]
mod tests {
    use cdpr::model_file::Model;

    use super::*;
    use crate::strategy::fixture::{begun, effect, evidence};

    #[test]
    fn errors_of_the_survey_are_asked_for_where_they_would_explain_what_is_left() {
        let anchors: Vec<_> = (1..=4).map(|cable| effect("anchor_offset", Some(cable), &[0.1, -0.05])).collect();
        for (hidden, asked) in [(anchors, true), (Vec::new(), false)] {
            let evidence = evidence(&hidden, 81);
            let (context, standing) = begun(&evidence, &Model::default());
            assert_eq!(is_survey(&context, &standing).expect("a fit"), asked);
        }
    }
}
