//! Pulley of finite radius: L = √(d² - r²) - r (α - α_0), d from its axis A_i.

use super::{DependsOn, Effect, EffectInfo, EffectSpec, LookAlike, Scope, Site, SpecError, Stage, parameter};
use crate::dynamics::PlantData;
use crate::per_cable::PerCable;

/// Pulley of finite radius: L = √(d² - r²) - r (α - α_0), d from its axis A_i.
///
/// The anchor is the pulley's axis then, and the cable leaves the pulley on a tangent: its straight part `f = √(d² - r²)` begins at
/// `A + r N`. With `r > 0` it runs clockwise round the pulley towards the platform, so the axis is on its right; with `r < 0`
/// counter-clockwise. As its direction α turns, `r dα` of it comes off the pulley (or goes on, by the sign); that is counted from
/// α_0, its direction with the platform at `x = y = φ = 0`, so what lies on the pulley there, a constant, is in no length. The
/// cable pulls along the gradient of that length, and all goes over into the cable from the anchor as `r → 0`.
///
/// Shows in: cable length against pose, in proportion to the angle that the cable turns.
///
/// Valid for: a pulley that stands in the plane; cable directions within half a turn of α_0; the whole length strains alike, on
/// the pulley too; mass and inertia of the pulley are those of the winch.
///
/// Source: A. Pott, Cable-Driven Parallel Robots: Theory and Application, 2018, chapter 7 (pulley kinematics).
#[derive(Clone, Debug)]
pub struct PulleyRadius {
    radius: f64,
}

impl Effect for PulleyRadius {
    const INFO: EffectInfo = EffectInfo {
        id: "pulley_radius",
        title: "Pulley of finite radius",
        equation: "L = √(d² - r²) - r (α - α_0), d from its axis A_i",
        law: |v, n| format!("L = √(d² - {}²) - ({}) (α - α_0)", n(v[0]), n(v[0])),
        scope: Scope::EachCable,
        site: Site::Anchor,
        depends_on: &[DependsOn::Position],
        parameters: &[
            parameter("radius", "m", "radius r; > 0: the cable runs clockwise round it towards the platform", (-0.5, 0.5)),
        ],
        texts: &[],
        shows_in: "cable length against pose, in proportion to the angle that the cable turns",
        source: "A. Pott, Cable-Driven Parallel Robots: Theory and Application, 2018, chapter 7 (pulley kinematics)",
        validity: "a pulley that stands in the plane; cable directions within half a turn of α_0; the whole length strains alike; mass and inertia of the pulley are those of the winch",
        look_alikes: &[
            LookAlike { id: "anchor_offset", separate_by: "cables that turn by half a radian and more" },
        ],
    };

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        Ok(Self { radius: spec.values[0] })
    }

    fn stage(&self) -> Stage {
        Stage::Parameters
    }

    fn change(&self, data: &mut PlantData, cables: &PerCable<bool>) {
        for (radius, _) in data.geometry.pulley_radius.iter_mut().zip(cables).filter(|(_, on)| **on) {
            *radius += self.radius;
        }
    }
}
