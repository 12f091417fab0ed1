//! Clocks of the devices that are late against the recorded forces.

use crate::data::device::Device;
use crate::data::{Channel, Trial, Undone};
use crate::filter::error::FitError;
use crate::filter::estimate::Fit;
use crate::filter::kalman::Randomness;
use crate::hypothesis::parameter::Free;
use crate::instruments::clock_offset::clock_offset;
use crate::instruments::clocks::Clocks;
use crate::instruments::sizing::{At, Kind, Sizing};
use crate::model::examined::Examined;
use crate::weigh::solve::solve;

/// Moves of a clock and of the trajectory in turn.
const CLOCK_MOVES: usize = 3;
/// Samples within which a delay is seen to first order.
pub(super) const FEW: f64 = 4.0;

/// How late each channel is (s) where kinematics alone show that the lengths are late against the pose.
pub(crate) fn late_lengths(model: &Examined, trials: &[Trial]) -> Vec<f64> {
    let offset = clock_offset(model, trials).filter(|late| *late < 0.0);
    let late = |channel: Channel| match (Device::of(channel), offset) {
        (Device::CableLengths | Device::UnstretchedLengths, Some(offset)) => -offset,
        _ => 0.0,
    };
    Channel::all(model.plant.cables()).into_iter().map(late).collect()
}

impl Sizing<'_> {
    /// What setting the clock of each device would gain, to first order: at the latent forces as they are and without.
    ///
    /// No device shows what is yet to come: it is late or not.
    pub(super) fn clocks(&self, fit: &Fit, from: &At) -> Vec<(Kind, At)> {
        let devices: Vec<Device> = Device::ALL.into_iter().filter(|d| !self.channels(*d).is_empty()).collect();
        let mut found: Vec<(Kind, At)> = Vec::new();
        let set = |late: &Randomness, device: Device| self.channels(device).iter().any(|at| late.late[*at] != 0.0);
        for randomness in [from.randomness.clone(), from.randomness.without_latents()] {
            let clocks = Clocks { devices: devices.clone(), all: self.all.clone() };
            let normal = clocks.normal(fit, self.trials, &randomness);
            let unset = devices.iter().filter(|device| !set(&randomness, **device)).count();
            // One clock is that by which all others count.
            let least = usize::from(!Undone::recorder(self.trials).is_in_time());
            for (c, device) in devices.iter().enumerate() {
                let gram = normal.gram[c * devices.len() + c];
                let step = normal.right[c] / gram;
                let late = step > 0.0 && step <= FEW * self.interval;
                if gram <= 0.0 || !late || set(&randomness, *device) || unset <= least {
                    continue;
                }
                let mut next = randomness.clone();
                self.channels(*device).into_iter().for_each(|at| next.late[at] += step);
                let value = normal.minus_two_log_likelihood - normal.right[c] * step;
                found.push((Kind::Late(*device), At { randomness: next, value }));
            }
        }
        found
    }

    /// Clocks as in `start`, then set, the parameters that are `free` with them where that is likelier: laws that were fitted beside
    /// late clocks are far from what they are beside clocks in time.
    pub(super) fn set_clock_beside(&self, fit: &Fit, free: &[Free], start: At) -> Result<(Fit, At), FitError> {
        if free.is_empty() {
            return self.set_clock(fit, start);
        }
        let (set, adapted) = (self.set_clock(fit, start.clone())?, self.adapted(fit, free, start)?);
        Ok(if adapted.1.value < set.1.value { adapted } else { set })
    }

    /// Clocks as in `start`, then set by Gauss-Newton, the trajectory smoothed in between.
    pub(super) fn set_clock(&self, fit: &Fit, start: At) -> Result<(Fit, At), FitError> {
        let mut fit = fit.clone();
        fit.randomness = start.randomness;
        let clocks = Clocks::set(&fit.randomness, self.trials);
        for _ in 0..CLOCK_MOVES {
            fit.smooth(self.trials)?;
            let randomness = fit.randomness.clone();
            let normal = clocks.normal(&fit, self.trials, &randomness);
            clocks.move_by(&solve(&normal).0, &mut fit.randomness);
        }
        fit.smooth(self.trials)?;
        let at = self.at(&fit, fit.randomness.clone());
        Ok((fit, at))
    }
}
