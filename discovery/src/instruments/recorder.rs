//! Recorded forces that are late, as behind the filter of a load cell.
//!
//! Forces that come later are those recorded and a part of how they change. What that does to the motion is estimated as the parameters of
//! effects are, and together with them: friction and masses look like it to first order. Then the forces are taken from as much earlier
//! ([`Trial::with_forces_before`]), so that what was recorded in time beside them, as a wind, stays where it is.

use rayon::prelude::*;

use super::clock::FEW;
use super::clocks::Clocks;
use super::sizing::{Sizing, WORTH};
use crate::data::device::Device;
use crate::data::{Recorder, Trial};
use crate::filter::error::FitError;
use crate::filter::estimate::{Fit, for_trial};
use crate::filter::kalman::Randomness;
use crate::filter::whiten::{Normal, whiten};
use crate::hypothesis::along::Along;
use crate::hypothesis::parameter::{Free, free_parameters};
use crate::hypothesis::signature::Varied;
use crate::hypothesis::survey::regularise;
use crate::model::delayed::rates;
use crate::weigh::criterion::EVIDENCE;
use crate::weigh::lost::of_forces;
use crate::weigh::proposal::varied_models;
use crate::weigh::solve::solve;

/// Samples, as many times as a delay may be that is seen to first order, within which it may end.
const WITHIN: f64 = 2.0;
/// Moves of the forces and of the trajectory in turn.
const MOVES: usize = 4;
/// What is estimated of a recorder: its delay, and half its variance.
const MOMENTS: usize = 2;

/// Forces that were recorded late, beside those that have been moved already.
pub(crate) struct Late {
    pub(crate) recorder: Recorder,
    /// The trials with the forces that acted, and what is fitted to them.
    pub(crate) trials: Vec<Trial>,
    pub(crate) fit: Fit,
    /// Parameters of the recorder.
    pub(crate) moments: usize,
}

/// Where the parameters of the effects, the clocks and the recorder would go together.
struct Step {
    randomness: Randomness,
    recorder: Recorder,
    /// Fall of `-2 log L` that is the recorder's alone.
    gain: f64,
    /// `-2 log L` that all of it promises.
    promise: f64,
}

impl Sizing<'_> {
    /// Forces that are late, and smooth as well where that is likelier, with what the parameters of the effects from `first` on are then;
    /// none where the data do not ask for it.
    pub(crate) fn recorded_late(&self, fit: &Fit, first: usize) -> Result<Option<Late>, FitError> {
        let begin = self.at(fit, fit.randomness.clone());
        let in_time = |device: &Device| self.channels(*device).iter().any(|at| fit.randomness.late[*at] == 0.0);
        // One clock is that by which all others count.
        if !Device::ALL.iter().any(in_time) {
            return Ok(None);
        }
        let mut best: Option<(f64, Late)> = None;
        for moments in [MOMENTS, 1] {
            let least = self.penalty.of_parameters(moments) + EVIDENCE;
            let Some((value, late)) = self.moved(fit, first, moments, begin.value - least)? else { continue };
            let score = value + self.penalty.of_parameters(moments);
            if best.as_ref().is_none_or(|(best, _)| score < *best) {
                best = Some((score, late));
            }
        }
        Ok(best.map(|(_, late)| late))
    }

    /// The forces moved to where they belong, and how likely the fit is then, if that is as likely as asked for. None also where a delay
    /// ends far from where it could be seen to first order, or the forces would be recorded before they act.
    fn moved(&self, fit: &Fit, first: usize, moments: usize, enough: f64) -> Result<Option<(f64, Late)>, FitError> {
        let free = free_parameters(&fit.model, first);
        let (mut fit, mut trials) = (fit.clone(), self.trials.to_vec());
        let (mut recorder, mut value) = (Recorder::default(), f64::INFINITY);
        let mut best = None;
        for round in 0..MOVES {
            let step = step(&fit, &trials, &free, moments);
            if round == 0 && (step.gain < 2.0 * WORTH || step.promise > enough) {
                return Ok(None);
            }
            recorder = recorder.behind(step.recorder);
            if !self.may_be(recorder) {
                break;
            }
            trials = self.trials.par_iter().map(|trial| trial.with_forces_before(recorder)).collect();
            fit.randomness = step.randomness;
            match fit.smooth(&trials) {
                Err(FitError::Diverged { .. } | FitError::Simulation(_)) => break,
                moved => moved?,
            };
            let sizing = self.on(&trials);
            let start = sizing.at(&fit, fit.randomness.clone());
            let (adapted, at) = sizing.adapted(&fit, &free, start)?;
            fit = adapted;
            fit.randomness = at.randomness;
            let gained = value - at.value;
            if gained > 0.0 {
                value = at.value;
                best = Some(Late { recorder, trials: trials.clone(), fit: fit.clone(), moments });
            }
            if gained < 2.0 * WORTH {
                break;
            }
        }
        Ok(best.filter(|_| value < enough).map(|late| (value, late)))
    }

    /// Whether forces may be recorded so, with what has been undone of it: not before they act, nor less smooth than they are by now, nor
    /// so late that it could not be seen to first order.
    fn may_be(&self, recorder: Recorder) -> bool {
        let all = Recorder::undone_in(self.trials).behind(recorder);
        all.delay > 0.0 && recorder.variance >= 0.0 && recorder.delay.abs() <= WITHIN * FEW * self.interval
    }
}

