//! Scale error of the winch encoder: measured (1 + factor) l_i (drum radius error).

use super::{DependsOn, Effect, EffectInfo, EffectSpec, LookAlike, Scope, Site, SpecError, Stage, parameter, signed};

/// Scale error of the winch encoder: measured (1 + factor) l_i (drum radius error).
///
/// Shows in: measured unstretched length in proportion to length.
///
/// Valid for: single-layer drum of constant radius.
///
/// Source: A. Pott, Cable-Driven Parallel Robots: Theory and Application, 2018.
#[derive(Clone, Debug)]
pub struct LengthSensorScale {
    factor: f64,
}

impl Effect for LengthSensorScale {
    const INFO: EffectInfo = EffectInfo {
        id: "length_sensor_scale",
        title: "Scale error of the winch encoder",
        equation: "measured (1 + factor) l_i (drum radius error)",
        law: |v, n| format!("measured (1 {}) l_i", signed(v[0], n)),
        scope: Scope::EachCable,
        site: Site::LengthSensor,
        depends_on: &[DependsOn::Position],
        parameters: &[
            parameter("factor", "1", "relative error of the drum radius", (-5e-3, 5e-3)).at_least(-0.5),
        ],
        texts: &[],
        shows_in: "measured unstretched length in proportion to length",
        source: "A. Pott, Cable-Driven Parallel Robots: Theory and Application, 2018",
        validity: "single-layer drum of constant radius",
        look_alikes: &[
            LookAlike { id: "cable_stiffness", separate_by: "several poses at two pretensions" },
            LookAlike { id: "length_sensor_bias", separate_by: "a wide range of lengths" },
        ],
    };

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        Ok(Self { factor: spec.values[0] })
    }

    fn stage(&self) -> Stage {
        Stage::Sensor
    }

    fn length_sensor(&self) -> (f64, f64) {
        (1.0 + self.factor, 0.0)
    }
}
