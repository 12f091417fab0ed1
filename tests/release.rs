//! The release of the paper's first simulation against the table made with an independent integrator.

use std::sync::Arc;

use cdpr::parameters::Parameters;
use cdpr::plant::Plant;
use cdpr::release::{RELEASE, RELEASE_POSE};
use cdpr::simulation::{Simulation, Start};

fn release(tolerance: f64) -> Simulation {
    let plant = Arc::new(Plant::new(Parameters::default(), Vec::new()).unwrap());
    Simulation::new(plant, &Start { pose: RELEASE_POSE, ..Start::default() }, tolerance).unwrap()
}

fn worst_deviation(tolerance: f64, step: f64) -> [f64; 3] {
    let mut simulation = release(tolerance);
    let mut worst = [0.0_f64; 3];
    let mut steps = 0;
    for row in &RELEASE {
        while f64::from(steps) * step < row.time - 0.5 * step {
            simulation.advance(step).unwrap();
            steps += 1;
        }
        let out = simulation.outputs();
        for k in 0..3 {
            worst[0] = worst[0].max((out.pose[k] - row.pose[k]).abs());
        }
        for i in 0..4 {
            worst[1] = worst[1].max((out.unstretched_length[i] - row.unstretched_length[i]).abs());
            worst[2] = worst[2].max((out.tension[i] - row.tension[i]).abs());
        }
    }
    worst
}

#[test]
fn release_matches_the_table() {
    for step in [0.01, 0.1, 1.0] {
        let [pose, length, tension] = worst_deviation(1e-12, step);
        // The table is printed to 10 digits: 5e-12 in the pose, 5e-8 m, 5e-7 N.
        assert!(pose < 2e-10, "pose off by {pose:e} at step {step}");
        assert!(length < 1e-7, "length off by {length:e} at step {step}");
        assert!(tension < 2e-6, "tension off by {tension:e} at step {step}");
    }
}

#[test]
fn default_tolerance_is_good_for_a_millionth() {
    let [pose, length, tension] = worst_deviation(cdpr::simulation::DEFAULT_TOLERANCE, 0.01);
    assert!(pose < 1e-8 && length < 1e-6 && tension < 1e-3, "{pose:e} {length:e} {tension:e}");
}
