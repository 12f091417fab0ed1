//! Elastic catenary: L/l = T/EA + asinh(q)/q, q = w l/(2 T).

use super::{DependsOn, Effect, EffectInfo, EffectSpec, LawPart, LookAlike, Scope, Site, SpecError, Stage, parameter};
use crate::scalar::Real;

/// Elastic catenary: L/l = T/EA + asinh(q)/q, q = w l/(2 T).
///
/// The exact shape at rest of an elastic cable under its weight, where [`super::CableSag`] takes the parabola. T is the part of
/// the tension along the chord, which is the same all along the cable; at its ends the cable carries √(T² + (w l/2)²).
///
/// Shows in: paid-out length against tension: longer than the chord, and soft, at low tension.
///
/// Valid for: elastic cable models; both ends at one height, as where the robot moves in a level plane; quasi-static shape.
///
/// Source: H. M. Irvine, Cable Structures, 1981, chapter 1 (elastic catenary).
#[derive(Clone, Debug)]
pub struct CableCatenary {
    weight: f64,
}

impl Effect for CableCatenary {
    const INFO: EffectInfo = EffectInfo {
        id: "cable_catenary",
        title: "Elastic catenary",
        equation: "L/l = T/EA + asinh(q)/q, q = w l/(2 T)",
        law: |v, n| format!("L/l = T/EA + asinh(q)/q, q = {} l/(2 T)", n(v[0])),
        scope: Scope::EachCable,
        site: Site::Cable,
        depends_on: &[DependsOn::Tension, DependsOn::Position],
        parameters: &[
            parameter("weight", "N/m", "weight per unstretched length w", (0.2, 5.0)).at_least(0.0),
        ],
        texts: &[],
        shows_in: "paid-out length against tension: longer than the chord, and soft, at low tension",
        source: "H. M. Irvine, Cable Structures, 1981, chapter 1 (elastic catenary)",
        validity: "elastic cable models; both ends at one height, as where the robot moves in a level plane; quasi-static shape",
        look_alikes: &[
            LookAlike { id: "cable_sag", separate_by: "w L / T above 1" },
            LookAlike { id: "cable_stiffness", separate_by: "two pretensions" },
        ],
    };

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        Ok(Self { weight: spec.values[0] })
    }

    fn stage(&self) -> Stage {
        Stage::ElasticLaw
    }

    fn chord_strain<S: Real>(&self, tension: S, _chord: S, unstretched: S) -> S {
        let q = unstretched * self.weight / (tension * 2.0);
        q.asinh() / q - 1.0
    }

    fn law_parts(&self) -> &'static [LawPart] {
        if self.weight != 0.0 { &[LawPart::Shape] } else { &[] }
    }
}
