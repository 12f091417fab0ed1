//! Cables going slack and taut again.

use std::sync::Arc;

use cdpr::dynamics::Inputs;
use cdpr::integrator::Solver;
use cdpr::parameters::{CableInertia, CableModel};
use cdpr::per_cable::PerCable;
use cdpr::plant::Plant;
use cdpr::simulation::{Simulation, Start};

use crate::random::{MODELS, Random, plant, state};

/// Winch 1 lets go for a tenth of a second: its cable goes slack, and taut again.
fn inputs(time: f64) -> Inputs {
    let first = if (0.1..0.2).contains(&time) { -500.0 } else { 1e4 };
    Inputs { winch_force: [first, 1e4, 1e4, 1e4].into(), disturbance: [0.0; 3] }
}

fn start() -> Start {
    Start { pose: [2.0, 1.0, 0.05], inputs: inputs(0.0), ..Start::default() }
}

/// Tiny explicit steps, the slack cables found anew in every one and a step in which they change halved until it is over
/// before they do: times of switching of cable 1 and the last state.
fn reference(plant: &Plant, end: f64, h: f64) -> (Vec<(f64, bool)>, Vec<f64>) {
    let mut y = start().states(plant).unwrap();
    let n = y.len();
    let mut k = [vec![0.0; n], vec![0.0; n], vec![0.0; n], vec![0.0; n]];
    let (mut stage, mut next) = (vec![0.0; n], vec![0.0; n]);
    let mut switches = Vec::new();
    let mut slack = plant.slack_cables(0.0, &y, &inputs(0.0));
    for step in 0..(end / h).round() as usize {
        let begin = step as f64 * h;
        let u = inputs(begin + 0.5 * h);
        let (mut done, mut part) = (0.0, h);
        while done < h {
            let time = begin + done;
            let now = plant.slack_cables(time, &y, &u);
            if now[0] != slack[0] {
                switches.push((time, now[0]));
            }
            slack = now;
            plant.rates(time, &y, &u, &slack, &mut k[0]);
            for (next, weight) in [(1, 0.5), (2, 0.5), (3, 1.0)] {
                for i in 0..n {
                    stage[i] = y[i] + weight * part * k[next - 1][i];
                }
                plant.rates(time, &stage, &u, &slack, &mut k[next]);
            }
            for i in 0..n {
                next[i] = y[i] + part / 6.0 * (k[0][i] + 2.0 * k[1][i] + 2.0 * k[2][i] + k[3][i]);
            }
            if part > 1e-4 * h && plant.slack_cables(time + part, &next, &u) != slack {
                part *= 0.5;
                continue;
            }
            y.copy_from_slice(&next);
            done += part;
            part = h - done;
        }
    }
    (switches, y)
}

#[test]
fn switches_are_where_tiny_steps_find_them() {
    let plant = plant(CableModel::LumpedMass, CableInertia::Paper, &[]);
    let h = 2e-5;
    let (switches, end) = reference(&plant, 1.5, h);
    assert!(switches.len() >= 2 && switches[0].1 && !switches[1].1, "{switches:?}");
    for step in [0.002_f64, 0.01, 0.1] {
        let mut simulation = Simulation::new(plant.clone(), &start(), 1e-9).unwrap();
        let mut found = Vec::new();
        let mut slack = simulation.slack()[0];
        for k in 0..(1.5 / step).round() as usize {
            // The middle of the step says which inputs hold in it.
            simulation.set_inputs(inputs((k as f64 + 0.5) * step));
            simulation.advance(step).unwrap();
            if simulation.slack()[0] != slack {
                slack = simulation.slack()[0];
                found.push((simulation.time(), slack));
            }
        }
        if step < 0.01 {
            assert_eq!(found.len(), switches.len(), "{found:?} {switches:?}");
            for (a, b) in found.iter().zip(&switches) {
                assert!(a.1 == b.1 && a.0 >= b.0 - 2.0 * h && a.0 <= b.0 + step + 2.0 * h, "{found:?} {switches:?}");
            }
        }
        assert!(simulation.statistics().switches >= switches.len() as u64);
        // The reference is of first order at its switches, in the least part of h.
        for (k, (a, b)) in simulation.states().iter().zip(&end).enumerate() {
            assert!((a - b).abs() < 2e-6, "step {step}, state {k}: {a} {b}");
        }
    }
}

/// Switching exactly: results at different communication steps agree far better than a missed switch would allow.
#[test]
fn slack_motion_does_not_depend_on_the_step() {
    let plant = plant(CableModel::LumpedMass, CableInertia::Paper, &[]);
    let run = |step: f64| {
        let mut simulation = Simulation::new(plant.clone(), &start(), 1e-11).unwrap();
        for k in 0..(1.5 / step).round() as usize {
            simulation.set_inputs(inputs((k as f64 + 0.5) * step));
            simulation.advance(step).unwrap();
        }
        assert!(simulation.statistics().switches >= 2);
        simulation.states().to_vec()
    };
    let fine = run(0.001);
    for step in [0.005, 0.02, 0.1] {
        for (a, b) in run(step).iter().zip(&fine) {
            assert!((a - b).abs() < 1e-8, "step {step}: {a} {b}");
        }
    }
}

