//! Winches that are commanded by torque, speed and length.

use std::sync::Arc;

use cdpr::dynamics::{Inputs, Jacobian};
use cdpr::effect::EffectSpec;
use cdpr::inverse::distribution::{Bounds, Distribution, Objective};
use cdpr::inverse::{Ends, InverseDynamics, InverseError, Samples, SplineTrajectory};
use cdpr::model_file::Model;
use cdpr::parameters::{CableInertia, CableModel, Parameters};
use cdpr::per_cable::PerCable;
use cdpr::plant::Plant;
use cdpr::simulation::{Simulation, Start};
use cdpr::statics::LinearModel;
use cdpr::winch::{WINCH_COMMANDS, WinchCommand, WinchParameters};

use crate::random::{MODELS, Random, state};

/// Inertia of the rotors (kg m²).
const ROTOR: f64 = 0.8;

fn winch(command: WinchCommand) -> WinchParameters {
    WinchParameters {
        command,
        drum_radius: 0.4,
        gear_ratio: 3.0,
        rotor_inertia: Some(ROTOR),
        ..WinchParameters::default()
    }
}

fn plant_with(winch: WinchParameters, model: CableModel, effects: Vec<EffectSpec>) -> Arc<Plant> {
    Arc::new(Plant::new(Parameters { winch, cable_model: model, ..Parameters::default() }, effects).unwrap())
}

/// At rest in the middle with 20 kN in each cable.
fn at_rest(winch: WinchParameters, effects: Vec<EffectSpec>) -> Simulation {
    let plant = plant_with(winch, CableModel::LumpedMass, effects);
    let length = plant.unstretched_length_for(0, 0.0, 900.0_f64.hypot(10.0), 2e4, &[]);
    let hold = match winch.command {
        WinchCommand::Force => 2e4,
        WinchCommand::Torque => 2e4 * winch.drum_radius / winch.gear_ratio,
        WinchCommand::Speed => 0.0,
        WinchCommand::Length => length,
    };
    let mut y = vec![0.0; plant.dimension()];
    for i in 0..4 {
        y[plant.unstretched_index(i).unwrap()] = length;
    }
    Simulation::from_states(plant, 0.0, y, Inputs::pulling(4, hold), 1e-10)
}

/// A torque is a force by gear and drum, and a rotor a mass at the cable, in every cable model.
#[test]
fn a_torque_moves_the_platform_as_the_force_that_it_makes() {
    let torque = winch(WinchCommand::Torque);
    let ratio = torque.gear_ratio / torque.drum_radius;
    let rotor = EffectSpec::new("winch_drum_inertia", None, &[ROTOR * ratio * ratio]).unwrap();
    for model in MODELS {
        let forces = [2.2e4, 1.9e4, 2.1e4, 2.0e4];
        let run = |plant: Arc<Plant>, unit: f64| {
            let inputs =
                Inputs { winch_force: PerCable::from_fn(4, |i| forces[i] / unit), disturbance: [50.0, 0.0, 9.0] };
            let start = Start { pose: [4.0, -3.0, 0.1], inputs, ..Start::default() };
            let mut simulation = Simulation::new(plant, &start, 1e-10).unwrap();
            let slopes = Inputs { winch_force: PerCable::from_fn(4, |i| 100.0 * i as f64 / unit), ..Inputs::none(4) };
            simulation.set_inputs_with_slopes(inputs, slopes);
            (0..10).for_each(|_| simulation.advance(0.2).unwrap());
            simulation
        };
        let commanded = run(plant_with(torque, model, Vec::new()), ratio);
        let forced = run(plant_with(WinchParameters::default(), model, vec![rotor.clone()]), 1.0);
        for (a, b) in commanded.states().iter().zip(forced.states()) {
            assert!((a - b).abs() <= 1e-10 * (1.0 + b.abs()), "{model:?}: {a} {b}");
        }
        // By a unit of torque there is so much more of every change.
        let (by_torque, by_force) = (LinearModel::of(&commanded), LinearModel::of(&forced));
        for row in 0..by_force.b.nrows() {
            let (a, b) = (by_torque.b[(row, 1)], ratio * by_force.b[(row, 1)]);
            assert!((a - b).abs() <= 1e-9 * (1e-6 + b.abs()), "{model:?}, row {row}: {a} {b}");
        }
        assert_eq!(by_torque.input_names[1], "winch_torque[2]");
    }
}

