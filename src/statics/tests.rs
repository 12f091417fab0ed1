use std::sync::Arc;

use nalgebra::{DVector, Matrix3};

use super::*;
use crate::dynamics::Inputs;
use crate::effect::EffectSpec;
use crate::inverse::distribution::{Bounds, Distribution, Objective, nearest, structure_matrix, torque_arm};
use crate::kinematics;
use crate::parameters::{CableModel, Parameters};
use crate::per_cable::PerCable;
use crate::plant::Plant;
use crate::simulation::{Simulation, Start, wrench_at_rest};

fn plant_of(model: CableModel, effects: Vec<EffectSpec>) -> Arc<Plant> {
    Arc::new(Plant::new(Parameters { cable_model: model, ..Parameters::default() }, effects).unwrap())
}

fn simulation(model: CableModel, pose: [f64; 3], force: f64) -> Simulation {
    let inputs = Inputs { winch_force: [force; 4].into(), disturbance: [0.0; 3] };
    Simulation::new(plant_of(model, Vec::new()), &Start { pose, inputs, ..Start::default() }, 1e-10).unwrap()
}

fn assert_close(found: f64, expected: f64, relative: f64, what: &str) {
    assert!((found - expected).abs() <= relative * expected.abs(), "{what}: {found}, expected {expected}");
}

#[test]
fn geometric_stiffness_at_the_centre_has_its_closed_form() {
    let p = Parameters::default();
    let (ra, rb, t) = (p.anchor_radius, p.attachment_radius, 1000.0);
    let l = ra.hypot(rb);
    let k = geometric_stiffness(&crate::geometry::Geometry::new(&p), &[0.0; 3], &[t; 4].into());
    assert_close(k[(0, 0)], 2.0 * t * (ra - rb).powi(2) / l.powi(3), 1e-12, "K_x");
    assert_close(k[(1, 1)], 2.0 * t * (ra + rb).powi(2) / l.powi(3), 1e-12, "K_y");
    assert_close(k[(2, 2)], -4.0 * t * (ra * rb).powi(2) / l.powi(3), 1e-12, "K_phi");
    assert_close(k[(2, 2)], -0.444 * t, 1e-3, "K_phi");
    for (r, c) in [(0, 1), (0, 2), (1, 2)] {
        assert!(k[(r, c)].abs() < 1e-10);
    }
}

#[test]
fn stiffness_is_the_slope_of_the_wrench() {
    let effects = vec![
        EffectSpec::new("umbilical", None, &[200.0, 5.0, 100.0, -300.0]).unwrap(),
        EffectSpec::new("cable_sag", Some(2), &[2.1, 2e4]).unwrap(),
    ];
    let plant = plant_of(CableModel::LumpedMass, effects);
    let (pose, tension) = ([40.0, -25.0, 0.15], [15e3, 12e3, 18e3, 9e3]);
    let lengths = kinematics::cable_lengths(plant.geometry(), &pose);
    let unstretched: PerCable<f64> =
        PerCable::from_fn(4, |i| plant.unstretched_length_for(i, 0.0, lengths[i], tension[i], &[0.0; 6]));
    // The wrench on the platform with the winches locked, from the plant's own forward evaluation.
    let wrench = |pose: [f64; 3]| {
        let mut y = vec![0.0; plant.dimension()];
        y[..3].copy_from_slice(&pose);
        for i in 0..4 {
            y[plant.unstretched_index(i).unwrap()] = unstretched[i];
        }
        let e = plant.evaluate(0.0, &y, &Inputs::none(4), &[false; 4].into());
        let inputs = Inputs { winch_force: e.tension, disturbance: [0.0; 3] };
        wrench_at_rest(&plant, 0.0, pose, &inputs)
    };
    let k = stiffness(&plant, 0.0, &pose, &tension.into()).unwrap().total();
    for c in 0..3 {
        let h = if c == 2 { 1e-4 } else { 1e-3 };
        let (mut ahead, mut behind) = (pose, pose);
        ahead[c] += h;
        behind[c] -= h;
        let (a, b) = (wrench(ahead), wrench(behind));
        for r in 0..3 {
            let slope = -(a[r] - b[r]) / (2.0 * h);
            let size = (k[(r, r)] * k[(c, c)]).abs().sqrt();
            assert!((slope - k[(r, c)]).abs() < 1e-6 * size, "{r},{c}: {slope} against {}", k[(r, c)]);
        }
    }
}

