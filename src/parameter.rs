//! The one list of a model's real parameters: names, units, meanings, ranges, and where each is kept.
//!
//! The FMU's variables, its saved bytes and the comments of a model file read it. Names are those of the FMU.

use crate::model_file::Model;
use crate::parameters::{ParameterError, Parameters, check_range};
use crate::signal::indexed;
use crate::winch::{WinchCommand, WinchParameters};

/// What a finite number may be.
#[derive(Clone, Copy)]
pub(crate) enum Range {
    Any,
    /// Zero or more.
    NotNegative,
    /// More than zero. A description in FMI can only say that zero is the least.
    Positive,
    /// These and between.
    Within(f64, f64),
}

impl Range {
    /// The least number, where there is one.
    pub(crate) fn least(self) -> Option<f64> {
        match self {
            Self::Any => None,
            Self::NotNegative | Self::Positive => Some(0.0),
            Self::Within(least, _) => Some(least),
        }
    }

    /// The greatest number, where there is one.
    pub(crate) fn greatest(self) -> Option<f64> {
        if let Self::Within(_, greatest) = self { Some(greatest) } else { None }
    }

    fn check(self, key: &str, value: f64) -> Result<(), ParameterError> {
        match self {
            Self::Positive if value.is_finite() && value > 0.0 => Ok(()),
            Self::Positive => Err(ParameterError::new(key, value, "a finite number greater than 0")),
            _ => {
                let (least, greatest) = (self.least(), self.greatest());
                check_range(key, value, least.unwrap_or(f64::NEG_INFINITY), greatest.unwrap_or(f64::INFINITY))
            }
        }
    }
}

/// A real parameter, or one for each cable.
pub(crate) struct RealParameter {
    pub(crate) name: &'static str,
    /// Its key in a model file, with `[]` where the cable's number goes.
    pub(crate) key: &'static str,
    /// One for each cable, named `name[1]` to `name[n]`.
    pub(crate) per_cable: bool,
    pub(crate) unit: &'static str,
    pub(crate) quantity: &'static str,
    pub(crate) description: &'static str,
    pub(crate) range: Range,
    pub(crate) nominal: f64,
    /// Where it is kept, `None` where the model has none; the index is 0 where there is one for all cables.
    pub(crate) field: fn(&mut Model, usize) -> Option<&mut f64>,
}

impl RealParameter {
    /// How many variables it has at most in a robot with `cables` cables.
    pub(crate) fn count(&self, cables: usize) -> usize {
        if self.per_cable { cables } else { 1 }
    }

    /// Whether it stands between a motor's torque and the cable.
    pub(crate) fn of_drive(&self) -> bool {
        ["drum_radius", "gear_ratio"].iter().any(|name| self.name.trim_start_matches("own_") == *name)
    }

    /// The variable's name.
    pub(crate) fn variable(&self, index: usize) -> String {
        if self.per_cable { indexed(self.name, index) } else { self.name.to_owned() }
    }
}

/// Unit and meaning of the parameter of this name, as a model file has them in a comment.
pub(crate) fn comment(name: &str) -> String {
    let found = REALS.iter().find(|parameter| parameter.name == name);
    let RealParameter { unit, description, .. } = found.expect("every key with a number is in the list");
    // A sentence begins after the unit.
    let mut text = description.chars();
    let first = text.next().map(|c| c.to_lowercase().to_string()).unwrap_or_default();
    format!("{}, {first}{}", unit.replace('.', " "), text.as_str())
}

/// The parameters of a model whose cables lie on two circles.
fn circles(model: &mut Model) -> Option<&mut Parameters> {
    model.parameters.cable.is_empty().then_some(&mut model.parameters)
}

/// The winches of a model in which they follow a speed or a length.
fn servo(model: &mut Model) -> Option<&mut WinchParameters> {
    Some(&mut model.parameters.winch).filter(|winch| winch.command.is_servo())
}

