//! Rotational damping of the platform: -c φ̇.

use super::{Axis, DependsOn, Effect, EffectInfo, EffectSpec, LookAlike, PlatformContext, Scope, Site, SpecError, Stage, parameter};
use crate::scalar::Real;

/// Rotational damping of the platform: -c φ̇.
///
/// Shows in: torque on the platform in proportion to its angular velocity.
///
/// Valid for: slow rotation.
///
/// Source: S. F. Hoerner, Fluid-Dynamic Drag, 1965 (linearised).
#[derive(Clone, Debug)]
pub struct PlatformRotationalDamping {
    coefficient: f64,
}

impl Effect for PlatformRotationalDamping {
    const INFO: EffectInfo = EffectInfo {
        id: "platform_rotational_damping",
        title: "Rotational damping of the platform",
        equation: "-c φ̇",
        law: |v, n| format!("τ = -{} φ̇", n(v[0])),
        scope: Scope::Whole,
        site: Site::Platform(&[Axis::Torque]),
        depends_on: &[DependsOn::Speed],
        parameters: &[
            parameter("coefficient", "N.m.s", "damping coefficient c", (100.0, 1e6)).at_least(0.0),
        ],
        texts: &[],
        shows_in: "torque on the platform in proportion to its angular velocity",
        source: "S. F. Hoerner, Fluid-Dynamic Drag, 1965 (linearised)",
        validity: "slow rotation",
        look_alikes: &[
            LookAlike { id: "platform_inertia", separate_by: "rotation at two frequencies" },
        ],
    };

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        Ok(Self { coefficient: spec.values[0] })
    }

    fn stage(&self) -> Stage {
        Stage::PlatformWrench
    }

    fn wrench<S: Real>(&self, context: &PlatformContext<'_, S>) -> [S; 3] {
        [S::from(0.0), S::from(0.0), context.twist[2] * -self.coefficient]
    }
}
