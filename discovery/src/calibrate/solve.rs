//! Robust least squares with what cannot be told held.

use nalgebra::{DMatrix, DVector, Dyn, SymmetricEigen};

use super::problem::{Equations, Problem, Sample};
use super::{CalibrateError, ChannelMisfit};
use crate::data::clean::median;

/// Most rounds.
pub(super) const ROUNDS: usize = 50;
/// Move, in standard errors, below which the corrections have settled.
const SETTLED: f64 = 1e-3;
/// Whitened residual from which a number counts less, in robust standard deviations (Huber's 95 % efficiency).
pub(super) const HUBER: f64 = 1.345;
/// The same from which it is an outlier.
pub(super) const OUTLIER: f64 = 5.0;
/// Longest memory that what is left is asked for, as a share of the samples.
const MEMORY: usize = 20;

/// The corrections with what is known of them.
pub(super) struct Solution {
    pub(super) change: DVector<f64>,
    pub(super) covariance: DMatrix<f64>,
    /// Share of each unknown that is told.
    pub(super) told: Vec<f64>,
    /// Directions that are held, in multiples of what is plausible of each unknown.
    pub(super) held: Vec<DVector<f64>>,
    pub(super) misfits: Vec<ChannelMisfit>,
    pub(super) outliers: usize,
    pub(super) widened: f64,
}

/// The whitened equations of one sample, less those that went into axes of the pose that were not measured.
struct White {
    residual: DVector<f64>,
    slopes: DMatrix<f64>,
    /// Of each row before it is whitened.
    plain: Equations,
}

fn white(problem: &Problem, sample: &Sample, change: &DVector<f64>) -> White {
    let plain = problem.equations(sample, change);
    let mut slopes = plain.whitened(&(&plain.slopes * DMatrix::from_diagonal(&problem.plausible)));
    let residual = DMatrix::from_columns(std::slice::from_ref(&plain.residual));
    let mut residual = plain.whitened(&residual).column(0).into_owned();
    if plain.free.ncols() > 0 {
        let left_over = plain.left_over().transpose();
        (slopes, residual) = (&left_over * slopes, &left_over * residual);
    }
    White { residual, slopes, plain }
}

/// Robust standard deviation.
pub(super) fn deviation(values: impl Iterator<Item = f64>) -> f64 {
    median(values.map(f64::abs).collect()) / 0.674_489_750_2
}

/// Corrections that have settled.
struct Settled {
    change: DVector<f64>,
    /// Directions in multiples of what is plausible, and how well each is told (one over its variance by noise).
    eigen: SymmetricEigen<f64, Dyn>,
    /// Those of them that are told.
    told: Vec<usize>,
    widened: f64,
    scale: f64,
}

/// The whitened equations of all samples at some corrections, the robust size of what is left, and by how much errors are
/// larger for it.
fn look(problem: &Problem, change: &DVector<f64>) -> (Vec<White>, f64, f64) {
    let all: Vec<White> = problem.samples.iter().map(|s| white(problem, s, change)).collect();
    let scale = deviation(all.iter().flat_map(|w| w.residual.iter().copied()));
    // Noise that is larger than it looks counts as noise.
    let scale = scale.max(1.0);
    let widened = widening(problem, &all, scale);
    (all, scale, widened)
}

/// Rounds of least squares from some corrections on, until they settle. Told is what is known better than the `least` (one over
/// the variance by noise, in multiples of what is plausible).
fn settle(problem: &Problem, start: DVector<f64>, least: f64) -> Result<Settled, CalibrateError> {
    let unknowns = problem.unknowns.len();
    let (mut change, mut moved) = (start, f64::INFINITY);
    for _ in 0..ROUNDS {
        let (all, scale, widened) = look(problem, &change);
        let mut gram = DMatrix::<f64>::zeros(unknowns, unknowns);
        let mut right = DVector::<f64>::zeros(unknowns);
        let now = change.component_div(&problem.plausible);
        for w in &all {
            for (r, residual) in w.residual.iter().enumerate() {
                let weight = (HUBER * scale / residual.abs()).min(1.0);
                let row = w.slopes.row(r).transpose();
                gram.ger(weight, &row, &row, 1.0);
                right.axpy(weight * (residual + row.dot(&now)), &row, 1.0);
            }
        }
        if !gram.iter().chain(right.iter()).all(|value| value.is_finite()) {
            return Err(CalibrateError::NotSettled { rounds: ROUNDS, moved: f64::INFINITY });
        }
        let eigen = gram.symmetric_eigen();
        let told: Vec<usize> = (0..unknowns).filter(|k| eigen.eigenvalues[*k] > least).collect();
        let mut next = DVector::<f64>::zeros(unknowns);
        for k in &told {
            let direction = eigen.eigenvectors.column(*k);
            next.axpy(direction.dot(&right) / eigen.eigenvalues[*k], &direction, 1.0);
        }
        let step = &next - &now;
        let in_errors =
            |k: &usize| eigen.eigenvectors.column(*k).dot(&step).abs() * eigen.eigenvalues[*k].sqrt() / widened;
        moved = told.iter().map(in_errors).fold(0.0, f64::max);
        change = next.component_mul(&problem.plausible);
        if moved < SETTLED {
            return Ok(Settled { change, eigen, told, widened, scale });
        }
    }
    Err(CalibrateError::NotSettled { rounds: ROUNDS, moved })
}

