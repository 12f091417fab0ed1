//! Delay of the pose sensor: measured pose at t - τ.

use super::{DependsOn, Effect, EffectInfo, EffectSpec, LookAlike, Scope, Site, SpecError, Stage, parameter};

/// Delay of the pose sensor: measured pose at t - τ.
///
/// Shows in: measured pose against cable lengths, in proportion to velocity.
///
/// Valid for: constant processing delay; before the start the pose is taken as constant.
///
/// Source: L. Ljung, System Identification: Theory for the User, 2nd ed., 1999.
#[derive(Clone, Debug)]
pub struct PoseSensorDelay {
    delay: f64,
}

impl Effect for PoseSensorDelay {
    const INFO: EffectInfo = EffectInfo {
        id: "pose_sensor_delay",
        title: "Delay of the pose sensor",
        equation: "measured pose at t - τ",
        law: |v, n| format!("measured pose at t - {}", n(v[0])),
        scope: Scope::Whole,
        site: Site::PoseSensor,
        depends_on: &[DependsOn::Speed],
        parameters: &[
            parameter("delay", "s", "delay τ", (1e-3, 1.0)).at_least(0.0),
        ],
        texts: &[],
        shows_in: "measured pose against cable lengths, in proportion to velocity",
        source: "L. Ljung, System Identification: Theory for the User, 2nd ed., 1999",
        validity: "constant processing delay; before the start the pose is taken as constant",
        look_alikes: &[
            LookAlike { id: "winch_delay", separate_by: "input against length" },
        ],
    };

    const ALWAYS: Option<&'static str> = Some("the poses that it holds back are those of all its past");

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        Ok(Self { delay: spec.values[0] })
    }

    fn stage(&self) -> Stage {
        Stage::Sensor
    }

    fn delay(&self) -> f64 {
        self.delay
    }
}
