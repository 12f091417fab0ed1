//! Corrections of the geometry before a search.
//!
//! Errors of a survey are found together with the laws, each within a tolerance that all such machines are built to. Where lengths alone
//! tell the pose and cannot be read by the geometry as given, it is corrected first, by kinematics, without a law in it.

use cdpr::effect::EffectSpec;
use cdpr::geometry::Geometry;
use cdpr::kinematics::cable_lengths;
use cdpr::model_file::Model;
use cdpr::parameters::CableModel;

use super::problem::{Problem, Unknown};
use super::{Calibration, ChannelMisfit, TOLD, calibrate};
use crate::data::{Channel, Trial};
use crate::hypothesis::survey::most_longer;
use crate::outcome::SurveyError;

/// Share of its length by which a cable may be longer or shorter than the model says for the survey to be wrong; more is an
/// encoder that counts from another zero, or another robot. A real robot's was off by 4 %.
const MOST_OFF: f64 = 0.1;

/// A model whose geometry was corrected.
pub(crate) struct Corrected {
    pub(crate) model: Model,
    /// What was corrected.
    pub(crate) errors: Vec<SurveyError>,
    /// What is said of it.
    pub(crate) remark: String,
}

/// Corrects a geometry that is off by more than corrections of a plausible size could make, where larger ones make up for it and lengths
/// alone tell the pose. (Where it is measured offsets of lengths by themselves show, which a calibration mixes with errors of
/// anchors.)
pub(crate) fn correct_before_search(model: &Model, trials: &[Trial]) -> Option<Corrected> {
    let trials = kinematics_alone(model, trials);
    // Where there are no equations, or no corrections that settle, the geometry stays as given, and what the check said of it stands.
    let problem = Problem::new(model, &trials).ok().filter(|problem| !problem.pose_is_measured())?;
    let found = calibrate(model, &trials).ok()?;
    let most = |channel: Channel| match channel {
        Channel::CableLength(cable) | Channel::UnstretchedLength(cable) => problem.plausible_of(cable),
        Channel::Pose(_) | Channel::Tension(_) => f64::INFINITY,
    };
    let explained = found.misfits.iter().any(|m| m.before.powi(2) - m.after.powi(2) > most(m.channel).powi(2));
    if !explained || found.misfits.iter().any(|m| m.after > most(m.channel)) {
        return None;
    }
    let errors = errors(&problem, &found);
    let effects: Vec<&EffectSpec> = errors.iter().map(|error| &error.effect).collect();
    let longer = most_longer(model, &effects);
    let usual = cable_lengths(&Geometry::new(&model.parameters), &[0.0; 3]).into_iter().fold(f64::INFINITY, f64::min);
    if longer > MOST_OFF * usual {
        return None;
    }
    let [before, left] = [|m: &ChannelMisfit| m.before, |m: &ChannelMisfit| m.after]
        .map(|of| found.misfits.iter().map(of).fold(0.0, f64::max));
    let remark = format!(
        "The lengths cannot be read by the geometry as given, which misses one by {before:.3} m where they fit it best. It was corrected \
         before the search, as `cdpr calibrate` does (calibration in discovery.json): in the middle of the workspace a cable is up to \
         {longer:.3} m longer or shorter, and {left:.4} m are left. What is called the model as given has this geometry."
    );
    Some(Corrected { model: found.model, errors, remark })
}

/// The recordings without lengths that say something of the geometry only with a force.
fn kinematics_alone(model: &Model, trials: &[Trial]) -> Vec<Trial> {
    let mut trials = trials.to_vec();
    if model.parameters.cable_model != CableModel::Rigid {
        trials.iter_mut().for_each(|t| t.drop_channels(|channel| matches!(channel, Channel::UnstretchedLength(_))));
    }
    trials
}

