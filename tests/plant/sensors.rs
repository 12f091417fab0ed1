//! What sensors make of the truth.

use cdpr::effect::EffectSpec;
use cdpr::parameters::{CableInertia, CableModel};
use cdpr::simulation::{Simulation, Start};

use crate::random::plant;

fn moving(effects: &[EffectSpec]) -> Simulation {
    let start = Start { pose: [3.0, -2.0, 0.1], twist: [0.4, 0.7, -0.05], ..Start::default() };
    let mut simulation =
        Simulation::new(plant(CableModel::LumpedMass, CableInertia::Paper, effects), &start, 1e-11).unwrap();
    for _ in 0..37 {
        simulation.advance(0.013).unwrap();
    }
    simulation
}

/// A start from what the sensors show of `cable` (from 0) is where it was shown.
fn starts_where_shown(simulation: &Simulation, cable: usize) {
    let (out, y) = (simulation.outputs(), simulation.states());
    let at = simulation.plant().unstretched_index(cable).unwrap();
    let shown = Start {
        unstretched_length: out.unstretched_length,
        unstretched_length_rate: out.unstretched_length_rate,
        ..Start::default()
    };
    let behind = shown.behind_sensors(simulation.plant());
    assert!((behind.unstretched_length[cable] - y[at]).abs() < 1e-9);
    assert!((behind.unstretched_length_rate[cable] - y[at + 1]).abs() < 1e-12);
}

#[test]
fn sensors_do_not_touch_the_motion() {
    let mut channel = EffectSpec::new("length_sensor_bias", Some(2), &[-0.2]).unwrap();
    channel.channel = Some("cable_length".to_owned());
    let effects = [
        EffectSpec::new("length_sensor_bias", Some(1), &[0.125]).unwrap(),
        channel,
        EffectSpec::new("length_sensor_scale", Some(1), &[0.002]).unwrap(),
        EffectSpec::new("pose_sensor_bias", None, &[0.01, -0.02, 0.003]).unwrap(),
    ];
    let (with, without) = (moving(&effects), moving(&[]));
    assert_eq!(with.states(), without.states());
    let (a, b) = (with.outputs(), without.outputs());
    let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-12 * (1.0 + b.abs()), "{a} {b}");
    // The effects act in the order given: the bias first, then the scale.
    near(a.unstretched_length[0], (b.unstretched_length[0] + 0.125) * 1.002);
    near(a.unstretched_length[1], b.unstretched_length[1]);
    near(a.cable_length[1], b.cable_length[1] - 0.2);
    near(a.cable_length[0], b.cable_length[0]);
    for (k, bias) in [0.01, -0.02, 0.003].into_iter().enumerate() {
        near(a.pose[k], b.pose[k] + bias);
    }
}

/// A mark at c on the platform, seen in a frame turned by θ in which lengths are wrong by s: by complex numbers
/// (1 + s) e^{-iθ} (z + c e^{iφ}).
#[test]
fn a_pose_is_seen_in_another_frame_and_at_another_point() {
    let (theta, factor, point, bias) = (0.3_f64, 0.02, [0.8, -0.5], [0.02, -0.01, 0.004]);
    let frame = EffectSpec::new("pose_sensor_frame", None, &[theta, point[0], point[1]]).unwrap();
    let scale = EffectSpec::new("pose_sensor_scale", None, &[factor]).unwrap();
    let offset = EffectSpec::new("pose_sensor_bias", None, &bias).unwrap();
    let (with, without) = (moving(&[offset.clone(), scale.clone(), frame.clone()]), moving(&[]));
    assert_eq!(with.states(), without.states());
    let ([x, y, phi], seen) = (without.outputs().pose, with.outputs().pose);
    let polar = |radius: f64, angle: f64| [radius * angle.cos(), radius * angle.sin()];
    let arm = polar(point[0].hypot(point[1]), point[1].atan2(point[0]) + phi);
    let mark = [x + arm[0], y + arm[1]];
    let expected = polar((1.0 + factor) * mark[0].hypot(mark[1]), mark[1].atan2(mark[0]) - theta);
    for (seen, expected) in
        seen.iter().zip([expected[0], expected[1], phi - theta]).zip(bias).map(|((s, e), b)| (s, e + b))
    {
        assert!((seen - expected).abs() < 1e-12, "{seen} {expected}");
    }
    // The start behind it is the pose of which it shows this.
    let plant = plant(CableModel::LumpedMass, CableInertia::Paper, &[frame, scale, offset]);
    let back = Start { pose: seen, ..Start::default() }.behind_sensors(&plant).pose;
    for (back, truth) in back.iter().zip([x, y, phi]) {
        assert!((back - truth).abs() < 1e-12, "{back} {truth}");
    }
    // What it shows changes as its rate says.
    let sensor = plant.pose_sensor();
    let (pose, rate, h) = ([x, y, phi], [0.4, -0.7, 0.2], 1e-6);
    let at = |s: f64| sensor.shown(&std::array::from_fn::<_, 3, _>(|k| pose[k] + s * rate[k]));
    let (ahead, behind) = (at(h), at(-h));
    for (k, shown) in sensor.shown_rate(&pose, &rate).iter().enumerate() {
        assert!((shown - (ahead[k] - behind[k]) / (2.0 * h)).abs() < 1e-8, "{k}");
    }
}

