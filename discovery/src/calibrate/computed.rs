//! Poses that were computed from lengths, and not measured.
//!
//! A controller that has no other instrument logs the pose that some of the lengths say, by the geometry that it believes in.
//! As a measurement it counts these lengths twice, and the others, which are off, against a geometry that nobody surveyed.

use cdpr::model_file::Model;

use super::problem::Problem;
use crate::data::{Channel, Trial};

/// Misfit of a length, in standard deviations of its noise and the pose's, below which these are no two noises.
const ONE_NOISE: f64 = 0.3;
/// Largest misfit of a length that may say the pose, and how many times more is left of the others with anchors that suit them best.
const MAY_SAY_IT: f64 = 1.5;
/// Least misfit of the others with the model as given: no survey is off so little for the one and so much for the other.
const IS_OFF: f64 = 10.0;

/// A pose that some lengths say and the others do not.
struct Said {
    axes: Vec<Channel>,
    by: Vec<Channel>,
    others: Vec<Channel>,
    /// Whether no measurement does that, or one of another geometry may.
    certain: bool,
}

impl Said {
    /// By as many lengths as axes, the others by none: to less than the noise with the model as given; to the noise with whatever
    /// anchors suit each length by itself, which suit none of several others; or to it with the model as given, by which several
    /// others are far off. One length may have a fault of its own.
    fn of(model: &Model, trial: &Trial) -> Option<Self> {
        let axes: Vec<Channel> = (0..3).map(Channel::Pose).filter(|c| trial.channels.contains(c)).collect();
        // Where no equations can be made, on pulleys or without lengths, there is nothing to compare; a calibration says why.
        let problem = Problem::new(model, std::slice::from_ref(trial)).ok().filter(|_| !axes.is_empty())?;
        let lengths = problem.lengths();
        let misfits = |of: &dyn Fn(Channel) -> f64| lengths.iter().map(|c| (*c, of(*c))).collect::<Vec<_>>();
        let parted = |misfits: &[(Channel, f64)], below: f64, above: f64, fewest: usize| {
            let (by, others): (Vec<_>, Vec<_>) = misfits.iter().partition(|(_, misfit)| *misfit < below);
            let told =
                by.len() == axes.len() && others.len() >= fewest && others.iter().all(|(_, misfit)| *misfit > above);
            let channels = |list: Vec<(Channel, f64)>| list.into_iter().map(|(channel, _)| channel).collect();
            told.then(|| (channels(by), channels(others)))
        };
        let given = misfits(&|channel| problem.misfit_as_given(channel));
        let with_any_anchors = || {
            let alone = misfits(&|channel| problem.misfit_alone(channel));
            let worst =
                alone.iter().map(|(_, misfit)| *misfit).filter(|misfit| *misfit < MAY_SAY_IT).fold(1.0, f64::max);
            parted(&alone, MAY_SAY_IT, MAY_SAY_IT * worst, 2)
        };
        let several = lengths.len() > axes.len() + 1;
        let certain = parted(&given, ONE_NOISE, ONE_NOISE, 1)
            .or_else(|| (several && problem.pose_is_measured()).then(with_any_anchors).flatten());
        let is_certain = certain.is_some();
        let (by, others) = certain.or_else(|| parted(&given, MAY_SAY_IT, IS_OFF, 2))?;
        Some(Self { axes, by, others, certain: is_certain })
    }

    fn words(&self) -> String {
        let names = |list: &[Channel]| list.iter().map(|c| c.name()).collect::<Vec<_>>().join(", ");
        let [axes, by, others] = [&self.axes, &self.by, &self.others].map(|list| names(list));
        format!("{axes} are what {by} say, to their noise, and not what {others} say.")
    }
}

/// A remark where a pose may have been computed.
pub(crate) fn computed_pose(model: &Model, trial: &Trial) -> Option<String> {
    let words = Said::of(model, trial)?.words();
    Some(format!(
        "{words} If nobody measured the pose, and it was computed from these, leave its columns out: it is no second instrument."
    ))
}

/// Takes poses that nobody measured out of recordings of one machine, of all where it shows in one; a remark that says so.
pub(crate) fn leave_out_computed_poses<'a>(
    model: &Model,
    trials: impl Iterator<Item = &'a mut Trial>,
) -> Option<String> {
    let mut trials: Vec<&mut Trial> = trials.collect();
    let (name, said) = trials
        .iter()
        .find_map(|trial| Said::of(model, trial).filter(|said| said.certain).map(|said| (trial.name.clone(), said)))?;
    trials.iter_mut().for_each(|trial| trial.drop_channels(|channel| matches!(channel, Channel::Pose(_))));
    Some(format!(
        "{name}: {} They were computed from these and nobody measured them: they count as not measured.",
        said.words()
    ))
}

