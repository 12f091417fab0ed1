//! The plant through the `Model` trait, as the FMI layer sees it.

mod blocks;
mod derivatives;
mod description;
mod initial_derivatives;
mod lifecycle;
mod saving;
mod sharing;
mod solver;

use fmi2_export::{Experiment, Model as _, Value};

use super::CablePlatform;
use crate::effect::{CATALOGUE, EffectSpec, Scope};
use crate::model_file::Model;
use crate::parameters::CableModel;

const MODELS: [CableModel; 3] = [CableModel::Rigid, CableModel::MasslessSpring, CableModel::LumpedMass];

const EXPERIMENT: Experiment = Experiment { start_time: 0.0, stop_time: None, tolerance: None };

fn index(platform: &CablePlatform, name: &str) -> usize {
    platform.description().find(name).unwrap_or_else(|| panic!("no variable `{name}`"))
}

fn get(platform: &mut CablePlatform, name: &str) -> f64 {
    let index = index(platform, name);
    match platform.get(index).unwrap() {
        Value::Real(value) => value,
        other => panic!("`{name}` is {other:?}"),
    }
}

fn set(platform: &mut CablePlatform, name: &str, value: f64) {
    let index = index(platform, name);
    platform.set(index, Value::Real(value)).unwrap();
}

fn choose(platform: &mut CablePlatform, name: &str, item: i32) {
    let index = index(platform, name);
    platform.set(index, Value::Integer(item)).unwrap();
}

fn initialise(platform: &mut CablePlatform, experiment: Experiment) {
    platform.enter_initialisation(experiment).unwrap();
    platform.initialise(experiment).unwrap();
}

/// Every real variable.
fn snapshot(platform: &mut CablePlatform) -> Vec<f64> {
    (0..platform.description().variables.len())
        .filter_map(|index| match platform.get(index).unwrap() {
            Value::Real(value) => Some(value),
            _ => None,
        })
        .collect()
}

/// A model off the beaten track: turned, moving, pulled unevenly.
fn moving(cable_model: CableModel, effects: Vec<EffectSpec>) -> Model {
    let mut model = Model { effects, ..Model::default() };
    model.parameters.cable_model = cable_model;
    model.start.pose = [4.0, -7.0, 0.2];
    model.start.twist = [0.6, -0.4, 0.01];
    model.start.inputs.winch_force = [8000.0, 9000.0, 7500.0, 8600.0].into();
    model.start.inputs.disturbance = [200.0, -150.0, 900.0];
    model
}

/// Every effect of the catalogue at a typical size, on cable 2 where it acts on one.
fn one_of_each() -> Vec<EffectSpec> {
    CATALOGUE
        .iter()
        .filter(|info| info.id != "expression")
        .map(|info| {
            let values: Vec<f64> =
                info.parameters.iter().map(|p| p.default.unwrap_or(0.5 * p.typical.0 + 0.5 * p.typical.1)).collect();
            let cable = (info.scope == Scope::EachCable).then_some(2);
            let values = match info.id {
                // Room for the forces at hand, and a cable that is light against them.
                "winch_saturation" => vec![0.0, 12_000.0],
                "cable_sag" => vec![1.0, 8000.0],
                _ => values,
            };
            EffectSpec::new(info.id, cable, &values).unwrap()
        })
        .chain([EffectSpec::expression("platform.force_y", "-3*vx*unstretched_length[3] + 2*sin(time)").unwrap()])
        .collect()
}
