//! Effects against what can be worked out by hand.

use std::sync::Arc;

use cdpr::dynamics::Inputs;
use cdpr::effect::EffectSpec;
use cdpr::parameters::{CableInertia, CableModel, Initialization, Parameters};
use cdpr::plant::Plant;
use cdpr::simulation::{Simulation, Start};

use crate::random::{MODELS, Random, plant, state};

fn effect(id: &str, cable: Option<usize>, values: &[f64]) -> EffectSpec {
    EffectSpec::new(id, cable, values).unwrap()
}

/// A platform that no cable holds: slack cables without mass, on drums so that they have states.
fn free(effects: Vec<EffectSpec>, twist: [f64; 3]) -> Simulation {
    let parameters = Parameters { cable_inertia: CableInertia::None, ..Parameters::default() };
    let mut all = vec![effect("winch_drum_inertia", None, &[50.0])];
    all.extend(effects);
    let plant = Arc::new(Plant::new(parameters, all).unwrap());
    let start = Start { twist, inputs: Inputs::none(4), ..Start::default() };
    let mut simulation = Simulation::new(plant.clone(), &start, 1e-11).unwrap();
    let mut y = simulation.states().to_vec();
    for i in 0..4 {
        y[plant.unstretched_index(i).unwrap()] += 100.0;
        y[plant.rate_index(i).unwrap()] = 0.0;
    }
    simulation.set_states(&y);
    assert_eq!(simulation.slack(), [true; 4]);
    simulation
}

fn run(simulation: &mut Simulation, seconds: f64) {
    let steps = (seconds / 0.1).round() as usize;
    for _ in 0..steps {
        simulation.advance(0.1).unwrap();
    }
}

#[test]
fn quadratic_drag_slows_as_its_closed_form() {
    let (c, m, v) = (80.0, 2500.0, 5.0);
    let mut simulation = free(vec![effect("platform_quadratic_drag", None, &[c, 0.0, 0.0])], [3.0, 4.0, 0.0]);
    run(&mut simulation, 10.0);
    let expected = v / (1.0 + c * v * 10.0 / m);
    let path = m / c * (1.0 + c * v * 10.0 / m).ln();
    let y = simulation.states();
    assert!((y[3] - 0.6 * expected).abs() < 1e-9 && (y[4] - 0.8 * expected).abs() < 1e-9);
    assert!((y[0] - 0.6 * path).abs() < 1e-8);
    // In a wind of the platform's own velocity there is no drag.
    let mut simulation = free(vec![effect("platform_quadratic_drag", None, &[c, 3.0, 4.0])], [3.0, 4.0, 0.0]);
    run(&mut simulation, 5.0);
    assert!((simulation.states()[3] - 3.0).abs() < 1e-12);
}

#[test]
fn linear_drag_and_rotational_damping_decay_exponentially() {
    let mut simulation = free(
        vec![effect("platform_linear_drag", None, &[300.0]), effect("platform_rotational_damping", None, &[4e4])],
        [2.0, -1.0, 0.05],
    );
    run(&mut simulation, 8.0);
    let y = simulation.states();
    assert!((y[3] - 2.0 * (-300.0_f64 * 8.0 / 2500.0).exp()).abs() < 1e-9);
    assert!((y[5] - 0.05 * (-4e4_f64 * 8.0 / 3.5e5).exp()).abs() < 1e-11);
}

#[test]
fn a_gust_moves_a_free_platform_as_integrated_twice() {
    let (a, w, psi, direction) = (500.0, 2.0, 0.7, 0.4_f64);
    let mut simulation = free(vec![effect("periodic_gust", None, &[a, w, psi, direction])], [0.0; 3]);
    run(&mut simulation, 6.0);
    let t = 6.0;
    let path = a / 2500.0 * (t * f64::cos(psi) / w - ((w * t + psi).sin() - psi.sin()) / (w * w));
    let y = simulation.states();
    assert!((y[0] - path * direction.cos()).abs() < 1e-8, "{} {}", y[0], path * direction.cos());
    assert!((y[1] - path * direction.sin()).abs() < 1e-8);
}

