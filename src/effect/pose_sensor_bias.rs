//! Bias of the pose sensor: measured x, y, phi + bias.

use super::{Effect, EffectInfo, EffectSpec, LookAlike, Scope, Site, SpecError, Stage, parameter};
use crate::pose_sensor::PoseSensor;

/// Bias of the pose sensor: measured x, y, phi + bias.
///
/// Shows in: measured pose against all cable lengths.
///
/// Valid for: constant over the trial.
///
/// Source: B. Hofmann-Wellenhof, H. Lichtenegger, E. Wasle, GNSS: Global Navigation Satellite Systems, 2008.
#[derive(Clone, Debug)]
pub struct PoseSensorBias {
    x: f64,
    y: f64,
    phi: f64,
}

impl Effect for PoseSensorBias {
    const INFO: EffectInfo = EffectInfo {
        id: "pose_sensor_bias",
        title: "Bias of the pose sensor",
        equation: "measured x, y, phi + bias",
        law: |v, n| format!("measured (x, y, φ) + ({}, {}, {})", n(v[0]), n(v[1]), n(v[2])),
        scope: Scope::Whole,
        site: Site::PoseSensor,
        depends_on: &[],
        parameters: &[
            parameter("x", "m", "bias of x", (-0.5, 0.5)).or(0.0),
            parameter("y", "m", "bias of y", (-0.5, 0.5)).or(0.0),
            parameter("phi", "rad", "bias of phi", (-0.05, 0.05)).or(0.0),
        ],
        texts: &[],
        shows_in: "measured pose against all cable lengths",
        source: "B. Hofmann-Wellenhof, H. Lichtenegger, E. Wasle, GNSS: Global Navigation Satellite Systems, 2008",
        validity: "constant over the trial",
        look_alikes: &[
            LookAlike { id: "anchor_offset", separate_by: "a survey: all anchors displaced together look the same" },
            LookAlike { id: "pose_sensor_frame", separate_by: "several orientations and places far from each other" },
        ],
    };

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        Ok(Self { x: spec.values[0], y: spec.values[1], phi: spec.values[2] })
    }

    fn stage(&self) -> Stage {
        Stage::Sensor
    }

    fn pose_sensor(&self, sensor: &mut PoseSensor) {
        sensor.bias = [self.x, self.y, self.phi];
    }
}
