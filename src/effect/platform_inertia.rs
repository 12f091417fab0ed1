//! Platform inertia error: I + ΔI.

use super::{Axis, DependsOn, Effect, EffectInfo, EffectSpec, LookAlike, Scope, Site, SpecError, Stage, parameter, signed};
use crate::dynamics::PlantData;
use crate::per_cable::PerCable;

/// Platform inertia error: I + ΔI.
///
/// Shows in: torque on the platform against its angular acceleration.
///
/// Valid for: rigid platform.
///
/// Source: J. Swevers, W. Verdonck, J. De Schutter, Dynamic model identification for industrial robots, IEEE Control Systems Magazine 27 (2007).
#[derive(Clone, Debug)]
pub struct PlatformInertia {
    inertia: f64,
}

impl Effect for PlatformInertia {
    const INFO: EffectInfo = EffectInfo {
        id: "platform_inertia",
        title: "Platform inertia error",
        equation: "I + ΔI",
        law: |v, n| format!("I {}", signed(v[0], n)),
        scope: Scope::Whole,
        site: Site::Platform(&[Axis::Torque]),
        depends_on: &[DependsOn::Acceleration],
        parameters: &[
            parameter("inertia", "kg.m2", "added moment of inertia ΔI", (-1e5, 1e5)),
        ],
        texts: &[],
        shows_in: "torque on the platform against its angular acceleration",
        source: "J. Swevers, W. Verdonck, J. De Schutter, Dynamic model identification for industrial robots, IEEE Control Systems Magazine 27 (2007)",
        validity: "rigid platform",
        look_alikes: &[
            LookAlike { id: "platform_rotational_damping", separate_by: "rotation at two frequencies" },
        ],
    };

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        Ok(Self { inertia: spec.values[0] })
    }

    fn stage(&self) -> Stage {
        Stage::Parameters
    }

    fn change(&self, data: &mut PlantData, _cables: &PerCable<bool>) {
        data.inertia += self.inertia;
    }
}