/// Corrections as errors of the survey; with a standard error where all of it is told.
fn errors(problem: &Problem, found: &Calibration) -> Vec<SurveyError> {
    let of = |first: usize, unknown: &Unknown| {
        let (id, channel, count) = match unknown {
            Unknown::Anchor(_, 0) => ("anchor_offset", None, 2),
            Unknown::Attachment(_, 0) => ("attachment_offset", None, 2),
            // The second coordinate stands with the first.
            Unknown::Anchor(..) | Unknown::Attachment(..) => return None,
            Unknown::Offset(Channel::CableLength(_)) => ("length_sensor_bias", Some("cable_length"), 1),
            Unknown::Offset(_) => ("length_sensor_bias", Some("unstretched_length"), 1),
        };
        let own = &found.corrections[first..first + count];
        let values: Vec<f64> = own.iter().map(|correction| correction.change).collect();
        let effect = EffectSpec::new(id, Some(unknown.cable() + 1), &values);
        let effect = effect.unwrap_or_else(|e| unreachable!("an effect of our own: {e}"));
        let standard_error = own.iter().map(|c| (c.told >= TOLD).then_some(c.standard_error)).collect();
        Some(SurveyError { effect: EffectSpec { channel: channel.map(str::to_owned), ..effect }, standard_error })
    };
    problem.unknowns.iter().enumerate().filter_map(|(k, unknown)| of(k, unknown)).collect()
}

#[cfg(test)]
mod tests {
    use super::super::tests::{laboratory, point, recorded, shifted};
    use super::*;

    /// A point on four cables, the same as it is, with anchors and zeros centimetres off, and a recording of that, of lengths alone.
    fn robot(zero: f64) -> (Model, Trial) {
        let given = point();
        let mut real = shifted(&given, [[0.02, -0.03], [-0.03, 0.02], [0.03, 0.02], [-0.02, 0.03]]);
        for cable in 0..4 {
            let off = zero * if cable % 2 == 0 { 1.0 } else { -1.0 };
            let bias = EffectSpec::new("length_sensor_bias", Some(cable + 1), &[off]).expect("an effect");
            real.effects.push(EffectSpec { channel: Some("cable_length".to_owned()), ..bias });
        }
        let mut trial = recorded(&real, [1.0, 1.0, 0.0], 600, 1, true);
        trial.drop_channels(|channel| !matches!(channel, Channel::CableLength(_)));
        (given, trial)
    }

    /// The logs of a real robot were refused as lengths that count from another zero.
    #[test]
    fn lengths_alone_correct_what_they_cannot_be_read_by() {
        let (given, trial) = robot(0.06);
        let found = correct_before_search(&given, std::slice::from_ref(&trial)).expect("corrections");
        assert!(found.remark.contains("corrected before the search"), "{}", found.remark);
        assert_eq!(found.errors.len(), 8);
        for error in found.errors.iter().filter(|error| error.effect.id == "anchor_offset") {
            let cable = error.effect.cable.expect("a cable") - 1;
            for (axis, value) in error.effect.values.iter().enumerate() {
                let at = |model: &Model| model.parameters.cable[cable].anchor[axis];
                assert!((at(&found.model) - at(&given) - value).abs() < 1e-12, "{error:?}");
            }
        }
    }

    #[test]
    fn an_encoder_that_counts_from_far_away_is_no_error_of_a_survey() {
        let (given, trial) = robot(0.6);
        assert!(correct_before_search(&given, &[trial]).is_none());
    }

    /// With the pose the zeros are what the check says, and the rest is found with the laws; and where a force stretches the
    /// cables the force may be at fault.
    #[test]
    fn nothing_is_corrected_beside_a_pose_or_by_a_force() {
        let given = laboratory(8);
        let mut real = given.clone();
        real.parameters.cable.iter_mut().for_each(|cable| cable.anchor[0] += 0.05 * cable.anchor[1]);
        let trial = recorded(&real, [0.8, 0.7, 0.5], 600, 1, true);
        assert!(correct_before_search(&given, std::slice::from_ref(&trial)).is_none());
        let mut stretched = trial;
        stretched.drop_channels(|channel| !matches!(channel, Channel::UnstretchedLength(_)));
        assert!(correct_before_search(&given, &[stretched]).is_none());
    }
}
