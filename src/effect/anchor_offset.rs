//! Anchor offset: A_i + (x, y).

use super::{DependsOn, Effect, EffectInfo, EffectSpec, LookAlike, Scope, Site, SpecError, Stage, parameter};
use crate::dynamics::PlantData;
use crate::per_cable::PerCable;

/// Anchor offset: A_i + (x, y).
///
/// Shows in: cable length against pose.
///
/// Valid for: constant survey error.
///
/// Source: A. Pott, Cable-Driven Parallel Robots: Theory and Application, 2018.
#[derive(Clone, Debug)]
pub struct AnchorOffset {
    x: f64,
    y: f64,
}

impl Effect for AnchorOffset {
    const INFO: EffectInfo = EffectInfo {
        id: "anchor_offset",
        title: "Anchor offset",
        equation: "A_i + (x, y)",
        law: |v, n| format!("A_i + ({}, {})", n(v[0]), n(v[1])),
        scope: Scope::EachCable,
        site: Site::Anchor,
        depends_on: &[DependsOn::Position],
        parameters: &[
            parameter("x", "m", "offset along x", (-2.0, 2.0)).or(0.0),
            parameter("y", "m", "offset along y", (-2.0, 2.0)).or(0.0),
        ],
        texts: &[],
        shows_in: "cable length against pose",
        source: "A. Pott, Cable-Driven Parallel Robots: Theory and Application, 2018",
        validity: "constant survey error",
        look_alikes: &[
            LookAlike { id: "length_sensor_bias", separate_by: "poses that turn the cable" },
            LookAlike { id: "attachment_offset", separate_by: "rotate the platform" },
        ],
    };

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        Ok(Self { x: spec.values[0], y: spec.values[1] })
    }

    fn stage(&self) -> Stage {
        Stage::Parameters
    }

    fn change(&self, data: &mut PlantData, cables: &PerCable<bool>) {
        for (anchor, _) in data.geometry.anchor.iter_mut().zip(cables).filter(|(_, on)| **on) {
            anchor[0] += self.x;
            anchor[1] += self.y;
        }
    }
}
