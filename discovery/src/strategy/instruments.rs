//! Instruments beside effects: what they have beside white noise is taken up where it explains more than effects do, found
//! anew where effects have names, and given back where it explains nothing any more.

use std::sync::Arc;

use crate::filter::error::FitError;
use crate::filter::estimate::Fit;
use crate::filter::kalman::Randomness;
use crate::instruments::clock_offset::wander_in_time;
use crate::instruments::{self, Sizing};
use crate::journal::Outcome;
use crate::strategy::context::Context;
use crate::strategy::fitted::{Evidence, Fitted, Trained, instruments_of};
use crate::strategy::standing::Standing;
use crate::strategy::undoing::{Others, what_recording_does};
use crate::weigh::criterion::EVIDENCE;

/// What was found, where its instruments are `better` known. What was found may only have stood for what instruments do: the
/// model as given has its own in its place where these explain as much.
pub(crate) fn beside_instruments(
    context: &Context<'_>,
    mut standing: Standing,
    better: Fitted,
) -> Result<Standing, FitError> {
    if instruments::parameters(&standing.fit.train.randomness) == 0 {
        standing.taken_up_beside = Some(standing.laws());
    }
    let base = context.counted_as(&standing.base, &better);
    // The model as given gets those that it asks for itself where they might explain as much.
    let explained = (base.score - better.score).max(0.0);
    let base = with_instruments(context, &base, explained)?.unwrap_or(base);
    if base.score <= better.score {
        standing.fit = better;
        // Its instruments are other ones than those beside the effects, and gaps count by them from here on.
        let base = context.counted(base);
        let standing = standing.give_up(context, "what the instruments add explains more", base.clone());
        return Ok(Standing { base: Arc::new(base), ..standing });
    }
    Ok(Standing { base: Arc::new(base), fit: better, ..standing })
}

/// `fitted` with what its instruments ask for, where that explains more than the `gain` of the best effect.
pub(crate) fn better_instruments(
    context: &Context<'_>,
    fitted: &Fitted,
    gain: f64,
) -> Result<Option<Fitted>, FitError> {
    let better = with_instruments(context, fitted, gain)?;
    let better = better.filter(|better| fitted.score - better.score > gain);
    Ok(better.map(|better| context.counted(better)))
}

/// `fitted` with what its instruments ask for, where something is left for them and no explanation gains far more.
pub(crate) fn with_instruments(context: &Context<'_>, fitted: &Fitted, gain: f64) -> Result<Option<Fitted>, FitError> {
    if let Some(asked_for) = context.asked.answer(fitted) {
        return Ok(asked_for.map(|better| context.counted_as(&better, fitted)));
    }
    let Evidence { train, noise, .. } = context.evidence;
    let asked_for = with_those(context, fitted, gain, &Sizing::new(train, noise, context.penalty))?;
    // What was not worth a look beside an explanation may be there.
    if gain == 0.0 || asked_for.is_some() {
        context.asked.keep(fitted, asked_for.as_ref());
    }
    Ok(asked_for)
}

/// What stands where pose and lengths wander against each other as no force can have them do, by kinematics alone: its instruments do
/// so, and those of the model as given.
pub(crate) fn evident_wander(context: &Context<'_>, standing: Standing) -> Result<Standing, FitError> {
    let (Evidence { train, noise, .. }, fit) = (context.evidence, &standing.fit);
    let Some(wander) = wander_in_time(&fit.train.examined, train) else { return Ok(standing) };
    let sizing = Sizing::new(train, noise, context.penalty);
    let wandering = sizing.wandering(&fit.train, wander, context.free_from);
    let wandering = context.journal.or_remark("Instruments that wander do not go with the data", wandering)?.flatten();
    let Some(wandering) = wandering else { return Ok(standing) };
    let score = context.score(&wandering, train);
    let better = context.verified(Trained { fit: wandering, score }, fit);
    let better = context.journal.or_remark("Instruments that wander do not go with the held-out data", better)?;
    let Some(better) = better.filter(|better| better.score < fit.score - EVIDENCE) else { return Ok(standing) };
    let better = context.counted(better);
    if standing.accepted.is_empty() {
        Ok(standing.with_base(better))
    } else {
        beside_instruments(context, standing, better)
    }
}

