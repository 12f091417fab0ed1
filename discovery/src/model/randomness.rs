//! What is random beside the model: latent disturbances, and what the instruments add to each recording.

use cdpr::per_cable::MAX_CABLES;

use crate::model::examined::WRENCH;

/// Smallest latent force considered, as a share of the winch forces: below it a trial is as good as undisturbed. The filter always has
/// it: along an unstable motion data of a model without any would say more the longer they are, and a gain of one winch was told 14
/// times more exactly without 0.03 N. Where latent forces are that small they are no processes, but white noise of the same power.
const SMALLEST_LATENT: f64 = 1.5e-6;
/// How many times as large a latent force has to be to be told from it: nothing leads from there on towards none.
const TOLD_FROM_NONE: f64 = 2.0;
/// Largest.
const LARGEST_LATENT: f64 = 5.0;
/// From what size on latent forces are searched for, as a share of the winch forces.
const FIRST_LATENT: f64 = 1.5e-3;

/// Most processes of noise with memory that the filter has room for, beside the latent disturbances of the most cables
/// and of the errors of the forces that they are driven with.
pub(crate) const MOST_MEMORIES: usize = ROOM - WRENCH - (1 + PARTS) * MAX_CABLES;
/// Most processes that the filter has room for.
pub(crate) const ROOM: usize = 64;

/// Noise with memory on one channel: first order (Gauss and Markov), stationary. Where its time constant is as long as the
/// recordings it is a drift; where that is endless, an origin that each recording has of its own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Memory {
    /// Place of the channel in [`Randomness::noise`].
    pub(crate) channel: usize,
    /// Standard deviation (in the channel's unit).
    pub(crate) deviation: f64,
    /// Time constant (s).
    pub(crate) time: f64,
    /// Whether it is a drift: its time constant is the length of the recordings, or endless.
    pub(crate) drift: bool,
}

impl Memory {
    /// Whether it is an origin that each recording has of its own, and stays as it is there.
    pub(crate) fn is_origin(&self) -> bool {
        self.drift && self.time.is_infinite()
    }
}

/// Parts of what is left of the error of a recorded force.
pub(crate) const PARTS: usize = 2;

/// What is left of the white error of recorded forces in those that are to be expected: second order, for each winch its own.
/// It is a sum of two parts of first order that one white noise drives, so that each forgets by itself.
///
/// Forces have power far above that of their error up to some frequency, and soon nothing but error. What is left falls as
/// steeply; with a first order it would shake the cables' own modes, and a model without damping would seem to be wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Expected {
    /// Standard deviation of each part over that of the white error.
    pub(crate) share: [f64; PARTS],
    /// Covariance of the parts over the variance of the white error.
    pub(crate) covariance: f64,
    /// Time constant of each part (s).
    pub(crate) time: [f64; PARTS],
    /// Variance of the error that the recorded forces have no room for, over that and what they vary by: the share of the
    /// forces that nobody recorded.
    pub(crate) unrecorded: f64,
}

/// Sizes of what is random: latent disturbances (Ornstein-Uhlenbeck), measurement noise, errors of the recorded inputs.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Randomness {
    /// Number of latent disturbances: those of the platform, and one for each winch.
    pub(crate) latents: usize,
    /// Standard deviation of the latent force on the platform (N); the torque's is `arm` times as large.
    pub(crate) force: f64,
    /// Standard deviation of the latent force at each winch (N).
    pub(crate) winch: f64,
    /// Mean size of the winch forces (N).
    pub(crate) usual_force: f64,
    /// Lever between force and torque (m).
    pub(crate) arm: f64,
    /// Correlation time of the latent disturbances (s).
    pub(crate) time: f64,
    /// White noise of each channel.
    pub(crate) noise: Vec<f64>,
    /// The least that it can be, and the most where nothing else is random in the instruments.
    pub(crate) least_noise: Vec<f64>,
    pub(crate) most_noise: Vec<f64>,
    /// Noise with memory, the channels in their order.
    pub(crate) memory: Vec<Memory>,
    /// White error of each recorded winch force (N), held from sample to sample.
    pub(crate) input: f64,
    /// What is left of it, where the forces are no longer those recorded but those to be expected.
    pub(crate) expected: Option<Expected>,
    /// Error of the time stamps (s).
    pub(crate) jitter: f64,
    /// How late each channel is against its stamp (s).
    pub(crate) late: Vec<f64>,
}

