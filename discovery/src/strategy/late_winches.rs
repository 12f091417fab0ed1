//! Winches that act late, in the place of devices that are all late.
//!
//! How late a device is counts against the recorded forces. What all devices are late by, these forces may act late by as well: one
//! cause in the place of as many clocks. A dead time does just the same, so that no data tell the two apart; a lag, which is its rival
//! from there on, differs where winches ring between samples.

use std::sync::Arc;

use cdpr::effect::{EffectSpec, SpecError};

use crate::data::{Channel, Trial, Undone};
use crate::filter::error::FitError;
use crate::filter::estimate::Fit;
use crate::filter::kalman::Randomness;
use crate::hypothesis::candidates::is_there;
use crate::hypothesis::sensor::{lateness_of_pose, pose_delay};
use crate::journal::Outcome;
use crate::strategy::context::Context;
use crate::strategy::instruments::with_other_instruments;
use crate::strategy::standing::{Accepted, Standing};
use crate::weigh::criterion::told_apart_from;

/// Laws of forces that come late on all winches alike.
pub(crate) const LATE: [&str; 2] = ["winch_delay", "winch_lag"];

/// What stands, with a dead time of all winches in the place of what the pose, by a law that was found, and all other devices, by their
/// clocks, are late by.
pub(crate) fn late_winches(context: &Context<'_>, standing: Standing) -> Result<Standing, FitError> {
    let Some((pose, common)) = in_common(context, &standing) else { return Ok(standing) };
    (context.progress)("weighing late winches against late clocks", 0.5);
    let [dead_time, lag] = LATE.map(|id| EffectSpec::new(id, None, &[common]));
    let (dead_time, lag) = (dead_time.map_err(no_effect)?, lag.map_err(no_effect)?);
    let mut in_time = standing.clone();
    let late = lateness_of_pose(&standing.found(context)[pose]).unwrap_or_default();
    let mut model = standing.fit.train.model.clone();
    if late > common {
        model.effects[context.at(pose)] = pose_delay(late - common).map_err(no_effect)?;
    } else {
        model.effects.remove(context.at(pose));
        in_time.accepted.remove(pose);
    }
    let (mut start, rounds) = (standing.fit.clone(), context.policy.rounds);
    start.train.randomness = sooner(&start.train.randomness, common);
    model.effects.push(dead_time.clone());
    let next =
        context.journal.tried(&dead_time, "in the place of late clocks", context.fit_without(&model, &start, rounds));
    let Some(next) = next else { return Ok(standing) };
    model.effects.pop();
    let without = context.fit_without(&model, &next, rounds);
    let Some(without) = context.journal.tried(&dead_time, "devices in time without it", without) else {
        return Ok(standing);
    };
    let explained = next.score - without.score;
    let change = next.score - standing.fit.score;
    if change >= told_apart_from(explained) {
        context.journal.note(&dead_time, Outcome::Refused, change, "late clocks explain more");
        return Ok(standing);
    }
    let next = context.counted(next);
    let effect = next.train.model.effects.last().unwrap_or(&dead_time);
    context.journal.note(effect, Outcome::Added, explained, "in the place of what all devices are late by");
    in_time.accepted.push(Accepted::new(vec![lag], explained, None));
    let of_base = sooner(&standing.base.train.randomness, common);
    if let Some(base) = with_other_instruments(context, &standing.base, of_base)? {
        in_time.base = Arc::new(context.counted_as(&base, &next));
    }
    Ok(in_time.changed(next))
}

fn no_effect(error: SpecError) -> FitError {
    FitError::Model(error.to_string())
}

/// `randomness` of devices whose clocks are less late by so much (s).
fn sooner(randomness: &Randomness, by: f64) -> Randomness {
    let late = randomness.late.iter().map(|late| (late - by).max(0.0)).collect();
    Randomness { late, ..randomness.clone() }
}

