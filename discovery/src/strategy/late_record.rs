//! Recorded forces that are late, where that explains most of what is left.

use std::sync::Arc;

use crate::filter::error::FitError;
use crate::filter::kalman::Randomness;
use crate::instruments::Sizing;
use crate::strategy::context::{Context, share};
use crate::strategy::fitted::{Fitted, Trained};
use crate::strategy::instruments::with_other_instruments;
use crate::strategy::standing::Standing;

/// What stands, and the model as given, where the forces were recorded late, if that explains most of what is left.
pub(crate) fn late_record(context: &Context<'_>, standing: Standing) -> Result<Standing, FitError> {
    let Some(better) = with_late_record(context, &standing.fit)? else { return Ok(standing) };
    let better = context.counted(better);
    if standing.accepted.is_empty() {
        return Ok(standing.with_base(better));
    }
    let recorder = better.train.randomness.recorder;
    let of_base = Randomness { recorder, ..standing.base.train.randomness.clone() };
    let base = with_other_instruments(context, &standing.base, of_base)?;
    let base = base.map_or_else(|| Arc::clone(&standing.base), |base| Arc::new(context.counted_as(&base, &better)));
    Ok(Standing { base, ..standing.changed(better) })
}

/// `fitted` where the forces were recorded late, if that explains most of what is left.
pub(crate) fn with_late_record(context: &Context<'_>, fitted: &Fitted) -> Result<Option<Fitted>, FitError> {
    let evidence = context.evidence;
    if !context.something_left(&fitted.train, &evidence.train) {
        return Ok(None);
    }
    let sizing = Sizing::new(&evidence.train, &evidence.noise, context.penalty);
    let late = sizing.recorded_late(&fitted.train, context.free_from);
    let late = context.journal.or_remark("Recorded forces that are late do not go with the data", late)?.flatten();
    let Some(fit) = late else { return Ok(None) };
    let score = context.score(&fit, &evidence.train);
    if share(fitted.score, &fit, score, &evidence.train) < context.policy.most {
        return Ok(None);
    }
    let better = context.verified(Trained { fit, score }, fitted);
    let better = context.journal.or_remark("Recorded forces that are late do not go with the held-out data", better)?;
    Ok(better.filter(|better| better.helps(fitted, context.policy)))
}

#[cfg(test)]
mod tests {
    use cdpr::effect::EffectSpec;
    use cdpr::model_file::Model;

    use super::*;
    use crate::data::recording::{noise, record};
    use crate::filter::estimate::noise_of_data;
    use crate::model::randomness::Recorder;
    use crate::strategy::fitted::Evidence;
    use crate::strategy::fixture::begun;

    /// Forces two samples late, by themselves, and ones in time where friction is missing, or with an error that is as slow as the motion.
    #[test]
    fn forces_are_late_where_that_explains_most_of_what_is_left() {
        let friction = EffectSpec::new("winch_coulomb_friction", None, &[100.0, 0.01]).expect("an effect");
        let recorded = |hidden: &[EffectSpec], late: usize, error: f64, seed: u64| {
            let mut trial = record(hidden, 40.0, seed);
            let inputs = trial.inputs.clone();
            trial.inputs[late..].copy_from_slice(&inputs[..inputs.len() - late]);
            for winch in 0..4 {
                let mut wander = 0.0;
                for (inputs, white) in trial.inputs.iter_mut().zip(noise(inputs.len(), 10 * seed + winch)) {
                    wander = 0.7 * wander + 0.7 * error * white;
                    inputs.winch_force[winch as usize] += wander;
                }
            }
            trial
        };
        for (hidden, late, error) in [(&[][..], 2, 0.0), (&[friction][..], 0, 0.0), (&[], 0, 30.0)] {
            let [first, second, held] = [31, 32, 33].map(|seed| recorded(hidden, late, error, seed));
            let (train, holdout) = (vec![first, second], vec![held]);
            let noise = noise_of_data(&train);
            let evidence = Evidence { train, holdout, noise, instruments: None };
            let (context, standing) = begun(&evidence, &Model::default());
            let standing = late_record(&context, standing).expect("a fit");
            let Recorder { delay, .. } = standing.fit.train.randomness.recorder;
            let expected = late as f64 * evidence.train[0].interval();
            assert!((delay - expected).abs() <= 0.05 * expected, "{delay} {expected} {error}");
            assert_eq!(standing.base.train.randomness.recorder.delay, delay);
        }
    }
}
