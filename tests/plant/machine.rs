//! Wind on cables, friction round pulleys, ripple of motors, anchors that give: against what can be worked out by hand.

use std::f64::consts::TAU;

use cdpr::dynamics::Inputs;
use cdpr::effect::{EffectKind, EffectSpec, WinchContext};
use cdpr::parameters::{CableInertia, CableModel, CableParameters, Parameters};
use cdpr::plant::Plant;

use crate::random::{MODELS, Random, plant, state};

fn effect(id: &str, cable: Option<usize>, values: &[f64]) -> EffectSpec {
    EffectSpec::new(id, cable, values).unwrap()
}

/// The force and torque by which an effect changes what moves the platform, at a state of the plant without it.
fn added(spec: EffectSpec, y: &[f64], u: &Inputs) -> [f64; 3] {
    let of = |effects: &[EffectSpec]| {
        let plant = plant(CableModel::LumpedMass, CableInertia::Paper, effects);
        let mut residual = vec![0.0; y.len()];
        plant.residual(0.0, y, &vec![0.0; y.len()], u, &[false; 4].into(), &mut residual);
        [residual[3], residual[4], residual[5]]
    };
    let (with, without) = (of(&[spec]), of(&[]));
    std::array::from_fn(|k| without[k] - with[k])
}

/// In air that stands still the wind is the drag of the cables, whatever the profile.
#[test]
fn wind_that_does_not_blow_is_the_drag_of_the_cables() {
    let mut random = Random(5);
    let bare = plant(CableModel::LumpedMass, CableInertia::Paper, &[]);
    for _ in 0..20 {
        let (y, u) = state(&mut random, &bare);
        let still = added(effect("cable_wind", None, &[0.0, 0.0, 0.02, 0.2, -900.0]), &y, &u);
        let drag = added(effect("cable_drag", None, &[0.02]), &y, &u);
        for (still, drag) in still.iter().zip(drag) {
            assert!((still - drag).abs() < 1e-6 * (1.0 + drag.abs()), "{still} {drag}");
        }
        // It brakes.
        let power: f64 = still.iter().zip(&y[3..6]).map(|(force, speed)| force * speed).sum();
        assert!(power < 0.0, "{power}");
    }
}

/// At rest in the middle: each cable at angle α carries ρ/4 C_d d L |w sin α| w sin α across itself to the platform.
#[test]
fn a_uniform_wind_leaves_half_of_its_load_on_the_platform() {
    let bare = plant(CableModel::LumpedMass, CableInertia::Paper, &[]);
    let (mut y, u) = state(&mut Random(7), &bare);
    y[..6].fill(0.0);
    let (wind, area) = (8.0, 0.024);
    let mut expected = [0.0; 3];
    for i in 0..4 {
        let geometry = bare.geometry();
        let (anchor, end) = (geometry.anchor[i], geometry.attachment[i]);
        let chord = [end[0] - anchor[0], end[1] - anchor[1]];
        let length = chord[0].hypot(chord[1]);
        let normal = [-chord[1] / length, chord[0] / length];
        let across = wind * normal[0];
        let force = 0.25 * 1.225 * area * length * across.abs() * across;
        expected[0] += force * normal[0];
        expected[1] += force * normal[1];
        expected[2] += end[0] * force * normal[1] - end[1] * force * normal[0];
    }
    let found = added(effect("cable_wind", None, &[wind, 0.0, area]), &y, &u);
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() < 1e-6 * expected.abs().max(1.0), "{found} {expected}");
    }
    assert!(found[0] > 100.0, "the wind pushes along itself: {found:?}");
    // A wind from the other side pushes the other way, and twice the wind pushes four times as much.
    let back = added(effect("cable_wind", None, &[-2.0 * wind, 0.0, area]), &y, &u);
    assert!((back[0] + 4.0 * found[0]).abs() < 1e-6 * found[0]);
}

/// A cable that stands upright in a wind that grows in proportion to height: ∫ s (s/h)² ds has its closed form.
#[test]
fn a_profile_over_height_loads_the_upper_end() {
    let upright = |x: f64| CableParameters::between([x, 0.0], [x, -1.0]);
    let mut cable = vec![upright(-1.0), upright(1.0)];
    cable.push(CableParameters::between([100.0, 40.0], [1.0, 0.0]));
    let parameters = Parameters { cable, gravity: [0.0, -9.81], ..Parameters::default() };
    let (wind, area, reference) = (6.0, 0.01, 10.0);
    let acceleration = |effects: Vec<EffectSpec>| {
        let plant = Plant::new(parameters.clone(), effects).unwrap();
        let mut y = vec![0.0; plant.dimension()];
        y[1] = 41.0; // the first two cables are 40 m long, straight up
        for i in 0..3 {
            y[plant.unstretched_index(i).unwrap()] = if i < 2 { 39.9 } else { 97.0 };
        }
        let mut residual = vec![0.0; y.len()];
        let rest = vec![0.0; y.len()];
        plant.residual(0.0, &y, &rest, &Inputs::none(3), &[false; 3].into(), &mut residual);
        [residual[3], residual[4], residual[5]]
    };
    let blown = effect("cable_wind", None, &[wind, 0.0, area, 1.0, 0.0, reference]);
    let (with, without) = (acceleration(vec![blown]), acceleration(vec![]));
    let height = 40.0_f64;
    let load = 0.5 * 1.225 * area * wind * wind;
    let upright = 2.0 * load * height.powi(3) / (4.0 * reference * reference);
    // The third lies nearly level at 40 to 41 m: half of the load of that height, less what blows along it.
    let third: [f64; 2] = [1.0 - 100.0, 1.0];
    let length = third[0].hypot(third[1]);
    let normal = [-third[1] / length, third[0] / length];
    let profile = |s: f64| (40.0 + s / length * third[1]) / reference;
    let steps = 2000;
    let share: f64 = (0..steps)
        .map(|k| {
            let s = (f64::from(k) + 0.5) / f64::from(steps) * length;
            s / length * (profile(s) * normal[0] * wind).powi(2) * normal[0].signum() * length / f64::from(steps)
        })
        .sum();
    let level = 0.5 * 1.225 * area * share * normal[0];
    let found = without[0] - with[0];
    assert!((found - upright - level).abs() < 1e-4 * upright, "{found} {upright} {level}");
}

