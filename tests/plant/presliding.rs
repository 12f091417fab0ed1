//! Friction that gives like a spring before it slides, against Dahl's closed forms.

use std::f64::consts::TAU;

use cdpr::dynamics::Inputs;
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

/// A law of friction, its parameters by chance within their typical ranges, with presliding.
fn any_friction(random: &mut Random) -> (EffectSpec, [f64; 2]) {
    let id = ["winch_coulomb_friction", "winch_stribeck_friction"][random.within(0.0, 1.99) as usize];
    let info = cdpr::effect::find(id).unwrap();
    let values: Vec<f64> = info
        .parameters
        .iter()
        .map(|p| {
            let (low, high) = p.typical;
            if low > 0.0 { low * (high / low).powf(random.within(0.0, 1.0)) } else { random.within(low, high) }
        })
        .collect();
    let levels = if id == "winch_coulomb_friction" { [values[0]; 2] } else { [values[0], values[1]] };
    (EffectSpec::new(id, Some(1), &values).unwrap(), levels)
}

/// At any speed and whatever the bristle can hold, the work put in is at least what the bristle stores.
#[test]
fn friction_with_presliding_adds_no_energy_within_its_typical_ranges() {
    let mut random = Random(72);
    for _ in 0..20_000 {
        let (spec, levels) = any_friction(&mut random);
        let value = |name: &str| {
            let at = spec.info().unwrap().parameters.iter().position(|p| p.name == name).unwrap();
            spec.values[at]
        };
        let bristle = Bristle::new(&spec);
        let speed = random.within(0.0, 1.0).powi(4) * [-3.0, 3.0][random.within(0.0, 1.99) as usize];
        // The levels of the direction from which it was bent.
        let direction = [-1.0, 1.0][random.within(0.0, 1.99) as usize];
        let highest = levels[0].max(levels[1]) * (1.0 + direction * value("asymmetry"));
        let held = direction * highest * random.within(0.0, 1.0);
        let (pull, rate) = bristle.at(speed, held / value("presliding_stiffness"));
        let (put_in, stored) = (pull * speed, held * rate);
        assert!(put_in - stored >= -1e-9 * (put_in.abs() + stored.abs()), "{spec:?} {speed} {held}: {put_in} {stored}");
    }
}

/// In steady sliding the bristle leaves the level of the law, in each direction its own.
#[test]
fn steady_sliding_has_the_level_of_its_direction() {
    let laws = [
        ("winch_coulomb_friction", vec![FORCE, 0.01, 0.3, 0.4]),
        ("winch_stribeck_friction", vec![100.0, 180.0, 0.05, 300.0, 0.004]),
    ];
    for (id, values) in laws {
        let of = |sizes: [f64; 4]| {
            EffectSpec::new(id, Some(1), &[&values[..], &sizes].concat()).map(|spec| EffectKind::new(&spec).unwrap())
        };
        let plain = of([0.0, 0.0, 0.0, 0.2]).unwrap();
        assert_eq!(plain.states(), 0);
        for speed in [-9.0_f64, -0.3, -0.01, -1e-4, 1e-7, 2e-3, 0.07, 2.0, 9.0] {
            let (viscous, dry) = match id {
                "winch_coulomb_friction" => (0.0, FORCE),
                _ => (300.0 * speed, 100.0 + 80.0 * (-(speed / 0.05).powi(2)).exp()),
            };
            let level = dry * if speed > 0.0 { 1.2 } else { -0.8 };
            for stiffness in [1e3, 1e5, 1e8] {
                let bristle = Bristle { law: of([stiffness, 500.0, 0.1, 0.2]).unwrap(), deflection: 0.0 };
                let (pull, rate) = bristle.at(speed, level / stiffness);
                assert!(rate.abs() < 1e-12 * speed.abs(), "{id} {speed}: {rate}");
                assert!((pull - level - viscous).abs() < 1e-9 * FORCE, "{id} {speed}: {pull} {level}");
            }
            // The smooth law without presliding is the same once it has turned.
            if speed.abs() > 5.0 {
                let law = plain.loss(0.0, &WinchContext { time: 0.0, speed });
                assert!((law - level - viscous).abs() < 1e-3 * FORCE, "{id} {speed}: {law} {level}");
            }
        }
    }
}

