//! Recordings against the model, before any search: units, signs, exchanged columns, other origins and frames, another robot.
//!
//! What was recorded is compared with what the geometry says of the cables' lengths and the balance of forces of the motion.
//! Where the reading as given misses by far, a small family of other readings is tried, and one is believed only if it explains
//! what was recorded. What a missing effect does, friction or an anchor that is off, no other reading explains.

mod change;
mod clock;
mod instants;
mod misfit;

use cdpr::model_file::Model;
use rayon::prelude::*;

use crate::calibrate::computed_pose;
use crate::data::clean::noise_by_differences;
use crate::data::{Channel, Trial};
use crate::model::examined::Examined;
use change::{Change, Column};
use instants::{Window, windows};
use misfit::{Misfits, misfits, pose_is_measured};

/// By how much a reading must shrink the misfits that it changes (their geometric mean) to be believed where it explains all.
const EXPLAINS: f64 = 5.0;
/// What it may leave then, in multiples of what may pass unnoticed.
const LITTLE: f64 = 5.0;
/// By how much where it leaves more: something else is missing too.
const OVERWHELMS: f64 = 100.0;
/// By which factor a misfit must differ for a reading to have changed it.
const CHANGED: f64 = 1.5;
/// Most readings that are put right together.
const MOST: usize = 4;
/// Share of the samples of a winch force below zero from which the column counts pushes.
const PUSHES: f64 = 0.9;
/// By how much a winch may pull more or less than recorded, as a share, before its column is thought to be another one.
const MOST_GAIN: f64 = 0.2;
/// Sections in which such a gain is looked for: to 0.1 %.
const SECTIONS: usize = 12;
/// Share of its length by which a cable may miss the geometry of the robot that was recorded.
const SAME_ROBOT: f64 = 0.25;

/// Checks trials against a model. Returns remarks.
///
/// # Errors
/// What no search should begin with, a line for each: what is seen, and what to write in the map.
pub(crate) fn check<'a>(model: &Model, trials: impl Iterator<Item = &'a Trial>) -> Result<Vec<String>, String> {
    let Ok(examined) = Examined::new(model) else { return Ok(Vec::new()) };
    let (mut remarks, mut errors) = (Vec::new(), Vec::new());
    for trial in trials {
        if let Err(message) = clock::check(trial) {
            errors.push(format!("{}: {message}", trial.name));
            continue;
        }
        remarks.extend(computed_pose(model, trial).map(|seen| format!("{}: {seen}", trial.name)));
        errors.extend(readings(&examined, trial).into_iter().map(|message| format!("{}: {message}", trial.name)));
    }
    if errors.is_empty() { Ok(remarks) } else { Err(errors.join("\n")) }
}

/// What is wrong with the reading of a trial.
fn readings(model: &Examined, trial: &Trial) -> Vec<String> {
    let channels = &trial.channels;
    let noise: Vec<f64> = (0..channels.len()).map(|j| noise_by_differences(trial, j).max(0.0)).collect();
    let mut windows = windows(trial);
    let mut words = Vec::new();
    let pushing = pushing(trial);
    if !pushing.is_empty() {
        let change = Change::Scale(pushing, -1.0, None);
        words.push(format!("cables pull, and {}", change.words()));
        windows = change.apply(channels, &windows);
    }
    let mut now = misfits(model, trial, &noise, &windows);
    while words.len() < MOST && now.iter().flatten().any(|m| *m > LITTLE) {
        let tried = |changes: Vec<Vec<Change>>| {
            let read = changes.into_par_iter().filter_map(|changes| {
                let read = changes.iter().fold(windows.clone(), |w, change| change.apply(channels, &w));
                let then = misfits(model, trial, &noise, &read);
                gain(&now, &then).map(|gain| (gain, changes, read, then))
            });
            read.max_by(|a, b| a.0.total_cmp(&b.0))
        };
        let single = change::all(model, trial, &windows).into_iter().map(|change| vec![change]).collect();
        // Two kinds of columns in other units hide each other; what misses by so much is no missing effect. From zeros of their own
        // lengths fit any geometry in any small unit, where nobody measured the pose.
        let pairs = || {
            let hidden = now.iter().flatten().any(|m| *m > OVERWHELMS);
            let pairs = change::units(trial).into_iter().filter(|_| hidden).flat_map(|first| {
                let read = first.apply(channels, &windows);
                let second = change::of_whole_kinds(model, trial, &read).into_iter();
                let second = second.filter(|second| pose_is_measured(channels) || !second.is_origin());
                second.map(move |second| vec![first.clone(), second])
            });
            tried(pairs.collect())
        };
        let Some((_, changes, read, then)) = tried(single).or_else(pairs) else { break };
        let misfits = |windows: &[Window]| misfits(model, trial, &noise, windows);
        if changes.iter().any(Change::exchanges_forces) && is_gain(channels, &windows, &then, misfits) {
            break;
        }
        words.extend(changes.iter().map(Change::words));
        (windows, now) = (read, then);
    }
    if words.is_empty() {
        words.extend(another_robot(model, trial, &windows));
    }
    if words.is_empty() && !pose_is_measured(channels) {
        words.extend(lengths_that_disagree(model, trial, &windows));
    }
    words
}

/// Winch forces that are below zero nearly throughout.
fn pushing(trial: &Trial) -> Vec<Column> {
    let negative = |i: &usize| {
        let count = trial.inputs.iter().filter(|inputs| inputs.winch_force[*i] < 0.0).count();
        count as f64 > PUSHES * trial.len() as f64
    };
    (0..trial.inputs[0].winch_force.len()).filter(negative).map(Column::Force).collect()
}

