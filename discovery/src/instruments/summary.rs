//! What was found of the instruments, with standard errors.

use nalgebra::DMatrix;

use super::sizing::{Size, Sizing};
use super::undoing::errors;
use crate::data::counts::resolution;
use crate::data::device::Device;
use crate::data::{Recorder, Trial, Undone};
use crate::filter::estimate::Fit;
use crate::filter::kalman::Randomness;
use crate::model::randomness::Memory;
use crate::outcome::{ChannelInstrument, Estimated, Instruments};
use crate::weigh::criterion::Penalty;

/// Step of the logarithm of a size for its standard error.
const ERROR_STEP: f64 = 0.1;

impl Sizing<'_> {
    /// Covariance of the logarithms of sizes that are found together: from how `-2 log L` bends over them, all other sizes
    /// held. `None` where it has no minimum there.
    fn covariance(&self, fit: &Fit, sizes: &[Size]) -> Option<DMatrix<f64>> {
        let moved = |randomness: &Randomness, size: usize, step: f64| self.scaled(randomness, sizes[size], step.exp());
        let value = |randomness: &Randomness| fit.minus_two_log_likelihood(self.trials, randomness);
        let here = value(&fit.randomness);
        let plus: Vec<Randomness> = (0..sizes.len()).map(|s| moved(&fit.randomness, s, ERROR_STEP)).collect();
        let values: Vec<f64> = plus.iter().map(value).collect();
        let mut bend = DMatrix::zeros(sizes.len(), sizes.len());
        for a in 0..sizes.len() {
            bend[(a, a)] = values[a] + value(&moved(&fit.randomness, a, -ERROR_STEP)) - 2.0 * here;
            for b in 0..a {
                // Of a quadratic form, what both moves together do beyond each by itself.
                bend[(a, b)] = value(&moved(&plus[a], b, ERROR_STEP)) - values[a] - values[b] + here;
                bend[(b, a)] = bend[(a, b)];
            }
        }
        // `-2 log L` bends by twice the information.
        Some((bend / (2.0 * ERROR_STEP * ERROR_STEP)).cholesky()?.inverse())
    }

    /// A size with its standard error.
    fn sized(&self, fit: &Fit, value: f64, size: Size) -> Estimated {
        let error = self.covariance(fit, &[size]).map(|covariance| value * covariance[(0, 0)].sqrt());
        Estimated { value, standard_error: error }
    }
}

/// What the instruments of the fit add, with standard errors; those of the clocks' delays are given. Beside what was undone of recordings
/// the parameters of the effects from `first` on adapt.
pub(crate) fn summary(fit: &Fit, trials: &[Trial], noise: &[f64], delay_errors: &[f64], first: usize) -> Instruments {
    let sizing = Sizing::new(trials, noise, Penalty::NONE);
    let randomness = &fit.randomness;
    let devices: Vec<Device> =
        Device::ALL.into_iter().filter(|d| sizing.channels(*d).iter().any(|at| randomness.late[*at] != 0.0)).collect();
    let error_of = |clock: usize| delay_errors.get(clock).copied().filter(|error| error.is_finite());
    let channel = |at: usize| {
        let memory =
            |is: fn(&Memory) -> bool| randomness.memory.iter().position(|memory| memory.channel == at && is(memory));
        let lasting = |is: fn(&Memory) -> bool| {
            memory(is).map(|m| sizing.sized(fit, randomness.memory[m].deviation, Size::Memory(m)))
        };
        let coloured = memory(|memory| !memory.drift).map(|m| {
            let sizes = [Size::Memory(m), Size::Time(m), Size::WhiteOf(at)];
            let covariance = sizing.covariance(fit, &sizes);
            let of = |value: f64, variance: fn(&DMatrix<f64>) -> f64| Estimated {
                value,
                standard_error: covariance.as_ref().map(|c| value * variance(c).sqrt()),
            };
            // A longer time constant has a larger deviation with it.
            let deviation = |c: &DMatrix<f64>| c[(0, 0)] + c[(0, 1)] + 0.25 * c[(1, 1)];
            [of(randomness.memory[m].deviation, deviation), of(randomness.memory[m].time, |c| c[(1, 1)])]
        });
        let delay = devices
            .iter()
            .position(|d| *d == Device::of(sizing.all[at]))
            .map(|c| Estimated { value: randomness.late[at], standard_error: error_of(c) });
        ChannelInstrument {
            channel: sizing.all[at],
            white: randomness.noise[at],
            coloured: coloured.map(|c| c[0]),
            time_constant: coloured.map(|c| c[1]),
            drift: lasting(|memory| memory.drift && !memory.is_origin()),
            origin: lasting(Memory::is_origin),
            delay,
            resolution: resolution(trials, sizing.all[at], randomness.noise[at]),
        }
    };
    let (Recorder { delay, variance }, slow_clock) = (Undone::recorder(trials), Undone::slow_clock(trials));
    let [of_delay, of_variance, of_clock] = errors(fit, trials, first);
    Instruments {
        channels: Device::ALL.into_iter().flat_map(|d| sizing.channels(d)).map(channel).collect(),
        late_forces: (delay != 0.0).then_some(Estimated { value: delay, standard_error: of_delay }),
        smoothed_forces: (variance > 0.0).then(|| Estimated {
            value: variance.sqrt(),
            standard_error: of_variance.map(|error| 0.5 * error / variance.sqrt()),
        }),
        slow_clock: (slow_clock != 0.0).then_some(Estimated { value: slow_clock, standard_error: of_clock }),
        winch_force: (randomness.input > 0.0).then(|| sizing.sized(fit, randomness.input, Size::Input)),
        stamps: (randomness.jitter > 0.0).then(|| sizing.sized(fit, randomness.jitter, Size::Jitter)),
    }
}