#[test]
fn wind_mass_and_inertia_give_the_accelerations_of_newton_and_euler() {
    let simulation = free(
        vec![
            effect("steady_wind", None, &[120.0, -60.0, 900.0]),
            effect("platform_mass", None, &[100.0]),
            effect("platform_inertia", None, &[-5e4]),
        ],
        [0.0; 3],
    );
    let a = simulation.evaluate().acceleration;
    assert!((a[0] - 120.0 / 2600.0).abs() < 1e-15 && (a[1] + 60.0 / 2600.0).abs() < 1e-15);
    assert!((a[2] - 900.0 / 3e5).abs() < 1e-16);
}

#[test]
fn an_umbilical_swings_a_free_platform() {
    let (k, d, m) = (100.0, 50.0, 2500.0);
    let mut simulation = free(vec![effect("umbilical", None, &[k, d, 2.0, -1.0])], [0.0; 3]);
    run(&mut simulation, 5.0);
    let (sigma, w2) = (d / (2.0 * m), k / m);
    let w = f64::sqrt(w2 - sigma * sigma);
    let shape = (-sigma * 5.0_f64).exp() * ((w * 5.0).cos() + sigma / w * (w * 5.0).sin());
    assert!((simulation.states()[0] - 2.0 * (1.0 - shape)).abs() < 1e-9);
    assert!((simulation.states()[1] + 1.0 - shape).abs() < 1e-9);
}

/// The offset against Newton and Euler about the centre of mass, written out on their own.
#[test]
fn an_offset_centre_of_mass_obeys_newton_and_euler() {
    let c = [1.5, -0.8];
    let drums = effect("winch_drum_inertia", None, &[20.0]);
    let plant = plant(CableModel::LumpedMass, CableInertia::None, &[drums, effect("platform_com_offset", None, &c)]);
    let mut random = Random(41);
    for _ in 0..100 {
        let (y, u) = state(&mut random, &plant);
        let e = plant.evaluate(0.0, &y, &u, &[false; 4].into());
        let (sin, cos) = y[2].sin_cos();
        let arm = [cos * c[0] - sin * c[1], sin * c[0] + cos * c[1]];
        let (mut force, mut torque) = ([u.disturbance[0], u.disturbance[1]], u.disturbance[2]);
        torque -= arm[0] * force[1] - arm[1] * force[0]; // the disturbance acts at G
        for i in 0..4 {
            let k = &e.kinematics[i];
            let pull = [-e.tension[i] * k.direction[0], -e.tension[i] * k.direction[1]];
            force[0] += pull[0];
            force[1] += pull[1];
            torque += (k.arm[0] - arm[0]) * pull[1] - (k.arm[1] - arm[1]) * pull[0];
        }
        let turn = torque / 3.5e5;
        let w2 = y[5] * y[5];
        let expected =
            [force[0] / 2500.0 + turn * arm[1] + w2 * arm[0], force[1] / 2500.0 - turn * arm[0] + w2 * arm[1], turn];
        for axis in 0..3 {
            let found = e.acceleration[axis];
            assert!((found - expected[axis]).abs() < 1e-11 * (1.0 + found.abs()), "{axis}: {found} {}", expected[axis]);
        }
    }
}

fn at_rest(effects: &[EffectSpec], force: f64) -> Simulation {
    let inputs = Inputs { winch_force: [force; 4].into(), disturbance: [0.0; 3] };
    let start = Start { inputs, ..Start::default() };
    Simulation::new(plant(CableModel::LumpedMass, CableInertia::Paper, effects), &start, 1e-11).unwrap()
}

/// After a jump by 3 kN the force rises at its limit of 2 kN/s until what is left is what the lag closes by itself, 0.1 s of it.
#[test]
fn a_rate_limit_makes_a_ramp_of_a_step_and_ends_as_a_lag() {
    let mut simulation = at_rest(&[effect("winch_lag", Some(2), &[0.1, 2e3])], 2e4);
    let mut inputs = simulation.inputs();
    for (step, way) in [(3e3, 1.0), (-3e3, -1.0)] {
        let from = inputs.winch_force[1];
        inputs.winch_force[1] += step;
        simulation.set_inputs(inputs);
        for k in 1..=20 {
            simulation.advance(0.1).unwrap();
            let since = 0.1 * f64::from(k);
            let expected = if since <= 1.4 {
                from + way * 2e3 * since
            } else {
                from + step - way * 200.0 * (-(since - 1.4) / 0.1_f64).exp()
            };
            let found = simulation.evaluate().pull[1];
            assert!((found - expected).abs() < 0.5, "{since}: {found} {expected}");
        }
    }
}

