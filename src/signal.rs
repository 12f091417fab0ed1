//! The one list of what goes in and out of a robot: names, units, meanings, and where each value is found.
//!
//! Tables, the FMU's variables, the linear model, formulas and recordings read it. Names are those of the FMU.

use crate::scalar::Real;
use crate::simulation::{Outputs, Shown};
use crate::winch::WinchCommand;

/// What a signal is, whatever its axis' or cable's number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Facts {
    /// Name without the cable's number.
    pub name: &'static str,
    /// Unit as FMI writes it.
    pub unit: &'static str,
    /// Kind of physical quantity, as Modelica names it.
    pub quantity: &'static str,
    /// Usual size (in its unit).
    pub nominal: f64,
    /// What it is; `{}` stands for the cable's number.
    pub description: &'static str,
}

/// A real signal that a robot shows. Axes `x`, `y`, `φ` are 0 to 2; cables count from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Signal {
    /// Measured pose, by axis.
    Pose(usize),
    /// Twist, by axis.
    Twist(usize),
    /// Measured geometric length of a cable.
    CableLength(usize),
    /// Measured unstretched length of a cable.
    UnstretchedLength(usize),
    /// Its rate.
    UnstretchedRate(usize),
    /// Measured tension of a cable.
    Tension(usize),
    /// Strain of a cable.
    Strain(usize),
    /// Angle of a cable.
    CableAngle(usize),
    /// Acceleration of the platform, by axis.
    Acceleration(usize),
    /// Angle of a winch's drum.
    WinchAngle(usize),
    /// Its rate.
    WinchRate(usize),
}

const fn facts(
    name: &'static str,
    unit: &'static str,
    quantity: &'static str,
    nominal: f64,
    description: &'static str,
) -> Facts {
    Facts { name, unit, quantity, nominal, description }
}

const POSE: [Facts; 3] = [
    facts("x", "m", "Length", 1.0, "Position of the platform along x"),
    facts("y", "m", "Length", 1.0, "Position of the platform along y"),
    facts("phi", "rad", "Angle", 0.1, "Orientation of the platform"),
];
const TWIST: [Facts; 3] = [
    facts("vx", "m/s", "Velocity", 1.0, "Velocity of the platform along x"),
    facts("vy", "m/s", "Velocity", 1.0, "Velocity of the platform along y"),
    facts("omega", "rad/s", "AngularVelocity", 0.1, "Angular velocity of the platform"),
];
const ACCELERATION: [Facts; 3] = [
    facts("ax", "m/s2", "Acceleration", 1e-2, "Acceleration of the platform along x"),
    facts("ay", "m/s2", "Acceleration", 1e-2, "Acceleration of the platform along y"),
    facts("alpha", "rad/s2", "AngularAcceleration", 1e-3, "Angular acceleration of the platform"),
];
const CABLE_LENGTH: Facts =
    facts("cable_length", "m", "Length", 1e3, "Distance from anchor to attachment point of cable {}");
const UNSTRETCHED_LENGTH: Facts = facts(
    "unstretched_length",
    "m",
    "Length",
    1e3,
    "Unstretched, paid-out length of cable {}; its start is used by from_states",
);
const UNSTRETCHED_RATE: Facts = facts(
    "unstretched_length_rate",
    "m/s",
    "Velocity",
    1.0,
    "Rate at which cable {} is paid out; its start is used by from_states",
);
const TENSION: Facts = facts("tension", "N", "Force", 1e3, "Tension of cable {}, zero where it is slack");
const STRAIN: Facts = facts("strain", "1", "Strain", 1e-4, "Strain of cable {}: elongation over unstretched length");
const CABLE_ANGLE: Facts =
    facts("cable_angle", "rad", "Angle", 1.0, "Angle of cable {} from anchor to attachment point against the x axis");
const WINCH_ANGLE: Facts =
    facts("winch_angle", "rad", "Angle", 1e3, "Angle of drum {}, zero with nothing paid out, growing as it pays out");
const WINCH_RATE: Facts =
    facts("winch_rate", "rad/s", "AngularVelocity", 1.0, "Angular rate of drum {}, positive when paying out");

/// The inputs from outside, force x, y and torque.
pub const DISTURBANCES: [Facts; 3] = [
    facts("disturbance_force_x", "N", "Force", 1e2, "Force on the platform from outside, along x"),
    facts("disturbance_force_y", "N", "Force", 1e2, "Force on the platform from outside, along y"),
    facts("disturbance_torque", "N.m", "Torque", 1e3, "Torque on the platform from outside"),
];

impl Signal {
    /// Every signal of a robot with so many cables, in the order of tables.
    pub fn all(cables: usize) -> Vec<Self> {
        let axes = |of: fn(usize) -> Self| (0..POSE.len()).map(of);
        let each = |of: fn(usize) -> Self| (0..cables).map(of);
        axes(Self::Pose)
            .chain(axes(Self::Twist))
            .chain(each(Self::CableLength))
            .chain(each(Self::UnstretchedLength))
            .chain(each(Self::UnstretchedRate))
            .chain(each(Self::Tension))
            .chain(each(Self::Strain))
            .chain(each(Self::CableAngle))
            .chain(axes(Self::Acceleration))
            .chain(each(Self::WinchAngle))
            .chain(each(Self::WinchRate))
            .collect()
    }

