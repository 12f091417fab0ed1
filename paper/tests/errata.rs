//! Every erratum of the paper: what the printed form does wrong, and that the corrected form does not.
//!
//! One test for each row of the table in `docs/errata.md`, in its order.

use std::sync::Arc;

use cdpr::dynamics::Inputs;
use cdpr::geometry::Geometry;
use cdpr::kinematics::{self, CableKinematics};
use cdpr::parameters::{CableDamper, CableInertia, CableModel, Parameters};
use cdpr::plant::Plant;
use cdpr::simulation::{Simulation, Start};
use cdpr_paper::mismatch::Mismatch;
use cdpr_paper::{printed, runge_kutta};

const POSE: [f64; 3] = [40.0, -25.0, 0.3];
const TWIST: [f64; 3] = [1.2, -0.7, 0.05];
const ACCELERATION: [f64; 3] = [0.3, 0.4, -0.02];

fn cable(pose: [f64; 3], twist: [f64; 3]) -> CableKinematics {
    kinematics::cables(&Geometry::new(&Parameters::default()), &pose, &twist)[1]
}

fn moved(t: f64) -> ([f64; 3], [f64; 3]) {
    let pose = std::array::from_fn(|k| POSE[k] + t * TWIST[k] + 0.5 * t * t * ACCELERATION[k]);
    (pose, std::array::from_fn(|k| TWIST[k] + t * ACCELERATION[k]))
}

fn turned(v: [f64; 2], by: f64) -> [f64; 2] {
    [by.cos() * v[0] - by.sin() * v[1], by.sin() * v[0] + by.cos() * v[1]]
}

fn close(a: f64, b: f64, relative: f64) -> bool {
    (a - b).abs() <= relative * b.abs().max(1e-12)
}

#[test]
fn equation_4_without_its_root_is_no_length() {
    let printed_length = |scale: f64| {
        let anchor = [-636.396 * scale, -636.396 * scale];
        printed::length([0.0; 3], 10.0 * scale, -0.25 * std::f64::consts::PI, anchor)
    };
    assert!(close(printed_length(2.0), 4.0 * printed_length(1.0), 1e-12), "it grows with the square of the robot");
    let [a, b] = [1.0, 2.0].map(|scale| {
        let p = Parameters { anchor_radius: 900.0 * scale, attachment_radius: 10.0 * scale, ..Parameters::default() };
        kinematics::cable_lengths(&Geometry::new(&p), &[0.0; 3])[0]
    });
    assert!(close(b, 2.0 * a, 1e-12) && close(a, 900.0_f64.hypot(10.0), 1e-12), "a length grows with the robot");
}

#[test]
fn equation_7_with_the_length_rate_is_not_the_velocity() {
    let h = 1e-4;
    let end = |t: f64| {
        let c = cable(moved(t).0, [0.0; 3]);
        [c.length * c.direction[0], c.length * c.direction[1]]
    };
    let (ahead, behind) = (end(h), end(-h));
    let velocity: [f64; 2] = std::array::from_fn(|k| (ahead[k] - behind[k]) / (2.0 * h));
    let c = cable(POSE, TWIST);
    let s = c.direction;
    let printed = printed::attachment_velocity(s, c.speed, c.angular_rate);
    let corrected =
        [c.speed * s[0] - c.angular_rate * c.length * s[1], c.speed * s[1] + c.angular_rate * c.length * s[0]];
    for k in 0..2 {
        assert!(close(corrected[k], velocity[k], 1e-6), "{corrected:?} {velocity:?}");
    }
    let miss = (printed[0] - velocity[0]).hypot(printed[1] - velocity[1]);
    assert!(miss > 0.1 * velocity[0].hypot(velocity[1]), "printed {printed:?}, velocity {velocity:?}");
}

