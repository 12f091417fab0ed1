//! The release of the paper's first simulation against the table made with an independent integrator.

use std::sync::Arc;

use cdpr::parameters::Parameters;
use cdpr::plant::Plant;
use cdpr::simulation::{Simulation, Start};

/// Columns: t, x, y, φ, l1..l4, T1..T4. Dormand-Prince 8(5,3) at 1e-12, `u = 1000 N` each, released at rest.
const TABLE: [[f64; 12]; 5] = [
    [
        1.0,
        0.09996146395,
        0.09995968337,
        0.1000568557,
        901.1359055,
        898.9954669,
        900.8532093,
        898.9985983,
        1000.081074,
        999.90959,
        1000.094669,
        999.9095578,
    ],
    [
        5.0,
        0.09903854427,
        0.09899415739,
        0.1014233341,
        901.1481507,
        898.9818407,
        900.8681242,
        898.9850023,
        1000.055707,
        999.9428216,
        1000.068239,
        999.9432948,
    ],
    [
        10.0,
        0.09617267687,
        0.09599688657,
        0.1057332615,
        901.1868182,
        898.9388839,
        900.9150799,
        898.9421384,
        1000.086979,
        999.9020214,
        1000.10683,
        999.9028128,
    ],
    [
        20.0,
        0.08498329362,
        0.08430780395,
        0.1235809352,
        901.3476993,
        898.7612063,
        901.1083041,
        898.7648046,
        1000.125725,
        999.8635548,
        1000.145636,
        999.8638785,
    ],
    [
        50.0,
        0.01818326125,
        0.01506077759,
        0.2778655904,
        902.758377,
        897.2470203,
        902.7113214,
        897.2519394,
        1000.260172,
        999.7379766,
        1000.263891,
        999.737674,
    ],
];

fn release(tolerance: f64) -> Simulation {
    let plant = Arc::new(Plant::new(Parameters::default(), Vec::new()).unwrap());
    Simulation::new(plant, &Start { pose: [0.1; 3], ..Start::default() }, tolerance).unwrap()
}

fn worst_deviation(tolerance: f64, step: f64) -> [f64; 3] {
    let mut simulation = release(tolerance);
    let mut worst = [0.0_f64; 3];
    let mut steps = 0;
    for row in TABLE {
        while f64::from(steps) * step < row[0] - 0.5 * step {
            simulation.advance(step).unwrap();
            steps += 1;
        }
        let out = simulation.outputs();
        for k in 0..3 {
            worst[0] = worst[0].max((out.pose[k] - row[1 + k]).abs());
        }
        for i in 0..4 {
            worst[1] = worst[1].max((out.unstretched_length[i] - row[4 + i]).abs());
            worst[2] = worst[2].max((out.tension[i] - row[8 + i]).abs());
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
    println!("{pose:e} {length:e} {tension:e}");
    assert!(pose < 1e-8 && length < 1e-6 && tension < 1e-3, "{pose:e} {length:e} {tension:e}");
}
