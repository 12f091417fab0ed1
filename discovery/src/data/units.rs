//! Units that a column of a recording may come in.

use std::f64::consts::{PI, TAU};

/// What a column measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Quantity {
    Time,
    Length,
    Angle,
    Force,
    Torque,
    /// What a drive or an encoder reports of its own; `scale` says how much of the column's unit one of it is.
    Raw,
}

impl Quantity {
    /// Of one of our columns.
    pub(crate) fn of(column: &str) -> Self {
        match column {
            "time" => Self::Time,
            "phi" => Self::Angle,
            "disturbance_torque" => Self::Torque,
            _ if column.starts_with("winch_force") || column.starts_with("tension") => Self::Force,
            _ if column.starts_with("disturbance_force") => Self::Force,
            _ => Self::Length,
        }
    }

    /// Its SI unit.
    pub(crate) fn si(self) -> &'static str {
        match self {
            Self::Time => "s",
            Self::Length => "m",
            Self::Angle => "rad",
            Self::Force => "N",
            Self::Torque => "N m",
            Self::Raw => "1",
        }
    }

    /// The units known for it.
    pub(crate) fn units(self) -> String {
        UNITS.iter().filter(|unit| unit.1 == self).map(|unit| unit.0).collect::<Vec<_>>().join(", ")
    }
}

/// Name, what it is a unit of, and how much of the SI unit it is.
const UNITS: [(&str, Quantity, f64); 38] = [
    ("s", Quantity::Time, 1.0),
    ("ms", Quantity::Time, 1e-3),
    ("us", Quantity::Time, 1e-6),
    ("ns", Quantity::Time, 1e-9),
    ("min", Quantity::Time, 60.0),
    ("h", Quantity::Time, 3600.0),
    ("m", Quantity::Length, 1.0),
    ("mm", Quantity::Length, 1e-3),
    ("cm", Quantity::Length, 1e-2),
    ("um", Quantity::Length, 1e-6),
    ("km", Quantity::Length, 1e3),
    ("in", Quantity::Length, 0.0254),
    ("ft", Quantity::Length, 0.3048),
    ("rad", Quantity::Angle, 1.0),
    ("mrad", Quantity::Angle, 1e-3),
    ("deg", Quantity::Angle, PI / 180.0),
    ("degree", Quantity::Angle, PI / 180.0),
    ("degrees", Quantity::Angle, PI / 180.0),
    ("rev", Quantity::Angle, TAU),
    ("N", Quantity::Force, 1.0),
    ("kN", Quantity::Force, 1e3),
    ("MN", Quantity::Force, 1e6),
    ("daN", Quantity::Force, 10.0),
    ("kgf", Quantity::Force, 9.806_65),
    ("lbf", Quantity::Force, 4.448_221_615_260_5),
    ("N.m", Quantity::Torque, 1.0),
    ("N m", Quantity::Torque, 1.0),
    ("Nm", Quantity::Torque, 1.0),
    ("kN.m", Quantity::Torque, 1e3),
    ("kN m", Quantity::Torque, 1e3),
    ("kNm", Quantity::Torque, 1e3),
    ("A", Quantity::Raw, 1.0),
    ("mA", Quantity::Raw, 1e-3),
    ("V", Quantity::Raw, 1.0),
    ("mV", Quantity::Raw, 1e-3),
    ("counts", Quantity::Raw, 1.0),
    ("%", Quantity::Raw, 1.0),
    ("1", Quantity::Raw, 1.0),
];

/// What `unit` is a unit of, and how much of the SI unit it is.
pub(crate) fn unit(name: &str) -> Option<(Quantity, f64)> {
    UNITS.iter().find(|known| known.0 == name).map(|known| (known.1, known.2))
}

/// Every unit.
pub(crate) fn all_units() -> String {
    UNITS.map(|unit| unit.0).join(", ")
}
