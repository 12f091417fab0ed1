//! Cable sag: ε = T/EA - (w L)²/24 (1/T² - 1/T_ref²).

use super::{DependsOn, Effect, EffectInfo, EffectSpec, LawPart, LookAlike, Scope, Site, SpecError, Stage, parameter};
use crate::scalar::Real;

/// Cable sag: ε = T/EA - (w L)²/24 (1/T² - 1/T_ref²).
///
/// Shows in: static stretch against tension: the cable is soft at low tension.
///
/// Valid for: elastic cable models; sag to span below 1/8, that is w L / T below about 1; quasi-static shape.
///
/// Source: H. M. Irvine, Cable Structures, 1981 (parabolic sag); H. J. Ernst, Der Bauingenieur 40 (1965) (equivalent modulus).
#[derive(Clone, Debug)]
pub struct CableSag {
    weight: f64,
    reference_tension: f64,
}

impl Effect for CableSag {
    const INFO: EffectInfo = EffectInfo {
        id: "cable_sag",
        title: "Cable sag",
        equation: "ε = T/EA - (w L)²/24 (1/T² - 1/T_ref²)",
        law: |v, n| format!("ε = T/EA - ({} L)²/24 (1/T² - 1/{}²)", n(v[0]), n(v[1])),
        scope: Scope::EachCable,
        site: Site::Cable,
        depends_on: &[DependsOn::Tension],
        parameters: &[
            parameter("weight", "N/m", "weight per length w", (0.0, 20.0)).at_least(0.0),
            parameter("reference_tension", "N", "tension T_ref at which the chord strain is counted as zero", (1e3, 1e5)).at_least(1.0).shape(),
        ],
        texts: &[],
        shows_in: "static stretch against tension: the cable is soft at low tension",
        source: "H. M. Irvine, Cable Structures, 1981 (parabolic sag); H. J. Ernst, Der Bauingenieur 40 (1965) (equivalent modulus)",
        validity: "elastic cable models; sag to span below 1/8, that is w L / T below about 1; quasi-static shape",
        look_alikes: &[
            LookAlike { id: "cable_stiffness", separate_by: "two pretensions" },
            LookAlike { id: "cable_catenary", separate_by: "w L / T above 1" },
        ],
    };

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        Ok(Self { weight: spec.values[0], reference_tension: spec.values[1] })
    }

    fn stage(&self) -> Stage {
        Stage::ElasticLaw
    }

    fn chord_strain<S: Real>(&self, tension: S, chord: S, _unstretched: S) -> S {
        let span_weight = chord * self.weight;
        let reference = self.reference_tension * self.reference_tension;
        -(span_weight * span_weight) / 24.0 * ((tension * tension).recip() - 1.0 / reference)
    }

    fn chord_strain_and_slope(&self, tension: f64, chord: f64, _unstretched: f64) -> [f64; 2] {
        let span_weight = chord * self.weight;
        let factor = span_weight * span_weight / 24.0;
        let inverse = tension.recip();
        let reference = self.reference_tension * self.reference_tension;
        [-factor * (inverse * inverse - 1.0 / reference), 2.0 * factor * inverse * inverse * inverse]
    }

    fn law_parts(&self) -> &'static [LawPart] {
        if self.weight != 0.0 { &[LawPart::Shape] } else { &[] }
    }
}

#[cfg(test)]
mod tests {
    use num_dual::Dual64;

    use super::*;

    #[test]
    fn the_slope_in_closed_form_is_that_of_dual_numbers() {
        let sag = CableSag { weight: 2.0, reference_tension: 2e4 };
        for tension in [5e2, 2e4, 3e5] {
            let [strain, slope] = sag.chord_strain_and_slope(tension, 900.0, 899.0);
            let dual = sag.chord_strain(Dual64::new(tension, 1.0), 900.0.into(), 899.0.into());
            assert!((strain - dual.re).abs() <= 1e-14 * (dual.re.abs() + 1e-3), "{strain} {dual}");
            assert!((slope / dual.eps - 1.0).abs() < 1e-14, "{slope} {dual}");
        }
    }
}
