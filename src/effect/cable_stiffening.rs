//! Stiffening cable: T_e = EA ε (1 + β ε²).

use super::{DependsOn, Effect, EffectInfo, EffectSpec, LawPart, LookAlike, Scope, Site, SpecError, Stage, parameter};
use crate::scalar::Real;

/// Stiffening cable: T_e = EA ε (1 + β ε²).
///
/// Shows in: static stretch falls behind tension at high tension.
///
/// Valid for: elastic cable models; strains below break (about 3 % for high-modulus polyethylene).
///
/// Source: A. H. Nayfeh, P. F. Pai, Linear and Nonlinear Structural Mechanics, 2004 (cubic stiffness).
#[derive(Clone, Debug)]
pub struct CableStiffening {
    coefficient: f64,
}

impl Effect for CableStiffening {
    const INFO: EffectInfo = EffectInfo {
        id: "cable_stiffening",
        title: "Stiffening cable",
        equation: "T_e = EA ε (1 + β ε²)",
        law: |v, n| format!("T_e = EA ε (1 + {} ε²)", n(v[0])),
        scope: Scope::EachCable,
        site: Site::Cable,
        depends_on: &[DependsOn::Tension],
        parameters: &[
            parameter("coefficient", "1", "stiffening coefficient β", (0.0, 1e6)).at_least(0.0),
        ],
        texts: &[],
        shows_in: "static stretch falls behind tension at high tension",
        source: "A. H. Nayfeh, P. F. Pai, Linear and Nonlinear Structural Mechanics, 2004 (cubic stiffness)",
        validity: "elastic cable models; strains below break (about 3 % for high-modulus polyethylene)",
        look_alikes: &[
            LookAlike { id: "cable_stiffness", separate_by: "a wider tension range" },
        ],
    };

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        Ok(Self { coefficient: spec.values[0] })
    }

    fn stage(&self) -> Stage {
        Stage::ElasticLaw
    }

    fn law_parts(&self) -> &'static [LawPart] {
        &[LawPart::Factor]
    }

    fn tension_factor<S: Real>(&self, strain: S, _chord: S, _axial_stiffness: f64) -> S {
        strain * strain * self.coefficient + 1.0
    }
}
