//! Sensors of the pose: how late they are.

use cdpr::effect::{EffectSpec, SpecError};

const POSE_DELAY: &str = "pose_sensor_delay";

/// How late (s) an effect makes the pose; none where it does not.
pub(crate) fn lateness_of_pose(effect: &EffectSpec) -> Option<f64> {
    (effect.id == POSE_DELAY).then(|| effect.values[0])
}

/// A pose that is `late` (s).
pub(crate) fn pose_delay(late: f64) -> Result<EffectSpec, SpecError> {
    EffectSpec::new(POSE_DELAY, None, &[late])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_delay_of_the_pose_is_read_back() {
        let delay = pose_delay(0.02).expect("an effect");
        assert_eq!(lateness_of_pose(&delay), Some(0.02));
        let drag = EffectSpec::new("platform_linear_drag", None, &[3.0]).expect("an effect");
        assert_eq!(lateness_of_pose(&drag), None);
    }
}
