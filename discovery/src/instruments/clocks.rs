//! Delays of the devices' clocks, as parameters.

use rayon::prelude::*;

use crate::data::device::Device;
use crate::data::{Channel, Trial};
use crate::filter::estimate::{Fit, for_trial};
use crate::filter::kalman::Randomness;
use crate::filter::path::LinearTrial;
use crate::filter::whiten::{Forcing, Normal, whiten};
use crate::hypothesis::along::Along;
use crate::hypothesis::signature::{Varied, sensitivities};

/// Rise of `-2 log L` without a delay from which it is not asked whether something else may do what it does.
const CERTAIN: f64 = 400.0;

/// Devices whose delays are estimated, each a parameter like those of effects.
pub(crate) struct Clocks {
    pub(super) devices: Vec<Device>,
    /// All channels, in the order of [`Randomness::late`].
    pub(super) all: Vec<Channel>,
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

    /// What each varied parameter adds along a trial, and after them the delay of each clock.
    pub(crate) fn after(&self, along: &Along<'_>, varied: &[Varied]) -> Forcing {
        self.beside(sensitivities(along, varied), along.linear, along.trial)
    }

    /// `forcing` with a column more for the delay of each clock: what is shown changes by minus its rate.
    fn beside(&self, forcing: Forcing, linear: &LinearTrial, trial: &Trial) -> Forcing {
        if self.count() == 0 {
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
    pub(super) fn normal(&self, fit: &Fit, trials: &[Trial], randomness: &Randomness) -> Normal {
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

/// `randomness` less the delay of one clock, for each whose delay the likelihood may do without: the others and the parameters
/// can only take some of what leaving it out costs where nothing else moves.
pub(super) fn less_one_clock(fit: &Fit, trials: &[Trial]) -> Vec<Randomness> {
    let clocks = Clocks::set(&fit.randomness, trials);
    let normal = clocks.normal(fit, trials, &fit.randomness);
    let less = |(c, device): (usize, &Device)| {
        let mut without = fit.randomness.clone();
        let mut delay = 0.0;
        let late = clocks.all.iter().zip(&mut without.late);
        let of_device = late.filter(|(channel, _)| Device::of(**channel) == *device);
        of_device.for_each(|(_, late)| delay = std::mem::take(late));
        (delay * delay * normal.gram[c * clocks.count() + c] < CERTAIN).then_some(without)
    };
    clocks.devices.iter().enumerate().filter_map(less).collect()
}