#[test]
fn equation_16_without_the_square_is_not_the_acceleration() {
    // (15): the centre moves at half the speed of the end.
    let centre = |t: f64| {
        let (pose, twist) = moved(t);
        let c = cable(pose, twist);
        let (s, along, across) = (c.direction, 0.5 * c.speed, 0.5 * c.angular_rate * c.length);
        [along * s[0] - across * s[1], along * s[1] + across * s[0]]
    };
    let h = 1e-4;
    let (ahead, behind) = (centre(h), centre(-h));
    let acceleration: [f64; 2] = std::array::from_fn(|k| (ahead[k] - behind[k]) / (2.0 * h));
    let c = cable(POSE, TWIST);
    let geometry = Geometry::new(&Parameters::default());
    let (length, angle) = kinematics::accelerations(&geometry, &POSE, &TWIST, &ACCELERATION);
    let printed = printed::centre_acceleration(c.direction, [c.length, c.speed, length[1]], [c.angular_rate, angle[1]]);
    // The corrected form differs in α̇² L where α̇ L stands.
    let repair = 0.5 * (c.angular_rate - c.angular_rate.powi(2)) * c.length;
    for k in 0..2 {
        assert!((printed[k] + repair * c.direction[k] - acceleration[k]).abs() < 1e-6, "{printed:?} {acceleration:?}");
    }
    assert!(repair.abs() > 0.1, "the printed form is off by {repair} m/s²");
}

#[test]
fn equation_17_with_the_platforms_mass_is_no_rods_inertia() {
    let (density, length): (f64, f64) = (0.215, 900.0);
    let pieces = 100_000;
    let integral: f64 = (0..pieces).map(|k| (length * (f64::from(k) + 0.5) / f64::from(pieces)).powi(2)).sum::<f64>()
        * density
        * length
        / f64::from(pieces);
    assert!(close(density * length.powi(3) / 3.0, integral, 1e-6), "ρ L³/3 is the rod's");
    let printed = printed::limb_inertia(2500.0, length);
    assert!(printed > 10.0 * integral, "M L²/3 = {printed}, rod {integral}: an eightfold mass error and more");
}

/// A cable turned about its anchor at constant length takes the power that its kinetic energy gains.
#[test]
fn equations_22_and_25_give_energy_for_nothing() {
    let (density, length, rate, acceleration) = (0.215_f64, 900.0_f64, 2e-3, 1e-3);
    let gain = density * length.powi(3) / 3.0 * rate * acceleration;
    let on_platform = printed::transverse_force(density, [length, 0.0], [rate, acceleration]);
    let power_from_platform = |force: f64| -force * length * rate;
    assert!(close(power_from_platform(on_platform), -gain, 1e-12), "printed: the platform gains what the cable gains");
    assert!(close(power_from_platform(-on_platform), gain, 1e-12), "corrected: the platform pays");
    // So the cables make the platform heavier, not lighter.
    let heavier = |inertia| {
        let parameters =
            Parameters { cable_model: CableModel::LumpedMass, cable_inertia: inertia, ..Parameters::default() };
        let plant = Plant::new(parameters, Vec::new()).unwrap();
        let y = Start::default().states(&plant).unwrap();
        let push = Inputs { winch_force: [1000.0; 4].into(), disturbance: [100.0, 0.0, 0.0] };
        plant.evaluate(0.0, &y, &push, &[false; 4].into()).acceleration[0]
    };
    let (with, printed_mass) = (heavier(CableInertia::Paper), {
        let across = density * 900.0_f64.hypot(10.0) / 3.0;
        let geometry = Geometry::new(&Parameters::default());
        let sum: f64 = kinematics::cables(&geometry, &[0.0; 3], &[0.0; 3])
            .iter()
            .map(|c| across * f64::powi(c.normal_row()[0], 2))
            .sum();
        2500.0 - sum
    });
    assert!(with < 100.0 / 2500.0, "corrected: {with} m/s² is less than without cables");
    assert!(100.0 / printed_mass > 100.0 / 2500.0, "printed: the cables would make the platform lighter");
}