#[test]
fn force_controlled_periods_are_those_of_the_closed_forms() {
    for model in [CableModel::Rigid, CableModel::LumpedMass] {
        let simulation = simulation(model, [0.0; 3], 1000.0);
        let modes = force_controlled_modes(simulation.plant(), &LinearModel::of(&simulation)).unwrap();
        let period = |k: usize| modes.iter().find(|m| m.oscillates() && m.shape[k].norm() > 0.9).unwrap().period();
        assert_close(period(0), 227.0, 3e-3, "x");
        assert_close(period(1), 221.0, 3e-3, "y");
        let growing: Vec<&Mode> = modes.iter().filter(|m| m.eigenvalue.re > 1e-6).collect();
        assert_eq!(growing.len(), 1, "only φ grows: {modes:?}");
        assert_close(growing[0].time_constant(), 29.6, 2e-3, "φ");
        assert!(growing[0].shape[2].norm() > 0.05, "{:?}", growing[0].shape);
    }
}

/// Eight such winches left the eigenvalues unfound, and four had modes that grew in 1e16 s: what rounding left of zeros.
#[test]
fn winches_that_follow_a_speed_leave_a_length_where_it_is() {
    use crate::parameters::CableParameters;
    use crate::winch::{WinchCommand, WinchParameters};
    let around = |cables: usize| {
        let at = |radius: f64, turn: f64| {
            let angle = std::f64::consts::TAU * turn / cables as f64;
            [radius * angle.cos(), radius * angle.sin()]
        };
        let cable = |i: usize| CableParameters::between(at(1.8, i as f64), at(0.12, i as f64 + [0.7, -0.7][i % 2]));
        (0..cables).map(cable).collect::<Vec<_>>()
    };
    for cables in [4, 6, 8, 12] {
        let winch = WinchParameters { command: WinchCommand::Speed, rotor_inertia: Some(1e-4), ..Default::default() };
        let parameters = Parameters {
            cable: around(cables),
            platform_mass: 3.0,
            platform_inertia: 0.04,
            youngs_modulus: 5e9,
            cable_area: 2e-6,
            cable_damping: 3.0,
            winch,
            ..Parameters::default()
        };
        let plant = Arc::new(Plant::new(parameters, Vec::new()).unwrap());
        let mut y = vec![0.0; plant.dimension()];
        for i in 0..cables {
            y[plant.unstretched_index(i).unwrap()] =
                0.99 * crate::kinematics::cable_lengths(plant.geometry(), &[0.0; 3])[i];
        }
        let simulation = Simulation::from_states(plant.clone(), 0.0, y, Inputs::none(cables), 1e-10);
        let modes = force_controlled_modes(&plant, &LinearModel::of(&simulation)).unwrap();
        assert_eq!(modes.iter().filter(|mode| mode.is_neutral()).count(), cables, "{modes:?}");
        assert!(modes.iter().all(|mode| !mode.is_unstable()), "{modes:?}");
        // The servos' own poles, and three oscillations of the platform as on locked winches.
        let servo = modes.iter().filter(|mode| (mode.eigenvalue + 20.0).norm() < 1e-3 && !mode.oscillates());
        assert_eq!(servo.count(), cables, "{modes:?}");
        assert_eq!(modes.iter().filter(|mode| mode.oscillates()).count(), 3);
    }
}

