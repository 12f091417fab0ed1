//! First transverse mode of the cables: m L/2 (p' + 2 ζ ω q') + T π²/(2L) q = F, p = q' + 2/π L α̇, ω = π/L √(T/m).

use std::f64::consts::{FRAC_2_PI, PI};

use super::cable_drag::AIR_DENSITY;
use super::{DependsOn, Effect, EffectInfo, EffectSpec, LawPart, LookAlike, Scope, Site, SpecError, Stage, SwingContext, parameter};
use crate::dynamics::PlantData;
use crate::per_cable::PerCable;
use crate::scalar::Real;

/// Share of a straight cable's mass that its first mode carries at its platform end, where all of it carries a third.
const MODE_SHARE: f64 = 2.0 / (PI * PI);

/// Points of Gauss and Legendre's rule on the cable, from anchor to platform, and their weights.
pub(super) const POINTS: [(f64, f64); 6] = [
    (0.033_765_242_898_424_03, 0.085_662_246_189_585_14),
    (0.169_395_306_766_867_76, 0.180_380_786_524_069_36),
    (0.380_690_406_958_401_56, 0.233_956_967_286_345_52),
    (1.0 - 0.380_690_406_958_401_56, 0.233_956_967_286_345_52),
    (1.0 - 0.169_395_306_766_867_76, 0.180_380_786_524_069_36),
    (1.0 - 0.033_765_242_898_424_03, 0.085_662_246_189_585_14),
];

/// First transverse mode of the cables: m L/2 (p' + 2 ζ ω q') + T π²/(2L) q = F, p = q' + 2/π L α̇, ω = π/L √(T/m).
///
/// Shows in: force on the platform across the cables near the cable's own frequency.
///
/// Valid for: straight taut cable without bending stiffness; deflection small against its length; reeling slow against the wave speed √(T/m); still air of 1.225 kg/m³.
///
/// Source: L. Meirovitch, Fundamentals of Vibrations, 2001, ch. 8 (strings; assumed modes); air drag as in cable_drag.
///
/// The deflection from the chord is `q sin(π s/L)` along `N`; the states are `q` (m) and `p` (m/s), the amplitude of the
/// cable's velocity across. The platform feels `T π/L q + ζ ω m L 2/π q'` along `N`, and in place of `ρL/3` only what is left
/// of the straight cable's inertia, `(1/3 - 2/π²) ρL`. Slow motion finds `2/π² m L` in the mode: with `m = ρ` as much as
/// was taken away, so that only the mode's own dynamics are new. The bow takes up the length `π² q²/(4L)`. Air drag `F`
/// acts on the cable as it moves, turning included, so that [`super::CableDrag`] would count it twice.
#[derive(Clone, Debug)]
pub struct CableTransverseMode {
    linear_density: f64,
    drag_area_per_length: f64,
    damping_ratio: f64,
}

impl Effect for CableTransverseMode {
    const INFO: EffectInfo = EffectInfo {
        id: "cable_transverse_mode",
        title: "First transverse mode of the cables",
        equation: "m L/2 (p' + 2 ζ ω q') + T π²/(2L) q = F, p = q' + 2/π L α̇, ω = π/L √(T/m)",
        law: |v, n| format!("m L/2 (p' + 2 ζ ω q') + T π²/(2L) q = F, m = {}, C_d d = {}, ζ = {}", n(v[0]), n(v[1]), n(v[2])),
        scope: Scope::EachCable,
        site: Site::Cable,
        depends_on: &[DependsOn::Acceleration, DependsOn::Tension],
        parameters: &[
            parameter("linear_density", "kg/m", "mass m per length that vibrates", (0.02, 5.0)).at_least(1e-3),
            parameter("drag_area_per_length", "m", "drag coefficient times diameter, C_d d", (0.0, 0.1))
                .at_least(0.0)
                .or(0.0)
                .shape(),
            parameter("damping_ratio", "1", "damping ratio ζ with both ends held, without air", (0.0, 0.05))
                .at_least(0.0)
                .at_most(1.0)
                .or(0.0)
                .shape(),
        ],
        texts: &[],
        shows_in: "force on the platform across the cables near the cable's own frequency",
        source: "L. Meirovitch, Fundamentals of Vibrations, 2001, ch. 8 (strings; assumed modes); air drag as in cable_drag",
        validity: "straight taut cable without bending stiffness; deflection small against its length; reeling slow against the wave speed √(T/m); still air of 1.225 kg/m³",
        look_alikes: &[
            LookAlike { id: "platform_mass", separate_by: "motion near the cables' own frequency, at two pretensions" },
            LookAlike { id: "cable_drag", separate_by: "motion near the cables' own frequency" },
        ],
    };

    const ALWAYS: Option<&'static str> = Some("a cable that has mass swings all the time");

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        let [linear_density, drag_area_per_length, damping_ratio] = [spec.values[0], spec.values[1], spec.values[2]];
        Ok(Self { linear_density, drag_area_per_length, damping_ratio })
    }

    fn stage(&self) -> Stage {
        Stage::Transverse
    }

    fn law_parts(&self) -> &'static [LawPart] {
        &[LawPart::Bow]
    }

    fn states(&self) -> usize {
        2
    }

    fn change(&self, data: &mut PlantData, cables: &PerCable<bool>) {
        for (cable, _) in data.cables.iter_mut().zip(cables).filter(|(_, on)| **on) {
            cable.straight_density = (1.0 / 3.0 - MODE_SHARE) * cable.acting_density();
            cable.swinging_density = MODE_SHARE * self.linear_density;
        }
    }

    fn swing<S: Real>(&self, context: &SwingContext<S>, states: &[S], rates: &mut [S]) -> S {
        let (length, tension) = (context.length, context.tension);
        let end = length * context.angular_rate;
        let rate = states[1] - end * FRAC_2_PI;
        // What the bow holds against the mode, by string tension and inner damping, it gives to its ends.
        let mut holding = tension * states[0] / length * (0.5 * PI * PI);
        if self.damping_ratio > 0.0 && tension.re() > 0.0 {
            holding += (tension * self.linear_density).sqrt() * rate * (PI * self.damping_ratio);
        }
        let [on_mode, on_chord] = self.drag(end, rate);
        rates[0] = rate;
        rates[1] = (on_mode - holding / length) * (2.0 / self.linear_density);
        holding * FRAC_2_PI + (on_chord - on_mode * FRAC_2_PI) * length
    }

    fn start_swing(&self, length: f64, angular_rate: f64, states: &mut [f64]) {
        states[0] = 0.0;
        states[1] = FRAC_2_PI * length * angular_rate;
    }

    fn swing_energy<S: Real>(&self, length: S, states: &[S]) -> S {
        length * states[1] * states[1] * (0.25 * self.linear_density)
    }

    fn bowed_length<S: Real>(&self, chord: S, states: &[S]) -> S {
        states[0] * states[0] / chord * (0.25 * PI * PI)
    }
}

impl CableTransverseMode {
    /// Generalised force of the air per length (N/m) on the mode and on the turning chord, with the cable's `end` (m/s)
    /// and the bow moving at `rate` (m/s).
    fn drag<S: Real>(&self, end: S, rate: S) -> [S; 2] {
        let mut forces = [S::from(0.0); 2];
        if self.drag_area_per_length > 0.0 {
            for (place, weight) in POINTS {
                let bow = (PI * place).sin();
                let speed = end * place + rate * bow;
                let force = -(speed.abs() * speed) * (0.5 * AIR_DENSITY * self.drag_area_per_length * weight);
                forces[0] += force * bow;
                forces[1] += force * place;
            }
        }
        forces
    }
}
