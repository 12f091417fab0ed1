//! Compliance of the anchor: a spring k between anchor and ground, in line with the cable.

use super::{DependsOn, Effect, EffectInfo, EffectSpec, LawPart, LookAlike, Scope, Site, SpecError, Stage, parameter};
use crate::scalar::Real;

/// Compliance of the anchor: a spring k between anchor and ground, in line with the cable: ε = T/EA + T/(k L).
///
/// Shows in: unstretched length against tension, more of it where the cable is short.
///
/// Valid for: elastic cable models; a light mast that gives along its cable and not across, a linear cable; the damper is the cable's own.
///
/// Source: springs in series; A. Pott, Cable-Driven Parallel Robots: Theory and Application, 2018 (stiffness of the frame).
#[derive(Clone, Debug)]
pub struct AnchorCompliance {
    stiffness: f64,
}

impl Effect for AnchorCompliance {
    const INFO: EffectInfo = EffectInfo {
        id: "anchor_compliance",
        title: "Compliance of the anchor",
        equation: "ε = T/EA + T/(k L)",
        law: |v, n| format!("ε = T/EA + T/({} L)", n(v[0])),
        scope: Scope::EachCable,
        site: Site::Anchor,
        depends_on: &[DependsOn::Tension, DependsOn::Position],
        parameters: &[
            parameter("stiffness", "N/m", "stiffness k of the anchor along its cable", (5e4, 1e7)).at_least(1.0).shape(),
        ],
        texts: &[],
        shows_in: "unstretched length against tension, more of it where the cable is short",
        source: "springs in series; A. Pott, Cable-Driven Parallel Robots: Theory and Application, 2018 (stiffness of the frame)",
        validity: "elastic cable models; a light mast that gives along its cable and not across, a linear cable; the damper is the cable's own",
        look_alikes: &[
            LookAlike { id: "cable_stiffness", separate_by: "a wide range of cable lengths" },
        ],
    };

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        Ok(Self { stiffness: spec.values[0] })
    }

    fn stage(&self) -> Stage {
        Stage::ElasticLaw
    }

    fn law_parts(&self) -> &'static [LawPart] {
        &[LawPart::Factor]
    }

    fn tension_factor<S: Real>(&self, _strain: S, chord: S, axial_stiffness: f64) -> S {
        ((chord * self.stiffness).recip() * axial_stiffness + 1.0).recip()
    }
}
