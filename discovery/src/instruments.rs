//! What the instruments add to recordings beside white noise: sizes by maximum likelihood on the innovations.
//!
//! Of each device (pose, lengths, load cells) noise with memory, drift and a late clock; of the recorded forces a white
//! error; of the stamps jitter. Each is taken up only where the likelihood gains more than its parameters cost, the one
//! that gains most first. What the instruments do, the latent forces need not carry: each is tried with the latent forces
//! as they are and without them.

use nalgebra::DMatrix;

use crate::data::{Channel, Trial};
use crate::estimate::{Fit, FitError, for_trial};
use crate::kalman::{Keep, Randomness, filter};
use crate::outcome::{ChannelInstrument, Estimated, Instruments};
use crate::path::LinearTrial;
use crate::randomness::Memory;
use crate::regression::Penalty;
use crate::search::{BEGINNING, EVIDENCE};
use crate::whiten::{Forcing, Normal, whiten};

/// Channels that share a device and its clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Device {
    Pose,
    CableLengths,
    UnstretchedLengths,
    Tensions,
}

impl Device {
    const ALL: [Self; 4] = [Self::Pose, Self::CableLengths, Self::UnstretchedLengths, Self::Tensions];

    fn of(channel: Channel) -> Self {
        match channel {
            Channel::Pose(_) => Self::Pose,
            Channel::CableLength(_) => Self::CableLengths,
            Channel::UnstretchedLength(_) => Self::UnstretchedLengths,
            Channel::Tension(_) => Self::Tensions,
        }
    }
}

/// What an instrument may add.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Colour(Device),
    Drift(Device),
    Late(Device),
    Input,
    Jitter,
}

/// A size that is searched for on a logarithmic scale.
#[derive(Clone, Copy, Debug)]
enum Size {
    /// Of all noise with memory of a device, of drift or not.
    Memories {
        device: Device,
        drift: bool,
    },
    /// Its time constant.
    Times(Device),
    /// White noise of a device.
    White(Device),
    /// One noise with memory, by its place.
    Memory(usize),
    /// Its time constant.
    Time(usize),
    /// White noise of one channel of all.
    WhiteOf(usize),
    Input,
    Jitter,
    Force,
    Winch,
}

/// Shortest time constant of noise with memory, in sampling intervals.
const SHORTEST: f64 = 1.0;
/// Longest, as a share of the longest recording: slower is drift.
const LONGEST: f64 = 0.2;
/// First sizes of noise with memory, in multiples of what differences say of white noise.
const RATIOS: [f64; 2] = [1.0, 4.0];
/// First errors of the recorded forces, as shares of the mean force.
const INPUTS: [f64; 3] = [3e-4, 3e-3, 3e-2];
/// First jitters of the stamps, in sampling intervals.
const JITTERS: [f64; 2] = [0.03, 0.2];
/// Share of what a rival gains that a first look at an instrument must gain for a second.
const PROMISING: f64 = 0.3;
/// Fall of `-2 log L` for which all sizes are gone through again.
const WORTH: f64 = 0.5;
/// Fall of `-2 log L` for which a size is moved on.
const LEAST: f64 = 0.05;
/// Most times that all sizes are gone through with one factor.
const MOST_PASSES: usize = 6;
/// Step of the logarithm of a size for its standard error.
const ERROR_STEP: f64 = 0.1;
/// Moves of a clock and of the trajectory in turn.
const CLOCK_MOVES: usize = 3;

/// A place of the search with its `-2 log L`.
#[derive(Clone)]
struct At {
    randomness: Randomness,
    value: f64,
}

struct Sizing<'a> {
    trials: &'a [Trial],
    /// White noise of each channel by differences.
    noise: &'a [f64],
    penalty: Penalty,
    all: Vec<Channel>,
    interval: f64,
    duration: f64,
    /// Mean winch force (N).
    tension: f64,
}

/// Number of parameters of the instruments beside white noise.
pub(crate) fn parameters(randomness: &Randomness) -> usize {
    let memories: usize = randomness.memory.iter().map(|m| if m.drift { 1 } else { 2 }).sum();
    let mut late: Vec<f64> = randomness.late.iter().copied().filter(|late| *late != 0.0).collect();
    late.sort_by(f64::total_cmp);
    late.dedup();
    memories + late.len() + usize::from(randomness.input > 0.0) + usize::from(randomness.jitter > 0.0)
}

