//! What instruments have anew in each recording, and what is the same in all: the one is a drift, or a zero that was set before each, the
//! other an error of the geometry or a law.

use rayon::prelude::*;

use super::sizing::{At, Sizing};
use crate::data::Trial;
use crate::filter::estimate::{Fit, for_trial};
use crate::filter::kalman::{Keep, Randomness, filter};
use crate::filter::path::LinearTrial;

impl Sizing<'_> {
    /// `from` with those drifts and origins alone that are not as likely the same in all recordings, as a law that costs more than they do.
    /// Of one recording nothing tells that.
    pub(super) fn not_the_same_in_all(&self, fit: &Fit, from: At) -> At {
        if self.trials.len() < 2 {
            return from;
        }
        let memory = &from.randomness.memory;
        let (law, drift) = (self.penalty.of(1), self.penalty.of_parameters(1));
        let same = |at: &usize| self.with_common_origin(fit, &from.randomness, *at) + law < from.value + drift;
        let common: Vec<usize> = (0..memory.len()).filter(|at| memory[*at].drift).filter(same).collect();
        if common.is_empty() {
            return from;
        }
        let mut different = from.randomness;
        common.iter().rev().for_each(|at| {
            different.memory.remove(*at);
        });
        self.at(fit, different.bounded())
    }

    /// The least `-2 log L` where the channel of one drift does not, but counts from the same zero in all recordings.
    fn with_common_origin(&self, fit: &Fit, randomness: &Randomness, at: usize) -> f64 {
        let mut without = randomness.clone();
        let drift = without.memory.remove(at);
        let linear = fit.linear(self.trials);
        let value = |from: f64| -> f64 {
            let of_trial = |(linear, trial): (&LinearTrial, &Trial)| {
                let mut linear = linear.clone();
                let (channel, channels) = (self.all[drift.channel], linear.channels);
                if let Some(j) = trial.channels.iter().position(|c| *c == channel) {
                    linear.residual.iter_mut().skip(j).step_by(channels).for_each(|residual| *residual -= from);
                }
                filter(&linear, &for_trial(&without, trial), Keep::Likelihood).minus_two_log_likelihood
            };
            linear.par_iter().zip(self.trials).map(of_trial).sum()
        };
        // A parabola, for the model is linear.
        let [less, none, more] = [-drift.deviation, 0.0, drift.deviation].map(value);
        let (slope, bend) = (0.5 * (more - less), more + less - 2.0 * none);
        none - 0.5 * slope * slope / bend
    }
}
