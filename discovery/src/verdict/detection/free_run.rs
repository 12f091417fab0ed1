//! What signatures do to free runs: how far a simulation without the effect would be from the measurements.

use std::ops::Range;

use nalgebra::DMatrix;

use crate::data::Trial;
use crate::filter::kalman::{Filtered, Randomness, covariances};
use crate::filter::path::LinearTrial;
use crate::filter::vector::{BLOCK, FULL, block, plus, plus_each, vectorised};
use crate::filter::whiten::Forcing;
use crate::model::examined::WRENCH;

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

/// One trial, the errors with which free runs over a horizon start in it, and the noise of its channels by which a gap is
/// measured.
pub(super) struct Course<'a> {
    linear: &'a LinearTrial,
    randomness: &'a Randomness,
    noise: Vec<f64>,
    /// The samples at which free runs start.
    starts: Vec<usize>,
    /// The filter's covariance at the sample after each: by then it has used the measurements of the start.
    covariances: Vec<Vec<f64>>,
}

impl<'a> Course<'a> {
    pub(super) fn new(
        linear: &'a LinearTrial,
        trial: &Trial,
        randomness: &'a Randomness,
        noise: Vec<f64>,
        horizon: f64,
    ) -> Self {
        let starts = trial.restarts(horizon);
        let after = starts.iter().map(|start| start + 1).filter(|after| *after < linear.len);
        Self { covariances: covariances(linear, randomness, after), linear, randomness, noise, starts }
    }

    fn is_start(&self, k: usize) -> bool {
        self.starts.binary_search(&k).is_ok()
    }
}

/// Numbers of some columns.
type Panel = [f64; FULL];

/// The free runs of some columns of signatures, of each block of them by themselves.
///
/// A run starts from the state that the filter has by then, which without the effect is itself wrong; so the error of the
/// filter is carried along, and the run begins with it. The error of a model without fault is that of the measurements and
/// that of the start, which is the same all through a run.
pub(super) struct Runs<'a> {
    course: &'a Course<'a>,
    blocks: &'a [Vec<usize>],
    columns: Vec<usize>,
    out: Vec<FreeRuns>,
    /// Truth minus estimate of the filter, and minus the free run: panel by panel, a row a state.
    filter: Vec<Panel>,
    run: Vec<Panel>,
    /// The sample at which the present run began, and its number.
    began: Option<(usize, usize)>,
    /// Sample and channel, and what the signatures do there, of the present run.
    told: Vec<(usize, usize)>,
    done: Vec<Panel>,
}

impl<'a> Runs<'a> {
    pub(super) fn new(course: &'a Course<'a>, blocks: &'a [Vec<usize>]) -> Self {
        let columns = blocks.concat();
        let (panels, n) = (columns.len().div_ceil(FULL), course.linear.states);
        Self {
            course,
            blocks,
            columns,
            out: blocks.iter().map(|block| FreeRuns::empty(block.len())).collect(),
            filter: vec![[0.0; FULL]; panels * (n + course.randomness.processes())],
            run: vec![[0.0; FULL]; panels * n],
            began: None,
            told: Vec::new(),
            done: Vec::new(),
        }
    }

    /// Goes on over some samples of which the filter's run is given, up to the last.
    pub(super) fn advance(&mut self, forcing: &Forcing, filtered: &Filtered, samples: &Range<usize>) {
        vectorised!(FUSED => self.advance_in::<FUSED>(forcing, filtered, samples));
    }

    /// What was found.
    pub(super) fn done(self) -> Vec<FreeRuns> {
        let add = |out: FreeRuns| FreeRuns { scatter: out.scatter + &out.gram, ..out };
        self.out.into_iter().map(add).collect()
    }

