//! The cables' own motion and mass against what can be worked out by hand.

use std::sync::Arc;

use cdpr::dynamics::Inputs;
use cdpr::effect::EffectSpec;
use cdpr::parameters::{CableInertia, CableModel, Parameters};
use cdpr::plant::Plant;
use cdpr::simulation::{Simulation, Start};

use crate::random::{Random, plant, state};

fn effect(id: &str, cable: Option<usize>, values: &[f64]) -> EffectSpec {
    EffectSpec::new(id, cable, values).unwrap()
}

/// Robots whose winches and platform hardly move, with tensions near 20 kN.
fn held(effects: &[EffectSpec], platform: f64) -> Simulation {
    let parameters = Parameters {
        cable_inertia: CableInertia::None,
        cable_damping: 0.0,
        platform_mass: 2500.0 * platform,
        platform_inertia: 3.5e5 * platform,
        ..Parameters::default()
    };
    let mut all = vec![effect("winch_drum_inertia", None, &[1e15])];
    all.extend_from_slice(effects);
    let plant = Arc::new(Plant::new(parameters, all).unwrap());
    let inputs = Inputs { winch_force: [2e4, 2.1e4, 1.9e4, 2e4].into(), ..Inputs::none(4) };
    let start = Start { pose: [30.0, -20.0, 0.05], inputs, ..Start::default() };
    let mut simulation = Simulation::new(plant, &start, 1e-11).unwrap();
    simulation.set_inputs(Inputs::none(4));
    simulation
}

#[test]
fn a_cable_between_held_ends_swings_at_the_frequency_of_a_string() {
    let (m, zeta) = (0.3, 0.05);
    for damping in [0.0, zeta] {
        let mut simulation = held(&[effect("cable_transverse_mode", Some(2), &[m, 0.0, damping])], 1e9);
        let first = simulation.plant().effect_states(1).start;
        let mut y = simulation.states().to_vec();
        y[first] = 1e-3;
        simulation.set_states(&y);
        let e = simulation.evaluate();
        let omega = std::f64::consts::PI / e.kinematics[1].length * (e.tension[1] / m).sqrt();
        let damped = omega * (1.0 - damping * damping).sqrt();
        for _ in 0..40 {
            simulation.advance(0.5).unwrap();
            let t = simulation.time();
            let ratio = damping * omega / damped;
            let expected = 1e-3 * (-damping * omega * t).exp() * ((damped * t).cos() + ratio * (damped * t).sin());
            let found = simulation.states()[first];
            assert!((found - expected).abs() < 2e-9, "t = {t}: {found} {expected}");
        }
    }
}

/// What the platform gives, the cables swing with: elastic energy, bow included, and motion keep their sum.
#[test]
fn a_swinging_cable_keeps_its_energy() {
    let mut simulation = held(&[effect("cable_transverse_mode", None, &[0.215, 0.0, 0.0])], 1.0);
    let mut y = simulation.states().to_vec();
    y[3..6].copy_from_slice(&[0.3, -0.2, 0.005]);
    simulation.plant().straighten(&mut y);
    simulation.set_states(&y);
    let plant = simulation.plant().clone();
    let stored = |s: &Simulation| {
        let (y, e) = (s.states(), s.evaluate());
        (0..4)
            .map(|i| {
                let q = y[plant.effect_states(i).start];
                let l = y[plant.unstretched_index(i).unwrap()];
                let chord = e.kinematics[i].length;
                let bow = std::f64::consts::PI.powi(2) * q * q / (4.0 * chord);
                0.5 * plant.data().cables[i].axial_stiffness * (chord + bow - l).powi(2) / l
            })
            .sum::<f64>()
    };
    let all = |s: &Simulation| plant.energy(s.states(), &[false; 4].into()).total() + stored(s);
    let before = all(&simulation);
    let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
    for _ in 0..400 {
        simulation.advance(0.05).unwrap();
        let swinging = plant.energy(simulation.states(), &[false; 4].into()).cables_across;
        (least, most) = (least.min(swinging), most.max(swinging));
        // The bow pulls at the platform along the cable by a thousandth of a thousandth of the tension, which is left out.
        let drift = all(&simulation) - before;
        assert!(drift.abs() < 2e-3 * most, "{drift} J of {most} J");
    }
    assert!(most > 5.0 && least < 0.1 * most, "{least} {most}");
}