/// How far the recorder would move, with latent forces as they are or without, whichever promises more.
fn step(fit: &Fit, trials: &[Trial], free: &[Free], moments: usize) -> Step {
    let of = |randomness: Randomness| {
        let (normal, others) = normal(fit, trials, &randomness, free, moments);
        let (steps, _) = solve(&normal);
        let rest = normal.picked(0..others);
        let rest = normal.minus_two_log_likelihood - rest.drop(&solve(&rest).0);
        let promise = normal.minus_two_log_likelihood - normal.drop(&steps);
        let recorder =
            Recorder { delay: steps[others], variance: steps.get(others + 1).map_or(0.0, |half| 2.0 * half) };
        Step { randomness, recorder, gain: rest - promise, promise }
    };
    let [own, without] = [fit.randomness.clone(), fit.randomness.without_latents()].map(of);
    if without.promise < own.promise { without } else { own }
}

/// Normal equations of the parameters that are free, the clocks that are set and behind these the moments of the recorder; and how many
/// come before the moments.
fn normal(fit: &Fit, trials: &[Trial], randomness: &Randomness, free: &[Free], moments: usize) -> (Normal, usize) {
    let clocks = Clocks::set(randomness, trials);
    let both = free.iter().zip(varied_models(&fit.model, free)).filter_map(|(free, varied)| Some((*free, varied?)));
    let (free, varied): (Vec<Free>, Vec<Varied>) = both.unzip();
    let linear = fit.linear(trials);
    let of_trial = |t: usize| {
        let (linear, trial, along) = (&linear[t], &trials[t], Along::new(fit, &linear, trials, t));
        let forcing = changes(trial)
            .iter()
            .take(moments)
            .fold(clocks.after(&along, &varied), |forcing, forces| forcing.beside(&of_forces(linear, forces)));
        whiten(linear, &for_trial(randomness, trial), &forcing)
    };
    let parts: Vec<Normal> = (0..trials.len()).into_par_iter().map(of_trial).collect();
    let others = free.len() + clocks.count();
    let mut normal = Normal::empty(others + moments);
    parts.iter().for_each(|part| normal.add(part));
    regularise(&mut normal, &fit.model, free.iter().map(|free| Some(*free)));
    (normal, others)
}

/// How the force at each winch changes where it comes earlier by a second, and where half a square second less of it is smoothed.
fn changes(trial: &Trial) -> [Vec<Vec<f64>>; MOMENTS] {
    let of = |winch: usize| {
        let forces: Vec<f64> = trial.inputs.iter().map(|inputs| inputs.winch_force[winch]).collect();
        let rate = rates(&trial.time, &forces, 1);
        let bend = rates(&trial.time, &rate, 1).into_iter().map(|bend| -bend).collect();
        (rate, bend)
    };
    let (rate, bend) = (0..trial.cables()).map(of).unzip();
    [rate, bend]
}

/// Standard errors of what has been undone of the recorder: of its delay (s) and its variance (s²). The parameters of the effects from
/// `first` on and the clocks adapt.
pub(super) fn errors(fit: &Fit, trials: &[Trial], first: usize) -> [Option<f64>; MOMENTS] {
    let recorder = Recorder::undone_in(trials);
    if recorder.is_in_time() {
        return [None; MOMENTS];
    }
    let moments = if recorder.variance > 0.0 { MOMENTS } else { 1 };
    let (normal, others) = normal(fit, trials, &fit.randomness, &free_parameters(&fit.model, first), moments);
    let (_, covariance) = solve(&normal);
    let error = |at: usize, unit: f64| {
        let variance = (at < others + moments).then(|| covariance[(at, at)])?;
        (variance > 0.0 && variance.is_finite()).then(|| unit * variance.sqrt())
    };
    [error(others, 1.0), error(others + 1, 2.0)]
}

