//! Hysteresis of a rope: T_h = F s beside the spring, s' = (ε' - |ε'| s)/ε_y.

use super::{
    DependsOn, Effect, EffectInfo, EffectSpec, LawPart, LookAlike, Scope, Site, SpecError, Stage, StrainContext, parameter,
};
use crate::scalar::Real;

/// Hysteresis of a rope: T_h = F s beside the spring, s' = (ε' - |ε'| s)/ε_y.
///
/// Fibres and strands rub on one another: straining a rope takes more tension than it gives back, however slowly. The element
/// lies in parallel with the cable's spring and feels the strain `ε = (L - l)/l` of the whole cable. It is the model of Bouc and
/// Wen with the exponent 1 and no term of the sign of the force, which for one element is also Dahl's.
///
/// - Small cycles: it is a spring `F/ε_y` (N) beside EA. Large ones: it is the level `F` against the straining.
/// - Between strains `±ε_a` a cycle takes `4 F ε_y (a - tanh a)` per length, `a = ε_a/ε_y`, whatever its speed.
/// - It stores `½ F ε_y s²` per length, and the work of `T_h ε'` beyond that is `F |ε'| s² ≥ 0`: no energy is made in the cable,
///   whatever the motion. Cable that is reeled takes along what it stores.
/// - A slack cable is not strained: its state stands still, and it is taut again where it went slack.
///
/// Shows in: tension over stretch runs in loops, which do not widen with speed.
///
/// Valid for: elastic cable models; one level for all tensions; cable comes from the drum as it is in the span; beside sag the
/// shape is that of the spring's tension alone.
///
/// Source: Y.-K. Wen, Method for random vibration of hysteretic systems, J. Eng. Mech. Div. ASCE 102 (1976); energy: S. Erlicher,
/// N. Point, Thermodynamic admissibility of Bouc-Wen type hysteresis models, C. R. Mécanique 332 (2004); on ropes: M. Miyasaka et al.,
/// Hysteresis model of longitudinally loaded cable for cable driven robots and identification of the parameters, ICRA 2016.
#[derive(Clone, Debug)]
pub struct CableHysteresis {
    force: f64,
    yield_strain: f64,
}

impl Effect for CableHysteresis {
    const INFO: EffectInfo = EffectInfo {
        id: "cable_hysteresis",
        title: "Cable hysteresis",
        equation: "T_h = F s beside the spring, s' = (ε' - |ε'| s)/ε_y",
        law: |v, n| format!("T_h = {} s, s' = (ε' - |ε'| s)/{}", n(v[0]), n(v[1])),
        scope: Scope::EachCable,
        site: Site::Cable,
        depends_on: &[DependsOn::Tension, DependsOn::Direction],
        parameters: &[
            parameter("force", "N", "level F that it holds at most", (5.0, 500.0)).at_least(0.0),
            parameter("yield_strain", "1", "strain ε_y over which it turns; F/ε_y is its stiffness (N)", (2e-5, 1e-3))
                .at_least(1e-9)
                .shape(),
        ],
        texts: &[],
        shows_in: "tension over stretch runs in loops, which do not widen with speed",
        source: "Y.-K. Wen, Method for random vibration of hysteretic systems, J. Eng. Mech. Div. ASCE 102 (1976); S. Erlicher, N. Point, Thermodynamic admissibility of Bouc-Wen type hysteresis models, C. R. Mécanique 332 (2004); M. Miyasaka et al., Hysteresis model of longitudinally loaded cable for cable driven robots and identification of the parameters, ICRA 2016",
        validity: "elastic cable models; one level for all tensions; cable comes from the drum as it is in the span; beside sag the shape is that of the spring's tension alone",
        look_alikes: &[
            LookAlike { id: "cable_damping", separate_by: "the same strains at another speed" },
            LookAlike { id: "cable_stiffness", separate_by: "large strains beside small ones" },
            LookAlike { id: "winch_coulomb_friction", separate_by: "winches that stand still" },
        ],
    };

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        Ok(Self { force: spec.values[0], yield_strain: spec.values[1] })
    }

    fn stage(&self) -> Stage {
        Stage::ElasticLaw
    }

    fn law_parts(&self) -> &'static [LawPart] {
        &[LawPart::Held, LawPart::Rates]
    }

    fn states(&self) -> usize {
        1
    }

    fn held_tension<S: Real>(&self, states: &[S]) -> S {
        states[0] * self.force
    }

    fn strain_rates<S: Real>(&self, context: &StrainContext<S>, states: &[S], rates: &mut [S]) {
        let rate = context.strain_rate;
        rates[0] = (rate - rate.abs() * states[0]) / self.yield_strain;
    }

    fn follows_strain_rate(&self) -> bool {
        true
    }
}
