//! Friction that gives like a spring before it slides, against Dahl's closed forms.

use std::f64::consts::TAU;

use cdpr::effect::{EffectKind, EffectSpec, WinchContext};
use cdpr::parameters::{CableInertia, CableModel};
use cdpr::simulation::{Simulation, Start};

use crate::random::{Random, plant};

const FORCE: f64 = 200.0;
const STIFFNESS: f64 = 4e4;
/// So sharp that the force turns its sign within no speed that is met.
const SHARP: f64 = 1e-9;

fn coulomb(presliding: [f64; 3], transition_speed: f64) -> EffectSpec {
    let [stiffness, damping, damping_speed] = presliding;
    let values = [FORCE, transition_speed, 0.0, 0.0, stiffness, damping, damping_speed];
    EffectSpec::new("winch_coulomb_friction", Some(2), &values).unwrap()
}

/// One friction under a prescribed motion of its winch.
struct Bristle {
    law: EffectKind,
    deflection: f64,
}

impl Bristle {
    fn new(spec: &EffectSpec) -> Self {
        let law = EffectKind::new(spec).unwrap();
        assert_eq!(law.states(), 1);
        Self { law, deflection: 0.0 }
    }

    /// The pull (N) and the rate of the deflection (m/s) at a speed (m/s).
    fn at(&self, speed: f64, deflection: f64) -> (f64, f64) {
        let mut rate = [0.0];
        let pull = self.law.loss_in(0.0, &[deflection], &mut rate, &WinchContext { time: 0.0, speed });
        (pull, rate[0])
    }

    /// Moves over `seconds` at `speed(t)` by classical Runge-Kutta steps; the work done on it (J).
    fn advance(&mut self, speed: impl Fn(f64) -> f64, from: f64, seconds: f64, steps: usize) -> f64 {
        let h = seconds / steps as f64;
        let mut work = 0.0;
        for k in 0..steps {
            let t = from + h * k as f64;
            let (before, a) = self.at(speed(t), self.deflection);
            let (half, b) = self.at(speed(t + 0.5 * h), self.deflection + 0.5 * h * a);
            let (_, c) = self.at(speed(t + 0.5 * h), self.deflection + 0.5 * h * b);
            let (_, d) = self.at(speed(t + h), self.deflection + h * c);
            self.deflection += h / 6.0 * (a + 2.0 * b + 2.0 * c + d);
            let (after, _) = self.at(speed(t + h), self.deflection);
            work += h / 6.0 * (before * speed(t) + 4.0 * half * speed(t + 0.5 * h) + after * speed(t + h));
        }
        work
    }

    fn pull(&self, speed: f64) -> f64 {
        self.at(speed, self.deflection).0
    }
}

/// From rest in one direction `F = F_c (1 - exp(-σ₀ x/F_c))`, however fast.
#[test]
fn force_rises_exponentially_with_displacement() {
    let spec = coulomb([STIFFNESS, 0.0, 0.0], SHARP);
    for (travel, seconds) in [(1e-4, 0.1), (4e-3, 3.0), (0.05, 0.7)] {
        let mut bristle = Bristle::new(&spec);
        let speed = |t: f64| 2.0 * travel * t / (seconds * seconds);
        bristle.advance(speed, 0.0, seconds, 4000);
        let expected = FORCE * (1.0 - (-STIFFNESS * travel / FORCE).exp());
        assert!((bristle.pull(0.0) - expected).abs() < 1e-6 * FORCE, "{travel}: {}", bristle.pull(0.0));
    }
}

/// Between reversals at ±X the loop closes, with the force `F_c tanh(σ₀ X/F_c)` at its ends.
#[test]
fn the_hysteresis_loop_closes() {
    let amplitude = 4e-3;
    let mut bristle = Bristle::new(&coulomb([STIFFNESS, 0.0, 0.0], SHARP));
    let speed = |t: f64| amplitude * TAU * (TAU * t).cos();
    bristle.advance(speed, 0.0, 10.25, 20_500);
    let end = FORCE * (STIFFNESS * amplitude / FORCE).tanh();
    assert!((bristle.pull(0.0) - end).abs() < 1e-4 * FORCE, "{} {end}", bristle.pull(0.0));
    // On the way back the force falls along the exponential of the way made since the reversal.
    bristle.advance(speed, 10.25, 0.25, 500);
    let halfway = -FORCE + (FORCE + end) * (-STIFFNESS * amplitude / FORCE).exp();
    assert!((bristle.pull(0.0) - halfway).abs() < 1e-4 * FORCE, "{} {halfway}", bristle.pull(0.0));
    let work = bristle.advance(speed, 10.5, 1.0, 2000);
    let rise = 1.0 - (-2.0 * STIFFNESS * amplitude / FORCE).exp();
    // The area between the two branches, by integration of the exponentials.
    let area = 2.0 * FORCE * 2.0 * amplitude - 2.0 * (FORCE + end) * FORCE / STIFFNESS * rise;
    assert!((work - area).abs() < 1e-3 * area, "{work} {area}");
}