/// Checks every number of a model's parameters on its own.
///
/// # Errors
/// The first that is out of its range, by its key in a model file.
pub(crate) fn check_ranges(parameters: &Parameters) -> Result<(), ParameterError> {
    let mut model = Model { parameters: parameters.clone(), ..Model::default() };
    // What only a servo has is in its range whatever commands the winches.
    model.parameters.winch.command = WinchCommand::Length;
    let cables = parameters.cables();
    for parameter in &REALS {
        for index in 0..parameter.count(cables) {
            if let Some(value) = (parameter.field)(&mut model, index) {
                let key = parameter.key.replace("[]", &format!("[{}]", index + 1));
                parameter.range.check(&key, *value)?;
            }
        }
    }
    Ok(())
}

/// Checks the integrator's tolerance.
///
/// # Errors
/// It is out of its range.
pub(crate) fn check_tolerance(tolerance: f64) -> Result<(), ParameterError> {
    let found = REALS.iter().find(|parameter| parameter.name == "relative_tolerance");
    found.map_or(Ok(()), |parameter| parameter.range.check(parameter.key, tolerance))
}

/// Every real parameter.
pub(crate) static REALS: [RealParameter; 32] = [
    RealParameter {
        name: "platform_mass",
        key: "platform_mass",
        per_cable: false,
        unit: "kg",
        quantity: "Mass",
        description: "Mass of the platform",
        range: Range::Positive,
        nominal: 1e3,
        field: |m, _| Some(&mut m.parameters.platform_mass),
    },
    RealParameter {
        name: "platform_inertia",
        key: "platform_inertia",
        per_cable: false,
        unit: "kg.m2",
        quantity: "MomentOfInertia",
        description: "Moment of inertia of the platform about its centre of mass",
        range: Range::Positive,
        nominal: 1e5,
        field: |m, _| Some(&mut m.parameters.platform_inertia),
    },
    RealParameter {
        name: "anchor_radius",
        key: "anchor_radius",
        per_cable: false,
        unit: "m",
        quantity: "Length",
        description: "Radius of the circle of anchors",
        range: Range::Positive,
        nominal: 1e3,
        field: |m, _| circles(m).map(|p| &mut p.anchor_radius),
    },
    RealParameter {
        name: "attachment_radius",
        key: "attachment_radius",
        per_cable: false,
        unit: "m",
        quantity: "Length",
        description: "Radius of the circle of attachment points on the platform",
        range: Range::NotNegative,
        nominal: 10.0,
        field: |m, _| circles(m).map(|p| &mut p.attachment_radius),
    },
    RealParameter {
        name: "anchor_angle",
        key: "anchor_angle[]",
        per_cable: true,
        unit: "rad",
        quantity: "Angle",
        description: "Angle of the anchor on its circle",
        range: Range::Any,
        nominal: 1.0,
        field: |m, i| circles(m)?.anchor_angle.get_mut(i),
    },
    RealParameter {
        name: "attachment_angle",
        key: "attachment_angle[]",
        per_cable: true,
        unit: "rad",
        quantity: "Angle",
        description: "Angle of the attachment point on its circle, in the platform's frame",
        range: Range::Any,
        nominal: 1.0,
        field: |m, i| circles(m)?.attachment_angle.get_mut(i),
    },
    RealParameter {
        name: "cable_density",
        key: "cable_density",
        per_cable: false,
        unit: "kg/m",
        quantity: "LinearDensity",
        description: "Mass of the cables per unstretched length",
        range: Range::NotNegative,
        nominal: 0.1,
        field: |m, _| Some(&mut m.parameters.cable_density),
    },
    RealParameter {
        name: "youngs_modulus",
        key: "youngs_modulus",
        per_cable: false,
        unit: "Pa",
        quantity: "Stress",
        description: "Effective Young's modulus of the cables",
        range: Range::Positive,
        nominal: 1e10,
        field: |m, _| Some(&mut m.parameters.youngs_modulus),
    },
    RealParameter {
        name: "cable_area",
        key: "cable_area",
        per_cable: false,
        unit: "m2",
        quantity: "Area",
        description: "Cross-section area of the cables",
        range: Range::Positive,
        nominal: 1e-4,
        field: |m, _| Some(&mut m.parameters.cable_area),
    },
    RealParameter {
        name: "cable_damping",
        key: "cable_damping",
        per_cable: false,
        unit: "N.s",
        quantity: "",
        description: "Damping of the cables: damping coefficient times unstretched length",
        range: Range::NotNegative,
        nominal: 1e4,
        field: |m, _| Some(&mut m.parameters.cable_damping),
    },
    RealParameter {
        name: "relative_tolerance",
        key: "relative_tolerance",
        per_cable: false,
        unit: "1",
        quantity: "",
        description: "Relative tolerance of the integrator; once changed it goes before the experiment's tolerance",
        range: Range::Within(1e-13, 1e-3),
        nominal: 1e-8,
        field: |m, _| Some(&mut m.relative_tolerance),
    },
    RealParameter {
        name: "gravity_x",
        key: "gravity (x)",
        per_cable: false,
        unit: "m/s2",
        quantity: "Acceleration",
        description: "Gravity on the platform along x",
        range: Range::Any,
        nominal: 1e1,
        field: |m, _| Some(&mut m.parameters.gravity[0]),
    },
    RealParameter {
        name: "gravity_y",
        key: "gravity (y)",
        per_cable: false,
        unit: "m/s2",
        quantity: "Acceleration",
        description: "Gravity on the platform along y",
        range: Range::Any,
        nominal: 1e1,
        field: |m, _| Some(&mut m.parameters.gravity[1]),
    },
    RealParameter {
        name: "centre_of_mass_x",
        key: "centre_of_mass (x)",
        per_cable: false,
        unit: "m",
        quantity: "Length",
        description: "Centre of mass of the platform along x of its own frame",
        range: Range::Any,
        nominal: 1.0,
        field: |m, _| Some(&mut m.parameters.centre_of_mass[0]),
    },
    RealParameter {
        name: "centre_of_mass_y",
        key: "centre_of_mass (y)",
        per_cable: false,
        unit: "m",
        quantity: "Length",
        description: "Centre of mass of the platform along y of its own frame",
        range: Range::Any,
        nominal: 1.0,
        field: |m, _| Some(&mut m.parameters.centre_of_mass[1]),
    },
    RealParameter {
        name: "anchor_x",
        key: "cable[].anchor (x)",
        per_cable: true,
        unit: "m",
        quantity: "Length",
        description: "Anchor along x",
        range: Range::Any,
        nominal: 1.0,
        field: |m, i| Some(&mut m.parameters.cable.get_mut(i)?.anchor[0]),
    },
    RealParameter {
        name: "anchor_y",
        key: "cable[].anchor (y)",
        per_cable: true,
        unit: "m",
        quantity: "Length",
        description: "Anchor along y",
        range: Range::Any,
        nominal: 1.0,
        field: |m, i| Some(&mut m.parameters.cable.get_mut(i)?.anchor[1]),
    },
    RealParameter {
        name: "attachment_x",
        key: "cable[].attachment (x)",
        per_cable: true,
        unit: "m",
        quantity: "Length",
        description: "Attachment point along x of the platform's frame",
        range: Range::Any,
        nominal: 1.0,
        field: |m, i| Some(&mut m.parameters.cable.get_mut(i)?.attachment[0]),
    },
    RealParameter {
        name: "attachment_y",
        key: "cable[].attachment (y)",
        per_cable: true,
        unit: "m",
        quantity: "Length",
        description: "Attachment point along y of the platform's frame",
        range: Range::Any,
        nominal: 1.0,
        field: |m, i| Some(&mut m.parameters.cable.get_mut(i)?.attachment[1]),
    },
    RealParameter {
        name: "own_youngs_modulus",
        key: "cable[].youngs_modulus",
        per_cable: true,
        unit: "Pa",
        quantity: "Stress",
        description: "Effective Young's modulus of this cable alone",
        range: Range::Positive,
        nominal: 1e10,
        field: |m, i| m.parameters.cable.get_mut(i)?.youngs_modulus.as_mut(),
    },
    RealParameter {
        name: "own_area",
        key: "cable[].area",
        per_cable: true,
        unit: "m2",
        quantity: "Area",
        description: "Cross-section area of this cable alone",
        range: Range::Positive,
        nominal: 1e-4,
        field: |m, i| m.parameters.cable.get_mut(i)?.area.as_mut(),
    },
    RealParameter {
        name: "own_density",
        key: "cable[].density",
        per_cable: true,
        unit: "kg/m",
        quantity: "LinearDensity",
        description: "Mass per unstretched length of this cable alone",
        range: Range::NotNegative,
        nominal: 0.1,
        field: |m, i| m.parameters.cable.get_mut(i)?.density.as_mut(),
    },
    RealParameter {
        name: "own_damping",
        key: "cable[].damping",
        per_cable: true,
        unit: "N.s",
        quantity: "",
        description: "Damping of this cable alone: damping coefficient times unstretched length",
        range: Range::NotNegative,
        nominal: 1e4,
        field: |m, i| m.parameters.cable.get_mut(i)?.damping.as_mut(),
    },
    RealParameter {
        name: "drum_radius",
        key: "drum_radius",
        per_cable: false,
        unit: "m",
        quantity: "Length",
        description: "Radius of the drums",
        range: Range::Positive,
        nominal: 1.0,
        field: |m, _| Some(&mut m.parameters.winch.drum_radius),
    },
    RealParameter {
        name: "gear_ratio",
        key: "gear_ratio",
        per_cable: false,
        unit: "1",
        quantity: "",
        description: "Turns of a motor to a turn of its drum",
        range: Range::Positive,
        nominal: 1.0,
        field: |m, _| Some(&mut m.parameters.winch.gear_ratio),
    },
    RealParameter {
        name: "rotor_inertia",
        key: "rotor_inertia",
        per_cable: false,
        unit: "kg.m2",
        quantity: "MomentOfInertia",
        description: "Moment of inertia of the winches' rotors about the motor's axis",
        range: Range::NotNegative,
        nominal: 1.0,
        field: |m, _| m.parameters.winch.rotor_inertia.as_mut(),
    },
    RealParameter {
        name: "winch_bandwidth",
        key: "bandwidth",
        per_cable: false,
        unit: "rad/s",
        quantity: "",
        description: "Bandwidth with which winches follow a speed or a length",
        range: Range::Positive,
        nominal: 10.0,
        field: |m, _| servo(m).map(|winch| &mut winch.bandwidth),
    },
    RealParameter {
        name: "winch_damping",
        key: "damping",
        per_cable: false,
        unit: "1",
        quantity: "",
        description: "Damping ratio with which winches follow a length",
        range: Range::NotNegative,
        nominal: 1.0,
        field: |m, _| servo(m).map(|winch| &mut winch.damping),
    },
    RealParameter {
        name: "winch_force_limit",
        key: "force_limit",
        per_cable: false,
        unit: "N",
        quantity: "Force",
        description: "Largest force with which winches follow a speed or a length",
        range: Range::Positive,
        nominal: 1e4,
        field: |m, _| servo(m).map(|winch| &mut winch.force_limit),
    },
    RealParameter {
        name: "own_drum_radius",
        key: "cable[].drum_radius",
        per_cable: true,
        unit: "m",
        quantity: "Length",
        description: "Radius of this winch's drum",
        range: Range::Positive,
        nominal: 1.0,
        field: |m, i| m.parameters.cable.get_mut(i)?.drum_radius.as_mut(),
    },
    RealParameter {
        name: "own_gear_ratio",
        key: "cable[].gear_ratio",
        per_cable: true,
        unit: "1",
        quantity: "",
        description: "Turns of this winch's motor to a turn of its drum",
        range: Range::Positive,
        nominal: 1.0,
        field: |m, i| m.parameters.cable.get_mut(i)?.gear_ratio.as_mut(),
    },
    RealParameter {
        name: "own_rotor_inertia",
        key: "cable[].rotor_inertia",
        per_cable: true,
        unit: "kg.m2",
        quantity: "MomentOfInertia",
        description: "Moment of inertia of this winch's rotor",
        range: Range::NotNegative,
        nominal: 1.0,
        field: |m, i| m.parameters.cable.get_mut(i)?.rotor_inertia.as_mut(),
    },
];
