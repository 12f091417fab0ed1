//! Hysteresis of cables against its closed forms.

use std::f64::consts::TAU;
use std::sync::Arc;

use cdpr::dynamics::Inputs;
use cdpr::effect::{EffectKind, EffectSpec, StrainContext};
use cdpr::parameters::{CableInertia, CableModel, Parameters};
use cdpr::plant::Plant;
use cdpr::simulation::{Simulation, Start};

use crate::random::{Random, plant};

const FORCE: f64 = 120.0;
const YIELD: f64 = 3e-4;

fn hysteresis(cable: Option<usize>) -> EffectSpec {
    EffectSpec::new("cable_hysteresis", cable, &[FORCE, YIELD]).unwrap()
}

/// One cable under a prescribed strain.
struct Rope {
    law: EffectKind,
    state: f64,
}

impl Rope {
    fn new() -> Self {
        let law = EffectKind::new(&hysteresis(Some(1))).unwrap();
        assert_eq!(law.states(), 1);
        Self { law, state: 0.0 }
    }

    fn held(&self) -> f64 {
        self.law.held_tension(&[self.state])
    }

    fn rate(&self, strain_rate: f64, state: f64) -> f64 {
        let mut rate = [0.0];
        self.law.strain_rates(&StrainContext { tension: 1e4, strain_rate }, &[state], &mut rate);
        rate[0]
    }

    /// Strains it at `speed(t)` (1/s) by classical Runge-Kutta steps; the work per length (N).
    fn strain(&mut self, speed: impl Fn(f64) -> f64, from: f64, seconds: f64, steps: usize) -> f64 {
        let h = seconds / steps as f64;
        let mut work = 0.0;
        for k in 0..steps {
            let t = from + h * k as f64;
            let speeds = [speed(t), speed(t + 0.5 * h), speed(t + h)];
            let before = self.held() * speeds[0];
            let a = self.rate(speeds[0], self.state);
            let b = self.rate(speeds[1], self.state + 0.5 * h * a);
            let half = self.law.held_tension(&[self.state + 0.5 * h * b]) * speeds[1];
            let c = self.rate(speeds[1], self.state + 0.5 * h * b);
            let d = self.rate(speeds[2], self.state + h * c);
            self.state += h / 6.0 * (a + 2.0 * b + 2.0 * c + d);
            work += h / 6.0 * (before + 4.0 * half + self.held() * speeds[2]);
        }
        work
    }
}

/// Between strains ±a a cycle takes 4 F ε_y (a/ε_y - tanh(a/ε_y)) per length, however fast.
#[test]
fn a_closed_cycle_takes_what_the_closed_form_says() {
    for amplitude in [0.2 * YIELD, YIELD, 6.0 * YIELD] {
        for period in [0.1, 30.0] {
            let mut rope = Rope::new();
            let speed = |t: f64| amplitude * TAU / period * (TAU * t / period).cos();
            rope.strain(speed, 0.0, 20.25 * period, 40_500);
            let ratio = amplitude / YIELD;
            assert!((rope.held() - FORCE * ratio.tanh()).abs() < 1e-4 * FORCE, "{} {amplitude}", rope.held());
            let work = rope.strain(speed, 20.25 * period, period, 4000);
            let area = 4.0 * FORCE * YIELD * (ratio - ratio.tanh());
            assert!(area > 0.0 && (work - area).abs() < 1e-4 * area, "{amplitude} {period}: {work} {area}");
        }
    }
}

/// A small strain meets a spring F/ε_y, a large one the level F against it, whichever way.
#[test]
fn it_is_a_spring_at_first_and_then_a_level() {
    for way in [1.0, -1.0] {
        let strained = |strain: f64| {
            let mut rope = Rope::new();
            rope.strain(|_| way * strain, 0.0, 1.0, 2000);
            rope.held()
        };
        let small = 1e-3 * YIELD;
        assert!((strained(small) - way * FORCE / YIELD * small).abs() < 1e-3 * FORCE / YIELD * small);
        assert!((strained(20.0 * YIELD) - way * FORCE).abs() < 1e-6 * FORCE);
    }
}