/// With the area as printed the paper's damper (33) feeds the slow oscillation along x; a damper of the strain's rate takes
/// from it.
#[test]
fn the_printed_damper_feeds_a_slow_oscillation_of_a_soft_cable() {
    use crate::parameters::CableDamper;
    let ratio = |base: Parameters, cable_damper: CableDamper| {
        let plant = Arc::new(Plant::new(Parameters { cable_damper, ..base }, Vec::new()).unwrap());
        let simulation = Simulation::new(plant.clone(), &Start::default(), 1e-10).unwrap();
        let modes = force_controlled_modes(&plant, &LinearModel::of(&simulation)).unwrap();
        let along_x = modes.iter().find(|mode| mode.oscillates() && mode.shape[0].norm() > 0.5).unwrap();
        assert!((200.0..250.0).contains(&along_x.period()), "{along_x:?}");
        along_x.damping_ratio()
    };
    let close = |found: f64, expected: f64, within: f64| assert!((found / expected - 1.0).abs() < within, "{found}");
    close(ratio(Parameters::as_printed(), CableDamper::LengthRate), -1.9e-3, 0.05);
    close(ratio(Parameters::as_printed(), CableDamper::StrainRate), 4.5e-5, 0.05);
    assert!(ratio(Parameters::default(), CableDamper::LengthRate).abs() < 1e-9);
}

#[test]
fn locked_winches_give_the_published_periods_and_damping() {
    let plant = plant_of(CableModel::LumpedMass, Vec::new());
    let modes = locked_model(&plant, 0.0, &[0.0; 3], &[1000.0; 4].into()).unwrap().modes().unwrap();
    let find = |k: usize| {
        modes
            .iter()
            .find(|m| (0..3).all(|j| j == k || m.shape[j].norm() < 0.01 * m.shape[k].norm()))
            .unwrap_or_else(|| panic!("no mode along coordinate {k}: {modes:?}"))
    };
    for (k, period) in [(0, 1.73), (1, 1.77), (2, 1.43)] {
        let mode = find(k);
        assert_close(mode.period(), period, 4e-3, "period");
        assert!((0.00225..0.00295).contains(&mode.damping_ratio()), "{}", mode.damping_ratio());
    }
    // The massless spring, locked, is the same thing.
    let massless = plant_of(CableModel::MasslessSpring, Vec::new());
    let again = locked_model(&massless, 0.0, &[0.0; 3], &[1000.0; 4].into()).unwrap().modes().unwrap();
    assert_close(again[0].period(), modes[0].period(), 1e-12, "massless spring");
    assert_eq!(
        locked_model(&plant_of(CableModel::Rigid, Vec::new()), 0.0, &[0.0; 3], &[1e3; 4].into()),
        Err(StaticsError::Rigid)
    );
}

#[test]
fn a_massless_spring_has_a_fast_pole_and_a_lumped_mass_light_damping() {
    let massless = simulation(CableModel::MasslessSpring, [0.0; 3], 1000.0);
    let modes = force_controlled_modes(massless.plant(), &LinearModel::of(&massless)).unwrap();
    let fast: Vec<&Mode> = modes.iter().filter(|m| m.natural_frequency() > 1.0).collect();
    assert_eq!(fast.len(), 4);
    for mode in fast {
        assert_close(mode.eigenvalue.re, -760.0, 1e-3, "pole");
        assert!(!mode.oscillates());
    }
    let lumped = simulation(CableModel::LumpedMass, [0.0; 3], 1000.0);
    let modes = force_controlled_modes(lumped.plant(), &LinearModel::of(&lumped)).unwrap();
    let cable: Vec<&Mode> = modes.iter().filter(|m| m.natural_frequency() > 1.0).collect();
    assert_eq!(cable.len(), 4);
    for mode in cable {
        assert!((12.5..14.5).contains(&mode.natural_frequency()), "{}", mode.natural_frequency());
        assert!((0.007..0.012).contains(&mode.damping_ratio()), "{}", mode.damping_ratio());
    }
    let slow = modes.iter().filter(|m| m.natural_frequency() < 0.1).count();
    assert_eq!(slow + 4, modes.len(), "platform modes are slower than 0.1 rad/s: {modes:?}");
}