#[test]
fn equation_24_turns_the_momentum_balance_round() {
    // A cable turned at constant length by a force at its end: across it, (21) says F_A - F_B = M a_C.
    let (density, length, acceleration) = (0.215_f64, 900.0_f64, 1e-3);
    let mass_times_acceleration = density * length * (0.5 * length * acceleration);
    // Moment balance about A, (20) with (21): the limb feels -F_B at its end.
    let at_platform = -density / 3.0 * length * length * acceleration;
    let at_anchor = mass_times_acceleration + at_platform;
    // Independent: momentum of slices of the rod.
    let momentum_rate: f64 =
        (0..1000).map(|k| density * length / 1000.0 * (length * (f64::from(k) + 0.5) / 1000.0) * acceleration).sum();
    assert!(close(at_anchor - at_platform, momentum_rate, 1e-9));
    assert!(close(printed::transverse_difference(at_platform, at_anchor), -momentum_rate, 1e-9), "the sign is turned");
}

#[test]
fn equation_28_depends_on_the_frame() {
    let (along, across, s) = (-1200.0, 35.0, [0.6, 0.8]);
    let corrected = |s: [f64; 2]| [along * s[0] - across * s[1], along * s[1] + across * s[0]];
    let by = 0.7;
    let (first, second) = (turned(corrected(s), by), corrected(turned(s, by)));
    assert!(close(first[0], second[0], 1e-12) && close(first[1], second[1], 1e-12), "(37) turns with the frame");
    let (first, second) =
        (turned(printed::platform_force(along, across, s), by), printed::platform_force(along, across, turned(s, by)));
    let miss = (first[0] - second[0]).hypot(first[1] - second[1]);
    assert!(miss > 10.0, "(28) gives two forces {miss} N apart for one robot seen from two frames");
    // And it is not even as large as its parts.
    let force = printed::platform_force(along, across, s);
    assert!((force[0].hypot(force[1]) - f64::hypot(along, across)).abs() > 1.0);
}

#[test]
fn equations_27_and_28_have_a_moment_that_depends_on_the_frame() {
    let (across, arm, s) = (35.0, [6.0, -8.0], [0.6, 0.8]);
    // E × (F N) = F (E·S).
    let n = [-s[1], s[0]];
    let moment = across * (arm[0] * n[1] - arm[1] * n[0]);
    assert!(close(across * (arm[0] * s[0] + arm[1] * s[1]), moment, 1e-12));
    let printed = printed::transverse_moment(across, arm, s);
    let seen_turned = printed::transverse_moment(across, turned(arm, 0.7), turned(s, 0.7));
    assert!((printed - moment).abs() > 1.0, "{printed} against {moment}");
    assert!((printed - seen_turned).abs() > 1.0, "one robot, two frames, two moments: {printed} and {seen_turned}");
}

#[test]
fn equation_36_cannot_hold_a_force_above_ea() {
    let (ea, unstretched) = (1520.0, 900.0);
    let law = |length: f64| ea * (length - unstretched) / unstretched;
    // Twice the stretch, twice the force: strain is per unstretched length.
    assert!(close(law(1100.0), 2.0 * law(1000.0), 1e-12));
    let printed = |length: f64| printed::elastic_force(ea, length, unstretched);
    assert!(printed(1100.0) < 1.9 * printed(1000.0), "(36) softens with stretch");
    assert!(printed(1e9) < ea, "however far it is pulled, (36) stays below EA");
    assert!(law(2500.0) > ea);
    // In the rigid limit both agree: the difference is of second order in strain.
    assert!(close(printed::elastic_force(15.2e6, 900.05, 900.0), 15.2e6 * 0.05 / 900.0, 1e-4));
}

