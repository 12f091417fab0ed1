//! What the instruments add to recordings beside white noise: sizes by maximum likelihood on the innovations.
//!
//! Of each device (pose, lengths, load cells) noise with memory, drift and a late clock; of the recorded forces a white
//! error; of the stamps jitter. Each is taken up only where the likelihood gains more than its parameters cost, the one
//! that gains most first; forces that are recorded late and clocks that are slow are [another matter](super::undoing). What the instruments do, the
//! latent forces need not carry: each is tried with the latent forces as they are and without them.

use crate::data::device::Device;
use crate::data::{Channel, Trial};
use crate::filter::error::FitError;
use crate::filter::estimate::Fit;
use crate::filter::kalman::Randomness;
use crate::hypothesis::parameter::{Free, free_parameters};
use crate::instruments::clocks::{Clocks, less_one_clock};
use crate::instruments::expected::largest_error;
use crate::model::randomness::{MOST_MEMORIES, Memory};
use crate::strategy::policy::POLICY;
use crate::verdict::POLICY as VERDICT;
use crate::weigh::criterion::{EVIDENCE, Penalty};
use crate::weigh::proposal::promises;
use crate::weigh::refine::refine_free;

/// What an instrument may add.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Colour(Device),
    Drift(Device),
    Origin(Device),
    Late(Device),
    Input,
    Jitter,
}

/// A size that is searched for on a logarithmic scale.
#[derive(Clone, Copy, Debug)]
pub(super) enum Size {
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
pub(super) const SHORTEST: f64 = 1.0;
/// Longest, as a share of the longest recording: slower is drift.
const LONGEST: f64 = 0.2;
/// First sizes of noise with memory, in multiples of what differences say of white noise: from one three times as large as it is nothing
/// leads to it.
const RATIOS: [f64; 3] = [0.25, 1.0, 4.0];
/// First sizes of drift, likewise: whatever its size, it is seen against what little else is as slow.
const DRIFTS: [f64; 2] = [1.0, 4.0];
/// Smallest and largest first error of the recorded forces, as shares of the mean force.
const INPUTS: (f64, f64) = (3e-4, 3e-2);
/// Smallest and largest first jitter of the stamps, in sampling intervals.
const JITTERS: (f64, f64) = (0.02, 0.2);
/// Steps between first sizes, as powers of ten: small where nothing else can stand in for a size that is off, large beside
/// latent forces, which can.
pub(super) const STEPS: (f64, f64) = (0.25, 1.0);
/// Share of what a rival gains that a first look at an instrument must gain for a second.
const PROMISING: f64 = 0.3;
/// Half the fall of `-2 log L` that a first look must promise.
pub(super) const WORTH: f64 = 0.5;

/// Rounds in which parameters adapt to a size.
const ADAPTING: usize = 4;

/// Whether anything of a fit adapts to the sizes of what is random.
fn adapts(fit: &Fit, free: &[Free], trials: &[Trial]) -> bool {
    !free.is_empty() || Clocks::set(&fit.randomness, trials).count() > 0
}

/// Sizes between two, with a step between them (powers of ten).
fn spaced((least, most): (f64, f64), step: f64) -> impl Iterator<Item = f64> {
    let count = ((most / least).log10() / step).round() as i32;
    (0..=count).map(move |k| least * 10.0_f64.powf(step * f64::from(k)))
}

/// A place of the search with its `-2 log L`.
#[derive(Clone)]
pub(super) struct At {
    pub(super) randomness: Randomness,
    pub(super) value: f64,
}

/// Instruments under examination.
#[derive(Clone)]
pub(crate) struct Sizing<'a> {
    pub(super) trials: &'a [Trial],
    /// White noise of each channel by differences.
    pub(super) noise: &'a [f64],
    pub(super) penalty: Penalty,
    pub(super) all: Vec<Channel>,
    pub(super) interval: f64,
    pub(super) duration: f64,
    /// Mean winch force (N).
    pub(super) tension: f64,
    /// Longest time constant of noise with memory (s).
    pub(super) longest: f64,
    /// What the recordings of the forces have where these hardly move, as if it were white: the largest white error of them (N).
    pub(super) floor: f64,
    /// The largest that is looked for (N).
    pub(super) largest_input: f64,
}