#[test]
fn the_linear_model_is_the_slope_of_rates_and_outputs() {
    for model in [CableModel::Rigid, CableModel::MasslessSpring, CableModel::LumpedMass] {
        let effects = vec![
            EffectSpec::new("winch_lag", None, &[0.3]).unwrap(),
            EffectSpec::new("platform_quadratic_drag", None, &[30.0, 4.0, 1.0]).unwrap(),
        ];
        let inputs = Inputs { winch_force: [9e3, 11e3, 10e3, 12e3].into(), disturbance: [50.0, -30.0, 500.0] };
        let start = Start { pose: [20.0, 10.0, 0.1], twist: [0.5, -0.3, 0.01], inputs, ..Start::default() };
        let simulation = Simulation::new(plant_of(model, effects), &start, 1e-10).unwrap();
        let linear = LinearModel::of(&simulation);
        let n = linear.state.len();
        assert!(linear.state_names.iter().all(|name| !name.is_empty()));
        for column in 0..n {
            let h = 1e-5 * linear.state[column].abs().max(0.1);
            let at = |h: f64| {
                let mut moved = simulation.clone();
                let mut y = linear.state.clone();
                y[column] += h;
                moved.set_states(&y);
                (DVector::from_vec(moved.rates()), moved.outputs())
            };
            let (ahead, behind) = (at(h), at(-h));
            let slope = (&ahead.0 - &behind.0) / (2.0 * h);
            for row in 0..n {
                let (found, expected) = (linear.a[(row, column)], slope[row]);
                assert!(
                    (found - expected).abs() < 1e-4 * (1.0 + expected.abs()),
                    "{model:?} A {row},{column}: {found} {expected}"
                );
            }
            let tension = linear.output_names.iter().position(|name| name == "tension[3]").unwrap();
            let expected = (ahead.1.tension[2] - behind.1.tension[2]) / (2.0 * h);
            let found = linear.c[(tension, column)];
            assert!(
                (found - expected).abs() < 1e-4 * (1.0 + expected.abs()),
                "{model:?} C {column}: {found} {expected}"
            );
        }
        let mut moved = simulation.clone();
        let mut pushed = inputs;
        pushed.disturbance[2] += 100.0;
        moved.set_inputs(pushed);
        let change = (moved.rates()[5] - linear.rate[5]) / 100.0;
        assert_close(linear.b[(5, 6)], change, 1e-9, "B");
    }
}

#[test]
fn locked_winches_hold_the_pose_that_their_lengths_were_made_for() {
    let bounds = Bounds::new(5e3, 30e3).unwrap();
    for (effects, disturbance) in [
        (Vec::new(), [0.0; 3]),
        (vec![EffectSpec::new("cable_creep", None, &[5e7, 100.0]).unwrap()], [500.0, -900.0, 4000.0]),
    ] {
        let plant = plant_of(CableModel::LumpedMass, effects);
        let pose = [30.0, -60.0, 0.1];
        let wrench = disturbance.map(|d: f64| -d);
        let structure = structure_matrix(plant.geometry(), &pose);
        let tension = Distribution { objective: Objective::MidTension, bounds }.tensions(&structure, &wrench).unwrap();
        let lengths = kinematics::cable_lengths(plant.geometry(), &pose);
        let unstretched: PerCable<f64> = PerCable::from_fn(4, |i| {
            let mut states = [0.0; 6];
            plant.start_effect_states(i, tension[i], tension[i], &mut states);
            plant.unstretched_length_for(i, 0.0, lengths[i], tension[i], &states)
        });
        let found = locked_equilibrium(&plant, 0.0, &unstretched, &disturbance, [29.0, -58.0, 0.15]).unwrap();
        for k in 0..3 {
            assert!((found.pose[k] - pose[k]).abs() < 1e-7, "{found:?}");
        }
        for i in 0..4 {
            assert_close(found.tension[i], tension[i], 1e-6, "tension");
        }
        // A small push moves it by the compliance.
        let push = [20.0, 0.0, 0.0];
        let pushed = std::array::from_fn(|k| disturbance[k] + push[k]);
        let moved = locked_equilibrium(&plant, 0.0, &unstretched, &pushed, found.pose).unwrap();
        if plant.effects().is_empty() {
            let compliance: Matrix3<f64> = found.stiffness.try_inverse().unwrap();
            let expected = compliance * nalgebra::Vector3::from(push);
            for k in 0..3 {
                assert!((moved.pose[k] - found.pose[k] - expected[k]).abs() < 1e-3 * expected.norm(), "{moved:?}");
            }
        }
    }
}

