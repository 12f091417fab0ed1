//! The structured Newton matrix against a dense one.

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;
use num_dual::Dual64;

use super::{Factors, Inputs, Jacobian, Linearisation};
use crate::effect::{CATALOGUE, EffectSpec};
use crate::kinematics;
use crate::parameters::{CableDamper, CableInertia, CableModel, Parameters};
use crate::per_cable::PerCable;
use crate::plant::Plant;

/// Numbers from -1 to 1 by a multiplicative generator (S. K. Park, K. W. Miller, CACM 31 (1988)).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0 * 48_271 % 2_147_483_647;
        2.0 * self.0 as f64 / 2_147_483_647.0 - 1.0
    }
}

fn state(random: &mut Random, plant: &Plant, speed: f64) -> (Vec<f64>, Inputs) {
    let mut y = vec![0.0; plant.dimension()];
    for (k, size) in [100.0, 100.0, 0.3, 3.0 * speed, 3.0 * speed, 0.2 * speed].into_iter().enumerate() {
        y[k] = size * random.next();
    }
    let cables = kinematics::cables(plant.geometry(), &[y[0], y[1], y[2]], &[y[3], y[4], y[5]]);
    for i in 0..4 {
        if let Some(at) = plant.unstretched_index(i) {
            y[at] = cables[i].length / (1.0 + 1.5e-3 + 5e-4 * random.next());
        }
        if let Some(at) = plant.rate_index(i) {
            y[at] = cables[i].speed + 0.02 * speed * random.next();
        }
        // Draws of their own: another effect in the catalogue does not change the rest.
        let mut own = Random(random.0);
        for at in plant.effect_states(i) {
            y[at] = 1e-4 * (1.0 + own.next());
        }
    }
    let winch_force = PerCable::from_fn(4, |_| 2e4 + 5e3 * random.next());
    (y, Inputs { winch_force, disturbance: std::array::from_fn(|_| 300.0 * random.next()) })
}

fn jacobian(plant: &Plant, time: f64, y: &[f64], u: &Inputs, slack: &PerCable<bool>) -> DMatrix<f64> {
    let n = y.len();
    let mut out = DMatrix::zeros(n, n);
    let mut rates = vec![Dual64::from(0.0); n];
    for column in 0..n {
        let seeded: Vec<Dual64> =
            y.iter().enumerate().map(|(k, v)| Dual64::new(*v, f64::from(u8::from(k == column)))).collect();
        plant.rates(Dual64::from(time), &seeded, &u.lift(), slack, &mut rates);
        for row in 0..n {
            out[(row, column)] = rates[row].eps;
        }
    }
    out
}

/// `∂f/∂u` by dual numbers: disturbance, then winch forces.
fn jacobian_of_inputs(plant: &Plant, time: f64, y: &[f64], u: &Inputs, slack: &PerCable<bool>) -> DMatrix<f64> {
    let n = y.len();
    let states: Vec<Dual64> = y.iter().map(|v| Dual64::from(*v)).collect();
    let mut out = DMatrix::zeros(n, 3 + 4);
    let mut rates = vec![Dual64::from(0.0); n];
    for column in 0..3 + 4 {
        let mut seeded: Inputs<Dual64> = u.lift();
        match column {
            0..3 => seeded.disturbance[column].eps = 1.0,
            _ => seeded.winch_force[column - 3].eps = 1.0,
        }
        plant.rates(Dual64::from(time), &states, &seeded, slack, &mut rates);
        for row in 0..n {
            out[(row, column)] = rates[row].eps;
        }
    }
    out
}

/// The dense Jacobian against dual numbers, by row relative to its largest entry.
fn jacobian_deviation(random: &mut Random, plant: &Plant, slack: &PerCable<bool>) -> f64 {
    let (y, u) = state(random, plant, 1.0);
    let mut made = Jacobian::default();
    made.update(plant, 3.0, &y, &u, slack);
    let expected = [jacobian(plant, 3.0, &y, &u, slack), jacobian_of_inputs(plant, 3.0, &y, &u, slack)];
    let mut worst = 0.0_f64;
    for (expected, made) in expected.iter().zip([&made.by_state, &made.by_input]) {
        for r in 0..expected.nrows() {
            let size = expected.row(r).amax();
            for c in 0..expected.ncols() {
                let difference = (made[r * expected.ncols() + c] - expected[(r, c)]).abs();
                worst = worst.max(if difference == 0.0 { 0.0 } else { difference / size });
            }
        }
    }
    worst
}