/// `l̈ = ω (v_c - l̇)`, however the cable rings.
#[test]
fn a_servo_follows_a_speed_with_its_bandwidth() {
    let mut simulation = at_rest(winch(WinchCommand::Speed), Vec::new());
    let before = simulation.outputs();
    simulation.set_inputs(Inputs { winch_force: [0.3, -0.3, 0.1, 0.0].into(), disturbance: [0.0; 3] });
    for step in 1..=20 {
        simulation.advance(0.02).unwrap();
        let time = 0.02 * f64::from(step);
        let outputs = simulation.outputs();
        let decay = (-20.0 * time).exp();
        for (i, speed) in [0.3, -0.3, 0.1, 0.0].into_iter().enumerate() {
            let rate = speed * (1.0 - decay);
            let way = speed * (time - (1.0 - decay) / 20.0);
            let found = outputs.unstretched_length[i] - before.unstretched_length[i];
            assert!((outputs.unstretched_length_rate[i] - rate).abs() < 1e-7, "{time} s, winch {}", i + 1);
            assert!((found - way).abs() < 1e-7, "{time} s, winch {}: {found} {way}", i + 1);
            assert!((outputs.winch_angle[i] - outputs.unstretched_length[i] / 0.4).abs() < 1e-9);
            assert!((outputs.winch_rate[i] - outputs.unstretched_length_rate[i] / 0.4).abs() < 1e-12);
        }
    }
}

/// `l̈ = ω² (l_c - l) - 2 ζ ω l̇`.
#[test]
fn a_servo_follows_a_length_with_bandwidth_and_damping() {
    let servo = WinchParameters { bandwidth: 15.0, damping: 0.4, ..winch(WinchCommand::Length) };
    let mut simulation = at_rest(servo, Vec::new());
    let start = simulation.outputs().unstretched_length;
    let mut inputs = simulation.inputs();
    inputs.winch_force[2] -= 0.05;
    simulation.set_inputs(inputs);
    let (decay, swing) = (0.4 * 15.0, 15.0 * (1.0_f64 - 0.16).sqrt());
    for step in 1..=40 {
        simulation.advance(0.02).unwrap();
        let t = 0.02 * f64::from(step);
        let left = (-decay * t).exp() * ((swing * t).cos() + decay / swing * (swing * t).sin());
        let outputs = simulation.outputs();
        for i in 0..4 {
            let expected = if i == 2 { -0.05 * (1.0 - left) } else { 0.0 };
            let found = outputs.unstretched_length[i] - start[i];
            assert!((found - expected).abs() < 1e-7, "{t} s, winch {}: {found} {expected}", i + 1);
        }
    }
}

#[test]
fn a_servo_pulls_within_its_limit_and_arrives_all_the_same() {
    let servo = WinchParameters { force_limit: 2.02e4, ..winch(WinchCommand::Length) };
    let mut simulation = at_rest(servo, Vec::new());
    let goal = simulation.outputs().unstretched_length[0] - 0.01;
    simulation.set_inputs(Inputs { winch_force: PerCable::filled(4, goal), disturbance: [0.0; 3] });
    let mut at_limit = 0;
    for _ in 0..1000 {
        simulation.advance(0.005).unwrap();
        let pull = simulation.evaluate().pull;
        assert!(pull.iter().all(|u| u.abs() <= 2.02e4), "{pull:?}");
        at_limit += usize::from(pull[0] == 2.02e4);
    }
    assert!(at_limit > 3, "the test says little");
    let arrived = simulation.outputs().unstretched_length;
    assert!(arrived.iter().all(|l| (l - goal).abs() < 1e-6), "{arrived:?} {goal}");
}