/// A step within the band changes nothing; one beyond it is followed to the band, as far behind on the way back.
#[test]
fn a_dead_band_is_play_with_a_lag() {
    let mut simulation = at_rest(&[effect("winch_dead_band", Some(2), &[200.0, 0.1])], 2e4);
    let mut inputs = simulation.inputs();
    let mut from = 2e4;
    for (command, ends) in [(20150.0, 2e4), (19850.0, 2e4), (21e3, 20800.0), (20500.0, 20700.0), (20600.0, 20700.0)] {
        inputs.winch_force[1] = command;
        simulation.set_inputs(inputs);
        for k in 1..=20 {
            simulation.advance(0.1).unwrap();
            let expected = ends + (from - ends) * (-f64::from(k)).exp();
            let found = simulation.evaluate().pull[1];
            assert!((found - expected).abs() < 1e-4, "{command} after {k}: {found} {expected}");
        }
        from = ends + (from - ends) * (-20.0_f64).exp();
    }
}

#[test]
fn a_lag_follows_a_step_exponentially() {
    let mut simulation = at_rest(&[effect("winch_lag", Some(2), &[0.3])], 2e4);
    simulation.set_inputs(Inputs { winch_force: [2.1e4; 4].into(), disturbance: [0.0; 3] });
    for step in 1..=20 {
        simulation.advance(0.07).unwrap();
        let pull = simulation.evaluate().pull;
        let expected = 2.1e4 - 1e3 * (-0.07 * f64::from(step) / 0.3).exp();
        assert!((pull[1] - expected).abs() < 1e-4, "{} {expected}", pull[1]);
        assert_eq!(pull[0], 2.1e4);
    }
}

/// A dead time that is no multiple of the step: the same as changing the inputs at the delayed times.
#[test]
fn a_delay_is_exact() {
    let delay = 0.0337;
    let command = |k: i32| 2e4 + 1500.0 * (0.7 * f64::from(k)).sin();
    let slope = |k: i32| 4000.0 * (0.3 * f64::from(k)).cos();
    let inputs = |force: f64| Inputs { winch_force: [force; 4].into(), disturbance: [0.0; 3] };
    let mut delayed = at_rest(&[effect("winch_delay", None, &[delay])], 2e4);
    for k in 0..100 {
        delayed.set_inputs_with_slopes(inputs(command(k)), inputs(slope(k)));
        delayed.advance(0.01).unwrap();
    }
    let mut shifted = at_rest(&[], 2e4);
    shifted.advance(delay).unwrap();
    for k in 0..100 {
        let left = 1.0 - shifted.time();
        if left <= 0.0 {
            break;
        }
        shifted.set_inputs_with_slopes(inputs(command(k)), inputs(slope(k)));
        shifted.advance(left.min(0.01)).unwrap();
    }
    assert!((shifted.time() - 1.0).abs() < 1e-12 && (delayed.time() - 1.0).abs() < 1e-12);
    for (a, b) in delayed.states().iter().zip(shifted.states()) {
        assert!((a - b).abs() < 1e-9 * (1.0 + a.abs()), "{a} {b}");
    }
    let (a, b) = (delayed.evaluate().pull[0], command(96) + slope(96) * (1.0 - delay - 0.96));
    assert!((a - b).abs() < 1e-6, "{a} {b}");
}

/// The pull (N) of winch 1 with an effect, under a force (N) and at a speed (m/s).
fn pull(spec: EffectSpec, force: f64, speed: f64) -> f64 {
    let plant = plant(CableModel::LumpedMass, CableInertia::Paper, &[spec]);
    let start = Start { inputs: Inputs { winch_force: [force; 4].into(), disturbance: [0.0; 3] }, ..Start::default() };
    let mut y = start.states(&plant).unwrap();
    y[plant.rate_index(0).unwrap()] = speed;
    plant.evaluate(0.0, &y, &start.inputs, &[false; 4].into()).pull[0]
}