/// Without elasticity the slack set solves a complementarity problem: no tension negative, no slack cable pulling.
#[test]
fn the_slack_set_of_stiff_cables_is_consistent() {
    let mut random = Random(51);
    let mut seen = [0; 5];
    for model in MODELS {
        for inertia in [CableInertia::Paper, CableInertia::Reeled] {
            let plant = plant(model, inertia, &[]);
            for _ in 0..500 {
                let (y, mut u) = state(&mut random, &plant);
                u.winch_force = PerCable::from_fn(4, |_| random.within(-1500.0, 1500.0));
                u.disturbance = [random.within(-2e4, 2e4), random.within(-2e4, 2e4), random.within(-2e5, 2e5)];
                let slack = plant.slack_cables(0.0, &y, &u);
                let e = plant.evaluate(0.0, &y, &u, &slack);
                for i in 0..4 {
                    assert_eq!(slack[i], e.tension_uncut[i] < 0.0, "{model:?} {:?}", e.tension_uncut);
                }
                seen[slack.iter().filter(|s| **s).count()] += usize::from(model == CableModel::Rigid);
            }
        }
    }
    assert!(seen.iter().filter(|n| **n > 20).count() >= 4, "too few sets seen: {seen:?}");
}

/// A cable that starts without tension and is pulled at once, again and again: no chatter.
#[test]
fn tension_about_zero_does_not_chatter() {
    for model in MODELS {
        let plant: Arc<Plant> = plant(model, CableInertia::Paper, &[]);
        let start = Start { inputs: Inputs::none(4), pose: [1.0, 2.0, 0.1], ..Start::default() };
        let mut simulation = Simulation::new(plant, &start, 1e-8).unwrap();
        for k in 0..2000 {
            let force = 20.0 * (0.3 * f64::from(k)).sin();
            simulation.set_inputs(Inputs { winch_force: [force, -force, force, 0.0].into(), disturbance: [0.0; 3] });
            simulation.advance(0.01).unwrap();
            assert!(simulation.outputs().tension.iter().all(|t| *t >= -1e-6));
        }
        let s = simulation.statistics();
        assert!(s.switches < 20_000 && s.steps < 200_000, "{model:?} {s:?}");
    }
}

/// A cable that tautens has no tension before it has strain, and one that goes slack none after its damper lets go.
#[test]
fn a_damper_does_not_pull_on_a_cable_without_strain() {
    let plant = plant(CableModel::LumpedMass, CableInertia::Paper, &[]);
    let mut simulation = Simulation::new(plant.clone(), &start(), 1e-9).unwrap();
    let (mut tautened, mut unstrained) = (0, 0);
    let mut slack = false;
    for k in 0..6000 {
        simulation.set_inputs(inputs((f64::from(k) + 0.5) * 2.5e-4));
        simulation.advance(2.5e-4).unwrap();
        let outputs = simulation.outputs();
        unstrained += usize::from(outputs.strain[0] < 0.0);
        assert!(outputs.strain[0] > -1e-12 || outputs.tension[0] == 0.0, "{} s: {outputs:?}", simulation.time());
        tautened += usize::from(slack && !outputs.slack[0]);
        slack = outputs.slack[0];
    }
    assert!(tautened > 0 && unstrained > 0, "the test says little: {tautened} {unstrained}");
    // Tautening as fast as it may: the winch winds in, the strain is still to come.
    let mut y = simulation.states().to_vec();
    let (length, rate) = (plant.unstretched_index(0).unwrap(), plant.rate_index(0).unwrap());
    y[length] = simulation.outputs().cable_length[0] + 1e-4;
    y[rate] = -50.0;
    assert!(plant.slack_cables(0.0, &y, &inputs(0.0))[0], "a damper of 20 kN s pulls 1 kN at this rate");
}

/// A cable is let go so far that it swings down to nothing and back within some hundredths of a second, between two stages of the
/// long steps that a loose tolerance allows.
#[test]
fn a_brief_slack_is_seen_at_every_step() {
    let plant = plant(CableModel::LumpedMass, CableInertia::Paper, &[]);
    let after_a_second = |solver: Solver, force: f64, step: f64| {
        let inputs = |first: f64| Inputs { winch_force: [first, 1e3, 1e3, 1e3].into(), disturbance: [0.0; 3] };
        let start = Start { inputs: inputs(1e3), ..Start::default() };
        let mut simulation = Simulation::new(plant.clone(), &start, 1e-3).unwrap().with_solver(solver);
        simulation.set_inputs(inputs(force));
        for _ in 0..(1.0 / step).round() as u32 {
            simulation.advance(step).unwrap();
        }
        simulation.statistics().switches
    };
    for solver in [Solver::Radau, Solver::DormandPrince] {
        for force in (430..=455).map(f64::from) {
            let switches = [1e-3, 0.1, 0.25, 0.5, 1.0].map(|step| after_a_second(solver, force, step));
            assert!(switches.iter().all(|count| *count >= 2), "{solver:?}, {force} N: {switches:?}");
        }
    }
}
