//! Errors of the survey: where anchors and attachments are, and what lengths count from.
//!
//! Nobody knows them to the last millimetre, and each is within a tolerance that all such machines are built to. Where the
//! geometry as given does not do, these errors are free beside every law, as the instruments' errors are: found with the
//! laws and not before them, for a winch that pulls too little looks like an anchor that is too near. Directions of which
//! recordings tell nothing are held by the tolerance (A. N. Tikhonov's regularisation, with the tolerance as its prior).

use std::ops::Range;

use cdpr::effect::EffectSpec;
use cdpr::geometry::Geometry;
use cdpr::model_file::Model;
use nalgebra::DMatrix;

use crate::data::{Channel, Trial};
use crate::filter::whiten::Normal;
use crate::hypothesis::beside::moved_in;
use crate::hypothesis::candidates::{Known, Library, is_there};
use crate::hypothesis::parameter::Free;
use crate::model::sizes::Sizes;

/// How exactly anybody who builds such a machine knows where its anchors are and what its encoders count from, as a share of
/// its reach.
pub(crate) const ANCHORS: f64 = 2e-3;
/// The same of attachments, as a share of their arm.
pub(crate) const ATTACHMENTS: f64 = 0.05;
/// Share of what an error of the survey may plausibly be, by which it is varied.
const VARIED: f64 = 0.025;

/// By how much (m) each size of an effect may plausibly be off, where it is an error of the survey.
fn plausible(id: &str, sizes: &Sizes) -> Option<f64> {
    match id {
        "anchor_offset" | "length_sensor_bias" => Some(ANCHORS * sizes.reach),
        "attachment_offset" => Some(ATTACHMENTS * sizes.arm),
        _ => None,
    }
}

/// Adds what is known beforehand of the parameters to their normal equations, in which they come first; how many it is
/// known of.
pub(crate) fn regularise(normal: &mut Normal, model: &Model, parameters: impl Iterator<Item = Option<Free>>) -> usize {
    let sizes = Sizes::of(&model.parameters);
    let mut known = 0;
    for (at, free) in parameters.enumerate() {
        let Some(free) = free else { continue };
        let effect = &model.effects[free.effect];
        if let Some(plausible) = plausible(&effect.id, &sizes) {
            normal.gram[at * normal.columns + at] += plausible.powi(-2);
            normal.right[at] -= effect.values[free.parameter] / plausible.powi(2);
            known += 1;
        }
    }
    known
}

/// What errors of the survey cost beside what they explain: each direction of which the data tell more than the tolerance does, as much as
/// they narrow it (the Occam factor of a parameter with a prior: D. J. C. MacKay, Neural Computation 4 (1992), 415). `free` are the
/// parameters of `model` that are estimated, and `covariance` theirs, the tolerance known.
pub(crate) fn price(model: &Model, free: &[Free], covariance: &DMatrix<f64>) -> f64 {
    let sizes = Sizes::of(&model.parameters);
    let known =
        free.iter().enumerate().filter_map(|(at, free)| Some((at, plausible(&model.effects[free.effect].id, &sizes)?)));
    let known: Vec<(usize, f64)> = known.collect();
    let scaled = |r: usize, c: usize| covariance[(known[r].0, known[c].0)] / (known[r].1 * known[c].1);
    let cholesky = DMatrix::from_fn(known.len(), known.len(), scaled).cholesky();
    // What is no covariance tells nothing.
    cholesky.map_or(f64::INFINITY, |cholesky| -cholesky.ln_determinant())
}

