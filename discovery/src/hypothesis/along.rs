//! What signatures are formed along: what the filter knows of the states before it has seen what comes next.
//!
//! The slope of the likelihood is a sum of innovations, each with what a parameter would have made of it, and where nothing is
//! missing its mean is zero if no innovation has a part in its own factor: the factors must be known before it, as in the
//! filter of the sensitivities (N. K. Gupta and R. K. Mehra, IEEE Trans. Autom. Control 19 (1974), 774). Along the smoothed
//! trajectory they are not. It is closer to the truth, but it has seen all innovations; where forces are random, a law that
//! acts by rates or accelerations seems to be missing then, and is not.
//!
//! First states and latent forces are taken as the trajectory has them: the states are few, and what is missing makes the
//! filter's guess of a latent force late. So where the recorded forces have no error it is the trajectory itself.

use std::ops::Range;

use cdpr::dynamics::Inputs;
use cdpr::model_file::Model;

use crate::data::Trial;
use crate::filter::estimate::{Fit, for_trial};
use crate::filter::kalman::{Keep, filter_from_start};
use crate::filter::path::{LinearTrial, Trajectory};
use crate::filter::variation::Step;
use crate::filter::within::Within;
use crate::hypothesis::slow::slow_ends;
use crate::model::examined::{Examined, Moment, WRENCH};

/// A model's trajectory in one trial, along which signatures are formed.
pub(crate) struct Along<'a> {
    pub(crate) model: &'a Model,
    pub(crate) base: &'a Examined,
    pub(crate) linear: &'a LinearTrial,
    pub(crate) trial: &'a Trial,
    known: Known,
    /// The ends of the steps without what rings in them, where something does.
    slow: Vec<f64>,
}

/// What is known at each sample before it is measured.
struct Known {
    /// States, and latents with the errors of the winch forces.
    trajectory: Trajectory,
    /// Inputs as the plant feels them then.
    felt: Vec<Inputs>,
    /// Where each step of the model goes from there, a number a state.
    ends: Vec<f64>,
    /// Where the integrator stops on the way.
    within: Within,
    /// What the sensors show there, a number a channel.
    shown: Vec<f64>,
}

impl Known {
    fn new(fit: &Fit, linear: &LinearTrial, trial: &Trial, smoothed: &Trajectory) -> Self {
        let (n, w) = (linear.states, linear.width());
        let mut ends = vec![0.0; (linear.len - 1) * n];
        for (k, (end, defect)) in ends.chunks_exact_mut(n).zip(linear.defect.chunks_exact(n)).enumerate() {
            let next = smoothed.states(k + 1).iter().zip(defect);
            end.iter_mut().zip(next).for_each(|(slot, (state, defect))| *slot = state + defect);
        }
        let (felt, within, shown) = (linear.felt.clone(), linear.within.clone(), linear.shown.clone());
        let mut known = Self { trajectory: smoothed.clone(), felt, ends, within, shown };
        let randomness = for_trial(&fit.randomness, trial).without_latents();
        if randomness.input == 0.0 {
            return known;
        }
        let filtered = filter_from_start(&linear.with_latents_given(), &randomness, Keep::Innovations);
        let errors = randomness.processes() - randomness.force_errors()..randomness.processes();
        let simulation = fit.examined.simulation(trial, 0, smoothed.states(0));
        let mut shown = Vec::new();
        for (k, row) in known.trajectory.values.chunks_exact_mut(w).enumerate() {
            let deviation = filtered.predicted(k);
            let mut acts = deviation[..n + randomness.estimated()].to_vec();
            acts.resize(w, 0.0);
            (n + WRENCH..w).cycle().zip(errors.clone()).for_each(|(winch, at)| acts[winch] += deviation[n + at]);
            row.iter_mut().zip(&acts).for_each(|(slot, by)| *slot += by);
            let Inputs { disturbance, winch_force, .. } = &mut known.felt[k];
            disturbance.iter_mut().chain(winch_force.iter_mut()).zip(&acts[n..]).for_each(|(slot, by)| *slot += by);
            if k + 1 < linear.len {
                let end = &mut known.ends[k * n..(k + 1) * n];
                let mut moved = vec![0.0; n];
                for (c, by) in acts.iter().enumerate() {
                    moved.iter_mut().zip(linear.column(k, c)).for_each(|(slot, slope)| *slot += by * slope);
                }
                end.iter_mut().zip(&moved).for_each(|(slot, by)| *slot += by);
                // Between, on a line from what the beginning is moved by to that.
                for point in known.within.step_mut(k).chunks_exact_mut(n + 1) {
                    let share = (point[0] - trial.time[k]) / linear.interval[k];
                    let ends = acts.iter().zip(&moved);
                    point[1..].iter_mut().zip(ends).for_each(|(slot, (from, to))| *slot += from + share * (to - from));
                }
            }
            let moment = Moment { time: trial.time[k], y: &row[..n], felt: &known.felt[k], slack: linear.slack[k] };
            fit.examined.measure_at(&simulation, &moment, &trial.channels, &mut shown);
            known.shown[k * linear.channels..][..linear.channels].copy_from_slice(&shown);
        }
        known
    }
}

