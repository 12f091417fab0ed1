//! What signatures do to free runs: how far a simulation without the effect would be from the measurements.

use nalgebra::DMatrix;

use crate::data::Trial;
use crate::gap::restarts;
use crate::kalman::{Filtered, Randomness};
use crate::path::LinearTrial;
use crate::vector::{BLOCK, FULL, block, plus, plus_each, vectorised};
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
    /// The filter's covariance at each of [`after_starts`].
    pub(super) covariances: &'a [Vec<f64>],
    pub(super) noise: Vec<f64>,
    pub(super) horizon: f64,
}

/// The samples after those at which free runs start: by then the filter has used the measurements of the start.
pub(super) fn after_starts(trial: &Trial, horizon: f64) -> Vec<usize> {
    restarts(trial, horizon).into_iter().map(|start| start + 1).filter(|after| *after < trial.len()).collect()
}

/// Numbers of some columns.
type Panel = [f64; FULL];

impl Runs<'_> {
    /// The free runs of some columns of `forcing`, of each block of them by themselves.
    ///
    /// A run starts from the state that the filter has by then, which without the effect is itself wrong; so the error of the
    /// filter is carried along, and the run begins with it. The error of a model without fault is that of the measurements and
    /// that of the start, which is the same all through a run.
    pub(super) fn of(&self, forcing: &Forcing, blocks: &[Vec<usize>]) -> Vec<FreeRuns> {
        vectorised!(FUSED => self.of_in::<FUSED>(forcing, blocks))
    }

    #[inline(always)]
    fn of_in<const FUSED: bool>(&self, forcing: &Forcing, blocks: &[Vec<usize>]) -> Vec<FreeRuns> {
        let Self { linear, randomness, .. } = self;
        let (n, m) = (linear.states, linear.channels);
        let all = n + randomness.processes();
        let remembered = randomness.shown_by_channel(m);
        let starts = restarts(self.trial, self.horizon);
        let is_start = |k: usize| starts.binary_search(&k).is_ok();
        let mut out: Vec<FreeRuns> = blocks.iter().map(|block| FreeRuns::empty(block.len())).collect();
        let columns = blocks.concat();
        let panels = columns.len().div_ceil(FULL);
        // Truth minus estimate of the filter, and minus the free run: panel by panel, a row a state.
        let mut filter = vec![[0.0; FULL]; panels * all];
        let mut run = vec![[0.0; FULL]; panels * n];
        let mut began = None;
        // Sample and channel, and what the signatures do there, of the present run.
        let mut told: Vec<(usize, usize)> = Vec::new();
        let mut done: Vec<Panel> = Vec::new();
        let mut decay = vec![0.0; all - n];
        let mut columns_of_step = vec![0.0; linear.width() * linear.padded];
        let (mut step, mut next) = (vec![[0.0; FULL]; n], vec![[0.0; FULL]; linear.padded]);
        for k in 0..linear.len {
            let sensor = |j: usize| &forcing.sensor[(k * m + j) * forcing.columns..(k * m + j + 1) * forcing.columns];
            if began.is_some() && (!is_start(k) || is_start(k.wrapping_sub(1))) {
                for j in (0..m).filter(|j| linear.residual[k * m + j].is_finite()) {
                    for (p, run) in run.chunks_exact(n).enumerate() {
                        let mut e = taken(sensor(j), &columns, p);
                        for (c, slope) in linear.shown_by(k, j) {
                            e = plus::<FULL, FUSED>(e, slope, &run[c]);
                        }
                        done.push(e.map(|e| e / self.noise[j]));
                    }
                    told.push((k, j));
                    let e = &done[done.len() - panels..].as_flattened();
                    let mut first = 0;
                    for (out, block) in out.iter_mut().zip(blocks) {
                        out.count += 1;
                        let e = &e[first..first + block.len()];
                        first += block.len();
                        for (slots, b) in out.gram.as_mut_slice().chunks_exact_mut(e.len()).zip(e) {
                            slots.iter_mut().zip(e).for_each(|(slot, a)| *slot += a * b);
                        }
                    }
                }
            }
            for j in (0..m).filter(|j| self.filtered.whitened[k * m + j].is_finite()) {
                let gain = self.filtered.gain(k * m + j);
                for (p, filter) in filter.chunks_exact_mut(all).enumerate() {
                    let mut e = taken(sensor(j), &columns, p);
                    for (c, slope) in linear.shown_by(k, j) {
                        e = plus::<FULL, FUSED>(e, slope, &filter[c]);
                    }
                    for process in remembered[j].clone() {
                        e = plus::<FULL, FUSED>(e, 1.0, &filter[n + process]);
                    }
                    for (row, gain) in filter.iter_mut().zip(gain) {
                        *row = plus::<FULL, FUSED>(*row, -gain, &e);
                    }
                }
            }
            if (is_start(k) || k + 1 == linear.len)
                && let Some(began) = began
            {
                self.add_start::<FUSED>(&told, &done, began, &mut out);
                told.clear();
                done.clear();
            }
            if k + 1 == linear.len {
                break;
            }
            if let Ok(at) = starts.binary_search(&k) {
                for (run, filter) in run.chunks_exact_mut(n).zip(filter.chunks_exact(all)) {
                    run.copy_from_slice(&filter[..n]);
                }
                began = Some((k, at));
            }
            randomness.decays(linear.interval[k], &mut decay);
            linear.columns(k, &mut columns_of_step);
            for (p, (filter, run)) in filter.chunks_exact_mut(all).zip(run.chunks_exact_mut(n)).enumerate() {
                let rows =
                    forcing.step[k * n * forcing.columns..(k + 1) * n * forcing.columns].chunks_exact(forcing.columns);
                step.iter_mut().zip(rows).for_each(|(slot, row)| *slot = taken(row, &columns, p));
                moved::<FUSED>(&columns_of_step, &filter[..linear.width()], &step, &mut next);
                filter[..n].copy_from_slice(&next[..n]);
                for (row, decay) in filter[n..].iter_mut().zip(&decay) {
                    *row = row.map(|value| decay * value);
                }
                if began.is_some() {
                    moved::<FUSED>(&columns_of_step, run, &step, &mut next);
                    run.copy_from_slice(&next[..n]);
                }
            }
        }
        for out in &mut out {
            out.scatter += &out.gram;
        }
        out
    }

    /// Adds the covariance, by the error of the state from which run `at` `began`, of the sums of what the signatures do times
    /// what the error does.
    #[inline(always)]
    fn add_start<const FUSED: bool>(
        &self,
        told: &[(usize, usize)],
        done: &[Panel],
        (began, at): (usize, usize),
        out: &mut [FreeRuns],
    ) {
        let (linear, n) = (self.linear, self.linear.states);
        let Some((last, _)) = told.last() else { return };
        let panels = done.len() / told.len();
        let mut by = vec![[0.0; FULL]; panels * n];
        let mut next = vec![[0.0; FULL]; n];
        let mut told = told.iter().zip(done.chunks_exact(panels)).rev().peekable();
        // The filter has the covariance at the sample after the start.
        for k in (began + 1..=*last).rev() {
            while let Some(((_, j), e)) = told.next_if(|((at, _), _)| *at == k) {
                for (by, e) in by.chunks_exact_mut(n).zip(e) {
                    for (state, slope) in linear.shown_by(k, *j) {
                        by[state] = plus::<FULL, FUSED>(by[state], slope / self.noise[*j], e);
                    }
                }
            }
            if k > began + 1 {
                for by in by.chunks_exact_mut(n) {
                    for (r, slot) in next.iter_mut().enumerate() {
                        let mut sum = [0.0; FULL];
                        for (slope, by) in linear.column(k - 1, r).zip(&*by) {
                            sum = plus::<FULL, FUSED>(sum, slope, by);
                        }
                        *slot = sum;
                    }
                    by.copy_from_slice(&next);
                }
            }
        }
        let width = n + self.randomness.processes();
        let covariance = DMatrix::from_fn(n, n, |r, c| self.covariances[at][r * width + c]);
        let mut first = 0;
        for out in out {
            let by = DMatrix::from_fn(n, out.gram.nrows(), |r, c| {
                let c = first + c;
                by[c / FULL * n + r][c % FULL]
            });
            first += by.ncols();
            out.scatter += by.transpose() * &covariance * &by;
        }
    }
}

/// The numbers of panel `p` of some columns of a row.
#[inline(always)]
fn taken(row: &[f32], columns: &[usize], p: usize) -> Panel {
    std::array::from_fn(|i| columns.get(p * FULL + i).map_or(0.0, |c| f64::from(row[*c])))
}

/// Writes the states one step on.
#[inline(always)]
fn moved<const FUSED: bool>(columns: &[f64], states: &[Panel], step: &[Panel], next: &mut [Panel]) {
    let padded = next.len();
    for (at, next) in next.as_chunks_mut::<BLOCK>().0.iter_mut().enumerate() {
        let mut sum = [[0.0; FULL]; BLOCK];
        sum.iter_mut().zip(step.iter().skip(at * BLOCK)).for_each(|(slot, step)| *slot = *step);
        for (column, row) in columns.chunks_exact(padded).zip(states) {
            plus_each::<FUSED>(&mut sum, block(column, at), row);
        }
        *next = sum;
    }
}
