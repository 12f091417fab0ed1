//! How far ahead a free run says something of the model.
//!
//! A free run starts from a state that is only known as well as the sensors allow, and its error grows as the robot's
//! motion does: where the rotation is unstable by 5 1/s, any model is off by a million times the noise after 3 s. So the
//! covariance of the start is carried along the free run by the linearised model, without any disturbance. What comes out
//! is the gap that a model without fault would leave. Gaps are judged as multiples of it, over horizons over which it
//! stays near the noise.

use rayon::prelude::*;

use super::policy::Policy;
use crate::data::Trial;
use crate::filter::estimate::{Fit, for_trial};
use crate::filter::kalman::{Randomness, covariances};
use crate::filter::path::LinearTrial;
use crate::outcome::{HORIZON, HORIZONS};

/// Shorter horizons (s) for robots whose motion grows too fast for those of the report.
const SHORTER: [f64; 8] = [2.0, 1.0, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01];
/// Samples of a free run below which it is no run.
const FEWEST: f64 = 4.0;

/// A horizon, and the gap that a model without fault would leave over it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Reach {
    /// Time between restarts (s).
    pub(crate) horizon: f64,
    /// In multiples of the noise, 1 at least.
    pub(crate) attainable: f64,
}

/// The gap that the model of `fit` would leave over `horizon` (s) if it were without fault and nothing disturbed it, as a
/// root mean square over samples and channels in units of `noise` (in the order of all channels).
pub(crate) fn attainable(fit: &Fit, trials: &[Trial], noise: &[f64], horizon: f64) -> f64 {
    let nothing = Randomness { noise: noise.to_vec(), ..fit.randomness.without_latents() };
    let linear = fit.linear(trials);
    let parts: Vec<(f64, usize)> = trials
        .par_iter()
        .zip(&linear[..])
        .map(|(trial, linear)| of_trial(linear, trial, &for_trial(&nothing, trial), horizon))
        .collect();
    let (sum, count) = parts.into_iter().fold((0.0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
    (sum / count.max(1) as f64).sqrt()
}

/// Sum over the predictions of one trial of their variance over that of the noise, and their number.
fn of_trial(linear: &LinearTrial, trial: &Trial, randomness: &Randomness, horizon: f64) -> (f64, usize) {
    let n = linear.states;
    let starts = trial.restarts(horizon);
    // The sample of a restart is used for the state; the filter has the covariance at the one after it.
    let known = covariances(linear, randomness, starts.iter().map(|k| k + 1).filter(|k| *k < linear.len));
    let width = n + randomness.processes();
    let mut next = starts.iter().zip(&known).peekable();
    let mut covariance: Vec<f64> = Vec::new();
    let (mut sum, mut count) = (0.0, 0);
    for k in 0..trial.len() {
        // As in the gap: the sample of a restart is no prediction, unless it ends a stretch of one interval.
        let is_start = |k: usize| starts.binary_search(&k).is_ok();
        if !covariance.is_empty() && (!is_start(k) || is_start(k.wrapping_sub(1))) {
            for j in 0..linear.channels {
                if !linear.residual[k * linear.channels + j].is_finite() {
                    continue;
                }
                let shown = linear.shown_by(k, j);
                let of_state: f64 = shown
                    .clone()
                    .flat_map(|(r, hr)| shown.clone().map(move |(c, hc)| (r, c, hr * hc)))
                    .map(|(r, c, weight)| weight * covariance[r * n + c])
                    .sum();
                sum += 1.0 + of_state.max(0.0) / randomness.noise[j].powi(2);
                count += 1;
            }
        }
        if k + 1 == trial.len() {
            break;
        }
        if let Some((_, known)) = next.next_if(|(start, _)| **start == k) {
            covariance = known.chunks_exact(width).take(n).flat_map(|row| row[..n].to_vec()).collect();
        } else if !covariance.is_empty() {
            covariance = carried(&covariance, n, |c| linear.column(k, c).collect());
        }
        if !covariance.iter().all(|v| v.is_finite()) {
            return (f64::INFINITY, count.max(1));
        }
    }
    (sum, count)
}

/// `F P Fᵀ`, the columns of `F` given.
fn carried(covariance: &[f64], n: usize, column: impl Fn(usize) -> Vec<f64>) -> Vec<f64> {
    let product = |of: &dyn Fn(usize, usize) -> f64| {
        let mut out = vec![0.0; n * n];
        for c in 0..n {
            let slopes = column(c);
            for (r, row) in out.chunks_exact_mut(n).enumerate() {
                for (slot, slope) in row.iter_mut().zip(&slopes) {
                    *slot += of(r, c) * slope;
                }
            }
        }
        out
    };
    // P Fᵀ, then its transpose times Fᵀ: P is symmetric.
    let half = product(&|r, c| covariance[r * n + c]);
    product(&|r, c| half[c * n + r])
}

/// Every horizon of the report, and the two by which the search goes: the main one, 5 s or the longest below it that the
/// growth allows, and a longer one where it allows that too.
#[derive(Clone, Debug)]
pub(crate) struct Reaches {
    pub(crate) main: Reach,
    pub(crate) long: Reach,
}

impl Default for Reaches {
    /// Those of a robot that is slow.
    fn default() -> Self {
        let reach = |horizon| Reach { horizon, attainable: 1.0 };
        Self { main: reach(HORIZON), long: reach(HORIZONS[2]) }
    }
}

impl Reaches {
    /// Chooses the horizons for `trials`, held-out ones, along a fit of the model as given.
    pub(crate) fn of(fit: &Fit, trials: &[Trial], noise: &[f64], policy: &Policy) -> Self {
        let reach = |horizon| Reach { horizon, attainable: attainable(fit, trials, noise, horizon) };
        let allowed = |reach: &Reach| reach.attainable <= policy.farthest;
        let interval = trials.iter().map(Trial::interval).fold(0.0, f64::max);
        let shorter = SHORTER.into_iter().filter(|h| *h >= FEWEST * interval);
        let mut last = reach(HORIZON);
        for horizon in shorter {
            if allowed(&last) {
                break;
            }
            last = reach(horizon);
        }
        let long = Some(reach(HORIZONS[2])).filter(|long| last.horizon == HORIZON && allowed(long));
        Self { main: last, long: long.unwrap_or(last) }
    }

    /// The horizons of the report, with the main one among them.
    pub(crate) fn reported(&self) -> Vec<f64> {
        let mut all = HORIZONS.to_vec();
        if !all.contains(&self.main.horizon) {
            all.push(self.main.horizon);
            all.sort_by(f64::total_cmp);
        }
        all
    }
}
