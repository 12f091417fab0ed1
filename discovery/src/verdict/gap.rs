//! The gap: how far the simulation is from the measurements when it runs free for a while.

use std::borrow::Cow;

use rayon::prelude::*;
use statrs::distribution::{ContinuousCDF, StudentsT};

use crate::data::{Channel, Trial};
use crate::filter::estimate::{Fit, for_trial};
use crate::filter::kalman::{Filtered, Keep, Randomness, filter, smoothed_memory};
use crate::filter::path::LinearTrial;
use crate::model::delayed::earlier;
use crate::model::examined::Examined;
use crate::model::randomness::Memory;
use crate::verdict::policy::POLICY;

/// Share of a normal distribution below twice its standard deviation.
const WITHIN_TWO: f64 = 0.977_25;

/// Free-running predictions of one trial.
pub(crate) struct Prediction {
    /// Predicted channels, a row a sample; `NAN` before the first restart.
    pub(crate) shown: Vec<Vec<f64>>,
    /// Samples at which the simulation restarts.
    pub(crate) restarts: Vec<usize>,
    /// What stretches without a sample inside predict of the sample at their end.
    ends: Vec<(usize, Vec<f64>)>,
    /// By how much the filter, which runs free for one sample, misses what is measured next: sum of squares in multiples of what it
    /// expects, and count.
    missed: (f64, usize),
}

impl Prediction {
    /// What channel `j` showed last before sample `k` in the run from `restart` on; `NAN` where it showed nothing. A run that could not be
    /// simulated to its end stays where it stopped: were its samples left out, a model would be the better for them.
    fn last(&self, restart: usize, k: usize, j: usize) -> f64 {
        self.shown[restart..k].iter().rev().map(|row| row[j]).find(|value| value.is_finite()).unwrap_or(f64::NAN)
    }

    /// Whether the simulation restarts at sample `k`.
    pub(crate) fn is_restart(&self, k: usize) -> bool {
        self.restarts.binary_search(&k).is_ok()
    }
}

/// Simulates every trial freely over `horizon` (s) at a time, from the state that the filter has by then, at the samples
/// of [`Trial::restarts`]. A stretch takes at least one sampling interval. What the filter knows by then of noise with memory is
/// shown as well, fading as it does: it is as much a part of what is measured next as the state. How a drift changes from there on is
/// shown as all measurements tell it, and so is from what a recording counts: that is none of the simulation's.
pub(crate) fn predict(fit: &Fit, trials: &[Trial], horizon: f64) -> Vec<Prediction> {
    predict_by(fit, &fit.examined, trials, horizon, &Known::of(fit, trials))
}

/// What a filter knows of one trial at each sample, and a smoother of drifts.
pub(crate) struct Known {
    filtered: Filtered,
    drifts: Vec<Vec<f64>>,
}

impl Known {
    /// What is known of each trial by a fit.
    pub(crate) fn of(fit: &Fit, trials: &[Trial]) -> Vec<Self> {
        let linear = fit.linear(trials);
        let of_trial = |(linear, trial): (&LinearTrial, &Trial)| {
            let randomness = for_trial(&fit.randomness, trial);
            let drifts = if randomness.drifts() { smoothed_memory(linear, &randomness) } else { Vec::new() };
            let (linear, randomness) = (less_origins(linear, &randomness, &drifts), randomness.with_origins_known());
            Self { filtered: filter(&linear, &randomness, Keep::Innovations), drifts }
        };
        linear.par_iter().zip(trials).map(of_trial).collect()
    }
}

/// The same without that from which each channel counts, in the first sample as in all.
fn less_origins<'a>(linear: &'a LinearTrial, randomness: &Randomness, smoothed: &[Vec<f64>]) -> Cow<'a, LinearTrial> {
    if !randomness.memory.iter().any(Memory::is_origin) {
        return Cow::Borrowed(linear);
    }
    let mut less = linear.clone();
    for (j, processes) in randomness.shown_by_channel(linear.channels).into_iter().enumerate() {
        let memories = processes.map(|process| process - randomness.estimated());
        let origin: f64 = memories.filter(|at| randomness.memory[*at].is_origin()).map(|at| smoothed[0][at]).sum();
        less.residual.iter_mut().skip(j).step_by(linear.channels).for_each(|residual| *residual -= origin);
    }
    Cow::Owned(less)
}

