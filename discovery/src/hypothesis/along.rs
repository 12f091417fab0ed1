//! What signatures are formed along.

use std::ops::Range;

use cdpr::model_file::Model;

use crate::data::Trial;
use crate::filter::estimate::Fit;
use crate::filter::path::{LinearTrial, Trajectory};
use crate::model::examined::Examined;

/// A model's trajectory in one trial, along which signatures are formed.
#[derive(Clone, Copy)]
pub(crate) struct Along<'a> {
    pub(crate) model: &'a Model,
    pub(crate) base: &'a Examined,
    pub(crate) linear: &'a LinearTrial,
    pub(crate) trial: &'a Trial,
    pub(crate) trajectory: &'a Trajectory,
}

impl<'a> Along<'a> {
    /// Along a fit and its linear models in the trial of number `t`.
    pub(crate) fn new(fit: &'a Fit, linear: &'a [LinearTrial], trials: &'a [Trial], t: usize) -> Self {
        let Fit { model, examined, trajectories, .. } = fit;
        debug_assert_eq!(trajectories[t].width, examined.states() + examined.latents());
        Self { model, base: examined, linear: &linear[t], trial: &trials[t], trajectory: &trajectories[t] }
    }

    /// The steps that begin at some samples.
    pub(super) fn steps(&self, samples: &Range<usize>) -> usize {
        samples.end.min(self.trial.len() - 1) - samples.start
    }

    /// What `varied` shows more at sample `k` than the base, given what it has `shown`; what it shows later is what it was.
    pub(super) fn shows_more(&self, varied: &Examined, k: usize, shown: &[f64]) -> impl Iterator<Item = f64> {
        let Self { base, linear, trial, .. } = self;
        shown.iter().zip(&trial.channels).enumerate().map(move |(j, (shown, channel))| {
            let at = k * linear.channels + j;
            let later = varied.late(*channel) - base.late(*channel);
            shown - linear.shown[at] - later * linear.rate[at]
        })
    }

    /// Rates of the base plant at both ends of each step.
    pub(crate) fn end_rates(&self, samples: &Range<usize>) -> [Vec<f64>; 2] {
        let Self { base, linear, trial, trajectory, .. } = self;
        let n = base.states();
        [0, 1].map(|end| {
            let mut rates = vec![0.0; self.steps(samples) * n];
            for (at, rates) in rates.chunks_exact_mut(n).enumerate() {
                let k = samples.start + at;
                let (time, y) = (trial.time[k + end], trajectory.states(k + end));
                base.plant.rates(time, y, &linear.felt[k], &linear.slack[k], rates);
            }
            rates
        })
    }
}