/// `fit` with what its instruments ask for; `None` where they ask for nothing, or far less than the `gain` of an explanation
/// that is at hand.
pub(crate) fn take_up(
    fit: &Fit,
    trials: &[Trial],
    noise: &[f64],
    penalty: Penalty,
    gain: f64,
) -> Result<Option<Fit>, FitError> {
    let sizing = Sizing::new(trials, noise, penalty);
    if gain > 0.0 && !sizing.promises(fit, gain) {
        return Ok(None);
    }
    let mut fit = fit.clone();
    let mut best = sizing.at(&fit, fit.randomness.clone());
    let (begin, mut taken) = (best.value, false);
    loop {
        let mut scanned: Vec<(Kind, At)> =
            sizing.kinds(&best.randomness).into_iter().map(|kind| (kind, sizing.scan(&fit, kind, &best))).collect();
        scanned.extend(sizing.clocks(&fit, &best));
        scanned.sort_by(|a, b| a.1.value.total_cmp(&b.1.value));
        let Some((kind, start)) = scanned.into_iter().next() else { break };
        if !taken && begin - start.value < PROMISING * gain {
            return Ok(None);
        }
        if best.value - start.value < 2.0 * WORTH {
            break;
        }
        let (next_fit, next) = match kind {
            Kind::Late(_) => sizing.set_clock(&fit, start)?,
            _ => (fit.clone(), sizing.search(&fit, &sizing.sizes(kind), start, &[3.0, 1.5])),
        };
        let cost =
            penalty.of_parameters(parameters(&next.randomness)) - penalty.of_parameters(parameters(&best.randomness));
        if best.value - next.value < cost + EVIDENCE {
            break;
        }
        (fit, best, taken) = (next_fit, next, true);
        // The trajectory no longer bends to what the instrument did.
        fit.randomness = best.randomness.clone();
        fit.smooth(trials)?;
        best = sizing.at(&fit, best.randomness);
    }
    if !taken {
        return Ok(None);
    }
    best = sizing.search(&fit, &sizing.each(&best.randomness), best, &[1.5, 1.15, 1.05]);
    best = sizing.pruned(&fit, best);
    fit.randomness = best.randomness;
    fit.smooth(trials)?;
    Ok(Some(fit))
}

/// The sizes of what the instruments of `fit` add, moved to where they belong with the model as it is now.
pub(crate) fn resize(fit: &Fit, trials: &[Trial], noise: &[f64]) -> Randomness {
    let sizing = Sizing::new(trials, noise, Penalty::NONE);
    let mut sizes: Vec<Size> = Vec::new();
    for device in Device::ALL {
        for drift in [false, true] {
            if sizing.has_memory(&fit.randomness, device, drift) {
                sizes.push(Size::Memories { device, drift });
            }
        }
    }
    if fit.randomness.input > 0.0 {
        sizes.push(Size::Input);
    }
    if fit.randomness.jitter > 0.0 {
        sizes.push(Size::Jitter);
    }
    let start = sizing.at(fit, fit.randomness.clone());
    sizing.search(fit, &sizes, start, &[2.0]).randomness
}

impl<'a> Sizing<'a> {
    fn new(trials: &'a [Trial], noise: &'a [f64], penalty: Penalty) -> Self {
        let forces: Vec<f64> = trials.iter().flat_map(|t| &t.inputs).flat_map(|i| i.winch_force).collect();
        let duration = |t: &Trial| t.time[t.len() - 1] - t.time[0];
        Self {
            trials,
            noise,
            penalty,
            all: Channel::all(),
            interval: crate::data::clean::median(trials.iter().map(Trial::interval).collect()),
            duration: trials.iter().map(duration).fold(0.0, f64::max),
            tension: forces.iter().map(|f| f.abs()).sum::<f64>() / forces.len().max(1) as f64,
        }
    }