/// Whether the recorded forces have a white error for sure, which alone explains more than the `gain` of the best effect.
pub(crate) fn forces_err_for_sure(context: &Context<'_>, fitted: &Fitted, gain: f64) -> bool {
    let Evidence { train, noise, .. } = context.evidence;
    Sizing::new(train, noise, context.penalty).forces_err_for_sure(&fitted.train, gain)
}

/// What stands where no effect was found and an error of the recorded forces explains what is left, though it is more than
/// recordings are with which a machine is described: with it they say little, and that is said.
pub(crate) fn with_any_error_of_forces(context: &Context<'_>, standing: Standing) -> Result<Standing, FitError> {
    let (Evidence { train, noise, .. }, fit) = (context.evidence, &standing.fit);
    let sizing = Sizing::new(train, noise, context.penalty);
    if !standing.accepted.is_empty() || !sizing.may_hide_an_error(&fit.train.randomness) {
        return Ok(standing);
    }
    let better = with_those(context, fit, 0.0, &sizing.with_any_error_of_forces())?;
    let Some(better) = better.filter(|better| better.score < fit.score) else { return Ok(standing) };
    Ok(standing.with_base(context.counted(better)))
}

fn with_those(
    context: &Context<'_>,
    fitted: &Fitted,
    gain: f64,
    sizing: &Sizing<'_>,
) -> Result<Option<Fitted>, FitError> {
    let trials = &context.evidence.train;
    if !context.something_left(&fitted.train, trials) {
        return Ok(None);
    }
    context.time.check()?;
    let taken = sizing.take_up(&fitted.train, gain, context.free_from);
    let taken = context.journal.or_remark("What the instruments seem to add does not go with the data", taken)?;
    let Some(Some(fit)) = taken else { return Ok(None) };
    let score = context.score(&fit, trials);
    let better = context.verified(Trained { fit, score }, fitted);
    // Without what the instruments took over nothing holds the held-out trajectory: they are no better.
    context.journal.or_remark("What the instruments seem to add does not go with the held-out data", better)
}

/// What stands with the instruments that are found now that its effects have names, where that is likelier than what was found
/// before: then what a law does was theirs as well, and took the place of what they do.
pub(crate) fn instruments_anew(context: &Context<'_>, standing: Standing) -> Result<Standing, FitError> {
    let plain = instruments::parameters(&standing.fit.train.randomness) == 0;
    // Those that were taken up beside these very laws would be found again.
    if standing.accepted.is_empty() || plain || standing.taken_up_beside.as_ref() == Some(&standing.laws()) {
        return Ok(standing);
    }
    let Some(anew) = with_instruments_anew(context, &standing.fit)? else { return Ok(standing) };
    Ok(standing.changed(context.counted(anew)))
}

/// What stands without effects in whose place the instruments explain more: an effect may have come in for what they do before
/// they were asked. A very certain one leaves a gap whatever they do.
pub(crate) fn instruments_instead(context: &Context<'_>, mut standing: Standing) -> Result<Standing, FitError> {
    let mut kept = 0;
    while kept < standing.accepted.len() {
        if context.certainty(&standing.fit).wald[context.at(kept)] >= context.policy.certain {
            kept += 1;
            continue;
        }
        let (model, effect) = standing.without(context, kept);
        let without = context.fit_without(&model, &standing.fit, context.policy.rounds);
        let without = context.journal.tried(&effect, "instruments in its place", without);
        let (mut instead, mut undone) = (None, None);
        if let Some(without) = without {
            (instead, undone) =
                (with_instruments_anew(context, &without)?, what_recording_does(context, &without, &Others::MORE)?);
        }
        let score = instead.as_ref().map_or(standing.fit.score, |instead| instead.score.min(standing.fit.score));
        if let Some(better) = undone.filter(|better| better.score < score) {
            let change = standing.fit.score - better.score;
            context.journal.note(&effect, Outcome::Removed, change, "what recording does explains more");
            return Ok(Standing { to_undo: Some(better.undone), ..standing });
        }
        let Some(instead) = instead.filter(|instead| instead.score < standing.fit.score) else {
            kept += 1;
            continue;
        };
        let change = standing.fit.score - instead.score;
        context.journal.note(&effect, Outcome::Removed, change, "what the instruments add explains more");
        standing.accepted.remove(kept);
        standing = standing.changed(context.counted(instead));
        if standing.accepted.is_empty() {
            standing.base = Arc::new(standing.fit.clone());
        }
    }
    Ok(standing)
}