#[test]
fn equation_35_runs_away() {
    let (masses, spring) = ([2500.0, 97.0], [16_889.0, 22.0]);
    // Stretched by 1 m and let go, no winch force: the body must be drawn towards the lumped mass.
    let [printed, _] = printed::two_mass(masses, spring, [1.0, 0.0], 0.0);
    assert!(printed > 0.0, "printed: a stretched spring pushes the body further away");
    let corrected = |stretch: f64, rate: f64| {
        let pull = spring[0] * stretch + spring[1] * rate;
        [-pull / masses[0], pull / masses[1]]
    };
    let energy = |signs: &dyn Fn(f64, f64) -> [f64; 2]| {
        // x, x', ẋ, ẋ'
        let rates = |_: f64, y: &[f64], out: &mut [f64]| {
            let [a, b] = signs(y[0] - y[1], y[2] - y[3]);
            out.copy_from_slice(&[y[2], y[3], a, b]);
        };
        let y = runge_kutta(rates, &[1.0, 0.0, 0.0, 0.0], 1e-3, 1000);
        let stored =
            0.5 * spring[0] * (y[0] - y[1]).powi(2) + 0.5 * (masses[0] * y[2] * y[2] + masses[1] * y[3] * y[3]);
        (stored, masses[0] * y[2] + masses[1] * y[3])
    };
    let (kept, momentum) = energy(&corrected);
    assert!(kept < 0.5 * spring[0] && kept > 0.1 * spring[0], "corrected: damping takes a little, {kept} J");
    assert!(momentum.abs() < 1e-9, "corrected: no momentum from within");
    // Printed for the body; the lumped mass felt as it must for the row F = m ẍ' + ... with F = 0.
    let (made, momentum) = energy(&|stretch, rate| {
        let [body, _] = printed::two_mass(masses, spring, [stretch, rate], 0.0);
        [body, -(spring[0] * stretch + spring[1] * rate) / masses[1]]
    });
    assert!(made > 10.0 * spring[0], "printed: energy out of nothing, {made} J");
    assert!(momentum.abs() < 1e6 && made.is_finite());
}

#[test]
fn equation_36_pushes_with_a_stretched_cable() {
    // Push-positive as the paper has it: F_B along S, from the anchor to the platform.
    let force = printed::elastic_force(15.2e6, 900.2, 900.0);
    assert!(force > 0.0, "printed: stretched by 0.2 m the cable pushes the platform away with {force} N");
    // The plant pulls: stretched cables on one side accelerate the platform towards that side.
    let plant = Plant::new(Parameters::default(), Vec::new()).unwrap();
    let mut y = Start::default().states(&plant).unwrap();
    for i in [0, 3] {
        y[plant.unstretched_index(i).unwrap()] -= 0.2;
    }
    let inputs = Inputs { winch_force: [1000.0; 4].into(), disturbance: [0.0; 3] };
    let acceleration = plant.evaluate(0.0, &y, &inputs, &[false; 4].into()).acceleration;
    assert!(acceleration[0] < -0.1, "anchors 1 and 4 are on the left: {acceleration:?}");
}

#[test]
fn table_1_cannot_mean_kilograms_per_metre() {
    let p = Parameters::default();
    let gyration = (p.platform_inertia / p.platform_mass).sqrt();
    assert!((5.0..20.0).contains(&gyration), "as kg m² the radius of gyration {gyration} m is the platform's size");
    let mass = p.platform_inertia * 2.0 * p.attachment_radius;
    assert!(mass > 1000.0 * p.platform_mass, "as kg/m over the platform's width it would be {mass} kg");
}

#[test]
fn table_2_makes_a_rope_denser_than_any_metal() {
    let density = |p: &Parameters| p.cable_density / p.cable_area;
    assert!(close(density(&Parameters::default()), 538.0, 1e-2), "a braided rope");
    assert!(density(&Parameters::as_printed()) > 2e5, "printed: denser than any metal");
    // The conclusion's fast pole is there with 4e-4 m² only.
    let pole = |p: &Parameters| -p.axial_stiffness() / p.cable_damping;
    assert!(close(pole(&Parameters::default()), -760.0, 1e-12));
    assert!(pole(&Parameters::as_printed()) > -0.1);
}

