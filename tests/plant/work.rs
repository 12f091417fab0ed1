//! Calls that would not have returned: what is too fast for the plant ends in an answer, soon.

use std::sync::Arc;

use cdpr::dynamics::Inputs;
use cdpr::effect::EffectSpec;
use cdpr::integrator::IntegrationError;
use cdpr::parameters::{CableModel, Parameters};
use cdpr::plant::Plant;
use cdpr::simulation::{Simulation, Start};

use crate::random::MODELS;

fn quiet() -> Inputs {
    Inputs::pulling(4, 1e3)
}

fn simulation(model: CableModel, effects: Vec<EffectSpec>, time: f64, tolerance: f64) -> Simulation {
    let plant = Plant::new(Parameters { cable_model: model, ..Parameters::default() }, effects).unwrap();
    let start = Start { time, pose: [0.1, 0.1, 0.05], inputs: quiet(), ..Start::default() };
    Simulation::new(Arc::new(plant), &start, tolerance).unwrap()
}

fn expression(target: &str, text: &str) -> Vec<EffectSpec> {
    vec![EffectSpec::expression(target, text).unwrap()]
}

/// Goes on in steps of `step` until `end` or an error, each of them in bounded work, and returns the error.
fn bounded(simulation: &mut Simulation, step: f64, end: f64) -> Option<IntegrationError> {
    while simulation.time() < end {
        let before = simulation.statistics().evaluations;
        let result = simulation.advance(step);
        let work = simulation.statistics().evaluations - before;
        assert!(work as f64 <= 250_000.0 + 1e6 * step, "{work} evaluations in a call of {step} s");
        assert!(simulation.states().iter().all(|v| v.is_finite()), "{:?}", simulation.states());
        if let Err(error) = result {
            assert_eq!(error.time(), simulation.time(), "{error}");
            assert!(error.to_string().contains(&format!("t = {} s", simulation.time())), "{error}");
            return Some(error);
        }
    }
    None
}

#[test]
fn a_sign_in_an_expression_does_not_stop_the_time() {
    for model in MODELS {
        let mut simulation = simulation(model, expression("platform.force_x", "-500*sign(vx)"), 0.0, 1e-8);
        assert_eq!(bounded(&mut simulation, 0.01, 5.0), None);
        let work = simulation.statistics().evaluations;
        assert!(work < 20_000, "{model:?}: {work} evaluations for 5 s at rest");
    }
}

#[test]
fn a_winch_that_swings_with_1e26_newton_ends_in_an_answer() {
    for model in MODELS {
        for start in [0.0, 1.0] {
            let mut simulation = simulation(model, expression("winch[1]", "1e26*sin(time)"), start, 1e-8);
            assert!(bounded(&mut simulation, 0.01, start + 1.0).is_some(), "{model:?}");
        }
    }
}

#[test]
fn a_torque_of_1e9_newton_metres_ends_in_an_answer() {
    for model in MODELS {
        for step in [2.0, 3600.0] {
            let mut simulation = simulation(model, vec![], 0.0, 1e-8);
            simulation.set_inputs(Inputs { disturbance: [0.0, 0.0, 1e9], ..quiet() });
            let before = simulation.statistics().evaluations;
            let error = simulation.advance(step).unwrap_err();
            assert!(matches!(error, IntegrationError::TooMuchWork { .. }), "{error}");
            assert!(simulation.time() > 0.1 && simulation.time() < 2.0, "{error}");
            assert!(simulation.statistics().evaluations - before < 2_000_000, "{error}");
        }
    }
}

#[test]
fn input_slopes_of_1e27_end_in_an_answer() {
    for model in MODELS {
        for step in [0.01, 2.0] {
            for slopes in [
                Inputs { winch_force: [1e27; 4].into(), disturbance: [0.0; 3] },
                Inputs { winch_force: [0.0; 4].into(), disturbance: [1e27; 3] },
            ] {
                let mut simulation = simulation(model, vec![], 0.0, 1e-8);
                simulation.set_inputs_with_slopes(quiet(), slopes);
                assert!(bounded(&mut simulation, step, 1.0).is_some(), "{model:?}");
            }
        }
    }
}

#[test]
fn creep_of_1_newton_ends_in_an_answer() {
    for model in MODELS {
        for force in [1e3, 2e4] {
            let creep = vec![EffectSpec::new("cable_creep", None, &[1.0, 1.0]).unwrap()];
            let mut simulation = simulation(model, creep, 0.0, 1e-8);
            simulation.set_inputs(Inputs { winch_force: [force; 4].into(), ..quiet() });
            bounded(&mut simulation, 0.1, 1.0);
        }
    }
}

/// At 3.6e14 s a clock of 64 bits ticks in sixteenths of a second: shorter stretches do not move it.
#[test]
fn a_delayed_pose_at_3_6e14_seconds_ends_in_an_answer() {
    for model in MODELS {
        for (start, step) in [(3.6e14, 0.1), (3.6e14, 1.0), (-3.6e14, 1.0), (1e17, 100.0)] {
            let delay = vec![EffectSpec::new("pose_sensor_delay", None, &[0.1]).unwrap()];
            let mut simulation = simulation(model, delay, start, 1e-8);
            bounded(&mut simulation, step, start + 10.0 * step);
            assert!(simulation.outputs().pose.iter().all(|v| v.is_finite()));
        }
    }
}