/// How large corrections are, as a mean square in multiples of what is plausible, by the directions that are told; one or
/// more.
fn usual_square(problem: &Problem, settled: &Settled) -> f64 {
    let now = settled.change.component_div(&problem.plausible);
    let squares = settled.told.iter().map(|k| settled.eigen.eigenvectors.column(*k).dot(&now).powi(2));
    (squares.sum::<f64>() / settled.told.len().max(1) as f64).max(1.0)
}

pub(super) fn solve(problem: &Problem) -> Result<Solution, CalibrateError> {
    let unknowns = problem.unknowns.len();
    let nothing = DVector::<f64>::zeros(unknowns);
    // What corrections explain is no noise: it must not hold them. So noise is what they leave where nothing but the
    // instruments' noise holds them, if they settle so.
    let (start, widened) = match settle(problem, nothing.clone(), 1.0) {
        Ok(Settled { change, widened, .. }) => (change, widened),
        Err(_) => (nothing.clone(), look(problem, &nothing).2),
    };
    let mut settled = settle(problem, start, widened * widened)?;
    // Where what is told is off by more than is plausible, so is the rest.
    for _ in 0..ROUNDS {
        let known = settled.told.len();
        let least = widened * widened / usual_square(problem, &settled);
        let more = settled.eigen.eigenvalues.iter().filter(|value| **value > least).count();
        if more <= known {
            break;
        }
        settled = settle(problem, settled.change, least)?;
    }
    let Settled { change, eigen, told, widened, scale } = settled;
    let mut covariance = DMatrix::<f64>::zeros(unknowns, unknowns);
    let mut share = vec![0.0; unknowns];
    for k in &told {
        let direction = eigen.eigenvectors.column(*k).into_owned();
        let column = direction.component_mul(&problem.plausible);
        covariance.ger(widened * widened / eigen.eigenvalues[*k], &column, &column, 1.0);
        share.iter_mut().zip(direction.iter()).for_each(|(share, v)| *share += v * v);
    }
    let held = (0..unknowns).filter(|k| !told.contains(k)).map(|k| eigen.eigenvectors.column(k).into_owned());
    let (misfits, outliers) = misfits(problem, &change, scale);
    Ok(Solution { held: held.collect(), told: share, covariance, change, misfits, outliers, widened })
}

/// By how much errors are larger than white noise of the size that the channels have makes them: what is left may be larger,
/// and may have a memory (G. E. P. Box, G. M. Jenkins and G. C. Reinsel, Time Series Analysis, 1994, section 2.1.3).
fn widening(problem: &Problem, all: &[White], scale: f64) -> f64 {
    let clipped = |residual: f64| residual.clamp(-HUBER * scale, HUBER * scale);
    let rows = all.iter().map(|w| w.residual.len()).max().unwrap_or(0);
    let (mut power, mut factor_sum) = (0.0, 0.0);
    for row in 0..rows {
        let series: Vec<(usize, f64)> = all
            .iter()
            .zip(&problem.samples)
            .filter(|(w, _)| w.residual.len() == rows)
            .map(|(w, sample)| (sample.trial, clipped(w.residual[row])))
            .collect();
        let own: f64 = series.iter().map(|(_, v)| v * v).sum();
        let mut sum = 1.0;
        for lag in 1..=series.len() / MEMORY {
            let pairs = series.iter().zip(&series[lag..]).filter(|(a, b)| a.0 == b.0);
            let correlation = pairs.map(|(a, b)| a.1 * b.1).sum::<f64>() / own.max(f64::MIN_POSITIVE);
            // Up to where it is lost in its own scatter.
            if correlation < 2.0 / (series.len() as f64).sqrt() {
                break;
            }
            sum += 2.0 * correlation;
        }
        power += own;
        factor_sum += own * sum;
    }
    let memory = if power > 0.0 { factor_sum / power } else { 1.0 };
    scale * memory.max(1.0).sqrt()
}

/// The misfits before and after, and the number of outliers, which are left out.
fn misfits(problem: &Problem, change: &DVector<f64>, scale: f64) -> (Vec<ChannelMisfit>, usize) {
    let mut out: Vec<ChannelMisfit> = Vec::new();
    let nothing = DVector::zeros(change.len());
    let mut outliers = 0;
    for sample in &problem.samples {
        let after = white(problem, sample, change);
        let before = problem.equations(sample, &nothing);
        let whole = after.residual.len() == after.plain.channels.len();
        for (row, channel) in after.plain.channels.iter().enumerate() {
            // Where lengths tell the pose one that is off shows in all.
            let residual = if whole { after.residual[row].abs() } else { after.residual.amax() };
            if residual > OUTLIER * scale {
                outliers += 1;
                continue;
            }
            let squares = [before.residual[row], after.plain.residual[row]].map(|v| v * v);
            match out.iter_mut().find(|m| m.channel == *channel) {
                Some(known) => {
                    (known.before, known.after) = (known.before + squares[0], known.after + squares[1]);
                    known.samples += 1;
                }
                None => {
                    out.push(ChannelMisfit { channel: *channel, before: squares[0], after: squares[1], samples: 1 })
                }
            }
        }
    }
    for misfit in &mut out {
        let count = misfit.samples as f64;
        (misfit.before, misfit.after) = ((misfit.before / count).sqrt(), (misfit.after / count).sqrt());
    }
    (out, outliers)
}