#[test]
fn a_tension_sensor_shows_its_gain_and_its_bias_and_nothing_else() {
    let gain = EffectSpec::new("tension_sensor_gain", Some(2), &[-0.03]).unwrap();
    let bias = EffectSpec::new("tension_sensor_bias", None, &[120.0]).unwrap();
    let (with, without) = (moving(&[gain, bias]), moving(&[]));
    assert_eq!(with.states(), without.states());
    let (a, b) = (with.outputs(), without.outputs());
    for i in 0..4 {
        let factor = if i == 1 { 0.97 } else { 1.0 };
        assert!(
            (a.tension[i] - (factor * b.tension[i] + 120.0)).abs() < 1e-9,
            "{i}: {} {}",
            a.tension[i],
            b.tension[i]
        );
    }
    assert_eq!((a.slack, a.strain, a.unstretched_length), (b.slack, b.strain, b.unstretched_length));
    assert_eq!(with.evaluate().tension, without.evaluate().tension);
}

/// A drum of 0.2 m whose axis is 10 mm beside its centre: the lever summed over the angle is what is paid out.
#[test]
fn an_eccentric_drum_counts_another_length_than_it_pays_out() {
    let (e, r, psi) = (0.01, 0.2, 0.7);
    let drum = EffectSpec::new("winch_drum_eccentricity", Some(2), &[e, r, psi]).unwrap();
    let (mut with, without) = (moving(std::slice::from_ref(&drum)), moving(&[]));
    assert_eq!(with.states(), without.states());
    let at = with.plant().unstretched_index(1).unwrap();
    for step in 0..40 {
        let mut y = without.states().to_vec();
        y[at] += 0.05 * f64::from(step);
        with.set_states(&y);
        let out = with.outputs();
        let (angle, rate) = (out.unstretched_length[1] / r, out.unstretched_length_rate[1] / r);
        // Simpson's rule over the angle, in parts of a turn.
        let lever = |angle: f64| r + e * (angle + psi).sin();
        let parts = 60_000;
        let h = angle / f64::from(parts);
        let summed: f64 = (0..parts)
            .map(|k| {
                let a = f64::from(k) * h;
                h / 6.0 * (lever(a) + 4.0 * lever(a + 0.5 * h) + lever(a + h))
            })
            .sum();
        assert!((summed - y[at]).abs() < 1e-8, "{step}: {summed} {}", y[at]);
        assert!((rate * lever(angle) - y[at + 1]).abs() < 1e-12, "{step}");
        let counted = out.winch_angle[1] * with.plant().parameters().winch.drum_radius;
        assert!((counted - out.unstretched_length[1]).abs() < 1e-9);
        assert_eq!(out.unstretched_length[0], y[with.plant().unstretched_index(0).unwrap()]);
        starts_where_shown(&with, 1);
    }
    let round = EffectSpec::new("winch_drum_eccentricity", Some(2), &[0.0, r, psi]).unwrap();
    assert!((moving(&[round]).outputs().unstretched_length[1] - without.outputs().unstretched_length[1]).abs() < 1e-9);
    let error = EffectSpec::new("winch_drum_eccentricity", None, &[0.11, r, psi]).unwrap_err().to_string();
    assert!(error.contains("less than half of `drum_radius`"), "{error}");
    let text = "[winch]\ncommand = \"torque\"\n[[effect]]\nid = \"winch_drum_eccentricity\"\n\
                eccentricity = 0.01\ndrum_radius = 0.2\nphase = 0\n";
    let error = cdpr::model_file::Model::from_toml(text).unwrap_err().to_string();
    assert!(error.contains("commanded by force"), "{error}");
}

