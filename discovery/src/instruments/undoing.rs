//! What recording does and can be undone in recordings: forces that are late, as behind the filter of a load cell, and a clock that is
//! slow.
//!
//! Forces that come later are those recorded and a part of how they change; where more time passes than the stamps say, each step goes
//! on for as much longer. What that does to the motion is estimated as the parameters of effects are, and together with them: friction and
//! masses look like it to first order. Then it is [undone](Trial::before) in the recordings: forces are taken from as much earlier, so that
//! what was recorded in time beside them, as a wind, stays where it is, and stamps are stretched.

use rayon::prelude::*;

use super::clock::FEW;
use super::clocks::Clocks;
use super::sizing::{Sizing, WORTH};
use crate::data::device::Device;
use crate::data::{Recorder, Trial, Undone};
use crate::filter::error::FitError;
use crate::filter::estimate::{Fit, for_trial};
use crate::filter::kalman::Randomness;
use crate::filter::whiten::{Forcing, Normal, whiten};
use crate::hypothesis::along::Along;
use crate::hypothesis::ends::Ends;
use crate::hypothesis::parameter::{Free, free_parameters};
use crate::hypothesis::survey::regularise;
use crate::model::delayed::rates;
use crate::weigh::criterion::EVIDENCE;
use crate::weigh::lost::of_forces;
use crate::weigh::proposal::varied;
use crate::weigh::solve::solve;

/// Samples, as many times as a delay may be that is seen to first order, within which it may end.
const WITHIN: f64 = 2.0;
/// By how much a clock may be slow or fast: what is off by more has other units.
const MOST_SLOW: f64 = 0.1;
/// Moves of the recordings and of the trajectory in turn.
const MOVES: usize = 4;
/// What is estimated of a recorder: its delay, and half its variance.
const MOMENTS: usize = 2;

/// What recording may do.
#[derive(Clone, Copy)]
enum Doing {
    /// Forces are late, and smooth as well where it has two moments.
    Forces { moments: usize },
    /// The clock is slow.
    Clock,
}

impl Doing {
    fn parameters(self) -> usize {
        match self {
            Self::Forces { moments } => moments,
            Self::Clock => 1,
        }
    }

    /// What its parameters do along a trial.
    fn forcing(self, along: &Along<'_>) -> Forcing {
        match self {
            Self::Forces { moments } => changes(along.trial)
                .iter()
                .take(moments)
                .fold(Forcing::none(), |forcing, forces| forcing.beside(&of_forces(along.linear, forces))),
            Self::Clock => of_time(along),
        }
    }

    /// What it is by its parameters.
    fn of(self, parameters: &[f64]) -> Undone {
        match self {
            Self::Forces { .. } => Undone::Forces(Recorder {
                delay: parameters[0],
                variance: parameters.get(1).map_or(0.0, |half| 2.0 * half),
            }),
            Self::Clock => Undone::Clock(parameters[0]),
        }
    }
}

/// Something that recording did, beside what has been undone already.
pub(crate) struct Did {
    pub(crate) undone: Undone,
    /// The trials as they were before, and what is fitted to them.
    pub(crate) trials: Vec<Trial>,
    pub(crate) fit: Fit,
    /// What its parameters cost.
    pub(crate) cost: f64,
}

/// Where the parameters of the effects, the clocks and what recording does would go together.
struct Step {
    randomness: Randomness,
    undone: Undone,
    /// Fall of `-2 log L` that is the recording's alone.
    gain: f64,
    /// `-2 log L` that all of it promises.
    promise: f64,
}

