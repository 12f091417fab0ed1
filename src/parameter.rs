//! The one list of a model's real parameters: names, units, meanings, ranges, and where each is kept.
//!
//! The FMU's variables, its saved bytes and the comments of a model file read it. Names are those of the FMU.

use crate::model_file::Model;
use crate::parameters::Parameters;
use crate::signal::indexed;
use crate::winch::WinchParameters;

/// A real parameter, or one for each cable.
pub(crate) struct RealParameter {
    pub(crate) name: &'static str,
    /// One for each cable, named `name[1]` to `name[n]`.
    pub(crate) per_cable: bool,
    pub(crate) unit: &'static str,
    pub(crate) quantity: &'static str,
    pub(crate) description: &'static str,
    pub(crate) range: (Option<f64>, Option<f64>),
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

const POSITIVE: (Option<f64>, Option<f64>) = (Some(0.0), None);
const ANY: (Option<f64>, Option<f64>) = (None, None);

/// Every real parameter. A lower bound of zero that is itself not allowed is refused at initialisation.
pub(crate) static REALS: [RealParameter; 32] = [
    RealParameter {
        name: "platform_mass",
        per_cable: false,
        unit: "kg",
        quantity: "Mass",
        description: "Mass of the platform",
        range: POSITIVE,
        nominal: 1e3,
        field: |m, _| Some(&mut m.parameters.platform_mass),
    },
    RealParameter {
        name: "platform_inertia",
        per_cable: false,
        unit: "kg.m2",
        quantity: "MomentOfInertia",
        description: "Moment of inertia of the platform about its centre of mass",
        range: POSITIVE,
        nominal: 1e5,
        field: |m, _| Some(&mut m.parameters.platform_inertia),
    },
    RealParameter {
        name: "anchor_radius",
        per_cable: false,
        unit: "m",
        quantity: "Length",
        description: "Radius of the circle of anchors",
        range: POSITIVE,
        nominal: 1e3,
        field: |m, _| circles(m).map(|p| &mut p.anchor_radius),
    },
    RealParameter {
        name: "attachment_radius",
        per_cable: false,
        unit: "m",
        quantity: "Length",
        description: "Radius of the circle of attachment points on the platform",
        range: POSITIVE,
        nominal: 10.0,
        field: |m, _| circles(m).map(|p| &mut p.attachment_radius),
    },
    RealParameter {
        name: "anchor_angle",
        per_cable: true,
        unit: "rad",
        quantity: "Angle",
        description: "Angle of the anchor on its circle",
        range: ANY,
        nominal: 1.0,
        field: |m, i| circles(m)?.anchor_angle.get_mut(i),
    },
    RealParameter {
        name: "attachment_angle",
        per_cable: true,
        unit: "rad",
        quantity: "Angle",
        description: "Angle of the attachment point on its circle, in the platform's frame",
        range: ANY,
        nominal: 1.0,
        field: |m, i| circles(m)?.attachment_angle.get_mut(i),
    },
    RealParameter {
        name: "cable_density",
        per_cable: false,
        unit: "kg/m",
        quantity: "LinearDensity",
        description: "Mass of the cables per unstretched length",
        range: POSITIVE,
        nominal: 0.1,
        field: |m, _| Some(&mut m.parameters.cable_density),
    },
    RealParameter {
        name: "youngs_modulus",
        per_cable: false,
        unit: "Pa",
        quantity: "Stress",
        description: "Effective Young's modulus of the cables",
        range: POSITIVE,
        nominal: 1e10,
        field: |m, _| Some(&mut m.parameters.youngs_modulus),
    },
    RealParameter {
        name: "cable_area",
        per_cable: false,
        unit: "m2",
        quantity: "Area",
        description: "Cross-section area of the cables",
        range: POSITIVE,
        nominal: 1e-4,
        field: |m, _| Some(&mut m.parameters.cable_area),
    },
    RealParameter {
        name: "cable_damping",
        per_cable: false,
        unit: "N.s",
        quantity: "",
        description: "Damping of the cables: damping coefficient times unstretched length",
        range: POSITIVE,
        nominal: 1e4,
        field: |m, _| Some(&mut m.parameters.cable_damping),
    },
    RealParameter {
        name: "relative_tolerance",
        per_cable: false,
        unit: "1",
        quantity: "",
        description: "Relative tolerance of the integrator; once changed it goes before the experiment's tolerance",
        range: (Some(1e-13), Some(1e-3)),
        nominal: 1e-8,
        field: |m, _| Some(&mut m.relative_tolerance),
    },
    RealParameter {
        name: "gravity_x",
        per_cable: false,
        unit: "m/s2",
        quantity: "Acceleration",
        description: "Gravity on the platform along x",
        range: ANY,
        nominal: 1e1,
        field: |m, _| Some(&mut m.parameters.gravity[0]),
    },
    RealParameter {
        name: "gravity_y",
        per_cable: false,
        unit: "m/s2",
        quantity: "Acceleration",
        description: "Gravity on the platform along y",
        range: ANY,
        nominal: 1e1,
        field: |m, _| Some(&mut m.parameters.gravity[1]),
    },
    RealParameter {
        name: "centre_of_mass_x",
        per_cable: false,
        unit: "m",
        quantity: "Length",
        description: "Centre of mass of the platform along x of its own frame",
        range: ANY,
        nominal: 1.0,
        field: |m, _| Some(&mut m.parameters.centre_of_mass[0]),
    },
    RealParameter {
        name: "centre_of_mass_y",
        per_cable: false,
        unit: "m",
        quantity: "Length",
        description: "Centre of mass of the platform along y of its own frame",
        range: ANY,
        nominal: 1.0,
        field: |m, _| Some(&mut m.parameters.centre_of_mass[1]),
    },
    RealParameter {
        name: "anchor_x",
        per_cable: true,
        unit: "m",
        quantity: "Length",
        description: "Anchor along x",
        range: ANY,
        nominal: 1.0,
        field: |m, i| Some(&mut m.parameters.cable.get_mut(i)?.anchor[0]),
    },
    RealParameter {
        name: "anchor_y",
        per_cable: true,
        unit: "m",
        quantity: "Length",
        description: "Anchor along y",
        range: ANY,
        nominal: 1.0,
        field: |m, i| Some(&mut m.parameters.cable.get_mut(i)?.anchor[1]),
    },
    RealParameter {
        name: "attachment_x",
        per_cable: true,
        unit: "m",
        quantity: "Length",
        description: "Attachment point along x of the platform's frame",
        range: ANY,
        nominal: 1.0,
        field: |m, i| Some(&mut m.parameters.cable.get_mut(i)?.attachment[0]),
    },
    RealParameter {
        name: "attachment_y",
        per_cable: true,
        unit: "m",
        quantity: "Length",
        description: "Attachment point along y of the platform's frame",
        range: ANY,
        nominal: 1.0,
        field: |m, i| Some(&mut m.parameters.cable.get_mut(i)?.attachment[1]),
    },
    RealParameter {
        name: "own_youngs_modulus",
        per_cable: true,
        unit: "Pa",
        quantity: "Stress",
        description: "Effective Young's modulus of this cable alone",
        range: POSITIVE,
        nominal: 1e10,
        field: |m, i| m.parameters.cable.get_mut(i)?.youngs_modulus.as_mut(),
    },
    RealParameter {
        name: "own_area",
        per_cable: true,
        unit: "m2",
        quantity: "Area",
        description: "Cross-section area of this cable alone",
        range: POSITIVE,
        nominal: 1e-4,
        field: |m, i| m.parameters.cable.get_mut(i)?.area.as_mut(),
    },
    RealParameter {
        name: "own_density",
        per_cable: true,
        unit: "kg/m",
        quantity: "LinearDensity",
        description: "Mass per unstretched length of this cable alone",
        range: POSITIVE,
        nominal: 0.1,
        field: |m, i| m.parameters.cable.get_mut(i)?.density.as_mut(),
    },
    RealParameter {
        name: "own_damping",
        per_cable: true,
        unit: "N.s",
        quantity: "",
        description: "Damping of this cable alone: damping coefficient times unstretched length",
        range: POSITIVE,
        nominal: 1e4,
        field: |m, i| m.parameters.cable.get_mut(i)?.damping.as_mut(),
    },
    RealParameter {
        name: "drum_radius",
        per_cable: false,
        unit: "m",
        quantity: "Length",
        description: "Radius of the drums",
        range: POSITIVE,
        nominal: 1.0,
        field: |m, _| Some(&mut m.parameters.winch.drum_radius),
    },
    RealParameter {
        name: "gear_ratio",
        per_cable: false,
        unit: "1",
        quantity: "",
        description: "Turns of a motor to a turn of its drum",
        range: POSITIVE,
        nominal: 1.0,
        field: |m, _| Some(&mut m.parameters.winch.gear_ratio),
    },
    RealParameter {
        name: "rotor_inertia",
        per_cable: false,
        unit: "kg.m2",
        quantity: "MomentOfInertia",
        description: "Moment of inertia of the winches' rotors about the motor's axis",
        range: POSITIVE,
        nominal: 1.0,
        field: |m, _| m.parameters.winch.rotor_inertia.as_mut(),
    },
    RealParameter {
        name: "winch_bandwidth",
        per_cable: false,
        unit: "rad/s",
        quantity: "",
        description: "Bandwidth with which winches follow a speed or a length",
        range: POSITIVE,
        nominal: 10.0,
        field: |m, _| servo(m).map(|winch| &mut winch.bandwidth),
    },
    RealParameter {
        name: "winch_damping",
        per_cable: false,
        unit: "1",
        quantity: "",
        description: "Damping ratio with which winches follow a length",
        range: POSITIVE,
        nominal: 1.0,
        field: |m, _| servo(m).map(|winch| &mut winch.damping),
    },
    RealParameter {
        name: "winch_force_limit",
        per_cable: false,
        unit: "N",
        quantity: "Force",
        description: "Largest force with which winches follow a speed or a length",
        range: POSITIVE,
        nominal: 1e4,
        field: |m, _| servo(m).map(|winch| &mut winch.force_limit),
    },
    RealParameter {
        name: "own_drum_radius",
        per_cable: true,
        unit: "m",
        quantity: "Length",
        description: "Radius of this winch's drum",
        range: POSITIVE,
        nominal: 1.0,
        field: |m, i| m.parameters.cable.get_mut(i)?.drum_radius.as_mut(),
    },
    RealParameter {
        name: "own_gear_ratio",
        per_cable: true,
        unit: "1",
        quantity: "",
        description: "Turns of this winch's motor to a turn of its drum",
        range: POSITIVE,
        nominal: 1.0,
        field: |m, i| m.parameters.cable.get_mut(i)?.gear_ratio.as_mut(),
    },
    RealParameter {
        name: "own_rotor_inertia",
        per_cable: true,
        unit: "kg.m2",
        quantity: "MomentOfInertia",
        description: "Moment of inertia of this winch's rotor",
        range: POSITIVE,
        nominal: 1.0,
        field: |m, i| m.parameters.cable.get_mut(i)?.rotor_inertia.as_mut(),
    },
];
