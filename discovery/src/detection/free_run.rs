//! What signatures do to free runs: how far a simulation without the effect would be from the measurements.

use nalgebra::DMatrix;

use crate::data::Trial;
use crate::gap::restarts;
use crate::kalman::{Filtered, Randomness};
use crate::path::LinearTrial;
use crate::whiten::Forcing;

/// What some signatures do to the predictions of free runs, in units of the noise.
#[derive(Clone, Debug)]
pub(super) struct FreeRuns {
    /// Its squares and products, summed over all predictions.
    pub(super) gram: DMatrix<f64>,
    /// Variances and covariances of the sums of what they do times the error that a model without fault has.
    pub(super) scatter: DMatrix<f64>,
    /// The number of predictions.
    pub(super) count: usize,
}

impl FreeRuns {
    pub(super) fn empty(columns: usize) -> Self {
        let nothing = DMatrix::zeros(columns, columns);
        Self { gram: nothing.clone(), scatter: nothing, count: 0 }
    }

    pub(super) fn add(&mut self, other: &Self) {
        self.gram += &other.gram;
        self.scatter += &other.scatter;
        self.count += other.count;
    }
}

/// One trial and the filter's run over it, with the noise of its channels by which a gap over `horizon` (s) is measured.
pub(super) struct Runs<'a> {
    pub(super) linear: &'a LinearTrial,
    pub(super) trial: &'a Trial,
    pub(super) randomness: &'a Randomness,
    pub(super) filtered: &'a Filtered,
    pub(super) noise: Vec<f64>,
    pub(super) horizon: f64,
}

impl Runs<'_> {
    /// The free runs of some columns of `forcing`.
    ///
    /// A run starts from the state that the filter has by then, which without the effect is itself wrong; so the error of the
    /// filter is carried along, and the run begins with it. The error of a model without fault is that of the measurements and
    /// that of the start, which is the same all through a run.
    pub(super) fn of(&self, forcing: &Forcing, columns: &[usize]) -> FreeRuns {
        let Self { linear, randomness, .. } = self;
        let (n, m, width) = (linear.states, linear.channels, columns.len());
        let all = n + randomness.processes();
        let remembered = randomness.shown_by_channel(m);
        let starts = restarts(self.trial, self.horizon);
        let is_start = |k: usize| starts.binary_search(&k).is_ok();
        let mut out = FreeRuns::empty(width);
        // Truth minus estimate of the filter, and minus the free run: a row a state, a number a column.
        let mut filter = vec![0.0; all * width];
        let mut run: Option<Vec<f64>> = None;
        let mut began = 0;
        // Sample, channel and what the signatures do there, of the present run.
        let mut told: Vec<(usize, usize, Vec<f64>)> = Vec::new();
        let mut e = vec![0.0; width];
        for k in 0..linear.len {
            let sensor = |j: usize| &forcing.sensor[(k * m + j) * forcing.columns..(k * m + j + 1) * forcing.columns];
            if let Some(run) = run.as_ref().filter(|_| !is_start(k) || is_start(k.wrapping_sub(1))) {
                for j in (0..m).filter(|j| linear.residual[k * m + j].is_finite()) {
                    shown(&mut e, sensor(j), columns, linear.shown_by(k, j), run);
                    out.count += 1;
                    let e: Vec<f64> = e.iter().map(|e| e / self.noise[j]).collect();
                    for (a, ea) in e.iter().enumerate() {
                        for (b, eb) in e.iter().enumerate() {
                            out.gram[(a, b)] += ea * eb;
                        }
                    }
                    told.push((k, j, e));
                }
            }
            for j in (0..m).filter(|j| self.filtered.whitened[k * m + j].is_finite()) {
                let memory = remembered[j].clone().map(|process| (n + process, 1.0));
                shown(&mut e, sensor(j), columns, linear.shown_by(k, j).chain(memory), &filter);
                let gain = self.filtered.gain(k * m + j);
                for (row, gain) in filter.chunks_exact_mut(width).zip(gain) {
                    row.iter_mut().zip(&e).for_each(|(slot, e)| *slot -= gain * e);
                }
            }
            if is_start(k) || k + 1 == linear.len {
                out.scatter += self.by_start(&std::mem::take(&mut told), began, width);
            }
            if k + 1 == linear.len {
                break;
            }
            if is_start(k) {
                run = Some(filter[..n * width].to_vec());
                began = k;
            }
            let step = &forcing.step[k * n * forcing.columns..(k + 1) * n * forcing.columns];
            let mut next = moved(linear, k, &filter[..linear.width() * width], step, forcing.columns, columns);
            for (process, row) in filter[n * width..].chunks_exact(width).enumerate() {
                let decay = randomness.decay(process, linear.interval[k]);
                next.extend(row.iter().map(|value| decay * value));
            }
            filter = next;
            run = run.map(|run| moved(linear, k, &run, step, forcing.columns, columns));
        }
        out.scatter += &out.gram;
        out
    }

    /// Covariance, by the error of the state from which a run `began`, of the sums of what the signatures do times what the
    /// error does.
    fn by_start(&self, told: &[(usize, usize, Vec<f64>)], began: usize, width: usize) -> DMatrix<f64> {
        let (linear, n) = (self.linear, self.linear.states);
        let mut by = DMatrix::<f64>::zeros(n, width);
        let mut told = told.iter().rev().peekable();
        let Some((last, ..)) = told.peek() else { return DMatrix::zeros(width, width) };
        // The filter has the covariance at the sample after the start.
        for k in (began + 1..=*last).rev() {
            while let Some((_, j, e)) = told.next_if(|(at, ..)| *at == k) {
                for (state, slope) in linear.shown_by(k, *j) {
                    for (c, e) in e.iter().enumerate() {
                        by[(state, c)] += slope * e / self.noise[*j];
                    }
                }
            }
            if k > began + 1 {
                by = DMatrix::from_fn(n, width, |r, c| {
                    linear.column(k - 1, r).iter().zip(by.column(c).iter()).map(|(slope, by)| slope * by).sum()
                });
            }
        }
        let covariance = DMatrix::from_fn(n, n, |r, c| self.filtered.covariance_row(linear, began + 1, r)[c]);
        by.transpose() * covariance * by
    }
}

/// What a sensor shows of the columns: directly, and by what the states do.
fn shown(e: &mut [f64], sensor: &[f32], columns: &[usize], by: impl Iterator<Item = (usize, f64)>, states: &[f64]) {
    let width = columns.len();
    e.iter_mut().zip(columns).for_each(|(slot, column)| *slot = f64::from(sensor[*column]));
    for (state, slope) in by {
        let row = &states[state * width..(state + 1) * width];
        e.iter_mut().zip(row).for_each(|(slot, value)| *slot += slope * value);
    }
}

/// The states one step on.
fn moved(linear: &LinearTrial, k: usize, states: &[f64], step: &[f32], all: usize, columns: &[usize]) -> Vec<f64> {
    let width = columns.len();
    let mut next: Vec<f64> =
        step.chunks_exact(all).flat_map(|row| columns.iter().map(|c| f64::from(row[*c]))).collect();
    for (c, row) in states.chunks_exact(width).enumerate() {
        for (target, slope) in next.chunks_exact_mut(width).zip(linear.column(k, c)) {
            target.iter_mut().zip(row).for_each(|(slot, value)| *slot += slope * value);
        }
    }
    next
}