impl Sizing<'_> {
    /// Forces that are late, and smooth as well where that is likelier, with what the parameters of the effects from `first` on are then;
    /// none where the data do not ask for it.
    pub(crate) fn recorded_late(&self, fit: &Fit, first: usize) -> Result<Option<Did>, FitError> {
        let begin = self.at(fit, fit.randomness.clone());
        let in_time = |device: &Device| self.channels(*device).iter().any(|at| fit.randomness.late[*at] == 0.0);
        // One clock is that by which all others count.
        if !Device::ALL.iter().any(in_time) {
            return Ok(None);
        }
        let mut best: Option<(f64, Did)> = None;
        for moments in [MOMENTS, 1] {
            let doing = Doing::Forces { moments };
            let enough = begin.value - self.cost(doing) - EVIDENCE;
            let Some((value, late)) = self.moved(fit, first, doing, enough)? else { continue };
            let score = value + late.cost;
            if best.as_ref().is_none_or(|(best, _)| score < *best) {
                best = Some((score, late));
            }
        }
        Ok(best.map(|(_, late)| late))
    }

    /// A clock that is slow, or fast, likewise, where that gains so much.
    pub(crate) fn slow_clock(&self, fit: &Fit, first: usize, gain: f64) -> Result<Option<Did>, FitError> {
        if !gain.is_finite() {
            return Ok(None);
        }
        let begin = self.at(fit, fit.randomness.clone());
        let least = gain.max(EVIDENCE) + self.cost(Doing::Clock);
        Ok(self.moved(fit, first, Doing::Clock, begin.value - least)?.map(|(_, slow)| slow))
    }

    /// What the parameters of what recording does cost: a slow clock is chosen among all that looks like it, as an effect is.
    fn cost(&self, doing: Doing) -> f64 {
        match doing {
            Doing::Forces { moments } => self.penalty.of_parameters(moments),
            Doing::Clock => self.penalty.of(1),
        }
    }

    /// What recording does undone, and how likely the fit is then, if that is as likely as asked for. None also where a delay
    /// ends far from where it could be seen to first order, or the forces would be recorded before they act.
    fn moved(&self, fit: &Fit, first: usize, doing: Doing, enough: f64) -> Result<Option<(f64, Did)>, FitError> {
        let free = free_parameters(&fit.model, first);
        let (mut fit, mut trials) = (fit.clone(), self.trials.to_vec());
        let (mut undone, mut value) = (None::<Undone>, f64::INFINITY);
        let mut best = None;
        for round in 0..MOVES {
            let step = step(&fit, &trials, &free, doing);
            if round == 0 && (step.gain < 2.0 * WORTH || step.promise > enough) {
                return Ok(None);
            }
            let next = undone.map_or(step.undone, |undone| undone.and(step.undone));
            if !self.may_be(next) {
                break;
            }
            undone = Some(next);
            trials = self.trials.par_iter().map(|trial| trial.before(next)).collect();
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
                let (trials, fit) = (trials.clone(), fit.clone());
                best = Some(Did { undone: next, trials, fit, cost: self.cost(doing) });
            }
            if gained < 2.0 * WORTH {
                break;
            }
        }
        Ok(best.filter(|_| value < enough).map(|did| (value, did)))
    }

    /// Whether recording may do so, with what has been undone of it: forces are not recorded before they act, nor less smooth than they are
    /// by now, nor so late that it could not be seen to first order.
    fn may_be(&self, undone: Undone) -> bool {
        let recorder = match undone {
            Undone::Clock(slow) => return slow.abs() < MOST_SLOW,
            Undone::Forces(recorder) => recorder,
        };
        let all = Undone::recorder(self.trials).behind(recorder);
        all.delay > 0.0 && recorder.variance >= 0.0 && recorder.delay.abs() <= WITHIN * FEW * self.interval
    }
}

/// How far what recording does would move, with latent forces as they are or without, whichever promises more.
fn step(fit: &Fit, trials: &[Trial], free: &[Free], doing: Doing) -> Step {
    let of = |randomness: Randomness| {
        let (normal, others) = normal(fit, trials, &randomness, free, doing);
        let (steps, _) = solve(&normal);
        let rest = normal.picked(0..others);
        let rest = normal.minus_two_log_likelihood - rest.drop(&solve(&rest).0);
        let promise = normal.minus_two_log_likelihood - normal.drop(&steps);
        Step { randomness, undone: doing.of(&steps[others..]), gain: rest - promise, promise }
    };
    let [own, without] = [fit.randomness.clone(), fit.randomness.without_latents()].map(of);
    if without.promise < own.promise { without } else { own }
}