/// In motion with a stiff bristle the whole plant moves as with a sharp static law.
#[test]
fn a_stiff_bristle_moves_as_sharp_friction_does() {
    let end = |presliding: [f64; 3]| {
        let plant = plant(CableModel::LumpedMass, CableInertia::Paper, &[coulomb(presliding, 1e-7)]);
        let start = Start { pose: [5.0, -8.0, 0.1], twist: [0.5, 0.2, -0.03], ..Start::default() };
        let mut simulation = Simulation::new(plant, &start, 1e-9).unwrap();
        for _ in 0..20 {
            simulation.advance(0.1).unwrap();
        }
        simulation.outputs().pose
    };
    let (stiff, sharp) = (end([1e9, 0.0, 0.0]), end([0.0; 3]));
    let soft = end([1e3, 0.0, 0.0]);
    for k in 0..2 {
        assert!((stiff[k] - sharp[k]).abs() < 1e-6, "{stiff:?} {sharp:?}");
        assert!((soft[k] - sharp[k]).abs() > 1e-4, "{soft:?} {sharp:?}");
    }
}

/// Winches that begin to pull more, by less than their friction: Dahl's friction gives like a spring and then holds.
#[test]
fn what_friction_holds_at_rest_it_holds_for_ever() {
    let (friction, stiffness, more) = (250.0, 1e5, 100.0);
    // The damping keeps the cables from ringing, under which friction gives a little at every swing.
    let values = [friction, 0.01, 0.0, 0.0, stiffness, 5e3];
    let spec = EffectSpec::new("winch_coulomb_friction", None, &values).unwrap();
    let plant = plant(CableModel::LumpedMass, CableInertia::Paper, &[spec]);
    let start = Start::default();
    let mut simulation = Simulation::new(plant.clone(), &start, 1e-9).unwrap();
    // At rest in the middle the platform stays, so each cable is a spring to a wall.
    let length = simulation.outputs().cable_length[0];
    let paid_out = simulation.outputs().unstretched_length[0];
    simulation.set_inputs_with_slopes(Inputs::pulling(4, 1e3), Inputs::pulling(4, more / 20.0));
    simulation.advance(20.0).unwrap();
    simulation.set_inputs(Inputs::pulling(4, 1e3 + more));
    let axial = plant.data().cables[0].axial_stiffness;
    let carried = |wound_in: f64| axial * (length / (paid_out - wound_in) - 1.0);
    // Force balance of the winch after a way: friction F_c (1 - exp(-σ₀ x/F_c)) holds what the cable does not carry.
    let (mut low, mut high) = (0.0, 0.1);
    for _ in 0..100 {
        let way = 0.5 * (low + high);
        let held = friction * (1.0 - (-stiffness * way / friction).exp());
        if carried(way) + held < 1e3 + more { low = way } else { high = way }
    }
    for time in [60.0, 200.0] {
        simulation.advance(time - simulation.time()).unwrap();
        for tension in simulation.outputs().tension.iter() {
            assert!((tension - carried(low)).abs() < 0.1, "at {time} s: {tension} N, {} N", carried(low));
        }
    }
    assert!((carried(low) - 1017.0).abs() < 0.1, "{}", carried(low));
}

#[test]
fn presliding_needs_a_force() {
    let error = EffectSpec::new("winch_coulomb_friction", None, &[0.0, 0.01, 0.0, 0.0, 1e4]).unwrap_err();
    assert!(error.to_string().contains("presliding_stiffness"), "{error}");
}
