//! Trajectories and sizes of the random parts of a model, estimated from trials.

use std::sync::Arc;

use cdpr::model_file::Model;
use cdpr::simulation::Simulation;
use rayon::prelude::*;

use crate::data::clean::{median, noise_by_differences};
use crate::data::counts::least_noise;
use crate::data::{Channel, Trial};
use crate::filter::error::FitError;
use crate::filter::first::first_trajectory;
use crate::filter::kalman::{Filtered, Keep, Randomness, filter, smooth, spread};
use crate::filter::path::{LinearTrial, Trajectory, linearise};
use crate::filter::shelf::Linear;
use crate::model::examined::{Examined, disturb};
use crate::model::randomness::Memory;

/// A model with everything that the data say of it.
#[derive(Clone)]
pub(crate) struct Fit {
    pub(crate) model: Model,
    pub(crate) examined: Examined,
    pub(crate) first: Vec<Vec<f64>>,
    pub(crate) trajectories: Vec<Trajectory>,
    /// The model linearised along the trajectories, how late channels were taken to be then, and the sums of its defects.
    linear: Linear,
    late: Vec<f64>,
    defects: Vec<f64>,
    pub(crate) randomness: Randomness,
    /// Share of its next move that each trajectory takes.
    pace: Vec<f64>,
}

/// A run of the filter.
pub(crate) struct Look {
    pub(crate) randomness: Randomness,
    pub(crate) filtered: Vec<Filtered>,
    /// `-2 log L`.
    pub(crate) value: f64,
}

/// Share of a move that a trajectory takes where whole moves overshoot: where friction turns its sign within a sample.
const SLOW: f64 = 0.7;
/// Least share of a move that is tried where the model cannot be simulated along all of it.
const LEAST_SHARE: f64 = 1.0 / 16.0;
/// Share of the defects that a move may leave.
const LEFT: f64 = 0.6;
/// Defect of a sample, relative to the size of its state, that is rounding and discretisation.
const NO_DEFECT: f64 = 1e-6;
/// Mean defect of a sample where a trajectory goes back and forth about one that the model can make.
const SMALL_DEFECT: f64 = 3e-4;
/// Share of the least defects so far below which they have shrunk.
const SHRUNK: f64 = 0.9;
/// Moves in which they may not shrink before a trajectory is left as it is.
const PATIENCE: usize = 4;
/// Change of `-2 log L` by a move below which a trajectory has settled.
const SETTLED: f64 = 1.0;

/// Noise of each channel of [`Channel::all`], pooled over trials, from the data alone; `NAN` where it is not measured.
pub(crate) fn noise_of_data(trials: &[Trial]) -> Vec<f64> {
    Channel::all(trials.first().map_or(0, Trial::cables))
        .iter()
        .map(|channel| {
            let of_trial = |t: &Trial| t.channels.iter().position(|c| c == channel).map(|j| noise_by_differences(t, j));
            let noise = median(trials.iter().filter_map(of_trial).collect());
            if noise.is_nan() { noise } else { noise.max(least_noise(trials, *channel, noise)) }
        })
        .collect()
}

/// `randomness` with its noise in the order of this trial's channels.
pub(crate) fn for_trial(randomness: &Randomness, trial: &Trial) -> Randomness {
    let all = Channel::all(trial.cables());
    let noise = trial
        .channels
        .iter()
        .map(|c| all.iter().position(|a| a == c).map_or(f64::NAN, |at| randomness.noise[at]))
        .collect();
    let bounds = |bound: &[f64], without: f64| -> Vec<f64> {
        let of = |c: &Channel| all.iter().position(|a| a == c).map_or(without, |at| bound[at]);
        trial.channels.iter().map(of).collect()
    };
    let least_noise = bounds(&randomness.least_noise, 0.0);
    let most_noise = bounds(&randomness.most_noise, f64::INFINITY);
    let memory = randomness.memory.iter().filter_map(|m| {
        let channel = trial.channels.iter().position(|c| *c == all[m.channel])?;
        Some(Memory { channel, ..*m })
    });
    let mut memory: Vec<Memory> = memory.collect();
    memory.sort_by_key(|m| m.channel);
    let late = trial.channels.iter().map(|c| all.iter().position(|a| a == c).map_or(0.0, |at| randomness.late[at]));
    Randomness { noise, least_noise, most_noise, memory, late: late.collect(), ..randomness.clone() }
}

