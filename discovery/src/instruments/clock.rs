//! Clocks of the devices that are late against the recorded forces.

use rayon::prelude::*;

use super::{At, Device, Kind, Sizing};
use crate::data::{Channel, Trial};
use crate::filter::estimate::{Fit, FitError, for_trial};
use crate::filter::kalman::Randomness;
use crate::filter::path::LinearTrial;
use crate::filter::whiten::{Forcing, Normal, whiten};
use crate::instruments::clock_offset::clock_offset;
use crate::model::examined::Examined;
use crate::weigh::refine::solve;

/// Moves of a clock and of the trajectory in turn.
const CLOCK_MOVES: usize = 3;
/// Rise of `-2 log L` without a delay from which it is not asked whether something else may do what it does.
const CERTAIN: f64 = 400.0;

/// Devices whose delays are estimated, each a parameter like those of effects.
pub(crate) struct Clocks {
    devices: Vec<Device>,
    /// All channels, in the order of [`Randomness::late`].
    all: Vec<Channel>,
}

impl Clocks {
    /// The clocks that were found to be late.
    pub(crate) fn set(randomness: &Randomness, trials: &[Trial]) -> Self {
        let all = Channel::all(trials.first().map_or(0, Trial::cables));
        let late = |device: &Device| {
            all.iter().zip(&randomness.late).any(|(channel, late)| Device::of(*channel) == *device && *late != 0.0)
        };
        Self { devices: Device::ALL.into_iter().filter(late).collect(), all }
    }

    pub(crate) fn count(&self) -> usize {
        self.devices.len()
    }

    /// `forcing` with a column more for the delay of each clock: what is shown changes by minus its rate.
    pub(crate) fn beside(&self, forcing: Forcing, linear: &LinearTrial, trial: &Trial) -> Forcing {
        if self.devices.is_empty() {
            return forcing;
        }
        let (given, columns) = (forcing.columns, forcing.columns + self.count());
        let widened = |values: &[f32], rows: usize| {
            let mut out = vec![0.0; rows * columns];
            if given > 0 {
                let rows = out.chunks_exact_mut(columns).zip(values.chunks_exact(given));
                rows.for_each(|(row, given)| row[..given.len()].copy_from_slice(given));
            }
            out
        };
        let step = widened(&forcing.step, (linear.len - 1) * linear.states);
        let mut sensor = widened(&forcing.sensor, linear.len * linear.channels);
        for (at, rate) in linear.rate.iter().enumerate() {
            let device = Device::of(trial.channels[at % linear.channels]);
            if let Some(c) = self.devices.iter().position(|d| *d == device) {
                sensor[at * columns + given + c] = -*rate as f32;
            }
        }
        Forcing { first: 0, columns, step, sensor }
    }

    /// Normal equations of the delays.
    fn normal(&self, fit: &Fit, trials: &[Trial], randomness: &Randomness) -> Normal {
        let of_trial = |(trial, linear): (&Trial, &LinearTrial)| {
            let forcing = self.beside(Forcing::none(), linear, trial);
            let randomness = for_trial(randomness, trial);
            whiten(linear, &randomness, &forcing)
        };
        let parts: Vec<Normal> = trials.par_iter().zip(fit.linear(trials).par_iter()).map(of_trial).collect();
        let mut normal = Normal::empty(self.count());
        parts.iter().for_each(|part| normal.add(part));
        normal
    }

    /// Moves the delays (s).
    pub(crate) fn move_by(&self, steps: &[f64], randomness: &mut Randomness) {
        for (device, step) in self.devices.iter().zip(steps) {
            let channels = self.all.iter().zip(&mut randomness.late).filter(|(c, _)| Device::of(**c) == *device);
            channels.for_each(|(_, late)| *late += step);
        }
    }
}

/// How late each channel is (s) where kinematics alone show that the lengths are late against the pose.
pub(crate) fn late_lengths(model: &Examined, trials: &[Trial]) -> Vec<f64> {
    let offset = clock_offset(model, trials).filter(|late| *late < 0.0);
    let late = |channel: Channel| match (Device::of(channel), offset) {
        (Device::CableLengths | Device::UnstretchedLengths, Some(offset)) => -offset,
        _ => 0.0,
    };
    Channel::all(model.plant.cables()).into_iter().map(late).collect()
}

/// `randomness` less the delay of one clock, for each whose delay the likelihood may do without: the others and the parameters
/// can only take some of what leaving it out costs where nothing else moves.
pub(super) fn less_one_clock(fit: &Fit, trials: &[Trial]) -> Vec<Randomness> {
    let clocks = Clocks::set(&fit.randomness, trials);
    let normal = clocks.normal(fit, trials, &fit.randomness);
    let less = |(c, device): (usize, &Device)| {
        let mut without = fit.randomness.clone();
        let channels = clocks.all.iter().zip(&mut without.late).filter(|(channel, _)| Device::of(**channel) == *device);
        let mut delay = 0.0;
        channels.for_each(|(_, late)| delay = std::mem::take(late));
        (delay * delay * normal.gram[c * clocks.count() + c] < CERTAIN).then_some(without)
    };
    clocks.devices.iter().enumerate().filter_map(less).collect()
}

impl Sizing<'_> {
    /// What setting the clock of each device would gain, to first order: at the latent forces as they are and without.
    ///
    /// The recorded forces have the reference clock, and no device shows what is yet to come: it is late or not.
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
                let late = step > 0.0 && step <= 4.0 * self.interval;
                if gram <= 0.0 || !late || set(&randomness, *device) {
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

    /// Normal equations of the delays of devices.
    pub(super) fn clock_normal(&self, fit: &Fit, randomness: &Randomness, devices: &[Device]) -> Normal {
        let clocks = Clocks { devices: devices.to_vec(), all: self.all.clone() };
        clocks.normal(fit, self.trials, randomness)
    }

    /// Clocks as in `start`, then set by Gauss-Newton, the trajectory smoothed in between.
    pub(super) fn set_clock(&self, fit: &Fit, start: At) -> Result<(Fit, At), FitError> {
        let mut fit = fit.clone();
        fit.randomness = start.randomness;
        let clocks = Clocks::set(&fit.randomness, self.trials);
        for _ in 0..CLOCK_MOVES {
            fit.smooth(self.trials)?;
            let randomness = fit.randomness.clone();
            let normal = self.clock_normal(&fit, &randomness, &clocks.devices);
            clocks.move_by(&solve(&normal).0, &mut fit.randomness);
        }
        fit.smooth(self.trials)?;
        let at = self.at(&fit, fit.randomness.clone());
        Ok((fit, at))
    }
}