/// The errors of the survey that recordings with lengths may show and that `model` does not have, zero each.
pub(crate) fn survey_errors(model: &Model, trials: &[Trial]) -> Vec<EffectSpec> {
    let geometry = Geometry::new(&model.parameters);
    // Where all cables meet in a point there is no attachment to be off.
    let point = geometry.attachment.iter().flatten().all(|coordinate| *coordinate == 0.0);
    let mut errors = Vec::new();
    for cable in 0..geometry.cables() {
        let lengths =
            [(Channel::CableLength(cable), "cable_length"), (Channel::UnstretchedLength(cable), "unstretched_length")];
        let measured = lengths.into_iter().filter(|(channel, _)| trials.iter().any(|t| t.channels.contains(channel)));
        let measured: Vec<&str> = measured.map(|(_, name)| name).collect();
        if measured.is_empty() {
            continue;
        }
        let error = |id: &str, values: &[f64]| {
            EffectSpec::new(id, Some(cable + 1), values).unwrap_or_else(|e| unreachable!("an effect of our own: {e}"))
        };
        errors.push(error("anchor_offset", &[0.0, 0.0]));
        if !point {
            errors.push(error("attachment_offset", &[0.0, 0.0]));
        }
        errors.extend(
            measured
                .into_iter()
                .map(|name| EffectSpec { channel: Some(name.to_owned()), ..error("length_sensor_bias", &[0.0]) }),
        );
    }
    let known = |error: &EffectSpec| {
        let same = |e: &EffectSpec| is_there(e, &error.id, error.cable) && channel_of(e) == channel_of(error);
        model.effects.iter().any(same)
    };
    errors.retain(|error| !known(error));
    errors
}

const LENGTH_BIAS: &str = "length_sensor_bias";

/// Whether an effect is an error of the survey.
pub(crate) fn is_of_survey(effect: &EffectSpec) -> bool {
    ["anchor_offset", "attachment_offset", LENGTH_BIAS].contains(&effect.id.as_str())
}

/// Whether an error of the survey is one of what a length counts from.
pub(crate) fn is_zero(error: &EffectSpec) -> bool {
    error.id == LENGTH_BIAS
}

/// The length that an effect of length sensors is of.
fn channel_of(effect: &EffectSpec) -> &str {
    effect.channel.as_deref().unwrap_or("unstretched_length")
}

/// Has the length of cable `cable` (from 1) that is measured as `channel` be shown longer by `change` (m).
pub(crate) fn shift_length(effects: &mut Vec<EffectSpec>, cable: usize, channel: &str, change: f64) {
    let same = |effect: &&mut EffectSpec| {
        effect.id == LENGTH_BIAS && effect.cable == Some(cable) && channel_of(effect) == channel
    };
    if let Some(bias) = effects.iter_mut().find(same) {
        bias.values[0] += change;
        return;
    }
    let bias = EffectSpec::new(LENGTH_BIAS, Some(cable), &[change]);
    let bias = bias.unwrap_or_else(|e| unreachable!("an effect of our own: {e}"));
    effects.push(EffectSpec { channel: Some(channel.to_owned()), ..bias });
}

/// Sets the errors of the survey that are a model's `effects` of these numbers beside the candidates of a library.
pub(crate) fn set_beside(library: &mut Library, model: &Model, effects: Range<usize>) {
    let sizes = Sizes::of(&model.parameters);
    for effect in &model.effects[effects] {
        let Some(plausible) = plausible(&effect.id, &sizes) else { continue };
        for (parameter, value) in effect.values.iter().enumerate() {
            // As small as candidates are varied by.
            let size = VARIED * plausible;
            let known = Known { mean: -value / size, precision: (size / plausible).powi(2) };
            library.set_beside(moved_in(effect, parameter, size), known);
        }
    }
}

/// By how much (m) errors of the survey make a cable longer at most, or shorter, with the platform in the middle.
pub(crate) fn most_longer(model: &Model, errors: &[&EffectSpec]) -> f64 {
    let geometry = Geometry::new(&model.parameters);
    let longer = |cable: usize| -> f64 {
        let [to, from] = [geometry.anchor[cable], geometry.attachment[cable]];
        let along = [to[0] - from[0], to[1] - from[1]];
        let length = along[0].hypot(along[1]);
        let of = |error: &&&EffectSpec| {
            let along = || (error.values[0] * along[0] + error.values[1] * along[1]) / length;
            match error.id.as_str() {
                "anchor_offset" => along(),
                "attachment_offset" => -along(),
                _ => error.values[0],
            }
        };
        errors.iter().filter(|error| error.cable == Some(cable + 1)).map(|error| of(&error)).sum()
    };
    (0..geometry.cables()).map(longer).map(f64::abs).fold(0.0, f64::max)
}