    /// Whether a look at the beginnings of the trials says that the instruments may have what an explanation gains.
    fn promises(&self, fit: &Fit, gain: f64) -> bool {
        let count = |t: &Trial| t.time.iter().take_while(|time| **time - t.time[0] <= BEGINNING).count();
        let linear: Vec<LinearTrial> = fit.linear.iter().zip(self.trials).map(|(l, t)| l.beginning(count(t))).collect();
        let samples = |linear: &[LinearTrial]| linear.iter().map(|l| l.len).sum::<usize>() as f64;
        let share = samples(&linear) / samples(&fit.linear);
        let begun = fit.along(linear);
        let begin = self.at(&begun, fit.randomness.clone());
        let kinds = self.kinds(&fit.randomness).into_iter().filter(|kind| !matches!(kind, Kind::Drift(_)));
        let scanned = kinds.map(|kind| self.scan(&begun, kind, &begin).value);
        let clocks = self.clocks(&begun, &begin).into_iter().map(|(_, at)| at.value);
        let least = scanned.chain(clocks).fold(f64::INFINITY, f64::min);
        begin.value - least >= PROMISING * share * gain
    }

    fn at(&self, fit: &Fit, randomness: Randomness) -> At {
        At { value: fit.minus_two_log_likelihood(self.trials, &randomness), randomness }
    }

    /// Places in the list of all channels of what a device measures here.
    fn channels(&self, device: Device) -> Vec<usize> {
        let measured = |c: &Channel| self.trials.iter().any(|t| t.channels.contains(c));
        (0..self.all.len()).filter(|at| Device::of(self.all[*at]) == device && measured(&self.all[*at])).collect()
    }

    fn has_memory(&self, randomness: &Randomness, device: Device, drift: bool) -> bool {
        randomness.memory.iter().any(|m| m.drift == drift && Device::of(self.all[m.channel]) == device)
    }

    /// What could be taken up.
    fn kinds(&self, randomness: &Randomness) -> Vec<Kind> {
        let mut kinds = Vec::new();
        for device in Device::ALL {
            let channels = self.channels(device).len();
            if channels == 0 || randomness.memory.len() + channels > crate::randomness::MOST_MEMORIES {
                continue;
            }
            if !self.has_memory(randomness, device, false) {
                kinds.push(Kind::Colour(device));
            }
            if !self.has_memory(randomness, device, true) {
                kinds.push(Kind::Drift(device));
            }
        }
        kinds.extend((randomness.input == 0.0).then_some(Kind::Input));
        kinds.extend((randomness.jitter == 0.0).then_some(Kind::Jitter));
        kinds
    }

    /// Sizes from which a kind is searched for.
    fn starts(&self, kind: Kind, from: &Randomness) -> Vec<Randomness> {
        let remembering = |device: Device, ratio: f64, time: f64, drift: bool| {
            self.channels(device).into_iter().fold(from.clone(), |randomness, channel| {
                randomness.with_memory(Memory { channel, deviation: ratio * self.noise[channel], time, drift })
            })
        };
        match kind {
            Kind::Colour(device) => {
                let longest = LONGEST * self.duration;
                let times = (0..).map(|k| 4.0 * self.interval * 8.0_f64.powi(k)).take_while(|time| *time < longest);
                times.flat_map(|time| RATIOS.map(|ratio| remembering(device, ratio, time, false))).collect()
            }
            Kind::Drift(device) => RATIOS.map(|ratio| remembering(device, ratio, self.duration, true)).to_vec(),
            Kind::Input => INPUTS.map(|share| Randomness { input: share * self.tension, ..from.clone() }).to_vec(),
            Kind::Jitter => JITTERS.map(|share| Randomness { jitter: share * self.interval, ..from.clone() }).to_vec(),
            Kind::Late(_) => Vec::new(),
        }
    }

    /// The best of the first sizes of a kind, with and without latent forces.
    fn scan(&self, fit: &Fit, kind: Kind, from: &At) -> At {
        let starts = self.starts(kind, &from.randomness).into_iter().flat_map(|start| {
            let bare = start.without_latents();
            if bare.same_latents(&start) { vec![start] } else { vec![start, bare] }
        });
        starts
            .map(|start| self.at(fit, start))
            .min_by(|a, b| a.value.total_cmp(&b.value))
            .unwrap_or_else(|| from.clone())
    }

    /// What belongs to a kind when its sizes are searched for.
    fn sizes(&self, kind: Kind) -> Vec<Size> {
        let mut sizes = match kind {
            Kind::Colour(device) => {
                vec![Size::Memories { device, drift: false }, Size::Times(device), Size::White(device)]
            }
            Kind::Drift(device) => vec![Size::Memories { device, drift: true }],
            Kind::Input => vec![Size::Input],
            Kind::Jitter => vec![Size::Jitter],
            Kind::Late(_) => vec![],
        };
        sizes.extend([Size::Force, Size::Winch]);
        sizes
    }