/// A cable reeled out at constant speed and constant density needs no net force along it: what its momentum gains comes in
/// at the anchor. The paper's rod stretches and gains mass, and asks for a force.
#[test]
fn equations_15_and_23_ask_for_a_force_where_none_is_needed() {
    let asked = |inertia: CableInertia| {
        let parameters = Parameters { cable_model: CableModel::Rigid, cable_inertia: inertia, ..Parameters::default() };
        let plant = Plant::new(parameters, Vec::new()).unwrap();
        let mut y = Start::default().states(&plant).unwrap();
        // Along cable 1, from its anchor to its attachment point.
        let c = kinematics::cables(plant.geometry(), &[0.0; 3], &[0.0; 3])[0];
        let speed = 5.0;
        (y[3], y[4]) = (speed * c.direction[0], speed * c.direction[1]);
        let inputs = Inputs { winch_force: [1000.0; 4].into(), disturbance: [0.0; 3] };
        let e = plant.evaluate(0.0, &y, &inputs, &[false; 4].into());
        // What remains of T - u when the mass times L̈ is taken off.
        let k = e.kinematics[0];
        let row = k.jacobian_row();
        let along: f64 = (0..3).map(|c| row[c] * e.acceleration[c]).sum::<f64>() + k.length_acceleration_bias(y[5]);
        let share = if inertia == CableInertia::Paper { 0.5 } else { 1.0 };
        let turning = k.length * k.angular_rate;
        let centrifugal = -0.5 * 0.215 * turning * turning;
        e.tension[0] - 1000.0 - share * 0.215 * k.length * along - centrifugal
    };
    assert!(asked(CableInertia::Reeled).abs() < 1e-9);
    assert!(close(asked(CableInertia::Paper), 0.5 * 0.215 * 25.0, 1e-9), "the rod asks for ρ/2 L̇²");
}

/// At constant strain a damper that measures strain feels nothing; the printed one feels the paying out.
#[test]
fn the_damper_of_33_feels_a_cable_that_is_reeled_out_at_constant_strain() {
    let (rate, strain) = (0.5, 1e-3);
    let felt = |cable_damper: CableDamper| {
        let p = Parameters { cable_damper, ..Parameters::default() };
        let (stiffness, damping) = (p.axial_stiffness(), p.cable_damping);
        let plant = Plant::new(p, Vec::new()).unwrap();
        let mut y = Start::default().states(&plant).unwrap();
        let c = kinematics::cables(plant.geometry(), &[0.0; 3], &[0.0; 3])[0];
        let speed = rate * (1.0 + strain);
        (y[3], y[4]) = (speed * c.direction[0], speed * c.direction[1]);
        let at = plant.unstretched_index(0).unwrap();
        (y[at], y[at + 1]) = (c.length / (1.0 + strain), rate);
        let e = plant.evaluate(0.0, &y, &Inputs::pulling(4, 1000.0), &[false; 4].into());
        (e.tension[0] - stiffness * strain) * y[at] / damping
    };
    assert!(close(felt(CableDamper::LengthRate), strain * rate, 1e-6));
    assert!(felt(CableDamper::StrainRate).abs() < 1e-6 * strain * rate);
}

/// `l̇` at constant tension and chord, with the printed area: its slope over `l` is the pole.
#[test]
fn table_2_has_another_pole_with_the_stretched_length() {
    let p = Parameters::as_printed();
    let (stiffness, damping, tension, chord) = (p.axial_stiffness(), p.cable_damping, 1000.0, 907.0);
    let rest = chord / (1.0 + tension / stiffness);
    let rate = |l: f64, b: f64| (stiffness * (chord - l) / l - tension) / b;
    let slope = |b: &dyn Fn(f64) -> f64| (rate(rest + 1e-4, b(rest + 1e-4)) - rate(rest - 1e-4, b(rest - 1e-4))) / 2e-4;
    assert!(close(slope(&|l| damping / l), -0.126, 1e-3));
    assert!(close(slope(&|_| damping / chord), -0.209, 1e-3));
}

