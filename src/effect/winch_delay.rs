//! Dead time of the winch: u(t - τ).

use super::{DependsOn, Effect, EffectInfo, EffectSpec, LookAlike, Scope, Site, SpecError, Stage, parameter};

/// Dead time of the winch: u(t - τ).
///
/// Shows in: tension after a jump of the winch force.
///
/// Valid for: constant transport and computing delay; before the start the command is taken as constant.
///
/// Source: L. Ljung, System Identification: Theory for the User, 2nd ed., 1999.
#[derive(Clone, Debug)]
pub struct WinchDelay {
    delay: f64,
}

impl Effect for WinchDelay {
    const INFO: EffectInfo = EffectInfo {
        id: "winch_delay",
        title: "Dead time of the winch",
        equation: "u(t - τ)",
        law: |v, n| format!("u(t - {})", n(v[0])),
        scope: Scope::EachCable,
        site: Site::Winch,
        depends_on: &[DependsOn::Input, DependsOn::Time],
        parameters: &[
            parameter("delay", "s", "dead time τ", (1e-3, 1.0)).at_least(0.0),
        ],
        texts: &[],
        shows_in: "tension after a jump of the winch force",
        source: "L. Ljung, System Identification: Theory for the User, 2nd ed., 1999",
        validity: "constant transport and computing delay; before the start the command is taken as constant",
        look_alikes: &[
            LookAlike { id: "winch_lag", separate_by: "phase above 1/τ: a faster sampled force step" },
        ],
    };

    const ALWAYS: Option<&'static str> = Some("the commands that it holds back are those of all its past");

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        Ok(Self { delay: spec.values[0] })
    }

    fn stage(&self) -> Stage {
        Stage::CommandDelay
    }

    fn delay(&self) -> f64 {
        self.delay
    }
}