/// The same by a model with other parameters, from what is known by the fit.
pub(crate) fn predict_by(
    fit: &Fit,
    examined: &Examined,
    trials: &[Trial],
    horizon: f64,
    known: &[Known],
) -> Vec<Prediction> {
    (0..trials.len())
        .into_par_iter()
        .map(|t| {
            let (trial, Known { filtered, drifts }) = (&trials[t], &known[t]);
            let randomness = for_trial(&fit.randomness, trial);
            let m = trial.channels.len();
            let remembered = randomness.shown_by_channel(m);
            let mut memory = vec![0.0; randomness.memory.len()];
            let remember = |shown: &mut [f64], memory: &[f64]| {
                for (value, processes) in shown.iter_mut().zip(&remembered) {
                    *value += processes.clone().map(|process| memory[process - randomness.estimated()]).sum::<f64>();
                }
            };
            let (shown, restarts) = (vec![vec![f64::NAN; m]; trial.len()], trial.restarts(horizon));
            let innovations = filtered.whitened.iter().filter(|innovation| innovation.is_finite());
            let missed = innovations.fold((0.0, 0), |(sum, count), innovation| (sum + innovation.powi(2), count + 1));
            let mut out = Prediction { shown, restarts, ends: Vec::new(), missed };
            let mut next_restart = out.restarts.clone().into_iter().peekable();
            let mut simulation = examined.simulation(trial, 0, fit.trajectories[t].states(0));
            let mut running = false;
            let mut shown = Vec::new();
            for k in 0..trial.len() {
                simulation.set_inputs(trial.inputs[k]);
                if next_restart.next_if_eq(&k).is_some() {
                    if running && out.is_restart(k.wrapping_sub(1)) {
                        examined.measure(&simulation, &trial.channels, &mut shown);
                        remember(&mut shown, &memory);
                        out.ends.push((k, shown.clone()));
                    }
                    let state: Vec<f64> =
                        fit.trajectories[t].states(k).iter().zip(filtered.updated(k)).map(|(a, b)| a + b).collect();
                    simulation.set_states(&state);
                    let known = &filtered.updated(k)[examined.states() + randomness.estimated()..];
                    memory.copy_from_slice(&known[..randomness.memory.len()]);
                    let origins = (0..memory.len()).filter(|at| randomness.memory[*at].is_origin());
                    origins.for_each(|at| memory[at] = drifts[k][at]);
                    running = true;
                }
                if running {
                    examined.measure(&simulation, &trial.channels, &mut shown);
                    remember(&mut shown, &memory);
                    out.shown[k].copy_from_slice(&shown);
                } else {
                    simulation.nudge_states(fit.trajectories[t].states(k));
                }
                if k + 1 < trial.len() {
                    let interval = trial.time[k + 1] - trial.time[k];
                    for (at, value) in memory.iter_mut().enumerate() {
                        if randomness.memory[at].drift {
                            *value += drifts[k + 1][at] - drifts[k][at];
                        } else {
                            *value *= randomness.decay(randomness.estimated() + at, interval);
                        }
                    }
                }
                if k + 1 < trial.len() && simulation.advance(trial.time[k + 1] - trial.time[k]).is_err() {
                    running = false;
                    simulation = examined.simulation(trial, k + 1, fit.trajectories[t].states(k + 1));
                }
            }
            for (j, (clock, channel)) in randomness.late.iter().zip(&trial.channels).enumerate() {
                let late = clock + examined.late(*channel);
                if late != 0.0 {
                    out.delay(&trial.time, j, late);
                }
            }
            out
        })
        .collect()
}

