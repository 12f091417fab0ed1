//! Known errors of a geometry, found again.

use cdpr::dynamics::Inputs;
use cdpr::effect::EffectSpec;
use cdpr::geometry::Geometry;
use cdpr::kinematics::cable_lengths;
use cdpr::parameters::{CableParameters, Parameters};

use super::*;
use crate::data::recording::noise;

pub(super) const PULL: f64 = 100.0;
const POSE_NOISE: [f64; 3] = [5e-4, 5e-4, 5e-4];
const LENGTH_NOISE: f64 = 5e-4;

/// A robot of 4 m with so many cables.
pub(super) fn laboratory(cables: usize) -> Model {
    let cable = (0..cables).map(|i| {
        let angle = std::f64::consts::TAU * (i as f64 + 0.5) / cables as f64;
        let turned = angle + if i % 2 == 0 { 0.9 } else { -0.9 };
        CableParameters::between([2.0 * angle.cos(), 2.0 * angle.sin()], [0.2 * turned.cos(), 0.2 * turned.sin()])
    });
    let parameters = Parameters {
        platform_mass: 20.0,
        platform_inertia: 0.4,
        cable_density: 0.02,
        cable_area: 4e-6,
        cable_damping: 100.0,
        cable: cable.collect(),
        ..Parameters::default()
    };
    Model { parameters, ..Model::default() }
}

/// The same whose cables meet in a point.
pub(super) fn point() -> Model {
    let mut model = laboratory(4);
    model.parameters.cable.iter_mut().for_each(|cable| cable.attachment = [0.0; 2]);
    model
}

/// A robot with its anchors shifted (m).
pub(super) fn shifted(model: &Model, by: [[f64; 2]; 4]) -> Model {
    let mut model = model.clone();
    for (cable, [x, y]) in model.parameters.cable.iter_mut().zip(by) {
        cable.anchor = [cable.anchor[0] + x, cable.anchor[1] + y];
    }
    model
}

/// A recording of a robot with this model, moved by so much (m, rad): poses, paid-out lengths, and cable lengths where wanted.
pub(super) fn recorded(model: &Model, reach: [f64; 3], samples: usize, seed: u64, chords: bool) -> Trial {
    let geometry = Geometry::new(&model.parameters);
    let cables = geometry.cables();
    let stiffness = model.parameters.axial_stiffness();
    let offset = |name: &str, cable: usize| -> f64 {
        let of = model.effects.iter().filter(|e| e.channel.as_deref() == Some(name) && e.cable == Some(cable + 1));
        of.map(|e| e.values[0]).sum()
    };
    let mut channels: Vec<Channel> = (0..3).map(Channel::Pose).collect();
    channels.extend((0..cables).map(Channel::UnstretchedLength));
    channels.extend((0..cables).filter(|_| chords).map(Channel::CableLength));
    let mut random = noise(samples * channels.len(), seed);
    let mut measured = Vec::new();
    let time: Vec<f64> = (0..samples).map(|k| 0.05 * k as f64).collect();
    for t in &time {
        let wave = |rate: f64, phase: f64| 0.7 * (rate * t + phase).sin() + 0.3 * (2.7 * rate * t).cos();
        let pose = [reach[0] * wave(0.31, 0.2), reach[1] * wave(0.43, 1.1), reach[2] * wave(0.59, 2.3)];
        let lengths = cable_lengths(&geometry, &pose);
        let mut row: Vec<f64> = pose.to_vec();
        row.extend((0..cables).map(|i| lengths[i] / (1.0 + PULL / stiffness) + offset("unstretched_length", i)));
        row.extend((0..cables).filter(|_| chords).map(|i| lengths[i] + offset("cable_length", i)));
        let size = |j: usize| POSE_NOISE.get(j).copied().unwrap_or(LENGTH_NOISE);
        row.iter_mut().enumerate().for_each(|(j, v)| *v += size(j) * random.next().expect("enough noise"));
        measured.push(row);
    }
    let mut inputs = Inputs::none(cables);
    inputs.winch_force.iter_mut().for_each(|force| *force = PULL);
    Trial {
        name: "made".to_owned(),
        inputs: vec![inputs; samples],
        time,
        channels,
        measured,
        taken_off: Vec::new(),
        undone: Vec::new(),
    }
}

/// The model of the robot as it is: everything a little off.
fn moved(model: &Model, by: f64, seed: u64) -> Model {
    let mut random = noise(100, seed);
    let mut off = || by * random.next().expect("enough noise");
    let mut model = model.clone();
    for i in 0..model.parameters.cable.len() {
        let cable = &mut model.parameters.cable[i];
        cable.anchor.iter_mut().chain(&mut cable.attachment).for_each(|v| *v += off());
        let mut bias = EffectSpec::new("length_sensor_bias", Some(i + 1), &[off()]).expect("an effect");
        bias.channel = Some("unstretched_length".to_owned());
        model.effects.push(bias);
    }
    model
}

