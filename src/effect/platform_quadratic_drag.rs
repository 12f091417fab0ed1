//! Quadratic drag of the platform: -c |v - w| (v - w).

use super::{Axis, DependsOn, Effect, EffectInfo, EffectSpec, LookAlike, PlatformContext, Scope, Site, SpecError, Stage, parameter};
use crate::scalar::Real;

/// Quadratic drag of the platform: -c |v - w| (v - w).
///
/// Shows in: force on the platform against the square of its velocity.
///
/// Valid for: bluff body, Reynolds number above about 1e4, no torque.
///
/// Source: S. F. Hoerner, Fluid-Dynamic Drag, 1965.
#[derive(Clone, Debug)]
pub struct PlatformQuadraticDrag {
    coefficient: f64,
    wind_x: f64,
    wind_y: f64,
}

impl Effect for PlatformQuadraticDrag {
    const INFO: EffectInfo = EffectInfo {
        id: "platform_quadratic_drag",
        title: "Quadratic drag of the platform",
        equation: "-c |v - w| (v - w)",
        law: |v, n| match v[1..] {
            [0.0, 0.0] => format!("F = -{} |v| v", n(v[0])),
            _ => format!("F = -{} |v - w| (v - w), w = ({}, {})", n(v[0]), n(v[1]), n(v[2])),
        },
        scope: Scope::Whole,
        site: Site::Platform(&[Axis::ForceX, Axis::ForceY]),
        depends_on: &[DependsOn::Speed],
        parameters: &[
            parameter("coefficient", "N.s2/m2", "½ ρ_air C_d A", (0.5, 500.0)).at_least(0.0),
            parameter("wind_x", "m/s", "steady wind speed w along x", (-20.0, 20.0)).or(0.0).shape(),
            parameter("wind_y", "m/s", "steady wind speed w along y", (-20.0, 20.0)).or(0.0).shape(),
        ],
        texts: &[],
        shows_in: "force on the platform against the square of its velocity",
        source: "S. F. Hoerner, Fluid-Dynamic Drag, 1965",
        validity: "bluff body, Reynolds number above about 1e4, no torque",
        look_alikes: &[
            LookAlike { id: "platform_linear_drag", separate_by: "wider speeds" },
        ],
    };

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        Ok(Self { coefficient: spec.values[0], wind_x: spec.values[1], wind_y: spec.values[2] })
    }

    fn stage(&self) -> Stage {
        Stage::PlatformWrench
    }

    fn wrench<S: Real>(&self, context: &PlatformContext<'_, S>) -> [S; 3] {
        let v = [context.twist[0] - self.wind_x, context.twist[1] - self.wind_y];
        let square = v[0] * v[0] + v[1] * v[1];
        // The square root has no derivative at rest, where the drag and its derivative are zero.
        if square.re() == 0.0 {
            return [S::from(0.0); 3];
        }
        let factor = square.sqrt() * -self.coefficient;
        [factor * v[0], factor * v[1], S::from(0.0)]
    }
}