/// A new model on trajectories of an old one: states of the same name are taken over, new ones start at rest. Cables keep their tensions,
/// for a length that is kept while its anchor is moved by a metre tears a cable or lets it hang.
pub(crate) fn carry_over(old: &Examined, new: &Examined, trial: &Trial, trajectory: &Trajectory) -> Trajectory {
    if old.states() == new.states() {
        let mut carried = trajectory.clone();
        let n = carried.states;
        for (k, row) in carried.values.chunks_exact_mut(carried.width).enumerate() {
            keep_tensions(old, new, trial.time[k], trajectory.states(k), &mut row[..n]);
        }
        return carried;
    }
    let n = new.states();
    let width = n + new.latents();
    let first = new.first_states(trial);
    let mut values = vec![0.0; trial.len() * width];
    let fresh = first_trajectory(new, trial, &first);
    let mut follower: Option<Simulation> = None;
    for k in 0..trial.len() {
        let row = &mut values[k * width..(k + 1) * width];
        row.copy_from_slice(fresh.row(k));
        let from = trajectory.states(k);
        row[..6].copy_from_slice(&from[..6]);
        for i in 0..new.plant.cables() {
            if let (Some(a), Some(b)) = (old.plant.unstretched_index(i), new.plant.unstretched_index(i)) {
                row[b] = from[a];
            }
            if let (Some(a), Some(b)) = (old.plant.rate_index(i), new.plant.rate_index(i)) {
                row[b] = from[a];
            }
        }
        row[n..].copy_from_slice(trajectory.latents(k));
        follow(new, trial, k, row, &mut follower);
        keep_tensions(old, new, trial.time[k], from, &mut row[..n]);
    }
    Trajectory { values, width, states: n }
}

/// Moves the unstretched lengths in `to`, states of `new` that have those of `old` in `from`, by what the tension that each cable had at
/// rest asks for.
fn keep_tensions(old: &Examined, new: &Examined, time: f64, from: &[f64], to: &mut [f64]) {
    let chords = |model: &Examined, y: &[f64]| {
        let geometry = model.plant.at(time).geometry();
        cdpr::kinematics::cables(geometry, &[y[0], y[1], y[2]], &[0.0; 3])
    };
    let (before, after) = (chords(old, from), chords(new, to));
    for i in 0..new.plant.cables() {
        let (Some(a), Some(b)) = (old.plant.unstretched_index(i), new.plant.unstretched_index(i)) else { continue };
        let (had, has) = (&from[old.plant.effect_states(i)], &to[new.plant.effect_states(i)]);
        let tension = old.plant.tension_for(i, time, before[i].length, from[a], had).max(0.0);
        let length = new.plant.unstretched_length_for(i, time, after[i].length, tension, has);
        // None where the cable is the same.
        let change = length - old.plant.unstretched_length_for(i, time, before[i].length, tension, had);
        if change.is_finite() && to[b] + change > 0.0 {
            to[b] += change;
        }
    }
}

/// Own states of effects in `row`, sample `k` of a trajectory, as they follow from the samples before; at first those of
/// a start. `follower` is the simulation that has come here from the last sample.
fn follow(model: &Examined, trial: &Trial, k: usize, row: &mut [f64], follower: &mut Option<Simulation>) {
    let cables = 0..model.plant.cables();
    if cables.clone().all(|i| model.plant.effect_states(i).is_empty()) {
        return;
    }
    let n = model.states();
    match follower {
        None => model.plant.straighten(&mut row[..n]),
        Some(simulation) => {
            for at in cables.flat_map(|i| model.plant.effect_states(i)) {
                row[at] = simulation.states()[at];
            }
        }
    }
    let simulation = follower.get_or_insert_with(|| model.simulation(trial, k, &row[..n]));
    simulation.nudge_states(&row[..n]);
    disturb(simulation, &trial.inputs[k], &row[n..]);
    if k + 1 < trial.len() && simulation.advance(trial.time[k + 1] - trial.time[k]).is_err() {
        *follower = None;
    }
}

impl Fit {
    /// Fits trajectories of `model` to `trials`, beginning with `before` (another model's) or from measurements alone.
    pub(crate) fn new(
        model: &Model,
        trials: &[Trial],
        randomness: &Randomness,
        before: Option<&Fit>,
    ) -> Result<Self, FitError> {
        let examined = Examined::new(model).map_err(|e| FitError::Model(e.to_string()))?;
        let begun = trials.iter().enumerate().map(|(t, trial)| {
            let first = examined.first_states(trial);
            let trajectory = match before {
                Some(fit) => carry_over(&fit.examined, &examined, trial, &fit.trajectories[t]),
                None => {
                    let mut trajectory = first_trajectory(&examined, trial, &first);
                    let mut follower = None;
                    for (k, row) in trajectory.values.chunks_exact_mut(trajectory.width).enumerate() {
                        follow(&examined, trial, k, row, &mut follower);
                    }
                    trajectory
                }
            };
            (first, trajectory)
        });
        let begun = begun.collect();
        let mut fit = Self::along_trajectories(model, examined, trials, begun, randomness.clone())?;
        if let Some(before) = before {
            fit.pace.clone_from(&before.pace);
        }
        Ok(fit)
    }

