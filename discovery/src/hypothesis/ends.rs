//! What the rates that a law adds at both ends of a step come to by its end.

use std::ops::Range;

use rayon::prelude::*;

use crate::filter::variation::{Step, Variation};
use crate::hypothesis::along::Along;

/// The base model at both ends of each step over some samples.
///
/// What is added to the rates is carried by the trapezoidal rule, good to a few per cent where the fastest mode turns by less than
/// a radian in a step; where something rings, as by the variational equation, what is added being on a line between the ends.
pub(crate) struct Ends<'a> {
    along: &'a Along<'a>,
    first: usize,
    /// Rates of the base plant, a number a state and step.
    rates: [Vec<f64>; 2],
    /// Where something rings, what a rate added at the beginning of a step, or at its end, adds to the states at its end: a column
    /// for each, of all of them for each step.
    carried: Vec<f64>,
}

/// Steps that are carried one after the other, side by side with others.
const STRETCH: usize = 100;

impl<'a> Ends<'a> {
    pub(crate) fn new(along: &'a Along<'a>, samples: &Range<usize>) -> Self {
        let (n, steps) = (along.base.states(), along.steps(samples));
        let rates = [0, 1].map(|end| {
            let mut rates = vec![0.0; steps * n];
            for (at, rates) in rates.chunks_exact_mut(n).enumerate() {
                let k = samples.start + at;
                let (time, y) = (along.trial.time[k + end], along.ends(k)[end]);
                along.base.plant.rates(time, y, along.felt(k), &along.linear.slack[k], rates);
            }
            rates
        });
        let mut carried = vec![0.0; if along.rings() { 2 * n * n * steps } else { 0 }];
        let stretches = carried.par_chunks_mut(2 * n * n * STRETCH).enumerate();
        stretches.for_each(|(at, carried)| carry(along, samples.start + at * STRETCH, carried));
        Self { along, first: samples.start, rates, carried }
    }

    /// Rates of the base plant at an end of step `k`.
    pub(crate) fn rates(&self, k: usize, end: usize) -> &[f64] {
        let n = self.along.base.states();
        &self.rates[end][(k - self.first) * n..][..n]
    }

    /// Adds to the states at the end of step `k` what is added to the rates at one of its ends.
    pub(super) fn carry(&self, k: usize, end: usize, added: &[f64], target: &mut [f32]) {
        let (linear, n) = (self.along.linear, added.len());
        let half = 0.5 * linear.interval[k];
        for (c, rate) in added.iter().enumerate().filter(|(_, rate)| **rate != 0.0) {
            if self.along.rings() {
                let column = &self.carried[((k - self.first) * 2 * n + end * n + c) * n..][..n];
                for (slot, slope) in target.iter_mut().zip(column) {
                    *slot += (slope * rate) as f32;
                }
            } else if end == 0 {
                for (slot, slope) in target.iter_mut().zip(linear.column(k, c)) {
                    *slot += (half * slope * rate) as f32;
                }
            } else {
                target[c] += (half * rate) as f32;
            }
        }
    }
}

/// Writes what rates added at either end come to, for the steps from `first` on.
fn carry(along: &Along<'_>, first: usize, carried: &mut [f64]) {
    let n = along.base.states();
    let mut variation = Variation::new(along.base);
    let mut response = vec![0.0; 2 * n * n];
    for (at, carried) in carried.chunks_exact_mut(2 * n * n).enumerate() {
        let step = along.step(first + at);
        // On a line between both ends.
        let forced = |part: &Step<'_>, forced: &mut [Vec<f64>; 2]| {
            for (forced, time) in forced.iter_mut().zip([part.inner_time(), part.end_time()]) {
                let share = (time - step.time) / step.interval;
                forced.fill(0.0);
                for r in 0..n {
                    forced[r * 2 * n + r] = 1.0 - share;
                    forced[r * 2 * n + n + r] = share;
                }
            }
        };
        variation.response(&step, 2 * n, forced, &mut response);
        for (c, column) in carried.chunks_exact_mut(n).enumerate() {
            for (slot, row) in column.iter_mut().zip(response.chunks_exact(2 * n)) {
                *slot = row[c];
            }
        }
    }
}