impl Randomness {
    /// Whether the latent disturbances are of the same size.
    pub(crate) fn same_latents(&self, other: &Self) -> bool {
        (self.force, self.winch) == (other.force, other.winch)
    }

    /// Whether all sizes are the same, also those of channels that are not measured.
    pub(crate) fn same(&self, other: &Self) -> bool {
        let measured =
            |own: &Self| Self { noise: Vec::new(), least_noise: Vec::new(), most_noise: Vec::new(), ..own.clone() };
        let alike = |a: &[f64], b: &[f64]| a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.total_cmp(b).is_eq());
        alike(&self.noise, &other.noise)
            && alike(&self.least_noise, &other.least_noise)
            && alike(&self.most_noise, &other.most_noise)
            && measured(self) == measured(other)
    }

    /// The size of latent force from which one is searched for (N).
    pub(crate) fn first_latent(usual_force: f64) -> f64 {
        FIRST_LATENT * usual_force
    }

    /// The size of latent force that is as good as none (N).
    pub(crate) fn smallest_latent(&self) -> f64 {
        SMALLEST_LATENT * self.usual_force
    }

    /// Whether latent disturbances have anything to do.
    pub(crate) fn has_latents(&self) -> bool {
        self.force.max(self.winch) > self.smallest_latent()
    }

    /// How many latent disturbances the filter estimates, the first of its processes: none where they have nothing to do, unless errors of
    /// forces act through them.
    pub(crate) fn estimated(&self) -> usize {
        if self.has_latents() || self.force_errors() > 0 { self.latents } else { 0 }
    }

    /// Power at low frequency of a latent disturbance over its variance, where it is held over intervals of this length (s): the
    /// variance of the white noise that stands for it.
    pub(crate) fn power(&self, interval: f64) -> f64 {
        let decay = (-f64::from(interval as f32) / self.time).exp();
        (1.0 + decay) / (1.0 - decay)
    }

    /// The same without latent disturbances.
    pub(crate) fn without_latents(&self) -> Self {
        let nothing = self.smallest_latent();
        Self { force: nothing, winch: nothing, ..self.clone() }
    }

    /// The same with all latent forces of a share of the size from which they are searched for.
    pub(crate) fn with_latents(&self, share: f64) -> Self {
        let size = self.considered(share * Self::first_latent(self.usual_force));
        Self { force: size, winch: size, ..self.clone() }
    }

    /// Whether the instruments add noise that is not white.
    pub(crate) fn has_instrument_noise(&self) -> bool {
        !self.memory.is_empty() || self.input > 0.0 || self.jitter > 0.0
    }

    /// The same with drifts that stay as they are.
    pub(crate) fn with_drifts_held(&self) -> Self {
        let mut held = self.clone();
        held.memory.iter_mut().filter(|memory| memory.drift).for_each(|memory| memory.time = f64::INFINITY);
        held
    }

    /// The same where it is known from what each recording counts.
    pub(crate) fn with_origins_known(&self) -> Self {
        let mut known = self.clone();
        known.memory.iter_mut().filter(|memory| memory.is_origin()).for_each(|memory| memory.deviation = 0.0);
        known
    }

    /// Whether an instrument drifts.
    pub(crate) fn drifts(&self) -> bool {
        self.memory.iter().any(|memory| memory.drift)
    }

    /// Whether a noise with memory outlasts the latent forces, as a drift does: then it can stand for what a law does to the motion.
    pub(crate) fn outlasts_latents(&self, memory: &Memory) -> bool {
        memory.drift || memory.time > self.time
    }

    /// The size of the latent force on the platform times a factor, within what is considered.
    pub(crate) fn force_scaled(&self, factor: f64) -> f64 {
        self.considered(self.force * factor)
    }

    /// The size of the latent forces at the winches times a factor, within what is considered.
    pub(crate) fn winch_scaled(&self, factor: f64) -> f64 {
        self.considered(self.winch * factor)
    }

    fn considered(&self, size: f64) -> f64 {
        let nothing = self.smallest_latent();
        if size < TOLD_FROM_NONE * nothing { nothing } else { size.min(LARGEST_LATENT * self.usual_force) }
    }

    /// The same with nothing but white noise from the instruments. Forces that are only to be expected keep what is left of
    /// their error.
    pub(crate) fn with_white_noise(&self) -> Self {
        let input = if self.expected.is_some() { self.input } else { 0.0 };
        Self { memory: Vec::new(), input, jitter: 0.0, ..self.clone() }.bounded()
    }

    /// The same with white noise within its bounds.
    pub(crate) fn bounded(mut self) -> Self {
        for at in 0..self.noise.len() {
            self.noise[at] = self.bounded_noise(at, self.noise[at]);
        }
        self
    }

    /// The size of white noise nearest to `size` that a channel can have.
    pub(crate) fn bounded_noise(&self, channel: usize, size: f64) -> f64 {
        let most = if self.has_instrument_noise() { f64::INFINITY } else { self.most_noise[channel] };
        size.min(most).max(self.least_noise[channel])
    }

    pub(crate) fn latent_deviation(&self, latent: usize) -> f64 {
        match latent {
            0 | 1 => self.force,
            2 => self.force * self.arm,
            _ => self.winch,
        }
    }

    /// What the filter estimates beside the states: latents, then noise with memory, then errors of forces.
    pub(crate) fn processes(&self) -> usize {
        self.estimated() + self.memory.len() + self.force_errors()
    }

    /// Parts of the errors of the winch forces that the filter estimates, the last of its processes: the first part of each
    /// winch, then the second, where they have memory; none where they are white.
    pub(crate) fn force_errors(&self) -> usize {
        if self.expected.is_some() && self.input > 0.0 { PARTS * self.winches() } else { 0 }
    }

    /// Winches, each with a latent force.
    pub(crate) fn winches(&self) -> usize {
        self.latents - WRENCH
    }

    /// Covariance of the two parts of the error of a winch force (N²).
    pub(crate) fn force_error_covariance(&self) -> f64 {
        self.expected.map_or(0.0, |expected| self.input.powi(2) * expected.covariance)
    }

    /// The pairs of processes that are correlated: the two parts of the error of each winch force.
    pub(crate) fn correlated(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let (processes, errors) = (self.processes(), self.force_errors());
        (processes - errors..processes - errors / PARTS).map(move |first| (first, first + errors / PARTS))
    }

    /// The part of the error of a winch force that a process is, if it is one that comes after the noise with memory.
    fn part(&self, at: usize) -> usize {
        (at - self.memory.len()) / self.winches()
    }

    /// White error of each winch force that the states are moved by (N). Once the forces are those to be expected it is no
    /// longer asked for: what is left of it has little that a model's error has not.
    pub(crate) fn white_input(&self) -> f64 {
        if self.expected.is_none() { self.input } else { 0.0 }
    }

    /// Stationary standard deviation of a process.
    pub(crate) fn deviation(&self, process: usize) -> f64 {
        match process.checked_sub(self.estimated()) {
            None => self.latent_deviation(process),
            Some(at) => match (self.memory.get(at), &self.expected) {
                (Some(memory), _) => memory.deviation,
                (None, Some(expected)) => self.input * expected.share[self.part(at)],
                (None, None) => 0.0,
            },
        }
    }

    /// What is left of each process after an interval (s), which is taken as a short number: stamps are rounded.
    #[inline]
    pub(crate) fn decays(&self, interval: f64, out: &mut [f64]) {
        let interval = f64::from(interval as f32);
        let (mut time, mut decay) = (f64::NAN, 0.0);
        for (process, slot) in out.iter_mut().enumerate() {
            let own = self.time_of(process);
            // Most have the time constant of their neighbour.
            if own != time {
                (time, decay) = (own, (-interval / own).exp());
            }
            *slot = decay;
        }
    }

    /// What is left of a process after an interval (s).
    pub(crate) fn decay(&self, process: usize, interval: f64) -> f64 {
        (-interval / self.time_of(process)).exp()
    }

    /// Time constant of a process (s).
    fn time_of(&self, process: usize) -> f64 {
        match process.checked_sub(self.estimated()) {
            None => self.time,
            Some(at) => match (self.memory.get(at), &self.expected) {
                (Some(memory), _) => memory.time,
                (None, Some(expected)) => expected.time[self.part(at)],
                (None, None) => 0.0,
            },
        }
    }

    /// The processes that each of so many channels shows beside the states.
    pub(crate) fn shown_by_channel(&self, channels: usize) -> Vec<std::ops::Range<usize>> {
        (0..channels)
            .map(|j| {
                let first = self.memory.partition_point(|m| m.channel < j);
                self.estimated() + first..self.estimated() + self.memory.partition_point(|m| m.channel <= j)
            })
            .collect()
    }

    /// The same with one more noise with memory.
    pub(crate) fn with_memory(mut self, memory: Memory) -> Self {
        let at = self.memory.partition_point(|m| m.channel <= memory.channel);
        self.memory.insert(at, memory);
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::recording::{fitted, record};

    /// From a hundredth above the least a search went nowhere, and latent forces stood where there are none.
    #[test]
    fn latent_forces_that_cannot_be_told_from_none_are_none() {
        let none = fitted(&[], &[record(&[], 10.0, 1)]).randomness.without_latents();
        assert!(!none.has_latents() && none.estimated() == 0 && none.processes() == 0);
        let times = |factor: f64| Randomness { force: none.force_scaled(factor), ..none.clone() };
        assert!(times(1.9).same(&none));
        assert_eq!((times(2.1).has_latents(), times(2.1).estimated()), (true, 7));
    }

    /// They were taken for exact where something explained all, and never had an error again.
    #[test]
    fn forces_that_are_only_to_be_expected_are_never_exact() {
        let recorded = fitted(&[], &[record(&[], 10.0, 1)]).randomness;
        let marred = Randomness { input: 20.0, jitter: 1e-3, ..recorded };
        assert_eq!(marred.with_white_noise().input, 0.0);
        let expected = Some(crate::instruments::expected::with_memory(0.25, 0.02));
        let plain = Randomness { expected, ..marred }.with_white_noise();
        assert_eq!((plain.input, plain.force_errors(), plain.jitter), (20.0, 8, 0.0));
    }

    /// Noise that jitter had let grow stayed when the jitter was left out, was cut afterwards, and the data were less likely by
    /// 1800 than before a step that seemed to make them likelier.
    #[test]
    fn white_noise_alone_is_no_more_than_differences_see() {
        let recorded = fitted(&[], &[record(&[], 10.0, 1)]).randomness;
        let noise: Vec<f64> = recorded.noise.iter().map(|noise| 8.0 * noise).collect();
        let marred = Randomness { noise, jitter: 1e-3, ..recorded };
        let measured = |randomness: &Randomness| randomness.noise[0] / marred.most_noise[0];
        assert!(measured(&marred.clone().bounded()) > 5.0);
        assert_eq!(measured(&marred.with_white_noise()), 1.0);
    }
}
