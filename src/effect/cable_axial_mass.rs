//! Axial mass at the platform end of the cables: -m/2 L L̈ along S.

use super::{DependsOn, Effect, EffectInfo, EffectSpec, LookAlike, Scope, Site, SpecError, Stage, parameter};
use crate::dynamics::PlantData;
use crate::per_cable::PerCable;

/// Axial mass at the platform end of the cables: -m/2 L L̈ along S.
///
/// Shows in: force on the platform along the cables against the rate of their lengths' rates.
///
/// Valid for: frequencies well below those of axial waves, π/L √(EA/m).
///
/// Source: M. Hall, A. Goupee, Ocean Engineering 104 (2015) (lumped-mass line: half of a segment's mass at each end).
///
/// The model's own cable has its mass along the cable at the winch only. Lumped at both ends, half of it moves with each.
#[derive(Clone, Debug)]
pub struct CableAxialMass {
    linear_density: f64,
}

impl Effect for CableAxialMass {
    const INFO: EffectInfo = EffectInfo {
        id: "cable_axial_mass",
        title: "Axial mass at the platform end of the cables",
        equation: "-m/2 L L̈ along S",
        law: |v, n| format!("-{}/2 L L̈ along S", n(v[0])),
        scope: Scope::EachCable,
        site: Site::Cable,
        depends_on: &[DependsOn::Acceleration],
        parameters: &[
            parameter("linear_density", "kg/m", "mass m per length, half of which counts", (0.02, 5.0)).at_least(0.0),
        ],
        texts: &[],
        shows_in: "force on the platform along the cables against the rate of their lengths' rates",
        source: "M. Hall, A. Goupee, Ocean Engineering 104 (2015) (lumped-mass line: half of a segment's mass at each end)",
        validity: "frequencies well below those of axial waves, π/L √(EA/m)",
        look_alikes: &[
            LookAlike { id: "winch_drum_inertia", separate_by: "motion near the cable modes: a drum slows them" },
            LookAlike { id: "platform_mass", separate_by: "rotation; one winch excited at a time" },
            LookAlike { id: "platform_inertia", separate_by: "translation; one winch excited at a time" },
        ],
    };

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        Ok(Self { linear_density: spec.values[0] })
    }

    fn stage(&self) -> Stage {
        Stage::Parameters
    }

    fn change(&self, data: &mut PlantData, cables: &PerCable<bool>) {
        for (cable, _) in data.cables.iter_mut().zip(cables).filter(|(_, on)| **on) {
            cable.end_density += 0.5 * self.linear_density;
        }
    }
}