/// On (37)-(40) the pole of the paid-out lengths, -760 1/s, bounds the step of the method of order 4 to 2.785/760 s.
#[test]
fn runge_kutta_fails_on_massless_springs_above_its_limit() {
    let parameters = Parameters { cable_model: CableModel::MasslessSpring, ..Parameters::default() };
    let plant = Arc::new(Plant::new(parameters, Vec::new()).unwrap());
    let start = Start { pose: [0.1; 3], ..Start::default() };
    let mut simulation = Simulation::new(plant.clone(), &start, 1e-12).unwrap();
    let (y, inputs) = (simulation.states().to_vec(), simulation.inputs());
    let run =
        |step: f64, steps| runge_kutta(|t, y, r| plant.rates(t, y, &inputs, &[false; 4].into(), r), &y, step, steps);
    simulation.advance(7.2).unwrap();
    let off = |states: &[f64]| (states[6] - simulation.states()[6]).abs();
    assert!(off(&run(0.0036, 2000)) < 1e-6, "{}", off(&run(0.0036, 2000)));
    let beyond = off(&run(0.0040, 1800));
    assert!(beyond.is_nan() || beyond > 1.0, "{beyond}");
}

#[test]
fn runge_kutta_can_be_used_with_rigid_cables() {
    let parameters = Parameters { cable_model: CableModel::Rigid, ..Parameters::default() };
    let plant = Arc::new(Plant::new(parameters, Vec::new()).unwrap());
    let start = Start { pose: [0.1; 3], ..Start::default() };
    let mut simulation = Simulation::new(plant.clone(), &start, 1e-12).unwrap();
    let (y, inputs) = (simulation.states().to_vec(), simulation.inputs());
    let explicit = runge_kutta(|t, y, r| plant.rates(t, y, &inputs, &[false; 4].into(), r), &y, 0.1, 200);
    simulation.advance(20.0).unwrap();
    for (a, b) in explicit.iter().zip(simulation.states()) {
        assert!((a - b).abs() < 1e-9, "{explicit:?} {:?}", simulation.states());
    }
}

#[test]
fn equal_constant_pull_is_unstable_in_rotation_and_the_mismatch_hides_it() {
    // Σ L_i has a maximum at φ = 0 for crossed cables.
    let geometry = Geometry::new(&Parameters::default());
    let sum = |phi: f64| kinematics::cable_lengths(&geometry, &[0.0, 0.0, phi]).iter().sum::<f64>();
    assert!(sum(0.1) < sum(0.0) && sum(-0.1) < sum(0.0));
    let displaced = |k: usize| {
        let mut pose = [0.0; 3];
        pose[k] = 1.0;
        kinematics::cable_lengths(&geometry, &pose).iter().sum::<f64>() > sum(0.0)
    };
    assert!(displaced(0) && displaced(1), "x and y are stable");
    let rigid = Parameters { cable_model: CableModel::Rigid, ..Parameters::default() };
    let release = |model: Mismatch| model.release([0.1; 3], 1e3, 1.0, 80.0).unwrap();
    let largest = |states: &[Vec<f64>], k: usize| states.iter().map(|y| y[k].abs()).fold(0.0, f64::max);
    let lowest = |states: &[Vec<f64>], k: usize| states.iter().map(|y| y[k]).fold(f64::INFINITY, f64::min);
    let consistent = release(Mismatch::consistent(rigid.clone()));
    assert!(largest(&consistent, 2) > 0.6, "φ grows");
    let mismatch = release(Mismatch::new(rigid));
    assert!(largest(&mismatch, 2) < 0.1001 && lowest(&mismatch, 2) < -0.09, "with the mismatch φ swings");
}