/// True minus given, in the order of the corrections.
fn truth(found: &Calibration, given: &Model, real: &Model) -> Vec<f64> {
    let number = |model: &Model, name: &str| -> f64 {
        let at = name.split(['[', ']']).nth(1).and_then(|n| n.parse::<usize>().ok()).expect("a cable");
        let axis = usize::from(name.ends_with('y'));
        let cable = &model.parameters.cable[at - 1];
        match name {
            _ if name.starts_with("anchor") => cable.anchor[axis],
            _ if name.starts_with("attachment") => cable.attachment[axis],
            _ => model.effects.iter().filter(|e| e.cable == Some(at)).map(|e| e.values[0]).sum(),
        }
    };
    found.corrections.iter().map(|c| number(real, &c.name) - number(given, &c.name)).collect()
}

#[test]
fn known_errors_of_four_and_eight_cables_are_found_within_their_errors() {
    for cables in [4, 8] {
        let given = laboratory(cables);
        let real = moved(&given, 3e-3, 7);
        let trials = [1, 2].map(|seed| recorded(&real, [0.8, 0.7, 0.5], 1500, seed, false));
        let found = calibrate(&given, &trials).expect("a calibration");
        assert_eq!((found.corrections.len(), found.held.len()), (5 * cables, 0), "{:?}", found.held);
        let truth = truth(&found, &given, &real);
        let errors: Vec<f64> =
            found.corrections.iter().zip(&truth).map(|(c, truth)| (c.change - truth) / c.standard_error).collect();
        let within = errors.iter().filter(|e| e.abs() < 2.0).count();
        // One in twenty is further off than two.
        assert!(within as f64 >= 0.85 * errors.len() as f64 && errors.iter().all(|e| e.abs() < 4.0), "{errors:?}");
        // And the errors are small: a tenth of what was off.
        assert!(found.corrections.iter().all(|c| c.standard_error < 1e-3), "{:?}", found.corrections);
        assert!((0.9..1.3).contains(&found.widened), "{}", found.widened);
        let worst = found.misfits.iter().map(|m| m.after / m.before).fold(0.0, f64::max);
        assert!(worst < 0.6, "{:?}", found.misfits);
        let again = calibrate(&found.model, &trials).expect("a calibration");
        assert!(again.corrections.iter().all(|c| c.change.abs() < 1e-6), "{:?}", again.corrections);
    }
}

#[test]
fn what_a_small_motion_does_not_tell_is_held_and_named() {
    let given = laboratory(4);
    let real = moved(&given, 3e-3, 7);
    let found = calibrate(&given, &[recorded(&real, [0.02, 0.02, 0.02], 1500, 3, false)]).expect("a calibration");
    assert!(!found.held.is_empty());
    assert!(found.held.iter().any(|held| held.contains("anchor[1]")), "{:?}", found.held);
    assert!(found.corrections.iter().any(|c| c.told < TOLD));
    // What is held is not moved to and fro: no correction is beyond what is plausible by much.
    assert!(found.corrections.iter().all(|c| c.change.abs() < 0.03), "{:?}", found.corrections);
    let noise = found.misfits.iter().map(|m| m.after).fold(0.0, f64::max);
    assert!(noise < 2.0 * LENGTH_NOISE, "{:?}", found.misfits);
}

#[test]
fn a_pose_in_another_frame_is_found_as_a_shift_and_a_turn() {
    let given = laboratory(4);
    let mut real = given.clone();
    let (shift, turn) = ([4e-3, -7e-3], 2e-3);
    for cable in &mut real.parameters.cable {
        let [x, y] = cable.anchor;
        cable.anchor = [x + shift[0] - turn * y, y + shift[1] + turn * x];
    }
    let found = calibrate(&given, &[recorded(&real, [0.8, 0.7, 0.5], 1500, 5, true)]).expect("a calibration");
    let Frame { shift: [x, y], turn: turned } = found.frame;
    for ((value, error), truth) in [(x, shift[0]), (y, shift[1]), (turned, turn)] {
        assert!((value - truth).abs() < 3.0 * error && error < 5e-4, "{value} ± {error}, {truth}");
    }
}