#[test]
fn long_lengths_leave_cables_slack_and_are_told_where_nothing_holds() {
    let plant = plant_of(CableModel::LumpedMass, Vec::new());
    // All cables 1 m too long: nothing holds the platform.
    let lengths = kinematics::cable_lengths(plant.geometry(), &[0.0; 3]);
    let slack: PerCable<f64> = PerCable::from_fn(4, |i| lengths[i] + 1.0);
    let error = locked_equilibrium(&plant, 0.0, &slack, &[0.0; 3], [0.0; 3]).unwrap_err();
    assert!(error.to_string().contains("singular"), "{error}");
    // Pulled to one side by a wind, the lee cables hang slack.
    let found = locked_equilibrium(&plant, 0.0, &slack, &[5e3, 0.0, 0.0], [3.0, 0.0, 0.0]).unwrap();
    assert_eq!([found.tension[1], found.tension[2]], [0.0, 0.0], "{found:?}");
    assert!(found.tension[0] > 1e3 && found.tension[3] > 1e3, "{found:?}");
}

#[test]
fn wrench_closure_is_lost_where_the_cables_meet_in_the_centre() {
    let geometry = crate::geometry::Geometry::new(&Parameters::default());
    let bounds = Bounds::new(1e3, 50e3).unwrap();
    let none = workspace::RequiredWrenches { centre: [0.0; 3], half_width: [0.0; 3] };
    let at = |phi: f64| workspace::feasibility(&geometry, &[0.0, 0.0, phi], &bounds, &none);
    assert_close(at(0.0).balance, 1.0, 1e-12, "equal tensions balance at the centre");
    for phi in [-0.6, -0.3, 0.3, 0.6] {
        assert!(at(phi).closure && at(phi).feasible(), "φ = {phi}: {:?}", at(phi));
    }
    // A quarter turn puts anchors, attachment points and centre in line: no torque can be exerted.
    let quarter = std::f64::consts::FRAC_PI_2;
    assert!(!at(quarter).closure, "{:?}", at(quarter));
    assert!(!at(1.65).reachable, "beyond it the cables run through the platform");
}

#[test]
fn a_singular_pose_whose_null_vector_is_rounding_has_no_wrench_closure() {
    // Cables that do not cross meet in the centre: the torques of all are rounding, at a condition of 5e15.
    let angle = PerCable::from([-2.356, -0.785, 0.785, 2.356]);
    let parameters = Parameters { anchor_angle: angle, attachment_angle: angle, ..Parameters::default() };
    let geometry = crate::geometry::Geometry::new(&parameters);
    let bounds = Bounds::new(1e3, 50e3).unwrap();
    let none = workspace::RequiredWrenches { centre: [0.0; 3], half_width: [0.0; 3] };
    let found = workspace::feasibility(&geometry, &[0.0; 3], &bounds, &none);
    assert!(!found.closure && found.balance < 0.0, "{found:?}");
    // A ten-millionth of a radian away it is no better.
    assert!(!workspace::feasibility(&geometry, &[0.0, 0.0, 1e-7], &bounds, &none).closure);
}