impl Prediction {
    /// Lets channel `j` show what was a while ago, in each stretch by itself.
    fn delay(&mut self, time: &[f64], j: usize, late: f64) {
        let ends = self.restarts.iter().skip(1).copied().chain([time.len()]);
        let stretches: Vec<(usize, usize)> = self.restarts.iter().copied().zip(ends).collect();
        for (first, end) in stretches.into_iter().filter(|(first, end)| end - first > 1) {
            let column: Vec<f64> = self.shown[first..end].iter().map(|row| row[j]).collect();
            for (row, then) in self.shown[first..end].iter_mut().zip(earlier(&time[first..end], &column, late)) {
                row[j] = then;
            }
        }
    }
}

/// Sums of squares of (simulated - measured)/σ.
#[derive(Clone, Debug, Default)]
pub(crate) struct GapSum {
    /// With their count, by channel of [`Channel::all`].
    channels: Vec<(f64, usize)>,
    /// By free run.
    runs: Vec<f64>,
    /// By how much predictions one sample ahead miss, in multiples of what is expected.
    missed: f64,
}

/// The gap of predictions.
pub(crate) fn gap(trials: &[Trial], predictions: &[Prediction], noise: &[f64]) -> GapSum {
    let all = Channel::all(trials.first().map_or(0, Trial::cables));
    let mut sums = vec![(0.0, 0); all.len()];
    let mut runs = Vec::new();
    for (trial, prediction) in trials.iter().zip(predictions) {
        let index: Vec<usize> = trial.channels.iter().map(|c| all.iter().position(|a| a == c).unwrap_or(0)).collect();
        // The sample of a restart has been used for the state; it is no prediction of its own stretch.
        let first = runs.len();
        runs.resize(first + prediction.restarts.len(), 0.0);
        let inside = (0..trial.len()).filter(|k| !prediction.is_restart(*k));
        let predicted = inside.map(|k| (k, &prediction.shown[k]));
        for (k, shown) in predicted.chain(prediction.ends.iter().map(|(k, shown)| (*k, shown))) {
            // Before the first nothing is predicted.
            let Some(run) = prediction.restarts.partition_point(|restart| *restart < k).checked_sub(1) else {
                continue;
            };
            for (j, at) in index.iter().enumerate() {
                let shown =
                    if shown[j].is_finite() { shown[j] } else { prediction.last(prediction.restarts[run], k, j) };
                let e = (shown - trial.measured[k][j]) / noise[*at];
                if e.is_finite() {
                    sums[*at].0 += e * e;
                    sums[*at].1 += 1;
                    runs[first + run] += e * e;
                }
            }
        }
    }
    let (sum, count) = predictions.iter().fold((0.0, 0), |a, b| (a.0 + b.missed.0, a.1 + b.missed.1));
    GapSum { channels: sums, runs, missed: (sum / count.max(1) as f64).sqrt() }
}

