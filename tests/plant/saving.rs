//! Identical calls give identical bits, also across saving and restoring.

use std::sync::Arc;

use cdpr::dynamics::Inputs;
use cdpr::effect::EffectSpec;
use cdpr::integrator::Solver;
use cdpr::parameters::{CableInertia, CableModel, Parameters};
use cdpr::plant::Plant;
use cdpr::simulation::{Simulation, Start};

use crate::catalogue::everything;
use crate::random::{MODELS, Random, plant};

fn start() -> Start {
    let inputs = Inputs { winch_force: [1.5e4; 4].into(), disturbance: [0.0; 3] };
    Start { pose: [3.0, -2.0, 0.1], twist: [0.4, 0.7, -0.05], inputs, ..Start::default() }
}

fn drive(simulation: &mut Simulation, steps: std::ops::Range<i32>) {
    for k in steps {
        let t = f64::from(k);
        let force: [f64; 4] = std::array::from_fn(|i| 1.5e4 + 2e3 * (0.3 * t + i as f64).sin());
        let slope: [f64; 4] = std::array::from_fn(|i| if k % 3 == 0 { 5e3 * (t + i as f64).cos() } else { 0.0 });
        let inputs = Inputs { winch_force: force.into(), disturbance: [100.0 * t.sin(), 50.0, -300.0 * t.cos()] };
        simulation.set_inputs_with_slopes(inputs, Inputs { winch_force: slope.into(), disturbance: [0.0; 3] });
        simulation.advance([0.01, 0.007, 0.013][k as usize % 3]).unwrap();
    }
}

fn bits(simulation: &Simulation) -> Vec<u64> {
    let out = simulation.outputs();
    let numbers = simulation.states().iter().chain(&out.pose).chain(&out.tension).chain(&out.cable_length);
    numbers.chain([&simulation.time()]).map(|v| v.to_bits()).collect()
}

fn saved(simulation: &Simulation) -> Vec<u8> {
    let mut bytes = Vec::new();
    simulation.save(&mut bytes);
    bytes
}

/// Saved in mid-run and taken up by a fresh object, which has meanwhile been elsewhere.
fn continues_bit_for_bit(plant: &Arc<Plant>, solver: Solver, what: &dyn std::fmt::Debug) {
    let mut simulation = Simulation::new(plant.clone(), &start(), 1e-8).unwrap().with_solver(solver);
    drive(&mut simulation, 0..40);
    let bytes = saved(&simulation);
    drive(&mut simulation, 40..80);
    let mut fresh =
        Simulation::new(plant.clone(), &Start { pose: [0.0; 3], ..start() }, 1e-8).unwrap().with_solver(solver);
    fresh.advance(0.2).unwrap_or_else(|e| panic!("{what:?}: {e}"));
    fresh.restore(&bytes).unwrap();
    assert_eq!(saved(&fresh), bytes, "{what:?}: saved again it is another");
    drive(&mut fresh, 40..80);
    assert_eq!(bits(&simulation), bits(&fresh), "{what:?}");
    assert_eq!(saved(&simulation), saved(&fresh), "{what:?}");
}

#[test]
fn identical_calls_give_identical_bits() {
    let mut random = Random(61);
    let hangs = |e: &EffectSpec| ["cable_sag", "cable_catenary"].contains(&e.id.as_str());
    let effects: Vec<EffectSpec> = everything(&mut random).into_iter().filter(|e| !hangs(e)).collect();
    for model in MODELS {
        let plant = plant(model, CableInertia::Paper, &effects);
        let run = || {
            let mut simulation = Simulation::new(plant.clone(), &start(), 1e-8).unwrap();
            drive(&mut simulation, 0..50);
            bits(&simulation)
        };
        assert_eq!(run(), run());
    }
}

#[test]
fn a_restored_run_continues_bit_for_bit() {
    for model in MODELS {
        for solver in [Solver::Radau, Solver::DormandPrince, Solver::Auto] {
            continues_bit_for_bit(&plant(model, CableInertia::Paper, &[]), solver, &(model, solver));
        }
    }
}

#[test]
fn a_restored_run_continues_bit_for_bit_with_every_effect() {
    let mut random = Random(62);
    for spec in everything(&mut random) {
        let plant = plant(CableModel::LumpedMass, CableInertia::Paper, std::slice::from_ref(&spec));
        for solver in [Solver::Radau, Solver::Auto] {
            continues_bit_for_bit(&plant, solver, &(&spec, solver));
        }
    }
}