/// Normal equations of the parameters that are free, the clocks that are set and behind these the parameters of what recording
/// does; and how many come before the latter.
fn normal(fit: &Fit, trials: &[Trial], randomness: &Randomness, free: &[Free], doing: Doing) -> (Normal, usize) {
    let clocks = Clocks::set(randomness, trials);
    let (free, varied) = varied(&fit.model, free);
    let linear = fit.linear(trials);
    let of_trial = |t: usize| {
        let (linear, trial, along) = (&linear[t], &trials[t], Along::new(fit, &linear, trials, t));
        let forcing = clocks.after(&along, &varied).beside(&doing.forcing(&along));
        whiten(linear, &for_trial(randomness, trial), &forcing)
    };
    let parts: Vec<Normal> = (0..trials.len()).into_par_iter().map(of_trial).collect();
    let others = free.len() + clocks.count();
    let mut normal = Normal::empty(others + doing.parameters());
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

/// How far the states go at the ends of the steps where all of a step takes longer, for each share that it does.
fn of_time(along: &Along<'_>) -> Forcing {
    let linear = along.linear;
    let n = linear.states;
    let ends = Ends::new(along, &(0..linear.len));
    let mut step = vec![0.0; (linear.len - 1) * n];
    for (k, row) in step.chunks_exact_mut(n).enumerate() {
        row.iter_mut().zip(ends.rates(k, 1)).for_each(|(slot, rate)| *slot = (linear.interval[k] * rate) as f32);
    }
    Forcing { first: 0, columns: 1, step, sensor: vec![0.0; linear.len * linear.channels] }
}

/// Standard errors of what has been undone: of the recorder's delay (s) and its variance (s²), and of the share by which the clock is slow.
/// The parameters of the effects from `first` on and the clocks of the devices adapt.
pub(crate) fn errors(fit: &Fit, trials: &[Trial], first: usize) -> [Option<f64>; MOMENTS + 1] {
    let recorder = Undone::recorder(trials);
    let of = |doing: Doing| {
        let (normal, others) = normal(fit, trials, &fit.randomness, &free_parameters(&fit.model, first), doing);
        let (_, covariance) = solve(&normal);
        let error = |at: usize| {
            let variance = (at < doing.parameters()).then(|| covariance[(others + at, others + at)])?;
            (variance > 0.0 && variance.is_finite()).then(|| variance.sqrt())
        };
        [error(0), error(1)]
    };
    let moments = recorder.moments();
    let [delay, half] = if recorder.is_in_time() { [None; 2] } else { of(Doing::Forces { moments }) };
    let [slow, _] = if Undone::slow_clock(trials) == 0.0 { [None; 2] } else { of(Doing::Clock) };
    [delay, half.map(|half| 2.0 * half), slow]
}

#[cfg(test)]
mod tests {
    use cdpr::effect::EffectSpec;

    use super::*;
    use crate::data::recording::{Bench, fitted_on, record_on};
    use crate::filter::estimate::noise_of_data;
    use crate::weigh::criterion::Penalty;

    /// What is found of recordings of a bench whose recorded forces were `changed`.
    fn found(bench: &Bench, hidden: &[EffectSpec], duration: f64, changed: impl Fn(&mut Trial)) -> (Recorder, Did) {
        let trials = [7, 8].map(|seed| {
            let mut trial = record_on(bench, hidden, duration, seed);
            changed(&mut trial);
            trial
        });
        let noise = noise_of_data(&trials);
        let fit = fitted_on(bench, hidden, &trials);
        let late = Sizing::new(&trials, &noise, Penalty::new(10_000)).recorded_late(&fit, 0).expect("a fit");
        let late = late.expect("late forces");
        (Undone::recorder(&late.trials), late)
    }

    /// Late by two samples: nothing that the catalogue has makes a machine act before it is driven.
    #[test]
    fn forces_that_are_recorded_late_are_late() {
        let bench = Bench::large();
        let (recorder, Did { undone, trials, fit, .. }) = found(&bench, &[], 60.0, |trial| {
            let inputs = trial.inputs.clone();
            for (late, inputs) in trial.inputs[2..].iter_mut().zip(&inputs) {
                late.winch_force = inputs.winch_force;
            }
        });
        assert!((recorder.delay / (2.0 * trials[0].interval()) - 1.0).abs() < 0.02, "{recorder:?}");
        assert!(recorder.variance.abs() < 0.1 * recorder.delay.powi(2), "{recorder:?}");
        assert_eq!(undone, Undone::Forces(recorder));
        // And their errors are those of what is then as good as in time.
        let [error, of_variance, of_clock] = errors(&fit, &trials, 0);
        let error = error.expect("an error");
        assert!(error < 0.02 * recorder.delay, "{error}");
        assert_eq!((of_variance.is_some(), of_clock), (recorder.variance > 0.0, None));
    }

    /// The recorder that is found behind a filter of first order with this time constant (s), and the one that the filter is from sample to
    /// sample.
    fn behind_a_filter(bench: &Bench, hidden: &[EffectSpec], duration: f64, constant: f64) -> ([Recorder; 2], Fit) {
        let (recorder, Did { trials, fit, .. }) = found(bench, hidden, duration, |trial| {
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

    /// Found to within its error, whatever else adapts; where stamps are right nothing is found.
    #[test]
    fn a_clock_that_is_fast_is_told_to_within_its_error() {
        let bench = Bench::large();
        for slow in [-2e-3, 0.0] {
            let trials = [7, 8].map(|seed| {
                let mut trial = record_on(&bench, &[], 60.0, seed);
                trial.time.iter_mut().for_each(|time| *time /= 1.0 + slow);
                trial
            });
            let noise = noise_of_data(&trials);
            let fit = fitted_on(&bench, &[], &trials);
            let found = Sizing::new(&trials, &noise, Penalty::new(10_000)).slow_clock(&fit, 0, 0.0).expect("a fit");
            assert_eq!(found.is_some(), slow != 0.0);
            let Some(Did { undone, trials, fit, .. }) = found else { continue };
            let [.., error] = errors(&fit, &trials, 0);
            let error = error.expect("an error");
            let Undone::Clock(found) = undone else { panic!("{undone:?}") };
            assert!(error < 0.1 * slow.abs() && (found - slow).abs() < 3.0 * error, "{found} {error}");
        }
    }

    /// Of a robot of 4 m whose cables ring.
    #[test]
    fn forces_of_a_stiff_robot_that_are_recorded_behind_a_filter_are_late() {
        let ([found, truth], _) = behind_a_filter(&Bench::laboratory(), &[], 20.0, 0.03);
        assert!((found.delay / truth.delay - 1.0).abs() < 0.15, "{found:?} {truth:?}");
    }
}
