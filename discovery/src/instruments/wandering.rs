//! Instruments that wander from the beginning, where kinematics show that they do.

use cdpr::model_file::Model;

use crate::data::Channel;
use crate::data::device::Device;
use crate::filter::error::FitError;
use crate::filter::estimate::Fit;
use crate::instruments::mismatch::Wander;
use crate::instruments::sizing::{Kind, SHORTEST, Size, Sizing};
use crate::model::randomness::{MOST_MEMORIES, Memory, Randomness};
use crate::model::sizes::Sizes;
use crate::strategy::policy::POLICY;

/// Share of the size from which latent forces are searched for elsewhere, where instruments do what these would carry.
const FEW_LATENTS: f64 = 0.03;
/// Factor by which there are more of them where the trajectories run away with so few.
const MORE: f64 = 10.0;

impl Sizing<'_> {
    /// The model of `given` where pose and lengths wander by so much against each other, each as far as the data say, with latent
    /// forces that need not do it; the parameters of the effects from `first` on adapt. A trajectory that follows such errors has
    /// cables slack that were not, and says nothing.
    pub(crate) fn wandering(&self, given: &Fit, wander: Wander, first: usize) -> Result<Option<Fit>, FitError> {
        let (model, from) = (&given.model, &given.randomness);
        let Wander { deviation, time } = wander;
        let arm = Sizes::of(&model.parameters).arm;
        let mut randomness = from.clone();
        for device in [Device::Pose, Device::CableLengths, Device::UnstretchedLengths] {
            for channel in self.without_memory(&randomness, device, false) {
                let deviation = if self.all[channel] == Channel::Pose(2) { deviation / arm } else { deviation };
                let time = time.clamp(SHORTEST * self.interval, self.longest);
                randomness = randomness.with_memory(Memory { channel, deviation, time, drift: false });
            }
        }
        if randomness.memory.len() > MOST_MEMORIES {
            return Ok(None);
        }
        let mut fit = self.settled(model, &randomness)?;
        let randomness = fit.randomness.clone();
        let devices = Device::ALL.into_iter().filter(|device| self.has_memory(&randomness, *device, false));
        let together: Vec<Size> = devices.flat_map(|device| self.sizes(Kind::Colour(device))).collect();
        for sizes in [together, self.each(&randomness)] {
            fit.randomness = self.most_likely(&fit, &sizes, self.at(&fit, fit.randomness.clone())).randomness;
            fit.settle(self.trials, POLICY.first_moves)?;
        }
        let best = self.at(&fit, fit.randomness.clone());
        fit.randomness = self.pruned(&fit, best).randomness;
        fit.settle(self.trials, POLICY.first_moves)?;
        // What is slower than noise with memory may be drifts.
        let taken = self.take_up(&fit, 0.0, first)?;
        Ok(Some(taken.unwrap_or(fit)))
    }

    /// Trajectories of a model from the data alone, with as few latent forces as they settle with, and at most about as many as
    /// `randomness` has: where a law is missing that none of them stands for, they run away.
    fn settled(&self, model: &Model, randomness: &Randomness) -> Result<Fit, FitError> {
        let most = randomness.force.max(randomness.winch);
        let mut share = FEW_LATENTS;
        loop {
            let few = randomness.with_latents(share);
            // None of them can be larger than the largest that is considered: the ladder ends.
            let last = few.force * MORE > most;
            let mut fit = Fit::new(model, self.trials, &few, None)?;
            let moved = fit.settle(self.trials, POLICY.first_moves);
            if last || moved.is_ok() && fit.has_settled() {
                return moved.map(|_| fit);
            }
            share *= MORE;
        }
    }
}

#[cfg(test)]
mod tests {
    use cdpr::effect::EffectSpec;

    use super::*;
    use crate::data::recording::{Bench, record_on};
    use crate::filter::estimate::noise_of_data;
    use crate::instruments::latents::first_randomness;
    use crate::weigh::criterion::Penalty;

    /// Friction of one winch, a thousand times what latent forces may do at first. Lengths were metres off, and sizes of instruments
    /// were found along that.
    #[test]
    fn trajectories_that_run_away_with_few_latent_forces_get_more() {
        let bench = Bench::ringing();
        let friction = EffectSpec::new("winch_coulomb_friction", Some(2), &[8.0, 2e-3]).expect("an effect");
        let trials = [31, 32].map(|seed| record_on(&bench, std::slice::from_ref(&friction), 10.0, seed));
        let model = Model { parameters: bench.parameters, ..Model::default() };
        let noise = noise_of_data(&trials);
        let first = first_randomness(&model, &trials, &noise);
        let mut few = Fit::new(&model, &trials, &first.with_latents(FEW_LATENTS), None).expect("a fit");
        assert!(few.settle(&trials, POLICY.first_moves).is_err() || !few.has_settled());
        let sizing = Sizing::new(&trials, &noise, Penalty::NONE);
        let fit = sizing.settled(&model, &first.with_latents(100.0)).expect("a fit");
        assert!(fit.has_settled() && fit.randomness.force > 5.0 * few.randomness.force, "{}", fit.randomness.force);
    }
}
