//! Capstan loss in the pulleys: μ |u| tanh(l̇/v_s).

use super::{DependsOn, Effect, EffectInfo, EffectSpec, LookAlike, Scope, Site, SpecError, Stage, WinchContext, parameter};
use crate::scalar::{Real, tanh};

/// Capstan loss in the pulleys: μ |u| tanh(l̇/v_s).
///
/// It opposes the motion whatever the sign of the force, which an effect before it may have turned.
///
/// Shows in: tension against winch force, with the sign of the winch speed and the size of the force.
///
/// Valid for: small loss (first order in μ θ), tension above zero, sliding.
///
/// Source: H. G. Howell, The general case of friction of a string round a cylinder, J. Text. Inst. 44 (1953); capstan equation T2 = T1 exp(μ θ) for small μ θ.
#[derive(Clone, Debug)]
pub struct PulleyCapstanLoss {
    loss: f64,
    transition_speed: f64,
}

impl Effect for PulleyCapstanLoss {
    const INFO: EffectInfo = EffectInfo {
        id: "pulley_capstan_loss",
        title: "Capstan loss in the pulleys",
        equation: "μ |u| tanh(l̇/v_s)",
        law: |v, n| format!("F = {} |u| tanh(l̇/{})", n(v[0]), n(v[1])),
        scope: Scope::EachCable,
        site: Site::Winch,
        depends_on: &[DependsOn::Direction, DependsOn::Tension],
        parameters: &[
            parameter("loss", "1", "share μ of the force lost over the pulleys", (1e-3, 0.2)).at_least(0.0),
            parameter("transition_speed", "m/s", "speed v_s over which the loss turns its sign", (1e-4, 0.1))
                .at_least(1e-9)
                .or(0.01).shape(),
        ],
        texts: &[],
        shows_in: "tension against winch force, with the sign of the winch speed and the size of the force",
        source: "H. G. Howell, The general case of friction of a string round a cylinder, J. Text. Inst. 44 (1953); capstan equation T2 = T1 exp(μ θ) for small μ θ",
        validity: "small loss (first order in μ θ), tension above zero, sliding",
        look_alikes: &[
            LookAlike { id: "winch_coulomb_friction", separate_by: "change the pretension" },
            LookAlike { id: "pulley_wrap_friction", separate_by: "the same to first order: paying out against winding in" },
        ],
    };

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        Ok(Self { loss: spec.values[0], transition_speed: spec.values[1] })
    }

    fn stage(&self) -> Stage {
        Stage::WinchLoss
    }

    fn loss<S: Real>(&self, force: S, context: &WinchContext<S>) -> S {
        force.abs() * tanh(context.speed / self.transition_speed) * self.loss
    }
}
