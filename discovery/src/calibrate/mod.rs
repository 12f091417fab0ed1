//! Geometry from the kinematics of recordings alone: anchors, attachments, offsets of length sensors, the frame of the pose.
//!
//! Each cable's measured length is compared with the distance of its ends at the measured pose, or where the lengths together
//! tell it to be, an unstretched length with what of that distance is paid out under the cable's tension. What explains the
//! differences best is found by weighted nonlinear least squares, the pose's own noise taken into account (W. A. Fuller,
//! Measurement Error Models, Wiley 1987), robustly (P. J. Huber, Robust Statistics, Wiley 1981). Directions in which the
//! recordings know the geometry no better than anybody who builds such a machine are held at the given value, by the singular
//! values of the problem (C. L. Lawson and R. J. Hanson, Solving Least Squares Problems, 1974). No standard error rests on a
//! prior.

mod before;
mod computed;
mod plausible;
mod problem;
mod solve;
#[cfg(test)]
mod tests;

use cdpr::model_file::Model;
use nalgebra::DMatrix;

pub(crate) use before::{Corrected, correct_before_search};
pub(crate) use computed::{computed_pose, leave_out_computed_poses};

use crate::data::{Channel, Trial};
use crate::hypothesis::survey::shift_length;

use problem::{Problem, Unknown};
use solve::{Solution, solve};

/// Why there is no calibration.
#[derive(Debug, thiserror::Error)]
pub enum CalibrateError {
    /// Recordings that cannot be used.
    #[error("{0}")]
    Data(String),
    /// A model that cannot be built.
    #[error("the model cannot be built: {0}")]
    Model(String),
    /// Pulleys of finite radius.
    #[error(
        "cable {cable} leaves a pulley; expected a model without `pulley_radius`, whose cables are straight from their anchors"
    )]
    Pulley {
        /// Cable, from 1.
        cable: usize,
    },
    /// Corrections that do not settle.
    #[error(
        "the corrections do not settle in {rounds} rounds; the last moved by {moved:.1e} standard errors. Is it the recordings' robot that the model describes?"
    )]
    NotSettled {
        /// Rounds of least squares.
        rounds: usize,
        /// Largest last move, in standard errors.
        moved: f64,
    },
}

/// One number of the geometry.
#[derive(Clone, Debug, PartialEq)]
pub struct Correction {
    /// `anchor[1].x`, `attachment[2].y`, `unstretched_length[3] offset`.
    pub name: String,
    /// As given (m).
    pub given: f64,
    /// What is added to it (m).
    pub change: f64,
    /// Its standard error (m), of what the recordings tell of it.
    pub standard_error: f64,
    /// Share of it that the recordings tell, from 0 to 1; the rest is held at the given value.
    pub told: f64,
}

/// What the anchors' corrections have in common: where all moved alike, the frame of the recorded poses against that of the
/// given anchors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// By how much all anchors are shifted (m), and the standard error.
    pub shift: [(f64, f64); 2],
    /// By how much they are turned about the origin (rad), and the standard error.
    pub turn: (f64, f64),
}

/// The misfit of one channel.
#[derive(Clone, Debug, PartialEq)]
pub struct ChannelMisfit {
    /// The channel.
    pub channel: Channel,
    /// Root mean square with the model as given (m), outliers left out.
    pub before: f64,
    /// With the corrected one (m).
    pub after: f64,
    /// Numbers compared.
    pub samples: usize,
}

/// A corrected model.
#[derive(Clone, Debug)]
pub struct Calibration {
    /// The model with corrected geometry; offsets are `length_sensor_bias` effects.
    pub model: Model,
    /// All numbers, in the order of the cables.
    pub corrections: Vec<Correction>,
    /// The anchors' common part.
    pub frame: Frame,
    /// Combinations that are held, each by the numbers that move in it.
    pub held: Vec<String>,
    /// By channel.
    pub misfits: Vec<ChannelMisfit>,
    /// Samples that are far off the others and count little.
    pub outliers: usize,
    /// Factor by which the standard errors are widened: what is left is more than the noise, or has a memory.
    pub widened: f64,
    /// What is odd about what is left, a sentence each.
    pub remarks: Vec<String>,
}

/// Share of a correction that must be told for it not to count as held.
pub const TOLD: f64 = 0.99;

/// Corrects the geometry of `model` by recordings.
///
/// # Errors
/// Recordings without lengths, or without any to spare where the pose is not measured, a tension that is not known, corrections
/// that do not settle or leave more than a tenth of how a length moves.
pub fn calibrate(model: &Model, trials: &[Trial]) -> Result<Calibration, CalibrateError> {
    let mut measured = trials.to_vec();
    let left_out = leave_out_computed_poses(model, measured.iter_mut());
    let trials = &measured[..];
    let problem = Problem::new(model, trials)?;
    let solution = solve(&problem).map_err(|error| {
        let seen: Vec<String> = no_length(trials).into_iter().chain(plausible::in_proportion(&problem)).collect();
        if seen.is_empty() { error } else { CalibrateError::Data(format!("{error} {}", seen.join(" "))) }
    })?;
    let mut remarks: Vec<String> = left_out.into_iter().collect();
    remarks.extend(plausible::check(&problem, &solution).map_err(CalibrateError::Data)?);
    for trial in trials {
        remarks.extend(computed_pose(model, trial).map(|seen| format!("{}: {seen}", trial.name)));
    }
    let change = &solution.change;
    let corrections = problem.unknowns.iter().enumerate().map(|(k, unknown)| Correction {
        name: unknown.name(),
        given: problem.given(*unknown),
        change: change[k],
        standard_error: solution.covariance[(k, k)].max(0.0).sqrt(),
        told: solution.told[k],
    });
    Ok(Calibration {
        corrections: corrections.collect(),
        frame: frame(&problem, &solution),
        held: held(&problem, &solution),
        misfits: solution.misfits.clone(),
        outliers: solution.outliers,
        widened: solution.widened,
        remarks,
        model: corrected(model, &problem, change.as_slice()),
    })
}

