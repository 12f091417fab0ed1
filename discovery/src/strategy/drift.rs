//! Laws in the place of a drift.
//!
//! A sensor that drifts bends to nearly anything, also to what several laws do together of which none alone explains as much, and so
//! does one whose noise is long remembered. So where one was taken up, laws are weighed as well where none is allowed, beside those of
//! the instruments that forget and latent forces: the best alone, and the best pair. Where that promises enough beside what the drift
//! explains, whatever is likelier with the instruments that belong to it stands.

use std::sync::Arc;

use cdpr::effect::EffectSpec;

use crate::data::Channel;
use crate::data::device::Device;
use crate::filter::error::FitError;
use crate::model::randomness::{Memory, Randomness};
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

/// What stands, or, where that has a drift or a noise that outlasts the latent forces, what laws in the place of that explain if that
/// is more; the model as given then has the same instruments.
pub(crate) fn instead_of_drift(context: &Context<'_>, standing: Standing) -> Result<Standing, FitError> {
    let fitted = &standing.fit;
    let randomness = &fitted.train.randomness;
    if !randomness.memory.iter().any(|memory| randomness.outlasts_latents(memory)) {
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
        if steady.score - next.score < context.policy.promising * (steady.score - fitted.score) {
            continue;
        }
        let next = with_instruments_anew(context, &next)?.unwrap_or(next);
        if best.as_ref().is_none_or(|(best, _)| next.score < best.score) {
            best = Some((next, rivals));
        }
    }
    let Some((next, rivals)) = best else { return Ok(standing) };
    if next.score >= fitted.score - EVIDENCE || !context.likelier(fitted, &next) {
        if next.score < fitted.score + EVIDENCE {
            let laws = &next.train.model.effects[fitted.train.model.effects.len()..];
            context.journal.as_likely_as_drifts(laws, next.score - fitted.score);
        }
        return Ok(standing);
    }
    let next = context.counted(next);
    // Free runs are compared by what the instruments of both are without the drift.
    let counted = Standing { fit: context.counted_as(&standing.fit, &next), ..standing.clone() };
    let entered = enter(context, &counted, next, rivals, Source::Catalogue, "in the place of a drift")?.entered();
    let Some(mut entered) = entered else { return Ok(standing) };
    if let Some(base) = steadied(context, &context.counted_as(&entered.base, &entered.fit))? {
        entered.base = Arc::new(base);
    }
    rounds(context, entered)
}

/// A fit with those of its instruments that forget.
fn steadied(context: &Context<'_>, fitted: &Fitted) -> Result<Option<Fitted>, FitError> {
    let randomness = forgetting(&fitted.train.randomness, fitted.train.model.parameters.cables());
    with_other_instruments(context, fitted, randomness)
}

/// `randomness` of a robot with so many cables, with those memories alone that latent forces outlast. Channels of a device remember alike:
/// where the noise of one outlasts the latent forces and that of another does not, it may have taken a drift in, and gets the other's.
fn forgetting(randomness: &Randomness, cables: usize) -> Randomness {
    let all = Channel::all(cables);
    let (outlasting, mut memory): (Vec<Memory>, Vec<Memory>) =
        randomness.memory.iter().partition(|memory| randomness.outlasts_latents(memory));
    let of_its_device = |slow: &Memory| {
        let same = |other: &&Memory| Device::of(all[other.channel]) == Device::of(all[slow.channel]);
        memory.iter().find(same).map(|other| Memory { channel: slow.channel, ..*other })
    };
    let instead: Vec<Memory> = outlasting.iter().filter(|slow| !slow.drift).filter_map(of_its_device).collect();
    memory.extend(instead);
    memory.sort_by_key(|memory| memory.channel);
    Randomness { memory, ..randomness.clone() }.bounded()
}

#[cfg(test)]
mod tests {
    use cdpr::model_file::Model;

    use super::*;
    use crate::data::Trial;
    use crate::data::recording::record;
    use crate::filter::estimate::noise_of_data;
    use crate::strategy::fitted::Evidence;