#[test]
fn winches_at_their_command_stay_at_rest() {
    for command in WINCH_COMMANDS {
        let mut simulation = at_rest(winch(command), Vec::new());
        let before = simulation.states().to_vec();
        simulation.advance(5.0).unwrap();
        for (a, b) in simulation.states().iter().zip(&before) {
            assert!((a - b).abs() < 1e-7, "{command:?}: {a} {b}");
        }
    }
}

/// The implicit equations hold, and energy comes from where the balance says, with servos as with forces.
#[test]
fn servos_satisfy_the_implicit_equations_and_the_energy_balance() {
    let mut random = Random(83);
    for command in [WinchCommand::Speed, WinchCommand::Length] {
        let friction = EffectSpec::new("winch_stribeck_friction", None, &[80.0, 150.0, 0.05, 30.0]).unwrap();
        let lag = EffectSpec::new("winch_lag", Some(2), &[0.05]).unwrap();
        for inertia in [CableInertia::Paper, CableInertia::Reeled] {
            let parameters = Parameters { winch: winch(command), cable_inertia: inertia, ..Parameters::default() };
            let plant = Plant::new(parameters, vec![friction.clone(), lag.clone()]).unwrap();
            for _ in 0..100 {
                let (y, mut u) = state(&mut random, &plant);
                u.winch_force = PerCable::from_fn(4, |i| match command {
                    WinchCommand::Length => y[plant.unstretched_index(i).unwrap()] + random.within(-0.2, 0.2),
                    _ => random.within(-1.0, 1.0),
                });
                let slack = plant.slack_cables(0.0, &y, &u);
                let mut rates = vec![0.0; y.len()];
                plant.rates(0.0, &y, &u, &slack, &mut rates);
                let mut left = rates.clone();
                plant.residual(0.0, &y, &rates, &u, &slack, &mut left);
                assert!(left.iter().all(|r| r.abs() < 1e-5), "{command:?}: {left:?}");
                let e = plant.evaluate(0.0, &y, &u, &slack);
                let power = plant.power(0.0, &y, &u, &e).total();
                let moving: Vec<num_dual::Dual64> =
                    y.iter().zip(&rates).map(|(y, rate)| num_dual::Dual64::new(*y, *rate)).collect();
                let change = plant.energy(&moving, &slack).total().eps;
                assert!((change - power).abs() < 1e-8 * (1e5 + power.abs()), "{command:?}: {change} {power}");
                // Newton's matrix has the servo in its blocks.
                let mut jacobian = Jacobian::default();
                jacobian.update(&plant, 0.0, &y, &u, &slack);
                for i in (0..4).filter(|i| !slack[*i]) {
                    let at = plant.unstretched_index(i).unwrap();
                    for column in at..at + 2 {
                        let along = |sign: f64| {
                            let mut moved = y.clone();
                            moved[column] += sign * 1e-6;
                            let mut rates = vec![0.0; y.len()];
                            plant.rates(0.0, &moved, &u, &slack, &mut rates);
                            rates[at + 1]
                        };
                        let (slope, found) =
                            ((along(1.0) - along(-1.0)) / 2e-6, jacobian.by_state[(at + 1) * y.len() + column]);
                        assert!(
                            (slope - found).abs() < 1e-3 * (10.0 + found.abs()),
                            "{command:?} {i}: {slope} {found}"
                        );
                    }
                }
            }
        }
    }
}

fn trajectory() -> SplineTrajectory {
    let pose = vec![[0.0; 3], [3.0, 2.0, 0.02], [5.0, 1.0, 0.05], [2.0, 0.0, 0.03]];
    let samples = Samples { time: vec![0.0, 4.0, 8.0, 12.0], pose, ..Samples::default() };
    SplineTrajectory::new(&samples, Ends::Rest).unwrap()
}

