//! Cable damping error: bl_i (1 + factor).

use super::{DependsOn, Effect, EffectInfo, EffectSpec, LookAlike, Scope, Site, SpecError, Stage, parameter, signed};
use crate::dynamics::PlantData;
use crate::per_cable::PerCable;

/// Cable damping error: bl_i (1 + factor).
///
/// Shows in: decay of the cable's axial mode after a jump of its winch force.
///
/// Valid for: elastic cable models; damping of braided rope depends on tension and length, reported values differ tenfold.
///
/// Source: C. M. Lambert, Dynamics and control of a multi-tethered aerostat positioning system, McGill University, 2006.
#[derive(Clone, Debug)]
pub struct CableDamping {
    factor: f64,
}

impl Effect for CableDamping {
    const INFO: EffectInfo = EffectInfo {
        id: "cable_damping",
        title: "Cable damping error",
        equation: "bl_i (1 + factor)",
        law: |v, n| format!("bl_i (1 {})", signed(v[0], n)),
        scope: Scope::EachCable,
        site: Site::Cable,
        depends_on: &[DependsOn::Speed],
        parameters: &[
            parameter("factor", "1", "relative error of the damping b l", (-0.9, 5.0)).at_least(-1.0),
        ],
        texts: &[],
        shows_in: "decay of the cable's axial mode after a jump of its winch force",
        source: "C. M. Lambert, Dynamics and control of a multi-tethered aerostat positioning system, McGill University, 2006",
        validity: "elastic cable models; damping of braided rope depends on tension and length, reported values differ tenfold",
        look_alikes: &[
            LookAlike { id: "winch_viscous_friction", separate_by: "ring-down with the winch locked" },
        ],
    };

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        Ok(Self { factor: spec.values[0] })
    }

    fn stage(&self) -> Stage {
        Stage::Parameters
    }

    fn change(&self, data: &mut PlantData, cables: &PerCable<bool>) {
        for (cable, _) in data.cables.iter_mut().zip(cables).filter(|(_, on)| **on) {
            cable.damping *= 1.0 + self.factor;
        }
    }
}