/// Which of the accepted effects is the delay of the pose, and what all devices that are measured are late by (s) with it. None
/// where one is in time, or forces of all winches come late already.
fn in_common(context: &Context<'_>, standing: &Standing) -> Option<(usize, f64)> {
    let found = standing.found(context);
    let delay = |effect: &EffectSpec| lateness_of_pose(effect).filter(|_| effect.from.or(effect.until).is_none());
    let (pose, late) = found.iter().enumerate().find_map(|(k, effect)| Some((k, delay(effect)?)))?;
    let is_late = |effect: &EffectSpec| LATE.iter().any(|id| is_there(effect, id, None));
    let clocks = least_late(&standing.fit.train, &context.evidence.train)?;
    let forces_late = !Undone::recorder(&context.evidence.train).is_in_time();
    (clocks > 0.0 && !forces_late && !standing.effects().iter().any(is_late)).then_some((pose, late.min(clocks)))
}

/// How late (s) all devices but the pose are at least; none where none is measured.
fn least_late(fit: &Fit, trials: &[Trial]) -> Option<f64> {
    let measured = |channel: &Channel| trials.iter().any(|trial| trial.channels.contains(channel));
    let all = Channel::all(fit.model.parameters.cables());
    let others = all.iter().zip(&fit.randomness.late);
    let others = others.filter(|(channel, _)| !matches!(channel, Channel::Pose(_)) && measured(channel));
    others.map(|(_, late)| *late).min_by(f64::total_cmp)
}

#[cfg(test)]
mod tests {
    use cdpr::model_file::Model;

    use super::*;
    use crate::data::recording::{Bench, record_on};
    use crate::filter::estimate::noise_of_data;
    use crate::strategy::fitted::Evidence;
    use crate::strategy::fixture::{begun, effect, names, with};

    /// What stands once the clocks were found, of recordings on a bench whose winches lag by so much (s), and the pose by so many samples
    /// of 10 ms more.
    fn found(lag: f64, pose: usize) -> Vec<(String, Option<usize>)> {
        let bench = Bench::ringing();
        let hidden: Vec<EffectSpec> = if lag > 0.0 { vec![effect("winch_lag", None, &[lag, 0.0])] } else { Vec::new() };
        let recorded = |seed: u64| {
            let mut trial = record_on(&bench, &hidden, 10.0, seed);
            let then = trial.measured.clone();
            for (k, row) in trial.measured.iter_mut().enumerate() {
                row[..3].copy_from_slice(&then[k.saturating_sub(pose)][..3]);
            }
            trial
        };
        let (train, holdout) = (vec![recorded(61)], vec![recorded(62)]);
        let noise = noise_of_data(&train);
        let evidence = Evidence::new(train, holdout, noise);
        let model = Model { parameters: bench.parameters.clone(), ..Model::default() };
        let (context, mut standing) = begun(&evidence, &model);
        let is_pose = |channel: &Channel| matches!(channel, Channel::Pose(_));
        let late = Channel::all(4).iter().map(|channel| if is_pose(channel) { 0.0 } else { lag }).collect();
        let mut randomness = standing.fit.train.randomness.clone();
        randomness.late = late;
        let base = with_other_instruments(&context, &standing.fit, randomness).expect("a fit").expect("a fit");
        standing = standing.with_base(base);
        let delay = pose_delay(lag + 0.01 * pose as f64).expect("an effect");
        let standing = with(&context, standing, vec![(delay, Vec::new())]);
        let standing = late_winches(&context, standing).expect("a fit");
        assert_eq!(least_late(&standing.fit.train, &evidence.train), Some(0.0));
        names(&context, &standing)
    }

    /// A lag of all winches beside a pose that is late came out as a later pose and late lengths, and no winch was named.
    #[test]
    fn what_all_devices_are_late_by_the_winches_are() {
        let expected = ["pose_sensor_delay", "winch_delay"].map(|id| (id.to_owned(), None));
        assert_eq!(found(0.01, 1), expected);
    }

    #[test]
    fn one_late_device_is_a_late_device() {
        assert_eq!(found(0.0, 1), [("pose_sensor_delay".to_owned(), None)]);
    }
}
