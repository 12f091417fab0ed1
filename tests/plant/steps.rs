//! The trajectory does not depend on the communication step, and times add up.

use cdpr::dynamics::Inputs;
use cdpr::effect::EffectSpec;
use cdpr::parameters::CableInertia;
use cdpr::simulation::{Simulation, Start};

use crate::random::{MODELS, plant};

#[test]
fn steps_of_1_10_and_100_ms_give_the_same_trajectory() {
    let friction = EffectSpec::new("winch_coulomb_friction", Some(2), &[200.0, 0.05]).unwrap();
    let lag = EffectSpec::new("winch_lag", None, &[0.04]).unwrap();
    for model in MODELS {
        for effects in [vec![], vec![friction.clone(), lag.clone()]] {
            let plant = plant(model, CableInertia::Paper, &effects);
            let run = |step: f64| {
                let start = Start { pose: [1.0, -2.0, 0.1], ..Start::default() };
                let mut simulation = Simulation::new(plant.clone(), &start, 1e-9).unwrap();
                for tenth in 0..50 {
                    let t = 0.1 * f64::from(tenth);
                    let force: [f64; 4] = std::array::from_fn(|i| 1.5e4 + 1e3 * (t + i as f64).sin());
                    simulation
                        .set_inputs(Inputs { winch_force: force.into(), disturbance: [200.0 * t.sin(), 0.0, 500.0] });
                    for _ in 0..(0.1 / step).round() as usize {
                        simulation.advance(step).unwrap();
                    }
                }
                simulation.states().to_vec()
            };
            let fine = run(0.001);
            for step in [0.01, 0.1] {
                for (k, (a, b)) in run(step).iter().zip(&fine).enumerate() {
                    // Lagged forces are in N; the cables' rates vary 13 times as fast as their lengths.
                    let rate = (0..4).any(|i| plant.rate_index(i) == Some(k));
                    let size = if k >= 6 && b.abs() > 2e3 {
                        1e3
                    } else if rate {
                        13.0
                    } else {
                        1.0
                    };
                    assert!((a - b).abs() < 5e-8 * size, "{model:?} step {step} state {k}: {a} {b}");
                }
            }
        }
    }
}

#[test]
fn slopes_hold_over_a_step_as_many_short_steps_would() {
    let plant = plant(MODELS[2], CableInertia::Paper, &[]);
    let slopes = Inputs { winch_force: [500.0, -300.0, 200.0, 0.0].into(), disturbance: [10.0, 0.0, -40.0] };
    let start = Start { inputs: Inputs { winch_force: [1e4; 4].into(), disturbance: [0.0; 3] }, ..Start::default() };
    let mut long = Simulation::new(plant.clone(), &start, 1e-10).unwrap();
    long.set_inputs_with_slopes(start.inputs, slopes);
    let mut short = long.clone();
    long.advance(1.0).unwrap();
    for _ in 0..100 {
        let now = short.inputs();
        short.set_inputs_with_slopes(now, slopes);
        short.advance(0.01).unwrap();
    }
    assert!((long.inputs().winch_force[0] - 10_500.0).abs() < 1e-9);
    for (a, b) in long.states().iter().zip(short.states()) {
        assert!((a - b).abs() < 1e-9, "{a} {b}");
    }
}

#[test]
fn an_end_can_be_named() {
    let plant = plant(MODELS[2], CableInertia::Paper, &[]);
    let mut simulation = Simulation::new(plant, &Start::default(), 1e-8).unwrap();
    for k in 1..=1000 {
        let end = f64::from(k) * 0.001;
        simulation.advance_to(end).unwrap();
        assert_eq!(simulation.time(), end);
    }
}