/// Whatever the winches are told, the command that inverse dynamics gives makes the acceleration asked for.
#[test]
fn inverse_dynamics_gives_the_command_in_its_own_unit() {
    let trajectory = trajectory();
    let distribution = Distribution { objective: Objective::MidTension, bounds: Bounds::new(1e3, 4e4).unwrap() };
    let friction = EffectSpec::new("winch_coulomb_friction", None, &[120.0, 0.02]).unwrap();
    for command in WINCH_COMMANDS {
        let plant = plant_with(winch(command), CableModel::LumpedMass, vec![friction.clone()]);
        let problem = InverseDynamics::new(plant.clone(), &trajectory, &distribution).unwrap();
        for instant in problem.run(&[0.0, 1.3, 5.0, 9.7], 1e-11).unwrap() {
            let simulation =
                Simulation::from_states(plant.clone(), instant.time, instant.states.clone(), instant.inputs(), 1e-9);
            let e = simulation.evaluate();
            for (found, wanted) in e.acceleration.iter().zip(instant.motion.derivative(2)) {
                assert!((found - wanted).abs() < 1e-9, "{command:?} at {} s: {found} {wanted}", instant.time);
            }
            for i in 0..4 {
                let (found, wanted) = (e.unstretched_acceleration[i], instant.unstretched_acceleration[i]);
                assert!((found - wanted).abs() < 1e-7, "{command:?} at {} s: {found} {wanted}", instant.time);
            }
        }
    }
    let weak = WinchParameters { force_limit: 1e4, ..winch(WinchCommand::Speed) };
    let plant = plant_with(weak, CableModel::LumpedMass, Vec::new());
    let error = InverseDynamics::new(plant, &trajectory, &distribution).unwrap().run(&[0.0], 1e-9).unwrap_err();
    assert!(matches!(error, InverseError::BeyondLimit { .. }), "{error}");
    assert!(error.to_string().contains("`force_limit` of 10000 N"), "{error}");
}

#[test]
fn a_term_on_forces_that_nobody_commands_is_refused() {
    let term = EffectSpec::expression("winch[1]", "0.1*winch_force[1]").unwrap();
    let parameters = Parameters { winch: winch(WinchCommand::Speed), ..Parameters::default() };
    let error = Plant::new(parameters, vec![term]).unwrap_err().to_string();
    assert!(error.contains("`winch_force` is no input"), "{error}");
}

/// A robot of its own: winches of unlike drums and rotors, told lengths, holds a pose against gravity.
#[test]
fn a_small_robot_with_geared_drums_hangs_where_its_lengths_say() {
    let text = "platform_mass = 20.0\nplatform_inertia = 0.8\ngravity = [0.0, -9.81]\nyoungs_modulus = 1e11\n\
        cable_area = 1e-5\ncable_density = 0.05\ncable_damping = 500.0\n\
        [winch]\ncommand = \"length\"\nbandwidth = 60.0\nrotor_inertia = 2e-4\ngear_ratio = 10.0\ndrum_radius = 0.05\n\
        [[cable]]\nanchor = [-2.0, 1.5]\nattachment = [-0.1, 0.1]\n\
        [[cable]]\nanchor = [2.0, 1.5]\nattachment = [0.1, 0.1]\ndrum_radius = 0.04\n\
        [[cable]]\nanchor = [2.0, -1.5]\nattachment = [0.1, -0.1]\ngear_ratio = 5.0\n\
        [[cable]]\nanchor = [-2.0, -1.5]\nattachment = [-0.1, -0.1]\nrotor_inertia = 1e-3\n";
    let model = Model::from_toml(text).unwrap();
    let mut simulation = model.simulation().unwrap();
    simulation.advance(20.0).unwrap();
    let plant = simulation.plant();
    let lengths = simulation.inputs().winch_force;
    let found = cdpr::statics::locked_equilibrium(plant, 0.0, &lengths, &[0.0; 3], [0.0; 3]).unwrap();
    let outputs = simulation.outputs();
    for k in 0..3 {
        assert!((outputs.pose[k] - found.pose[k]).abs() < 1e-6, "{:?} {:?}", outputs.pose, found.pose);
    }
    assert!((outputs.winch_angle[1] - lengths[1] / 0.04).abs() < 1e-6);
    let rotor = |i: usize| plant.data().cables[i].drum_mass;
    assert!((rotor(1) - 2e-4 * 250.0_f64.powi(2)).abs() < 1e-9 && (rotor(3) - 1e-3 * 200.0_f64.powi(2)).abs() < 1e-9);
}
