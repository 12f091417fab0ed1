//! Laws in the place of a drift.
//!
//! A sensor that drifts bends to nearly anything, also to what several laws do together of which none alone explains as much.
//! So where a drift was taken up, laws are weighed as well where none is allowed, beside those of the instruments that forget and
//! latent forces: the best alone, and the best pair. Where that explains half of what the drift does, whatever is likelier with the
//! instruments that belong to it stands.

use std::sync::Arc;

use cdpr::effect::EffectSpec;

use crate::filter::error::FitError;
use crate::strategy::candidates::signatures;
use crate::strategy::context::Context;
use crate::strategy::entrance::enter;
use crate::strategy::fitted::Fitted;
use crate::strategy::instruments::{with_instruments_anew, with_other_instruments};
use crate::strategy::pair::best_pair;
use crate::strategy::round::best_alone;
use crate::strategy::rounds::rounds;
use crate::strategy::standing::Standing;
use crate::weigh::criterion::EVIDENCE;
use crate::weigh::signatures::Source;

/// What stands, or, where that has a drift, what laws in the place of that explain if that is more; the model as given then has
/// the same instruments.
pub(crate) fn instead_of_drift(context: &Context<'_>, standing: Standing) -> Result<Standing, FitError> {
    let fitted = &standing.fit;
    if !fitted.train.randomness.drifts() {
        return Ok(standing);
    }
    (context.progress)("weighing laws against a drift", 0.5);
    let Some(steady) = steadied(context, fitted)? else { return Ok(standing) };
    let signatures = signatures(context, &standing, &steady, Source::Catalogue);
    let (fit, trials) = (&steady.train, &context.evidence.train);
    let laws = [
        best_alone(fit, trials, &signatures, context.penalty, context.policy),
        best_pair(fit, trials, &signatures, context.penalty, context.policy),
    ];
    let mut best: Option<(Fitted, Vec<Vec<EffectSpec>>)> = None;
    for (effects, rivals) in laws.into_iter().flatten() {
        let mut model = steady.train.model.clone();
        model.effects.extend(effects.clone());
        let next = context.fit(&model, &steady);
        let Some(next) = context.journal.tried(&effects[0], "in the place of a drift", next) else { continue };
        // A drift stands for what explains as much, and not for what explains a little where nothing else does.
        if steady.score - next.score < context.policy.of_a_drift * (steady.score - fitted.score) {
            continue;
        }
        let next = with_instruments_anew(context, &next)?.unwrap_or(next);
        if best.as_ref().is_none_or(|(best, _)| next.score < best.score) {
            best = Some((next, rivals));
        }
    }
    let Some((next, rivals)) = best else { return Ok(standing) };
    if next.score >= fitted.score - EVIDENCE || !context.likelier(fitted, &next) {
        return Ok(standing);
    }
    let next = context.counted(next);
    let entered = enter(context, &standing, next, rivals, Source::Catalogue, "in the place of a drift")?.entered();
    let Some(mut entered) = entered else { return Ok(standing) };
    if let Some(base) = steadied(context, &context.counted_as(&entered.base, &entered.fit))? {
        entered.base = Arc::new(base);
    }
    rounds(context, entered)
}

/// A fit with those of its instruments that forget.
fn steadied(context: &Context<'_>, fitted: &Fitted) -> Result<Option<Fitted>, FitError> {
    let mut randomness = fitted.train.randomness.clone();
    randomness.memory.retain(|memory| !memory.drift && memory.time <= randomness.time);
    with_other_instruments(context, fitted, randomness.bounded())
}

#[cfg(test)]
mod tests {
    use cdpr::model_file::Model;

    use super::*;
    use crate::data::Trial;
    use crate::data::recording::record;
    use crate::filter::estimate::noise_of_data;
    use crate::model::randomness::Memory;
    use crate::strategy::fitted::Evidence;

    /// Ids that stand where `hidden` acts, x wanders by so much (m), and all unstretched lengths were said to drift.
    fn in_the_place_of_a_drift(hidden: &[EffectSpec], wander: f64) -> Vec<String> {
        let recorded = |seed: u64| -> Trial {
            let mut trial = record(hidden, 40.0, seed);
            let last = trial.time[trial.len() - 1];
            for (row, time) in trial.measured.iter_mut().zip(&trial.time) {
                row[0] += wander * (std::f64::consts::TAU * time / last + seed as f64).sin();
            }
            trial
        };
        let (train, holdout) = (vec![recorded(51), recorded(52)], vec![recorded(53)]);
        let noise = noise_of_data(&train);
        let evidence = Evidence { train, holdout, noise, instruments: None };
        let begun = Context::begin(&evidence, &Model::default(), 0..0, &|_, _| {});
        let (context, base) = begun.expect("a fit");
        let channels = if wander > 0.0 { 0..1 } else { 7..11 };
        let drift = |channel| Memory { channel, deviation: 0.06, time: 40.0, drift: true };
        let mut train = base.train.clone();
        train.randomness =
            channels.map(drift).fold(train.randomness.without_latents(), |all, one| all.with_memory(one));
        train.smooth(&evidence.train).expect("a trajectory");
        let instruments = Some(train.randomness.without_latents());
        let fit = context.finish(train, base.holdout.clone(), instruments);
        let standing = Standing { fit, ..Standing::new(&context, base) };
        let standing = instead_of_drift(&context, standing).expect("a search");
        standing.effects().iter().map(|effect| effect.id.clone()).collect()
    }

    /// All lengths were said to drift, and nothing to be missing.
    #[test]
    fn two_laws_that_a_drift_stood_for_are_found() {
        let gain = EffectSpec::new("winch_force_gain", Some(1), &[0.01]).expect("an effect");
        let drag = EffectSpec::new("platform_linear_drag", None, &[60.0]).expect("an effect");
        let mut found = in_the_place_of_a_drift(&[gain, drag], 0.0);
        found.sort();
        assert_eq!(found, ["platform_linear_drag", "winch_force_gain"]);
    }

    #[test]
    fn a_pose_that_wanders_is_no_law() {
        assert_eq!(in_the_place_of_a_drift(&[], 0.05), Vec::<String>::new());
    }
}
