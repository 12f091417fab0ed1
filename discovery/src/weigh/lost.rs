//! How far parameters may be off by what recorded forces lose with their error.
//!
//! The forces to be expected in the place of those recorded with an error lack a part that cannot be told from it (see
//! [`expected`](crate::instruments::expected)). What is left of the error is modelled as having nothing to do with the motion. That
//! is so where forces come from elsewhere; but a controller answers the motion, and the lost part of its answer looks like damping,
//! friction or mass (U. Forssell and L. Ljung, Automatica 35 (1999), 1215, on errors of a closed loop's noise model).
//!
//! The error itself has nothing to do with the motion, nor with what a parameter makes of it. So what was taken off the forces goes
//! along with that as far as the lost forces do. How far a parameter would move to make up for it says how far it may be off, either
//! way: how the forces were made is not known.

use rayon::prelude::*;

use crate::data::Trial;
use crate::filter::estimate::{Fit, for_trial};
use crate::filter::path::LinearTrial;
use crate::filter::whiten::{Forcing, Normal, whiten};
use crate::hypothesis::along::Along;
use crate::hypothesis::parameter::Free;
use crate::hypothesis::survey::regularise;
use crate::instruments::clocks::Clocks;
use crate::model::examined::WRENCH;
use crate::weigh::proposal::varied;
use crate::weigh::solve::solve;

/// How far parameters and clocks would move to make up for lost forces.
pub(crate) struct Lost {
    free: Vec<Free>,
    /// Of these, and of the clocks after them.
    steps: Vec<f64>,
}

impl Lost {
    pub(crate) fn moves(&self, parameter: Free) -> f64 {
        self.free.iter().position(|free| *free == parameter).map_or(0.0, |at| self.steps[at])
    }

    /// Of the clock at this place among those that are set.
    pub(crate) fn moves_clock(&self, clock: usize) -> f64 {
        self.steps.get(self.free.len() + clock).copied().unwrap_or(0.0)
    }
}

/// How far the parameters that are `free` and the clocks would move; none where the forces are as they were recorded.
pub(crate) fn lost(fit: &Fit, trials: &[Trial], free: &[Free]) -> Option<Lost> {
    if trials.iter().all(|trial| trial.taken_off.is_empty()) {
        return None;
    }
    let clocks = Clocks::set(&fit.randomness, trials);
    let (free, varied) = varied(&fit.model, free);
    let linear = fit.linear(trials);
    let columns = free.len() + clocks.count();
    let of_trial = |t: usize| {
        let (linear, trial, along) = (&linear[t], &trials[t], Along::new(fit, &linear, trials, t));
        let forces = of_forces(linear, &trial.taken_off);
        let forcing = clocks.after(&along, &varied).beside(&forces);
        whiten(linear, &for_trial(&fit.randomness, trial), &forcing)
    };
    let parts: Vec<Normal> = (0..trials.len()).into_par_iter().map(of_trial).collect();
    let mut all = Normal::empty(columns + 1);
    parts.iter().for_each(|part| all.add(part));
    let mut normal = all.picked(0..columns);
    regularise(&mut normal, &fit.model, free.iter().map(|free| Some(*free)));
    normal.right = all.gram[columns * all.columns..][..columns].to_vec();
    Some(Lost { free, steps: solve(&normal).0 })
}

/// What forces at the winches, besides those of the trial, do to the states.
pub(crate) fn of_forces(linear: &LinearTrial, forces: &[Vec<f64>]) -> Forcing {
    let n = linear.states;
    let mut step = vec![0.0; (linear.len - 1) * n];
    for (k, row) in step.chunks_exact_mut(n).enumerate() {
        for (winch, forces) in forces.iter().enumerate() {
            let acts = linear.column(k, n + WRENCH + winch);
            row.iter_mut().zip(acts).for_each(|(slot, by)| *slot += (forces[k] * by) as f32);
        }
    }
    Forcing { first: 0, columns: 1, step, sensor: vec![0.0; linear.len * linear.channels] }
}

#[cfg(test)]
mod tests {
    use cdpr::effect::EffectSpec;

    use super::*;
    use crate::data::recording::{fitted, record};
    use crate::hypothesis::parameter::free_parameters;
    use crate::hypothesis::signature::sensitivities;

    /// A force that is larger by a share of itself does what a gain of that share does.
    #[test]
    fn forces_of_a_gain_act_as_the_gain_does() {
        let gain = EffectSpec::new("winch_force_gain", Some(2), &[0.01]).expect("an effect");
        let trials = [record(&[], 20.0, 41)];
        let fit = fitted(&[gain], &trials);
        let free = free_parameters(&fit.model, 0);
        let (_, varied) = varied(&fit.model, &free);
        let linear = fit.linear(&trials);
        let by_gain = sensitivities(&Along::new(&fit, &linear, &trials, 0), &varied);
        let recorded = |k: usize| trials[0].inputs[k].winch_force[1];
        let forces: Vec<Vec<f64>> =
            (0..4).map(|i| (0..trials[0].len()).map(|k| if i == 1 { recorded(k) } else { 0.0 }).collect()).collect();
        let by_forces = of_forces(&linear[0], &forces);
        let size = by_gain.step.iter().map(|value| value.abs()).fold(0.0, f32::max);
        let apart = by_gain.step.iter().zip(&by_forces.step).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(size > 0.0 && apart < 0.03 * size, "{apart} of {size}");
    }

    /// A controller's answer to the winches' speeds is viscous friction of that size to the model, and no drag on the platform.
    #[test]
    fn a_lost_answer_to_the_motion_moves_what_looks_like_it() {
        let drag = EffectSpec::new("platform_linear_drag", None, &[60.0]).expect("an effect");
        let friction = EffectSpec::new("winch_viscous_friction", None, &[10.0]).expect("an effect");
        let mut trials = [record(&[], 60.0, 42)];
        let fit = fitted(&[drag, friction], &trials);
        let free = free_parameters(&fit.model, 0);
        assert!(lost(&fit, &trials, &free).is_none());
        // As if a controller's damping of 3 N s/m at every winch had been taken for error.
        let speed = |k: usize, i: usize| {
            let y = fit.trajectories[0].states(k);
            cdpr::kinematics::cables(fit.examined.plant.geometry(), &[y[0], y[1], y[2]], &[y[3], y[4], y[5]])[i].speed
        };
        let answer: Vec<Vec<f64>> = (0..4).map(|i| (0..trials[0].len()).map(|k| 3.0 * speed(k, i)).collect()).collect();
        trials[0].taken_off = answer;
        let certainty = crate::weigh::proposal::certainty(&fit, &trials, 0);
        assert!(certainty.lost[1] > 100.0 * certainty.lost[0], "{:?}", certainty.lost);
        let lost = lost(&fit, &trials, &free).expect("forces were taken off");
        let [drag, friction] = [0, 1].map(|at| lost.moves(free[at]));
        assert!((friction.abs() / 3.0 - 1.0).abs() < 0.1 && drag.abs() < 6.0, "{friction} {drag}");
        assert_eq!(lost.moves_clock(0), 0.0);
    }
}
