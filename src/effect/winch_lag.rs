//! First-order lag of the winch: τ u_a' = u - u_a.

use super::{DependsOn, Effect, EffectInfo, EffectSpec, LookAlike, Scope, Site, SpecError, Stage, WinchContext, parameter};
use crate::scalar::Real;

/// First-order lag of the winch: τ u_a' = u - u_a.
///
/// Shows in: tension after a jump of the winch force.
///
/// Valid for: closed-loop force drive with one dominant pole.
///
/// Source: L. Ljung, System Identification: Theory for the User, 2nd ed., 1999.
#[derive(Clone, Debug)]
pub struct WinchLag {
    time_constant: f64,
    /// Largest rate of the force (N/s).
    rate_limit: f64,
}

impl Effect for WinchLag {
    const INFO: EffectInfo = EffectInfo {
        id: "winch_lag",
        title: "First-order lag of the winch",
        equation: "τ u_a' = u - u_a, |u_a'| ≤ R",
        law: |v, n| match v.get(1) {
            Some(rate) if *rate != 0.0 => format!("{} u_a' = u - u_a, |u_a'| ≤ {}", n(v[0]), n(*rate)),
            _ => format!("{} u_a' = u - u_a", n(v[0])),
        },
        scope: Scope::EachCable,
        site: Site::Winch,
        depends_on: &[DependsOn::Input, DependsOn::Time],
        parameters: &[
            parameter("time_constant", "s", "time constant τ", (5e-3, 2.0)).at_least(1e-6),
            parameter("rate_limit", "N/s", "largest rate R of the force; 0 is none", (500.0, 5e4))
                .at_least(0.0)
                .or(0.0)
                .shape()
                .extension(),
        ],
        texts: &[],
        shows_in: "tension after a jump of the winch force",
        source: "L. Ljung, System Identification: Theory for the User, 2nd ed., 1999",
        validity: "closed-loop force drive with one dominant pole",
        look_alikes: &[
            LookAlike { id: "winch_delay", separate_by: "phase above 1/τ: a faster sampled force step" },
        ],
    };

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        // Without a limit it is one that nothing reaches.
        let rate_limit = if spec.values[1] == 0.0 { f64::INFINITY } else { spec.values[1] };
        Ok(Self { time_constant: spec.values[0], rate_limit })
    }

    fn stage(&self) -> Stage {
        Stage::Command(3)
    }

    fn states(&self) -> usize {
        1
    }

    fn command<S: Real>(&self, force: S, states: &[S], rates: &mut [S], _context: &WinchContext<S>) -> S {
        let wanted = (force - states[0]) / self.time_constant;
        let held = wanted.re().abs() > self.rate_limit;
        rates[0] = if held { S::from(self.rate_limit.copysign(wanted.re())) } else { wanted };
        states[0]
    }

    fn start_command(&self, force: f64, states: &mut [f64]) {
        states[0] = force;
    }
}
