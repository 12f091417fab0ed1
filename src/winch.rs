//! Winches: what commands them, and what turns between command and cable.
//!
//! A drum of radius `r` behind a gear of ratio `N` pulls with `u = τ N/r` under the torque `τ` of its motor, whose rotor of
//! inertia `J` moves with the cable's winch end as a mass `J N²/r²`, whatever the command (A. Pott, *Cable-Driven Parallel
//! Robots: Theory and Application*, 2018, chapter 7).
//!
//! A winch commanded by speed or length is a servo. It knows the tension and the mass that it moves, and pulls so that its
//! paid-out length follows its command `v_c` or `l_c` as
//!
//! - speed: `l̈ = ω (v_c - l̇)`,
//! - length: `l̈ = ω² (l_c - l) - 2 ζ ω l̇`,
//!
//! with bandwidth `ω` and damping ratio `ζ`, as far as a force within its limit can: `u = T - m(l) l̈ - (what the cable's own
//! motion takes)`, cut off at `±u_max`. Effects of the winch come after that force, so what they change the servo does not know of.

use serde::{Deserialize, Serialize};

use crate::scalar::Real;

/// What a winch is told.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum WinchCommand {
    /// Its force on the cable (N), as in the paper.
    #[default]
    Force,
    /// The torque of its motor (N m), positive when pulling.
    Torque,
    /// The speed at which it pays out (m/s).
    Speed,
    /// The length that it has paid out (m).
    Length,
}

/// The commands, in the order in which they are documented.
pub const WINCH_COMMANDS: [WinchCommand; 4] =
    [WinchCommand::Force, WinchCommand::Torque, WinchCommand::Speed, WinchCommand::Length];

impl WinchCommand {
    /// Name of the input, without its index, in FMU, tables and `[start]`.
    pub fn input(self) -> &'static str {
        match self {
            Self::Force => "winch_force",
            Self::Torque => "winch_torque",
            Self::Speed => "winch_speed",
            Self::Length => "winch_length",
        }
    }

    /// Its unit as FMI writes it.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Force => "N",
            Self::Torque => "N.m",
            Self::Speed => "m/s",
            Self::Length => "m",
        }
    }

    /// As it stands in a model file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Force => "force",
            Self::Torque => "torque",
            Self::Speed => "speed",
            Self::Length => "length",
        }
    }

    /// Whether the winch makes its own force to follow its command.
    pub fn is_servo(self) -> bool {
        matches!(self, Self::Speed | Self::Length)
    }
}

/// The winches, `[winch]` in a model file; a cable may have a drum, gear and rotor of its own.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "a table [winch]")]
pub struct WinchParameters {
    /// What they are told.
    pub command: WinchCommand,
    /// Radius `r` of the drum (m).
    pub drum_radius: f64,
    /// Turns `N` of the motor to a turn of the drum.
    pub gear_ratio: f64,
    /// Inertia `J` of the rotor about the motor's axis (kg m²), none without.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rotor_inertia: Option<f64>,
    /// Bandwidth `ω` of a servo (rad/s).
    pub bandwidth: f64,
    /// Damping ratio `ζ` of a servo that is commanded by length.
    pub damping: f64,
    /// Largest force `u_max` of a servo (N), in both directions.
    pub force_limit: f64,
}

impl Default for WinchParameters {
    fn default() -> Self {
        Self {
            command: WinchCommand::Force,
            drum_radius: 0.5,
            gear_ratio: 1.0,
            rotor_inertia: None,
            bandwidth: 20.0,
            damping: 0.7,
            force_limit: 5e4,
        }
    }
}

/// One winch as the equations use it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WinchData {
    /// What it is told.
    pub command: WinchCommand,
    /// Radius of its drum (m).
    pub drum_radius: f64,
    /// Turns of its motor to a turn of the drum.
    pub gear_ratio: f64,
    /// Bandwidth of the servo (rad/s).
    pub bandwidth: f64,
    /// Damping ratio of the servo.
    pub damping: f64,
    /// Largest force of the servo (N).
    pub force_limit: f64,
}

impl WinchData {
    /// Force on the cable (N) by a unit of the command, where that is a force or a torque.
    pub fn force_per_command(&self) -> f64 {
        if self.command == WinchCommand::Torque { self.gear_ratio / self.drum_radius } else { 1.0 }
    }

    /// Mass (kg) that a rotor of this inertia (kg m²) is at the winch end of the cable.
    pub fn rotor_mass(&self, inertia: f64) -> f64 {
        inertia * (self.gear_ratio / self.drum_radius).powi(2)
    }

    /// The acceleration (m/s²) of the paid-out length that the servo wants under its command.
    pub(crate) fn wanted<S: Real>(&self, command: S, length: S, rate: S) -> S {
        let bandwidth = self.bandwidth;
        match self.command {
            WinchCommand::Length => {
                (command - length) * (bandwidth * bandwidth) - rate * (2.0 * self.damping * bandwidth)
            }
            _ => (command - rate) * bandwidth,
        }
    }

    /// The command under which the servo wants this acceleration (m/s²).
    pub(crate) fn command_for<S: Real>(&self, acceleration: S, length: S, rate: S) -> S {
        let bandwidth = self.bandwidth;
        match self.command {
            WinchCommand::Length => {
                length + (acceleration + rate * (2.0 * self.damping * bandwidth)) / (bandwidth * bandwidth)
            }
            _ => rate + acceleration / bandwidth,
        }
    }
}