#[test]
fn winch_effects_change_the_pull_as_they_say() {
    let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-9 * b.abs(), "{a} {b}");
    near(pull(effect("winch_force_gain", None, &[0.03]), 1e4, 0.0), 1.03e4);
    near(pull(effect("winch_force_bias", None, &[-40.0]), 1e4, 0.0), 9960.0);
    near(pull(effect("winch_saturation", None, &[500.0, 8e3]), 1e4, 0.0), 8e3);
    near(pull(effect("winch_saturation", None, &[500.0, 8e3]), 100.0, 0.0), 500.0);
    near(pull(effect("winch_coulomb_friction", None, &[250.0, 0.01]), 1e4, 0.005), 1e4 + 250.0 * 0.5_f64.tanh());
    near(pull(effect("winch_coulomb_friction", None, &[250.0, 0.01]), 1e4, -30.0), 9750.0);
    // At l̇ = 2 v_s/π the arctangent has turned by an eighth of a circle: half the force.
    let slow = effect("winch_coulomb_friction", None, &[250.0, 0.01, 1.0]);
    near(pull(slow, 1e4, 0.02 / std::f64::consts::PI), 1e4 + 125.0);
    near(pull(effect("winch_viscous_friction", None, &[700.0]), 1e4, -0.5), 9650.0);
    near(pull(effect("pulley_capstan_loss", None, &[0.02, 0.01]), 1e4, 3.0), 1.02e4);
    let stribeck = effect("winch_stribeck_friction", None, &[100.0, 180.0, 0.05, 300.0]);
    near(pull(stribeck.clone(), 1e4, 0.05), 1e4 + (100.0 + 80.0 * (-1.0_f64).exp()) * 10.0_f64.tanh() + 15.0);
    near(pull(stribeck, 1e4, -2.0), 1e4 - 700.0);
}

#[test]
fn a_capstan_takes_energy_from_a_winch_that_pushes_too() {
    let pull = |force: f64, speed: f64| pull(effect("pulley_capstan_loss", None, &[0.02, 0.01]), force, speed);
    for force in [-500.0, 500.0] {
        for speed in [-3.0, 3.0] {
            let lost = (pull(force, speed) - force) * speed;
            assert!((lost - 0.02 * 500.0 * 3.0).abs() < 1e-9, "{force} N at {speed} m/s: {lost} W");
        }
    }
}

/// A loss in proportion to the force takes its share of a force added as an expression, too.
#[test]
fn losses_come_after_added_forces() {
    let loss = effect("pulley_capstan_loss", Some(1), &[0.1, 0.01]);
    let added = EffectSpec::expression("winch[1]", "1000").unwrap();
    let plant = plant(CableModel::LumpedMass, CableInertia::Paper, &[loss, added]);
    let start = Start { inputs: Inputs { winch_force: [1e4; 4].into(), disturbance: [0.0; 3] }, ..Start::default() };
    let mut y = start.states(&plant).unwrap();
    y[plant.rate_index(0).unwrap()] = 5.0;
    let pull = plant.evaluate(0.0, &y, &start.inputs, &[false; 4].into()).pull[0];
    assert!((pull - 12.1e3).abs() < 1e-6, "{pull}");
}

/// At 2 m/s of winding in, 5 kW are 2.5 kN; braking is not limited, nor is a force below.
#[test]
fn a_drive_gives_its_power_and_no_more() {
    let plant = plant(CableModel::LumpedMass, CableInertia::Paper, &[effect("winch_power_limit", None, &[5e3])]);
    let start = Start { inputs: Inputs { winch_force: [1e4; 4].into(), disturbance: [0.0; 3] }, ..Start::default() };
    for (rate, expected) in [(-2.0, 2.5e3), (-0.4, 1e4), (0.0, 1e4), (2.0, 1e4), (-50.0, 100.0)] {
        let mut y = start.states(&plant).unwrap();
        y[plant.rate_index(1).unwrap()] = rate;
        let pull = plant.evaluate(0.0, &y, &start.inputs, &[false; 4].into()).pull;
        assert!((pull[1] - expected).abs() < 1e-9, "{rate} m/s: {}", pull[1]);
        assert_eq!(pull[0], 1e4);
    }
}

