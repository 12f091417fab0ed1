//! The controller under the rules of the FMI layer.

use std::fs;
use std::path::Path;

use fmi2_export::description::Causality;
use fmi2_export::{Experiment, Model, Value};
use winch_controller::WinchController;

fn fresh() -> WinchController {
    WinchController::instantiate(None).unwrap()
}

fn index(model: &WinchController, name: &str) -> usize {
    model.description().find(name).unwrap()
}

fn values(model: &mut WinchController) -> Vec<Value> {
    (0..model.description().variables.len()).map(|i| model.get(i).unwrap()).collect()
}

const EXPERIMENT: Experiment = Experiment { start_time: 0.0, stop_time: None, tolerance: None };

#[test]
fn the_table_keeps_the_rules() {
    fresh().description().validate().unwrap();
}

#[test]
fn every_start_is_what_the_model_starts_with() {
    let mut model = fresh();
    for index in 0..model.description().variables.len() {
        let variable = &model.description().variables[index];
        let (name, start) = (variable.name.clone(), variable.start_of());
        if let Some(start) = start {
            assert_eq!(model.get(index).unwrap(), start, "{name}");
        }
    }
}

#[test]
fn every_parameter_can_be_set_on_its_own() {
    let parameters: Vec<usize> = {
        let model = fresh();
        let table = &model.description().variables;
        (0..table.len()).filter(|&i| table[i].causality == Causality::Parameter).collect()
    };
    for &changed in &parameters {
        let (mut before, mut after) = (fresh(), fresh());
        after.set(changed, Value::Real(0.123)).unwrap();
        for &i in &parameters {
            let same = before.get(i).unwrap() == after.get(i).unwrap();
            assert_eq!(same, i != changed, "variable {i} after setting {changed}");
        }
    }
}

#[test]
fn a_restored_controller_goes_on_bit_for_bit() {
    let mut model = fresh();
    let (x, phi, bandwidth) = (index(&model, "x"), index(&model, "phi"), index(&model, "position_bandwidth"));
    model.set(bandwidth, Value::Real(0.3)).unwrap();
    model.initialise(EXPERIMENT).unwrap();
    let go = |model: &mut WinchController, from: u32| {
        let mut all = Vec::new();
        for i in from..from + 50 {
            let t = 0.02 * f64::from(i);
            model.set(x, Value::Real(0.1 * t.sin())).unwrap();
            model.set(phi, Value::Real(0.01 * t.cos())).unwrap();
            model.step(t, 0.02).unwrap();
            all.push(values(model));
        }
        all
    };
    go(&mut model, 0);
    let mut saved = Vec::new();
    model.save(&mut saved);
    let first = go(&mut model, 50);
    let mut other = fresh();
    other.restore(&saved).unwrap();
    assert_eq!(go(&mut other, 50), first);

    assert!(other.restore(&saved[1..]).is_err());
    assert!(other.restore(&[]).is_err());
    other.reset();
    assert_eq!(values(&mut other), values(&mut fresh()));
}

#[test]
fn bounds_in_the_wrong_order_are_refused() {
    let mut model = fresh();
    let max = index(&model, "max_tension");
    model.set(max, Value::Real(500.0)).unwrap();
    let problem = model.initialise(EXPERIMENT).unwrap_err().to_string();
    assert!(problem.contains("1000, 20000, 500 N"), "{problem}");
}

#[test]
fn a_start_out_of_the_bounds_is_refused() {
    let mut model = fresh();
    let start = index(&model, "start_tension");
    model.set(start, Value::Real(500.0)).unwrap();
    let problem = model.initialise(EXPERIMENT).unwrap_err().to_string();
    assert!(problem.contains("500 in 1000 to 60000 N"), "{problem}");
}

#[test]
fn a_wrench_out_of_reach_is_told_once() {
    let mut model = fresh();
    let (x, feasible) = (index(&model, "x"), index(&model, "feasible"));
    model.initialise(EXPERIMENT).unwrap();
    model.set(x, Value::Real(-400.0)).unwrap();
    for i in 0..100 {
        model.step(0.02 * f64::from(i), 0.02).unwrap();
    }
    assert_eq!(model.get(feasible).unwrap(), Value::Boolean(false));
    assert_eq!(model.take_log().len(), 1);
    model.set(x, Value::Real(0.0)).unwrap();
    for i in 100..400 {
        model.step(0.02 * f64::from(i), 0.02).unwrap();
    }
    assert_eq!(model.get(feasible).unwrap(), Value::Boolean(true));
    assert_eq!(model.take_log().len(), 1);
}

/// What is wrong with the controller of this model file.
fn refused(name: &str, model: &str) -> String {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    fs::create_dir_all(&folder).unwrap();
    fs::write(folder.join("model.toml"), model).unwrap();
    match WinchController::instantiate(Some(&folder)) {
        Err(error) => error.to_string(),
        Ok(mut controller) => controller.initialise(EXPERIMENT).unwrap_err().to_string(),
    }
}

#[test]
fn robots_that_it_cannot_hold_are_refused_with_the_reason() {
    let two = "[[cable]]\nanchor = [-3.0, 3.0]\nattachment = [-0.2, 0.1]\n\
               [[cable]]\nanchor = [3.0, 3.0]\nattachment = [0.2, 0.1]\n";
    let problem = refused("two", &format!("gravity = [0.0, -9.81]\n{two}"));
    assert!(problem.contains("2 cables cannot exert every force and torque in the plane; expected 3"), "{problem}");
    let problem = refused("torque", "[winch]\ncommand = \"torque\"\nrotor_inertia = 0.1\n");
    assert!(problem.contains("model.toml: `command` of the winches is \"torque\""), "{problem}");
    let problem = refused("broken", "platform_mass = -1.0\n");
    assert!(problem.contains("model.toml: line 1") && problem.contains("platform_mass"), "{problem}");
}