/// Two cables, and four on one point, exert wrenches in a plane only: forces in it that no tensions make were called feasible.
#[test]
fn wrenches_beyond_the_border_of_a_flat_set_are_not_feasible() {
    use crate::parameters::CableParameters;
    let bounds = Bounds::new(10.0, 100.0).unwrap();
    let point = |anchors: &[[f64; 2]]| {
        let cable = anchors.iter().map(|a| CableParameters::between(*a, [0.0; 2])).collect();
        crate::geometry::Geometry::new(&Parameters { cable, ..Parameters::default() })
    };
    let four = point(&[[-3.0, -3.0], [3.0, -3.0], [3.0, 3.0], [-3.0, 3.0]]);
    let margin = |geometry, pose: [f64; 3], centre| {
        let required = workspace::RequiredWrenches { centre, half_width: [0.0; 3] };
        workspace::capacity_margin(geometry, &pose, &bounds, &required)
    };
    // All four pull along the diagonals: along x no more than two of them at 100 N, against two at 10 N.
    let most = 2.0 * (100.0 - 10.0) / 2_f64.sqrt();
    for (force, feasible) in [(0.0, true), (most - 1e-6, true), (most + 1e-3, false), (500.0, false)] {
        let found = margin(&four, [0.0; 3], [force, 0.0, 0.0]);
        assert!((found >= -1e-9) == feasible && found < 1e-9, "{force} N: {found}");
    }
    assert!(margin(&four, [0.0; 3], [0.0, 0.0, 1e-3]) < -1e-4, "no torque can be exerted");
    // On the line between its anchors a point is pulled along that line, and in no other direction.
    let two = point(&[[-2.0, 0.0], [2.0, 0.0]]);
    for (force, feasible) in [([50.0, 0.0, 0.0], true), ([95.0, 0.0, 0.0], false), ([0.0, 1.0, 0.0], false)] {
        assert_eq!(margin(&two, [1.0, 0.0, 0.0], force) >= -1e-9, feasible, "{force:?}");
    }
}

/// V.-D. Nguyen, Constructing force-closure grasps, Int. J. Robotics Research 7(3) (1988): what two points hold within cones of
/// forces is held against any wrench exactly if the line through the points lies strictly inside both cones. A bar on four
/// cables, two from each side, is such a grasp.
#[test]
fn a_bar_on_four_cables_is_closed_where_its_line_passes_between_the_anchors() {
    use crate::parameters::CableParameters;
    let (a, h, b) = (3.0, 1.2, 0.3);
    let ends = [([-a, -h], [-b, 0.0]), ([-a, h], [-b, 0.0]), ([a, -h], [b, 0.0]), ([a, h], [b, 0.0])];
    let cable = ends.map(|(anchor, attachment)| CableParameters::between(anchor, attachment)).to_vec();
    let geometry = crate::geometry::Geometry::new(&Parameters { cable, ..Parameters::default() });
    let bounds = Bounds::new(1.0, 100.0).unwrap();
    let none = workspace::RequiredWrenches { centre: [0.0; 3], half_width: [0.0; 3] };
    let area = [[b - a, -h], [a - b, h]];
    let angles: Vec<f64> = (0..9).map(|k| 0.1 + 0.02 * f64::from(k)).collect();
    let points = workspace::MapPoints::over(area, 24, angles.clone());
    let map = workspace::WorkspaceMap::new(&geometry, points, &bounds, |_| none);
    let shares = map.share_of_orientations(|cell| cell.closure);
    let (mut everywhere, mut somewhere) = (0, 0);
    for (j, y) in map.points.y.iter().enumerate() {
        for (i, x) in map.points.x.iter().enumerate() {
            let closed = |phi: f64| [-a, a].into_iter().all(|side| (y + (side - x) * phi.tan()).abs() < h);
            for (k, phi) in angles.iter().enumerate() {
                assert_eq!(map.cell(i, j, k).closure, closed(*phi), "{x} {y} {phi}");
            }
            let expected = angles.iter().filter(|phi| closed(**phi)).count();
            assert!((shares[24 * j + i] - expected as f64 / 9.0).abs() < 1e-12);
            everywhere += usize::from(expected == 9);
            somewhere += usize::from(expected > 0);
        }
    }
    // The inclusion workspace has a closed form too: the angle farthest either way decides.
    assert!(everywhere > 20 && somewhere > everywhere + 100 && somewhere < 576, "{everywhere} {somewhere}");
}