/// The model of `fitted` with the instruments that are found from plain ones on, if that is likelier.
pub(crate) fn with_instruments_anew(context: &Context<'_>, fitted: &Fitted) -> Result<Option<Fitted>, FitError> {
    let Some(plain) = with_plain_instruments(context, fitted)? else { return Ok(None) };
    let anew = with_instruments(context, &plain, 0.0)?.unwrap_or(plain);
    Ok((anew.score < fitted.score).then_some(anew))
}

/// The model of `fitted` with instruments that have white noise alone; latent forces carry what else they did.
fn with_plain_instruments(context: &Context<'_>, fitted: &Fitted) -> Result<Option<Fitted>, FitError> {
    with_other_instruments(context, fitted, fitted.train.randomness.with_white_noise())
}

/// The model of `fitted` with the instruments of `randomness`; latent forces carry what else they did.
pub(crate) fn with_other_instruments(
    context: &Context<'_>,
    fitted: &Fitted,
    randomness: Randomness,
) -> Result<Option<Fitted>, FitError> {
    let (model, trials) = (&fitted.train.model, &context.evidence.train);
    let mut start = fitted.train.clone();
    start.randomness = randomness;
    let start = context.loosened(model, &start, trials);
    let trained = start.and_then(|start| context.train(model, &start, trials, context.policy.rounds, None));
    let other = trained.and_then(|trained| context.verified(trained, fitted));
    context.journal.or_remark("With other instruments the model does not go with the data", other)
}

/// What stands without what its instruments were given before its effects were known, where it is as good without: a drift
/// may have stood for a law that has a name now, and a delay for what another clock or a drift does. The effects' parameters
/// adapt. Instruments became smaller as effects took their part: all gaps count by those that are left.
pub(crate) fn without_idle_instruments(context: &Context<'_>, mut standing: Standing) -> Result<Standing, FitError> {
    let trials = &context.evidence.train;
    let mut kept = 0;
    while let Some(randomness) = instruments::less_by_one(&standing.fit.train, trials).into_iter().nth(kept) {
        let mut start = standing.fit.train.clone();
        start.randomness = randomness;
        let trained = context.train(&start.model, &start, trials, context.policy.rounds, None);
        let without = trained.and_then(|trained| {
            let instruments = instruments_of(&trained.fit);
            context.verified_by(trained, &standing.fit, instruments)
        });
        match without {
            // What was fitted beside it knew it still.
            Ok(without) if without.score <= standing.fit.score => standing = standing.changed(without),
            Ok(_) => kept += 1,
            Err(error) => {
                // What cannot be fitted without it has it.
                context.journal.instruments_failed("without one of their parts", &error);
                kept += 1;
            }
        }
    }
    let fit = context.counted(standing.fit);
    let base = Arc::new(context.counted_as(&standing.base, &fit));
    Ok(Standing { fit, base, ..standing })
}

