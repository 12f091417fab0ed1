//! Torque ripple of the winch: A sin(2π l/p + ψ) beside its force.

use std::f64::consts::TAU;

use super::{DependsOn, Effect, EffectInfo, EffectSpec, LookAlike, PlatformContext, Scope, Site, SpecError, Stage, parameter};
use crate::scalar::Real;

/// Torque ripple of the winch: A sin(2π l/p + ψ) beside its force, by the length `l` that is paid out.
///
/// A function of position alone: what it gives in one half of a turn it takes in the other.
///
/// Shows in: a wave of the tension along the paid-out length.
///
/// Valid for: one harmonic of cogging, of slots or of a gear's teeth; the cable does not slip on its drum. A start that is given by
/// forces counts the cable as unstretched for its phase.
///
/// Source: T. M. Jahns, W. L. Soong, Pulsating torque minimization techniques for permanent magnet AC motor drives, IEEE Trans.
/// Industrial Electronics 43 (1996).
#[derive(Clone, Debug)]
pub struct WinchTorqueRipple {
    amplitude: f64,
    /// Radians of the wave to a metre of cable.
    number: f64,
    phase: f64,
}

impl Effect for WinchTorqueRipple {
    const INFO: EffectInfo = EffectInfo {
        id: "winch_torque_ripple",
        title: "Torque ripple of the winch",
        equation: "A sin(2π l/p + ψ) beside the winch force",
        law: |v, n| format!("F = {} sin(2π l/{} + {})", n(v[0]), n(v[1]), n(v[2])),
        scope: Scope::EachCable,
        site: Site::Winch,
        depends_on: &[DependsOn::Position],
        parameters: &[
            parameter("amplitude", "N", "amplitude A at the cable", (1.0, 100.0)),
            parameter("period", "m", "cable p that is paid out in one period; a drum's turn is 2π r", (0.5, 5.0)).at_least(1e-6).shape(),
            parameter("phase", "rad", "phase ψ with nothing paid out", (-3.2, 3.2)).shape(),
        ],
        texts: &[],
        shows_in: "a wave of the tension along the paid-out length",
        source: "T. M. Jahns, W. L. Soong, Pulsating torque minimization techniques for permanent magnet AC motor drives, IEEE Trans. Industrial Electronics 43 (1996)",
        validity: "one harmonic of cogging, of slots or of a gear's teeth; the cable does not slip on its drum; a start that is given by forces counts the cable as unstretched for its phase",
        look_alikes: &[
            LookAlike { id: "periodic_gust", separate_by: "another speed of the winch: the ripple's frequency follows it" },
        ],
    };

    /// It moves the platform by the length of its own cable.
    const COUPLES_CABLES: bool = true;

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        Ok(Self { amplitude: spec.values[0], number: TAU / spec.values[1], phase: spec.values[2] })
    }

    fn stage(&self) -> Stage {
        Stage::WinchPosition
    }

    fn pull<S: Real>(&self, context: &PlatformContext<'_, S>, cable: usize) -> S {
        (context.unstretched_length[cable] * self.number + self.phase).sin() * self.amplitude
    }
}
