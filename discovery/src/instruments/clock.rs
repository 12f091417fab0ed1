//! Clocks of the devices that are late against the recorded forces.

use super::{At, Device, Kind, Sizing};
use crate::estimate::{Fit, FitError, for_trial};
use crate::kalman::{Keep, Randomness, filter};
use crate::whiten::{Forcing, Normal, whiten};

/// Moves of a clock and of the trajectory in turn.
const CLOCK_MOVES: usize = 3;

impl Sizing<'_> {
    /// What setting the clock of each device would gain, to first order: at the latent forces as they are and without.
    ///
    /// The recorded forces have the reference clock.
    pub(super) fn clocks(&self, fit: &Fit, from: &At) -> Vec<(Kind, At)> {
        let devices: Vec<Device> = Device::ALL.into_iter().filter(|d| !self.channels(*d).is_empty()).collect();
        let mut found: Vec<(Kind, At)> = Vec::new();
        let set = |late: &Randomness, device: Device| self.channels(device).iter().any(|at| late.late[*at] != 0.0);
        for randomness in [from.randomness.clone(), from.randomness.without_latents()] {
            let normal = self.clock_normal(fit, &randomness, &devices);
            for (c, device) in devices.iter().enumerate() {
                let gram = normal.gram[c * devices.len() + c];
                let step = normal.right[c] / gram;
                // More than a few samples are no first order.
                if gram <= 0.0 || step.abs() > 4.0 * self.interval || set(&randomness, *device) {
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

    /// Normal equations of the delays of devices: what is shown changes by minus its rate.
    pub(super) fn clock_normal(&self, fit: &Fit, randomness: &Randomness, devices: &[Device]) -> Normal {
        let mut normal = Normal::empty(devices.len());
        for (t, trial) in self.trials.iter().enumerate() {
            let linear = &fit.linear[t];
            let mut forcing = Forcing {
                columns: devices.len(),
                step: vec![0.0; (linear.len - 1) * linear.states * devices.len()],
                sensor: vec![0.0; linear.len * linear.channels * devices.len()],
            };
            for (at, rate) in linear.rate.iter().enumerate() {
                let device = Device::of(trial.channels[at % linear.channels]);
                if let Some(c) = devices.iter().position(|d| *d == device) {
                    forcing.sensor[at * devices.len() + c] = -*rate as f32;
                }
            }
            let randomness = for_trial(randomness, trial);
            let filtered = filter(linear, &randomness, Keep::Innovations);
            normal.add(&whiten(linear, &randomness, &filtered, &forcing, None));
        }
        normal
    }

    /// Clocks as in `start`, then set by Gauss-Newton, the trajectory smoothed in between.
    pub(super) fn set_clock(&self, fit: &Fit, start: At) -> Result<(Fit, At), FitError> {
        let mut fit = fit.clone();
        fit.randomness = start.randomness;
        let devices: Vec<Device> = Device::ALL
            .into_iter()
            .filter(|d| self.channels(*d).iter().any(|at| fit.randomness.late[*at] != 0.0))
            .collect();
        for _ in 0..CLOCK_MOVES {
            fit.smooth(self.trials)?;
            let randomness = fit.randomness.clone();
            let normal = self.clock_normal(&fit, &randomness, &devices);
            for (c, device) in devices.iter().enumerate() {
                let step = normal.right[c] / normal.gram[c * devices.len() + c];
                for at in self.channels(*device) {
                    fit.randomness.late[at] += step;
                }
            }
        }
        fit.smooth(self.trials)?;
        let at = self.at(&fit, fit.randomness.clone());
        Ok((fit, at))
    }
}