/// Largest relative difference of the structured and the dense solution, real and complex, over some right-hand sides.
fn deviation(random: &mut Random, plant: &Plant, speed: f64, slack: &PerCable<bool>) -> f64 {
    let (y, u) = state(random, plant, speed);
    let n = y.len();
    let mut linearisation = Linearisation::default();
    linearisation.update(plant, 3.0, &y, &u, slack);
    let dense = jacobian(plant, 3.0, &y, &u, slack);
    let (sigma, pair) = (360.0, Complex64::new(270.0, 300.0));
    let mut factors = Factors::new(&plant.states_of_cables());
    factors.update(&linearisation, sigma, pair);
    let real_dense = (DMatrix::identity(n, n) * sigma - &dense).lu();
    let complex_dense = (DMatrix::identity(n, n) * pair - dense.map(Complex64::from)).lu();
    let mut worst = 0.0_f64;
    for column in 0..n {
        let mut b = vec![0.0; n];
        b[column] = 1.0;
        let expected = real_dense.solve(&DVector::from_column_slice(&b)).unwrap();
        factors.solve_real(&mut b);
        let (mut re, mut im) = (vec![0.0; n], vec![0.0; n]);
        (re[column], im[column]) = (0.6, 0.8);
        let pair = |re: &[f64], im: &[f64]| DVector::from_fn(n, |row, _| Complex64::new(re[row], im[row]));
        let expected_pair = complex_dense.solve(&pair(&re, &im)).unwrap();
        factors.solve_complex(&mut re, &mut im);
        let found_pair = pair(&re, &im);
        let size = expected.amax();
        let size_pair = expected_pair.iter().fold(0.0_f64, |m, v| m.max(v.norm()));
        for row in 0..n {
            worst = worst.max((b[row] - expected[row]).abs() / size);
            worst = worst.max((found_pair[row] - expected_pair[row]).norm() / size_pair);
        }
    }
    worst
}

const MODELS: [CableModel; 3] = [CableModel::Rigid, CableModel::MasslessSpring, CableModel::LumpedMass];

fn plant(model: CableModel, inertia: CableInertia, effects: Vec<EffectSpec>) -> Plant {
    let parameters = Parameters { cable_model: model, cable_inertia: inertia, ..Parameters::default() };
    Plant::new(parameters, effects).unwrap()
}

/// An entry of every effect but expressions with values within its typical range. Its draws are its own: another effect in the
/// catalogue does not change them.
fn everything(random: &mut Random) -> Vec<EffectSpec> {
    let mut all = Vec::new();
    random.next();
    let seed = random.0;
    for info in CATALOGUE.iter().filter(|info| info.id != "expression") {
        let mut random = Random(info.id.bytes().fold(seed, |seed, b| (seed * 31 + u64::from(b)) % 2_147_483_646 + 1));
        random.next();
        let mut values: Vec<f64> = info
            .parameters
            .iter()
            .map(|p| p.typical.0 + (p.typical.1 - p.typical.0) * (0.5 + 0.5 * random.next()))
            .collect();
        match info.id {
            "winch_saturation" => values = vec![1e3, 9e4],
            "platform_mass" => values[0] = values[0].abs(),
            _ => {}
        }
        all.push(EffectSpec::new(info.id, None, &values).unwrap());
    }
    all
}

/// The structured solution and the dense matrix against dual numbers, with and without slack cables.
fn assert_exact(random: &mut Random, plant: &Plant, name: &str, allowed: f64) {
    for slack in [[false; 4], [false, true, false, true]].map(PerCable::from) {
        let worst = deviation(random, plant, 1.0, &slack);
        assert!(worst < allowed, "{name}, slack {slack:?}: {worst:e}");
        let worst = jacobian_deviation(random, plant, &slack);
        assert!(worst < 1e-9, "{name}, slack {slack:?}, dense: {worst:e}");
    }
}

