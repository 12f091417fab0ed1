//! Exact derivatives against differences, and the declared dependencies against the derivatives.

use std::collections::BTreeSet;

use fmi2_export::Model as _;
use fmi2_export::description::Causality;

use super::*;

/// A state with nothing special about it, taken over as start values so that each can be moved by itself.
fn settled(cable_model: CableModel, effects: Vec<EffectSpec>) -> CablePlatform {
    let mut platform = CablePlatform::new(moving(cable_model, effects)).unwrap();
    initialise(&mut platform, EXPERIMENT);
    platform.step(0.0, 0.3).unwrap();
    platform
}

fn unknowns(platform: &CablePlatform) -> Vec<usize> {
    let real = |k: &usize| matches!(platform.description().variables[*k].kind, fmi2_export::description::Kind::Real(_));
    platform.description().outputs().filter(real).chain(platform.description().derivatives()).collect()
}

fn knowns(platform: &CablePlatform) -> Vec<usize> {
    let input = |k: &usize| {
        let causality = platform.description().variables[*k].causality;
        causality == Causality::Input || causality == Causality::Independent
    };
    let count = platform.description().variables.len();
    (0..count).filter(input).chain(platform.description().states()).collect()
}

fn column(platform: &mut CablePlatform, unknowns: &[usize], known: usize) -> Vec<f64> {
    let mut out = vec![0.0; unknowns.len()];
    platform.directional_derivative(unknowns, &[known], &[1.0], &mut out).unwrap();
    out
}

/// How far a known is moved for a central difference: small against curvature, large against rounding.
fn width(name: &str) -> f64 {
    match name.split('[').next().unwrap() {
        "winch_force" | "disturbance_force_x" | "disturbance_force_y" | "disturbance_torque" => 10.0,
        "phi" | "omega" => 1e-4,
        "time" => 1e-4,
        name if name.starts_with("effect.winch_lag") => 1.0,
        name if name.starts_with("effect.cable_transverse_mode") => 1e-3,
        name if name.starts_with("effect.") => 1e-7,
        _ => 1e-3,
    }
}

/// Values of `unknowns` with one known moved.
fn moved(platform: &mut CablePlatform, unknowns: &[usize], known: usize, amount: f64) -> Vec<f64> {
    use super::super::role::{Role, State};
    let role = platform.shared.roles[known];
    let mut state = Vec::new();
    platform.save(&mut state);
    let simulation = platform.simulation.as_mut().unwrap();
    let plant = simulation.plant().clone();
    let mut y = simulation.states().to_vec();
    let slot = match role {
        Role::State(State::Twist(k)) => Some((3 + k, 1.0)),
        Role::State(State::Effect(i, k)) => Some((plant.effect_states(i).start + k, 1.0)),
        _ => None,
    };
    let cable = match role {
        Role::State(State::UnstretchedLength(i) | State::UnstretchedRate(i)) => {
            plant.unstretched_index(i).map(|k| (i, k))
        }
        _ => None,
    };
    if let Role::State(State::Pose(k)) = role {
        let sensor = plant.pose_sensor();
        let mut shown = sensor.shown(&[y[0], y[1], y[2]]);
        shown[k] += amount;
        y[..3].copy_from_slice(&sensor.behind(&shown));
        simulation.set_states(&y);
    } else if let Some((k, scale)) = slot {
        y[k] += amount / scale;
        simulation.set_states(&y);
    } else if let Some((i, k)) = cable {
        // What is shown moves by the amount, and the other of length and rate stays as it is shown.
        let sensor = &plant.cable[i].unstretched_sensor;
        let rate = plant.rate_index(i);
        let (mut shown, mut shown_rate) = (sensor.shown(y[k]), rate.map_or(0.0, |r| sensor.shown_rate(y[k], y[r])));
        match role {
            Role::State(State::UnstretchedLength(_)) => shown += amount,
            _ => shown_rate += amount,
        }
        y[k] = sensor.behind(shown);
        if let Some(r) = rate {
            y[r] = sensor.rate_behind(shown, shown_rate);
        }
        simulation.set_states(&y);
    } else if !matches!(role, Role::State(_)) {
        let name = platform.description().variables[known].name.clone();
        let value = get(platform, &name);
        set(platform, &name, value + amount);
    }
    platform.forget_instant();
    let values = unknowns
        .iter()
        .map(|k| match platform.get(*k).unwrap() {
            Value::Real(value) => value,
            other => panic!("{other:?}"),
        })
        .collect();
    platform.restore(&state).unwrap();
    values
}