    /// Every size by itself.
    fn each(&self, randomness: &Randomness) -> Vec<Size> {
        let mut sizes = Vec::new();
        for (at, memory) in randomness.memory.iter().enumerate() {
            sizes.push(Size::Memory(at));
            if !memory.drift {
                sizes.extend([Size::Time(at), Size::WhiteOf(memory.channel)]);
            }
        }
        sizes.extend((randomness.input > 0.0).then_some(Size::Input));
        sizes.extend((randomness.jitter > 0.0).then_some(Size::Jitter));
        sizes.extend([Size::Force, Size::Winch]);
        sizes
    }

    /// `from` with a size multiplied.
    fn scaled(&self, from: &Randomness, size: Size, factor: f64) -> Randomness {
        let mut next = from.clone();
        let of = |m: &Memory, device: Device| Device::of(self.all[m.channel]) == device;
        let times = SHORTEST * self.interval..=LONGEST * self.duration;
        // What it does within a sample stays: size and time constant are told apart by what it does later.
        let time = |memory: &mut Memory| {
            let before = memory.time;
            memory.time = (factor * before).clamp(*times.start(), *times.end());
            memory.deviation *= (memory.time / before).sqrt();
        };
        let white = |noise: &mut f64, at: usize| *noise = (factor * *noise).max(self.all[at].noise_floor());
        match size {
            Size::Memories { device, drift } => {
                let chosen = next.memory.iter_mut().filter(|m| m.drift == drift && of(m, device));
                chosen.for_each(|m| m.deviation *= factor);
            }
            Size::Times(device) => next.memory.iter_mut().filter(|m| !m.drift && of(m, device)).for_each(time),
            Size::White(device) => {
                self.channels(device).into_iter().for_each(|at| white(&mut next.noise[at], at));
            }
            Size::Memory(at) => next.memory[at].deviation *= factor,
            Size::Time(at) => time(&mut next.memory[at]),
            Size::WhiteOf(at) => white(&mut next.noise[at], at),
            Size::Input => next.input *= factor,
            Size::Jitter => next.jitter *= factor,
            Size::Force => next.force = next.force_scaled(factor),
            Size::Winch => next.winch = next.winch_scaled(factor),
        }
        next
    }

    /// The best place reached by multiplying one size after the other by each of the factors and their inverses, again as
    /// long as that is worth it.
    fn search(&self, fit: &Fit, sizes: &[Size], mut best: At, factors: &[f64]) -> At {
        for factor in factors {
            for _ in 0..MOST_PASSES {
                let begin = best.value;
                for size in sizes {
                    best = self.along(fit, *size, best, *factor);
                }
                if begin - best.value < WORTH {
                    break;
                }
            }
        }
        best
    }

    /// The best place reached by multiplying one size by a factor or its inverse.
    fn along(&self, fit: &Fit, size: Size, mut best: At, factor: f64) -> At {
        let begin = best.value;
        for factor in [factor, 1.0 / factor] {
            loop {
                let next = self.scaled(&best.randomness, size, factor);
                if next == best.randomness {
                    break;
                }
                let next = self.at(fit, next);
                if next.value > best.value - LEAST {
                    break;
                }
                best = next;
            }
            if best.value < begin {
                break;
            }
        }
        best
    }

    /// Without what does not pay for its parameters now that the rest has been taken up.
    fn pruned(&self, fit: &Fit, mut best: At) -> At {
        let from = &best.randomness;
        let mut less: Vec<Randomness> = Vec::new();
        less.extend((from.jitter > 0.0).then(|| Randomness { jitter: 0.0, ..from.clone() }));
        less.extend((from.input > 0.0).then(|| Randomness { input: 0.0, ..from.clone() }));
        for without in less {
            let white: Vec<Size> = Device::ALL.map(Size::White).to_vec();
            let next = self.search(fit, &white, self.at(fit, without), &[1.05]);
            if next.value < best.value + self.penalty.of_parameters(1) + EVIDENCE {
                best = next;
            }
        }
        for at in (0..best.randomness.memory.len()).rev() {
            let mut without = best.randomness.clone();
            let cost = self.penalty.of_parameters(if without.memory.remove(at).drift { 1 } else { 2 });
            let next = self.at(fit, without);
            if next.value < best.value + cost {
                best = next;
            }
        }
        best
    }