#[test]
fn springs_start_carrying_the_whole_pull() {
    let added = EffectSpec::expression("winch[2]", "500").unwrap();
    let gain = effect("winch_force_gain", Some(3), &[0.1]);
    let simulation = at_rest(&[added, gain], 1e4);
    let tension = simulation.outputs().tension;
    for (i, expected) in [1e4, 1.05e4, 1.1e4, 1e4].into_iter().enumerate() {
        assert!((tension[i] - expected).abs() < 1e-5, "{tension:?}");
    }
}

/// The chord, unstretched length and states of cable 1 at rest at the origin under `force` with `spec`.
fn carried(spec: EffectSpec, force: f64) -> (f64, f64) {
    let simulation = at_rest(&[spec], force);
    let e = simulation.evaluate();
    assert!((e.tension[0] - force).abs() < 1e-9 * force, "{} against {force}", e.tension[0]);
    (e.kinematics[0].length, e.unstretched[0])
}

#[test]
fn stiffening_follows_its_cubic() {
    let (chord, length) = carried(effect("cable_stiffening", None, &[2e5]), 3e4);
    let strain = (chord - length) / length;
    assert!((15.2e6 * strain * (1.0 + 2e5 * strain * strain) - 3e4).abs() < 1e-4);
}

/// The sagging cable against the catenary: the parabola is its first term.
#[test]
fn sag_is_that_of_a_shallow_catenary() {
    let (w, tension) = (2.0, 2e4);
    let (chord, length) = carried(effect("cable_sag", None, &[w, 1e9]), tension);
    let arc = 2.0 * tension / w * (w * chord / (2.0 * tension)).sinh();
    let stretched = length * (1.0 + tension / 15.2e6);
    let ratio = w * chord / tension;
    // Next term of the series, and the product of sag and strain.
    let error = ratio.powi(4) / 1920.0 + ratio.powi(2) / 24.0 * (2.0 * tension / 15.2e6 + ratio.powi(2) / 12.0);
    assert!((stretched - arc).abs() < 1.1 * error * chord, "{stretched} {arc}");
    assert!(arc - chord > 100.0 * error * chord, "the sag must be larger than what is left out");
    // Below the reference tension the sag is counted from there.
    let (chord, length) = carried(effect("cable_sag", None, &[w, 2e4]), 2e4);
    assert!(((chord - length) / length - 2e4 / 15.2e6).abs() < 1e-12);
}

/// The catenary is the parabola where it is shallow, and where it is deep its arc is longer than the parabola's.
#[test]
fn a_catenary_is_the_parabola_at_first_and_longer_where_it_is_deep() {
    // What the arc is longer than the parabola's: as good as nothing, and 2.9 % by the next terms of the series.
    for (weight, tension, deep) in [(0.5, 2e4, 0.0), (2.0, 1.2e3, 0.029)] {
        let (chord, hanging) = carried(effect("cable_catenary", None, &[weight]), tension);
        let strain = tension / 15.2e6;
        let arc = 2.0 * tension / weight * (weight * chord / (2.0 * tension)).sinh();
        assert!((hanging - arc).abs() < 1.3 * strain * arc, "{hanging} {arc}");
        let parabola = chord * (1.0 + (weight * chord / tension).powi(2) / 24.0);
        let more = (hanging - chord / (1.0 + strain)) / (parabola - chord) - 1.0;
        assert!((more - deep).abs() < 5.0 * strain + 0.1 * deep, "{weight} N/m: {more}");
    }
}

#[test]
fn warmth_lengthens_the_cable() {
    let spec = effect("cable_thermal_expansion", None, &[2e-4, 100.0, 0.5]);
    let plant = plant(CableModel::LumpedMass, CableInertia::Paper, &[spec]);
    let start = Start { inputs: Inputs { winch_force: [2e4; 4].into(), disturbance: [0.0; 3] }, ..Start::default() };
    let y = start.states(&plant).unwrap();
    for time in [0.0_f64, 20.0, 61.0] {
        let e = plant.evaluate(time, &y, &start.inputs, &[false; 4].into());
        let free = e.unstretched[2] * (1.0 + 2e-4 * (std::f64::consts::TAU * time / 100.0 + 0.5).sin());
        let expected = 15.2e6 * (e.kinematics[2].length - free) / free;
        assert!((e.tension[2] - expected).abs() < 1e-6, "{} {expected}", e.tension[2]);
    }
}