#[test]
fn directional_derivatives_are_those_of_differences() {
    let everything = one_of_each();
    let alone = everything.iter().map(|spec| vec![spec.clone()]);
    for effects in alone.chain([Vec::new()]) {
        for cable_model in MODELS {
            let label = effects.first().map_or("plain", |e| e.id.as_str()).to_owned();
            // Behind its damper a massless spring is strained so slowly that any difference goes over the kink at rest.
            if label == "cable_hysteresis" && cable_model == CableModel::MasslessSpring {
                continue;
            }
            let mut platform = settled(cable_model, effects.clone());
            let (unknowns, knowns) = (unknowns(&platform), knowns(&platform));
            let present = moved(&mut platform, &unknowns, knowns[1], 0.0);
            for &known in &knowns {
                let name = platform.description().variables[known].name.clone();
                if name == "time" {
                    continue;
                }
                let exact = column(&mut platform, &unknowns, known);
                let h = width(&name);
                let ahead = moved(&mut platform, &unknowns, known, h);
                let behind = moved(&mut platform, &unknowns, known, -h);
                for (k, &unknown) in unknowns.iter().enumerate() {
                    let difference = (ahead[k] - behind[k]) / (2.0 * h);
                    // A tension is the difference of two lengths near 1 km times EA: rounding shows at 1e-13 * EA.
                    let rounding = 1e-12 * present[k].abs().max(1.0) / h
                        + match platform.description().variables[unknown].name.split('[').next().unwrap() {
                            "tension" => 1e-5 / h,
                            _ => 3e-7 / h * 1e-2,
                        };
                    let bound = 2e-5 * exact[k].abs() + rounding;
                    assert!(
                        (exact[k] - difference).abs() <= bound,
                        "{label}, {cable_model:?}: d {} / d {name} is {}, by differences {difference}, bound {bound:e}",
                        platform.description().variables[unknown].name,
                        exact[k]
                    );
                }
            }
        }
    }
}

/// Pairs of unknown and known with a derivative that is not zero, over the cable models and inertias.
fn shown(effects: &[EffectSpec]) -> BTreeSet<(String, String)> {
    let mut pairs = BTreeSet::new();
    for cable_model in MODELS {
        for inertia in [1, 3] {
            let mut platform = CablePlatform::new(moving(cable_model, effects.to_vec())).unwrap();
            choose(&mut platform, "cable_inertia", inertia);
            initialise(&mut platform, EXPERIMENT);
            platform.step(0.0, 0.3).unwrap();
            let (unknowns, knowns) = (unknowns(&platform), knowns(&platform));
            for &known in &knowns {
                let column = column(&mut platform, &unknowns, known);
                for (&unknown, value) in unknowns.iter().zip(column) {
                    if value != 0.0 {
                        let name = |k: usize| platform.description().variables[k].name.clone();
                        pairs.insert((name(unknown), name(known)));
                    }
                }
            }
        }
    }
    pairs
}

fn declared(platform: &CablePlatform) -> BTreeSet<(String, String)> {
    let variables = &platform.description().variables;
    let pairs = unknowns(platform).into_iter().flat_map(|unknown| {
        let list = variables[unknown].dependencies.clone().unwrap();
        list.into_iter().map(move |known| (unknown, known.index))
    });
    pairs.map(|(unknown, known)| (variables[unknown].name.clone(), variables[known].name.clone())).collect()
}

#[test]
fn declared_dependencies_are_exactly_those_that_show() {
    let platform = CablePlatform::new(Model::default()).unwrap();
    let (declared, shown) = (declared(&platform), shown(&[]));
    assert_eq!(shown.difference(&declared).collect::<Vec<_>>(), Vec::<&(String, String)>::new(), "not declared");
    assert_eq!(declared.difference(&shown).collect::<Vec<_>>(), Vec::<&(String, String)>::new(), "never shown");
}

#[test]
fn declared_dependencies_hold_with_every_effect() {
    let everything = one_of_each();
    let pairs = everything.iter().map(|one| vec![one.clone()]).chain([everything.clone()]);
    for effects in pairs {
        let label = effects[0].id.clone();
        let platform = CablePlatform::new(Model { effects: effects.clone(), ..Model::default() }).unwrap();
        let missing: Vec<_> = shown(&effects).difference(&declared(&platform)).cloned().collect();
        assert!(missing.is_empty(), "{label}: {missing:?}");
    }
}

