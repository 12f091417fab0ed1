//! Dead band of the winch: τ u_a' = d(u - u_a), nothing within ±δ.

use super::{DependsOn, Effect, EffectInfo, EffectSpec, LookAlike, Scope, Site, SpecError, Stage, WinchContext, parameter};
use crate::scalar::Real;

/// Dead band of the winch: τ u_a' = d(u - u_a), with d(x) = 0 within ±δ and x ∓ δ beyond.
///
/// A force loop that lets an error of `δ` be, so that it does not hunt: the force stays where it is until the command has gone `δ` away,
/// and then follows it that far behind. As `τ` goes to zero it is play (backlash) of the command.
///
/// Shows in: tension that stays while the command turns round, and is late by the band where it goes on.
///
/// Valid for: closed-loop force drive with one dominant pole. Play of the gear itself is closed by a cable under tension.
///
/// Source: G. Tao, P. V. Kokotovic, Adaptive Control of Systems with Actuator and Sensor Nonlinearities, 1996 (dead zone, backlash).
#[derive(Clone, Debug)]
pub struct WinchDeadBand {
    band: f64,
    time_constant: f64,
}

impl Effect for WinchDeadBand {
    const INFO: EffectInfo = EffectInfo {
        id: "winch_dead_band",
        title: "Dead band of the winch",
        equation: "τ u_a' = d(u - u_a), d(x) = 0 within ±δ, x ∓ δ beyond",
        law: |v, n| format!("{} u_a' = d(u - u_a), d(x) = 0 within ±{}", n(v[1]), n(v[0])),
        scope: Scope::EachCable,
        site: Site::Winch,
        depends_on: &[DependsOn::Input, DependsOn::Time],
        parameters: &[
            parameter("band", "N", "error δ of the force that is let be, to either side", (5.0, 500.0)).at_least(0.0),
            parameter("time_constant", "s", "time constant τ", (5e-3, 0.5)).at_least(1e-6).shape(),
        ],
        texts: &[],
        shows_in: "tension that stays while the command turns round, and is late by the band where it goes on",
        source: "G. Tao, P. V. Kokotovic, Adaptive Control of Systems with Actuator and Sensor Nonlinearities, 1996 (dead zone, backlash)",
        validity: "closed-loop force drive with one dominant pole; play of the gear itself is closed by a cable under tension",
        look_alikes: &[
            LookAlike { id: "winch_lag", separate_by: "commands that turn round within the band, or jump by much more than it" },
            LookAlike { id: "winch_force_bias", separate_by: "commands that rise and fall: a bias has one sign" },
        ],
    };

    const NO_INVERSE: Option<&'static str> = Some("what it passes depends on the forces before");

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        Ok(Self { band: spec.values[0], time_constant: spec.values[1] })
    }

    fn stage(&self) -> Stage {
        Stage::Command(2)
    }

    fn states(&self) -> usize {
        1
    }

    fn command<S: Real>(&self, force: S, states: &[S], rates: &mut [S], _context: &WinchContext<S>) -> S {
        let error = force - states[0];
        let beyond = error.re().abs() > self.band;
        rates[0] = if beyond { (error - self.band.copysign(error.re())) / self.time_constant } else { S::from(0.0) };
        states[0]
    }

    fn start_command(&self, force: f64, states: &mut [f64]) {
        states[0] = force;
    }
}
