//! Offset of the centre of mass: centre of mass at G + R(φ) c.

use super::{Axis, DependsOn, Effect, EffectInfo, EffectSpec, Scope, Site, SpecError, Stage, parameter};
use crate::dynamics::PlantData;
use crate::per_cable::PerCable;

/// Offset of the centre of mass: centre of mass at G + R(φ) c.
///
/// Shows in: torque on the platform against its acceleration, force against angular acceleration.
///
/// Valid for: rigid platform; the moment of inertia stays that about the centre of mass.
///
/// Source: H. Goldstein, C. Poole, J. Safko, Classical Mechanics, 3rd ed., 2002 (rigid body motion).
#[derive(Clone, Debug)]
pub struct PlatformComOffset {
    x: f64,
    y: f64,
}

impl Effect for PlatformComOffset {
    const INFO: EffectInfo = EffectInfo {
        id: "platform_com_offset",
        title: "Offset of the centre of mass",
        equation: "centre of mass at G + R(φ) c",
        law: |v, n| format!("centre of mass at G + R(φ) ({}, {})", n(v[0]), n(v[1])),
        scope: Scope::Whole,
        site: Site::Platform(&[Axis::ForceX, Axis::ForceY, Axis::Torque]),
        depends_on: &[DependsOn::Acceleration],
        parameters: &[
            parameter("x", "m", "c along the body's x axis", (-1.0, 1.0)).or(0.0),
            parameter("y", "m", "c along the body's y axis", (-1.0, 1.0)).or(0.0),
        ],
        texts: &[],
        shows_in: "torque on the platform against its acceleration, force against angular acceleration",
        source: "H. Goldstein, C. Poole, J. Safko, Classical Mechanics, 3rd ed., 2002 (rigid body motion)",
        validity: "rigid platform; the moment of inertia stays that about the centre of mass",
        look_alikes: &[
        ],
    };

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        Ok(Self { x: spec.values[0], y: spec.values[1] })
    }

    fn stage(&self) -> Stage {
        Stage::Parameters
    }

    fn change(&self, data: &mut PlantData, _cables: &PerCable<bool>) {
        data.centre_of_mass[0] += self.x;
        data.centre_of_mass[1] += self.y;
    }
}