#[test]
fn newton_matrix_is_exact_without_effects() {
    let mut random = Random(18);
    for model in MODELS {
        for inertia in [CableInertia::Paper, CableInertia::Reeled, CableInertia::None] {
            for damper in [CableDamper::LengthRate, CableDamper::StrainRate] {
                let parameters = Parameters {
                    cable_model: model,
                    cable_inertia: inertia,
                    cable_damper: damper,
                    gravity: [0.3, -9.81],
                    centre_of_mass: [1.0, -2.0],
                    ..Parameters::default()
                };
                // Drums, so that there is a mass at every winch.
                let drums = EffectSpec::new("winch_drum_inertia", None, &[97.0]).unwrap();
                let plant = Plant::new(parameters, vec![drums]).unwrap();
                for _ in 0..5 {
                    assert_exact(&mut random, &plant, &format!("{model:?} {inertia:?} {damper:?}"), 1e-9);
                }
            }
        }
    }
}

#[test]
fn newton_matrix_is_exact_with_each_effect() {
    let mut random = Random(17);
    let drums = EffectSpec::new("winch_drum_inertia", None, &[97.0]).unwrap();
    for model in MODELS {
        for spec in everything(&mut random) {
            let id = spec.id.clone();
            // Left out: the slow force of a swinging cable.
            let allowed = if id == "cable_transverse_mode" { 1e-2 } else { 1e-9 };
            let effects = if id == "winch_drum_inertia" { vec![spec] } else { vec![drums.clone(), spec] };
            let plant = plant(model, CableInertia::Paper, effects);
            for _ in 0..5 {
                assert_exact(&mut random, &plant, &format!("{model:?} {id}"), allowed);
            }
        }
    }
}

/// What is left out of swinging cables matters little beside everything else.
#[test]
fn newton_matrix_is_nearly_exact_with_all_effects() {
    let mut random = Random(19);
    for model in MODELS {
        for inertia in [CableInertia::Paper, CableInertia::Reeled] {
            let effects = everything(&mut random);
            let plant = plant(model, inertia, effects);
            for _ in 0..20 {
                assert_exact(&mut random, &plant, &format!("{model:?} {inertia:?}"), 1e-2);
            }
        }
    }
}

/// Where winch forces are said to do nothing but accelerate the ends of their cables, the rates under others are told exactly.
#[test]
fn rates_follow_winch_forces_where_they_pull_apart() {
    let mut random = Random(23);
    let mut apart = Vec::new();
    for model in MODELS {
        for spec in everything(&mut random) {
            let id = spec.id.clone();
            let plant = plant(model, CableInertia::Paper, vec![spec]);
            if !plant.pulls_apart {
                continue;
            }
            apart.push(id.clone());
            for slack in [[false; 4], [false, true, false, true]].map(PerCable::from) {
                let (y, u) = state(&mut random, &plant, 1.0);
                let pulled = Inputs { winch_force: PerCable::from_fn(4, |_| 2e4 + 5e3 * random.next()), ..u };
                let rates = |u: &Inputs| {
                    let mut rates = vec![0.0; y.len()];
                    plant.rates(0.0, &y, u, &slack, &mut rates);
                    rates
                };
                let (mut followed, evaluated) = (rates(&u), rates(&pulled));
                plant.pull_harder(&y, |i| pulled.winch_force[i] - u.winch_force[i], &mut followed);
                for (a, b) in followed.iter().zip(&evaluated) {
                    assert!((a - b).abs() < 1e-9 * b.abs().max(1.0), "{id}: {a}, evaluated {b}");
                }
            }
        }
    }
    for expected in ["platform_quadratic_drag", "cable_sag", "cable_creep", "cable_transverse_mode"] {
        assert!(apart.iter().any(|id| id == expected), "{expected}");
    }
    assert!(!apart.iter().any(|id| id.starts_with("winch_") && id.contains("friction")), "{apart:?}");
}
