//! Bias of a length sensor: measured length + bias (`channel`: unstretched_length or cable_length).

use super::{Effect, EffectInfo, EffectSpec, LookAlike, Scope, Site, SpecError, Stage, TextInfo, parameter, signed};

/// Bias of a length sensor: measured length + bias (`channel`: unstretched_length or cable_length).
///
/// Shows in: measured length against the length from pose or tension.
///
/// Valid for: constant over the trial.
///
/// Source: A. Pott, Cable-Driven Parallel Robots: Theory and Application, 2018.
#[derive(Clone, Debug)]
pub struct LengthSensorBias {
    bias: f64,
}

impl Effect for LengthSensorBias {
    const INFO: EffectInfo = EffectInfo {
        id: "length_sensor_bias",
        title: "Bias of a length sensor",
        equation: "measured length + bias (`channel`: unstretched_length or cable_length)",
        law: |v, n| format!("measured length {}", signed(v[0], n)),
        scope: Scope::EachCable,
        site: Site::LengthSensor,
        depends_on: &[],
        parameters: &[
            parameter("bias", "m", "length added by the sensor", (-0.5, 0.5)),
        ],
        texts: &[TextInfo {
            name: "channel",
            description: "the sensor, unstretched_length (default) or cable_length",
        }],
        shows_in: "measured length against the length from pose or tension",
        source: "A. Pott, Cable-Driven Parallel Robots: Theory and Application, 2018",
        validity: "constant over the trial",
        look_alikes: &[
            LookAlike { id: "anchor_offset", separate_by: "poses that turn the cable" },
            LookAlike { id: "cable_thermal_expansion", separate_by: "a trial over more than a period" },
        ],
    };

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        Ok(Self { bias: spec.values[0] })
    }

    fn stage(&self) -> Stage {
        Stage::Sensor
    }

    fn length_sensor(&self) -> (f64, f64) {
        (1.0, self.bias)
    }
}
