//! A pose that is late, where kinematics alone show it. No trajectory that is known is near that of the model with it.

use crate::filter::error::FitError;
use crate::hypothesis::sensor::pose_delay;
use crate::instruments::clock_offset::clock_offset;
use crate::journal::Outcome;
use crate::strategy::context::Context;
use crate::strategy::entrance::enter;
use crate::strategy::standing::Standing;
use crate::weigh::signatures::Source;

/// What stands with the delay of the pose, where kinematics alone show that.
pub(crate) fn evident_delay(context: &Context<'_>, standing: Standing) -> Result<Standing, FitError> {
    let fitted = &standing.fit;
    let offset = clock_offset(&fitted.train.examined, &context.evidence.train);
    let Some(late) = offset.filter(|late| *late > 0.0) else { return Ok(standing) };
    let effect = pose_delay(late).map_err(|error| FitError::Model(error.to_string()))?;
    let mut delayed = fitted.train.model.clone();
    delayed.effects.push(effect.clone());
    let next = context.refined_by_data(&delayed, fitted);
    let next = context.journal.tried(&effect, "by kinematics, it cannot be fitted", next);
    let Some(next) = next else { return Ok(standing) };
    if !next.helps(fitted, context.policy) {
        let reason = "kinematics show it, but it does not predict the held-out data better";
        context.journal.note(&effect, Outcome::Refused, next.score - fitted.score, reason);
        return Ok(standing);
    }
    let entered = enter(context, &standing, next, vec![Vec::new()], Source::Catalogue, "kinematics alone show it")?;
    Ok(entered.unwrap_or(standing))
}
