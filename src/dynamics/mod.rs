//! Newton-Euler dynamics of the cables and the platform, equations (17)-(28) and (36)-(42).

mod cable;
mod columns;
mod elastic;
mod evaluation;
mod factors;
mod instant;
mod jacobian;
mod linearisation;
pub(crate) mod matrix3;
mod residual;
#[cfg(test)]
mod tests;

pub(crate) use cable::{CableConstants, Held, swing_tension};
pub(crate) use elastic::ElasticLaw;
pub use evaluation::Evaluation;
pub(crate) use evaluation::{Margins, Reading, strain};
pub(crate) use factors::Factors;
pub use jacobian::Jacobian;
pub(crate) use linearisation::Linearisation;

use crate::geometry::Geometry;
use crate::parameters::{CableDamper, CableInertia, CableModel, Parameters};
use crate::per_cable::PerCable;
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

    /// Mass per length (kg/m) that moves with the winch end: half of `ρ` in the paper's rod, all of it in a reeled cable.
    pub(crate) fn axial_density(&self) -> f64 {
        match self.inertia {
            CableInertia::Paper => 0.5 * self.density,
            CableInertia::Reeled => self.density,
            CableInertia::None => 0.0,
        }
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
