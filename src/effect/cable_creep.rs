//! Cable creep: spring EA in series with a Kelvin element: ε_c' = (T/EA_c - ε_c)/τ.

use super::{
    DependsOn, Effect, EffectInfo, EffectSpec, LawPart, LookAlike, Scope, Site, SpecError, Stage, StrainContext, parameter,
};
use crate::scalar::Real;

/// Cable creep: spring EA in series with a Kelvin element: ε_c' = (T/EA_c - ε_c)/τ.
///
/// Shows in: unstretched length drifts against cable length after a load change.
///
/// Valid for: elastic cable models; one relaxation time; small strain; tension above zero.
///
/// Source: W. N. Findley, J. S. Lai, K. Onaran, Creep and Relaxation of Nonlinear Viscoelastic Materials, 1976 (standard linear solid).
#[derive(Clone, Debug)]
pub struct CableCreep {
    axial_stiffness: f64,
    time_constant: f64,
}

impl Effect for CableCreep {
    const INFO: EffectInfo = EffectInfo {
        id: "cable_creep",
        title: "Cable creep",
        equation: "spring EA in series with a Kelvin element: ε_c' = (T/EA_c - ε_c)/τ",
        law: |v, n| format!("ε_c' = (T/{} - ε_c)/{}", n(v[0]), n(v[1])),
        scope: Scope::EachCable,
        site: Site::Cable,
        depends_on: &[DependsOn::Tension, DependsOn::Time],
        parameters: &[
            parameter("axial_stiffness", "N", "stiffness EA_c of the Kelvin element", (2e7, 1e9)).at_least(1.0).shape(),
            parameter("time_constant", "s", "time constant τ of the Kelvin element", (1.0, 1e4)).at_least(1e-3).shape(),
        ],
        texts: &[],
        shows_in: "unstretched length drifts against cable length after a load change",
        source: "W. N. Findley, J. S. Lai, K. Onaran, Creep and Relaxation of Nonlinear Viscoelastic Materials, 1976 (standard linear solid)",
        validity: "elastic cable models; one relaxation time; small strain; tension above zero",
        look_alikes: &[
            LookAlike { id: "cable_thermal_expansion", separate_by: "a load step at constant temperature" },
            LookAlike { id: "length_sensor_bias", separate_by: "a load step" },
        ],
    };

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        Ok(Self { axial_stiffness: spec.values[0], time_constant: spec.values[1] })
    }

    fn stage(&self) -> Stage {
        Stage::ElasticLaw
    }

    fn law_parts(&self) -> &'static [LawPart] {
        &[LawPart::Inelastic, LawPart::Rates]
    }

    fn states(&self) -> usize {
        1
    }

    fn inelastic_strain<S: Real>(&self, states: &[S]) -> S {
        states[0]
    }

    fn strain_rates<S: Real>(&self, context: &StrainContext<S>, states: &[S], rates: &mut [S]) {
        rates[0] = (context.tension / self.axial_stiffness - states[0]) / self.time_constant;
    }

    fn start_strain(&self, tension: f64, states: &mut [f64]) {
        states[0] = tension / self.axial_stiffness;
    }
}
