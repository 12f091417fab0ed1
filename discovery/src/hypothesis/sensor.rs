//! What sensors of the pose may do: how late they are.

use cdpr::effect::{EffectSpec, SpecError};

const POSE_DELAY: &str = "pose_sensor_delay";

/// A pose that is `late` (s).
pub(crate) fn pose_delay(late: f64) -> Result<EffectSpec, SpecError> {
    EffectSpec::new(POSE_DELAY, None, &[late])
}