/// Number of parameters of the instruments beside white noise.
pub(crate) fn parameters(randomness: &Randomness) -> usize {
    let memories: usize = randomness.memory.iter().map(|m| if m.drift { 1 } else { 2 }).sum();
    let mut late: Vec<f64> = randomness.late.iter().copied().filter(|late| *late != 0.0).collect();
    late.sort_by(f64::total_cmp);
    late.dedup();
    memories + late.len() + usize::from(randomness.input > 0.0) + usize::from(randomness.jitter > 0.0)
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
    if fit.randomness.white_input() > 0.0 {
        sizes.push(Size::Input);
    }
    if fit.randomness.jitter > 0.0 {
        sizes.push(Size::Jitter);
    }
    let start = sizing.at(fit, fit.randomness.clone());
    sizing.most_likely(fit, &sizes, start).randomness
}

/// `randomness` less one thing that instruments add, for each of those: noise with memory or drift of a device, the error of
/// the recorded forces, jitter; and the delay of a clock that is not certain.
pub(crate) fn less_by_one(fit: &Fit, trials: &[Trial]) -> Vec<Randomness> {
    let randomness = &fit.randomness;
    let all = Channel::all(trials.first().map_or(0, Trial::cables));
    let mut less = Vec::new();
    for device in Device::ALL {
        for drift in [true, false] {
            let without = less_memories(randomness, &all, device, drift);
            let fewer = without.memory.len() < randomness.memory.len();
            less.extend(fewer.then_some(without));
        }
    }
    less.extend((randomness.white_input() > 0.0).then(|| Randomness { input: 0.0, ..randomness.clone() }));
    less.extend((randomness.jitter > 0.0).then(|| Randomness { jitter: 0.0, ..randomness.clone() }));
    less.extend(less_one_clock(fit, trials));
    less.into_iter().map(Randomness::bounded).collect()
}

/// `randomness` without drifts of lengths; none where they have no drift.
pub(crate) fn less_drifts_of_lengths(randomness: &Randomness, trials: &[Trial]) -> Option<Randomness> {
    let all = Channel::all(trials.first().map_or(0, Trial::cables));
    let lengths = [Device::CableLengths, Device::UnstretchedLengths];
    let without = lengths.iter().fold(randomness.clone(), |less, device| less_memories(&less, &all, *device, true));
    (without.memory.len() < randomness.memory.len()).then(|| without.bounded())
}

/// `randomness` without what a device remembers, drift or not.
pub(super) fn less_memories(randomness: &Randomness, all: &[Channel], device: Device, drift: bool) -> Randomness {
    let mut without = randomness.clone();
    without.memory.retain(|m| m.drift != drift || Device::of(all[m.channel]) != device);
    without
}

impl<'a> Sizing<'a> {
    pub(crate) fn new(trials: &'a [Trial], noise: &'a [f64], penalty: Penalty) -> Self {
        let forces: Vec<f64> = trials.iter().flat_map(|t| &t.inputs).flat_map(|i| i.winch_force).collect();
        let duration = trials.iter().map(|t: &Trial| t.time[t.len() - 1] - t.time[0]).fold(0.0, f64::max);
        let floor = largest_error(trials, 0.0);
        Self {
            trials,
            noise,
            penalty,
            all: Channel::all(trials.first().map_or(0, Trial::cables)),
            interval: crate::data::clean::median(trials.iter().map(Trial::interval).collect()),
            duration,
            tension: forces.iter().map(|f| f.abs()).sum::<f64>() / forces.len().max(1) as f64,
            longest: LONGEST * duration,
            floor,
            largest_input: floor,
        }
    }

    /// Whether latent forces are larger than what may act without being recorded where recordings say something of a machine.
    pub(crate) fn may_hide_an_error(&self, randomness: &Randomness) -> bool {
        let size = randomness.force.hypot(randomness.winch);
        randomness.has_latents() && size > largest_error(self.trials, VERDICT.unrecorded)
    }

