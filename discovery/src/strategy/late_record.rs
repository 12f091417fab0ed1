//! Recorded forces that are late, where that explains most of what is left, or more than anything else does.

use crate::data::{Recorder, Trial};
use crate::filter::error::FitError;
use crate::filter::estimate::Fit;
use crate::instruments::Sizing;
use crate::instruments::recorder::Late;
use crate::strategy::context::{Context, share};
use crate::strategy::fitted::Fitted;
use crate::strategy::standing::Standing;
use crate::weigh::criterion::EVIDENCE;

/// What stands; where late forces explain most of what it leaves, or more than all `others`, the search begins again with those that acted.
pub(crate) fn late_record(
    context: &Context<'_>,
    standing: Standing,
    others: impl FnOnce(&Fitted, f64) -> Result<bool, FitError>,
) -> Result<Standing, FitError> {
    let late = with_late_record(context, &standing.fit, |gained| others(&standing.fit, gained))?;
    Ok(Standing { recorder: late.map(|late| late.recorder), ..standing })
}

/// How forces are recorded, and the score of what stands with those that acted.
pub(crate) struct LateRecord {
    pub(crate) recorder: Recorder,
    pub(crate) score: f64,
}

/// Forces that were recorded late, if beside `fitted` that explains most of what is left, or no `others` gain as much: friction looks like it
/// to first order, and then gains more.
pub(crate) fn with_late_record(
    context: &Context<'_>,
    fitted: &Fitted,
    others: impl FnOnce(f64) -> Result<bool, FitError>,
) -> Result<Option<LateRecord>, FitError> {
    let evidence = context.evidence;
    let moved = evidence.train.first().map_or(0, |trial| trial.undone.len());
    if moved >= context.policy.most_moves_of_forces || !context.something_left(&fitted.train, &evidence.train) {
        return Ok(None);
    }
    let sizing = Sizing::new(&evidence.train, &evidence.noise, context.penalty);
    let late = sizing.recorded_late(&fitted.train, context.free_from);
    let late = context.journal.or_remark("Recorded forces that are late do not go with the data", late)?.flatten();
    let Some(Late { recorder, trials, fit, moments }) = late else { return Ok(None) };
    let score = context.score(&fit, &trials) + context.penalty.of_parameters(moments);
    if share(fitted.score, &fit, score, &trials) < context.policy.most && others(fitted.score - score)? {
        return Ok(None);
    }
    let held: Vec<Trial> = evidence.holdout.iter().map(|trial| trial.with_forces_before(recorder)).collect();
    let held_out = Fit::new(&fit.model, &held, &fit.randomness, Some(&fitted.holdout)).and_then(|mut held_out| {
        held_out.settle(&held, context.policy.held_out_moves)?;
        Ok(held_out.minus_two_log_likelihood(&held, &fit.randomness))
    });
    let held_out =
        context.journal.or_remark("Recorded forces that are late do not go with the held-out data", held_out)?;
    let helps = held_out.is_some_and(|held_out| held_out < fitted.holdout_score - context.policy.helps * EVIDENCE);
    Ok(helps.then_some(LateRecord { recorder, score }))
}

#[cfg(test)]
mod tests {
    use cdpr::effect::EffectSpec;
    use cdpr::model_file::Model;

    use super::*;
    use crate::data::recording::{noise, record};
    use crate::filter::estimate::noise_of_data;
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
            let standing = late_record(&context, standing, |_, _| Ok(true)).expect("a fit");
            assert_eq!(standing.begins_anew(), late > 0, "{:?} {error}", standing.recorder);
            let expected = late as f64 * evidence.train[0].interval();
            let Recorder { delay, .. } = standing.recorder.unwrap_or_default();
            assert!((delay - expected).abs() <= 0.05 * expected, "{delay} {expected} {error}");
        }
    }
}