/// In slow motion the mode gives back to the platform what it took of the straight cable's inertia.
#[test]
fn a_cable_in_slow_motion_is_as_heavy_as_a_straight_one() {
    let density = Parameters::default().cable_density;
    let mode = effect("cable_transverse_mode", None, &[density, 0.03, 0.02]);
    let [straight, swinging] = [vec![], vec![mode]].map(|e| plant(CableModel::LumpedMass, CableInertia::Paper, &e));
    let inputs = Inputs { winch_force: [2e4; 4].into(), ..Inputs::none(4) };
    let start = Start { inputs, ..Start::default() };
    let disturbed = Inputs { disturbance: [8.0, -5.0, 40.0], ..inputs };
    let y = start.states(&straight).unwrap();
    let e = straight.evaluate(0.0, &y, &disturbed, &[false; 4].into());
    let pose = [y[0], y[1], y[2]];
    let (_, turning) = cdpr::kinematics::accelerations(straight.geometry(), &pose, &[0.0; 3], &e.acceleration);
    let mut bowed = start.states(&swinging).unwrap();
    for i in 0..4 {
        let length = e.kinematics[i].length;
        let omega_square = std::f64::consts::PI.powi(2) * e.tension[i] / (density * length * length);
        bowed[swinging.effect_states(i).start] = -std::f64::consts::FRAC_2_PI * length * turning[i] / omega_square;
    }
    let found = swinging.evaluate(0.0, &bowed, &disturbed, &[false; 4].into()).acceleration;
    for (a, b) in found.iter().zip(&e.acceleration) {
        assert!((a - b).abs() < 1e-4 * b.abs(), "{found:?} {:?}", e.acceleration);
    }
}

/// The power that air takes from a turning and bowing cable is the integral over its length.
#[test]
fn drag_of_a_swinging_cable_takes_the_power_integrated_along_it() {
    let spec = effect("cable_transverse_mode", Some(3), &[0.215, 0.03, 0.0]);
    let plant = plant(CableModel::LumpedMass, CableInertia::Paper, &[spec]);
    let mut random = Random(44);
    for _ in 0..20 {
        let (mut y, u) = state(&mut random, &plant);
        let first = plant.effect_states(2).start;
        (y[first], y[first + 1]) = (0.0, random.within(-8.0, 8.0));
        let e = plant.evaluate(0.0, &y, &u, &[false; 4].into());
        let k = &e.kinematics[2];
        let end = k.length * k.angular_rate;
        let bow = y[first + 1] - std::f64::consts::FRAC_2_PI * end;
        let parts = 10_000;
        let integral: f64 = (0..parts)
            .map(|p| (f64::from(p) + 0.5) / f64::from(parts))
            .map(|s| 0.5 * 1.225 * 0.03 * (end * s + bow * (std::f64::consts::PI * s).sin()).abs().powi(3))
            .sum::<f64>()
            * k.length
            / f64::from(parts);
        // Elsewhere the cable only hands energy to and fro: its own and the platform's work cancel where nothing is bent.
        let power = plant.power(0.0, &y, &u, &e).effects - 0.25 * 0.215 * k.speed * y[first + 1].powi(2);
        assert!((power + integral).abs() < 0.02 * integral, "{power} {integral}");
    }
}

/// Half of the cable's mass at its end: Newton's and Euler's law with these masses along the cables.
#[test]
fn axial_mass_moves_with_the_platform_along_the_cables_only() {
    let drums = effect("winch_drum_inertia", None, &[50.0]);
    let mass = effect("cable_axial_mass", None, &[0.4]);
    let [plain, heavy] =
        [vec![drums.clone()], vec![drums, mass]].map(|e| plant(CableModel::LumpedMass, CableInertia::None, &e));
    let inputs = Inputs { winch_force: [2e4; 4].into(), ..Inputs::none(4) };
    let start = Start { pose: [30.0, -20.0, 0.05], inputs, ..Start::default() };
    let y = start.states(&plain).unwrap();
    let disturbed = Inputs { disturbance: [300.0, -500.0, 4e3], ..inputs };
    let [light, slow] = [plain, heavy].map(|p| p.evaluate(0.0, &y, &disturbed, &[false; 4].into()));
    let mut wrench = [2500.0 * slow.acceleration[0], 2500.0 * slow.acceleration[1], 3.5e5 * slow.acceleration[2]];
    for k in &slow.kinematics {
        let row = k.jacobian_row();
        let along: f64 = row.iter().zip(&slow.acceleration).map(|(r, a)| r * a).sum();
        for (sum, r) in wrench.iter_mut().zip(row) {
            *sum += 0.2 * k.length * along * r;
        }
    }
    let expected = [2500.0 * light.acceleration[0], 2500.0 * light.acceleration[1], 3.5e5 * light.acceleration[2]];
    for (found, expected) in wrench.iter().zip(expected) {
        assert!((found - expected).abs() < 1e-8 * expected.abs(), "{wrench:?} {expected:?}");
    }
}
