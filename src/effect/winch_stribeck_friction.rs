//! Stribeck friction in the winch: [F_c + (F_s - F_c) exp(-(l̇/v_s)²)] tanh(l̇/v_0) + c l̇ with v_0 = v_s/10.

use super::{Effect, EffectInfo, EffectSpec, LookAlike, Scope, SpecError, Stage, WinchContext, parameter};
use crate::scalar::{Real, tanh};

/// Stribeck friction in the winch: [F_c + (F_s - F_c) exp(-(l̇/v_s)²)] tanh(l̇/v_0) + c l̇ with v_0 = v_s/10.
///
/// Shows in: tension against winch force: highest just after a reversal.
///
/// Valid for: sliding; quasi-static law, no presliding displacement.
///
/// Source: R. Stribeck, VDI-Zeitschrift 46 (1902); Armstrong-Hélouvry, Dupont, Canudas de Wit, Automatica 30 (1994).
#[derive(Clone, Debug)]
pub struct WinchStribeckFriction {
    coulomb: f64,
    static_friction: f64,
    stribeck_speed: f64,
    viscous: f64,
}

impl Effect for WinchStribeckFriction {
    const INFO: EffectInfo = EffectInfo {
        id: "winch_stribeck_friction",
        title: "Stribeck friction in the winch",
        equation: "[F_c + (F_s - F_c) exp(-(l̇/v_s)²)] tanh(l̇/v_0) + c l̇ with v_0 = v_s/10",
        scope: Scope::EachCable,
        parameters: &[
            parameter("coulomb", "N", "Coulomb friction F_c", (5.0, 2e3)).at_least(0.0),
            parameter("static", "N", "static friction F_s", (5.0, 4e3)).at_least(0.0),
            parameter("stribeck_speed", "m/s", "Stribeck speed v_s", (1e-3, 1.0)).at_least(1e-9).or(0.05).shape(),
            parameter("viscous", "N.s/m", "viscous coefficient c", (0.0, 1e4)).at_least(0.0).or(0.0).shape(),
        ],
        texts: &[],
        shows_in: "tension against winch force: highest just after a reversal",
        source: "R. Stribeck, VDI-Zeitschrift 46 (1902); Armstrong-Hélouvry, Dupont, Canudas de Wit, Automatica 30 (1994)",
        validity: "sliding; quasi-static law, no presliding displacement",
        look_alikes: &[
            LookAlike { id: "winch_coulomb_friction", separate_by: "slow and fast reversals" },
        ],
    };

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        Ok(Self { coulomb: spec.values[0], static_friction: spec.values[1], stribeck_speed: spec.values[2], viscous: spec.values[3] })
    }

    fn stage(&self) -> Stage {
        Stage::WinchLoss
    }

    fn loss<S: Real>(&self, _force: S, context: &WinchContext<S>) -> S {
        let relative = context.speed / self.stribeck_speed;
        let level = (-(relative * relative)).exp() * (self.static_friction - self.coulomb) + self.coulomb;
        // The sign turns ten times faster than the Stribeck dip, so that the peak F_s is visible.
        level * tanh(relative * 10.0) + context.speed * self.viscous
    }
}
