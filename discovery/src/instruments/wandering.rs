//! Instruments that wander from the beginning, where kinematics show that they do.

use crate::data::Channel;
use crate::filter::error::FitError;
use crate::filter::estimate::Fit;
use crate::instruments::device::Device;
use crate::instruments::mismatch::Wander;
use crate::instruments::sizing::{Kind, SHORTEST, Size, Sizing};
use crate::model::randomness::{MOST_MEMORIES, Memory};
use crate::model::sizes::Sizes;
use crate::strategy::policy::POLICY;

/// Share of the size from which latent forces are searched for elsewhere, where instruments do what these would carry.
const FEW_LATENTS: f64 = 0.03;

impl Sizing<'_> {
    /// The model of `given` where pose and lengths wander by so much against each other, each as far as the data say, with latent
    /// forces that need not do it; the parameters of the effects from `first` on adapt. A trajectory that follows such errors has
    /// cables slack that were not, and says nothing.
    pub(crate) fn wandering(&self, given: &Fit, wander: Wander, first: usize) -> Result<Option<Fit>, FitError> {
        let (model, from) = (&given.model, &given.randomness);
        let Wander { deviation, time } = wander;
        let arm = Sizes::of(&model.parameters).arm;
        let mut randomness = from.with_latents(FEW_LATENTS);
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
        let mut fit = Fit::new(model, self.trials, &randomness, None)?;
        let devices = Device::ALL.into_iter().filter(|device| self.has_memory(&randomness, *device, false));
        let together: Vec<Size> = devices.flat_map(|device| self.sizes(Kind::Colour(device))).collect();
        for sizes in [together, self.each(&randomness)] {
            fit.settle(self.trials, POLICY.first_moves)?;
            fit.randomness = self.most_likely(&fit, &sizes, self.at(&fit, fit.randomness.clone())).randomness;
        }
        let best = self.at(&fit, fit.randomness.clone());
        fit.randomness = self.pruned(&fit, best).randomness;
        fit.settle(self.trials, POLICY.first_moves)?;
        // What is slower than noise with memory may be drifts.
        let taken = self.take_up(&fit, 0.0, first)?;
        Ok(Some(taken.unwrap_or(fit)))
    }
}
