//! Robust least squares with what cannot be told held.

use nalgebra::{DMatrix, DVector};

use super::problem::{Equations, Problem, Sample};
use super::{CalibrateError, ChannelMisfit};
use crate::data::clean::median;

/// Most rounds.
const ROUNDS: usize = 50;
/// Move, in multiples of what is plausible, below which the corrections have settled: far below any standard error.
const SETTLED: f64 = 1e-7;
/// Whitened residual from which a number counts less, in robust standard deviations (Huber's 95 % efficiency).
const HUBER: f64 = 1.345;
/// The same from which it is an outlier.
const OUTLIER: f64 = 5.0;
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

/// The whitened equations of one sample.
struct White {
    residual: DVector<f64>,
    slopes: DMatrix<f64>,
    /// Of each row before it is whitened.
    plain: Equations,
}

fn white(problem: &Problem, sample: &Sample, change: &DVector<f64>) -> White {
    let plain = problem.equations(sample, change);
    let root = plain.covariance.clone().cholesky().unwrap_or_else(|| unreachable!("noise above zero on every row")).l();
    let solved = |right: DMatrix<f64>| root.solve_lower_triangular(&right).unwrap_or_else(|| unreachable!("as above"));
    let slopes = solved(&plain.slopes * DMatrix::from_diagonal(&problem.plausible));
    let residual = solved(DMatrix::from_columns(std::slice::from_ref(&plain.residual))).column(0).into_owned();
    White { residual, slopes, plain }
}

/// Robust standard deviation.
fn deviation(values: impl Iterator<Item = f64>) -> f64 {
    median(values.map(f64::abs).collect()) / 0.674_489_750_2
}

pub(super) fn solve(problem: &Problem) -> Result<Solution, CalibrateError> {
    let unknowns = problem.unknowns.len();
    let mut change = DVector::<f64>::zeros(unknowns);
    let mut moved = f64::INFINITY;
    let mut last = None;
    for _ in 0..ROUNDS {
        let all: Vec<White> = problem.samples.iter().map(|s| white(problem, s, &change)).collect();
        let scale = deviation(all.iter().flat_map(|w| w.residual.iter().copied())).max(f64::MIN_POSITIVE);
        // Noise that is larger than it looks counts as noise.
        let scale = scale.max(1.0);
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
        let widened = widening(problem, &all, scale);
        let eigen = gram.symmetric_eigen();
        // Told is what is known better than what is plausible.
        let told: Vec<usize> = (0..unknowns).filter(|k| eigen.eigenvalues[*k] > widened * widened).collect();
        let mut next = DVector::<f64>::zeros(unknowns);
        for k in &told {
            let direction = eigen.eigenvectors.column(*k);
            next.axpy(direction.dot(&right) / eigen.eigenvalues[*k], &direction, 1.0);
        }
        moved = (&next - &now).amax();
        change = next.component_mul(&problem.plausible);
        last = Some((eigen, told, widened, scale));
        if moved < SETTLED {
            break;
        }
    }
    let (eigen, told, widened, scale) = match last {
        Some(last) if moved < SETTLED => last,
        _ => return Err(CalibrateError::NotSettled { rounds: ROUNDS, moved }),
    };
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
        for (row, channel) in after.plain.channels.iter().enumerate() {
            if after.residual[row].abs() > OUTLIER * scale {
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
