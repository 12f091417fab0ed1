//! Scale error of the pose sensor: measured (1 + factor) p.

use super::{DependsOn, Effect, EffectInfo, EffectSpec, LookAlike, Scope, Site, SpecError, Stage, parameter, signed};
use crate::pose_sensor::PoseSensor;

/// Scale error of the pose sensor: measured (1 + factor) p.
///
/// Cameras know lengths by the size of their calibration board, trackers by the speed of light in air of an assumed temperature and
/// pressure (1 K is 1e-6). Positions are `1 + factor` times as far from the origin of the sensor's frame; angles are as they are.
/// `pose_sensor_bias` is added to what this effect leaves.
///
/// Shows in: measured position against all cable lengths, more the farther out.
///
/// Valid for: constant over the trial, the same along all directions.
///
/// Source: R. Hartley, A. Zisserman, Multiple View Geometry in Computer Vision, 2004, section 10.2 (similarity ambiguity); J. M.
/// Rüeger, Electronic Distance Measurement, 1996 (scale by refraction).
#[derive(Clone, Debug)]
pub struct PoseSensorScale {
    factor: f64,
}

impl Effect for PoseSensorScale {
    const INFO: EffectInfo = EffectInfo {
        id: "pose_sensor_scale",
        title: "Scale error of the pose sensor",
        equation: "measured (1 + factor) p",
        law: |v, n| format!("measured (1 {}) p", signed(v[0], n)),
        scope: Scope::Whole,
        site: Site::PoseSensor,
        depends_on: &[DependsOn::Position],
        parameters: &[parameter("factor", "1", "relative error of the measured position", (-5e-3, 5e-3)).at_least(-0.5)],
        texts: &[],
        shows_in: "measured position against all cable lengths, more the farther out",
        source: "R. Hartley, A. Zisserman, Multiple View Geometry in Computer Vision, 2004, section 10.2; J. M. Rüeger, Electronic Distance Measurement, 1996",
        validity: "constant over the trial, the same along all directions",
        look_alikes: &[
            LookAlike { id: "length_sensor_scale", separate_by: "a survey of the anchors: lengths of all cables and anchors too short by as much look the same" },
            LookAlike { id: "pose_sensor_bias", separate_by: "places far from each other" },
        ],
    };

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        Ok(Self { factor: spec.values[0] })
    }

    fn stage(&self) -> Stage {
        Stage::Sensor
    }

    fn pose_sensor(&self, sensor: &mut PoseSensor) {
        sensor.stretch = self.factor;
    }
}
