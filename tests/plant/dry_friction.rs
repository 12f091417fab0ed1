//! Dry friction written as an expression: it sticks, and it slides, whatever the tolerance.

use std::sync::Arc;

use cdpr::dynamics::Inputs;
use cdpr::effect::EffectSpec;
use cdpr::parameters::{CableModel, Parameters};
use cdpr::plant::Plant;
use cdpr::simulation::{Simulation, Start};

use crate::random::MODELS;

fn simulation(model: CableModel, effects: Vec<EffectSpec>, tolerance: f64) -> Simulation {
    let plant = Plant::new(Parameters { cable_model: model, ..Parameters::default() }, effects).unwrap();
    let start = Start { inputs: pushed(0.0), ..Start::default() };
    Simulation::new(Arc::new(plant), &start, tolerance).unwrap()
}

fn pushed(force: f64) -> Inputs {
    Inputs { winch_force: [1e3; 4].into(), disturbance: [force, 0.0, 0.0] }
}

#[test]
fn a_push_below_the_friction_moves_nothing() {
    for model in MODELS {
        for tolerance in [1e-4, 1e-8] {
            let friction = EffectSpec::expression("platform.force_x", "-500*sign(vx)").unwrap();
            let mut simulation = simulation(model, vec![friction], tolerance);
            simulation.set_inputs(pushed(400.0));
            for _ in 0..1000 {
                simulation.advance(0.01).unwrap();
            }
            // 400/500 = tanh(1.0986): the creep is 1.1e-6 m/s.
            let creep = simulation.states()[0] / 10.0;
            assert!((creep / 1.0986e-6 - 1.0).abs() < 0.01, "{model:?}, {tolerance:e}: {creep:e} m/s");
        }
    }
}

/// Stuck, slid and stuck again: the same journey at every tolerance, and that of friction that turns a thousand times as fast.
#[test]
fn a_swinging_push_slides_as_far_at_every_tolerance() {
    for model in MODELS {
        let journey = |width: &str, tolerance: f64| {
            let text = format!("-500*sign(vx{width})");
            let friction = EffectSpec::expression("platform.force_x", &text).unwrap();
            let mut simulation = simulation(model, vec![friction], tolerance);
            for k in 0..1200 {
                simulation.set_inputs(pushed(1000.0 * (0.005 * f64::from(k)).sin()));
                simulation.advance(0.01).unwrap();
            }
            simulation.states()[0]
        };
        let exact = journey("", 1e-11);
        assert!(exact.abs() > 0.1, "it slides: {exact} m");
        for tolerance in [1e-3, 1e-4, 1e-6, 1e-8] {
            let found = journey("", tolerance);
            assert!((found / exact - 1.0).abs() < 0.01, "{model:?}, {tolerance:e}: {found} m, {exact} m");
        }
        let steeper = journey("*1000", 1e-8);
        assert!((steeper / exact - 1.0).abs() < 0.01, "{model:?}: {steeper} m, {exact} m");
    }
}

#[test]
fn friction_in_a_winch_is_the_same_at_every_tolerance() {
    for model in MODELS {
        let travel = |tolerance: f64| {
            let friction =
                |i| EffectSpec::expression(&format!("winch[{i}]"), &format!("250*sign(unstretched_length_rate[{i}])"));
            let mut simulation = simulation(model, vec![friction(1).unwrap(), friction(2).unwrap()], tolerance);
            for k in 0..1000 {
                simulation.set_inputs(pushed(1000.0 * (0.005 * f64::from(k)).sin()));
                simulation.advance(0.01).unwrap();
            }
            simulation.states()[0]
        };
        let exact = travel(1e-10);
        for tolerance in [1e-3, 1e-4, 1e-6, 1e-8] {
            let found = travel(tolerance);
            assert!((found / exact - 1.0).abs() < 0.02, "{model:?}, {tolerance:e}: {found} m, {exact} m");
        }
    }
}