/// A robot whose encoders are all that was recorded was refused. Four cables tell where a point is and two numbers more.
#[test]
fn lengths_alone_tell_the_geometry_that_they_share() {
    let point = |mut model: Model| {
        model.parameters.cable.iter_mut().for_each(|cable| cable.attachment = [0.0; 2]);
        model
    };
    for (given, turn) in [(laboratory(8), 0.5), (point(laboratory(4)), 0.0)] {
        let mut real = given.clone();
        let mut random = noise(100, 4);
        for cable in &mut real.parameters.cable {
            cable.anchor.iter_mut().for_each(|v| *v += 0.02 * random.next().expect("enough noise"));
        }
        let mut trial = recorded(&real, [0.8, 0.7, turn], 1500, 11, true);
        let lengths = |channel: &Channel| matches!(channel, Channel::CableLength(_));
        let kept: Vec<usize> = (0..trial.channels.len()).filter(|j| lengths(&trial.channels[*j])).collect();
        trial.measured.iter_mut().for_each(|row| *row = kept.iter().map(|j| row[*j]).collect());
        trial.channels.retain(lengths);
        let found = calibrate(&given, &[trial]).expect("a calibration");
        // A frame of their own is all that the poses then have: it is held.
        let Frame { shift: [x, y], turn: turned } = found.frame;
        assert!([x, y, turned].iter().all(|(value, _)| value.abs() < 0.02), "{:?}", found.frame);
        assert!(found.corrections.iter().any(|correction| correction.told < TOLD), "{:?}", found.corrections);
        // Attachments a hair off the point put cables through the platform.
        let attachments = found.model.parameters.cable.iter().map(|cable| cable.attachment);
        assert!(turn > 0.0 || attachments.flatten().all(|coordinate| coordinate == 0.0));
        for misfit in &found.misfits {
            assert!(misfit.before > 5.0 * LENGTH_NOISE && misfit.after < 1.1 * LENGTH_NOISE, "{:?}", found.misfits);
        }
        assert!((0.9..1.3).contains(&found.widened), "{}", found.widened);
        // What is between the anchors, sides and diagonals, does not depend on the frame.
        let apart = |model: &Model, i: usize, k: usize| {
            let [a, b] = [i, k].map(|i| model.parameters.cable[i].anchor);
            (a[0] - b[0]).hypot(a[1] - b[1])
        };
        for (i, k) in (0..given.parameters.cable.len()).flat_map(|k| (0..k).map(move |i| (i, k))) {
            let error = apart(&found.model, i, k) - apart(&real, i, k);
            assert!(error.abs() < 0.01, "{i} {k} {error}");
        }
    }
}

/// Errors of centimetres counted as noise with a memory, so long that nothing was told apart from it and all was held.
#[test]
fn what_corrections_explain_does_not_hold_them() {
    let given = laboratory(4);
    let real = moved(&given, 0.1, 7);
    let found = calibrate(&given, &[recorded(&real, [0.8, 0.7, 0.5], 1500, 11, false)]).expect("a calibration");
    assert!(found.held.is_empty(), "{:?}", found.held);
    for misfit in &found.misfits {
        assert!(misfit.before > 0.05 && misfit.after < 1.5 * LENGTH_NOISE, "{:?}", found.misfits);
    }
}

#[test]
fn outliers_do_not_count() {
    let given = laboratory(4);
    let real = moved(&given, 3e-3, 7);
    let mut trial = recorded(&real, [0.8, 0.7, 0.5], 1500, 9, false);
    for k in (0..trial.len()).step_by(40) {
        let channels = trial.channels.len();
        trial.measured[k][3 + k % (channels - 3)] += 0.5;
    }
    let found = calibrate(&given, &[trial]).expect("a calibration");
    let truth = truth(&found, &given, &real);
    let off = found.corrections.iter().zip(&truth).map(|(c, t)| ((c.change - t) / c.standard_error).abs());
    assert!(off.fold(0.0, f64::max) < 4.0, "{:?}", found.corrections);
    assert!(found.outliers >= 38, "{}", found.outliers);
}

