//! How far recorded quantities are from what kinematics and the balance of forces predict of them.

use cdpr::geometry::Geometry;
use cdpr::per_cable::PerCable;
use nalgebra::{Matrix3, Vector3};

use super::LITTLE;
use super::instants::{Instant, SIDE, Window};
use crate::data::clean::median;
use crate::data::{Channel, Trial};
use crate::model::examined::{Examined, gauss_newton_pose};

/// Share of a cable's length by which it may miss the geometry, unnoticed: centimetres at a robot of hundreds of metres.
const LENGTH_FLOOR: f64 = 1e-4;
/// Share of the mean force that may be missing in the balance of forces, unnoticed.
const FORCE_FLOOR: f64 = 2e-3;
/// Share of the mean force by which a tension may differ from its command, unnoticed.
const TENSION_FLOOR: f64 = 5e-3;
/// Strain under the mean force at which no cable holds: the forces are in no such unit.
const TORN: f64 = 0.5;
/// A misfit that is no number, or larger, in floors.
const WORST: f64 = 1e9;

/// What is compared with a prediction: one entry each, in multiples of what may pass unnoticed, one or more; none where nothing can
/// be predicted.
pub(super) type Misfits = Vec<Option<f64>>;

/// Whether somebody measured the pose.
pub(super) fn pose_is_measured(channels: &[Channel]) -> bool {
    (0..3).all(|k| channels.contains(&Channel::Pose(k)))
}

/// The poses of all instants, measured or, where coordinates are missing, from the lengths.
pub(super) fn poses(model: &Examined, channels: &[Channel], windows: &[Window]) -> Vec<Vec<[f64; 3]>> {
    let place = |wanted: Channel| channels.iter().position(|c| *c == wanted);
    let pose: [Option<usize>; 3] = std::array::from_fn(|k| place(Channel::Pose(k)));
    let complete = pose.iter().all(Option::is_some);
    let mut last = [0.0; 3];
    windows
        .iter()
        .map(|window| {
            let at = |instant: &Instant| {
                let known = pose.map(|j| j.map(|j| instant.shown[j]).filter(|v| v.is_finite()));
                if complete {
                    return known.map(|v| v.unwrap_or(f64::NAN));
                }
                let lengths = lengths(model, channels, instant);
                let guess = std::array::from_fn(|k| known[k].unwrap_or(last[k]));
                let found = gauss_newton_pose(model.plant.geometry(), &lengths, &known, guess);
                last = if found.iter().all(|v| v.is_finite()) { found } else { [0.0; 3] };
                found
            };
            window.instants.iter().map(at).collect()
        })
        .collect()
}

/// Lengths from anchor to platform, as measured.
pub(super) fn lengths(model: &Examined, channels: &[Channel], instant: &Instant) -> Vec<Option<f64>> {
    let shown = |wanted: Channel| {
        let j = channels.iter().position(|c| *c == wanted)?;
        Some(instant.shown[j]).filter(|v| v.is_finite())
    };
    model.lengths(shown, &instant.inputs)
}

/// States with the platform at rest at a pose, where the cables have these lengths, carrying their winch forces.
fn states(model: &Examined, instant: &Instant, pose: [f64; 3], chords: &[f64]) -> Vec<f64> {
    let plant = &model.plant;
    let mut y = vec![0.0; model.states()];
    y[..3].copy_from_slice(&pose);
    plant.straighten(&mut y);
    for (i, force) in instant.inputs.winch_force.iter().enumerate() {
        if let Some(at) = plant.unstretched_index(i) {
            let mut own = [0.0; cdpr::dynamics::MAX_EFFECT_STATES];
            let range = plant.effect_states(i);
            own[..range.len()].copy_from_slice(&y[range]);
            y[at] = plant.unstretched_length_for(i, instant.time, chords[i], force.max(0.0), &own);
        }
    }
    y
}

/// What a channel would show in such states; nothing of the pose, along which the others are told.
fn predicted(model: &Examined, channel: Channel, instant: &Instant, chords: &[f64], y: &[f64]) -> Option<f64> {
    let plant = &model.plant;
    match channel {
        Channel::Pose(_) => None,
        Channel::CableLength(i) => Some(plant.shown_lengths(i, chords[i], chords[i])[0]),
        Channel::UnstretchedLength(i) => {
            let paid_out = plant.unstretched_index(i).map_or(chords[i], |at| y[at]);
            Some(plant.shown_lengths(i, chords[i], paid_out)[1])
        }
        Channel::Tension(i) => Some(instant.inputs.winch_force[i]),
    }
}

/// By how much each channel beside the pose is off what is predicted of it: the median of all instants.
pub(super) fn off(model: &Examined, trial: &Trial, windows: &[Window]) -> Vec<(Channel, f64)> {
    let poses = poses(model, &trial.channels, windows);
    let of = |(j, channel): (usize, &Channel)| {
        let all = windows.iter().zip(&poses).flat_map(|(window, poses)| window.instants.iter().zip(poses));
        let off = all.filter_map(|(instant, pose)| {
            let chords = cdpr::kinematics::cable_lengths(model.plant.geometry(), pose);
            let y = states(model, instant, *pose, &chords);
            Some((instant.shown[j] - predicted(model, *channel, instant, &chords, &y)?).abs())
        });
        let off: Vec<f64> = off.collect();
        (!off.is_empty()).then(|| (*channel, median(off)))
    };
    trial.channels.iter().enumerate().filter_map(of).collect()
}