/// What is put in is never less than what the spring holds.
#[test]
fn no_energy_is_made() {
    let mut random = Random(71);
    for _ in 0..20 {
        let damping = [random.within(0.0, 5e3), random.within(0.0, 0.1)];
        let mut bristle = Bristle::new(&coulomb([STIFFNESS, damping[0], damping[1]], SHARP));
        let waves: [[f64; 3]; 3] =
            std::array::from_fn(|_| [random.within(0.0, 0.02), random.within(0.5, 20.0), random.within(0.0, TAU)]);
        let speed = |t: f64| waves.iter().map(|[a, w, p]| a * (w * t + p).sin()).sum::<f64>();
        let mut work = 0.0;
        for k in 0..400 {
            work += bristle.advance(speed, 0.01 * f64::from(k), 0.01, 100);
            let stored = 0.5 * STIFFNESS * bristle.deflection.powi(2);
            assert!(work >= stored - 1e-6, "{damping:?} {work} {stored}");
        }
        assert!(work > 0.0);
    }
}

/// A bristle that does not bend leaves the static law, and in steady sliding any bristle does.
#[test]
fn without_presliding_the_static_law_is_left() {
    let laws = [
        ("winch_coulomb_friction", vec![FORCE, 0.01, 0.3, 0.4]),
        ("winch_stribeck_friction", vec![100.0, 180.0, 0.05, 300.0, 0.004]),
    ];
    for (id, values) in laws {
        let of = |presliding: [f64; 3]| {
            EffectSpec::new(id, Some(1), &[&values[..], &presliding].concat())
                .map(|spec| EffectKind::new(&spec).unwrap())
        };
        let plain = of([0.0; 3]).unwrap();
        assert_eq!(plain.states(), 0);
        let context = |speed| WinchContext { time: 0.0, speed };
        for speed in [-0.3, -0.01, -1e-4, 1e-7, 2e-3, 0.07, 2.0] {
            let law = plain.loss(0.0, &context(speed));
            for stiffness in [1e3, 1e5, 1e8] {
                let bristle = Bristle { law: of([stiffness, 500.0, 0.1]).unwrap(), deflection: 0.0 };
                let viscous = if id == "winch_stribeck_friction" { 300.0 * speed } else { 0.0 };
                let (pull, rate) = bristle.at(speed, (law - viscous) / stiffness);
                assert!(rate.abs() < 1e-12 * speed.abs() && (pull - law).abs() < 1e-9 * FORCE, "{id} {speed}: {rate}");
            }
        }
    }
    // In motion with a stiff bristle the whole plant moves as with the static law.
    let end = |presliding: [f64; 3]| {
        let plant = plant(CableModel::LumpedMass, CableInertia::Paper, &[coulomb(presliding, 0.05)]);
        let start = Start { pose: [5.0, -8.0, 0.1], twist: [0.5, 0.2, -0.03], ..Start::default() };
        let mut simulation = Simulation::new(plant, &start, 1e-9).unwrap();
        for _ in 0..20 {
            simulation.advance(0.1).unwrap();
        }
        simulation.outputs().pose
    };
    let (stiff, plain) = (end([1e9, 0.0, 0.0]), end([0.0; 3]));
    let soft = end([1e3, 0.0, 0.0]);
    for k in 0..2 {
        assert!((stiff[k] - plain[k]).abs() < 1e-6, "{stiff:?} {plain:?}");
        assert!((soft[k] - plain[k]).abs() > 1e-4, "{soft:?} {plain:?}");
    }
}

#[test]
fn presliding_needs_a_force() {
    let error = EffectSpec::new("winch_coulomb_friction", None, &[0.0, 0.01, 0.0, 0.0, 1e4]).unwrap_err();
    assert!(error.to_string().contains("presliding_stiffness"), "{error}");
}
