//! The energy balance, in every instant and along simulations.

use cdpr::dynamics::Inputs;
use cdpr::effect::EffectSpec;
use cdpr::parameters::{CableInertia, CableModel, Parameters};
use cdpr::per_cable::PerCable;
use cdpr::plant::Plant;
use cdpr::simulation::{Simulation, Start};
use num_dual::Dual64;
use std::sync::Arc;

use crate::catalogue::everything;
use crate::random::{INERTIAS, MODELS, Random, plant, state};

/// The rate of the energy along the motion, by dual numbers, and the power said to make it; and the largest of them.
fn balance(plant: &Plant, time: f64, y: &[f64], u: &Inputs, slack: &PerCable<bool>) -> (f64, f64, f64) {
    let mut rates = vec![0.0; y.len()];
    plant.rates(time, y, u, slack, &mut rates);
    let moving: Vec<Dual64> = y.iter().zip(&rates).map(|(y, r)| Dual64::new(*y, *r)).collect();
    let rate = plant.energy(&moving, slack).total().eps;
    let power = plant.power(time, y, u, &plant.evaluate(time, y, u, slack));
    let size = [power.winches, power.disturbance, power.effects, power.damping, power.cable_laws, power.reeling];
    (rate, power.total(), size.iter().fold(1.0_f64, |m, p| m.max(p.abs())))
}

#[test]
fn energy_changes_by_the_power_in_every_instant() {
    let mut random = Random(31);
    for model in MODELS {
        for inertia in INERTIAS {
            let plant = plant(model, inertia, &[]);
            for _ in 0..100 {
                let (y, u) = state(&mut random, &plant);
                let (rate, power, size) = balance(&plant, 0.0, &y, &u, &[false; 4].into());
                assert!((rate - power).abs() < 1e-10 * size, "{model:?} {inertia:?}: {rate} {power}");
            }
        }
    }
}

#[test]
fn energy_balances_with_slack_cables() {
    let mut random = Random(32);
    // Without cable mass there must be drums, or the massless spring takes the place of the lumped mass.
    let drums = EffectSpec::new("winch_drum_inertia", None, &[50.0]).unwrap();
    for inertia in INERTIAS {
        let plant = plant(CableModel::LumpedMass, inertia, std::slice::from_ref(&drums));
        for _ in 0..100 {
            let (mut y, u) = state(&mut random, &plant);
            for i in 0..4 {
                // Some longer than their chord, some stretched but closing fast.
                let at = plant.unstretched_index(i).unwrap();
                y[at] *= 1.0 + random.within(-2e-3, 3e-3);
                y[at + 1] += random.within(-2.0, 2.0);
            }
            let slack = plant.slack_cables(0.0, &y, &u);
            let (rate, power, size) = balance(&plant, 0.0, &y, &u, &slack);
            assert!((rate - power).abs() < 1e-10 * size, "{inertia:?} {slack:?}: {rate} {power}");
            let damping = plant.power(0.0, &y, &u, &plant.evaluate(0.0, &y, &u, &slack)).damping;
            assert!(damping <= 0.0, "dampers add {damping} W");
        }
    }
}

#[test]
fn energy_balances_with_every_effect() {
    let mut random = Random(33);
    for _ in 0..3 {
        for spec in everything(&mut random) {
            for model in MODELS {
                let plant = plant(model, CableInertia::Paper, std::slice::from_ref(&spec));
                let (y, u) = state(&mut random, &plant);
                let (rate, power, size) = balance(&plant, 2.0, &y, &u, &[false; 4].into());
                assert!((rate - power).abs() < 1e-9 * size, "{spec:?} {model:?}: {rate} {power}");
            }
        }
    }
}

fn moving(plant: Arc<Plant>) -> Simulation {
    let inputs = Inputs { winch_force: [21e3, 19e3, 22e3, 20e3].into(), disturbance: [100.0, -50.0, 300.0] };
    let start = Start { pose: [20.0, -30.0, 0.05], twist: [0.5, 1.0, 0.02], inputs, ..Start::default() };
    Simulation::new(plant, &start, 1e-12).unwrap()
}

