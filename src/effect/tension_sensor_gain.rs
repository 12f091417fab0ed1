//! Gain error of a tension sensor: measured (1 + factor) T_i.

use super::{DependsOn, Effect, EffectInfo, EffectSpec, LookAlike, Scope, Site, SpecError, Stage, parameter, signed};

/// Gain error of a tension sensor: measured (1 + factor) T_i.
///
/// Shows in: measured tension in proportion to tension.
///
/// Valid for: a linear force sensor in the line of its cable; a sensor at a pulley has the wrap's angle in its factor.
///
/// Source: W. Kraus, V. Schmidt, P. Rajendra, A. Pott, System identification and cable force control for a cable robot with
/// industrial servo drives, IEEE ICRA 2014.
#[derive(Clone, Debug)]
pub struct TensionSensorGain {
    factor: f64,
}

impl Effect for TensionSensorGain {
    const INFO: EffectInfo = EffectInfo {
        id: "tension_sensor_gain",
        title: "Gain error of the tension sensor",
        equation: "measured (1 + factor) T_i",
        law: |v, n| format!("measured (1 {}) T_i", signed(v[0], n)),
        scope: Scope::EachCable,
        site: Site::TensionSensor,
        depends_on: &[DependsOn::Tension],
        parameters: &[
            parameter("factor", "1", "relative error of the measured tension", (-0.05, 0.05)).at_least(-0.9),
        ],
        texts: &[],
        shows_in: "measured tension in proportion to tension",
        source: "W. Kraus, V. Schmidt, P. Rajendra, A. Pott, System identification and cable force control for a cable robot with industrial servo drives, IEEE ICRA 2014",
        validity: "a linear force sensor in the line of its cable; a sensor at a pulley has the wrap's angle in its factor",
        look_alikes: &[
            LookAlike { id: "tension_sensor_bias", separate_by: "a wide range of tensions" },
            LookAlike { id: "cable_stiffness", separate_by: "the motion: a sensor's error does not touch it" },
        ],
    };

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        Ok(Self { factor: spec.values[0] })
    }

    fn stage(&self) -> Stage {
        Stage::Sensor
    }

    fn tension_sensor(&self) -> (f64, f64) {
        (1.0 + self.factor, 0.0)
    }
}
