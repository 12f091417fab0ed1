//! Poses that were computed from lengths, and not measured.
//!
//! A controller that has no other instrument logs the pose that some of the lengths say, by the geometry that it believes in.
//! As a measurement it counts these lengths twice, and the others, which are off, against a geometry that nobody surveyed.

use cdpr::model_file::Model;

use super::problem::Problem;
use crate::data::{Channel, Trial};

/// Largest misfit of a length that says the pose, in standard deviations of its noise and the pose's.
const SAYS_IT: f64 = 1.5;
/// Least misfit of the other lengths: no survey is off so little for the one and so much for the other.
const IS_OFF: f64 = 10.0;

/// A remark where as many lengths as axes of the pose are recorded have the recorded pose to their noise with the model as given, and
/// all others are far off.
pub(crate) fn computed_pose(model: &Model, trial: &Trial) -> Option<String> {
    // Recordings without lengths, or on pulleys, have nothing to be compared.
    let problem = Problem::new(model, std::slice::from_ref(trial)).ok()?;
    let axes: Vec<Channel> = (0..3).map(Channel::Pose).filter(|c| trial.channels.contains(c)).collect();
    let (mut say_it, mut off) = (Vec::new(), Vec::new());
    for channel in problem.lengths() {
        match problem.misfit_as_given(channel) {
            misfit if misfit < SAYS_IT => say_it.push(channel),
            misfit if misfit > IS_OFF => off.push(channel),
            _ => return None,
        }
    }
    if off.is_empty() || axes.is_empty() || say_it.len() != axes.len() {
        return None;
    }
    let names = |channels: &[Channel]| channels.iter().map(|c| c.name()).collect::<Vec<_>>().join(", ");
    Some(format!(
        "{} are what {} say with the model as given, to their noise, while {} are far off. If nobody measured the pose, and it was \
         computed from these, leave its columns out: it is no second instrument.",
        names(&axes),
        names(&say_it),
        names(&off)
    ))
}

#[cfg(test)]
mod tests {
    use super::super::tests::{laboratory, recorded};
    use super::*;

    /// A real robot's log has the position by two of its four lengths, which its anchors are not far off for.
    #[test]
    fn a_pose_that_was_computed_is_told_from_one_that_was_measured() {
        let given = laboratory(4);
        let measured = recorded(&given, [1.0, 1.0, 0.3], 300, 1, false);
        assert_eq!(computed_pose(&given, &measured), None);
        let off = |cables: &[usize]| {
            let mut trial = measured.clone();
            trial.measured.iter_mut().for_each(|row| cables.iter().for_each(|cable| row[2 + cable] += 0.05));
            computed_pose(&given, &trial)
        };
        let seen = off(&[2]).expect("a remark");
        let lengths = "unstretched_length[1], unstretched_length[3], unstretched_length[4]";
        assert!(seen.starts_with(&format!("x, y, phi are what {lengths} say")), "{seen}");
        // Two that are off leave fewer than it takes to say a pose.
        assert_eq!(off(&[2, 3]), None);
    }
}