    /// `model` linearised along trajectories that are known, each behind the guess of its first states.
    pub(crate) fn along_trajectories(
        model: &Model,
        examined: Examined,
        trials: &[Trial],
        begun: Vec<(Vec<f64>, Trajectory)>,
        randomness: Randomness,
    ) -> Result<Self, FitError> {
        let (first, trajectories) = begun.into_iter().unzip();
        let mut fit = Self {
            model: model.clone(),
            examined,
            first,
            trajectories,
            linear: Linear::Given(Arc::default()),
            late: Vec::new(),
            defects: Vec::new(),
            randomness,
            pace: vec![1.0; trials.len()],
        };
        fit.linearise(trials)?;
        Ok(fit)
    }

    /// Linearises along the present trajectories.
    fn linearise(&mut self, trials: &[Trial]) -> Result<(), FitError> {
        // Those along the trajectories before take no room any more.
        self.linear = Linear::Given(Arc::default());
        self.late.clone_from(&self.randomness.late);
        let linear = self.linearised(trials)?;
        self.defects = linear.iter().map(LinearTrial::total_defect).collect();
        self.linear = Linear::kept(linear);
        Ok(())
    }

    fn linearised(&self, trials: &[Trial]) -> Result<Vec<LinearTrial>, FitError> {
        let randomness = Randomness { late: self.late.clone(), ..self.randomness.clone() };
        let of_trial = |(t, trial): (usize, &Trial)| {
            let late = for_trial(&randomness, trial).late;
            linearise(&self.examined, trial, &self.trajectories[t], &self.first[t], &late)
        };
        trials.par_iter().enumerate().map(of_trial).collect()
    }

    /// The model linearised along the trajectories.
    pub(crate) fn linear(&self, trials: &[Trial]) -> Arc<Vec<LinearTrial>> {
        self.linear.models(|| {
            let again = self.linearised(trials);
            again.unwrap_or_else(|e| unreachable!("it was linearised along the same trajectories before: {e}"))
        })
    }

    /// Moves the trajectories to the smoothed states, or most of the way where that has overshot before, as far as the model
    /// can be simulated there, and linearises there. Returns `-2 log L` as it was before.
    pub(crate) fn smooth(&mut self, trials: &[Trial]) -> Result<f64, FitError> {
        let before = self.defects.clone();
        let linear = self.linear(trials);
        let moves: Vec<(Vec<f64>, f64)> = (0..trials.len())
            .into_par_iter()
            .map(|t| {
                let randomness = for_trial(&self.randomness, &trials[t]);
                smooth(&linear[t], &randomness)
            })
            .collect();
        drop(linear);
        self.move_by(&moves, 1.0);
        let mut share = 1.0;
        while let Err(error) = self.linearise(trials) {
            if share <= LEAST_SHARE || matches!(error, FitError::Model(_)) {
                self.move_by(&moves, -share);
                self.linearise(trials)?;
                return Err(error);
            }
            // Where it cannot go all the way, it goes as far as it can.
            share *= 0.5;
            self.move_by(&moves, -share);
        }
        for (((pace, after), before), trial) in self.pace.iter_mut().zip(&self.defects).zip(before).zip(trials) {
            let overshot = *after > LEFT * before && *after > NO_DEFECT * trial.len() as f64;
            *pace = if overshot { SLOW } else { 1.0 };
        }
        Ok(moves.iter().map(|(_, value)| value).sum())
    }

    /// Moves the trajectories by a share of the paces that they have.
    fn move_by(&mut self, moves: &[(Vec<f64>, f64)], share: f64) {
        for ((trajectory, (deviation, _)), pace) in self.trajectories.iter_mut().zip(moves).zip(&self.pace) {
            for (value, move_) in trajectory.values.iter_mut().zip(deviation) {
                *value += share * pace * move_;
            }
        }
    }

    /// Moves the trajectories until they stay or their defects no longer shrink, at most so often. Returns whether they stay.
    pub(crate) fn settle(&mut self, trials: &[Trial], most: usize) -> Result<bool, FitError> {
        let (mut last, mut least, mut idle) = (f64::INFINITY, self.defect(), 0);
        for _ in 0..most {
            let value = self.smooth(trials)?;
            let defect = self.defect();
            (least, idle) = if defect < SHRUNK * least { (defect, 0) } else { (least, idle + 1) };
            if (last - value).abs() < SETTLED {
                return Ok(true);
            }
            if idle == PATIENCE {
                break;
            }
            last = value;
        }
        Ok(false)
    }

