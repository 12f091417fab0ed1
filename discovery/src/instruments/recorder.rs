//! Recorded forces that are late, as behind the filter of a load cell: all devices are ahead of them.
//!
//! Nothing in a machine acts before it is driven. But what is missing may look like it to first order, and friction does; so forces are
//! late only where that explains most of what is left.

use super::clock::FEW;
use super::clocks::{Clocks, Moment};
use super::sizing::{At, Sizing};
use crate::data::device::Device;
use crate::filter::error::FitError;
use crate::filter::estimate::Fit;
use crate::filter::kalman::Randomness;
use crate::hypothesis::parameter::free_parameters;
use crate::model::randomness::Recorder;
use crate::weigh::criterion::EVIDENCE;

/// Samples, as many times as a delay may be that is seen to first order, within which it may end.
const WITHIN: f64 = 2.0;

impl Sizing<'_> {
    /// `fit` where the recorded forces are late, or late ones smoothed as well, with what the parameters of the effects from `first` on and
    /// the latent forces are then; none where the data do not ask for it.
    pub(crate) fn recorded_late(&self, fit: &Fit, first: usize) -> Result<Option<Fit>, FitError> {
        let begin = self.at(fit, fit.randomness.clone());
        let worth = |value: f64| value < begin.value - self.penalty.of_parameters(1) - EVIDENCE;
        let starts = self.recorders(fit, &begin).into_iter().filter(|start| worth(start.value));
        let Some(start) = starts.min_by(|a, b| a.value.total_cmp(&b.value)) else { return Ok(None) };
        let Some((late, at)) = self.set_recorder(fit, start)? else { return Ok(None) };
        let cost = self.cost_beyond(&at.randomness, &begin.randomness);
        let Some((late, at)) = self.followed(late, at, begin.value - cost - EVIDENCE)? else { return Ok(None) };
        let (mut late, at) = self.adapted(&late, &free_parameters(&fit.model, first), at)?;
        late.randomness = at.randomness;
        Ok(Some(late))
    }

    /// What late forces would gain, to first order, at the latent forces as they are and without: a delay, or of late ones a filter.
    fn recorders(&self, fit: &Fit, from: &At) -> Vec<At> {
        let recorder = from.randomness.recorder;
        let moment = if recorder.delay > 0.0 { Moment::Variance } else { Moment::Delay };
        let in_time = |device: &Device| self.channels(*device).iter().any(|at| from.randomness.late[*at] == 0.0);
        // One clock is that by which all others count.
        if recorder.variance > 0.0 || !Device::ALL.iter().any(in_time) {
            return Vec::new();
        }
        let clocks = Clocks { devices: Vec::new(), recorder: vec![moment], all: self.all.clone() };
        let of = |randomness: Randomness| {
            let normal = clocks.normal(fit, self.trials, &randomness);
            let step = normal.right[0] / normal.gram[0];
            let few = FEW * self.interval;
            let most = if moment == Moment::Delay { few } else { 0.5 * few * few };
            let mut next = randomness;
            match moment {
                Moment::Delay => next.recorder = Recorder::filter(step),
                Moment::Variance => next.recorder.variance = 2.0 * step,
            }
            let value = normal.minus_two_log_likelihood - normal.right[0] * step;
            (step > 0.0 && step <= most).then_some(At { randomness: next, value })
        };
        let sizes = [from.randomness.clone(), from.randomness.without_latents()];
        sizes.into_iter().filter_map(of).collect()
    }

    /// `fit` with forces late as in `start`, behind a filter or only later, whichever is likelier: the motion of a stiff robot, of which
    /// much is as fast as a filter, does not tell what that smooths. None where the delay ends far from where it could be seen to first
    /// order, or no trajectory goes with it.
    fn set_recorder(&self, fit: &Fit, start: At) -> Result<Option<(Fit, At)>, FitError> {
        let mut later = start.clone();
        later.randomness.recorder.variance = 0.0;
        let mut best: Option<(Fit, At)> = None;
        for start in [start, later] {
            match self.set_clock(fit, start) {
                Err(FitError::Diverged { .. } | FitError::Simulation(_)) => {}
                set => {
                    let set = set?;
                    let Recorder { delay, .. } = set.1.randomness.recorder;
                    let seen = delay > 0.0 && delay <= WITHIN * FEW * self.interval;
                    let better = best.as_ref().is_none_or(|best| set.1.value < best.1.value);
                    best = if seen && better { Some(set) } else { best };
                }
            }
        }
        Ok(best)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::Trial;
    use crate::data::recording::{Bench, fitted_on, record_on};
    use crate::filter::estimate::noise_of_data;
    use crate::instruments::less_by_one;
    use crate::weigh::criterion::Penalty;

    /// What is found of recordings of a bench whose recorded forces were `changed`.
    fn found(bench: &Bench, duration: f64, changed: impl Fn(&mut Trial)) -> (Fit, [Trial; 2]) {
        let trials = [7, 8].map(|seed| {
            let mut trial = record_on(bench, &[], duration, seed);
            changed(&mut trial);
            trial
        });
        let noise = noise_of_data(&trials);
        let fit = fitted_on(bench, &[], &trials);
        let late = Sizing::new(&trials, &noise, Penalty::new(10_000)).recorded_late(&fit, 0).expect("a fit");
        (late.expect("late forces"), trials)
    }

    /// Late by two samples: nothing that the catalogue has makes a machine act before it is driven.
    #[test]
    fn forces_that_are_recorded_late_are_late() {
        let (fit, trials) = found(&Bench::large(), 60.0, |trial| {
            let inputs = trial.inputs.clone();
            trial.inputs[2..].copy_from_slice(&inputs[..inputs.len() - 2]);
        });
        let Recorder { delay, variance } = fit.randomness.recorder;
        assert!((delay / (2.0 * trials[0].interval()) - 1.0).abs() < 0.05, "{delay}");
        assert!(variance < 0.1 * delay * delay, "{variance}");
        // What is certain is not given back, as with any clock.
        assert!(less_by_one(&fit, &trials).iter().all(|less| less.recorder.delay == delay));
    }

    /// The delay and the variance that are found behind a filter of first order with this time constant (s), and those that the filter
    /// has from sample to sample.
    fn behind_a_filter(bench: &Bench, duration: f64, time_constant: f64) -> [Recorder; 2] {
        let (fit, trials) = found(bench, duration, |trial| {
            let decay = (-trial.interval() / time_constant).exp();
            for k in 1..trial.len() {
                let before = trial.inputs[k - 1].winch_force;
                let forces = trial.inputs[k].winch_force.iter_mut().zip(before);
                forces.for_each(|(force, before)| *force += decay * (before - *force));
            }
        });
        let interval = trials[0].interval();
        let decay = (-interval / time_constant).exp();
        let delay = interval * decay / (1.0 - decay);
        [fit.randomness.recorder, Recorder { delay, variance: delay * (delay + interval) }]
    }

    /// Beside a delay alone a mass of some tenths of a per mille was named, since a filter takes from the forces what moves faster.
    #[test]
    fn forces_that_are_recorded_behind_a_filter_are_late_and_smoothed() {
        let mut bench = Bench::large();
        bench.noise = [1e-4, 1e-4, 1e-6, 1e-4];
        let [found, truth] = behind_a_filter(&bench, 60.0, 0.15);
        assert!((found.delay / truth.delay - 1.0).abs() < 0.05, "{found:?} {truth:?}");
        assert!((found.variance / truth.variance - 1.0).abs() < 0.2, "{found:?} {truth:?}");
    }

    /// Of a robot of 4 m whose cables ring: its trajectory moves by more than a linear model tells where the forces come later.
    #[test]
    fn forces_of_a_stiff_robot_that_are_recorded_behind_a_filter_are_late() {
        let [found, truth] = behind_a_filter(&Bench::laboratory(), 20.0, 0.03);
        assert!((found.delay / truth.delay - 1.0).abs() < 0.15, "{found:?} {truth:?}");
    }
}
