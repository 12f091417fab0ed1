//! The FMU's variables.

use fmi2_export::description::{
    DefaultExperiment, Dependency, LogCategory, ModelDescription, Unit, Variability, Variable,
};

use crate::settings::{SETTINGS, Settings};

/// Messages of the controller itself.
pub(crate) const LOG_CATEGORY: &str = "logController";

/// What a place in the table stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Place {
    Pose(usize),
    Twist(usize),
    Force(usize),
    Reference(usize),
    Feasible,
    Setting(usize),
}

const POSE: [(&str, &str); 3] = [("x", "m"), ("y", "m"), ("phi", "rad")];
const TWIST: [(&str, &str); 3] = [("vx", "m/s"), ("vy", "m/s"), ("omega", "rad/s")];
/// Value reference of the first setting; a gap leaves room for more inputs and outputs.
const FIRST_SETTING: u32 = 100;

/// Every place, in the table's order.
pub(crate) fn places() -> Vec<Place> {
    (0..3)
        .map(Place::Pose)
        .chain((0..3).map(Place::Twist))
        .chain((0..4).map(Place::Force))
        .chain((0..3).map(Place::Reference))
        .chain([Place::Feasible])
        .chain((0..SETTINGS.len()).map(Place::Setting))
        .collect()
}

/// The table that goes with [`places`].
pub(crate) fn table() -> ModelDescription {
    let mut table = ModelDescription::new("WinchController", "WinchController");
    table.description = Some(
        "Sampled pose controller for a planar robot on four cables: feed-forward, PD feedback, bounded winch forces"
            .into(),
    );
    table.version = Some(env!("CARGO_PKG_VERSION").into());
    table.license = Some(env!("CARGO_PKG_LICENSE").into());
    // Its outputs change at samples only, so there is nothing to take derivatives of.
    table.capabilities.can_interpolate_inputs = false;
    table.capabilities.max_output_derivative_order = 0;
    table.capabilities.provides_directional_derivative = false;
    table.units = units();
    table.log_categories = vec![LogCategory {
        name: LOG_CATEGORY.into(),
        description: "When the wanted wrench leaves and enters what the bounds allow".into(),
    }];
    table.default_experiment = Some(DefaultExperiment {
        start_time: Some(0.0),
        stop_time: Some(120.0),
        tolerance: None,
        step_size: Some(0.02),
    });
    for (index, place) in places().into_iter().enumerate() {
        table.add(variable(place, index));
    }
    table
}

fn units() -> Vec<Unit> {
    let degrees = 180.0 / std::f64::consts::PI;
    vec![
        Unit::mechanical("1", 0, 0, 0, 0),
        Unit::mechanical("kg", 1, 0, 0, 0),
        Unit::mechanical("kg/m", 1, -1, 0, 0),
        Unit::mechanical("kg.m2", 1, 2, 0, 0),
        Unit::mechanical("m", 0, 1, 0, 0),
        Unit::mechanical("m/s", 0, 1, -1, 0),
        Unit::mechanical("N", 1, 1, -2, 0).display("kN", 1e-3),
        Unit::mechanical("rad", 0, 0, 0, 1).display("deg", degrees),
        Unit::mechanical("rad/s", 0, 0, -1, 1).display("deg/s", degrees),
        Unit::mechanical("s", 0, 0, 1, 0),
    ]
}

fn variable(place: Place, index: usize) -> Variable {
    let reference = index as u32;
    match place {
        Place::Pose(k) => {
            let (name, unit) = POSE[k];
            shown_in_degrees(Variable::real(name, reference).input().unit(unit).start(0.0), unit)
                .described(format!("Measured {name} of the platform"))
        }
        Place::Twist(k) => {
            let (name, unit) = TWIST[k];
            shown_in_degrees(Variable::real(name, reference).input().unit(unit).start(0.0), unit)
                .described(format!("Measured rate of {}", POSE[k].0))
        }
        Place::Force(i) => sampled(Variable::real(format!("winch_force[{}]", i + 1), reference))
            .unit("N")
            .nominal(2e4)
            .initially_depends_on(initial_knowns())
            .described(format!("Force of winch {}, positive when it pulls", i + 1)),
        Place::Reference(k) => {
            let (name, unit) = POSE[k];
            let variable = sampled(Variable::real(format!("reference_{name}"), reference)).unit(unit);
            shown_in_degrees(variable, unit).described(format!("Where {name} should be"))
        }
        Place::Feasible => sampled(Variable::boolean("feasible", 0))
            .initially_depends_on(initial_knowns())
            .described("Do the winch forces give the wanted wrench within their bounds?"),
        Place::Setting(k) => setting(k),
    }
}

fn setting(k: usize) -> Variable {
    let setting = &SETTINGS[k];
    let start = *(setting.place)(&mut Settings::default());
    let variable = Variable::real(setting.name, FIRST_SETTING + k as u32).unit(setting.unit).start(start);
    let variable = if setting.tunable { variable.tunable_parameter() } else { variable.parameter() };
    let variable = match setting.min {
        Some(min) => variable.min(min),
        None => variable,
    };
    shown_in_degrees(variable, setting.unit).described(setting.description)
}

/// An output that changes when a step is taken and at no other time, whatever the inputs do.
fn sampled(variable: Variable) -> Variable {
    variable.output().variability(Variability::Discrete).depends_on([])
}

/// In initialisation mode the first sample follows the inputs and all parameters.
fn initial_knowns() -> Vec<Dependency> {
    let known = |(index, place): (usize, Place)| match place {
        Place::Pose(_) | Place::Twist(_) | Place::Setting(_) => Some(Dependency::on(index)),
        _ => None,
    };
    places().into_iter().enumerate().filter_map(known).collect()
}

fn shown_in_degrees(variable: Variable, unit: &str) -> Variable {
    match unit {
        "rad" => variable.display_unit("deg"),
        "rad/s" => variable.display_unit("deg/s"),
        _ => variable,
    }
}