    /// What it is.
    pub fn facts(self) -> &'static Facts {
        match self {
            Self::Pose(k) => &POSE[k],
            Self::Twist(k) => &TWIST[k],
            Self::CableLength(_) => &CABLE_LENGTH,
            Self::UnstretchedLength(_) => &UNSTRETCHED_LENGTH,
            Self::UnstretchedRate(_) => &UNSTRETCHED_RATE,
            Self::Tension(_) => &TENSION,
            Self::Strain(_) => &STRAIN,
            Self::CableAngle(_) => &CABLE_ANGLE,
            Self::Acceleration(k) => &ACCELERATION[k],
            Self::WinchAngle(_) => &WINCH_ANGLE,
            Self::WinchRate(_) => &WINCH_RATE,
        }
    }

    /// The cable that it is of, if it is of one.
    pub fn cable(self) -> Option<usize> {
        match self {
            Self::Pose(_) | Self::Twist(_) | Self::Acceleration(_) => None,
            Self::CableLength(i)
            | Self::UnstretchedLength(i)
            | Self::UnstretchedRate(i)
            | Self::Tension(i)
            | Self::Strain(i)
            | Self::CableAngle(i)
            | Self::WinchAngle(i)
            | Self::WinchRate(i) => Some(i),
        }
    }

    /// Its name, with the cable's number from 1.
    pub fn name(self) -> String {
        let name = self.facts().name;
        self.cable().map_or_else(|| name.to_owned(), |i| indexed(name, i))
    }

    /// Its unit as FMI writes it.
    pub fn unit(self) -> &'static str {
        self.facts().unit
    }

    /// Its value among the outputs.
    pub fn value<S: Real>(self, outputs: &Outputs<S>) -> S {
        match self {
            Self::Pose(k) => outputs.pose[k],
            Self::Twist(k) => outputs.twist[k],
            Self::CableLength(i) => outputs.cable_length[i],
            Self::UnstretchedLength(i) => outputs.unstretched_length[i],
            Self::UnstretchedRate(i) => outputs.unstretched_length_rate[i],
            Self::Tension(i) => outputs.tension[i],
            Self::Strain(i) => outputs.strain[i],
            Self::CableAngle(i) => outputs.cable_angle(i),
            Self::Acceleration(k) => outputs.acceleration[k],
            Self::WinchAngle(i) => outputs.winch_angle[i],
            Self::WinchRate(i) => outputs.winch_rate[i],
        }
    }

    /// Its value alone, made when it is asked for.
    #[inline(always)]
    pub(crate) fn of<S: Real>(self, shown: &Shown<S>) -> S {
        match self {
            Self::Pose(k) => shown.pose(k),
            Self::Twist(k) => shown.twist(k),
            Self::CableLength(i) => shown.cable_length(i),
            Self::UnstretchedLength(i) => shown.unstretched_length(i),
            Self::UnstretchedRate(i) => shown.unstretched_length_rate(i),
            Self::Tension(i) => shown.tension(i),
            Self::Strain(i) => shown.strain(i),
            Self::CableAngle(i) => shown.cable_angle(i),
            Self::Acceleration(k) => shown.acceleration(k),
            Self::WinchAngle(i) => shown.winch_angle(i),
            Self::WinchRate(i) => shown.winch_rate(i),
        }
    }
}

/// `name[i + 1]`: the name of a cable's own (from 0).
pub fn indexed(name: &str, cable: usize) -> String {
    format!("{name}[{}]", cable + 1)
}

/// Names of the inputs of a robot with so many cables, whose winches are told `command`.
pub fn input_names(cables: usize, command: WinchCommand) -> Vec<String> {
    let commands = (0..cables).map(|i| indexed(command.input(), i));
    commands.chain(DISTURBANCES.map(|d| d.name.to_owned())).collect()
}

/// Names of all signals, in the order of [`Signal::all`].
pub fn output_names(cables: usize) -> Vec<String> {
    Signal::all(cables).into_iter().map(Signal::name).collect()
}

/// Values of all signals, in the order of [`Signal::all`].
pub fn output_values<S: Real>(outputs: &Outputs<S>) -> Vec<S> {
    Signal::all(outputs.tension.len()).into_iter().map(|signal| signal.value(outputs)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model_file::Model;

    /// Each of a robot's signals has a name of its own, and is the same whichever way it is read.
    #[test]
    fn a_signal_is_one_thing_by_name_and_by_value() {
        let mut model = Model::default();
        model.start.pose = [3.0, -2.0, 0.1];
        model.start.inputs.winch_force = [2000.0, 1500.0, 1800.0, 1700.0].into();
        let mut simulation = model.simulation().unwrap();
        simulation.advance(0.3).unwrap();
        let (evaluation, outputs) = (simulation.evaluate(), simulation.outputs());
        let shown = simulation.shown(&evaluation);
        let cables = simulation.plant().cables();
        let (names, values) = (output_names(cables), output_values(&outputs));
        for ((signal, name), value) in Signal::all(cables).into_iter().zip(&names).zip(values) {
            assert_eq!(names.iter().filter(|other| *other == name).count(), 1, "{name}");
            assert_eq!(signal.value(&outputs), value, "{name}");
            assert_eq!(signal.of(&shown), value, "{name}");
            assert!(value != 0.0, "{name} shows nothing, so this test shows nothing of it");
            assert_eq!(name.ends_with(']'), signal.cable().is_some());
        }
        assert_eq!(names[6], "cable_length[1]");
        assert_eq!(input_names(2, WinchCommand::Speed)[1..3], ["winch_speed[2]", "disturbance_force_x"]);
    }
}