/// Between two calls under the same inputs the explicit method keeps the rates, from stiff equations on the implicit one goes on.
#[test]
fn what_the_explicit_method_knows_is_saved() {
    let friction = EffectSpec::new("winch_coulomb_friction", None, &[250.0, 1e-5]).unwrap();
    for (effects, stiff) in [(vec![], false), (vec![friction], true)] {
        let plant = plant(CableModel::LumpedMass, CableInertia::Paper, &effects);
        let begin = || Simulation::new(plant.clone(), &start(), 1e-8).unwrap().with_solver(Solver::Auto);
        let mut simulation = begin();
        let go_on = |simulation: &mut Simulation| (0..100).for_each(|_| simulation.advance(0.01).unwrap());
        go_on(&mut simulation);
        assert_eq!(simulation.stiff_since().is_some(), stiff);
        let bytes = saved(&simulation);
        let mut fresh = begin();
        fresh.restore(&bytes).unwrap();
        assert_eq!(saved(&fresh), bytes);
        let before = simulation.statistics().evaluations;
        go_on(&mut simulation);
        go_on(&mut fresh);
        assert_eq!(bits(&simulation), bits(&fresh));
        assert_eq!(
            fresh.statistics().evaluations,
            simulation.statistics().evaluations - before,
            "known rates are used"
        );
    }
}

/// Whichever method is in use, on trial or not: what is known of both goes on with the state.
#[test]
fn the_choice_between_the_methods_is_saved() {
    let plant = plant(CableModel::MasslessSpring, CableInertia::Paper, &[]);
    let begin = || Simulation::new(plant.clone(), &start(), 1e-8).unwrap().with_solver(Solver::Auto);
    let mut simulation = begin();
    for k in 0..300 {
        let bytes = saved(&simulation);
        let mut fresh = begin();
        fresh.restore(&bytes).unwrap();
        assert_eq!(saved(&fresh), bytes);
        let pull = 2e4 + 500.0 * f64::from(k).sin();
        for simulation in [&mut simulation, &mut fresh] {
            simulation.set_inputs(Inputs::pulling(4, pull));
            simulation.advance(0.01).unwrap();
        }
        assert_eq!(bits(&simulation), bits(&fresh), "step {k}");
    }
    assert!(simulation.statistics().newton_iterations > 0, "the implicit method was tried");
}

/// Saved while a cable is slack and its switch is still to come.
#[test]
fn a_slack_cable_is_saved() {
    let plant = plant(CableModel::LumpedMass, CableInertia::Paper, &[]);
    let mut simulation = Simulation::new(plant.clone(), &start(), 1e-8).unwrap();
    simulation.set_inputs(Inputs { winch_force: [-5e2, 1e4, 1e4, 1e4].into(), disturbance: [0.0; 3] });
    let mut steps = 0;
    while !simulation.slack()[0] {
        simulation.advance(0.005).unwrap();
        steps += 1;
        assert!(steps < 200, "never slack");
    }
    simulation.set_inputs(Inputs { winch_force: [1e4; 4].into(), disturbance: [0.0; 3] });
    let bytes = saved(&simulation);
    let mut fresh = Simulation::new(plant, &start(), 1e-8).unwrap();
    fresh.restore(&bytes).unwrap();
    for s in [&mut simulation, &mut fresh] {
        for _ in 0..400 {
            s.advance(0.01).unwrap();
        }
        assert!(!s.slack()[0], "taut again");
    }
    assert_eq!(bits(&simulation), bits(&fresh));
}

#[test]
fn what_is_no_saved_state_is_refused_and_changes_nothing() {
    let delay = EffectSpec::new("winch_delay", None, &[0.2]).unwrap();
    let pose_delay = EffectSpec::new("pose_sensor_delay", None, &[0.05]).unwrap();
    let plant = plant(CableModel::LumpedMass, CableInertia::Paper, &[delay, pose_delay]);
    let mut simulation = Simulation::new(plant.clone(), &start(), 1e-8).unwrap();
    drive(&mut simulation, 0..20);
    let bytes = saved(&simulation);
    let mut other = Simulation::new(plant, &start(), 1e-8).unwrap();
    let before = bits(&other);
    for length in 0..bytes.len() {
        assert!(other.restore(&bytes[..length]).is_err(), "cut at {length}");
    }
    let mut longer = bytes.clone();
    longer.push(0);
    assert!(other.restore(&longer).is_err());
    // Any number replaced by NaN, or any byte of a count by 255, is noticed.
    for at in (0..bytes.len() - 7).step_by(4) {
        let mut damaged = bytes.clone();
        damaged[at..at + 8].copy_from_slice(&[255; 8]);
        assert!(other.restore(&damaged).is_err(), "damaged at {at}");
    }
    assert_eq!(bits(&other), before);
    let heavier = Parameters { platform_mass: 2600.0, ..Parameters::default() };
    let mut heavier =
        Simulation::new(Arc::new(Plant::new(heavier, other.plant().effects().to_vec()).unwrap()), &start(), 1e-8)
            .unwrap();
    let error = heavier.restore(&bytes).unwrap_err();
    assert!(error.to_string().contains("another model"), "{error}");
}
