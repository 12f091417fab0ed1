//! How late the pose is against the lengths of the cables, by kinematics alone.
//!
//! In a stiff robot a clock that is late by a few samples puts platform and cables where no force that its winches have could
//! put them: cables would be slack that were not. No trajectory of the model is near such data, and nothing that is found along
//! one of them means anything. So what no force can explain is settled before any dynamics. By how much the lengths that belong
//! to the pose differ from those measured beside it, stretched by the recorded forces, is proportional to their rate where the
//! clocks differ. In a soft robot a missing force does the same: there the search tells them apart.

use crate::data::clean::noise_by_differences;
use crate::data::{Channel, Trial};
use crate::instruments::mismatch::{Lengths, NO_FORCE, Wander, stiffness, wander};
use crate::model::examined::Examined;
use crate::model::sizes::usual_force;

/// Share of the squared mismatch that the offset must explain: most of it.
const EXPLAINS: f64 = 0.5;
/// Share of a rate's square that may be noise: what is regressed on a rate with noise comes out smaller by so much.
const NOISE: f64 = 0.01;

/// Sums over the samples of all cables, each less its means in each trial.
#[derive(Default)]
struct Sums {
    mismatch: f64,
    product: f64,
    rate: f64,
    /// Of the rate times the cable's stiffness (N/m).
    force: f64,
    count: usize,
}

impl Sums {
    fn of(model: &Examined, trials: &[Trial]) -> Self {
        let mut sums = Self::default();
        for trial in trials {
            (0..trial.cables()).for_each(|i| sums.add(model, trial, i));
        }
        sums
    }

    fn add(&mut self, model: &Examined, trial: &Trial, cable: usize) {
        let Lengths { of_pose, mismatch } = Lengths::of(model, trial, cable, 0.0);
        let position = |channel: &Channel| matches!(channel, Channel::Pose(0 | 1));
        let noise = (0..trial.channels.len()).filter(|j| position(&trial.channels[*j]));
        let noise = noise.map(|j| noise_by_differences(trial, j)).fold(0.0, f64::max);
        let rates = rates(&trial.time, &of_pose, noise);
        let seen: Vec<[f64; 2]> = (0..trial.len())
            .map(|k| [mismatch[k], rates[k]])
            .filter(|values| values.iter().all(|value| value.is_finite()))
            .collect();
        let count = seen.len() as f64;
        let mean = |part: usize| seen.iter().map(|values| values[part]).sum::<f64>() / count;
        let means = [mean(0), mean(1)];
        let stiffness = stiffness(model, &of_pose, cable);
        for values in &seen {
            let [mismatch, rate] = [values[0] - means[0], values[1] - means[1]];
            self.mismatch += mismatch * mismatch;
            self.product += mismatch * rate;
            self.rate += rate * rate;
            self.force += (stiffness * rate).powi(2);
            self.count += 1;
        }
    }

    /// How late the pose is (s), where that explains most of the mismatch.
    fn late(&self) -> Option<f64> {
        let explained = self.product * self.product / (self.rate * self.mismatch);
        (explained > EXPLAINS).then_some(-self.product / self.rate)
    }
}

/// How late the pose is against the lengths (s), beside what the model has of it, less than zero where the lengths are late; `None` where
/// no more than a force that is missing shows.
pub(crate) fn clock_offset(model: &Examined, trials: &[Trial]) -> Option<f64> {
    let sums = Sums::of(model, trials);
    let unknown = sums.late()? - model.late(Channel::Pose(0));
    let force = unknown.abs() * (sums.force / sums.count as f64).sqrt();
    (force > NO_FORCE * usual_force(trials)).then_some(unknown)
}

/// By how much pose and lengths wander against each other where no force can do that, nor a clock that is late: what a clock explains most
/// of is no wander, be it a clock or a force.
pub(crate) fn wander_in_time(model: &Examined, trials: &[Trial]) -> Option<Wander> {
    wander(model, trials, Sums::of(model, trials).late().unwrap_or(0.0))
}

