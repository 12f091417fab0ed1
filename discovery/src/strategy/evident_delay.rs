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
    let entered =
        enter(context, &standing, next, vec![Vec::new()], Source::Catalogue, "kinematics alone show it")?.entered();
    Ok(entered.unwrap_or(standing))
}

#[cfg(test)]
mod tests {
    use cdpr::model_file::Model;

    use super::*;
    use crate::data::Trial;
    use crate::data::recording::{Bench, record_on};
    use crate::filter::estimate::noise_of_data;
    use crate::strategy::fitted::Evidence;
    use crate::strategy::fixture::{begun, names};

    /// A stiff robot, whose pose comes so many samples of 10 ms late.
    #[test]
    fn a_late_pose_is_found_by_kinematics_and_a_pose_in_time_is_not() {
        let bench = Bench::laboratory();
        let recorded = |samples: usize, seed: u64| -> Trial {
            let mut trial = record_on(&bench, &[], 20.0, seed);
            let then = trial.measured.clone();
            for (k, row) in trial.measured.iter_mut().enumerate() {
                row[..3].copy_from_slice(&then[k.saturating_sub(samples)][..3]);
            }
            trial
        };
        for samples in [3, 0] {
            let (train, holdout) = (vec![recorded(samples, 4)], vec![recorded(samples, 5)]);
            let noise = noise_of_data(&train);
            let evidence = Evidence::new(train, holdout, noise);
            let model = Model { parameters: bench.parameters.clone(), ..Model::default() };
            let (context, standing) = begun(&evidence, &model);
            let standing = evident_delay(&context, standing).expect("a fit");
            assert_eq!(names(&context, &standing).len(), usize::from(samples > 0));
            let late = standing.found(&context).first().map_or(0.0, |effect| effect.values[0]);
            assert!((late - 0.01 * samples as f64).abs() < 2e-3, "{late}");
        }
    }
}
