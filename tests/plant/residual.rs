//! The residual and its solved-for form say the same.

use cdpr::dynamics::Inputs;
use cdpr::effect::{EffectKind, EffectSpec, Stage};
use cdpr::per_cable::PerCable;
use cdpr::plant::Plant;
use num_dual::Dual64;

use crate::catalogue::everything;
use crate::random::{INERTIAS, MODELS, Random, plant, state};

/// Largest entry of `residual(y, rates(y))` in units of the terms that it is the difference of.
fn mismatch(plant: &Plant, time: f64, y: &[f64], u: &Inputs, slack: &PerCable<bool>) -> f64 {
    let n = plant.dimension();
    let mut rates = vec![0.0; n];
    plant.rates(time, y, u, slack, &mut rates);
    assert!(rates.iter().all(|r| r.is_finite()), "{rates:?}");
    let mut residual = vec![f64::NAN; n];
    plant.residual(time, y, &rates, u, slack, &mut residual);
    // How far each row moves when the rates do: the size of a rounding error in it.
    let mut worst = 0.0_f64;
    for (row, value) in residual.iter().enumerate() {
        let mut size = 0.0_f64;
        let mut shaken = vec![0.0; n];
        for column in 0..n {
            let mut other = rates.clone();
            let step = 1e-3 * (1.0 + other[column].abs());
            other[column] += step;
            plant.residual(time, y, &other, u, slack, &mut shaken);
            size = size.max((shaken[row] - value).abs() / step * (1.0 + rates[column].abs()));
        }
        let forces = u.winch_force.iter().fold(0.0_f64, |m, f| m.max(f.abs()));
        let force_row = (3..6).contains(&row) || size > 10.0;
        worst = worst.max(value.abs() / (size + if force_row { forces * 10.0 } else { 0.0 } + 1.0));
    }
    worst
}

#[test]
fn rates_solve_the_residual_for_all_models_and_inertias() {
    let mut random = Random(1);
    for model in MODELS {
        for inertia in INERTIAS {
            let plant = plant(model, inertia, &[]);
            for _ in 0..100 {
                let (y, u) = state(&mut random, &plant);
                let worst = mismatch(&plant, 0.0, &y, &u, &[false; 4].into());
                assert!(worst < 1e-12, "{model:?} {inertia:?}: {worst:e}");
                let slack: [bool; 4] = std::array::from_fn(|_| random.within(0.0, 1.0) < 0.4);
                let worst = mismatch(&plant, 0.0, &y, &u, &slack.into());
                assert!(worst < 1e-12, "{model:?} {inertia:?} slack {slack:?}: {worst:e}");
            }
        }
    }
}

#[test]
fn rates_solve_the_residual_for_every_effect() {
    let mut random = Random(2);
    for round in 0..4 {
        for spec in everything(&mut random) {
            for model in MODELS {
                let plant = plant(model, INERTIAS[round % 3], std::slice::from_ref(&spec));
                for _ in 0..5 {
                    let (y, u) = state(&mut random, &plant);
                    let time = random.within(0.0, 100.0);
                    let worst = mismatch(&plant, time, &y, &u, &[false; 4].into());
                    assert!(worst < 1e-12, "{spec:?} {model:?}: {worst:e}");
                }
            }
        }
    }
}

#[test]
fn rates_solve_the_residual_with_all_effects_at_once() {
    let mut random = Random(3);
    for _ in 0..50 {
        let effects: Vec<EffectSpec> = everything(&mut random);
        for model in MODELS {
            let plant = plant(model, INERTIAS[0], &effects);
            let (y, u) = state(&mut random, &plant);
            let worst = mismatch(&plant, 7.0, &y, &u, &[false, true, false, false].into());
            assert!(worst < 1e-12, "{model:?}: {worst:e}");
        }
    }
}

/// A residual that ignored an effect would agree with rates that ignore it too.
#[test]
fn every_effect_on_the_motion_changes_the_residual() {
    let mut random = Random(4);
    for spec in everything(&mut random) {
        let stage = EffectKind::new(&spec).unwrap().stage();
        if [Stage::Sensor, Stage::CommandDelay].contains(&stage) {
            continue;
        }
        let model = MODELS[2];
        let (with, without) = (plant(model, INERTIAS[0], std::slice::from_ref(&spec)), plant(model, INERTIAS[0], &[]));
        let changed = (0..20).any(|_| {
            let (y, mut u) = state(&mut random, &without);
            u.winch_force = u.winch_force.map(|f| 4.0 * f); // beyond a saturation, too
            let mut wide = vec![0.0; with.dimension()];
            wide[..6].copy_from_slice(&y[..6]);
            for i in 0..4 {
                let (a, b) = (with.unstretched_index(i).unwrap(), without.unstretched_index(i).unwrap());
                wide[a..a + 2].copy_from_slice(&y[b..b + 2]);
            }
            let (a, b) =
                (with.evaluate(3.0, &wide, &u, &[false; 4].into()), without.evaluate(3.0, &y, &u, &[false; 4].into()));
            a.acceleration != b.acceleration || a.unstretched_acceleration != b.unstretched_acceleration || {
                ["cable_creep", "cable_hysteresis"].contains(&spec.id.as_str()) && a.effect_rate != b.effect_rate
            }
        });
        assert!(changed, "{spec:?} changes nothing");
    }
}

/// Dual numbers through the solved-for form give the derivative that differences give.
#[test]
fn dual_numbers_differentiate_the_rates() {
    let mut random = Random(5);
    for model in MODELS {
        let effects: Vec<EffectSpec> = everything(&mut random)
            .into_iter()
            // Kinks have no derivative, and a steep friction law needs smaller differences than rounding allows.
            .filter(|s| !["winch_saturation", "expression"].contains(&s.id.as_str()) && !s.id.contains("friction"))
            .collect();
        let plant = plant(model, INERTIAS[1], &effects);
        let (y, u) = state(&mut random, &plant);
        let n = plant.dimension();
        let swinging: Vec<usize> = plant
            .states_of_effects()
            .iter()
            .filter(|place| place.stage == Stage::Transverse)
            .flat_map(|place| (0..place.count).map(|k| plant.effect_states(place.cable).start + place.first + k))
            .collect();
        let mut dual = vec![Dual64::from(0.0); n];
        let (mut ahead, mut behind) = (vec![0.0; n], vec![0.0; n]);
        for column in 0..n {
            let seeded: Vec<Dual64> =
                y.iter().enumerate().map(|(k, v)| Dual64::new(*v, f64::from(u8::from(k == column)))).collect();
            plant.rates(Dual64::from(5.0), &seeded, &u.lift(), &[false; 4].into(), &mut dual);
            // A small bow hardly stretches its cable: only a wide difference rises above rounding.
            let step = if swinging.contains(&column) { 1e-3 } else { 1e-6 * (1.0 + y[column].abs() * 1e-1) };
            let mut moved = y.clone();
            moved[column] = y[column] + step;
            plant.rates(5.0, &moved, &u, &[false; 4].into(), &mut ahead);
            moved[column] = y[column] - step;
            plant.rates(5.0, &moved, &u, &[false; 4].into(), &mut behind);
            for row in 0..n {
                let difference = (ahead[row] - behind[row]) / (2.0 * step);
                let size = 1e-7 / step + difference.abs();
                assert!(
                    (dual[row].eps - difference).abs() < 1e-5 * (1.0 + size),
                    "{model:?} row {row} column {column}: {} against {difference}",
                    dual[row].eps
                );
            }
        }
    }
}
