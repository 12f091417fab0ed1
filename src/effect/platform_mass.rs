//! Platform mass error: M + ΔM.

use super::{Axis, DependsOn, Effect, EffectInfo, EffectSpec, LookAlike, Scope, Site, SpecError, Stage, parameter, signed};
use crate::dynamics::PlantData;
use crate::per_cable::PerCable;

/// Platform mass error: M + ΔM.
///
/// Shows in: force on the platform against its acceleration.
///
/// Valid for: payload fixed at the centre of mass.
///
/// Source: J. Swevers, W. Verdonck, J. De Schutter, Dynamic model identification for industrial robots, IEEE Control Systems Magazine 27 (2007).
#[derive(Clone, Debug)]
pub struct PlatformMass {
    mass: f64,
}

impl Effect for PlatformMass {
    const INFO: EffectInfo = EffectInfo {
        id: "platform_mass",
        title: "Platform mass error",
        equation: "M + ΔM",
        law: |v, n| format!("M {}", signed(v[0], n)),
        scope: Scope::Whole,
        site: Site::Platform(&[Axis::ForceX, Axis::ForceY]),
        depends_on: &[DependsOn::Acceleration],
        parameters: &[
            parameter("mass", "kg", "added mass ΔM", (-500.0, 500.0)),
        ],
        texts: &[],
        shows_in: "force on the platform against its acceleration",
        source: "J. Swevers, W. Verdonck, J. De Schutter, Dynamic model identification for industrial robots, IEEE Control Systems Magazine 27 (2007)",
        validity: "payload fixed at the centre of mass",
        look_alikes: &[
            LookAlike { id: "winch_force_gain", separate_by: "a common gain of all winches: change the tension at rest" },
        ],
    };

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        Ok(Self { mass: spec.values[0] })
    }

    fn stage(&self) -> Stage {
        Stage::Parameters
    }

    fn change(&self, data: &mut PlantData, _cables: &PerCable<bool>) {
        data.mass += self.mass;
    }
}
