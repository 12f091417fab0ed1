//! Periodic gust: A sin(ω t + ψ) along `direction`.

use super::{DependsOn, Effect, EffectInfo, EffectSpec, PlatformContext, Scope, Site, SpecError, Stage, parameter, signed};
use crate::scalar::Real;

/// Periodic gust: A sin(ω t + ψ) along `direction`.
///
/// Shows in: force on the platform at one frequency.
///
/// Valid for: one spectral line; force through G.
///
/// Source: E. Simiu, R. H. Scanlan, Wind Effects on Structures, 3rd ed., 1996 (vortex shedding, buffeting).
#[derive(Clone, Debug)]
pub struct PeriodicGust {
    amplitude: f64,
    frequency: f64,
    phase: f64,
    direction: f64,
}

impl Effect for PeriodicGust {
    const INFO: EffectInfo = EffectInfo {
        id: "periodic_gust",
        title: "Periodic gust",
        equation: "A sin(ω t + ψ) along `direction`",
        law: |v, n| format!("F = {} sin({} t {}) along the angle {}", n(v[0]), n(v[1]), signed(v[2], n), n(v[3])),
        scope: Scope::Whole,
        site: Site::PlatformAlong(3),
        depends_on: &[DependsOn::Time],
        parameters: &[
            parameter("amplitude", "N", "amplitude A", (5.0, 2e3)),
            parameter("frequency", "rad/s", "angular frequency ω", (0.05, 10.0)).at_least(1e-9).shape(),
            parameter("phase", "rad", "phase ψ at t = 0", (-3.2, 3.2)).or(0.0).shape(),
            parameter("direction", "rad", "direction of the force, from the x axis", (-3.2, 3.2)).or(0.0).shape(),
        ],
        texts: &[],
        shows_in: "force on the platform at one frequency",
        source: "E. Simiu, R. H. Scanlan, Wind Effects on Structures, 3rd ed., 1996 (vortex shedding, buffeting)",
        validity: "one spectral line; force through G",
        look_alikes: &[
        ],
    };

    const IN_TIME: bool = true;

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        Ok(Self { amplitude: spec.values[0], frequency: spec.values[1], phase: spec.values[2], direction: spec.values[3] })
    }

    fn stage(&self) -> Stage {
        Stage::PlatformWrench
    }

    fn wrench<S: Real>(&self, context: &PlatformContext<'_, S>) -> [S; 3] {
        let force = (context.time * self.frequency + self.phase).sin() * self.amplitude;
        [force * self.direction.cos(), force * self.direction.sin(), S::from(0.0)]
    }
}