#[test]
fn equilibria_that_a_plain_newton_missed_are_found() {
    let plant = plant_of(CableModel::LumpedMass, Vec::new());
    let inputs = Inputs { winch_force: [1110.5, 1081.3, 891.2, 825.8].into(), disturbance: [50.0, -16.5, 164.1] };
    let found = static_equilibrium(&plant, 0.0, [0.0; 3], &inputs).unwrap();
    for (k, (expected, digits)) in [(34.956, 1e-3), (-150.959, 1e-3), (0.4083, 1e-4)].into_iter().enumerate() {
        assert!((found[k] - expected).abs() <= digits, "{found:?}");
    }
    // Forces that are known to balance somewhere: a pose at rest is found from the middle, wherever it is.
    let wave = |k: i32, rate: f64| (f64::from(k) * rate).sin();
    let mut cases = 0;
    for k in 0..300 {
        let pose = [350.0 * wave(k, 1.31), 350.0 * wave(k, 2.17), 0.6 * wave(k, 3.53)];
        if plant.geometry().check_pose(&pose).is_err() {
            continue;
        }
        let winch_force = PerCable::from_fn(4, |i| 1000.0 + 500.0 * wave(k, 0.71 + 0.39 * i as f64));
        let cables = Inputs { winch_force, disturbance: [0.0; 3] };
        let disturbance = wrench_at_rest(&plant, 0.0, pose, &cables).map(|w| -w);
        let inputs = Inputs { winch_force, disturbance };
        let found = static_equilibrium(&plant, 0.0, [0.0; 3], &inputs).unwrap_or_else(|e| panic!("{pose:?}: {e}"));
        let left = wrench_at_rest(&plant, 0.0, found, &inputs);
        assert!(left.iter().all(|w| w.abs() < 1e-3), "{pose:?}: {left:?} at {found:?}");
        cases += 1;
    }
    assert!(cases > 200, "{cases}");
}

/// Where the nearest wrench lies within a facet, it is as far off as the margin is negative: both count torques by one arm.
#[test]
fn capacity_and_the_nearest_tensions_count_torques_by_the_same_arm() {
    let geometry = crate::geometry::Geometry::new(&Parameters::default());
    let bounds = Bounds::new(1e3, 20e3).unwrap();
    let mut compared = 0;
    for k in 0..40 {
        let s = f64::from(k);
        let pose = [300.0 * (1.3 * s).sin(), 300.0 * (0.7 * s).cos(), 0.6 * (2.1 * s).sin()];
        let wrench = [1e3 * (0.9 * s).sin(), 1e3 * (1.7 * s).cos(), 3e5 * (3.1 * s).sin()];
        let structure = structure_matrix(&geometry, &pose);
        let required = workspace::RequiredWrenches { centre: wrench, half_width: [0.0; 3] };
        let margin = workspace::capacity_margin(&geometry, &pose, &bounds, &required);
        let found = nearest(&structure, &wrench, &bounds);
        let between = |t: &f64| *t > 1e3 + 1.0 && *t < 20e3 - 1.0;
        if margin < 0.0 && found.nearest_tension.iter().filter(|t| between(t)).count() == 2 {
            let arm = torque_arm(&structure);
            let [x, y, torque] = found.shortfall;
            let distance = (x * x + y * y + (torque / arm).powi(2)).sqrt();
            assert!((margin + distance).abs() < 1e-6 * distance, "{pose:?} {wrench:?}: {margin} {distance}");
            compared += 1;
        }
    }
    assert!(compared > 5, "{compared}");
}

