//! Cable stiffness error: EA_i (1 + factor).

use super::{DependsOn, Effect, EffectInfo, EffectSpec, LookAlike, Scope, Site, SpecError, Stage, parameter, signed};
use crate::dynamics::PlantData;
use crate::per_cable::PerCable;

/// Cable stiffness error: EA_i (1 + factor).
///
/// Shows in: unstretched length against tension: the static stretch and the frequency of that cable's mode.
///
/// Valid for: elastic cable models; the manufacturer's modulus of a braided rope is known to 10-30 %.
///
/// Source: H. A. McKenna, J. W. S. Hearle, N. O'Hear, Handbook of Fibre Rope Technology, 2004.
#[derive(Clone, Debug)]
pub struct CableStiffness {
    factor: f64,
}

impl Effect for CableStiffness {
    const INFO: EffectInfo = EffectInfo {
        id: "cable_stiffness",
        title: "Cable stiffness error",
        equation: "EA_i (1 + factor)",
        law: |v, n| format!("EA_i (1 {})", signed(v[0], n)),
        scope: Scope::EachCable,
        site: Site::Cable,
        depends_on: &[DependsOn::Tension],
        parameters: &[
            parameter("factor", "1", "relative error of the axial stiffness", (-0.3, 0.3)).at_least(-0.95),
        ],
        texts: &[],
        shows_in: "unstretched length against tension: the static stretch and the frequency of that cable's mode",
        source: "H. A. McKenna, J. W. S. Hearle, N. O'Hear, Handbook of Fibre Rope Technology, 2004",
        validity: "elastic cable models; the manufacturer's modulus of a braided rope is known to 10-30 %",
        look_alikes: &[
            LookAlike { id: "anchor_offset", separate_by: "several poses at two pretensions" },
            LookAlike { id: "length_sensor_scale", separate_by: "several poses at two pretensions" },
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
            cable.axial_stiffness *= 1.0 + self.factor;
        }
    }
}
