//! Bias of a tension sensor: measured T_i + bias.

use super::{Effect, EffectInfo, EffectSpec, LookAlike, Scope, Site, SpecError, Stage, parameter, signed};

/// Bias of a tension sensor: measured T_i + bias, of a slack cable the bias alone.
///
/// Shows in: constant offset of a measured tension.
///
/// Valid for: a sensor whose zero does not drift during the trial.
///
/// Source: W. Kraus, V. Schmidt, P. Rajendra, A. Pott, System identification and cable force control for a cable robot with
/// industrial servo drives, IEEE ICRA 2014.
#[derive(Clone, Debug)]
pub struct TensionSensorBias {
    bias: f64,
}

impl Effect for TensionSensorBias {
    const INFO: EffectInfo = EffectInfo {
        id: "tension_sensor_bias",
        title: "Bias of the tension sensor",
        equation: "measured T_i + bias",
        law: |v, n| format!("measured T_i {}", signed(v[0], n)),
        scope: Scope::EachCable,
        site: Site::TensionSensor,
        depends_on: &[],
        parameters: &[
            parameter("bias", "N", "added to the measured tension", (-500.0, 500.0)),
        ],
        texts: &[],
        shows_in: "constant offset of a measured tension",
        source: "W. Kraus, V. Schmidt, P. Rajendra, A. Pott, System identification and cable force control for a cable robot with industrial servo drives, IEEE ICRA 2014",
        validity: "a sensor whose zero does not drift during the trial",
        look_alikes: &[
            LookAlike { id: "tension_sensor_gain", separate_by: "a wide range of tensions" },
            LookAlike { id: "winch_force_bias", separate_by: "the motion: a sensor's error does not touch it" },
        ],
    };

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        Ok(Self { bias: spec.values[0] })
    }

    fn stage(&self) -> Stage {
        Stage::Sensor
    }

    fn tension_sensor(&self) -> (f64, f64) {
        (1.0, self.bias)
    }
}