/// Rates of a signal with white noise, from as near readings as the noise allows; `NAN` where these are missing.
fn rates(time: &[f64], signal: &[f64], noise: f64) -> Vec<f64> {
    // A slow sensor has its readings some rows apart.
    let known: Vec<usize> = (0..time.len()).filter(|k| signal[*k].is_finite()).collect();
    let mut rates = vec![f64::NAN; time.len()];
    let (Some(first), Some(last)) = (known.first(), known.last()) else { return rates };
    let span = time[*last] - time[*first];
    let over = |half: usize| -> Vec<f64> {
        let of = |k: usize| {
            let (before, after) = (known[k.checked_sub(half)?], *known.get(k + half)?);
            Some((signal[after] - signal[before]) / (time[after] - time[before]))
        };
        (0..known.len()).map(|k| of(k).unwrap_or(f64::NAN)).collect()
    };
    let mut half = 1;
    loop {
        let of_known = over(half);
        let finite = || of_known.iter().filter(|rate| rate.is_finite());
        let square = finite().map(|rate| rate * rate).sum::<f64>() / finite().count() as f64;
        let apart = 2.0 * half as f64 * span / (known.len().max(2) - 1) as f64;
        if 2.0 * (noise / apart).powi(2) < NOISE * square || 8 * half > known.len() {
            known.iter().zip(of_known).for_each(|(k, rate)| rates[*k] = rate);
            return rates;
        }
        half *= 2;
    }
}

#[cfg(test)]
mod tests {
    use cdpr::effect::EffectSpec;
    use cdpr::model_file::Model;

    use super::*;
    use crate::data::recording::{Bench, record_on};

    /// A recording whose pose, or lengths, come so many samples late.
    fn late(bench: &Bench, effects: &[EffectSpec], pose: usize, lengths: usize) -> Option<f64> {
        let mut trial = record_on(bench, effects, 20.0, 4);
        let then = trial.measured.clone();
        for k in 0..trial.len() {
            for j in 0..trial.channels.len() {
                trial.measured[k][j] = then[k.saturating_sub(if j < 3 { pose } else { lengths })][j];
            }
        }
        let model = Model { parameters: bench.parameters.clone(), ..Model::default() };
        clock_offset(&Examined::new(&model).unwrap(), &[trial])
    }

    #[test]
    fn clocks_of_a_stiff_robot_are_told_by_kinematics() {
        let bench = Bench::laboratory();
        let found = late(&bench, &[], 3, 0).expect("a late pose");
        assert!((found - 0.03).abs() < 2e-3, "{found}");
        let found = late(&bench, &[], 0, 3).expect("late lengths");
        assert!((found + 0.03).abs() < 2e-3, "{found}");
        assert_eq!(late(&bench, &[], 0, 0), None);
    }

    /// A pose of which every third row has a reading had no rates at all.
    #[test]
    fn a_slow_pose_that_is_late_is_told_by_kinematics() {
        let bench = Bench::laboratory();
        let mut trial = record_on(&bench, &[], 20.0, 4);
        let then = trial.measured.clone();
        for k in 0..trial.len() {
            for j in 0..3 {
                trial.measured[k][j] = if k % 3 == 0 { then[k.saturating_sub(3)][j] } else { f64::NAN };
            }
        }
        let model = Model { parameters: bench.parameters.clone(), ..Model::default() };
        let found = clock_offset(&Examined::new(&model).unwrap(), &[trial]).expect("a late pose");
        assert!((found - 0.03).abs() < 3e-3, "{found}");
    }

    /// Friction of a stiff robot, whose clocks agree, and a late pose of a soft one, where a small force would do the same.
    #[test]
    fn what_a_force_can_do_is_left_to_the_search() {
        let friction = EffectSpec::new("winch_viscous_friction", None, &[200.0]).unwrap();
        assert_eq!(late(&Bench::laboratory(), &[friction], 0, 0), None);
        assert_eq!(late(&Bench::large(), &[], 2, 0), None);
    }
}
