//! Frame and point of the pose sensor: measured R(-θ) (G + R(φ) c), φ - θ.

use super::{DependsOn, Effect, EffectInfo, EffectSpec, LookAlike, Scope, Site, SpecError, Stage, parameter};
use crate::pose_sensor::PoseSensor;

/// Frame and point of the pose sensor: measured R(-θ) (G + R(φ) c), φ - θ.
///
/// A camera or laser tracker measures in a frame of its own, turned by `angle` θ (counter-clockwise) about the origin against that
/// of the anchors, and it measures where its mark or prism is, `(x, y)` from the platform's reference point in the body frame. A
/// milliradian is 0.1 m at 100 m. A shift of the frame is `pose_sensor_bias`, which is added to what this effect leaves.
///
/// Shows in: measured pose against all cable lengths, more the farther out; x and y as the platform turns.
///
/// Valid for: constant over the trial.
///
/// Source: B. Siciliano, L. Sciavicco, L. Villani, G. Oriolo, Robotics: Modelling, Planning and Control, 2009, section 2.7
/// (homogeneous transformations); lever arms: B. Hofmann-Wellenhof, H. Lichtenegger, E. Wasle, GNSS, 2008.
#[derive(Clone, Debug)]
pub struct PoseSensorFrame {
    angle: f64,
    point: [f64; 2],
}

impl Effect for PoseSensorFrame {
    const INFO: EffectInfo = EffectInfo {
        id: "pose_sensor_frame",
        title: "Frame and point of the pose sensor",
        equation: "measured R(-θ) (G + R(φ) c), φ - θ",
        law: |v, n| match v[1..] {
            [0.0, 0.0] => format!("measured R(-({})) G, φ - ({})", n(v[0]), n(v[0])),
            _ => format!("measured R(-({})) (G + R(φ) ({}, {})), φ - ({})", n(v[0]), n(v[1]), n(v[2]), n(v[0])),
        },
        scope: Scope::Whole,
        site: Site::PoseSensor,
        depends_on: &[DependsOn::Position],
        parameters: &[
            parameter("angle", "rad", "angle θ by which its frame is turned counter-clockwise", (-0.05, 0.05)).or(0.0),
            parameter("x", "m", "x of the measured point in the body frame, from the reference point", (-0.5, 0.5)).or(0.0).extension(),
            parameter("y", "m", "y of the measured point in the body frame, from the reference point", (-0.5, 0.5)).or(0.0).extension(),
        ],
        texts: &[],
        shows_in: "measured pose against all cable lengths, more the farther out; x and y as the platform turns",
        source: "B. Siciliano, L. Sciavicco, L. Villani, G. Oriolo, Robotics: Modelling, Planning and Control, 2009, section 2.7; B. Hofmann-Wellenhof, H. Lichtenegger, E. Wasle, GNSS: Global Navigation Satellite Systems, 2008",
        validity: "constant over the trial",
        look_alikes: &[
            LookAlike { id: "anchor_offset", separate_by: "a survey: all anchors turned together look the same" },
            LookAlike { id: "pose_sensor_bias", separate_by: "several orientations and places far from each other" },
        ],
    };

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        Ok(Self { angle: spec.values[0], point: [spec.values[1], spec.values[2]] })
    }

    fn stage(&self) -> Stage {
        Stage::Sensor
    }

    fn pose_sensor(&self, sensor: &mut PoseSensor) {
        (sensor.angle, sensor.point) = (self.angle, self.point);
    }
}