    /// The same where any white error of the recorded forces may be, whatever it says of the recordings.
    pub(crate) fn with_any_error_of_forces(self) -> Self {
        Self { largest_input: f64::INFINITY, ..self }
    }

    /// Whether the recorded forces have a white error for sure: all that they hold where they hardly move moves nothing, and that alone
    /// explains more than the `gain` of an explanation that is at hand.
    pub(crate) fn forces_err_for_sure(&self, fit: &Fit, gain: f64) -> bool {
        if fit.randomness.input > 0.0 {
            return false;
        }
        let starts = self.all_starts(Kind::Input, &fit.randomness).into_iter().map(|start| self.at(fit, start));
        let best = starts.min_by(|a, b| a.value.total_cmp(&b.value));
        let begin = fit.minus_two_log_likelihood(self.trials, &fit.randomness);
        let enough = begin - gain - self.penalty.of_parameters(1) - EVIDENCE;
        best.is_some_and(|best| best.randomness.input == self.floor && best.value < enough)
    }

    /// `fit` with what its instruments ask for; `None` where they ask for nothing, or far less than the `gain` of an explanation
    /// that is at hand.
    ///
    /// The parameters of the effects from `first` on, and the clocks that are set, adapt: fitted beside latent forces they are not
    /// near enough for an instrument to do without these.
    pub(crate) fn take_up(&self, fit: &Fit, gain: f64, first: usize) -> Result<Option<Fit>, FitError> {
        let free = free_parameters(&fit.model, first);
        if gain > 0.0 && !self.promises(fit, gain)? {
            return Ok(None);
        }
        let mut fit = fit.clone();
        let mut best = self.at(&fit, fit.randomness.clone());
        let (begin, mut taken) = (best.value, false);
        let mut refused: Vec<(Kind, bool)> = Vec::new();
        loop {
            let mut scanned = self.scan_all(&fit, &free, &best);
            scanned.extend(self.clocks(&fit, &best));
            scanned.retain(|(kind, start)| !refused.contains(&(*kind, start.randomness.has_latents())));
            scanned.sort_by(|a, b| a.1.value.total_cmp(&b.1.value));
            let Some((kind, start)) = scanned.into_iter().next() else { break };
            let with_latents = start.randomness.has_latents();
            if !taken && begin - start.value < PROMISING * gain {
                return Ok(None);
            }
            // A late pose is an effect of the catalogue, which is told from what else delays there.
            if best.value - start.value < 2.0 * WORTH || kind == Kind::Late(Device::Pose) {
                break;
            }
            let (next_fit, next) = match kind {
                Kind::Late(_) => self.set_clock_beside(&fit, &free, start)?,
                _ => {
                    let (adapted, start) = self.adapted(&fit, &free, start)?;
                    let next = self.most_likely(&adapted, &self.sizes(kind), start);
                    (adapted, next)
                }
            };
            let cost = self.cost_beyond(&next.randomness, &best.randomness);
            if best.value - next.value < cost + EVIDENCE {
                break;
            }
            match self.followed(next_fit, next, best.value - cost - EVIDENCE)? {
                Some(followed) => ((fit, best), taken) = (followed, true),
                None => refused.push((kind, with_latents)),
            }
        }
        if !taken {
            return Ok(None);
        }
        (fit, best) = self.exchanged(fit, best)?;
        (fit, best) = self.divided(fit, best)?;
        best = self.most_likely(&fit, &self.each(&best.randomness), best);
        best = self.pruned(&fit, best);
        fit.randomness = best.randomness;
        fit.smooth(self.trials)?;
        Ok(Some(fit))
    }

    /// What the parameters of `next` cost beyond those of `before`.
    pub(super) fn cost_beyond(&self, next: &Randomness, before: &Randomness) -> f64 {
        self.penalty.of_parameters(parameters(next)) - self.penalty.of_parameters(parameters(before))
    }