    /// Mean defect of a sample, relative to the size of its state.
    fn defect(&self) -> f64 {
        let samples: usize = self.trajectories.iter().map(|path| path.values.len() / path.width).sum();
        self.defects.iter().sum::<f64>() / samples as f64
    }

    /// Whether the trajectories are near ones that the model can make.
    pub(crate) fn has_settled(&self) -> bool {
        self.defect() < SMALL_DEFECT
    }

    /// Whether its trajectories are to be taken before those of another fit of the same model: what has not settled has no likelihood.
    pub(crate) fn stands_before(&self, other: &Self, trials: &[Trial]) -> bool {
        let value = |fit: &Self| fit.minus_two_log_likelihood(trials, &fit.randomness);
        match (self.has_settled(), other.has_settled()) {
            (true, false) => true,
            (false, true) => false,
            _ => value(self) < value(other),
        }
    }

    /// The same fit of one of its trials.
    pub(crate) fn of_one(&self, trials: &[Trial], at: usize) -> Result<Self, FitError> {
        let (first, trajectories) = (vec![self.first[at].clone()], vec![self.trajectories[at].clone()]);
        let pace = vec![self.pace[at]];
        let mut one = Self { first, trajectories, pace, linear: Linear::Given(Arc::default()), ..self.clone() };
        one.linearise(&trials[at..=at])?;
        Ok(one)
    }

    /// The same fit on parts of its trials.
    pub(crate) fn part(&self, trials: &[Trial], parts: &[Trial]) -> Result<Self, FitError> {
        let mut of_parts = Self { linear: Linear::Given(Arc::default()), ..self.clone() };
        for (t, (trial, part)) in trials.iter().zip(parts).enumerate() {
            let start = trial.time.partition_point(|time| *time < part.time[0]);
            let trajectory = &mut of_parts.trajectories[t];
            trajectory.values.truncate((start + part.len()) * trajectory.width);
            trajectory.values.drain(..start * trajectory.width);
            if start > 0 {
                of_parts.first[t] = trajectory.states(0).to_vec();
            }
        }
        of_parts.linearise(parts)?;
        Ok(of_parts)
    }

    pub(crate) fn filter(&self, trials: &[Trial], randomness: &Randomness, keep: Keep) -> Vec<Filtered> {
        let linear = self.linear(trials);
        (0..trials.len())
            .into_par_iter()
            .map(|t| filter(&linear[t], &for_trial(randomness, &trials[t]), keep))
            .collect()
    }

    /// By channel of [`Channel::all`], how far simulations that run freely over `horizon` (s) would be from the measurements
    /// where nothing is missing but what `randomness` has (root mean square); `NAN` where nothing is measured.
    pub(crate) fn spread(&self, trials: &[Trial], randomness: &Randomness, horizon: f64) -> Vec<f64> {
        let all = Channel::all(self.examined.plant.cables());
        let of_trial = |(trial, linear): (&Trial, &LinearTrial)| {
            let randomness = for_trial(randomness, trial);
            spread(linear, &randomness, &trial.restarts(horizon))
        };
        let parts: Vec<Vec<(f64, usize)>> =
            trials.par_iter().zip(self.linear(trials).par_iter()).map(of_trial).collect();
        let mut sums = vec![(0.0, 0); all.len()];
        for (trial, parts) in trials.iter().zip(parts) {
            for (channel, part) in trial.channels.iter().zip(parts) {
                if let Some(at) = all.iter().position(|a| a == channel) {
                    sums[at] = (sums[at].0 + part.0, sums[at].1 + part.1);
                }
            }
        }
        sums.iter().map(|(sum, count)| (sum / *count as f64).sqrt()).collect()
    }

    /// The filter's run at other sizes of the random parts.
    pub(crate) fn look(&self, trials: &[Trial], randomness: Randomness) -> Look {
        let filtered = self.filter(trials, &randomness, Keep::Likelihood);
        let value = filtered.iter().map(|f| f.minus_two_log_likelihood).sum();
        Look { randomness, filtered, value }
    }
}

#[cfg(test)]
mod tests {
    use cdpr::effect::EffectSpec;

    use super::*;
    use crate::data::recording::{Bench, of_channels, record, record_on};
    use crate::instruments::latents::first_randomness;

