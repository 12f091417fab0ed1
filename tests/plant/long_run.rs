//! Hours of motion, and inputs of every kind.

use cdpr::dynamics::Inputs;
use cdpr::parameters::{CableInertia, CableModel};
use cdpr::simulation::{Simulation, Start};

use crate::random::{MODELS, Random, plant};

/// A controller that holds the platform at a reference: winch forces from a wrench by the transposed Jacobian.
fn controlled(simulation: &Simulation, reference: [f64; 2]) -> Inputs {
    let y = simulation.states();
    let wrench = [
        -60.0 * (y[0] - reference[0]) - 250.0 * y[3],
        -60.0 * (y[1] - reference[1]) - 250.0 * y[4],
        -3e4 * y[2] - 4e4 * y[5],
    ];
    let cables = cdpr::kinematics::cables(simulation.plant().geometry(), &[y[0], y[1], y[2]], &[0.0; 3]);
    let force: [f64; 4] = std::array::from_fn(|i| {
        let row = cables[i].jacobian_row();
        let turn = row[2].signum() * 0.02 * wrench[2];
        (2e4 - 0.4 * (row[0] * wrench[0] + row[1] * wrench[1]) - turn).clamp(1e3, 6e4)
    });
    Inputs { winch_force: force.into(), disturbance: [0.0; 3] }
}

#[test]
fn an_hour_of_1_ms_steps_ends_after_an_hour() {
    let plant = plant(CableModel::LumpedMass, CableInertia::Paper, &[]);
    let inputs = Inputs { winch_force: [2e4; 4].into(), disturbance: [0.0; 3] };
    let start = Start { pose: [1.0, 1.0, 0.02], inputs, ..Start::default() };
    let mut simulation = Simulation::new(plant, &start, 1e-8).unwrap();
    for k in 0..3_600_000_u32 {
        if k % 10 == 0 {
            let t = 1e-3 * f64::from(k);
            let inputs = controlled(&simulation, [3.0 * (0.02 * t).sin(), 2.0 * (0.013 * t).cos()]);
            simulation.set_inputs(inputs);
        }
        simulation.advance(1e-3).unwrap();
    }
    assert_eq!(simulation.time(), 3600.0);
    let y = simulation.states();
    assert!(y[..3].iter().all(|v| v.abs() < 10.0), "{y:?}");
    assert_eq!(simulation.slack(), [false; 4]);
}

/// Forces of every size and sign and large disturbances, changing every 10 ms, until the platform has left.
#[test]
fn random_inputs_never_hang_nor_give_nan() {
    let mut random = Random(71);
    for model in MODELS {
        for inertia in [CableInertia::Paper, CableInertia::Reeled] {
            for run in 0..4 {
                let plant = plant(model, inertia, &[]);
                let pose = [random.within(-100.0, 100.0), random.within(-100.0, 100.0), random.within(-0.3, 0.3)];
                let mut simulation = Simulation::new(plant, &Start { pose, ..Start::default() }, 1e-7).unwrap();
                let mut steps = 0;
                for _ in 0..1500 {
                    let force: [f64; 4] = std::array::from_fn(|_| match random.within(0.0, 4.0) as u32 {
                        0 => 0.0,
                        1 => random.within(-2e3, 0.0),
                        _ => random.within(0.0, 4e4),
                    });
                    let size = [1e3, 1e4][run % 2];
                    let [x, y, turn]: [f64; 3] = random.around(size);
                    simulation.set_inputs(Inputs { winch_force: force.into(), disturbance: [x, y, 10.0 * turn] });
                    if let Err(error) = simulation.advance(0.01) {
                        panic!("{model:?} {inertia:?}: {error}");
                    }
                    steps += 1;
                    assert!(simulation.states().iter().all(|v| v.is_finite()));
                    let out = simulation.outputs();
                    assert!(out.tension.iter().all(|t| *t >= 0.0), "{model:?}: {:?}", out.tension);
                    let pose = [simulation.states()[0], simulation.states()[1], 0.0];
                    if pose[0].abs().max(pose[1].abs()) > 400.0 {
                        break;
                    }
                }
                assert!(steps > 300, "{model:?}: left after {steps} steps");
            }
        }
    }
}
