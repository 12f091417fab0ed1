//! MoorPy 1.3.0 (National Renewable Energy Laboratory): linearised stiffness of a moored body.
//!
//! The robot as a body in deep water on four lines of no weight to speak of (w = 1e-6 N/m, EA = 15.2 MN), in a plane 50 m
//! below the surface; forces, line tensions and the stiffness of the lines along surge, sway and yaw, from
//! `Body.getForces(lines_only=True)` and `Body.getStiffnessA(lines_only=True)`. MoorPy solves each line's catenary to a
//! tolerance of its own: its tensions differ from the elastic law by up to half a newton.

use cdpr::dynamics::Inputs;
use cdpr::effect::EffectSpec;
use cdpr::geometry::Geometry;
use cdpr::kinematics;
use cdpr::parameters::{CableParameters, Parameters};
use cdpr::per_cable::PerCable;
use cdpr::plant::Plant;
use cdpr::simulation::wrench_at_rest;
use cdpr::statics::stiffness;

struct Case {
    pose: [f64; 3],
    tension: [f64; 4],
    moorpy_tension: [f64; 4],
    moorpy_force: [f64; 3],
    moorpy_stiffness: [[f64; 3]; 3],
}

const CASES: [Case; 2] = [
    Case {
        pose: [0.0; 3],
        tension: [1000.0; 4],
        moorpy_tension: [999.6170713311906, 999.8315396953451, 999.8315396953451, 999.6170713311906],
        moorpy_force: [0.306655185753, 0.0, 0.0],
        moorpy_stiffness: [
            [3.453265674576e4, 0.0, 0.0],
            [0.0, 3.303161134444e4, 1.614647075176e1],
            [0.0, 1.614647075176e1, 6.754704305930e6],
        ],
    },
    Case {
        pose: [120.0, -80.0, 0.2],
        tension: [15e3, 22e3, 18e3, 25e3],
        moorpy_tension: [14997.452527458161, 21998.228719795014, 18003.40423582842, 25002.044967596175],
        moorpy_force: [-4621.08427414128, 6808.397989287199, 141052.02396248037],
        moorpy_stiffness: [
            [3.416803136843e4, -1.450212122458e3, 4.975723947220e4],
            [-1.450212122458e3, 3.404075387933e4, -9.377743627875e4],
            [4.975723947220e4, -9.377743627875e4, 6.495645480584e6],
        ],
    },
];

#[test]
fn forces_and_stiffness_agree() {
    let plant = Plant::new(Parameters::default(), Vec::new()).unwrap();
    assert_eq!(plant.parameters().axial_stiffness(), 15.2e6);
    for case in CASES {
        for i in 0..4 {
            assert!((case.moorpy_tension[i] - case.tension[i]).abs() < 4.0);
        }
        let inputs = Inputs { winch_force: case.tension.into(), disturbance: [0.0; 3] };
        let force = wrench_at_rest(&plant, 0.0, case.pose, &inputs);
        let arm = plant.parameters().attachment_radius;
        for k in 0..3 {
            let scale = if k == 2 { arm } else { 1.0 };
            // As far as the tensions agree, 4 N on each of four lines.
            assert!((force[k] - case.moorpy_force[k]).abs() < 8.0 * scale, "{force:?} {:?}", case.moorpy_force);
        }
        let ours = stiffness(&plant, 0.0, &case.pose, &case.tension.into()).unwrap().total();
        for r in 0..3 {
            for c in 0..3 {
                let (a, b) = (ours[(r, c)], case.moorpy_stiffness[r][c]);
                let size = (ours[(r, r)] * ours[(c, c)]).sqrt();
                assert!((a - b).abs() < 2e-4 * size, "{r},{c}: {a} against {b}");
            }
        }
    }
}

/// A robot by coordinates, of this EA (N), with what MoorPy gives for it as above.
struct Robot {
    axial_stiffness: f64,
    ends: &'static [([f64; 2], [f64; 2])],
    pose: [f64; 3],
    tension: &'static [f64],
    moorpy_force: [f64; 3],
    moorpy_stiffness: [[f64; 3]; 3],
}

/// Three cables over a field of 100 m, and six on a bench of 4 m.
const ROBOTS: [Robot; 2] = [
    Robot {
        axial_stiffness: 4e6,
        ends: &[([-50.0, 20.0], [1.0, -0.3]), ([50.0, 38.5], [-0.55, 0.7]), ([4.5, 40.0], [0.95, 1.3])],
        pose: [1.5, -1.0, 0.02],
        tension: &[2000.0, 2500.0, 3000.0],
        moorpy_force: [263.91266660774255, 5298.126582042908, 572.3753608546422],
        moorpy_stiffness: [
            [100397.66594582763, 11786.237600216522, -48007.057003140515],
            [11786.237600216524, 135112.29888694157, 53727.84449721236],
            [-48007.057003140515, 53727.84449721236, 127252.63347175135],
        ],
    },
    Robot {
        axial_stiffness: 1e5,
        ends: &[
            ([-2.0, -1.5], [0.05, -0.19]),
            ([0.1, -1.6], [0.12, -0.16]),
            ([2.0, -1.5], [0.19, -0.06]),
            ([2.0, 1.5], [0.19, -0.06]),
            ([-0.2, 1.6], [-0.2, 0.04]),
            ([-2.0, 1.5], [0.07, 0.19]),
        ],
        pose: [0.1, -0.08, 0.15],
        tension: &[150.0, 180.0, 200.0, 220.0, 170.0, 190.0],
        moorpy_force: [-3.4631228645403382, 44.27071384444913, -41.414254368667386],
        moorpy_stiffness: [
            [109196.10044849866, 2221.163892327284, 3768.4595590210793],
            [2221.1638923272876, 191077.24892178888, 14525.580487313651],
            [3768.4595590210793, 14525.580487313651, 8785.691918955576],
        ],
    },
];