    const DRIFT: Memory = Memory { channel: 0, deviation: 0.06, time: 40.0, drift: true };
    /// As slow as noise with memory is looked for in recordings of 40 s.
    const SLOW: Memory = Memory { time: 8.0, drift: false, ..DRIFT };

    /// Ids that stand where `hidden` acts, x wanders by so much (m), and it or else all unstretched lengths were said to remember.
    fn in_the_place_of(memory: Memory, hidden: &[EffectSpec], wander: f64) -> Vec<String> {
        let recorded = |seed: u64| -> Trial {
            let mut trial = record(hidden, 28.0, seed);
            let last = trial.time[trial.len() - 1];
            for (row, time) in trial.measured.iter_mut().zip(&trial.time) {
                row[0] += wander * (std::f64::consts::TAU * time / last + seed as f64).sin();
            }
            trial
        };
        let (train, holdout) = (vec![recorded(51), recorded(52)], vec![recorded(53)]);
        let noise = noise_of_data(&train);
        let evidence = Evidence::new(train, holdout, noise);
        let begun = Context::begin(&evidence, &Model::default(), 0..0, &|_, _| {});
        let (context, base) = begun.expect("a fit");
        let channels = if wander > 0.0 { 0..1 } else { 7..11 };
        let remembered = channels.map(|channel| Memory { channel, ..memory });
        let mut train = base.train.clone();
        train.randomness = remembered.fold(train.randomness.without_latents(), |all, memory| all.with_memory(memory));
        let mut holdout = base.holdout.clone();
        holdout.randomness = train.randomness.clone();
        train.settle(&evidence.train, 10).expect("a trajectory");
        holdout.settle(&evidence.holdout, 10).expect("a trajectory");
        let instruments = Some(train.randomness.without_latents());
        let fit = context.finish(train, holdout, instruments);
        let standing = Standing { fit, ..Standing::new(&context, base) };
        let standing = instead_of_drift(&context, standing).expect("a search");
        standing.effects().iter().map(|effect| effect.id.clone()).collect()
    }

    /// All lengths were said to drift, or to remember for 20 s of 100, and nothing to be missing.
    #[test]
    fn two_laws_that_a_drift_or_a_slow_noise_stood_for_are_found() {
        let stiffness = EffectSpec::new("cable_stiffness", Some(2), &[-0.05]).expect("an effect");
        let bias = EffectSpec::new("length_sensor_bias", Some(4), &[0.03]).expect("an effect");
        for memory in [DRIFT, SLOW] {
            let found = in_the_place_of(memory, &[stiffness.clone(), bias.clone()], 0.0);
            // An anchor that is off shows as the bias does; they are compared later.
            let either = |id: &String| ["length_sensor_bias", "anchor_offset"].contains(&id.as_str());
            let right = found.len() == 2 && found.iter().any(|id| id == "cable_stiffness") && found.iter().any(either);
            assert!(right, "{memory:?}: {found:?}");
        }
    }

    /// Where two lengths of four stood for two laws with noise of 20 s, they had nothing of their own without it, and latent forces
    /// took what the laws would have.
    #[test]
    fn a_channel_without_its_slow_noise_has_that_of_its_device() {
        let begun = crate::data::recording::fitted(&[], &[record(&[], 5.0, 1)]);
        let [fast, slow] = [0.4, 20.0].map(|time| Memory { time, drift: false, ..DRIFT });
        let of = |channel: usize, memory: Memory| Memory { channel, ..memory };
        let memory = vec![of(0, DRIFT), of(7, fast), of(8, slow), of(9, fast), of(9, DRIFT), of(10, DRIFT)];
        let forgot = forgetting(&Randomness { memory, ..begun.randomness }, 4).memory;
        assert_eq!(forgot, [of(7, fast), of(8, fast), of(9, fast)]);
    }

    #[test]
    fn a_pose_that_wanders_is_no_law() {
        assert_eq!(in_the_place_of(DRIFT, &[], 0.05), Vec::<String>::new());
    }
}