#[cfg(test)]
mod tests {
    use cdpr::effect::EffectSpec;

    use super::*;
    use crate::data::recording::{Bench, fitted_on, record_on};
    use crate::filter::estimate::noise_of_data;
    use crate::weigh::criterion::Penalty;

    /// What is found of recordings of a bench whose recorded forces were `changed`.
    fn found(bench: &Bench, hidden: &[EffectSpec], duration: f64, changed: impl Fn(&mut Trial)) -> Late {
        let trials = [7, 8].map(|seed| {
            let mut trial = record_on(bench, hidden, duration, seed);
            changed(&mut trial);
            trial
        });
        let noise = noise_of_data(&trials);
        let fit = fitted_on(bench, hidden, &trials);
        let late = Sizing::new(&trials, &noise, Penalty::new(10_000)).recorded_late(&fit, 0).expect("a fit");
        late.expect("late forces")
    }

    /// Late by two samples: nothing that the catalogue has makes a machine act before it is driven.
    #[test]
    fn forces_that_are_recorded_late_are_late() {
        let bench = Bench::large();
        let Late { recorder, trials, fit, moments } = found(&bench, &[], 60.0, |trial| {
            let inputs = trial.inputs.clone();
            for (late, inputs) in trial.inputs[2..].iter_mut().zip(&inputs) {
                late.winch_force = inputs.winch_force;
            }
        });
        assert!((recorder.delay / (2.0 * trials[0].interval()) - 1.0).abs() < 0.02, "{recorder:?}");
        assert!(recorder.variance.abs() < 0.1 * recorder.delay.powi(2), "{recorder:?}");
        assert!(trials.iter().all(|trial| trial.recorder() == recorder));
        // And their errors are those of what is then as good as in time.
        let [error, of_variance] = errors(&fit, &trials, 0);
        let error = error.expect("an error");
        assert!(error < 0.02 * recorder.delay, "{error}");
        assert_eq!(of_variance.is_some(), moments > 1 && recorder.variance > 0.0);
    }

    /// The recorder that is found behind a filter of first order with this time constant (s), and the one that the filter is from sample to
    /// sample.
    fn behind_a_filter(bench: &Bench, hidden: &[EffectSpec], duration: f64, constant: f64) -> ([Recorder; 2], Fit) {
        let Late { recorder, trials, fit, .. } = found(bench, hidden, duration, |trial| {
            let decay = (-trial.interval() / constant).exp();
            for k in 1..trial.len() {
                let before = trial.inputs[k - 1].winch_force;
                let forces = trial.inputs[k].winch_force.iter_mut().zip(before);
                forces.for_each(|(force, before)| *force += decay * (before - *force));
            }
        });
        let interval = trials[0].interval();
        let decay = (-interval / constant).exp();
        let delay = interval * decay / (1.0 - decay);
        ([recorder, Recorder { delay, variance: delay * (delay + interval) }], fit)
    }

    /// Beside a delay alone a mass of some tenths of a per mille was named, since a filter takes from the forces what moves faster; and where
    /// a mass is, or friction, these took over what is smoothed before it was asked for.
    #[test]
    fn forces_that_are_recorded_behind_a_filter_are_late_and_smoothed() {
        let mut bench = Bench::large();
        bench.noise = [1e-4, 1e-4, 1e-6, 1e-4];
        for (hidden, value) in [(None, 0.0), (Some("platform_mass"), 100.0), (Some("winch_coulomb_friction"), 150.0)] {
            let hidden = hidden.map(|id| match id {
                "platform_mass" => EffectSpec::new(id, None, &[value]).expect("an effect"),
                _ => EffectSpec::new(id, Some(3), &[value, 0.01]).expect("an effect"),
            });
            let ([found, truth], fit) = behind_a_filter(&bench, hidden.as_slice(), 60.0, 0.15);
            assert!((found.delay / truth.delay - 1.0).abs() < 0.05, "{found:?} {truth:?}");
            assert!((found.variance / truth.variance - 1.0).abs() < 0.2, "{found:?} {truth:?}");
            if let Some(effect) = fit.model.effects.first() {
                assert!((effect.values[0] / value - 1.0).abs() < 2e-3, "{effect:?}");
            }
        }
    }

    /// Of a robot of 4 m whose cables ring.
    #[test]
    fn forces_of_a_stiff_robot_that_are_recorded_behind_a_filter_are_late() {
        let ([found, truth], _) = behind_a_filter(&Bench::laboratory(), &[], 20.0, 0.03);
        assert!((found.delay / truth.delay - 1.0).abs() < 0.15, "{found:?} {truth:?}");
    }
}
