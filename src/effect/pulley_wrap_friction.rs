//! Friction of a cable round its pulleys: |u| (exp(μ θ tanh(l̇/v_s)) - 1).

use super::{DependsOn, Effect, EffectInfo, EffectSpec, LookAlike, Scope, Site, SpecError, Stage, WinchContext, parameter};
use crate::scalar::{Real, tanh};

/// Friction of a cable round its pulleys: |u| (exp(μ θ tanh(l̇/v_s)) - 1).
///
/// The cable feels `u exp(μ θ)` when paid out and `u exp(-μ θ)` when wound in. It opposes the motion whatever the sign of the force.
///
/// Shows in: tension against winch force, more of it when paying out than when winding in.
///
/// Valid for: a limp cable that slides over its pulleys; tension above zero.
///
/// Source: L. Euler, Remarques sur l'effet du frottement dans l'équilibre, 1762; H. G. Howell, The general case of friction of a
/// string round a cylinder, J. Text. Inst. 44 (1953).
#[derive(Clone, Debug)]
pub struct PulleyWrapFriction {
    exponent: f64,
    transition_speed: f64,
}

impl Effect for PulleyWrapFriction {
    const INFO: EffectInfo = EffectInfo {
        id: "pulley_wrap_friction",
        title: "Wrap friction in the pulleys",
        equation: "|u| (exp(μ θ tanh(l̇/v_s)) - 1)",
        law: |v, n| format!("F = |u| (exp({} {} tanh(l̇/{})) - 1)", n(v[0]), n(v[1]), n(v[2])),
        scope: Scope::EachCable,
        site: Site::Winch,
        depends_on: &[DependsOn::Direction, DependsOn::Tension],
        parameters: &[
            parameter("friction", "1", "coefficient of friction μ between cable and pulley", (0.01, 0.2)).at_least(0.0),
            parameter("wrap_angle", "rad", "angle θ over which it lies on its pulleys, all together", (0.2, 3.2)).at_least(0.0).in_product_with("friction"),
            parameter("transition_speed", "m/s", "speed v_s over which the friction turns its sign", (1e-4, 0.1))
                .at_least(1e-9)
                .or(0.01).shape(),
        ],
        texts: &[],
        shows_in: "tension against winch force, more of it when paying out than when winding in",
        source: "L. Euler, Remarques sur l'effet du frottement dans l'équilibre, 1762; H. G. Howell, The general case of friction of a string round a cylinder, J. Text. Inst. 44 (1953)",
        validity: "a limp cable that slides over its pulleys; tension above zero",
        look_alikes: &[
            LookAlike { id: "pulley_capstan_loss", separate_by: "the same to first order in μ θ: paying out against winding in" },
            LookAlike { id: "winch_coulomb_friction", separate_by: "change the pretension" },
        ],
    };

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        Ok(Self { exponent: spec.values[0] * spec.values[1], transition_speed: spec.values[2] })
    }

    fn stage(&self) -> Stage {
        Stage::WinchLoss
    }

    fn loss<S: Real>(&self, force: S, context: &WinchContext<S>) -> S {
        let sign = tanh(context.speed / self.transition_speed);
        force.abs() * (sign * self.exponent).exp_m1()
    }
}