/// The model of `base` beside the instruments of `fitted`: what these leave of it. Latent forces carry what they can.
pub(crate) fn beside_those_of(context: &Context<'_>, fitted: &Fitted, base: &Fitted) -> Result<Fitted, FitError> {
    let (evidence, moves) = (context.evidence, context.policy.first_moves);
    let randomness = fitted.train.randomness.with_latents(1.0);
    let settled = |from: &Fit, trials| {
        let mut fit = Fit::new(&base.train.model, trials, &randomness, Some(from))?;
        fit.settle(trials, moves)?;
        Ok::<_, FitError>(fit)
    };
    let mut train = settled(&base.train, &evidence.train)?;
    train.fit_latents(&evidence.train);
    train.settle(&evidence.train, moves)?;
    let mut holdout = settled(&base.holdout, &evidence.holdout)?;
    holdout.randomness = train.randomness.clone();
    holdout.settle(&evidence.holdout, moves)?;
    Ok(context.finish(train, holdout, fitted.instruments.clone()))
}

#[cfg(test)]
mod tests {
    use cdpr::effect::EffectSpec;
    use cdpr::model_file::Model;

    use super::*;
    use crate::data::recording::{Bench, noise, record, record_on};
    use crate::filter::estimate::noise_of_data;
    use crate::model::randomness::Memory;
    use crate::strategy::fixture::{begun, with};
    use crate::strategy::standing::Accepted;

    /// Gaps went on by the instruments beside effects that were given up: 11 in the place of 0.93.
    #[test]
    fn where_instruments_take_the_place_of_effects_they_are_those_of_the_model_as_given() {
        let recorded = |seed: u64| {
            let mut trial = record(&[], 40.0, seed);
            let mut errors = noise(4 * trial.len(), 90 + seed);
            let forces = trial.inputs.iter_mut().flat_map(|inputs| inputs.winch_force.iter_mut());
            forces.for_each(|force| *force += 100.0 * errors.next().unwrap_or(0.0));
            trial
        };
        let (train, holdout) = (vec![recorded(31), recorded(32)], vec![recorded(33)]);
        let noise = noise_of_data(&train);
        let evidence = Evidence::new(train, holdout, noise);
        let begun = Context::begin(&evidence, &Model::default(), 0..0, &|_, _| {});
        let (context, base) = begun.expect("a fit");
        let inertia = EffectSpec::new("winch_drum_inertia", None, &[50.0]).expect("an effect");
        let better = Model { effects: vec![inertia], ..Model::default() };
        let mut better = context.fit(&better, &base).expect("a fit");
        let other = Memory { channel: 0, deviation: 1e-4, time: 1.0, drift: false };
        better.train.randomness = better.train.randomness.with_memory(other);
        better.instruments = Some(better.train.randomness.without_latents());
        let accepted = vec![Accepted::new(Vec::new(), -100.0, None)];
        let standing = Standing { fit: better.clone(), accepted, ..Standing::new(&context, base) };
        let Standing { base, fit, accepted, .. } = beside_instruments(&context, standing, better).expect("a fit");
        assert!(fit.train.model.effects.is_empty() && accepted.is_empty());
        assert!(fit.instruments.as_ref().is_some_and(|randomness| randomness.white_input() > 0.0));
        assert!(fit.gap[0] < 1.3 && base.gap == fit.gap, "{:?} {:?}", fit.gap, base.gap);
    }

    /// A search in which `law` stands and the instruments were asked for beside it.
    fn with_a_drift_beside(evidence: &Evidence, law: EffectSpec) -> (Context<'_>, Standing) {
        let (context, standing) = begun(evidence, &Model::default());
        let standing = with(&context, standing, vec![(law, Vec::new())]);
        let better = better_instruments(&context, &standing.fit, 0.0).expect("a fit").expect("a drift");
        let standing = beside_instruments(&context, standing, better).expect("a fit");
        (context, standing)
    }

    /// A gain of five per cent beside a pose that wanders by a centimetre: no instrument of the model as given does what the gain does.
    #[test]
    fn the_model_as_given_is_asked_for_its_instruments_where_they_may_explain_as_much() {
        let gain = EffectSpec::new("winch_force_gain", Some(1), &[0.05]).expect("an effect");
        let evidence = wandering(std::slice::from_ref(&gain), 0.01, 61);
        let (_, standing) = with_a_drift_beside(&evidence, gain);
        let drifts = |fitted: &Fitted| fitted.train.randomness.memory.len();
        assert!(drifts(&standing.fit) > 0 && drifts(&standing.base) == 0 && standing.accepted.len() == 1);
    }

