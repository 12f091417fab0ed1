//! Wind load through the cables: ½ ρ_air C_d d |v_n| v_n, v_n = N·w(h) - s α̇, along the cable; w = w_ref (h/h_ref)^p.

use super::cable_transverse_mode::POINTS;
use super::{AIR_DENSITY, Axis, DependsOn, Effect, EffectInfo, EffectSpec, LookAlike, PlatformContext, Scope, Site, SpecError, Stage, parameter};
use crate::kinematics;
use crate::scalar::Real;

/// Wind load through the cables: ½ ρ_air C_d d |v_n| v_n, v_n = N·w(h) - s α̇, along the cable; w = w_ref (h/h_ref)^p.
///
/// Every cable carries half of a uniform wind on it to the platform and half to its anchor; of a wind that grows with height more
/// goes to the upper end. The cable's own motion is in `v_n`, so that [`super::CableDrag`] beside it would count the air twice.
///
/// Shows in: a steady force on the platform that changes with the directions of the cables.
///
/// Valid for: straight cables, steady wind in the plane, air of 1.225 kg/m³, cross-flow principle. With an exponent the plane stands
/// upright, y is up, and there is no wind below the ground; without, the wind is the same everywhere.
///
/// Source: S. F. Hoerner, Fluid-Dynamic Drag, 1965 (cylinders in cross flow); M. Nahon, G. Gilardi, C. Lambert, Dynamics/control of a
/// radio telescope receiver supported by a tethered aerostat, J. Guidance, Control, and Dynamics 25 (2002) (profile by a power of height).
#[derive(Clone, Debug)]
pub struct CableWind {
    wind: [f64; 2],
    drag_area_per_length: f64,
    exponent: f64,
    ground: f64,
    reference_height: f64,
}

impl Effect for CableWind {
    const INFO: EffectInfo = EffectInfo {
        id: "cable_wind",
        title: "Wind load through the cables",
        equation: "½ ρ_air C_d d |v_n| v_n, v_n = N·w(h) - s α̇, along the cable; w = w_ref (h/h_ref)^p",
        law: |v, n| {
            format!(
                "½ ρ_air {} |v_n| v_n, v_n = N·w - s α̇, w = [{}, {}] ((y - {})/{})^{}",
                n(v[2]), n(v[0]), n(v[1]), n(v[4]), n(v[5]), n(v[3])
            )
        },
        scope: Scope::Whole,
        site: Site::Platform(&[Axis::ForceX, Axis::ForceY, Axis::Torque]),
        depends_on: &[DependsOn::Position, DependsOn::Speed],
        parameters: &[
            parameter("wind_x", "m/s", "wind w_ref along x at the reference height", (-10.0, 10.0)),
            parameter("wind_y", "m/s", "wind w_ref along y at the reference height", (-10.0, 10.0)),
            parameter("drag_area_per_length", "m", "drag coefficient times diameter, C_d d", (0.002, 0.03)).at_least(0.0),
            parameter("exponent", "1", "exponent p of the profile over height; 0 is the same wind everywhere", (0.1, 0.2))
                .at_least(0.0)
                .at_most(2.0)
                .or(0.0)
                .shape()
                .extension(),
            parameter("ground", "m", "y of the ground, from which height counts", (-1000.0, 0.0)).or(0.0).shape().idle_without("exponent"),
            parameter("reference_height", "m", "height h_ref of w_ref above the ground", (10.0, 100.0)).at_least(1e-3).or(10.0).shape().idle_without("exponent"),
        ],
        texts: &[],
        shows_in: "a steady force on the platform that changes with the directions of the cables",
        source: "S. F. Hoerner, Fluid-Dynamic Drag, 1965 (cylinders in cross flow); M. Nahon, G. Gilardi, C. Lambert, Dynamics/control of a radio telescope receiver supported by a tethered aerostat, J. Guidance, Control, and Dynamics 25 (2002) (profile by a power of height)",
        validity: "straight cables, steady wind in the plane, air of 1.225 kg/m³, cross-flow principle; with an exponent y is up and there is no wind below the ground",
        look_alikes: &[
            LookAlike { id: "steady_wind", separate_by: "poses far apart: the cables turn" },
            LookAlike { id: "cable_drag", separate_by: "the steady part of the force" },
        ],
    };

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        let [wind_x, wind_y, drag_area_per_length, exponent, ground, reference_height] = spec.values[..] else {
            unreachable!("as many values as parameters")
        };
        Ok(Self { wind: [wind_x, wind_y], drag_area_per_length, exponent, ground, reference_height })
    }

    fn stage(&self) -> Stage {
        Stage::PlatformWrench
    }

    fn wrench<S: Real>(&self, context: &PlatformContext<'_, S>) -> [S; 3] {
        let mut wrench = [S::from(0.0); 3];
        let cables = kinematics::cables(context.geometry, context.pose, context.twist);
        for (k, anchor) in cables.iter().zip(&context.geometry.anchor) {
            let normal = [-k.direction[1], k.direction[0]];
            let across = normal[0] * self.wind[0] + normal[1] * self.wind[1];
            // ∫ s f ds over the cable, divided by L: the end at the platform carries that share.
            let mut share = S::from(0.0);
            for (point, weight) in POINTS {
                let along = k.span * point;
                let profile = self.profile(along * k.direction[1] + anchor[1]);
                let relative = across * profile - along * k.angular_rate;
                share += relative.abs() * relative * (point * weight);
            }
            let force = share * k.span * (0.5 * AIR_DENSITY * self.drag_area_per_length);
            for (sum, row) in wrench.iter_mut().zip([normal[0], normal[1], k.arm_dot_direction]) {
                *sum += force * row;
            }
        }
        wrench
    }
}

impl CableWind {
    /// The wind at this y (m) as a share of that at the reference height.
    fn profile<S: Real>(&self, y: S) -> S {
        if self.exponent == 0.0 {
            return S::from(1.0);
        }
        let height = (y - self.ground) / self.reference_height;
        if height.re() > 0.0 { height.powf(self.exponent) } else { S::from(0.0) }
    }
}
