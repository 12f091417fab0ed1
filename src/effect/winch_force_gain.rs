//! Gain error of the winch force: u (1 + factor).

use super::{DependsOn, Effect, EffectInfo, EffectSpec, LookAlike, Scope, Site, SpecError, Stage, WinchContext, parameter, signed};
use crate::scalar::Real;

/// Gain error of the winch force: u (1 + factor).
///
/// Shows in: tension against winch force.
///
/// Valid for: linear drive.
///
/// Source: A. Pott, Cable-Driven Parallel Robots: Theory and Application, 2018.
#[derive(Clone, Debug)]
pub struct WinchForceGain {
    factor: f64,
}

impl Effect for WinchForceGain {
    const INFO: EffectInfo = EffectInfo {
        id: "winch_force_gain",
        title: "Gain error of the winch force",
        equation: "u (1 + factor)",
        law: |v, n| format!("u (1 {})", signed(v[0], n)),
        scope: Scope::EachCable,
        site: Site::Winch,
        depends_on: &[DependsOn::Tension],
        parameters: &[
            parameter("factor", "1", "relative error of the force", (-0.2, 0.2)).at_least(-1.0),
        ],
        texts: &[],
        shows_in: "tension against winch force",
        source: "A. Pott, Cable-Driven Parallel Robots: Theory and Application, 2018",
        validity: "linear drive",
        look_alikes: &[
            LookAlike { id: "winch_force_bias", separate_by: "vary the mean tension" },
            LookAlike { id: "winch_drum_inertia", separate_by: "higher frequency" },
            LookAlike { id: "platform_mass", separate_by: "change the tension at rest" },
        ],
    };

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        Ok(Self { factor: spec.values[0] })
    }

    fn stage(&self) -> Stage {
        Stage::Command(4)
    }

    fn command<S: Real>(&self, force: S, _states: &[S], _rates: &mut [S], _context: &WinchContext<S>) -> S {
        force * (1.0 + self.factor)
    }
}
