//! Newton-Euler dynamics of the cables and the platform, equations (17)-(28) and (36)-(42).

mod columns;
mod elastic;
mod evaluation;
mod factors;
mod instant;
mod jacobian;
mod linearisation;
pub(crate) mod matrix3;
mod residual;
mod servo;
#[cfg(test)]
mod tests;

pub(crate) use elastic::{tension as elastic_tension, unstretched_length};
pub use evaluation::Evaluation;
pub(crate) use evaluation::Margins;
pub(crate) use factors::Factors;
pub(crate) use instant::{swing_tension, winch_pull};
pub use jacobian::Jacobian;
pub(crate) use linearisation::Linearisation;

use crate::geometry::Geometry;
use crate::parameters::{CableDamper, CableInertia, CableModel, Parameters};
use crate::per_cable::{MAX_CABLES, PerCable};
use crate::scalar::Real;
use crate::winch::WinchData;

/// Largest number of effect states on one cable.
pub const MAX_EFFECT_STATES: usize = 8;

/// What drives the plant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inputs<S = f64> {
    /// Winch forces `u_i` (N), pull-positive; of winches that are commanded by torque, speed or length the commands in their unit
    /// (N m, m/s, m).
    pub winch_force: PerCable<S>,
    /// Disturbance `[f_Dx, f_Dy, τ_D]` on the platform (N, N m).
    pub disturbance: [S; 3],
}

impl Inputs {
    /// No force on any of `cables` cables, no disturbance.
    pub fn none(cables: usize) -> Self {
        Self::pulling(cables, 0.0)
    }

    /// The same winch force (N) on each of `cables` cables, no disturbance.
    pub fn pulling(cables: usize, force: f64) -> Self {
        Self { winch_force: PerCable::filled(cables, force), disturbance: [0.0; 3] }
    }

    /// Whether every force is zero.
    #[inline]
    pub(crate) fn is_zero(&self) -> bool {
        self.winch_force.iter().chain(&self.disturbance).all(|force| *force == 0.0)
    }

    /// The same values as another number type, without derivatives.
    pub fn lift<S: Real>(&self) -> Inputs<S> {
        Inputs { winch_force: self.winch_force.map(S::from), disturbance: self.disturbance.map(S::from) }
    }
}

/// One cable's numbers as the equations use them, effects of [`crate::effect::Stage::Parameters`] included.
#[derive(Clone, Debug, PartialEq)]
pub struct CableData {
    /// The axial model.
    pub model: CableModel,
    /// How the cable's own mass enters.
    pub inertia: CableInertia,
    /// What the damper measures.
    pub damper: CableDamper,
    /// `ρ` (kg/m).
    pub density: f64,
    /// `EA` (N).
    pub axial_stiffness: f64,
    /// `b l` (N s).
    pub damping: f64,
    /// Its winch.
    pub winch: WinchData,
    /// Inertia of drum and rotor at the cable (kg), moving with the cable.
    pub drum_mass: f64,
    /// Mass per length (kg/m) that the platform's end carries across the cable: `ρ/3` of a cable that stays straight.
    pub straight_density: f64,
    /// Mass per length (kg/m) that the platform's end carries along the cable.
    pub end_density: f64,
    /// Mass per length (kg/m) that the end carries across besides, in slow motion, by an effect's own states.
    pub swinging_density: f64,
}

impl CableData {
    /// Density (kg/m) that acts across and along: zero where the cable's mass is left out.
    pub(crate) fn acting_density(&self) -> f64 {
        if self.inertia == CableInertia::None { 0.0 } else { self.density }
    }

    /// Share of `ρ l` that moves with the winch end: a half in the paper's rod, all of it in a reeled cable.
    pub(crate) fn axial_share(&self) -> f64 {
        match self.inertia {
            CableInertia::Paper => 0.5,
            CableInertia::Reeled => 1.0,
            CableInertia::None => 0.0,
        }
    }

    /// The axial force that the cable's own motion takes beyond mass times acceleration (N), from length, its rate, and
    /// angular rate: `ρ/2 (rate² - l² α̇²)` in the paper's rod (23), `-ρ/2 l² α̇²` in a reeled cable.
    #[inline]
    pub(crate) fn axial_bias<S: Real>(&self, length: S, rate: S, angular_rate: S) -> S {
        let turning = length * angular_rate;
        match self.inertia {
            CableInertia::Paper => (rate * rate - turning * turning) * (0.5 * self.density),
            CableInertia::Reeled => -(turning * turning) * (0.5 * self.density),
            CableInertia::None => S::from(0.0),
        }
    }

    /// How much cable a damper loses to each metre that is paid out: 1 as the paper has it, `L/l` where it measures strain.
    #[inline]
    pub(crate) fn paid_out_share<S: Real>(&self, length: S, unstretched: S) -> S {
        match self.damper {
            CableDamper::LengthRate => S::from(1.0),
            CableDamper::StrainRate => length / unstretched,
        }
    }

    /// Rate (1/s) of the strain `(L - l)/l` at length and rate of the chord and the cable's own.
    #[inline]
    pub(crate) fn strain_rate<S: Real>([length, speed]: [S; 2], [unstretched, rate]: [S; 2]) -> S {
        (speed - rate * length / unstretched) / unstretched
    }