/// Lengths that no cable has, where there are any: a platform that lies at an anchor tells little, and that badly.
fn no_length(trials: &[Trial]) -> Option<String> {
    let mut channels = trials.iter().flat_map(|trial| trial.channels.iter().enumerate().map(move |own| (trial, own)));
    channels.find_map(|(trial, (j, channel))| {
        let (Channel::CableLength(_) | Channel::UnstretchedLength(_)) = channel else { return None };
        let mut none = trial.time.iter().zip(&trial.measured).filter(|(_, row)| row[j] <= 0.0);
        let (time, row) = none.next()?;
        Some(format!(
            "In {} {} is {} m at {time} s, and at or below zero in {} rows, expected a length above zero: leave out rows in \
             which the platform lies at an anchor, or shift the length (`offset` in the map).",
            trial.name,
            channel.name(),
            row[j],
            1 + none.count()
        ))
    })
}

/// The combinations that are held, cable by cable: of each the numbers that have a part in it, the largest first.
fn held(problem: &Problem, solution: &Solution) -> Vec<String> {
    /// Share of the largest part from which one counts.
    const PART: f64 = 0.3;
    /// Share of a cable's combination that must be held.
    const MOSTLY: f64 = 0.5;
    let mut out = Vec::new();
    for cable in 0..problem.geometry.cables() {
        let own: Vec<usize> = (0..problem.unknowns.len()).filter(|k| problem.unknowns[*k].cable() == cable).collect();
        // What is held of this cable: directions that are held alike are mixed between cables.
        let held: DMatrix<f64> = DMatrix::from_fn(own.len(), own.len(), |a, b| {
            solution.held.iter().map(|direction| direction[own[a]] * direction[own[b]]).sum::<f64>()
        });
        if own.is_empty() {
            continue;
        }
        let eigen = held.symmetric_eigen();
        for direction in (0..own.len()).filter(|k| eigen.eigenvalues[*k] > MOSTLY).map(|k| eigen.eigenvectors.column(k))
        {
            let largest = direction.amax();
            let mut parts: Vec<usize> = (0..own.len()).filter(|k| direction[*k].abs() >= PART * largest).collect();
            parts.sort_by(|a, b| direction[*b].abs().total_cmp(&direction[*a].abs()));
            let names: Vec<String> = parts.iter().map(|k| problem.unknowns[own[*k]].name()).collect();
            out.push(names.join(", "));
        }
    }
    out
}

/// Shift and turn that all anchors have in common, by least squares.
fn frame(problem: &Problem, solution: &Solution) -> Frame {
    let anchors: Vec<(usize, [f64; 2], usize)> = (0..problem.unknowns.len())
        .filter_map(|k| match problem.unknowns[k] {
            Unknown::Anchor(cable, axis) => Some((k, problem.geometry.anchor[cable], axis)),
            _ => None,
        })
        .collect();
    let rows = DMatrix::from_fn(anchors.len(), 3, |r, c| {
        let (_, at, axis) = anchors[r];
        match c {
            2 => [-at[1], at[0]][axis],
            c => f64::from(u8::from(c == axis)),
        }
    });
    // Three anchors or more around the origin leave no doubt; else the part that cannot be told is left out.
    let inverse = rows.pseudo_inverse(1e-12).unwrap_or_else(|e| unreachable!("a tolerance above zero: {e}"));
    let mut pick = DMatrix::zeros(anchors.len(), problem.unknowns.len());
    anchors.iter().enumerate().for_each(|(r, (k, ..))| pick[(r, *k)] = 1.0);
    let map = inverse * pick;
    let value = &map * &solution.change;
    let covariance = &map * &solution.covariance * map.transpose();
    let of = |k: usize| (value[k], covariance[(k, k)].max(0.0).sqrt());
    Frame { shift: [of(0), of(1)], turn: of(2) }
}

/// `model` with the corrections in it.
fn corrected(model: &Model, problem: &Problem, change: &[f64]) -> Model {
    let mut model = model.clone();
    let parameters = &mut model.parameters;
    if parameters.cable.is_empty() {
        parameters.cable = parameters.on_circles();
    }
    for (unknown, change) in problem.unknowns.iter().zip(change) {
        match *unknown {
            Unknown::Anchor(cable, axis) => parameters.cable[cable].anchor[axis] += change,
            Unknown::Attachment(cable, axis) => parameters.cable[cable].attachment[axis] += change,
            Unknown::Offset(channel) => {
                let (name, cable) = match channel {
                    Channel::CableLength(cable) => ("cable_length", cable + 1),
                    Channel::UnstretchedLength(cable) => ("unstretched_length", cable + 1),
                    _ => continue,
                };
                shift_length(&mut model.effects, cable, name, *change);
            }
        }
    }
    model
}