impl<'a> Along<'a> {
    /// Along a fit and its linear models in the trial of number `t`.
    pub(crate) fn new(fit: &'a Fit, linear: &'a [LinearTrial], trials: &'a [Trial], t: usize) -> Self {
        let Fit { model, examined, trajectories, .. } = fit;
        debug_assert_eq!(trajectories[t].width, examined.states() + examined.latents());
        let (linear, trial) = (&linear[t], &trials[t]);
        let known = Known::new(fit, linear, trial, &trajectories[t]);
        let mut along = Self { model, base: examined, linear, trial, known, slow: Vec::new() };
        along.slow = slow_ends(examined, linear.len - 1, |k| along.step(k));
        along
    }

    /// Whether something rings between samples.
    pub(super) fn rings(&self) -> bool {
        !self.slow.is_empty()
    }

    /// The states at both ends of step `k`, as the samples there have them, but without what rings.
    pub(super) fn ends(&self, k: usize) -> [&[f64]; 2] {
        self.slow_ends(k).unwrap_or_else(|| [self.states(k), self.states(k + 1)])
    }

    fn slow_ends(&self, k: usize) -> Option<[&[f64]; 2]> {
        let n = self.base.states();
        self.rings().then(|| [2 * k, 2 * k + 1].map(|end| &self.slow[end * n..(end + 1) * n]))
    }

    /// The states at sample `k`.
    pub(crate) fn states(&self, k: usize) -> &[f64] {
        self.known.trajectory.states(k)
    }

    /// The latents at sample `k`.
    pub(crate) fn latents(&self, k: usize) -> &[f64] {
        self.known.trajectory.latents(k)
    }

    /// The inputs as the plant feels them over step `k`.
    pub(crate) fn felt(&self, k: usize) -> &Inputs {
        &self.known.felt[k]
    }

    /// Where step `k` of the base model goes from the states at its beginning, to first order in how far these are off the
    /// trajectory.
    pub(crate) fn end(&self, k: usize) -> &[f64] {
        let n = self.base.states();
        &self.known.ends[k * n..(k + 1) * n]
    }

    /// Step `k` of the base model, without what rings in it.
    pub(crate) fn step(&self, k: usize) -> Step<'_> {
        let [from, to] = self.slow_ends(k).unwrap_or_else(|| [self.states(k), self.end(k)]);
        Step { from, to, within: &[], ..self.own_step(k) }
    }

    /// Step `k` of the base model as it goes.
    pub(super) fn own_step(&self, k: usize) -> Step<'_> {
        let (interval, felt, slack) = (self.linear.interval[k], *self.felt(k), self.linear.slack[k]);
        let (from, to, within) = (self.states(k), self.end(k), self.known.within.step(k));
        Step { time: self.trial.time[k], interval, from, to, felt, slack, within }
    }

    /// The steps that begin at some samples.
    pub(super) fn steps(&self, samples: &Range<usize>) -> usize {
        samples.end.min(self.trial.len() - 1) - samples.start
    }

    /// What `varied` shows more at sample `k` than the base, given what it has `shown`; what it shows later is what it was.
    pub(super) fn shows_more(&self, varied: &Examined, k: usize, shown: &[f64]) -> impl Iterator<Item = f64> {
        let Self { base, linear, trial, known, .. } = self;
        shown.iter().zip(&trial.channels).enumerate().map(move |(j, (shown, channel))| {
            let at = k * linear.channels + j;
            let later = varied.late(*channel) - base.late(*channel);
            shown - known.shown[at] - later * linear.rate[at]
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::recording::{fitted, noise, record};

    #[test]
    fn only_where_forces_have_an_error_is_it_another_path_than_the_trajectory() {
        let mut trial = record(&[], 20.0, 5);
        let mut errors = noise(4 * trial.len(), 6);
        for force in trial.inputs.iter_mut().flat_map(|inputs| inputs.winch_force.iter_mut()) {
            *force += 50.0 * errors.next().unwrap_or(0.0);
        }
        let trials = [trial];
        let mut fit = fitted(&[], &trials);
        for error in [0.0, 50.0] {
            fit.randomness.input = error;
            fit.smooth(&trials).expect("a trajectory");
            let linear = fit.linear(&trials);
            let along = Along::new(&fit, &linear, &trials, 0);
            let off = |k: usize| along.states(k).iter().zip(fit.trajectories[0].states(k)).any(|(a, b)| a != b);
            assert_eq!((0..trials[0].len()).any(off), error > 0.0, "{error}");
            assert!(!off(0), "the first states are given");
        }
    }
}
