//! Air drag of the cables: ½ ρ_air C_d d |v_n| v_n along the cable; on the platform -ρ_air/8 C_d d L³ |α̇| α̇ along N.

use super::{DependsOn, Effect, EffectInfo, EffectSpec, LookAlike, Scope, Site, SpecError, Stage, parameter};
use crate::scalar::Real;

/// Density of air at sea level, 15 °C (kg/m³), International Standard Atmosphere.
pub const AIR_DENSITY: f64 = 1.225;

/// Air drag of the cables: ½ ρ_air C_d d |v_n| v_n along the cable; on the platform -ρ_air/8 C_d d L³ |α̇| α̇ along N.
///
/// Shows in: force on the platform against its speed across the cables.
///
/// Valid for: straight cable turning about its anchor in still air of 1.225 kg/m³, cross-flow principle.
///
/// Source: S. F. Hoerner, Fluid-Dynamic Drag, 1965 (cylinders in cross flow); moment balance about the anchor as in (20), (22).
#[derive(Clone, Debug)]
pub struct CableDrag {
    drag_area_per_length: f64,
}

impl Effect for CableDrag {
    const INFO: EffectInfo = EffectInfo {
        id: "cable_drag",
        title: "Air drag of the cables",
        equation: "½ ρ_air C_d d |v_n| v_n along the cable; on the platform -ρ_air/8 C_d d L³ |α̇| α̇ along N",
        law: |v, n| format!("-ρ_air/8 {} L³ |α̇| α̇ along N", n(v[0])),
        scope: Scope::EachCable,
        site: Site::Cable,
        depends_on: &[DependsOn::Speed],
        parameters: &[
            parameter("drag_area_per_length", "m", "drag coefficient times diameter, C_d d", (0.0, 0.1)).at_least(0.0),
        ],
        texts: &[],
        shows_in: "force on the platform against its speed across the cables",
        source: "S. F. Hoerner, Fluid-Dynamic Drag, 1965 (cylinders in cross flow); moment balance about the anchor as in (20), (22)",
        validity: "straight cable turning about its anchor in still air of 1.225 kg/m³, cross-flow principle",
        look_alikes: &[
            LookAlike { id: "platform_quadratic_drag", separate_by: "motion along and across one cable" },
            LookAlike { id: "platform_linear_drag", separate_by: "wider speeds" },
        ],
    };

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        Ok(Self { drag_area_per_length: spec.values[0] })
    }

    fn stage(&self) -> Stage {
        Stage::Transverse
    }

    fn transverse_force<S: Real>(&self, length: S, angular_rate: S) -> S {
        // ∫ s · ½ ρ C_d d |α̇ s| α̇ s ds over the cable, divided by L: the end at the platform carries that share.
        -(length.powi(3) * angular_rate.abs() * angular_rate) * (AIR_DENSITY / 8.0 * self.drag_area_per_length)
    }
}