#[test]
fn the_margin_agrees_with_the_distribution_at_the_corners() {
    let geometry = crate::geometry::Geometry::new(&Parameters::default());
    let bounds = Bounds::new(1e3, 20e3).unwrap();
    let distribution = Distribution { objective: Objective::MidTension, bounds };
    let (mut inside, mut outside) = (0, 0);
    for i in 0..12 {
        for j in 0..12 {
            let pose = [-605.0 + 110.0 * f64::from(i), -605.0 + 110.0 * f64::from(j), 0.1];
            let half_width = [2e3, 2e3, 2e4];
            let required = workspace::RequiredWrenches { centre: [500.0, 0.0, 0.0], half_width };
            let margin = workspace::capacity_margin(&geometry, &pose, &bounds, &required);
            let structure = structure_matrix(&geometry, &pose);
            let all = (0..8).all(|corner: u32| {
                let wrench = std::array::from_fn(|k| {
                    let side = if corner >> k & 1 == 0 { 1.0 } else { -1.0 };
                    required.centre[k] + side * half_width[k]
                });
                distribution.tensions(&structure, &wrench).is_ok()
            });
            assert_eq!(margin >= 0.0, all, "pose {pose:?}: margin {margin}");
            if all { inside += 1 } else { outside += 1 }
        }
    }
    assert!(inside > 20 && outside > 20, "{inside} inside, {outside} outside: the test says little");
}

#[test]
fn a_map_shrinks_with_the_wrenches_asked_for() {
    let geometry = crate::geometry::Geometry::new(&Parameters::default());
    let bounds = Bounds::new(1e3, 20e3).unwrap();
    let map = |force: f64| {
        let required = workspace::RequiredWrenches { centre: [0.0; 3], half_width: [force, force, 10.0 * force] };
        let points = workspace::MapPoints::over(workspace::anchor_rectangle(&geometry), 20, vec![0.0]);
        workspace::WorkspaceMap::new(&geometry, points, &bounds, |_| required)
    };
    let count = |map: &workspace::WorkspaceMap, holds: fn(&workspace::Feasibility) -> bool| {
        map.share_of_orientations(holds).iter().filter(|share| **share == 1.0).count()
    };
    let (small, large) = (map(100.0), map(3000.0));
    assert!(count(&small, |c| c.feasible()) > count(&large, |c| c.feasible()) + 20);
    assert!(count(&small, |c| c.closed()) >= count(&small, |c| c.feasible()));
    // Left and right mirror each other.
    for j in 0..20 {
        for i in 0..10 {
            let (a, b) = (small.cells[j * 20 + i], small.cells[j * 20 + 19 - i]);
            assert!((a.margin - b.margin).abs() < 1e-6, "{a:?} {b:?}");
        }
    }
}

#[test]
fn six_cables_around_close_every_wrench_and_three_do_not() {
    use crate::geometry::Geometry;
    use crate::parameters::CableParameters;
    use workspace::{RequiredWrenches, feasibility};
    let around = |cables: usize| {
        let cable = (0..cables).map(|i| {
            let angle = std::f64::consts::TAU * (i as f64 + 0.4) / cables as f64;
            let on_body = angle + if i % 2 == 0 { 0.7 } else { -0.7 };
            CableParameters::between(
                [900.0 * angle.cos(), 900.0 * angle.sin()],
                [10.0 * on_body.cos(), 10.0 * on_body.sin()],
            )
        });
        Geometry::new(&Parameters { cable: cable.collect(), ..Parameters::default() })
    };
    let bounds = Bounds::new(1e3, 50e3).unwrap();
    let asked = RequiredWrenches { centre: [0.0; 3], half_width: [0.0; 3] };
    let at = |cables: usize| feasibility(&around(cables), &[0.0; 3], &bounds, &asked);
    assert!(at(6).closure && at(8).closure && (at(6).balance - 1.0).abs() < 1e-6, "{:?}", at(6));
    assert!(!at(3).closure && at(3).balance < 0.0, "{:?}", at(3));
    // With four cables both ways to the balance are open.
    for pose in [[0.0; 3], [200.0, -100.0, 0.2], [-50.0, 300.0, -0.3]] {
        let geometry = Geometry::new(&Parameters::default());
        let closed = feasibility(&geometry, &pose, &bounds, &asked).balance;
        let halved = workspace::balance_by_halving(&structure_matrix(&geometry, &pose));
        assert!((closed.max(-1.0) - halved).abs() < 1e-6 || closed <= 0.0 && halved == -1.0, "{closed} {halved}");
    }
}
