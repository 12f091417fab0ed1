//! Attachment offset: B_i + (x, y) in the body frame.

use super::{DependsOn, Effect, EffectInfo, EffectSpec, LookAlike, Scope, Site, SpecError, Stage, parameter};
use crate::dynamics::PlantData;
use crate::per_cable::PerCable;

/// Attachment offset: B_i + (x, y) in the body frame.
///
/// Shows in: cable length against orientation.
///
/// Valid for: constant survey error.
///
/// Source: A. Pott, Cable-Driven Parallel Robots: Theory and Application, 2018.
#[derive(Clone, Debug)]
pub struct AttachmentOffset {
    x: f64,
    y: f64,
}

impl Effect for AttachmentOffset {
    const INFO: EffectInfo = EffectInfo {
        id: "attachment_offset",
        title: "Attachment offset",
        equation: "B_i + (x, y) in the body frame",
        law: |v, n| format!("B_i + ({}, {}) in the body frame", n(v[0]), n(v[1])),
        scope: Scope::EachCable,
        site: Site::Attachment,
        depends_on: &[DependsOn::Position],
        parameters: &[
            parameter("x", "m", "offset along the body's x axis", (-0.5, 0.5)).or(0.0),
            parameter("y", "m", "offset along the body's y axis", (-0.5, 0.5)).or(0.0),
        ],
        texts: &[],
        shows_in: "cable length against orientation",
        source: "A. Pott, Cable-Driven Parallel Robots: Theory and Application, 2018",
        validity: "constant survey error",
        look_alikes: &[
            LookAlike { id: "anchor_offset", separate_by: "rotate the platform" },
        ],
    };

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        Ok(Self { x: spec.values[0], y: spec.values[1] })
    }

    fn stage(&self) -> Stage {
        Stage::Parameters
    }

    fn change(&self, data: &mut PlantData, cables: &PerCable<bool>) {
        for (attachment, _) in data.geometry.attachment.iter_mut().zip(cables).filter(|(_, on)| **on) {
            attachment[0] += self.x;
            attachment[1] += self.y;
        }
    }
}