    /// Whether a look at the beginnings of the trials says that the instruments may have what an explanation gains.
    fn promises(&self, fit: &Fit, gain: f64) -> Result<bool, FitError> {
        let beginnings = self.beginnings().unwrap_or_else(|| self.trials.to_vec());
        let (begun, sizing) = (fit.part(self.trials, &beginnings)?, self.on(&beginnings));
        let samples = |trials: &[Trial]| trials.iter().map(Trial::len).sum::<usize>() as f64;
        let share = samples(&beginnings) / samples(self.trials);
        let begin = sizing.at(&begun, fit.randomness.clone());
        let kinds = self.kinds(&fit.randomness).into_iter().filter(|kind| !matches!(kind, Kind::Drift(_)));
        let starts = kinds.flat_map(|kind| self.all_starts(kind, &fit.randomness));
        let values = starts.map(|start| sizing.at(&begun, start).value);
        let clocks = sizing.clocks(&begun, &begin).into_iter();
        let clocks = clocks.filter(|(kind, _)| *kind != Kind::Late(Device::Pose)).map(|(_, at)| at.value);
        let least = values.chain(clocks).fold(f64::INFINITY, f64::min);
        Ok(begin.value - least >= PROMISING * share * gain)
    }

    pub(super) fn at(&self, fit: &Fit, randomness: Randomness) -> At {
        At { value: fit.minus_two_log_likelihood(self.trials, &randomness), randomness }
    }

    /// Places in the list of all channels of what a device measures here.
    pub(super) fn channels(&self, device: Device) -> Vec<usize> {
        let measured = |c: &Channel| self.trials.iter().any(|t| t.channels.contains(c));
        (0..self.all.len()).filter(|at| Device::of(self.all[*at]) == device && measured(&self.all[*at])).collect()
    }

    pub(super) fn has_memory(&self, randomness: &Randomness, device: Device, drift: bool) -> bool {
        randomness.memory.iter().any(|m| m.drift == drift && Device::of(self.all[m.channel]) == device)
    }

    /// Channels of a device without noise with memory, or without drift.
    pub(super) fn without_memory(&self, randomness: &Randomness, device: Device, drift: bool) -> Vec<usize> {
        let without = |at: &usize| !randomness.memory.iter().any(|m| m.drift == drift && m.channel == *at);
        self.channels(device).into_iter().filter(without).collect()
    }

    /// What could be taken up.
    pub(super) fn kinds(&self, randomness: &Randomness) -> Vec<Kind> {
        let mut kinds = Vec::new();
        for (device, drift) in Device::ALL.into_iter().flat_map(|device| [(device, false), (device, true)]) {
            let channels = self.without_memory(randomness, device, drift).len();
            if channels > 0 && randomness.memory.len() + channels <= MOST_MEMORIES {
                kinds.push(if drift { Kind::Drift(device) } else { Kind::Colour(device) });
                kinds.extend((drift && self.trials.len() > 1).then_some(Kind::Origin(device)));
            }
        }
        kinds.extend((randomness.input == 0.0).then_some(Kind::Input));
        kinds.extend((randomness.jitter == 0.0).then_some(Kind::Jitter));
        kinds
    }

    /// Sizes from which a kind is searched for, with a step between them (powers of ten).
    pub(super) fn starts(&self, kind: Kind, from: &Randomness, step: f64) -> Vec<Randomness> {
        let remembering = |device: Device, ratio: f64, time: f64, drift: bool| {
            self.without_memory(from, device, drift).into_iter().fold(from.clone(), |randomness, channel| {
                randomness.with_memory(Memory { channel, deviation: ratio * self.noise[channel], time, drift })
            })
        };
        match kind {
            Kind::Colour(device) => {
                let times =
                    (0..).map(|k| 4.0 * self.interval * 8.0_f64.powi(k)).take_while(|time| *time < self.longest);
                times.flat_map(|time| RATIOS.map(|ratio| remembering(device, ratio, time, false))).collect()
            }
            Kind::Drift(device) => DRIFTS.map(|ratio| remembering(device, ratio, self.duration, true)).to_vec(),
            Kind::Origin(device) => DRIFTS.map(|ratio| remembering(device, ratio, f64::INFINITY, true)).to_vec(),
            Kind::Input => {
                // An error is all that a recording has where the force hardly moves, or the force itself shakes there: between these
                // nothing leads from one to the other.
                let sizes = spaced(INPUTS, step).map(|share| share * self.tension).chain([self.floor]);
                let sizes = sizes.filter(|input| *input <= self.largest_input);
                sizes.map(|input| Randomness { input, ..from.clone() }).collect()
            }
            Kind::Jitter => spaced(JITTERS, step)
                .map(|share| Randomness { jitter: share * self.interval, ..from.clone() })
                .collect(),
            Kind::Late(_) => Vec::new(),
        }
    }