    /// What setting the clock of each device would gain, to first order: at the latent forces as they are and without.
    ///
    /// The recorded forces have the reference clock. A late pose is an effect of the catalogue.
    fn clocks(&self, fit: &Fit, from: &At) -> Vec<(Kind, At)> {
        let devices: Vec<Device> =
            Device::ALL.into_iter().filter(|d| *d != Device::Pose && !self.channels(*d).is_empty()).collect();
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
    fn clock_normal(&self, fit: &Fit, randomness: &Randomness, devices: &[Device]) -> Normal {
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
    fn set_clock(&self, fit: &Fit, start: At) -> Result<(Fit, At), FitError> {
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

/// The smallest step between different readings, where all are multiples of it and it is no smaller than a share of the
/// noise that matters.
fn resolution(trials: &[Trial], channel: Channel, noise: f64) -> Option<f64> {
    let mut readings: Vec<f64> = Vec::new();
    for trial in trials {
        let Some(j) = trial.channels.iter().position(|c| *c == channel) else { continue };
        readings.extend(trial.measured.iter().map(|row| row[j]).filter(|v| v.is_finite()));
    }
    readings.sort_by(f64::total_cmp);
    let count =
        readings.windows(2).map(|w| w[1] - w[0]).filter(|step| *step > 1e-3 * noise).fold(f64::INFINITY, f64::min);
    let whole = |v: &f64| {
        let multiple = (v - readings[0]) / count;
        (multiple - multiple.round()).abs() < 1e-3
    };
    // Noise of a tenth of a count hides it, one of many counts makes it superfluous.
    (count.is_finite() && count > 0.3 * noise && readings.iter().all(whole)).then_some(count)
}

/// What the instruments of the fit add, with standard errors.
pub(crate) fn summary(fit: &Fit, trials: &[Trial], noise: &[f64]) -> Instruments {
    let sizing = Sizing::new(trials, noise, Penalty::NONE);
    let randomness = &fit.randomness;
    let devices: Vec<Device> =
        Device::ALL.into_iter().filter(|d| sizing.channels(*d).iter().any(|at| randomness.late[*at] != 0.0)).collect();
    let clocks = (!devices.is_empty()).then(|| sizing.clock_normal(fit, randomness, &devices));
    let channel = |at: usize| {
        let memory = |drift: bool| randomness.memory.iter().position(|m| m.channel == at && m.drift == drift);
        let coloured = memory(false).map(|m| {
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
        let delay = devices.iter().position(|d| *d == Device::of(sizing.all[at])).and_then(|c| {
            let gram = clocks.as_ref()?.gram[c * devices.len() + c];
            Some(Estimated { value: randomness.late[at], standard_error: Some(1.0 / gram.sqrt()) })
        });
        ChannelInstrument {
            channel: sizing.all[at],
            white: randomness.noise[at],
            coloured: coloured.map(|c| c[0]),
            time_constant: coloured.map(|c| c[1]),
            drift: memory(true).map(|m| sizing.sized(fit, randomness.memory[m].deviation, Size::Memory(m))),
            delay,
            resolution: resolution(trials, sizing.all[at], randomness.noise[at]),
        }
    };
    Instruments {
        channels: Device::ALL.into_iter().flat_map(|d| sizing.channels(d)).map(channel).collect(),
        winch_force: (randomness.input > 0.0).then(|| sizing.sized(fit, randomness.input, Size::Input)),
        stamps: (randomness.jitter > 0.0).then(|| sizing.sized(fit, randomness.jitter, Size::Jitter)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::recording::{fitted, noise, record};

    const PENALTY: usize = 10_000;

    /// Recordings of a robot that misses nothing, with what `change` does to each.
    fn recordings(change: impl Fn(u64, &mut Trial)) -> [Trial; 2] {
        let mut trials = [record(&[], 60.0, 7), record(&[], 60.0, 8)];
        (0..).zip(&mut trials).for_each(|(t, trial)| change(t, trial));
        trials
    }

    fn taken_up(trials: &[Trial]) -> Option<Fit> {
        let fit = fitted(&[], trials);
        take_up(&fit, trials, &crate::estimate::noise_of_data(trials), Penalty::new(PENALTY), 0.0).unwrap()
    }

    /// First-order noise of this size and time constant.
    fn remembering(trial: &Trial, deviation: f64, time: f64, seed: u64) -> Vec<f64> {
        let decay = (-trial.interval() / time).exp();
        let mut last = 0.0;
        let white = noise(trial.len() + 100, seed);
        let step = |white| {
            last = decay * last + deviation * (1.0 - decay * decay).sqrt() * white;
            last
        };
        white.map(step).skip(100).collect()
    }

    #[test]
    fn white_noise_asks_for_nothing_more() {
        assert!(taken_up(&recordings(|_, _| {})).is_none());
    }

    /// The likelihood has its maximum near what made the series, and what is found is no worse than that.
    #[test]
    fn noise_with_memory_on_the_pose_is_found_with_its_time_constant() {
        let trials = recordings(|t, trial| {
            for j in 0..2 {
                let colour = remembering(trial, 0.01, 0.8, 1000 * (t + 1) + 37 * j as u64);
                trial.measured.iter_mut().zip(colour).for_each(|(row, colour)| row[j] += colour);
            }
        });
        let fit = taken_up(&trials).expect("an instrument");
        let mut truth = fit.randomness.clone();
        for memory in truth.memory.iter_mut().filter(|m| m.channel < 2) {
            assert!((memory.deviation / 0.01 - 1.0).abs() < 0.3, "{memory:?}");
            assert!((memory.time / 0.8).ln().abs() < 0.7, "{memory:?}");
            (memory.deviation, memory.time) = (0.01, 0.8);
        }
        assert_eq!(truth.memory.iter().filter(|m| m.channel < 2).count(), 2, "{truth:?}");
        let value = |randomness: &Randomness| fit.minus_two_log_likelihood(&trials, randomness);
        assert!(value(&fit.randomness) < value(&truth) + WORTH, "{:?}", fit.randomness);
        assert!(fit.randomness.force.max(fit.randomness.winch) < 5.0, "{:?}", fit.randomness);
    }

    #[test]
    fn an_error_of_the_recorded_forces_is_no_latent_force() {
        let trials = recordings(|t, trial| {
            let mut errors = noise(4 * trial.len(), 60 + t);
            for inputs in &mut trial.inputs {
                inputs.winch_force.iter_mut().for_each(|f| *f += 50.0 * errors.next().unwrap_or(0.0));
            }
        });
        let fit = taken_up(&trials).expect("an instrument");
        assert!((fit.randomness.input / 50.0 - 1.0).abs() < 0.3, "{:?}", fit.randomness);
        assert!(fit.randomness.force.max(fit.randomness.winch) < 5.0, "{:?}", fit.randomness);
    }

    #[test]
    fn late_lengths_are_a_late_clock() {
        let trials = recordings(|_, trial| {
            let late = 0.02;
            for j in 3..trial.channels.len() {
                let column: Vec<f64> = trial.measured.iter().map(|row| row[j]).collect();
                // The noise stays: what is shown moves by less than a sample of it.
                for (k, row) in trial.measured.iter_mut().enumerate().skip(3).take(column.len().saturating_sub(6)) {
                    let slope = (column[k + 3] - column[k - 3]) / (trial.time[k + 3] - trial.time[k - 3]);
                    row[j] -= late * slope;
                }
            }
        });
        let fit = taken_up(&trials).expect("an instrument");
        for at in 0..fit.randomness.late.len() {
            let expected = if matches!(Channel::all()[at], Channel::UnstretchedLength(_)) { 0.02 } else { 0.0 };
            assert!((fit.randomness.late[at] - expected).abs() < 4e-3, "{:?}", fit.randomness.late);
        }
    }

    #[test]
    fn counts_are_seen_and_digits_of_a_file_are_not() {
        let mut trial = record(&[], 20.0, 9);
        assert_eq!(resolution(std::slice::from_ref(&trial), Channel::Pose(0), 2e-3), None);
        trial.measured.iter_mut().for_each(|row| row[0] = 5e-3 * (row[0] / 5e-3).round());
        let count = resolution(&[trial], Channel::Pose(0), 2e-3).expect("counts");
        assert!((count - 5e-3).abs() < 1e-9, "{count}");
    }
}