/// `model` with errors of the survey.
pub(crate) fn with_errors(model: &Model, errors: &[EffectSpec]) -> Model {
    let mut model = model.clone();
    model.effects.extend_from_slice(errors);
    model
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::recording::{fitted, record};
    use crate::hypothesis::candidates::{Situation, catalogue};
    use crate::journal::Outcome;
    use crate::outcome::Verdict;
    use crate::weigh::criterion::Penalty;
    use crate::weigh::refine::refine;
    use crate::weigh::regression::ladder;
    use crate::weigh::regression::rank;
    use crate::weigh::signatures::Signatures;
    use crate::weigh::signatures::levels;
    use crate::{Geometry as Given, Settings, discover};

    fn effect(id: &str, cable: usize, values: &[f64]) -> EffectSpec {
        EffectSpec::new(id, Some(cable), values).expect("an effect")
    }

    #[test]
    fn what_is_measured_has_errors_and_what_is_known_of_is_left_alone() {
        let trials = [record(&[], 4.0, 61)];
        let lengths = trials[0].channels.iter().filter(|c| matches!(c, Channel::UnstretchedLength(_))).count();
        let all = survey_errors(&Model::default(), &trials);
        assert_eq!(all.len(), 3 * lengths);
        let known = Model { effects: vec![effect("anchor_offset", 2, &[0.01, 0.0])], ..Model::default() };
        assert_eq!(survey_errors(&known, &trials).len(), all.len() - 1);
        // A law on all cables stands beside none on one: a search ended with "given twice for cable 1".
        let anchors = EffectSpec::new("anchor_offset", None, &[0.01, 0.0]).expect("an effect");
        let known = Model { effects: vec![anchors], ..Model::default() };
        let errors = survey_errors(&known, &trials);
        assert_eq!(errors.len(), all.len() - lengths);
        assert!(with_errors(&known, &errors).plant().is_ok());
        let blind = [trials[0].clone()].map(|mut trial| {
            trial.channels.iter_mut().for_each(|channel| {
                if let Channel::UnstretchedLength(cable) = *channel {
                    *channel = Channel::Tension(cable);
                }
            });
            trial
        });
        assert!(survey_errors(&Model::default(), &blind).is_empty());
    }

    /// Half a minute around one pose tells an anchor along its cable and hardly across it.
    #[test]
    fn what_recordings_do_not_tell_is_held_by_the_tolerance() {
        let hidden = [effect("anchor_offset", 1, &[0.05, 0.05]), effect("attachment_offset", 3, &[0.02, -0.01])];
        let trials = [record(&hidden, 30.0, 62)];
        let given = Model::default();
        let errors = survey_errors(&given, &trials);
        let mut fit = fitted(&errors, &trials);
        refine(&mut fit, &trials, 0, 6, None).expect("a refinement");
        let sizes = Sizes::of(&given.parameters);
        for effect in &fit.model.effects {
            let tolerance = plausible(&effect.id, &sizes).expect("an error of the survey");
            assert!(effect.values.iter().all(|value| value.abs() < tolerance), "{effect:?}");
        }
        // What the errors of a cable do to its length at the middle they do together.
        for cable in 1..=4 {
            let of = |effects: &[EffectSpec]| {
                let own: Vec<&EffectSpec> = effects.iter().filter(|effect| effect.cable == Some(cable)).collect();
                most_longer(&given, &own)
            };
            let (found, truth) = (of(&fit.model.effects), of(&hidden));
            assert!((found - truth).abs() < 0.003, "cable {cable}: {found} {truth}");
        }
    }

    /// Weighed by itself a wind stood before the winch's force: the geometry had taken up what it does to the lengths.
    #[test]
    fn a_winch_is_told_from_the_geometry_that_stood_for_it() {
        let hidden = [
            effect("winch_force_gain", 2, &[-0.01]),
            effect("anchor_offset", 1, &[0.05, -0.04]),
            effect("attachment_offset", 3, &[0.01, 0.01]),
        ];
        let trials = [record(&hidden, 40.0, 66)];
        let errors = survey_errors(&Model::default(), &trials);
        let mut fit = fitted(&errors, &trials);
        refine(&mut fit, &trials, 0, 6, None).expect("a refinement");
        let mut library = catalogue(&fit.model, &Situation::of(&trials));
        set_beside(&mut library, &fit.model, 0..errors.len());
        assert_eq!(library.beside.len(), 20);
        let signatures = Signatures::new(library);
        let levels = levels(&fit, &trials, &signatures, &ladder(&fit.randomness));
        let library = &signatures.library;
        let ranked = rank(library, &levels, Penalty::NONE);
        let best = &library.candidates[ranked[0].candidate];
        assert_eq!((best.id, best.cable), ("winch_force_gain", Some(2)));
        let found = best.effect(&ranked[0].amplitudes).expect("an effect").values[0];
        assert!((found + 0.01).abs() < 1e-3, "{found}");
    }

    /// Ten times as exact as the tolerance is one of ten places: `2 ln 10` for each parameter, and nothing for what is no error of a survey.
    #[test]
    fn an_error_of_the_survey_costs_as_much_as_the_data_narrow_it() {
        let effects = vec![effect("anchor_offset", 2, &[0.0, 0.0]), effect("winch_force_gain", 1, &[0.01])];
        let model = Model { effects, ..Model::default() };
        let free: Vec<Free> = [(0, 0), (0, 1), (1, 0)].map(|(effect, parameter)| Free { effect, parameter }).into();
        let tolerance = ANCHORS * Sizes::of(&model.parameters).reach;
        let priced = |share: f64| {
            let own = (share * tolerance).powi(2);
            price(&model, &free, &DMatrix::from_diagonal(&[own, own, 1e-8].to_vec().into()))
        };
        assert!(priced(1.0).abs() < 1e-9 && (priced(0.1) - 4.0 * 10.0_f64.ln()).abs() < 1e-9);
        assert!(price(&model, &free, &DMatrix::zeros(3, 3)).is_infinite());
    }

    /// On a recording like these, with the geometry as given, friction came with four parts of the geometry that stood for all.
    #[test]
    fn friction_is_alone_where_the_geometry_is_off() {
        let mut hidden = vec![effect("winch_viscous_friction", 2, &[2000.0])];
        for (cable, [x, y]) in [[2.0, -3.0], [-1.0, 4.0], [3.0, 2.0], [-4.0, 1.0]].into_iter().enumerate() {
            hidden.push(effect("anchor_offset", cable + 1, &[0.02 * x, 0.02 * y]));
            hidden.push(effect("attachment_offset", cable + 1, &[4e-3 * y, 4e-3 * x]));
        }
        let record = |seed| record(&hidden, 25.0, seed);
        let trials = [record(63), record(64)].to_vec();
        let settings = Settings { geometry: Given::Corrected, time_limit: None };
        let found = discover(&Model::default(), trials, vec![record(65)], settings, &|_, _| ());
        let found = found.expect("a verdict");
        // So short recordings leave open whether it is Stribeck's.
        assert!(matches!(found.verdict, Verdict::Named | Verdict::Ambiguous), "{:?}", found.remarks);
        let [friction] = &found.effects[..] else { panic!("{:?}", found.effects) };
        assert_eq!((friction.effect.id.as_str(), friction.effect.cable), ("winch_viscous_friction", Some(2)));
        let error = friction.standard_error[0].expect("an error");
        assert!((friction.effect.values[0] - 2000.0).abs() < 3.0 * error && error < 5.0, "{friction:?}");
        assert_eq!(found.survey.len(), 12);
        // What was tried with the geometry as given is not lost, and comes first.
        let restarted = found.journal.iter().position(|entry| entry.outcome == Outcome::Restarted).expect("an entry");
        assert!(restarted > 0 && found.journal.len() > restarted + 1, "{:?}", found.journal);
    }
}