    /// Friction that turns its sign within a sample: whole moves would go back and forth for ever.
    #[test]
    fn a_trajectory_with_sharp_friction_settles() {
        let friction = EffectSpec::new("winch_stribeck_friction", Some(2), &[100.0, 260.0, 0.12, 40.0]).unwrap();
        let trials = [record(std::slice::from_ref(&friction), 40.0, 5)];
        let model = Model { effects: vec![friction], ..Model::default() };
        let randomness = first_randomness(&model, &trials, &noise_of_data(&trials));
        let mut fit = Fit::new(&model, &trials, &randomness, None).unwrap();
        fit.settle(&trials, 40).unwrap();
        let settled = fit.smooth(&trials).unwrap();
        let moved = fit.minus_two_log_likelihood(&trials, &randomness) - settled;
        assert!(moved.abs() < SETTLED, "{moved}");
    }

    /// With its length kept, a cable is torn or hangs where its anchor moves by a metre and a half along it, as errors of the survey
    /// move of which lengths tell little: a refinement of the right law came out less likely by 1e9.
    #[test]
    fn cables_keep_their_tensions_where_an_anchor_moves_or_their_law_changes() {
        let trials = [record(&[], 20.0, 6)];
        let mut fit = crate::data::recording::fitted(&[], &trials);
        fit.settle(&trials, 10).unwrap();
        let settled = fit.minus_two_log_likelihood(&trials, &fit.randomness);
        let effect = |id: &str, values: &[f64]| EffectSpec::new(id, Some(2), values).unwrap();
        // Outwards, and the length that is shown is as it was.
        let away = vec![effect("anchor_offset", &[1.1, -1.1]), effect("length_sensor_bias", &[-1.1 * 2.0_f64.sqrt()])];
        for effects in [away, vec![effect("cable_stiffness", &[-0.1])], Vec::new()] {
            let model = Model { effects, ..Model::default() };
            let mut carried = Fit::new(&model, &trials, &fit.randomness, Some(&fit)).unwrap();
            let tensions = |fit: &Fit| -> Vec<f64> {
                let (plant, path) = (&fit.examined.plant, &fit.trajectories[0]);
                let of_sample = |(k, time): (usize, &f64)| {
                    let y = path.states(k);
                    let chord = cdpr::kinematics::cables(plant.geometry(), &[y[0], y[1], y[2]], &[0.0; 3])[1].length;
                    plant.tension_for(1, *time, chord, y[plant.unstretched_index(1).unwrap()], &[])
                };
                trials[0].time.iter().enumerate().map(of_sample).collect()
            };
            let changes = tensions(&carried).into_iter().zip(tensions(&fit)).map(|(after, before)| after - before);
            assert!(changes.map(f64::abs).fold(0.0, f64::max) < 1e-3);
            if model.effects.is_empty() {
                assert_eq!(carried.trajectories[0].values, fit.trajectories[0].values);
            } else if model.effects.len() == 2 {
                carried.smooth(&trials).unwrap();
                let value = carried.minus_two_log_likelihood(&trials, &fit.randomness);
                assert!((value - settled).abs() < 1e3, "{value} {settled}");
            }
        }
    }

    /// Of a robot of 4 m that moves as it begins, with nothing but its pose: trajectories ran away, and something was said to be missing.
    #[test]
    fn a_small_robot_settles_by_its_pose_alone() {
        let bench = Bench::ringing();
        let whole = record_on(&bench, &[], 12.0, 6);
        let trial = of_channels(&whole.part(200..whole.len(), String::new()), &[0, 1, 2]);
        let model = Model { parameters: bench.parameters, ..Model::default() };
        let trials = [trial];
        let randomness = first_randomness(&model, &trials, &noise_of_data(&trials)).without_latents();
        let mut fit = Fit::new(&model, &trials, &randomness, None).unwrap();
        assert!(fit.settle(&trials, 6).unwrap() && fit.has_settled(), "{}", fit.defect());
    }

    #[test]
    fn a_beginning_has_the_trajectory_of_the_whole() {
        let whole = [record(&[], 20.0, 6)];
        let fit = crate::data::recording::fitted(&[], &whole);
        let part = [whole[0].part(0..80, String::new())];
        let begun = fit.part(&whole, &part).unwrap();
        let (linear, begun_linear) = (fit.linear(&whole), begun.linear(&part));
        assert_eq!(begun_linear[0].len, 80);
        assert_eq!(begun.trajectories[0].values, fit.trajectories[0].values[..80 * fit.trajectories[0].width]);
        assert_eq!(begun_linear[0].defect, linear[0].defect[..79 * linear[0].states]);
    }
}