/// The standard linear solid under constant tension: creep strain `T/EA_c (1 - exp(-t/τ))`.
#[test]
fn creep_relaxes_exponentially_under_constant_tension() {
    let (stiffness, tau, force) = (1e8, 4.0, 2e4);
    let mut simulation = at_rest(&[effect("cable_creep", None, &[stiffness, tau])], force);
    let plant = simulation.plant().clone();
    let chord = simulation.evaluate().kinematics[0].length;
    let mut y = simulation.states().to_vec();
    for i in 0..4 {
        y[plant.effect_states(i).start] = 0.0;
        y[plant.unstretched_index(i).unwrap()] = chord / (1.0 + force / 15.2e6);
        // As the winch would already be moving, so that nothing rings.
        let strain_rate = force / stiffness / tau;
        y[plant.rate_index(i).unwrap()] = -chord * strain_rate;
    }
    simulation.set_states(&y);
    for step in 1..=10 {
        simulation.advance(1.0).unwrap();
        let strain = force / stiffness * (1.0 - (-f64::from(step) / tau).exp());
        let y = simulation.states();
        let found = y[plant.effect_states(2).start];
        assert!((found - strain).abs() < 1e-4 * strain, "{found} {strain}");
        let length = chord / (1.0 + force / 15.2e6 + strain);
        assert!((y[plant.unstretched_index(2).unwrap()] - length).abs() < 5e-4, "{step}");
    }
}

/// Given lengths decide the tension, and creep is settled under that one, not under the winch's force.
#[test]
fn creep_is_settled_under_the_tension_of_given_lengths() {
    // The second creeps more than it stretches: taking the tension without creep first would swing ever further.
    for stiffness in [1e8, 2e6] {
        let tau = 4.0;
        let effects = [effect("cable_creep", None, &[stiffness, tau]), effect("cable_stiffening", Some(2), &[50.0])];
        for model in [CableModel::MasslessSpring, CableModel::LumpedMass] {
            let parameters = Parameters { cable_model: model, ..Parameters::default() };
            let plant = Arc::new(Plant::new(parameters, effects.to_vec()).unwrap());
            let inputs = Inputs { winch_force: [900.0; 4].into(), ..Inputs::none(4) };
            let mut start = Start { pose: [3.0, -2.0, 0.05], inputs, ..Start::default() };
            start.unstretched_length =
                Simulation::new(plant.clone(), &start, 1e-8).unwrap().outputs().unstretched_length;
            start.unstretched_length[0] *= 0.999;
            start.unstretched_length[3] *= 1.1;
            start.initialization = Initialization::FromStates;
            let simulation = Simulation::new(plant.clone(), &start, 1e-8).unwrap();
            let y = simulation.states();
            for i in 0..4 {
                let creep = y[plant.effect_states(i).start];
                let chord = simulation.evaluate().kinematics[i].length;
                let strain = (chord - start.unstretched_length[i]) / start.unstretched_length[i] - creep;
                let factor = if i == 1 { 1.0 + 50.0 * strain * strain } else { 1.0 };
                let tension = (15.2e6 * strain * factor).max(0.0);
                assert!((creep * stiffness - tension).abs() < 1e-6 * tension.max(1.0), "{i}: {creep} {tension}");
            }
            let slack = y[plant.effect_states(3).start];
            let taut = y[plant.effect_states(2).start] * stiffness;
            assert!(slack == 0.0 && (taut - 900.0).abs() < 1e-4, "{slack} {taut}");
        }
    }
}

/// The power that air takes from a turning cable is the integral over its length.
#[test]
fn cable_drag_takes_the_power_integrated_along_the_cable() {
    let spec = effect("cable_drag", Some(3), &[0.03]);
    let plant = plant(CableModel::LumpedMass, CableInertia::Paper, &[spec]);
    let mut random = Random(43);
    for _ in 0..20 {
        let (y, u) = state(&mut random, &plant);
        let e = plant.evaluate(0.0, &y, &u, &[false; 4].into());
        let k = &e.kinematics[2];
        let parts = 10_000;
        let ds = k.length / f64::from(parts);
        let integral: f64 = (0..parts)
            .map(|p| 0.5 * 1.225 * 0.03 * (k.angular_rate.abs() * (f64::from(p) + 0.5) * ds).powi(3) * ds)
            .sum();
        let power = plant.power(0.0, &y, &u, &e).effects;
        assert!((power + integral).abs() < 1e-6 * integral, "{power} {integral}");
    }
}

