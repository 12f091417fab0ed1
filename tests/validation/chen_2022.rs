//! G. Chen, S. Hutchinson, F. Dellaert, Locally Optimal Estimation and Control of Cable Driven Parallel Robots using Time Varying
//! Linear Quadratic Gaussian Control, IROS 2022: a planar robot of four cables on a rectangle, whose logs are public (repository
//! gchenfc/cable-robot). The authors state its model's kinematics and dynamics as tests of their library GTDynamics, folder
//! `gtdynamics/cablerobot`: `src/test_cdpr_planar.py` and `tests/testCableTensionFactor.cpp`. Their y axis points into the
//! plane, their z is y here.

use std::sync::Arc;

use cdpr::dynamics::Inputs;
use cdpr::inverse::distribution::structure_matrix;
use cdpr::kinematics;
use cdpr::parameters::{CableInertia, CableModel, CableParameters, Parameters};
use cdpr::plant::Plant;
use cdpr::simulation::{Simulation, Start};

const CENTRE: [f64; 3] = [1.5, 1.5, 0.0];

/// Anchors in the corners of a square of 3 m, cables to the corners of a platform of 0.3 m and 1 kg.
fn robot() -> Arc<Plant> {
    let s = 0.15;
    let cable = [([3.0, 0.0], [s, -s]), ([3.0, 3.0], [s, s]), ([0.0, 3.0], [-s, s]), ([0.0, 0.0], [-s, -s])]
        .map(|(anchor, attachment)| CableParameters::between(anchor, attachment))
        .to_vec();
    let parameters = Parameters {
        cable,
        platform_mass: 1.0,
        platform_inertia: 1.0,
        cable_model: CableModel::Rigid,
        cable_inertia: CableInertia::None,
        ..Parameters::default()
    };
    Arc::new(Plant::new(parameters, Vec::new()).unwrap())
}

fn simulation(winch_force: [f64; 4]) -> Simulation {
    let inputs = Inputs { winch_force: winch_force.into(), disturbance: [0.0; 3] };
    Simulation::new(robot(), &Start { pose: CENTRE, inputs, ..Start::pulling(4) }, 1e-10).unwrap()
}

#[test]
fn lengths_and_rates_are_those_of_their_kinematics() {
    let cables = kinematics::cables(robot().geometry(), &CENTRE, &[0.0, -2.0_f64.sqrt(), 0.0]);
    for (cable, rate) in cables.iter().zip([-1.0, 1.0, 1.0, -1.0]) {
        assert!((cable.length - 1.35 * 2.0_f64.sqrt()).abs() < 1e-15, "{}", cable.length);
        assert!((cable.speed - rate).abs() < 1e-15, "{} {rate}", cable.speed);
    }
}

#[test]
fn a_newton_in_one_cable_pulls_towards_its_corner() {
    let structure = structure_matrix(robot().geometry(), &CENTRE);
    for (row, expected) in [-1.0 / 2.0_f64.sqrt(), -1.0 / 2.0_f64.sqrt(), 0.0].into_iter().enumerate() {
        assert!((structure[(row, 3)] - expected).abs() < 1e-15, "{structure}");
    }
}

#[test]
fn accelerations_are_those_of_their_dynamics() {
    for (force, expected) in
        [([1.0, 0.0, 0.0, 1.0], [0.0, -2.0_f64.sqrt()]), ([1.0, 1.0, 0.0, 0.0], [2.0_f64.sqrt(), 0.0])]
    {
        let found = simulation(force).evaluate().acceleration;
        for (a, b) in found.iter().zip([expected[0], expected[1], 0.0]) {
            assert!((a - b).abs() < 1e-12, "{found:?} {expected:?}");
        }
    }
    // Their three states, 10 ms apart, agree to the error of their Euler steps.
    let mut moving = simulation([1.0, 1.0, 0.0, 0.0]);
    moving.advance(0.01).unwrap();
    assert!((moving.outputs().twist[0] - 0.01 * 2.0_f64.sqrt()).abs() < 1e-6, "{:?}", moving.outputs().twist);
}