/// Power integrated by Simpson's rule over the simulation against the change of energy.
#[test]
fn a_simulation_keeps_the_balance() {
    let drag = EffectSpec::new("platform_quadratic_drag", None, &[50.0, 3.0, -2.0]).unwrap();
    let friction = EffectSpec::new("winch_viscous_friction", None, &[500.0]).unwrap();
    let cable_drag = EffectSpec::new("cable_drag", None, &[0.02]).unwrap();
    for (model, inertia, effects) in [
        (CableModel::LumpedMass, CableInertia::Paper, vec![]),
        (CableModel::LumpedMass, CableInertia::Reeled, vec![drag, friction, cable_drag]),
        (CableModel::Rigid, CableInertia::Paper, vec![]),
        (CableModel::Rigid, CableInertia::Reeled, vec![]),
    ] {
        let plant = plant(model, inertia, &effects);
        let mut simulation = moving(plant.clone());
        let power = |s: &Simulation| plant.power(s.time(), s.states(), &s.inputs(), &s.evaluate()).total();
        let energy = |s: &Simulation| plant.energy(s.states(), &s.slack()).total();
        let (before, step) = (energy(&simulation), 0.005);
        let mut work = 0.0;
        for _ in 0..1000 {
            let start = power(&simulation);
            simulation.advance(0.5 * step).unwrap();
            let middle = power(&simulation);
            simulation.advance(0.5 * step).unwrap();
            work += step / 6.0 * (start + 4.0 * middle + power(&simulation));
        }
        let gain = energy(&simulation) - before;
        assert!((gain - work).abs() < 1e-6 * gain.abs().max(1e3), "{model:?} {inertia:?}: {gain} J, work {work} J");
    }
}

/// Without cable mass, damping and winch work (all locked by drums of enormous inertia) energy is conserved.
#[test]
fn energy_is_conserved_where_nothing_takes_it() {
    let parameters = Parameters { cable_inertia: CableInertia::None, cable_damping: 0.0, ..Parameters::default() };
    let locked = EffectSpec::new("winch_drum_inertia", None, &[1e15]).unwrap();
    let plant = Arc::new(Plant::new(parameters, vec![locked]).unwrap());
    let mut simulation = moving(plant.clone());
    // Drums at rest stay there.
    let mut y = simulation.states().to_vec();
    for i in 0..4 {
        y[plant.rate_index(i).unwrap()] = 0.0;
    }
    simulation.set_states(&y);
    simulation.set_inputs(Inputs::none(4));
    let energy = |s: &Simulation| plant.energy(s.states(), &[false; 4].into()).total();
    let before = energy(&simulation);
    for _ in 0..1000 {
        simulation.advance(0.01).unwrap();
    }
    let drift = (energy(&simulation) - before) / before;
    assert!(drift.abs() < 1e-10, "relative drift {drift:e}");
    assert!((simulation.states()[0] - y[0]).abs() > 1e-3, "it does not move");
}

/// With slack, massless cables nothing acts: the centre of mass moves straight on, the platform turns evenly.
#[test]
fn momentum_is_conserved_without_forces() {
    let parameters = Parameters { cable_inertia: CableInertia::None, ..Parameters::default() };
    let offset = EffectSpec::new("platform_com_offset", None, &[2.0, -1.0]).unwrap();
    let drums = EffectSpec::new("winch_drum_inertia", None, &[50.0]).unwrap();
    let plant = Arc::new(Plant::new(parameters, vec![offset, drums]).unwrap());
    let start = Start { twist: [0.3, -0.2, 0.05], inputs: Inputs::none(4), ..Start::default() };
    let mut simulation = Simulation::new(plant.clone(), &start, 1e-10).unwrap();
    let mut y = simulation.states().to_vec();
    for i in 0..4 {
        y[plant.unstretched_index(i).unwrap()] += 50.0;
    }
    simulation.set_states(&y);
    let centre = |y: &[f64]| {
        let (sin, cos) = y[2].sin_cos();
        let arm = [2.0 * cos + sin, 2.0 * sin - cos];
        [y[0] + arm[0], y[1] + arm[1], y[3] - y[5] * arm[1], y[4] + y[5] * arm[0]]
    };
    let first = centre(simulation.states());
    for _ in 0..100 {
        simulation.advance(0.2).unwrap();
    }
    let last = centre(simulation.states());
    assert_eq!(simulation.slack(), [true; 4]);
    for k in 0..2 {
        assert!((last[2 + k] - first[2 + k]).abs() < 1e-10, "speed {k}");
        assert!((last[k] - first[k] - 20.0 * first[2 + k]).abs() < 1e-8, "position {k}");
    }
    assert!((simulation.states()[5] - 0.05).abs() < 1e-11 && (simulation.states()[2] - 1.0).abs() < 1e-9);
}