    #[inline(always)]
    fn advance_in<const FUSED: bool>(&mut self, forcing: &Forcing, filtered: &Filtered, samples: &Range<usize>) {
        let Course { linear, randomness, noise, .. } = self.course;
        let (n, m) = (linear.states, linear.channels);
        let (alone, all) = (n + randomness.estimated(), n + randomness.processes());
        let remembered = randomness.shown_by_channel(m);
        let is_start = |k: usize| self.course.is_start(k);
        let panels = self.columns.len().div_ceil(FULL);
        let mut decay = vec![0.0; all - n];
        let mut columns_of_step = vec![0.0; linear.width() * linear.padded];
        let (mut step, mut next) = (vec![[0.0; FULL]; n], vec![[0.0; FULL]; linear.padded]);
        let mut acting = vec![[0.0; FULL]; alone];
        for k in samples.clone() {
            let (kept, each) = (k - samples.start, forcing.columns);
            let sensor = |j: usize| &forcing.sensor[(kept * m + j) * each..(kept * m + j + 1) * each];
            if self.began.is_some() && (!is_start(k) || is_start(k.wrapping_sub(1))) {
                for j in (0..m).filter(|j| linear.residual[k * m + j].is_finite()) {
                    for (p, run) in self.run.chunks_exact(n).enumerate() {
                        let mut e = taken(sensor(j), &self.columns, p);
                        for (c, slope) in linear.shown_by(k, j) {
                            e = plus::<FULL, FUSED>(e, slope, &run[c]);
                        }
                        self.done.push(e.map(|e| e / noise[j]));
                    }
                    self.told.push((k, j));
                    let e = &self.done[self.done.len() - panels..].as_flattened();
                    let mut first = 0;
                    for (out, block) in self.out.iter_mut().zip(self.blocks) {
                        out.count += 1;
                        let e = &e[first..first + block.len()];
                        first += block.len();
                        for (slots, b) in out.gram.as_mut_slice().chunks_exact_mut(e.len()).zip(e) {
                            slots.iter_mut().zip(e).for_each(|(slot, a)| *slot += a * b);
                        }
                    }
                }
            }
            for j in (0..m).filter(|j| filtered.whitened[kept * m + j].is_finite()) {
                let gain = filtered.gain(kept * m + j);
                for (p, filter) in self.filter.chunks_exact_mut(all).enumerate() {
                    let mut e = taken(sensor(j), &self.columns, p);
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
                && let Some(began) = self.began
            {
                self.add_start::<FUSED>(began);
                self.told.clear();
                self.done.clear();
            }
            if k + 1 == linear.len {
                break;
            }
            if let Ok(at) = self.course.starts.binary_search(&k) {
                for (run, filter) in self.run.chunks_exact_mut(n).zip(self.filter.chunks_exact(all)) {
                    run.copy_from_slice(&filter[..n]);
                }
                self.began = Some((k, at));
            }
            randomness.decays(linear.interval[k], &mut decay);
            linear.columns(k, &mut columns_of_step);
            let both = self.filter.chunks_exact_mut(all).zip(self.run.chunks_exact_mut(n));
            for (p, (filter, run)) in both.enumerate() {
                let rows = forcing.step[kept * n * each..(kept + 1) * n * each].chunks_exact(each);
                step.iter_mut().zip(rows).for_each(|(slot, row)| *slot = taken(row, &self.columns, p));
                // Errors of forces move the states as the latent forces at their winches do.
                acting.copy_from_slice(&filter[..alone]);
                for (winch, at) in (n + WRENCH..alone).cycle().zip(all - randomness.force_errors()..all) {
                    acting[winch] = plus::<FULL, FUSED>(acting[winch], 1.0, &filter[at]);
                }
                moved::<FUSED>(&columns_of_step, &acting, &step, &mut next);
                filter[..n].copy_from_slice(&next[..n]);
                for (row, decay) in filter[n..].iter_mut().zip(&decay) {
                    *row = row.map(|value| decay * value);
                }
                if self.began.is_some() {
                    moved::<FUSED>(&columns_of_step, run, &step, &mut next);
                    run.copy_from_slice(&next[..n]);
                }
            }
        }
    }

    /// Adds the covariance, by the error of the state from which run `at` `began`, of the sums of what the signatures do times
    /// what the error does.
    #[inline(always)]
    fn add_start<const FUSED: bool>(&mut self, (began, at): (usize, usize)) {
        let Self { course, out, told, done, .. } = self;
        let (linear, n) = (course.linear, course.linear.states);
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
                        by[state] = plus::<FULL, FUSED>(by[state], slope / course.noise[*j], e);
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
        let width = n + course.randomness.processes();
        let covariance = DMatrix::from_fn(n, n, |r, c| course.covariances[at][r * width + c]);
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
