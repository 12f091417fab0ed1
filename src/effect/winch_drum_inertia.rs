//! Drum inertia: J/r² added to the lumped mass (rigid: to the axial inertia).

use super::{DependsOn, Effect, EffectInfo, EffectSpec, LookAlike, Scope, Site, SpecError, Stage, parameter};
use crate::dynamics::PlantData;
use crate::per_cable::PerCable;

/// Drum inertia: J/r² added to the lumped mass (rigid: to the axial inertia).
///
/// Shows in: unstretched length after a jump of the winch force; frequency of that cable's mode.
///
/// Valid for: drum and gear turning with the cable, no slip.
///
/// Source: A. Pott, Cable-Driven Parallel Robots: Theory and Application, 2018.
#[derive(Clone, Debug)]
pub struct WinchDrumInertia {
    mass: f64,
}

impl Effect for WinchDrumInertia {
    const INFO: EffectInfo = EffectInfo {
        id: "winch_drum_inertia",
        title: "Drum inertia",
        equation: "J/r² added to the lumped mass (rigid: to the axial inertia)",
        law: |v, n| format!("J/r² = {}", n(v[0])),
        scope: Scope::EachCable,
        site: Site::Winch,
        depends_on: &[DependsOn::Acceleration],
        parameters: &[
            parameter("mass", "kg", "drum inertia J over the radius squared", (1.0, 2e3)).at_least(0.0),
        ],
        texts: &[],
        shows_in: "unstretched length after a jump of the winch force; frequency of that cable's mode",
        source: "A. Pott, Cable-Driven Parallel Robots: Theory and Application, 2018",
        validity: "drum and gear turning with the cable, no slip",
        look_alikes: &[
            LookAlike { id: "winch_force_gain", separate_by: "higher frequency" },
        ],
    };

    const GIVES_WINCH_MASS: bool = true;
    /// It can leave one cable lumped beside massless ones.
    const COUPLES_CABLES: bool = true;

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        Ok(Self { mass: spec.values[0] })
    }

    fn stage(&self) -> Stage {
        Stage::Parameters
    }

    fn change(&self, data: &mut PlantData, cables: &PerCable<bool>) {
        for (cable, _) in data.cables.iter_mut().zip(cables).filter(|(_, on)| **on) {
            cable.drum_mass += self.mass;
        }
    }
}
