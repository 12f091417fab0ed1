//! Poses that were computed from lengths, and not measured.
//!
//! A controller that has no other instrument logs the pose that some of the lengths say, by the geometry that it believes in.
//! As a measurement it counts these lengths twice, and the others, which are off, against a geometry that nobody surveyed.

use cdpr::model_file::Model;

use super::problem::Problem;
use crate::data::{Channel, Trial};

/// Misfit of a length, in standard deviations of its noise and the pose's, below which these are no two noises.
const ONE_NOISE: f64 = 0.3;
/// Largest misfit of a length that may say the pose.
const MAY_SAY_IT: f64 = 1.5;
/// Least misfit of the others then: no survey is off so little for the one and so much for the other.
const IS_OFF: f64 = 10.0;

/// A remark where as many lengths as axes of the pose are recorded have the recorded pose with the model as given: to less than
/// their noise, or to their noise while several others, for one may have a fault of its own, are far off.
pub(crate) fn computed_pose(model: &Model, trial: &Trial) -> Option<String> {
    // Where no equations can be made, on pulleys or without lengths, there is nothing to compare; a calibration says why.
    let problem = Problem::new(model, std::slice::from_ref(trial)).ok()?;
    let axes: Vec<Channel> = (0..3).map(Channel::Pose).filter(|c| trial.channels.contains(c)).collect();
    let misfits: Vec<(Channel, f64)> =
        problem.lengths().into_iter().map(|channel| (channel, problem.misfit_as_given(channel))).collect();
    let (say_it, others) = [ONE_NOISE, MAY_SAY_IT].into_iter().find_map(|most| {
        let (say_it, others): (Vec<_>, Vec<_>) = misfits.iter().partition(|(_, misfit)| *misfit < most);
        let told = most == ONE_NOISE || others.len() > 1 && others.iter().all(|(_, misfit)| *misfit > IS_OFF);
        (told && !others.is_empty() && !axes.is_empty() && say_it.len() == axes.len()).then_some((say_it, others))
    })?;
    let names = |list: Vec<(Channel, f64)>| list.iter().map(|(c, _)| c.name()).collect::<Vec<_>>().join(", ");
    Some(format!(
        "{} are what {} say with the model as given, to their noise, and not what {} say. If nobody measured the pose, and it was \
         computed from these, leave its columns out: it is no second instrument.",
        axes.iter().map(|c| c.name()).collect::<Vec<_>>().join(", "),
        names(say_it),
        names(others)
    ))
}

#[cfg(test)]
mod tests {
    use super::super::tests::{PULL, laboratory, recorded};
    use super::*;

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
