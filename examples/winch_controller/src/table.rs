//! The FMU's variables.

use fmi2_export::description::{
    DefaultExperiment, Dependency, LogCategory, ModelDescription, Unit, Variability, Variable,
};

use crate::control::Measurement;
use crate::settings::{Entry, Settings};

/// Messages of the controller itself.
pub(crate) const LOG_CATEGORY: &str = "logController";

/// What a place in the table stands for.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Place {
    Pose(usize),
    Twist(usize),
    Force(usize),
    Reference(usize),
    Feasible,
    Setting(Entry),
}

const POSE: [(&str, &str); 3] = [("x", "m"), ("y", "m"), ("phi", "rad")];
const TWIST: [(&str, &str); 3] = [("vx", "m/s"), ("vy", "m/s"), ("omega", "rad/s")];
/// Settings have the value reference of their place and this, so that none is another's whatever comes before.
const FIRST_SETTING: u32 = 100;

/// Every place, in the table's order.
pub(crate) fn places(settings: &Settings) -> Vec<Place> {
    (0..3)
        .map(Place::Pose)
        .chain((0..3).map(Place::Twist))
        .chain((0..settings.robot.cables()).map(Place::Force))
        .chain((0..3).map(Place::Reference))
        .chain([Place::Feasible])
        .chain(settings.entries().into_iter().map(Place::Setting))
        .collect()
}

/// The table that goes with [`places`], for a controller that begins with these settings and this measurement.
pub(crate) fn table(settings: &Settings, measured: &Measurement) -> ModelDescription {
    let mut table = ModelDescription::new("WinchController", "WinchController");
    table.description = Some(format!(
        "Sampled pose controller for a planar robot on {} cables: feed-forward, PD feedback, bounded winch forces",
        settings.robot.cables()
    ));
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
    let places = places(settings);
    let mut settings = settings.clone();
    let known = initial_knowns(&places);
    for (index, place) in places.into_iter().enumerate() {
        table.add(variable(place, index as u32, &mut settings, measured, &known));
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
        Unit::mechanical("m/s2", 0, 1, -2, 0),
        Unit::mechanical("N", 1, 1, -2, 0).display("kN", 1e-3),
        Unit::mechanical("rad", 0, 0, 0, 1).display("deg", degrees),
        Unit::mechanical("rad/s", 0, 0, -1, 1).display("deg/s", degrees),
        Unit::mechanical("s", 0, 0, 1, 0),
    ]
}

/// `known`: what the outputs depend on at first.
fn variable(
    place: Place,
    reference: u32,
    settings: &mut Settings,
    measured: &Measurement,
    known: &[Dependency],
) -> Variable {
    match place {
        Place::Pose(k) => {
            let (name, unit) = POSE[k];
            shown_in_degrees(Variable::real(name, reference).input().unit(unit).start(measured.pose[k]), unit)
                .described(format!("Measured {name} of the platform"))
        }
        Place::Twist(k) => {
            let (name, unit) = TWIST[k];
            shown_in_degrees(Variable::real(name, reference).input().unit(unit).start(measured.twist[k]), unit)
                .described(format!("Measured rate of {}", POSE[k].0))
        }
        Place::Force(i) => sampled(Variable::real(format!("winch_force[{}]", i + 1), reference))
            .unit("N")
            .nominal(settings.bounds.mean)
            .initially_depends_on(known.to_vec())
            .described(format!("Force of winch {}, positive when it pulls", i + 1)),
        Place::Reference(k) => {
            let (name, unit) = POSE[k];
            let variable = sampled(Variable::real(format!("reference_{name}"), reference)).unit(unit);
            shown_in_degrees(variable, unit).described(format!("Where {name} should be"))
        }
        Place::Feasible => sampled(Variable::boolean("feasible", 0))
            .initially_depends_on(known.to_vec())
            .described("Do the winch forces give the wanted wrench within their bounds?"),
        Place::Setting(entry) => setting(entry, FIRST_SETTING + reference, settings),
    }
}

fn setting(entry: Entry, reference: u32, settings: &mut Settings) -> Variable {
    let setting = entry.setting;
    let variable = Variable::real(entry.name(), reference).unit(setting.unit).start(*entry.place(settings));
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
fn initial_knowns(places: &[Place]) -> Vec<Dependency> {
    let known = |(index, place): (usize, &Place)| match place {
        Place::Pose(_) | Place::Twist(_) | Place::Setting(_) => Some(Dependency::on(index)),
        Place::Force(_) | Place::Reference(_) | Place::Feasible => None,
    };
    places.iter().enumerate().filter_map(known).collect()
}

fn shown_in_degrees(variable: Variable, unit: &str) -> Variable {
    match unit {
        "rad" => variable.display_unit("deg"),
        "rad/s" => variable.display_unit("deg/s"),
        _ => variable,
    }
}