/// The misfits of a reading: of each length, of each axis of the balance of forces, of each tension.
///
/// Where nobody measured the pose it is known only where the lengths agree, and so is the balance. That is taken in its weak form:
/// both sides are weighted over each window by a function that vanishes with its slope
/// at the ends, so that the acceleration becomes the pose weighted by that function's second derivative.
pub(super) fn misfits(model: &Examined, trial: &Trial, noise: &[f64], windows: &[Window]) -> Misfits {
    let poses = poses(model, &trial.channels, windows);
    let plant = &model.plant;
    let usual = cdpr::kinematics::cable_lengths(plant.geometry(), &[0.0; 3]);
    let slack = PerCable::filled(plant.cables(), false);
    let forces: Vec<f64> =
        windows.iter().flat_map(|w| &w.instants).flat_map(|i| i.inputs.winch_force).map(f64::abs).collect();
    let level = forces.iter().sum::<f64>() / forces.len().max(1) as f64;
    let torn = level > TORN * plant.data().cables.iter().map(|c| c.axial_stiffness).fold(f64::INFINITY, f64::min);
    let mut off: Vec<Vec<f64>> = vec![Vec::new(); trial.channels.len()];
    let mut balance = Vec::new();
    for (window, poses) in windows.iter().zip(&poses) {
        let (mut moved, mut pushed, mut mass) = (Vector3::zeros(), Vector3::zeros(), Matrix3::zeros());
        let middle = Vector3::from(poses[SIDE]);
        for (k, (instant, pose)) in window.instants.iter().zip(poses).enumerate() {
            let chords = cdpr::kinematics::cable_lengths(plant.geometry(), pose);
            let y = states(model, instant, *pose, &chords);
            for (j, channel) in trial.channels.iter().enumerate() {
                if let Some(predicted) = predicted(model, *channel, instant, &chords, &y) {
                    off[j].push((instant.shown[j] - predicted).abs());
                }
            }
            let e = plant.evaluate(instant.time, &y, &instant.inputs, &slack);
            let (weight, curvature) = weak(k as f64 / SIDE as f64 - 1.0);
            let step = window.step * SIDE as f64;
            moved += (Vector3::from(*pose) - middle) * (curvature / (step * step));
            pushed += Vector3::from(e.acceleration) * weight;
            if k == SIDE {
                mass = mass_matrix(model, instant, &y, e.acceleration);
            }
        }
        let weights: f64 = (0..=2 * SIDE).map(|k| weak(k as f64 / SIDE as f64 - 1.0).0).sum();
        balance.push(mass * (moved - pushed) / weights);
    }
    let arm = usual_arm(plant.geometry());
    let in_floors = |misfit: f64, floor: f64| {
        let multiple = misfit / floor;
        if multiple.is_finite() && !torn { multiple.clamp(1.0, WORST) } else { WORST }
    };
    let mut out = Vec::new();
    let mut known = true;
    for (j, channel) in trial.channels.iter().enumerate() {
        let misfit = median(std::mem::take(&mut off[j]));
        let multiple = match *channel {
            Channel::Pose(_) => continue,
            Channel::CableLength(i) | Channel::UnstretchedLength(i) => {
                in_floors(misfit, (LENGTH_FLOOR * usual[i]).max(noise[j]))
            }
            Channel::Tension(_) => in_floors(misfit, TENSION_FLOOR * level),
        };
        known &= matches!(channel, Channel::Tension(_)) || multiple <= LITTLE;
        out.push(Some(multiple));
    }
    known |= pose_is_measured(&trial.channels);
    for axis in 0..3 {
        let square = balance.iter().map(|b| b[axis] * b[axis]).sum::<f64>() / balance.len() as f64;
        let multiple = in_floors(square.sqrt() / if axis == 2 { arm } else { 1.0 }, FORCE_FLOOR * level);
        out.push(known.then_some(multiple));
    }
    out
}

/// The mass that a wrench on the platform moves, cables included: what a known wrench adds to the acceleration says it.
fn mass_matrix(model: &Examined, instant: &Instant, y: &[f64], acceleration: [f64; 3]) -> Matrix3<f64> {
    const WRENCH: f64 = 1e3;
    let slack = PerCable::filled(model.plant.cables(), false);
    let mobility = Matrix3::from_columns(&[0, 1, 2].map(|axis| {
        let mut inputs = instant.inputs;
        inputs.disturbance[axis] += WRENCH;
        let more = model.plant.evaluate(instant.time, y, &inputs, &slack).acceleration;
        (Vector3::from(more) - Vector3::from(acceleration)) / WRENCH
    }));
    mobility.try_inverse().unwrap_or_else(|| Matrix3::from_element(f64::NAN))
}

/// Mean distance of the attachments from the platform's centre (m).
fn usual_arm(geometry: &Geometry) -> f64 {
    let arms = geometry.attachment.map(|b| b[0].hypot(b[1]));
    (arms.iter().sum::<f64>() / arms.len() as f64).max(1e-3)
}

/// `(1 - s²)⁴` and its second derivative.
fn weak(s: f64) -> (f64, f64) {
    let rest = (1.0 - s * s).max(0.0);
    (rest.powi(4), 8.0 * rest * rest * (7.0 * s * s - 1.0))
}