#[test]
fn forces_and_stiffness_of_three_and_of_six_cables_agree() {
    for robot in ROBOTS {
        let cable =
            robot.ends.iter().map(|(anchor, attachment)| CableParameters::between(*anchor, *attachment)).collect();
        let area = robot.axial_stiffness / 1e9;
        let parameters = Parameters { cable, youngs_modulus: 1e9, cable_area: area, ..Parameters::default() };
        let plant = Plant::new(parameters, Vec::new()).unwrap();
        let tension = PerCable::from_slice(robot.tension).unwrap();
        let inputs = Inputs { winch_force: tension, disturbance: [0.0; 3] };
        let force = wrench_at_rest(&plant, 0.0, robot.pose, &inputs);
        let arm = plant.geometry().attachment_scale();
        let ours = stiffness(&plant, 0.0, &robot.pose, &tension).unwrap().total();
        for r in 0..3 {
            // Its tensions differ by up to 0.008 N.
            let scale = if r == 2 { arm } else { 1.0 };
            assert!((force[r] - robot.moorpy_force[r]).abs() < 0.02 * scale, "{force:?} {:?}", robot.moorpy_force);
            for c in 0..3 {
                let (a, b) = (ours[(r, c)], robot.moorpy_stiffness[r][c]);
                let size = (ours[(r, r)] * ours[(c, c)]).sqrt();
                assert!((a - b).abs() < 2e-4 * size, "{r},{c}: {a} against {b}");
            }
        }
    }
}

/// A hanging line between two points of one height, of EA = 15.2 MN, by `moorpy.Catenary.catenary(span, 0, length, EA, weight,
/// CB=-1e4, Tol=1e-10)`: the horizontal force at its end and its slope with the span.
#[test]
fn a_hanging_cable_is_the_catenary_of_moorpy() {
    for (span, weight, length, force, slope) in [
        (900.0, 2.11, 899.154, 19996.66677275449, 1.07739537e4),
        (900.0, 2.11, 905.116, 4999.975349829078, 4.56529161e2),
        (907.0, 2.10915, 1051.664, 999.999508096346, 4.93204365),
        (900.0, 4.2, 1039.861, 2000.000869894191, 10.1178369),
    ] {
        let catenary = EffectSpec::new("cable_catenary", None, &[weight]).unwrap();
        let plant = Plant::new(Parameters::default(), vec![catenary]).unwrap();
        let tension = |span: f64| plant.tension_for(0, 0.0, span, length, &[]);
        let found = tension(span);
        assert!((found - force).abs() < 1e-8 * force, "{length} m: {found} against {force}");
        let step = 1e-3;
        let stiffness = (tension(span + step) - tension(span - step)) / (2.0 * step);
        assert!((stiffness - slope).abs() < 1e-5 * slope, "{length} m: {stiffness} against {slope}");
        let back = plant.unstretched_length_for(0, 0.0, span, found, &[]);
        assert!((back - length).abs() < 1e-12 * length, "{back} against {length}");
    }
}

/// The same stiffness by finite differences of the lengths and the elastic law alone.
#[test]
fn stiffness_is_the_second_derivative_of_the_elastic_energy() {
    let parameters = Parameters::default();
    let geometry = Geometry::new(&parameters);
    let ea = parameters.axial_stiffness();
    let plant = Plant::new(parameters, Vec::new()).unwrap();
    for case in CASES {
        let start = kinematics::cable_lengths(&geometry, &case.pose);
        let unstretched: Vec<f64> = (0..4).map(|i| start[i] / (1.0 + case.tension[i] / ea)).collect();
        let energy = |pose: [f64; 3]| -> f64 {
            let lengths = kinematics::cable_lengths(&geometry, &pose);
            (0..4).map(|i| 0.5 * ea / unstretched[i] * (lengths[i] - unstretched[i]).powi(2)).sum()
        };
        let ours = stiffness(&plant, 0.0, &case.pose, &case.tension.into()).unwrap().total();
        let h = [0.05, 0.05, 0.005];
        for r in 0..3 {
            for c in 0..3 {
                let at = |a: f64, b: f64| {
                    let mut pose = case.pose;
                    pose[r] += a * h[r];
                    pose[c] += b * h[c];
                    energy(pose)
                };
                let second = (at(1.0, 1.0) - at(1.0, -1.0) - at(-1.0, 1.0) + at(-1.0, -1.0)) / (4.0 * h[r] * h[c]);
                let size = (ours[(r, r)] * ours[(c, c)]).sqrt();
                assert!((ours[(r, c)] - second).abs() < 1e-4 * size, "{r},{c}: {} against {second}", ours[(r, c)]);
            }
        }
    }
}