    /// Winches that are driven by 500 N of which nothing is recorded, more than a tenth of what the recorded forces do: it is no
    /// instrument's as long as an effect may explain it.
    #[test]
    fn an_error_of_forces_that_is_more_than_recordings_have_is_taken_where_nothing_else_was_found() {
        let bench = Bench::large().with_unrecorded_forces(500.0);
        let recorded = |seed: u64| record_on(&bench, &[], 28.0, seed);
        let (train, holdout) = (vec![recorded(61), recorded(62)], vec![recorded(63)]);
        let noise = noise_of_data(&train);
        let evidence = Evidence::new(train, holdout, noise);
        let begun = Context::begin(&evidence, &Model::default(), 0..0, &|_, _| {});
        let (context, base) = begun.expect("a fit");
        let asked_for = with_instruments(&context, &base, 0.0).expect("a fit");
        let input = asked_for.as_ref().map_or(0.0, |fitted| fitted.train.randomness.white_input());
        assert!(input < 300.0, "{input}");
        let standing = Standing::new(&context, base);
        let beside_an_effect = Standing { accepted: vec![Accepted::new(Vec::new(), -1.0, None)], ..standing.clone() };
        assert!(!with_any_error_of_forces(&context, beside_an_effect).expect("a fit").white_force_error());
        let found = with_any_error_of_forces(&context, standing).expect("a fit");
        let input = found.fit.train.randomness.white_input();
        assert!(found.white_force_error() && (450.0..550.0).contains(&input), "{input}");
    }

    /// Latent forces of a tenth of the tensions carried a pose that wandered by half a millimetre, and cables were slack along the
    /// trajectories: nothing that was found there meant anything. Here it is 5 mm.
    #[test]
    fn instruments_of_a_stiff_robot_that_wander_leave_nothing_to_latent_forces() {
        let bench = Bench::laboratory();
        let recorded = |seed: u64| {
            let mut trial = record_on(&bench, &[], 20.0, seed);
            let last = trial.time[trial.len() - 1];
            for (row, time) in trial.measured.iter_mut().zip(&trial.time) {
                row[1] += 5e-3 * (2.0 * std::f64::consts::PI * time / last).sin();
            }
            trial
        };
        let (train, holdout) = (vec![recorded(71), recorded(72)], vec![recorded(73)]);
        let noise = noise_of_data(&train);
        let evidence = Evidence::new(train, holdout, noise);
        let model = Model { parameters: bench.parameters.clone(), ..Model::default() };
        let begun = Context::begin(&evidence, &model, 0..0, &|_, _| {});
        let (context, base) = begun.expect("a fit");
        assert!(base.train.randomness.has_latents());
        let standing = evident_wander(&context, Standing::new(&context, base.clone())).expect("a fit");
        let Fitted { train, gap, score, .. } = &standing.fit;
        assert!(!train.randomness.has_latents() && *score < base.score - 100.0, "{:?}", train.randomness);
        assert!((0.8..1.2).contains(&gap[0]), "{gap:?}");
    }

    /// Recordings with `hidden` effects, from this seed on, in which x wanders by so much (m).
    fn wandering(hidden: &[EffectSpec], wander: f64, seed: u64) -> Evidence {
        let recorded = |seed: u64| {
            let mut trial = record(hidden, 40.0, seed);
            let last = trial.time[trial.len() - 1];
            for (row, time) in trial.measured.iter_mut().zip(&trial.time) {
                row[0] += wander * (std::f64::consts::PI * time / last).sin();
            }
            trial
        };
        let (train, holdout) = (vec![recorded(seed), recorded(seed + 1)], vec![recorded(seed + 2)]);
        let noise = noise_of_data(&[&train[..], &holdout[..]].concat());
        Evidence::new(train, holdout, noise)
    }

