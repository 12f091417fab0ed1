//! Viscous friction in the winch: c l̇.

use super::{DependsOn, Effect, EffectInfo, EffectSpec, LookAlike, Scope, Site, SpecError, Stage, WinchContext, parameter};
use crate::scalar::Real;

/// Viscous friction in the winch: c l̇.
///
/// Shows in: tension against winch force, in proportion to the winch speed.
///
/// Valid for: lubricated bearings and gears at constant temperature.
///
/// Source: Armstrong-Hélouvry, Dupont, Canudas de Wit, A survey of models for friction, Automatica 30 (1994).
#[derive(Clone, Debug)]
pub struct WinchViscousFriction {
    coefficient: f64,
}

impl Effect for WinchViscousFriction {
    const INFO: EffectInfo = EffectInfo {
        id: "winch_viscous_friction",
        title: "Viscous friction in the winch",
        equation: "c l̇",
        law: |v, n| format!("F = {} l̇", n(v[0])),
        scope: Scope::EachCable,
        site: Site::Winch,
        depends_on: &[DependsOn::Speed],
        parameters: &[
            parameter("coefficient", "N.s/m", "friction coefficient c", (1.0, 1e4)).at_least(0.0),
        ],
        texts: &[],
        shows_in: "tension against winch force, in proportion to the winch speed",
        source: "Armstrong-Hélouvry, Dupont, Canudas de Wit, A survey of models for friction, Automatica 30 (1994)",
        validity: "lubricated bearings and gears at constant temperature",
        look_alikes: &[
            LookAlike { id: "platform_linear_drag", separate_by: "rotation of the platform" },
            LookAlike { id: "cable_damping", separate_by: "ring-down with the winch locked" },
        ],
    };

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        Ok(Self { coefficient: spec.values[0] })
    }

    fn stage(&self) -> Stage {
        Stage::WinchLoss
    }

    fn loss<S: Real>(&self, _force: S, context: &WinchContext<S>) -> S {
        context.speed * self.coefficient
    }
}