impl GapSum {
    /// Root mean square over all samples and channels.
    ///
    /// Where predictions one sample ahead miss by far, it is no less than that: along a trajectory that is not near the data errors
    /// may grow as they do nowhere else, and free runs from there are near to anything.
    pub(crate) fn total(&self) -> f64 {
        let (sum, count) = self.channels.iter().fold((0.0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
        let total = (sum / count.max(1) as f64).sqrt();
        if self.missed > POLICY.farthest { total.max(self.missed) } else { total }
    }

    /// Root mean square of one channel.
    pub(crate) fn channel(&self, at: usize) -> Option<f64> {
        let (sum, count) = self.channels[at];
        (count > 0).then(|| (sum / count as f64).sqrt())
    }

    /// Standard error of the change of the squared gap from `before`, as a share of that, by how it differs from one free run to
    /// the next; infinite where there is one only. Few runs know little of it: it is as much wider as Student's distribution says,
    /// so that a change of twice as much is as rare as for many.
    pub(crate) fn scatter(&self, before: &Self) -> f64 {
        let changes: Vec<f64> = self.runs.iter().zip(&before.runs).map(|(after, before)| after - before).collect();
        let count = changes.len() as f64;
        // No distribution has less than one degree of freedom.
        let Ok(student) = StudentsT::new(0.0, 1.0, count - 1.0) else { return f64::INFINITY };
        let wider = 0.5 * student.inverse_cdf(WITHIN_TWO);
        let mean = changes.iter().sum::<f64>() / count;
        let variance = changes.iter().map(|change| (change - mean).powi(2)).sum::<f64>() * count / (count - 1.0);
        wider * variance.sqrt() / before.runs.iter().sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::recording::{fitted, record};
    use crate::filter::estimate::noise_of_data;

    /// Every sample is a restart then; what is predicted of it is that of the one before.
    #[test]
    fn samples_one_horizon_apart_have_a_gap() {
        let trial = record(&[], 60.0, 8);
        let every = |by: usize| {
            let mut slow = trial.clone();
            let keep = |k: &usize| k.is_multiple_of(by);
            slow.time = (0..trial.len()).filter(keep).map(|k| trial.time[k]).collect();
            slow.inputs = (0..trial.len()).filter(keep).map(|k| trial.inputs[k]).collect();
            slow.measured = (0..trial.len()).filter(keep).map(|k| trial.measured[k].clone()).collect();
            [slow]
        };
        for by in [10, 20] {
            let trials = every(by);
            let fit = fitted(&[], &trials);
            let predictions = predict(&fit, &trials, 1.0);
            let gap = gap(&trials, &predictions, &noise_of_data(&trials)).total();
            assert!(gap > 0.1, "{by}: {gap}");
        }
    }

    #[test]
    fn what_differs_from_run_to_run_is_scatter() {
        let of = |runs: &[f64]| GapSum { channels: vec![(runs.iter().sum(), 10)], runs: runs.to_vec(), missed: 1.0 };
        let before = of(&[10.0, 10.0, 10.0, 10.0]);
        // Every run is better by a tenth.
        assert!(of(&[9.0; 4]).scatter(&before) < 1e-12);
        // One in four is worse by as much as it was, the others by nothing: a quarter, give or take as much, and three degrees of
        // freedom have 2.3 % beyond 3.307 where the normal distribution has them beyond 2.
        let few = of(&[20.0, 10.0, 10.0, 10.0]).scatter(&before);
        assert!((few / 0.25 - 3.307 / 2.0).abs() < 1e-3, "{few}");
        let often = |run: &[f64]| of(&run.repeat(100));
        let many = often(&[20.0, 10.0, 10.0, 10.0]).scatter(&often(&[10.0; 4]));
        assert!((many / 0.0217 - 1.0).abs() < 0.01, "{many}");
        // A delay of 5.8 ms that made the data likelier by thousands was given up for a single run of 20 s.
        assert_eq!(of(&[20.0]).scatter(&of(&[10.0])), f64::INFINITY);
    }

    /// Along a held-out trajectory that had not come near the data errors grew by 1e22, and nothing was missing at a gap of 3e-22.
    #[test]
    fn a_gap_is_no_less_than_what_is_missed_one_sample_ahead() {
        let trials = [record(&[], 40.0, 8)];
        let gap_along = |fit: &Fit| {
            let far = vec![1e3; Channel::all(4).len()];
            gap(&trials, &predict(fit, &trials, 5.0), &far).total()
        };
        let mut fit = fitted(&[], &trials);
        assert!(gap_along(&fit) < 1e-3);
        fit.randomness.noise.iter_mut().for_each(|noise| *noise *= 0.05);
        fit.randomness.force = fit.randomness.smallest_latent();
        fit.randomness.winch = fit.randomness.smallest_latent();
        assert!(gap_along(&fit) > 10.0);
    }

    /// A model under which a cable is wound in lost its worst samples, and seemed the better for it.
    #[test]
    fn a_run_that_stops_misses_what_comes_after() {
        let trials = [record(&[], 30.0, 8)];
        let (fit, noise) = (fitted(&[], &trials), noise_of_data(&trials));
        let mut predictions = predict(&fit, &trials, 5.0);
        let whole = gap(&trials, &predictions, &noise);
        let [_, second, third, ..] = predictions[0].restarts[..] else { panic!("three runs") };
        predictions[0].shown[second + 10..third].iter_mut().for_each(|row| row.fill(f64::NAN));
        let stopped = gap(&trials, &predictions, &noise);
        assert!(stopped.runs[1] > 10.0 * whole.runs[1] && stopped.runs[2] == whole.runs[2]);
        let count = |gap: &GapSum| gap.channels.iter().map(|(_, count)| count).sum::<usize>();
        assert_eq!(count(&stopped), count(&whole));
    }

    /// The first run ends where the second begins.
    #[test]
    fn sums_of_runs_are_those_of_channels() {
        let trials = [record(&[], 40.0, 8)];
        let fit = fitted(&[], &trials);
        for horizon in [0.02, 1.0, 5.0] {
            let gap = gap(&trials, &predict(&fit, &trials, horizon), &noise_of_data(&trials));
            let all: f64 = gap.channels.iter().map(|(sum, _)| sum).sum();
            assert!((gap.runs.iter().sum::<f64>() / all - 1.0).abs() < 1e-9, "{horizon}");
            assert_eq!(gap.runs.len(), trials[0].restarts(horizon).len());
        }
    }

    /// Free runs from the first second on were as far off as the filter knew little by then of where encoders had been set to zero: by chance
    /// 1.6 times as far as expected, and more than noise was left.
    #[test]
    fn from_what_a_recording_counts_is_none_of_what_is_left_of_a_free_run() {
        let mut trials = [record(&[], 60.0, 8)];
        let zeros = [0.08, -0.06, 0.05, -0.07];
        let fitted = fitted(&[], &trials);
        for row in &mut trials[0].measured {
            row[3..].iter_mut().zip(zeros).for_each(|(length, zero)| *length += zero);
        }
        let mut fit = fitted.clone();
        let origin = |channel: usize| Memory { channel, deviation: 0.07, time: f64::INFINITY, drift: true };
        fit.randomness =
            (7..11).fold(fit.randomness.without_latents(), |all, channel| all.with_memory(origin(channel)));
        fit.settle(&trials, 10).expect("a fit");
        for horizon in [1.0, 5.0, 20.0] {
            let expected = fit.spread(&trials, &fit.randomness, horizon);
            let without = Randomness { memory: Vec::new(), ..fit.randomness.clone() };
            let without = fit.spread(&trials, &without, horizon);
            assert!(
                expected.iter().zip(&without).all(|(own, without)| !own.is_finite() || *own < 1.01 * without),
                "{expected:?} {without:?}"
            );
            let gap = gap(&trials, &predict(&fit, &trials, horizon), &expected).total();
            assert!((0.6..1.2).contains(&gap), "{horizon} s: {gap}");
        }
    }

    /// A pose that wanders smoothly, by more than a noise that forgets at random would in five seconds: a robot without fault left 1.9.
    #[test]
    fn a_drift_is_none_of_what_is_left_of_a_free_run() {
        let mut trials = [record(&[], 60.0, 8)];
        let wander = |time: f64| 0.05 * (std::f64::consts::TAU * time / 90.0).cos();
        for (time, row) in trials[0].time.iter().zip(&mut trials[0].measured) {
            row[0] += wander(*time);
        }
        let mut fit = fitted(&[], &trials);
        let drift = Memory { channel: 0, deviation: 8e-3, time: 60.0, drift: true };
        fit.randomness = fit.randomness.without_latents().with_memory(drift);
        fit.smooth(&trials).expect("a fit");
        for horizon in [1.0, 5.0, 20.0] {
            let expected = fit.spread(&trials, &fit.randomness, horizon);
            let of_x = gap(&trials, &predict(&fit, &trials, horizon), &expected).channel(0).expect("a gap");
            assert!((0.8..1.2).contains(&of_x), "{horizon}: {of_x}");
        }
    }
}
