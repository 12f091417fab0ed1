//! Coulomb friction in the winch: F_c tanh(l̇/v_s) added to the pull felt by the cable when paying out.

use std::f64::consts::{FRAC_2_PI, FRAC_PI_2};

use super::{Effect, EffectInfo, EffectSpec, LookAlike, Scope, SpecError, Stage, WinchContext, parameter};
use crate::scalar::{Real, tanh};

/// Coulomb friction in the winch: F_c tanh(l̇/v_s) added to the pull felt by the cable when paying out.
///
/// No smooth law is the true one, so the shape can be fitted: a share w of the force turns its sign as
/// (2/π) arctan(π l̇/(2 v_s)), as steep at rest and slower to reach F_c. With w = 0, the default, it is tanh.
///
/// Shows in: tension against winch force, with the sign of the winch speed.
///
/// Valid for: sliding; the smooth law creeps at speeds below v_s where a real winch sticks.
///
/// Source: B. Armstrong-Hélouvry, P. Dupont, C. Canudas de Wit, A survey of models for friction, Automatica 30 (1994).
#[derive(Clone, Debug)]
pub struct WinchCoulombFriction {
    force: f64,
    transition_speed: f64,
    tail: f64,
}

impl Effect for WinchCoulombFriction {
    const INFO: EffectInfo = EffectInfo {
        id: "winch_coulomb_friction",
        title: "Coulomb friction in the winch",
        equation: "F_c tanh(l̇/v_s) added to the pull felt by the cable when paying out (with a tail w: F_c [(1 - w) tanh(l̇/v_s) + w (2/π) arctan(π l̇/(2 v_s))])",
        scope: Scope::EachCable,
        parameters: &[
            parameter("force", "N", "friction force F_c", (5.0, 2e3)).at_least(0.0),
            parameter("transition_speed", "m/s", "speed v_s over which the force turns its sign", (1e-4, 0.1)).at_least(1e-9).or(0.01).shape(),
            parameter("tail", "1", "share w of the force that turns as (2/π) arctan(π l̇/(2 v_s)) in place of tanh", (-0.2, 1.0))
                .at_least(-0.5)
                .at_most(1.5)
                .or(0.0)
                .shape(),
        ],
        texts: &[],
        shows_in: "tension against winch force, with the sign of the winch speed",
        source: "B. Armstrong-Hélouvry, P. Dupont, C. Canudas de Wit, A survey of models for friction, Automatica 30 (1994)",
        validity: "sliding; the smooth law creeps at speeds below v_s where a real winch sticks",
        look_alikes: &[
            LookAlike { id: "pulley_capstan_loss", separate_by: "change the pretension" },
            LookAlike { id: "winch_stribeck_friction", separate_by: "slow and fast reversals" },
        ],
    };

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        Ok(Self { force: spec.values[0], transition_speed: spec.values[1], tail: spec.values[2] })
    }

    fn stage(&self) -> Stage {
        Stage::WinchLoss
    }

    fn loss<S: Real>(&self, _force: S, context: &WinchContext<S>) -> S {
        let speed = context.speed / self.transition_speed;
        let sign = tanh(speed);
        if self.tail == 0.0 {
            return sign * self.force;
        }
        let slow = (speed * FRAC_PI_2).atan() * FRAC_2_PI;
        (sign * (1.0 - self.tail) + slow * self.tail) * self.force
    }
}