    /// Noises with memory that are left of those that the instruments were given, where the pose wanders by so much (m): what
    /// the wander asks for, or else a drift of x that nothing asks for.
    fn released(wander: f64) -> (usize, usize) {
        let hidden = EffectSpec::new("winch_force_gain", Some(1), &[0.01]).expect("an effect");
        let evidence = wandering(std::slice::from_ref(&hidden), wander, 41);
        let begun = Context::begin(&evidence, &Model::default(), 0..0, &|_, _| {});
        let (context, base) = begun.expect("a fit");
        let mut fitted = context.fit(&Model { effects: vec![hidden], ..Model::default() }, &base).expect("a fit");
        if let Some(asked_for) = with_instruments(&context, &fitted, 0.0).expect("a fit") {
            fitted = asked_for;
        } else {
            let drift = Memory { channel: 0, deviation: 2e-3, time: 40.0, drift: true };
            fitted.train.randomness = fitted.train.randomness.clone().with_memory(drift);
            fitted.train.smooth(&evidence.train).expect("a trajectory");
        }
        let instruments = Some(fitted.train.randomness.without_latents());
        let fit = context.finish(fitted.train, fitted.holdout, instruments);
        assert!(!fit.train.randomness.memory.is_empty());
        let accepted = vec![Accepted::new(Vec::new(), -1.0, None)];
        let standing = Standing { fit, accepted, ..Standing::new(&context, base) };
        let fit = without_idle_instruments(&context, standing).expect("a fit").fit;
        let standing = fit.train.randomness.memory.len();
        (standing, fit.instruments.map_or(0, |randomness| randomness.memory.len()))
    }

    /// Ids that stand where `hidden` acts and x wanders, for which `effect` came in.
    fn left_beside_a_wander(hidden: &[EffectSpec], effect: EffectSpec) -> Vec<String> {
        let evidence = wandering(hidden, 0.05, 51);
        let begun = Context::begin(&evidence, &Model::default(), 0..0, &|_, _| {});
        let (context, base) = begun.expect("a fit");
        let fit = context.fit(&Model { effects: vec![effect], ..Model::default() }, &base).expect("a fit");
        let accepted = vec![Accepted::new(Vec::new(), fit.score - base.score, None)];
        let standing = Standing { fit, accepted, ..Standing::new(&context, base) };
        let standing = instruments_instead(&context, standing).expect("a fit");
        assert_eq!(standing.accepted.len(), standing.effects().len());
        standing.effects().iter().map(|effect| effect.id.clone()).collect()
    }

    /// A pose that wanders beside a law: its drift is not looked for a second time, but is beside another law.
    #[test]
    fn instruments_taken_up_beside_the_laws_that_stand_are_not_looked_for_anew() {
        let gain = EffectSpec::new("winch_force_gain", Some(1), &[0.01]).expect("an effect");
        let evidence = wandering(std::slice::from_ref(&gain), 0.05, 61);
        let (context, mut standing) = with_a_drift_beside(&evidence, gain);
        // Whatever is found is better than this.
        standing.fit.score = f64::INFINITY;
        let score = |standing: &Standing| instruments_anew(&context, standing.clone()).expect("a fit").fit.score;
        assert!(score(&standing).is_infinite());
        standing.taken_up_beside = Some(Vec::new());
        assert!(score(&standing).is_finite());
    }

    /// Strong damping of all cables was named for stamps that jitter.
    #[test]
    fn an_effect_does_not_stand_for_what_instruments_do() {
        let bias = EffectSpec::new("winch_force_bias", Some(2), &[3.0]).expect("an effect");
        assert!(left_beside_a_wander(&[], bias).is_empty());
        let gain = EffectSpec::new("winch_force_gain", Some(1), &[0.01]).expect("an effect");
        assert_eq!(left_beside_a_wander(std::slice::from_ref(&gain), gain.clone()), [gain.id]);
    }

    #[test]
    fn a_drift_that_explains_nothing_any_more_is_given_back() {
        assert_eq!(released(0.0), (0, 0));
        let (standing, held_against) = released(0.05);
        assert!(standing > 0 && standing == held_against, "{standing} {held_against}");
    }
}