    /// The first sizes of a kind, with and without latent forces.
    fn all_starts(&self, kind: Kind, from: &Randomness) -> Vec<Randomness> {
        let mut starts = self.starts(kind, &from.without_latents(), STEPS.0);
        if from.has_latents() {
            starts.extend(self.starts(kind, from, STEPS.1));
        }
        starts
    }

    /// The first sizes of all kinds, with what the parameters that are `free` and the clocks would gain beside them.
    fn scan_all(&self, fit: &Fit, free: &[Free], from: &At) -> Vec<(Kind, At)> {
        let kinds = self.kinds(&from.randomness).into_iter();
        let starts = kinds.flat_map(|kind| {
            self.all_starts(kind, &from.randomness).into_iter().map(move |randomness| (kind, randomness))
        });
        let starts: Vec<(Kind, Randomness)> = starts.collect();
        let alone = |randomness: &Randomness| fit.minus_two_log_likelihood(self.trials, randomness);
        let sizes: Vec<Randomness> = starts.iter().map(|(_, start)| start.clone()).collect();
        let values: Vec<f64> = if adapts(fit, free, self.trials) {
            let values = promises(fit, self.trials, free, &sizes).into_iter().zip(&starts);
            // Forces with an error are those to be expected, whatever else adapts.
            let of_forces = |kind: &Kind, start| if *kind == Kind::Input { alone(start) } else { f64::INFINITY };
            values
                .map(|(promise, (kind, start))| promise.minus_two_log_likelihood.min(of_forces(kind, start)))
                .collect()
        } else {
            sizes.iter().map(alone).collect()
        };
        starts.into_iter().zip(values).map(|((kind, randomness), value)| (kind, At { randomness, value })).collect()
    }

    /// The beginnings of the trials; none where these are the whole.
    fn beginnings(&self) -> Option<Vec<Trial>> {
        let end = |trial: &Trial| trial.time.partition_point(|time| *time - trial.time[0] <= POLICY.longest_beginning);
        let part = |trial: &Trial| trial.part(0..end(trial), trial.name.clone());
        let shorter = self.trials.iter().any(|trial| end(trial) < trial.len());
        shorter.then(|| self.trials.iter().map(part).collect())
    }

