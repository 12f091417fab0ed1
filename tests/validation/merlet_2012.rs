//! J.-P. Merlet, manual of the library ALIAS-C++ (INRIA, 2012), "Example 2": a planar robot whose triangular platform hangs on
//! three limbs, given by their lengths' squares 50, 26 and 25; its two poses are printed there.

use cdpr::geometry::Geometry;
use cdpr::inverse::distribution::{Bounds, Distribution, Objective, structure_matrix};
use cdpr::kinematics;
use cdpr::parameters::{CableParameters, Parameters};
use cdpr::per_cable::PerCable;
use cdpr::plant::Plant;
use cdpr::statics::locked_equilibrium;

const ENDS: [([f64; 2], [f64; 2]); 3] =
    [([0.0, 0.0], [0.0, 0.0]), ([10.0, 0.0], [4.0, 0.0]), ([3.0, 10.0], [2.0, 2.0])];
const SQUARES: [f64; 3] = [50.0, 26.0, 25.0];
/// The reference point is the first vertex.
const PRINTED: [[f64; 3]; 2] = [[5.0, 5.0, 0.0], [3.369707132, 6.216516219, -0.8067834380]];

fn robot() -> Parameters {
    let cable = ENDS.map(|(anchor, attachment)| CableParameters::between(anchor, attachment)).to_vec();
    // In gravity the platform may be anywhere.
    Parameters { cable, platform_mass: 1.0, platform_inertia: 1.0, gravity: [0.0, -1e-9], ..Parameters::default() }
}

fn apart(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).abs()).fold(0.0, f64::max)
}

#[test]
fn these_lengths_lead_to_the_two_poses_and_no_other() {
    let geometry = Geometry::new(&robot());
    let lengths = PerCable::from(SQUARES.map(f64::sqrt));
    let mut met = [0; 2];
    for k in 0..600 {
        let s = f64::from(k);
        let guess = [5.0 + 6.0 * (1.3 * s).sin(), 5.0 + 6.0 * (0.7 * s).cos(), 3.1 * (0.31 * s).sin()];
        let Ok(mut pose) = kinematics::forward_kinematics(&geometry, &lengths, guess, 1e-9) else { continue };
        pose[2] = (pose[2] + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU) - std::f64::consts::PI;
        let which = PRINTED.iter().position(|printed| apart(*printed, pose) < 5e-9);
        met[which.unwrap_or_else(|| panic!("a third pose {pose:?}"))] += 1;
    }
    assert!(met.iter().all(|times| *times > 50), "{met:?}");
}

/// Ritter's method of sections: about the point where two of the lines meet, the third alone balances a wrench's moment.
#[test]
fn forces_are_those_of_moments_about_where_two_lines_meet() {
    let geometry = Geometry::new(&robot());
    for pose in PRINTED {
        let structure = structure_matrix(&geometry, &pose);
        // A wrench of three pulls that are all positive.
        let pulls = [30.0, 20.0, 40.0];
        let wrench: [f64; 3] = std::array::from_fn(|r| (0..3).map(|i| structure[(r, i)] * pulls[i]).sum());
        let [fx, fy, torque] = wrench;
        let [sin, cos] = [pose[2].sin(), pose[2].cos()];
        let line = |i: usize| {
            let (anchor, [bx, by]) = ENDS[i];
            let end = [pose[0] + cos * bx - sin * by, pose[1] + sin * bx + cos * by];
            let (dx, dy) = (anchor[0] - end[0], anchor[1] - end[1]);
            (end, [dx / dx.hypot(dy), dy / dx.hypot(dy)])
        };
        let moment = |at: [f64; 2], point: [f64; 2], force: [f64; 2]| {
            (point[0] - at[0]) * force[1] - (point[1] - at[1]) * force[0]
        };
        let bounds = Bounds::new(1.0, 100.0).unwrap();
        let found = Distribution { objective: Objective::MinimumNorm, bounds }.tensions(&structure, &wrench).unwrap();
        for i in 0..3 {
            let ((p, u), (q, v)) = (line((i + 1) % 3), line((i + 2) % 3));
            let along = ((q[0] - p[0]) * v[1] - (q[1] - p[1]) * v[0]) / (u[0] * v[1] - u[1] * v[0]);
            let meet = [p[0] + along * u[0], p[1] + along * u[1]];
            let (end, direction) = line(i);
            let asked = torque + moment(meet, [pose[0], pose[1]], [fx, fy]);
            let expected = asked / moment(meet, end, direction);
            assert!((found[i] - expected).abs() < 1e-9 * expected, "limb {}: {} against {expected}", i + 1, found[i]);
            assert!((found[i] - pulls[i]).abs() < 1e-9 * pulls[i], "limb {}: {}", i + 1, found[i]);
        }
    }
}

#[test]
fn stretched_cables_hold_the_platform_in_either_pose() {
    let plant = Plant::new(robot(), vec![]).unwrap();
    let stiffness = plant.parameters().axial_stiffness();
    for pose in PRINTED {
        let structure = structure_matrix(plant.geometry(), &pose);
        let pulls = [3e4, 2e4, 4e4];
        let disturbance = std::array::from_fn(|r| -(0..3).map(|i| structure[(r, i)] * pulls[i]).sum::<f64>());
        let lengths = PerCable::from_fn(3, |i| SQUARES[i].sqrt() / (1.0 + pulls[i] / stiffness));
        let near = [pose[0] + 0.01, pose[1] - 0.01, pose[2] + 0.005];
        let found = locked_equilibrium(&plant, 0.0, &lengths, &disturbance, near).unwrap();
        assert!(apart(found.pose, pose) < 1e-8, "{:?} against {pose:?}", found.pose);
        for (tension, pull) in found.tension.iter().zip(pulls) {
            assert!((tension - pull).abs() < 1e-2, "{tension} against {pull}");
        }
    }
}