#[cfg(test)]
mod tests {
    use super::super::calibrate;
    use super::super::tests::{PULL, laboratory, point, recorded, shifted};
    use super::*;
    use crate::model::examined::gauss_newton_pose;

    /// A real robot's log has the position by two of its four lengths and the anchors of its firmware.
    #[test]
    fn a_pose_that_was_computed_is_told_from_one_that_was_measured() {
        let given = laboratory(8);
        let measured = recorded(&given, [1.0, 1.0, 0.3], 300, 1, false);
        let off = |cables: std::ops::RangeInclusive<usize>, trial: &Trial| {
            let mut trial = trial.clone();
            trial.measured.iter_mut().for_each(|row| cables.clone().for_each(|cable| row[2 + cable] += 0.05));
            computed_pose(&given, &trial)
        };
        assert_eq!(computed_pose(&given, &measured), None);
        let seen = off(4..=8, &measured).expect("a remark");
        let lengths = [1, 2, 3].map(|cable| format!("unstretched_length[{cable}]")).join(", ");
        assert!(seen.starts_with(&format!("x, y, phi are what {lengths} say")), "{seen}");
        assert_eq!(off(3..=8, &measured), None);
    }

    /// A point on four cables, whose controller has the position by lengths 1 and 4 and anchors 1 and 4 of its firmware, which are off.
    /// Corrected, these lengths do not say it any more.
    #[test]
    fn a_pose_that_was_computed_is_left_out_also_beside_a_corrected_geometry() {
        let given = point();
        let real = shifted(&given, [[0.15, -0.1], [-0.1, 0.1], [0.1, 0.05], [-0.1, 0.15]]);
        let mut measured = recorded(&real, [0.7, 0.7, 0.0], 600, 1, true);
        measured.drop_channels(|channel| matches!(channel, Channel::Pose(2) | Channel::UnstretchedLength(_)));
        let geometry = cdpr::geometry::Geometry::new(&given.parameters);
        let mut computed = measured.clone();
        for row in &mut computed.measured {
            let lengths = [Some(row[2]), None, None, Some(row[5])];
            let pose = gauss_newton_pose(&geometry, &lengths, &[None, None, Some(0.0)], [row[0], row[1], 0.0]);
            row[..2].copy_from_slice(&pose[..2]);
        }
        for model in [&given, &real] {
            let mut trials = [measured.clone(), computed.clone()];
            let said = leave_out_computed_poses(model, trials[1..].iter_mut()).expect("a remark");
            assert!(said.starts_with("made: x, y are what cable_length[1], cable_length[4] say"), "{said}");
            assert!(said.contains("not what cable_length[2], cable_length[3] say"), "{said}");
            assert_eq!(trials[1].channels, (0..4).map(Channel::CableLength).collect::<Vec<_>>());
            assert_eq!(leave_out_computed_poses(model, trials[..1].iter_mut()), None);
        }
        let found = calibrate(&given, &[computed]).expect("a calibration");
        assert!(found.remarks[0].contains("count as not measured"), "{:?}", found.remarks);
        assert!(found.misfits.iter().all(|misfit| misfit.after < 1e-3), "{:?}", found.misfits);
    }

    /// One length by itself may have a bias: only a pose without a noise of its own is computed then.
    #[test]
    fn a_length_with_a_bias_is_no_computed_pose() {
        let given = laboratory(4);
        let mut trial = recorded(&given, [1.0, 1.0, 0.3], 300, 1, false);
        trial.measured.iter_mut().for_each(|row| row[4] += 0.05);
        assert_eq!(computed_pose(&given, &trial), None);
        let geometry = cdpr::geometry::Geometry::new(&given.parameters);
        for row in &mut trial.measured {
            let lengths = cdpr::kinematics::cable_lengths(&geometry, &[row[0], row[1], row[2]]);
            [0, 2, 3].into_iter().for_each(|cable| {
                row[3 + cable] = lengths[cable] / (1.0 + PULL / given.parameters.axial_stiffness());
            });
        }
        assert!(computed_pose(&given, &trial).is_some());
    }
}