    /// Damper's force (N), (33), at length and rate of the chord and the cable's own.
    #[inline]
    pub(crate) fn damper_force<S: Real>(&self, length: S, speed: S, unstretched: S, rate: S) -> S {
        (speed - rate * self.paid_out_share(length, unstretched)) * self.damping / unstretched
    }

    /// Mass (kg) that moves with the winch end at this length (m).
    #[inline]
    pub(crate) fn axial_mass<S: Real>(&self, length: S) -> S {
        length * (self.density * self.axial_share()) + self.drum_mass
    }
}

/// The cables' numbers, one array per quantity and with the products that every evaluation needs; zero beyond the last
/// cable, so that it adds nothing.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CableConstants {
    pub(crate) axial_stiffness: [f64; MAX_CABLES],
    pub(crate) damping: [f64; MAX_CABLES],
    /// As [`CableData::straight_density`].
    pub(crate) straight_density: [f64; MAX_CABLES],
    /// Axial mass per length (kg/m): `ρ/2` or `ρ`.
    axial_density: [f64; MAX_CABLES],
    drum_mass: [f64; MAX_CABLES],
    /// Factor of `rate²` in the axial bias (kg/m).
    rate_square: [f64; MAX_CABLES],
    /// Factor of `-(l α̇)²` in the axial bias (kg/m).
    turning_square: [f64; MAX_CABLES],
    /// 1 where the damper measures the strain's rate, 0 where the length's.
    pub(crate) strain_damper: [f64; MAX_CABLES],
}

impl CableConstants {
    pub(crate) fn new(cables: &[CableData]) -> Self {
        let each = |f: &dyn Fn(&CableData) -> f64| std::array::from_fn(|i| cables.get(i).map_or(0.0, f));
        Self {
            axial_stiffness: each(&|c| c.axial_stiffness),
            damping: each(&|c| c.damping),
            straight_density: each(&|c| c.straight_density),
            axial_density: each(&|c| c.density * c.axial_share()),
            drum_mass: each(&|c| c.drum_mass),
            rate_square: each(&|c| if c.inertia == CableInertia::Paper { 0.5 * c.density } else { 0.0 }),
            turning_square: each(&|c| 0.5 * c.acting_density()),
            strain_damper: each(&|c| f64::from(u8::from(c.damper == CableDamper::StrainRate))),
        }
    }

    /// As [`CableData::axial_mass`].
    #[inline]
    pub(crate) fn axial_mass<S: Real>(&self, i: usize, length: S) -> S {
        length * self.axial_density[i] + self.drum_mass[i]
    }

    /// As [`CableData::axial_bias`], from the speed across the cable's end (m/s) in place of its angular rate.
    #[inline]
    pub(crate) fn axial_bias<S: Real>(&self, i: usize, rate: S, turning: S) -> S {
        rate * rate * self.rate_square[i] - turning * turning * self.turning_square[i]
    }
}

/// The plant's numbers as the equations use them. Effects may change them before the plant is built.
#[derive(Clone, Debug, PartialEq)]
pub struct PlantData {
    /// Anchors and attachment points.
    pub geometry: Geometry,
    /// `M` (kg).
    pub mass: f64,
    /// `I_M` (kg m²) about the centre of mass.
    pub inertia: f64,
    /// Centre of mass in the body frame, from G (m).
    pub centre_of_mass: [f64; 2],
    /// The cables.
    pub cables: Vec<CableData>,
    /// Acceleration by gravity (m/s²), on the platform.
    pub gravity: [f64; 2],
}

impl PlantData {
    /// The plant without effects.
    pub fn new(parameters: &Parameters) -> Self {
        let cable = |i: usize| {
            let own = parameters.cable.get(i);
            let or = |own: Option<f64>, common: f64| own.unwrap_or(common);
            let modulus = or(own.and_then(|c| c.youngs_modulus), parameters.youngs_modulus);
            let winch = parameters.winch;
            let inertia = or(own.and_then(|c| c.rotor_inertia), winch.rotor_inertia.unwrap_or(0.0));
            let winch = WinchData {
                command: winch.command,
                drum_radius: or(own.and_then(|c| c.drum_radius), winch.drum_radius),
                gear_ratio: or(own.and_then(|c| c.gear_ratio), winch.gear_ratio),
                bandwidth: winch.bandwidth,
                damping: winch.damping,
                force_limit: winch.force_limit,
            };
            let mut cable = CableData {
                model: parameters.cable_model,
                inertia: parameters.cable_inertia,
                damper: parameters.cable_damper,
                density: or(own.and_then(|c| c.density), parameters.cable_density),
                axial_stiffness: modulus * or(own.and_then(|c| c.area), parameters.cable_area),
                damping: or(own.and_then(|c| c.damping), parameters.cable_damping),
                drum_mass: winch.rotor_mass(inertia),
                winch,
                straight_density: 0.0,
                end_density: 0.0,
                swinging_density: 0.0,
            };
            cable.straight_density = cable.acting_density() / 3.0;
            cable
        };
        Self {
            geometry: Geometry::new(parameters),
            mass: parameters.platform_mass,
            inertia: parameters.platform_inertia,
            centre_of_mass: parameters.centre_of_mass,
            cables: (0..parameters.cables()).map(cable).collect(),
            gravity: parameters.gravity,
        }
    }
}