#[test]
fn wrap_friction_multiplies_by_the_capstan_s_exponential() {
    let kind = |id: &str, values: &[f64]| EffectKind::new(&effect(id, Some(1), values)).unwrap();
    let (friction, wrap) = (0.12, 2.5);
    let kind_of_wrap = kind("pulley_wrap_friction", &[friction, wrap, 0.01]);
    let felt = |force: f64, speed: f64| force + kind_of_wrap.loss(force, &WinchContext { time: 0.0, speed });
    let factor = f64::exp(friction * wrap);
    assert!((felt(2e4, 1.0) - 2e4 * factor).abs() < 1e-9);
    assert!((felt(2e4, -1.0) - 2e4 / factor).abs() < 1e-9);
    assert_eq!(felt(2e4, 0.0), 2e4);
    // It takes energy at every speed, whatever the sign of the force.
    for force in [2e4, -2e4] {
        for speed in [-1.0, -0.003, 0.001, 0.5] {
            assert!((felt(force, speed) - force) * speed > 0.0, "{force} {speed}");
        }
    }
    // A small wrap is the capstan loss: what they differ by is of second order.
    let small = kind("pulley_wrap_friction", &[0.02, 0.5, 0.01]);
    let capstan = kind("pulley_capstan_loss", &[0.01, 0.01]);
    let context = WinchContext { time: 0.0, speed: 0.4 };
    let (a, b) = (small.loss(1e4, &context), capstan.loss(1e4, &context));
    assert!(a > b && a - b < 0.51 * 1e4 * 0.01_f64.powi(2), "{a} {b}");
}

/// The pull of winch 2 at a paid-out length, of all cable models that have it as a state.
#[test]
fn a_ripple_is_a_wave_along_the_cable_and_does_no_work_in_a_period() {
    let (amplitude, period, phase) = (150.0, 1.7, 0.6);
    for model in MODELS {
        let with =
            plant(model, CableInertia::Paper, &[effect("winch_torque_ripple", Some(2), &[amplitude, period, phase])]);
        let (y, u) = state(&mut Random(3), &with);
        let pull = |more: f64| {
            let mut y = y.clone();
            if let Some(at) = with.unstretched_index(1) {
                y[at] += more;
            }
            let e = with.evaluate(0.0, &y, &u, &[false; 4].into());
            let expected = u.winch_force[1] + amplitude * (TAU * e.unstretched[1] / period + phase).sin();
            assert!((e.pull[1] - expected).abs() < 1e-7, "{model:?}: {} {expected}", e.pull[1]);
            assert_eq!(e.pull[0], u.winch_force[0]);
            e.pull[1]
        };
        pull(0.0);
        if with.unstretched_index(1).is_some() {
            let work: f64 = (0..1000).map(|k| pull(period * f64::from(k) / 1000.0) - u.winch_force[1]).sum();
            assert!((work / 1000.0).abs() < 1e-7 * amplitude, "{work}");
        }
    }
}

/// Two springs in series: the cable's EA/l and the anchor's k, as far as L stands for l in the smaller of the two.
#[test]
fn an_anchor_that_gives_is_a_spring_in_series() {
    let tension = |effects: &[EffectSpec], chord: f64, unstretched: f64| {
        plant(CableModel::LumpedMass, CableInertia::Paper, effects).tension_for(0, 0.0, chord, unstretched, &[0.0; 8])
    };
    let stiffness = 4e5;
    let gives = effect("anchor_compliance", Some(1), &[stiffness]);
    let (chord, unstretched) = (640.0, 639.5);
    let axial = Parameters::default().youngs_modulus * Parameters::default().cable_area;
    let strain = (chord - unstretched) / unstretched;
    let expected = strain / (1.0 / axial + 1.0 / (stiffness * chord));
    let found = tension(std::slice::from_ref(&gives), chord, unstretched);
    assert!((found - expected).abs() < 1e-9 * expected, "{found} {expected}");
    // What the two take up is what there is: to the strain's square.
    let taken = found * unstretched / axial + found / stiffness;
    assert!((taken - 0.5).abs() < 1e-3 * 0.5, "{taken}");
    assert!(found < tension(&[], chord, unstretched));
    // It is slack where the cable is, and an anchor of rock is none.
    assert!(tension(std::slice::from_ref(&gives), 639.0, unstretched) < 0.0);
    let rock = effect("anchor_compliance", None, &[1e15]);
    assert!((tension(&[rock], chord, unstretched) - tension(&[], chord, unstretched)).abs() < 1e-3);
    // The length at which it carries a tension is the inverse.
    let plant = plant(CableModel::LumpedMass, CableInertia::Paper, &[gives, effect("cable_stiffening", None, &[2e4])]);
    let length = plant.unstretched_length_for(0, 0.0, chord, 2e4, &[0.0; 8]);
    assert!((plant.tension_for(0, 0.0, chord, length, &[0.0; 8]) - 2e4).abs() < 1e-6);
}