/// By how much a reading lowers the sum of the misfits' logarithms; `None` where that is not enough to believe it.
fn gain(now: &Misfits, then: &Misfits) -> Option<f64> {
    let changed: Vec<(f64, f64)> =
        now.iter().zip(then).filter_map(|(a, b)| (*a).zip(*b)).filter(|(a, b)| (a / b).max(b / a) > CHANGED).collect();
    if changed.is_empty() {
        return None;
    }
    let count = changed.len() as f64;
    let gain: f64 = changed.iter().map(|(a, b)| (a / b).ln()).sum();
    let left = (changed.iter().map(|(_, b)| b.ln()).sum::<f64>() / count).exp();
    let factor = (gain / count).exp();
    (factor >= if left <= LITTLE { EXPLAINS } else { OVERWHELMS }).then_some(gain)
}

/// Whether one winch that pulls a little more or less explains as much as what leaves `then`: where forces hardly vary, another
/// one of about the same size in its place does nothing else.
fn is_gain(
    channels: &[Channel],
    windows: &[Window],
    then: &Misfits,
    misfits: impl Fn(&[Window]) -> Misfits + Sync,
) -> bool {
    let logarithms = |misfits: &Misfits| misfits.iter().flatten().map(|m| m.ln()).sum::<f64>();
    let left = logarithms(then);
    let best = |cable: usize| {
        let with = |gain: f64| {
            let change = Change::Scale(vec![Column::Force(cable)], gain, None);
            logarithms(&misfits(&change.apply(channels, windows)))
        };
        // The misfits fall and rise once: golden sections.
        let (mut low, mut high) = (1.0 - MOST_GAIN, 1.0 + MOST_GAIN);
        let section = |low: f64, high: f64, share: f64| low + share * (high - low);
        const GOLDEN: f64 = 0.618_033_988_75;
        let (mut a, mut b) = (section(low, high, 1.0 - GOLDEN), section(low, high, GOLDEN));
        let (mut at_a, mut at_b) = (with(a), with(b));
        for _ in 0..SECTIONS {
            if at_a < at_b {
                (high, b, at_b) = (b, a, at_a);
                a = section(low, high, 1.0 - GOLDEN);
                at_a = with(a);
            } else {
                (low, a, at_a) = (a, b, at_b);
                b = section(low, high, GOLDEN);
                at_b = with(b);
            }
        }
        at_a.min(at_b)
    };
    let cables = windows.first().map_or(0, |window| window.instants[0].inputs.winch_force.len());
    (0..cables).into_par_iter().any(|cable| best(cable) <= left)
}

/// That lengths by which alone the pose is known fit no pose, by more than errors of a calibration are.
fn lengths_that_disagree(model: &Examined, trial: &Trial, windows: &[Window]) -> Option<String> {
    let usual = cdpr::kinematics::cable_lengths(model.plant.geometry(), &[0.0; 3]);
    let far = |(channel, off): (Channel, f64)| match channel {
        Channel::CableLength(i) | Channel::UnstretchedLength(i) => {
            (off > change::ANOTHER_ORIGIN * usual[i]).then(|| format!("{} by {off:.3} m", channel.name()))
        }
        Channel::Pose(_) | Channel::Tension(_) => None,
    };
    let far: Vec<String> = misfit::off(model, trial, windows).into_iter().filter_map(far).collect();
    (!far.is_empty()).then(|| {
        format!(
            "the lengths fit no pose of the model's geometry, also not where they fit it best: {} are off there. Does one count from \
             another zero (`offset` in the map), or is the geometry another one? `cdpr calibrate` tells, and writes a model that fits them.",
            far.join(", ")
        )
    })
}

/// That the recorded robot is not the model's.
fn another_robot(model: &Examined, trial: &Trial, windows: &[Window]) -> Option<String> {
    let geometry = model.plant.geometry();
    let reach = geometry.anchor.iter().map(|a| a[0].hypot(a[1])).fold(0.0, f64::max);
    let poses = misfit::poses(model, &trial.channels, windows);
    let far = poses.iter().flatten().find(|pose| geometry.between_anchors && pose[0].hypot(pose[1]) > reach);
    if let Some([x, y, _]) = far {
        return Some(format!(
            "the platform is at x = {x:.3} m, y = {y:.3} m, outside the model's anchors, which are at most {reach:.3} m from \
             the centre. Is it the recordings' robot that the model describes? Else see to units, origin and frame in the map."
        ));
    }
    for (instant, pose) in windows.iter().zip(&poses).flat_map(|(w, poses)| w.instants.iter().zip(poses)) {
        let expected = cdpr::kinematics::cable_lengths(geometry, pose);
        for (j, channel) in trial.channels.iter().enumerate() {
            let (i, sensor) = match *channel {
                Channel::CableLength(i) => (i, 0),
                Channel::UnstretchedLength(i) => (i, 1),
                _ => continue,
            };
            let found = instant.shown[j];
            let expected = model.plant.shown_lengths(i, expected[i], expected[i])[sensor];
            if (found - expected).abs() > SAME_ROBOT * expected {
                return Some(format!(
                    "{} is {found:.3} m at x = {:.3} m, y = {:.3} m, phi = {:.4} rad, where the model's geometry has {:.3} m, \
                     and no other unit, order or origin explains it. Is it the recordings' robot that the model describes?",
                    channel.name(),
                    pose[0],
                    pose[1],
                    pose[2],
                    expected
                ));
            }
        }
    }
    None
}

#[cfg(test)]
mod tests;
