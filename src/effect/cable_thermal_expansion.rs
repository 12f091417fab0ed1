//! Thermal expansion of the cables: l → l (1 + strain_amplitude sin(2π t/period + phase)).

use super::{DependsOn, Effect, EffectInfo, EffectSpec, LawPart, LookAlike, Scope, Site, SpecError, Stage, parameter, signed};
use crate::scalar::Real;

/// Thermal expansion of the cables: l → l (1 + strain_amplitude sin(2π t/period + phase)).
///
/// Shows in: unstretched length against cable length, all cables together, slowly.
///
/// Valid for: elastic cable models; uniform temperature along and among the cables.
///
/// Source: McKenna, Hearle, O'Hear, Handbook of Fibre Rope Technology, 2004 (axial expansion of HMPE about -1.2e-5 1/K).
#[derive(Clone, Debug)]
pub struct CableThermalExpansion {
    strain_amplitude: f64,
    period: f64,
    phase: f64,
}

impl Effect for CableThermalExpansion {
    const INFO: EffectInfo = EffectInfo {
        id: "cable_thermal_expansion",
        title: "Thermal expansion of the cables",
        equation: "l → l (1 + strain_amplitude sin(2π t/period + phase))",
        law: |v, n| format!("l → l (1 {} sin(2π t/{} {}))", signed(v[0], n), n(v[1]), signed(v[2], n)),
        scope: Scope::Whole,
        site: Site::Cable,
        depends_on: &[DependsOn::Time],
        parameters: &[
            parameter("strain_amplitude", "1", "amplitude of the thermal strain α ΔT", (-1e-3, 1e-3)),
            parameter("period", "s", "period of the temperature", (10.0, 1e5)).at_least(1e-3).shape(),
            parameter("phase", "rad", "phase of the temperature at t = 0", (-3.2, 3.2)).or(0.0).shape(),
        ],
        texts: &[],
        shows_in: "unstretched length against cable length, all cables together, slowly",
        source: "McKenna, Hearle, O'Hear, Handbook of Fibre Rope Technology, 2004 (axial expansion of HMPE about -1.2e-5 1/K)",
        validity: "elastic cable models; uniform temperature along and among the cables",
        look_alikes: &[
            LookAlike { id: "cable_creep", separate_by: "a load step at constant temperature" },
        ],
    };

    const IN_TIME: bool = true;

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        Ok(Self { strain_amplitude: spec.values[0], period: spec.values[1], phase: spec.values[2] })
    }

    fn stage(&self) -> Stage {
        Stage::ElasticLaw
    }

    fn law_parts(&self) -> &'static [LawPart] {
        &[LawPart::Length]
    }

    fn length_factor<S: Real>(&self, time: S) -> S {
        (time * (std::f64::consts::TAU / self.period) + self.phase).sin() * self.strain_amplitude + 1.0
    }
}
