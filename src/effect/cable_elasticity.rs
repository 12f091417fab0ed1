//! Cable elasticity: `cable_model` becomes `lumped_mass` with EA and b l as given.

use super::{DependsOn, Effect, EffectInfo, EffectSpec, LookAlike, Scope, Site, SpecError, Stage, parameter};
use crate::dynamics::PlantData;
use crate::parameters::CableModel;
use crate::per_cable::PerCable;

/// Cable elasticity: `cable_model` becomes `lumped_mass` with EA and b l as given.
///
/// Shows in: unstretched length against cable length; ringing after a jump of a winch force.
///
/// Valid for: base model `rigid` or any other; small strain, linear law, unilateral.
///
/// Source: the paper, equations (32), (33), Fig. 5(b).
#[derive(Clone, Debug)]
pub struct CableElasticity {
    axial_stiffness: f64,
    damping: f64,
}

impl Effect for CableElasticity {
    const INFO: EffectInfo = EffectInfo {
        id: "cable_elasticity",
        title: "Cable elasticity",
        equation: "`cable_model` becomes `lumped_mass` with EA and b l as given",
        law: |v, n| format!("lumped_mass with EA = {}, b l = {}", n(v[0]), n(v[1])),
        scope: Scope::Whole,
        site: Site::Cable,
        depends_on: &[DependsOn::Tension],
        parameters: &[
            parameter("axial_stiffness", "N", "axial stiffness EA", (1e5, 1e9)).at_least(1.0).shape(),
            parameter("damping", "N.s", "damping b l", (0.0, 1e6)).at_least(0.0).shape(),
        ],
        texts: &[],
        shows_in: "unstretched length against cable length; ringing after a jump of a winch force",
        source: "the paper, equations (32), (33), Fig. 5(b)",
        validity: "base model `rigid` or any other; small strain, linear law, unilateral",
        look_alikes: &[
            LookAlike { id: "winch_drum_inertia", separate_by: "axial cable mass: a jump of one winch force" },
        ],
    };

    const ALWAYS: Option<&'static str> = Some("whether cables are elastic decides which states there are");

    const SETS_WHAT_OTHERS_SCALE: bool = true;

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        Ok(Self { axial_stiffness: spec.values[0], damping: spec.values[1] })
    }

    fn stage(&self) -> Stage {
        Stage::Parameters
    }

    fn change(&self, data: &mut PlantData, _cables: &PerCable<bool>) {
        for cable in &mut data.cables {
            cable.model = CableModel::LumpedMass;
            cable.axial_stiffness = self.axial_stiffness;
            cable.damping = self.damping;
        }
    }
}