    /// The same on parts of the trials.
    pub(super) fn on<'b>(&self, trials: &'b [Trial]) -> Sizing<'b>
    where
        'a: 'b,
    {
        Sizing { trials, ..self.clone() }
    }

    /// `fit` with the sizes of `start`, its parameters that are `free` and its clocks moved to where they belong beside them; as
    /// it is where it is likelier so: beside recorded forces with an error they may go where that error has nothing to do.
    pub(super) fn adapted(&self, fit: &Fit, free: &[Free], start: At) -> Result<(Fit, At), FitError> {
        if !adapts(fit, free, self.trials) {
            return Ok((fit.clone(), start));
        }
        let alone = self.at(fit, start.randomness.clone());
        let mut adapted = fit.clone();
        adapted.randomness = start.randomness;
        // Where no step can be taken it is as it was, and is asked below whether that is better.
        match refine_free(&mut adapted, self.trials, free, ADAPTING, None) {
            Err(FitError::Diverged { .. } | FitError::Simulation(_)) => return Ok((fit.clone(), alone)),
            ended => ended?,
        };
        let at = self.at(&adapted, adapted.randomness.clone());
        Ok(if at.value < alone.value { (adapted, at) } else { (fit.clone(), alone) })
    }

    /// What belongs to a kind when its sizes are searched for.
    pub(super) fn sizes(&self, kind: Kind) -> Vec<Size> {
        let mut sizes = match kind {
            Kind::Colour(device) => {
                vec![Size::Memories { device, drift: false }, Size::Times(device), Size::White(device)]
            }
            Kind::Drift(device) | Kind::Origin(device) => vec![Size::Memories { device, drift: true }],
            Kind::Input => vec![Size::Input],
            Kind::Jitter => vec![Size::Jitter],
            Kind::Late(_) => vec![],
        };
        sizes.extend([Size::Force, Size::Winch]);
        sizes
    }

    /// Every size by itself.
    pub(super) fn each(&self, randomness: &Randomness) -> Vec<Size> {
        let mut sizes = Vec::new();
        for (at, memory) in randomness.memory.iter().enumerate() {
            sizes.push(Size::Memory(at));
            if !memory.drift {
                sizes.extend([Size::Time(at), Size::WhiteOf(memory.channel)]);
            }
        }
        sizes.extend((randomness.white_input() > 0.0).then_some(Size::Input));
        sizes.extend((randomness.jitter > 0.0).then_some(Size::Jitter));
        sizes.extend([Size::Force, Size::Winch]);
        sizes
    }

    /// `from` with a size multiplied.
    pub(super) fn scaled(&self, from: &Randomness, size: Size, factor: f64) -> Randomness {
        let mut next = from.clone();
        let of = |m: &Memory, device: Device| Device::of(self.all[m.channel]) == device;
        let times = SHORTEST * self.interval..=self.longest;
        // What it does within a sample stays: size and time constant are told apart by what it does later.
        let time = |memory: &mut Memory| {
            let before = memory.time;
            memory.time = (factor * before).clamp(*times.start(), *times.end());
            memory.deviation *= (memory.time / before).sqrt();
        };
        let white = |next: &mut Randomness, at: usize| {
            next.noise[at] = next.bounded_noise(at, factor * next.noise[at]);
        };
        match size {
            Size::Memories { device, drift } => {
                let chosen = next.memory.iter_mut().filter(|m| m.drift == drift && of(m, device));
                chosen.for_each(|m| m.deviation *= factor);
            }
            Size::Times(device) => next.memory.iter_mut().filter(|m| !m.drift && of(m, device)).for_each(time),
            Size::White(device) => {
                self.channels(device).into_iter().for_each(|at| white(&mut next, at));
            }
            Size::Memory(at) => next.memory[at].deviation *= factor,
            Size::Time(at) => time(&mut next.memory[at]),
            Size::WhiteOf(at) => white(&mut next, at),
            Size::Input => next.input = (factor * next.input).min(self.largest_input.max(from.input)),
            Size::Jitter => next.jitter *= factor,
            Size::Force => next.force = next.force_scaled(factor),
            Size::Winch => next.winch = next.winch_scaled(factor),
        }
        next
    }

    /// Without what does not pay for its parameters now that the rest has been taken up.
    pub(super) fn pruned(&self, fit: &Fit, mut best: At) -> At {
        let from = &best.randomness;
        let mut less: Vec<Randomness> = Vec::new();
        less.extend((from.jitter > 0.0).then(|| Randomness { jitter: 0.0, ..from.clone() }));
        less.extend((from.white_input() > 0.0).then(|| Randomness { input: 0.0, ..from.clone() }));
        for without in less {
            let white: Vec<Size> = Device::ALL.map(Size::White).to_vec();
            let next = self.most_likely(fit, &white, self.at(fit, without.bounded()));
            if next.value < best.value + self.penalty.of_parameters(1) + EVIDENCE {
                best = next;
            }
        }
        for at in (0..best.randomness.memory.len()).rev() {
            let mut without = best.randomness.clone();
            let cost = self.penalty.of_parameters(if without.memory.remove(at).drift { 1 } else { 2 });
            let next = self.at(fit, without.bounded());
            if next.value < best.value + cost {
                best = next;
            }
        }
        best
    }
}