/// Wound up turn by turn: each turn is shorter than the one before by the angle's share of a layer.
#[test]
fn layers_on_a_drum_count_more_than_is_paid_out() {
    let (d, n, r) = (0.012, 25.0, 0.6);
    let layers = EffectSpec::new("winch_drum_layers", Some(2), &[d, n, r]).unwrap();
    let wave = EffectSpec::new("winch_drum_eccentricity", Some(2), &[0.01, r, 0.7]).unwrap();
    for (effects, e) in [(vec![layers.clone()], 0.0), (vec![wave, layers.clone()], 0.01)] {
        let (with, without) = (moving(&effects), moving(&[]));
        assert_eq!(with.states(), without.states());
        let (out, y) = (with.outputs(), without.states());
        let at = with.plant().unstretched_index(1).unwrap();
        let (angle, rate) = (out.unstretched_length[1] / r, out.unstretched_length_rate[1] / r);
        let lever = |angle: f64| r - d * angle / (std::f64::consts::TAU * n) + e * (angle + 0.7).sin();
        let parts = 200_000;
        let h = angle / f64::from(parts);
        let summed: f64 = (0..parts).map(|k| h * lever((f64::from(k) + 0.5) * h)).sum();
        assert!((summed - y[at]).abs() < 1e-5, "{summed} {}", y[at]);
        assert!((rate * lever(angle) - y[at + 1]).abs() < 1e-12);
        assert!(out.unstretched_length[1] > y[at] + 50.0);
        starts_where_shown(&with, 1);
    }
    // 0.3 m of drum hold 942 m of such a cable, less than from one anchor to the farthest.
    let small = EffectSpec::new("winch_drum_layers", None, &[0.012, 40.0, 0.3]).unwrap();
    let error = cdpr::plant::Plant::new(Default::default(), vec![small]).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("942.4") && error.contains("on the drum"), "{error}");
}

/// What the sensor of a slack cable shows is its bias; a host is told by `slack` and not by the sign.
#[test]
fn the_tension_sensor_of_a_slack_cable_shows_its_bias() {
    let bias = EffectSpec::new("tension_sensor_bias", Some(3), &[-40.0]).unwrap();
    let gain = EffectSpec::new("tension_sensor_gain", Some(3), &[0.05]).unwrap();
    let mut simulation = moving(&[gain, bias]);
    let mut y = simulation.states().to_vec();
    y[simulation.plant().unstretched_index(2).unwrap()] += 50.0;
    simulation.set_states(&y);
    let out = simulation.outputs();
    assert!(out.slack[2] && out.tension[2] == -40.0, "{out:?}");
}

#[test]
fn a_delayed_pose_is_the_pose_of_then() {
    let delayed = moving(&[EffectSpec::new("pose_sensor_delay", None, &[0.1234]).unwrap()]);
    let start = Start { pose: [3.0, -2.0, 0.1], twist: [0.4, 0.7, -0.05], ..Start::default() };
    let mut then = Simulation::new(plant(CableModel::LumpedMass, CableInertia::Paper, &[]), &start, 1e-11).unwrap();
    then.advance(37.0 * 0.013 - 0.1234).unwrap();
    for k in 0..3 {
        let (a, b) = (delayed.outputs().pose[k], then.states()[k]);
        // Between its points, 0.02 s apart at most, the history is a cubic.
        assert!((a - b).abs() < 2e-9, "{a} {b}");
    }
    // Before the start there is the start.
    let mut early =
        Simulation::new(plant(CableModel::LumpedMass, CableInertia::Paper, delayed.plant().effects()), &start, 1e-11)
            .unwrap();
    early.advance(0.05).unwrap();
    assert_eq!(early.outputs().pose, start.pose);
}