/// What is put in is never less than what the rope stores.
#[test]
fn no_energy_is_made() {
    let mut random = Random(73);
    for _ in 0..20 {
        let waves: [[f64; 3]; 3] =
            std::array::from_fn(|_| [random.within(0.0, 0.02), random.within(0.5, 20.0), random.within(0.0, TAU)]);
        let speed = |t: f64| waves.iter().map(|[a, w, p]| a * (w * t + p).sin()).sum::<f64>();
        let (mut rope, mut work) = (Rope::new(), 0.0);
        for k in 0..400 {
            work += rope.strain(speed, 0.01 * f64::from(k), 0.01, 100);
            let stored = 0.5 * FORCE * YIELD * rope.state.powi(2);
            assert!(work >= stored - 1e-9 * FORCE, "{work} {stored}");
        }
        assert!(work > 0.0);
    }
}

/// Undamped cables on winches that cannot move: the platform swings, and only the hysteresis takes energy.
#[test]
fn a_swinging_platform_loses_energy_to_it_at_every_moment() {
    let parameters = Parameters { cable_inertia: CableInertia::None, cable_damping: 0.0, ..Parameters::default() };
    let locked = EffectSpec::new("winch_drum_inertia", None, &[1e15]).unwrap();
    let plant = Arc::new(Plant::new(parameters, vec![locked, hysteresis(None)]).unwrap());
    let start = Start { inputs: Inputs::pulling(4, 2e4), twist: [0.15, -0.1, 0.004], ..Start::default() };
    let mut simulation = Simulation::new(plant.clone(), &start, 1e-9).unwrap();
    let mut y = simulation.states().to_vec();
    (0..4).for_each(|i| y[plant.rate_index(i).unwrap()] = 0.0);
    simulation.set_states(&y);
    let axial = plant.data().cables[0].axial_stiffness;
    let energy = |s: &Simulation| {
        let (y, e) = (s.states(), s.evaluate());
        let cable = |i: usize| {
            let (length, state) = (y[plant.unstretched_index(i).unwrap()], y[plant.effect_states(i).start]);
            let strain = (e.kinematics[i].length - length) / length;
            0.5 * length * (axial * strain * strain + FORCE * YIELD * state * state)
        };
        plant.energy(y, &s.slack()).platform
            + plant.energy(y, &s.slack()).cables_across
            + (0..4).map(cable).sum::<f64>()
    };
    let first = energy(&simulation);
    let (at_first, mut before) = (plant.energy(simulation.states(), &simulation.slack()).platform, first);
    for k in 0..400 {
        simulation.advance(0.05).unwrap();
        let now = energy(&simulation);
        assert!(now < before + 1e-7 * at_first, "{k}: {before} {now}");
        before = now;
    }
    assert!(first - before > 0.1 * at_first, "{at_first} J at first, {} J taken", first - before);
}

#[test]
fn tension_and_length_are_inverses_beside_what_is_held() {
    let effects = [hysteresis(Some(1)), EffectSpec::new("cable_stiffening", None, &[2e4]).unwrap()];
    let plant = plant(CableModel::LumpedMass, CableInertia::Paper, &effects);
    for state in [-0.9, 0.0, 0.6] {
        let mut states = [0.0; 8];
        states[0] = state;
        let length = plant.unstretched_length_for(0, 0.0, 640.0, 2e4, &states);
        assert!((plant.tension_for(0, 0.0, 640.0, length, &states) - 2e4).abs() < 1e-6);
        let without = plant.tension_for(0, 0.0, 640.0, length, &[0.0; 8]);
        assert!((without + FORCE * state - 2e4).abs() < 1e-6, "{without}");
    }
}

/// While a cable is slack nothing strains it: it is taut again at the length at which it went slack.
#[test]
fn a_slack_cable_keeps_its_state() {
    let plant = plant(CableModel::LumpedMass, CableInertia::Paper, &[hysteresis(None)]);
    let (mut y, u) = crate::random::state(&mut Random(9), &plant);
    y[plant.effect_states(1).start] = -0.4;
    let rate = |slack: bool| plant.evaluate(0.0, &y, &u, &[false, slack, false, false].into()).effect_rate[1][0];
    assert_eq!(rate(true), 0.0);
    assert!(rate(false) != 0.0);
}