#[test]
fn output_derivatives_are_those_of_differences() {
    for effects in [Vec::new(), one_of_each()] {
        for cable_model in MODELS {
            let mut platform = settled(cable_model, effects.clone());
            let ramp = index(&platform, "winch_force[1]");
            platform.set_input_derivative(ramp, 1, 400.0).unwrap();
            let outputs: Vec<usize> = unknowns(&platform)
                .into_iter()
                .filter(|k| platform.description().variables[*k].causality == Causality::Output)
                .collect();
            let read = |platform: &mut CablePlatform| moved(platform, &outputs, ramp_free(platform), 0.0);
            let h = 1e-4;
            let mut samples = Vec::new();
            let mut exact = Vec::new();
            for k in 0..3 {
                if k == 1 {
                    exact = outputs.iter().map(|&o| platform.output_derivative(o, 1).unwrap()).collect();
                }
                samples.push(read(&mut platform));
                platform.step(0.3 + f64::from(k) * h, h).unwrap();
            }
            for (k, &output) in outputs.iter().enumerate() {
                let difference = (samples[2][k] - samples[0][k]) / (2.0 * h);
                let name = &platform.description().variables[output].name;
                let bound = 1e-3 * exact[k].abs()
                    + 1e-7 * samples[1][k].abs().max(1.0)
                    + if name.starts_with("tension") { 0.1 } else { 0.0 };
                assert!(
                    (exact[k] - difference).abs() <= bound,
                    "{cable_model:?}: {name} changes at {}, by differences {difference}",
                    exact[k]
                );
            }
        }
    }
}

/// Some known that `moved` leaves alone when moved by nothing.
fn ramp_free(platform: &CablePlatform) -> usize {
    index(platform, "x")
}

/// Hosts ask for one unknown after the other, and go on to the next known or the next instant.
#[test]
fn derivatives_one_by_one_are_those_all_at_once() {
    let mut platform = settled(CableModel::LumpedMass, one_of_each());
    let (unknowns, knowns) = (unknowns(&platform), knowns(&platform));
    for time in [0.3, 0.4] {
        for known in &knowns {
            let together = column(&mut platform, &unknowns, *known);
            for (unknown, value) in unknowns.iter().zip(together) {
                assert_eq!(column(&mut platform, &[*unknown], *known), [value], "{unknown} by {known}");
            }
        }
        platform.step(time, 0.1).unwrap();
        assert!(platform.tangent.is_none(), "of the instant before");
    }
}

#[test]
fn what_is_no_known_is_refused() {
    let mut platform = settled(CableModel::LumpedMass, Vec::new());
    let (x, mass) = (index(&platform, "x"), index(&platform, "platform_mass"));
    platform.directional_derivative(&[x], &[mass], &[1.0], &mut [0.0]).unwrap_err();
    platform.directional_derivative(&[mass], &[x], &[1.0], &mut [0.0]).unwrap_err();
    platform.output_derivative(x, 2).unwrap_err();
    platform.set_input_derivative(x, 1, 0.0).unwrap_err();
    let force = index(&platform, "winch_force[1]");
    platform.set_input_derivative(force, 2, 0.0).unwrap_err();
}

/// A, B, C, D of the library, column by column through the FMU's interface.
#[test]
fn the_linear_model_is_that_of_the_library() {
    for cable_model in [CableModel::Rigid, CableModel::MasslessSpring, CableModel::LumpedMass] {
        let mut platform = settled(cable_model, Vec::new());
        let linear = crate::statics::LinearModel::of(platform.simulation.as_ref().unwrap());
        let place = |platform: &CablePlatform, name: &str| platform.description().find(name).unwrap();
        let rates: Vec<usize> = linear.state_names.iter().map(|n| place(&platform, &format!("der({n})"))).collect();
        let outputs: Vec<usize> = linear.output_names.iter().map(|n| place(&platform, n)).collect();
        let unknowns = [rates, outputs].concat();
        let n = linear.state_names.len();
        for (known, (upper, lower)) in linear
            .state_names
            .iter()
            .zip(linear.a.column_iter().zip(linear.c.column_iter()))
            .chain(linear.input_names.iter().zip(linear.b.column_iter().zip(linear.d.column_iter())))
        {
            let known = place(&platform, known);
            let found = column(&mut platform, &unknowns, known);
            for (k, value) in found.iter().enumerate() {
                let expected = if k < n { upper[k] } else { lower[k - n] };
                assert_eq!(*value, expected, "{cable_model:?}: d {} / d {known}", unknowns[k]);
            }
        }
    }
}
