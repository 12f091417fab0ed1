//! Linear drag of the platform: -c v.

use super::{Axis, DependsOn, Effect, EffectInfo, EffectSpec, LookAlike, PlatformContext, Scope, Site, SpecError, Stage, parameter};
use crate::scalar::Real;

/// Linear drag of the platform: -c v.
///
/// Shows in: force on the platform in proportion to its velocity.
///
/// Valid for: low Reynolds number or a linearised drag about a mean wind.
///
/// Source: G. K. Batchelor, An Introduction to Fluid Dynamics, 1967, sec. 4.9.
#[derive(Clone, Debug)]
pub struct PlatformLinearDrag {
    coefficient: f64,
}

impl Effect for PlatformLinearDrag {
    const INFO: EffectInfo = EffectInfo {
        id: "platform_linear_drag",
        title: "Linear drag of the platform",
        equation: "-c v",
        law: |v, n| format!("F = -{} v", n(v[0])),
        scope: Scope::Whole,
        site: Site::Platform(&[Axis::ForceX, Axis::ForceY]),
        depends_on: &[DependsOn::Speed],
        parameters: &[
            parameter("coefficient", "N.s/m", "drag coefficient c", (1.0, 2e3)).at_least(0.0),
        ],
        texts: &[],
        shows_in: "force on the platform in proportion to its velocity",
        source: "G. K. Batchelor, An Introduction to Fluid Dynamics, 1967, sec. 4.9",
        validity: "low Reynolds number or a linearised drag about a mean wind",
        look_alikes: &[
            LookAlike { id: "platform_quadratic_drag", separate_by: "wider speeds" },
            LookAlike { id: "winch_viscous_friction", separate_by: "rotation of the platform" },
        ],
    };

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        Ok(Self { coefficient: spec.values[0] })
    }

    fn stage(&self) -> Stage {
        Stage::PlatformWrench
    }

    fn wrench<S: Real>(&self, context: &PlatformContext<'_, S>) -> [S; 3] {
        [context.twist[0] * -self.coefficient, context.twist[1] * -self.coefficient, S::from(0.0)]
    }
}