#[test]
fn a_term_as_text_equals_the_effect_in_code() {
    let drag = effect("platform_linear_drag", None, &[75.0]);
    let text = |axis: &str, text: &str| EffectSpec::expression(axis, text).unwrap();
    let written = vec![text("platform.force_x", "-75*vx"), text("platform.force_y", "-75*vy")];
    let run = |effects: Vec<EffectSpec>| {
        let plant = plant(CableModel::LumpedMass, CableInertia::Paper, &effects);
        let start = Start { twist: [3.0, -2.0, 0.02], ..Start::default() };
        let mut simulation = Simulation::new(plant, &start, 1e-10).unwrap();
        for _ in 0..200 {
            simulation.advance(0.05).unwrap();
        }
        simulation.states().to_vec()
    };
    for (a, b) in run(vec![drag]).iter().zip(run(written)) {
        assert!((a - b).abs() < 1e-12 * (1.0 + a.abs()), "{a} {b}");
    }
}

/// In the massless spring tension follows from the winch force and the motion alone (as the paper's equations have it).
#[test]
fn a_massless_spring_moves_as_a_rigid_cable() {
    let friction = effect("winch_coulomb_friction", Some(2), &[200.0, 0.05]);
    let run = |model| {
        let start = Start { pose: [5.0, -8.0, 0.1], twist: [0.5, 0.2, -0.03], ..Start::default() };
        let plant = plant(model, CableInertia::Paper, std::slice::from_ref(&friction));
        let mut simulation = Simulation::new(plant, &start, 1e-11).unwrap();
        for k in 0..300 {
            let t = 0.02 * f64::from(k);
            let force: [f64; 4] = std::array::from_fn(|i| 2e4 + 1e3 * (t + i as f64).sin());
            simulation.set_inputs(Inputs { winch_force: force.into(), disturbance: [50.0 * t.cos(), 0.0, 0.0] });
            simulation.advance(0.02).unwrap();
        }
        simulation
    };
    let [rigid, spring] = [CableModel::Rigid, CableModel::MasslessSpring]
        .map(|m| plant(m, CableInertia::Paper, std::slice::from_ref(&friction)));
    let mut random = Random(45);
    for _ in 0..50 {
        let (y, u) = state(&mut random, &spring);
        let (a, b) =
            (rigid.evaluate(0.0, &y[..6], &u, &[false; 4].into()), spring.evaluate(0.0, &y, &u, &[false; 4].into()));
        assert_eq!((a.acceleration, a.tension), (b.acceleration, b.tension));
    }
    let (rigid, spring) = (run(CableModel::Rigid), run(CableModel::MasslessSpring));
    for k in 0..6 {
        let (a, b) = (rigid.states()[k], spring.states()[k]);
        // The two take different steps.
        assert!((a - b).abs() < 2e-9, "{k}: {a} {b}");
    }
    let (a, b) = (rigid.outputs(), spring.outputs());
    for i in 0..4 {
        assert!((a.tension[i] - b.tension[i]).abs() < 1e-6);
        assert!(a.strain[i] == 0.0 && (b.strain[i] - b.tension[i] / 15.2e6).abs() < 1e-4);
    }
}

#[test]
fn elasticity_as_an_effect_is_the_elastic_model() {
    let elastic = effect("cable_elasticity", None, &[15.2e6, 2e4]);
    let (a, b) =
        (plant(CableModel::Rigid, CableInertia::Paper, &[elastic]), plant(MODELS[2], CableInertia::Paper, &[]));
    let mut random = Random(44);
    let (y, u) = state(&mut random, &a);
    assert_eq!(
        a.evaluate(0.0, &y, &u, &[false; 4].into()).acceleration,
        b.evaluate(0.0, &y, &u, &[false; 4].into()).acceleration
    );
}