#[test]
fn recordings_that_cannot_tell_are_refused() {
    let given = laboratory(4);
    let whole = recorded(&given, [0.5; 3], 100, 1, false);
    let message = |trial: Trial| match calibrate(&given, &[trial]) {
        Err(CalibrateError::Data(message)) => message,
        other => panic!("{other:?}"),
    };
    let only = |keep: &dyn Fn(&Channel) -> bool| {
        let mut trial = whole.clone();
        let kept: Vec<usize> = (0..trial.channels.len()).filter(|j| keep(&trial.channels[*j])).collect();
        trial.channels = kept.iter().map(|j| whole.channels[*j]).collect();
        trial.measured.iter_mut().for_each(|row| *row = kept.iter().map(|j| row[*j]).collect());
        trial
    };
    let three = message(only(&|c| matches!(c, Channel::UnstretchedLength(i) if *i < 3)));
    assert!(three.starts_with("x, y, phi not measured, and no length is left over"), "{three}");
    let one = message(only(&|c| matches!(c, Channel::Pose(0 | 1) | Channel::UnstretchedLength(2))));
    assert!(one.starts_with("phi not measured, and no length is left over"), "{one}");
    let without_lengths = message(only(&|c| matches!(c, Channel::Pose(_))));
    assert!(without_lengths.contains("expected columns cable_length[i] or unstretched_length[i]"), "{without_lengths}");
    let short = message(whole.part(0..30, "short".to_owned()));
    assert!(short.contains("30 samples with a length"), "{short}");
    let eight = message(recorded(&laboratory(8), [0.5; 3], 100, 1, false));
    assert!(eight.contains("8 winch forces, expected 4"), "{eight}");
    assert!(calibrate(&given, &[]).is_err());
    let mut by_torque = given.clone();
    by_torque.parameters.winch.command = cdpr::winch::WinchCommand::Torque;
    by_torque.parameters.winch.rotor_inertia = Some(1e-3);
    let unknown = calibrate(&by_torque, std::slice::from_ref(&whole)).expect_err("no tension").to_string();
    assert!(unknown.contains("needs the tension"), "{unknown}");
    let mut without_forces = whole;
    without_forces.inputs.iter_mut().for_each(|inputs| inputs.winch_force.iter_mut().for_each(|f| *f = f64::NAN));
    let unknown = calibrate(&given, &[without_forces]).expect_err("no tension").to_string();
    assert!(unknown.contains("needs the tension"), "{unknown}");
}

/// A take of motion capture beside a log of lengths.
#[test]
fn lengths_of_the_cables_need_no_forces() {
    let given = laboratory(4);
    let mut whole = recorded(&given, [0.5; 3], 100, 1, true);
    whole.channels.drain(3..7);
    whole.measured.iter_mut().for_each(|row| drop(row.drain(3..7)));
    let mut without = whole.clone();
    without.inputs.iter_mut().for_each(|inputs| inputs.winch_force.iter_mut().for_each(|f| *f = f64::NAN));
    let corrections = |trial: Trial| calibrate(&given, &[trial]).expect("a calibration").corrections;
    assert_eq!(corrections(without), corrections(whole));
}

/// Lengths in mm came out as a model with nothing corrected, and without an error.
#[test]
fn lengths_that_no_geometry_explains_are_refused() {
    let given = laboratory(4);
    let whole = recorded(&given, [0.5; 3], 100, 1, false);
    for wrong in [1e3, 1e300] {
        let mut trial = whole.clone();
        trial.measured.iter_mut().flat_map(|row| &mut row[3..]).for_each(|length| *length *= wrong);
        let error = calibrate(&given, &[trial]).expect_err("no calibration").to_string();
        assert!(error.contains("length[1] is ") && error.contains("`scale` in the map"), "{error}");
    }
    let mut pose = whole;
    pose.measured.iter_mut().for_each(|row| row[1] *= 1e3);
    assert!(calibrate(&given, &[pose]).is_err());
}

/// Drums of a real robot were some 7 % smaller than its firmware had them, and the calibration ended without a word of that.
#[test]
fn lengths_of_another_scale_come_with_that_scale() {
    let given = laboratory(4);
    let mut trial = recorded(&given, [1.2, 1.2, 0.3], 300, 1, true);
    let whole = calibrate(&given, std::slice::from_ref(&trial)).expect("a calibration");
    assert!(whole.remarks.is_empty(), "{:?}", whole.remarks);
    trial.measured.iter_mut().flat_map(|row| &mut row[3..]).for_each(|length| *length *= 1.07);
    let seen = match calibrate(&given, &[trial]) {
        Ok(found) => found.remarks.join(" "),
        Err(error) => error.to_string(),
    };
    assert!((1..=4).all(|cable| seen.contains(&format!("length[{cable}] times 0.93"))), "{seen}");
}

#[test]
fn lengths_that_no_cable_has_are_named() {
    let mut trial = recorded(&laboratory(4), [0.5; 3], 100, 1, false);
    assert_eq!(no_length(std::slice::from_ref(&trial)), None);
    (10..30).for_each(|k| trial.measured[k][4] = -0.02);
    let seen = no_length(&[trial]).expect("a remark");
    assert!(seen.contains("unstretched_length[2] is -0.02 m at 0.5 s") && seen.contains("in 20 rows"), "{seen}");
}
