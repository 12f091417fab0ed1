//! Bias of the winch force: u + bias.

use super::{Effect, EffectInfo, EffectSpec, LookAlike, Scope, Site, SpecError, Stage, WinchContext, parameter, signed};
use crate::scalar::Real;

/// Bias of the winch force: u + bias.
///
/// Shows in: tension against winch force.
///
/// Valid for: constant over the trial.
///
/// Source: A. Pott, Cable-Driven Parallel Robots: Theory and Application, 2018.
#[derive(Clone, Debug)]
pub struct WinchForceBias {
    bias: f64,
}

impl Effect for WinchForceBias {
    const INFO: EffectInfo = EffectInfo {
        id: "winch_force_bias",
        title: "Bias of the winch force",
        equation: "u + bias",
        law: |v, n| format!("u {}", signed(v[0], n)),
        scope: Scope::EachCable,
        site: Site::Winch,
        depends_on: &[],
        parameters: &[
            parameter("bias", "N", "force added", (-500.0, 500.0)),
        ],
        texts: &[],
        shows_in: "tension against winch force",
        source: "A. Pott, Cable-Driven Parallel Robots: Theory and Application, 2018",
        validity: "constant over the trial",
        look_alikes: &[
            LookAlike { id: "winch_force_gain", separate_by: "vary the mean tension" },
            LookAlike { id: "steady_wind", separate_by: "change the pose: the bias turns with the cable" },
        ],
    };

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        Ok(Self { bias: spec.values[0] })
    }

    fn stage(&self) -> Stage {
        Stage::Command(5)
    }

    fn command<S: Real>(&self, force: S, _states: &[S], _rates: &mut [S], _context: &WinchContext<S>) -> S {
        force + self.bias
    }
}
