//! Umbilical: spring and damper from the platform centre to a ground point, -k (G - p) - d v.

use super::{Axis, DependsOn, Effect, EffectInfo, EffectSpec, LookAlike, PlatformContext, Scope, Site, SpecError, Stage, parameter};
use crate::scalar::Real;

/// Umbilical: spring and damper from the platform centre to a ground point, -k (G - p) - d v.
///
/// Shows in: force on the platform in proportion to its position.
///
/// Valid for: slack hose or cable near its rest shape; linear in the displacement.
///
/// Source: C. M. Lambert, M. Nahon et al., Implementation of an aerostat positioning system with cable control, IEEE/ASME Transactions on Mechatronics 12 (2007).
#[derive(Clone, Debug)]
pub struct Umbilical {
    stiffness: f64,
    damping: f64,
    x: f64,
    y: f64,
}

impl Effect for Umbilical {
    const INFO: EffectInfo = EffectInfo {
        id: "umbilical",
        title: "Umbilical",
        equation: "spring and damper from the platform centre to a ground point, -k (G - p) - d v",
        law: |v, n| format!("F = -{} (G - ({}, {})) - {} v", n(v[0]), n(v[2]), n(v[3]), n(v[1])),
        scope: Scope::Whole,
        site: Site::Platform(&[Axis::ForceX, Axis::ForceY]),
        depends_on: &[DependsOn::Position, DependsOn::Speed],
        parameters: &[
            parameter("stiffness", "N/m", "stiffness k", (0.5, 500.0)).at_least(0.0),
            parameter("damping", "N.s/m", "damping d", (0.0, 1e3)).at_least(0.0).or(0.0).shape(),
            parameter("x", "m", "ground point x", (-100.0, 100.0)).or(0.0).shape(),
            parameter("y", "m", "ground point y", (-100.0, 100.0)).or(0.0).shape(),
        ],
        texts: &[],
        shows_in: "force on the platform in proportion to its position",
        source: "C. M. Lambert, M. Nahon et al., Implementation of an aerostat positioning system with cable control, IEEE/ASME Transactions on Mechatronics 12 (2007)",
        validity: "slack hose or cable near its rest shape; linear in the displacement",
        look_alikes: &[
            LookAlike { id: "platform_linear_drag", separate_by: "hold two positions at rest" },
            LookAlike { id: "winch_force_bias", separate_by: "hold two positions at rest" },
        ],
    };

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        Ok(Self { stiffness: spec.values[0], damping: spec.values[1], x: spec.values[2], y: spec.values[3] })
    }

    fn stage(&self) -> Stage {
        Stage::PlatformWrench
    }

    fn wrench<S: Real>(&self, context: &PlatformContext<'_, S>) -> [S; 3] {
        let axis = |k: usize, ground: f64| {
            -((context.pose[k] - ground) * self.stiffness) - context.twist[k] * self.damping
        };
        [axis(0, self.x), axis(1, self.y), S::from(0.0)]
    }
}
