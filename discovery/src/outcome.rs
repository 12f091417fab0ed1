//! What a discovery found: the engine's result, from which `discovery.json`, the report and the tables are made.

use cdpr::effect::{DependsOn, EffectSpec, Place};
use cdpr::model_file::Model;
use cdpr::per_cable::PerCable;

use crate::data::device::Device;
use crate::data::{Channel, Trial};
use crate::journal::Entry;
use crate::model::examined::WRENCH;
use crate::report;

/// The outcome in one word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The model reproduces the data as well as the noise allows.
    NoMissingEffect,
    /// Every effect found is in the catalogue, and what remains is white and near the noise.
    Named,
    /// Two or more explanations differ by less than the evidence can tell.
    Ambiguous,
    /// Effects of the catalogue explain most of the gap, and more than the noise is left; see [`Remaining`].
    PartlyNamed,
    /// Part of the gap needs terms outside the catalogue, or cannot be explained at all.
    Unnamed,
}

/// A place where the model disagrees with the measurements.
#[derive(Clone, Debug, PartialEq)]
pub struct Located {
    /// Of one cable, where it belongs to a cable.
    pub place: Place,
    /// Share of the explained gap, 0 to 1.
    pub share: f64,
    /// Stretches `(trial, start, end)` (s) in which it shows; trials count through the training trials.
    pub when: Vec<(usize, f64, f64)>,
    /// What the disagreement depends on.
    pub depends_on: Vec<DependsOn>,
}

/// An effect or term that was added to the model.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// The effect with its estimated parameters.
    pub effect: EffectSpec,
    /// The same as the model as given has it, with other numbers; `None` where it lacks it.
    pub given: Option<EffectSpec>,
    /// Whether it may be called what is missing: its size is known, its shape is that of its law, and it takes away a part
    /// of the gap that can be seen. Others are candidates: in the model, and no causes.
    pub named: bool,
    /// Standard error of each parameter; `None` where the data do not determine it.
    pub standard_error: Vec<Option<f64>>,
    /// When it begins and ends.
    pub onset: Onset,
    /// Bayesian information criterion with it minus without it.
    pub delta_bic: f64,
    /// Gap on held-out data over the main horizon with everything found but this.
    pub holdout_gap_without: Option<f64>,
    /// Explanations nearly as good, the nearest first.
    pub alternatives: Vec<Alternative>,
    /// What chance did beside it when it came in; `None` where the data are too short to tell.
    pub null_test: Option<NullTest>,
    /// Its size in blocks of time; `None` where the data have no room for two.
    pub stability: Option<Stability>,
}

/// An error of the survey, found together with the laws or before them: where an anchor or an attachment is, or what a length counts from.
#[derive(Clone, Debug)]
pub struct SurveyError {
    /// The error, as an effect.
    pub effect: EffectSpec,
    /// Standard error of each parameter; `None` where the data do not determine it.
    pub standard_error: Vec<Option<f64>>,
}

/// When an effect begins and ends (s, on the clock of each trial); `None` where it was there before, or stays.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Onset {
    /// When it begins.
    pub from: Option<Estimated>,
    /// When it ends.
    pub until: Option<Estimated>,
}

/// The weighing of all candidates repeated against innovations shifted in time and frequency, where only chance can explain
/// anything. A gain is the fall of the information criterion by the best candidate, its penalty taken off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NullTest {
    /// Number of shifts.
    pub shifts: usize,
    /// Gain without a shift; of an effect that came in, how far the criterion rises without it.
    pub found: f64,
    /// Shifts with a gain as large.
    pub as_strong: usize,
    /// Shifts with a gain that the search would have followed.
    pub over_threshold: usize,
    /// Largest gain by chance.
    pub largest: f64,
}

/// The size of an effect in blocks of time.
#[derive(Clone, Debug, PartialEq)]
pub struct Stability {
    /// The blocks that say something of it.
    pub blocks: Vec<Block>,
    /// Sum of squares of the deviations from a common size, weighted: chi-square if the size is constant.
    pub chi_square: f64,
    /// Its degrees of freedom.
    pub degrees: usize,
    /// Probability of a larger one if the size is constant.
    pub p_value: f64,
    /// By how much the size differs from block to block beyond what its errors explain: a standard deviation, in
    /// multiples of the size.
    pub spread: f64,
}

impl Stability {
    /// Whether the size differs from block to block, by chance once in a thousand times and by an amount that matters.
    pub fn varies(&self) -> bool {
        self.p_value < UNLIKELY && self.spread > TOLERATED_SPREAD
    }
}

/// Probability below which a size that varies is not left to chance.
const UNLIKELY: f64 = 1e-3;

/// Spread of the size over the blocks that is of no practical weight.
const TOLERATED_SPREAD: f64 = 0.03;

/// The size of an effect in one block of time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Block {
    /// The trial, counted through the training trials.
    pub trial: usize,
    /// Start (s).
    pub start: f64,
    /// End (s).
    pub end: f64,
    /// Size in multiples of the size over all data.
    pub size: f64,
    /// Its standard error.
    pub standard_error: f64,
}

/// Another explanation of the same disagreement.
#[derive(Clone, Debug, PartialEq)]
pub struct Alternative {
    /// The effect with the parameters it would have.
    pub effect: EffectSpec,
    /// BIC with it in place of the chosen one, minus BIC with the chosen one: of the training data, or where it is far off,
    /// of their beginnings alone.
    pub delta_bic: f64,
    /// Correlation of the whitened signatures.
    pub correlation: Option<f64>,
    /// Whether the evidence cannot tell the two apart.
    pub indistinguishable: bool,
    /// The experiment that would.
    pub separate_by: String,
}

/// A pair of gaps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BeforeAfter {
    /// With the model as given.
    pub before: f64,
    /// With what was found.
    pub after: f64,
}

/// Gaps over one horizon.
#[derive(Clone, Debug, PartialEq)]
pub struct HorizonGap {
    /// Time between restarts (s).
    pub horizon: f64,
    /// On training data, all channels.
    pub train: BeforeAfter,
    /// On held-out data, all channels.
    pub holdout: BeforeAfter,
    /// What a model without fault would leave on held-out data: how the error of a run's start grows.
    pub attainable: f64,
    /// Standard error of the change of the squared gap on held-out data, as a share of what it was before.
    pub scatter: f64,
    /// Whether what is attainable is near enough to the noise for the gap to say something of the model.
    pub judged: bool,
    /// By channel: training and held-out data.
    pub channels: Vec<(Channel, BeforeAfter, Option<BeforeAfter>)>,
}

/// What is left on held-out data over one horizon.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Remaining {
    /// Time between restarts of the free runs, and of each stretch over which forces are averaged (s).
    pub horizon: f64,
    /// By how much free runs miss x and y, without the noise: root mean square (m). `None` where neither is measured.
    pub position: Option<f64>,
    /// The same of φ (rad).
    pub rotation: Option<f64>,
    /// The same of the lengths (m).
    pub length: Option<f64>,
    /// Force on the platform that the model needs beyond its own, a mean over each stretch: root mean square (N).
    pub force: f64,
    /// The same of the torque (N m).
    pub torque: f64,
}

/// Whiteness of the innovations of one channel with the final model.
#[derive(Clone, Debug, PartialEq)]
pub struct Whiteness {
    /// The channel.
    pub channel: Channel,
    /// Estimated noise (in the channel's unit).
    pub noise: f64,
    /// Samples used.
    pub samples: usize,
    /// Ljung-Box statistic over 20 lags.
    pub statistic: f64,
    /// Its limit.
    pub limit: f64,
}

/// A size with its standard error, `None` where the data do not determine it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimated {
    /// The size.
    pub value: f64,
    /// Its standard error.
    pub standard_error: Option<f64>,
}

/// What one measured channel adds to the truth, in its unit; what the data do not ask for is absent.
#[derive(Clone, Debug, PartialEq)]
pub struct ChannelInstrument {
    /// The channel.
    pub channel: Channel,
    /// Standard deviation of its white noise.
    pub white: f64,
    /// Standard deviation of its noise with memory (Gauss-Markov, first order).
    pub coloured: Option<Estimated>,
    /// Time constant of that (s).
    pub time_constant: Option<Estimated>,
    /// Standard deviation of its drift over the recordings.
    pub drift: Option<Estimated>,
    /// Standard deviation of what it counts from, from recording to recording.
    pub origin: Option<Estimated>,
    /// How late it is against the recorded inputs (s).
    pub delay: Option<Estimated>,
    /// Its resolution: the step of which all readings are multiples.
    pub resolution: Option<f64>,
}

/// What the instruments add to the recordings.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Instruments {
    /// By channel.
    pub channels: Vec<ChannelInstrument>,
    /// How late the recorded winch forces are against those that act (s).
    pub late_forces: Option<Estimated>,
    /// Over how long recording smooths them, as a filter does: the standard deviation of its response to an impulse (s).
    pub smoothed_forces: Option<Estimated>,
    /// By which share the clock of the stamps is slow: how much longer everything takes than they say.
    pub slow_clock: Option<Estimated>,
    /// White error of each recorded winch force (N).
    pub winch_force: Option<Estimated>,
    /// Jitter of the time stamps (s).
    pub stamps: Option<Estimated>,
}

impl Instruments {
    /// The delays, one for each device: its channels share a clock.
    pub fn clocks(&self) -> Vec<(String, Estimated)> {
        let mut out: Vec<(String, Estimated)> = Vec::new();
        for c in &self.channels {
            let device = Device::of(c.channel).name().to_owned();
            if let Some(delay) = c.delay.filter(|_| out.iter().all(|(known, _)| *known != device)) {
                out.push((device, delay));
            }
        }
        out
    }

    /// What a reader should know before any cause, a sentence each.
    pub(crate) fn remarks(&self) -> Vec<String> {
        let with = |size: &Estimated, scale: f64| {
            report::with_error(scale * size.value, size.standard_error.map(|error| scale * error))
        };
        let clocks = self.clocks().into_iter().map(|(device, delay)| {
            let way = if delay.value > 0.0 { "lags" } else { "leads" };
            let size = Estimated { value: delay.value.abs(), ..delay };
            let forces = if self.late_forces.is_some() { "forces that act" } else { "recorded forces" };
            format!("{device} {way} the {forces} by {} ms.", with(&size, 1e3))
        });
        let late_forces = self
            .late_forces
            .iter()
            .map(|size| format!("The recorded winch forces lag what is measured by {} ms.", with(size, 1e3)));
        let smoothed = self.smoothed_forces.iter().map(|size| {
            format!(
                "They are smoothed over {} ms (standard deviation of the response to an impulse), as behind a filter.",
                with(size, 1e3)
            )
        });
        let slow_clock = self.slow_clock.iter().map(|size| {
            let way = if size.value > 0.0 { "slow" } else { "fast" };
            let size = Estimated { value: size.value.abs(), ..*size };
            format!("The clock of the time stamps is {way} by {} %.", with(&size, 100.0))
        });
        let force = self.winch_force.iter();
        let force = force.map(|size| format!("The recorded winch forces have a white error of {} N.", with(size, 1.0)));
        let stamps = self.stamps.iter().map(|size| format!("The time stamps jitter by {} ms.", with(size, 1e3)));
        let of_channels = |what: &str, size: fn(&ChannelInstrument) -> Option<&Estimated>| {
            let of_channel = |c: &ChannelInstrument| {
                let (scale, unit) = c.channel.small_unit();
                let name = report::channel_words(&c.channel.name()).replace('\u{a0}', " ");
                Some(format!("{name} {} {unit}", with(size(c)?, scale)))
            };
            let sizes: Vec<String> = self.channels.iter().filter_map(of_channel).collect();
            (!sizes.is_empty()).then(|| format!("{what}: {}.", sizes.join(", ")))
        };
        let drifts = of_channels("Measurements drift over a recording, or count from another zero in each", |c| {
            c.drift.as_ref()
        });
        let origins = of_channels("Measurements count from another zero in each recording (standard deviation)", |c| {
            c.origin.as_ref()
        });
        clocks
            .chain(drifts)
            .chain(origins)
            .chain(late_forces)
            .chain(smoothed)
            .chain(slow_clock)
            .chain(force)
            .chain(stamps)
            .collect()
    }
}

/// One trial with predictions, for pictures and `gap.csv`.
#[derive(Clone, Debug)]
pub struct Compared {
    /// The measurements (outliers taken out).
    pub trial: Trial,
    /// Whether it was held out.
    pub holdout: bool,
    /// Free-running predictions over the main horizon by the model as given, a row a sample.
    pub before: Vec<Vec<f64>>,
    /// By the model with what was found.
    pub after: Vec<Vec<f64>>,
    /// Samples at which the simulation restarts.
    pub restarts: Vec<usize>,
    /// How far a model without fault would be from the measurements of each channel of the trial, in its unit (root mean
    /// square): its noise, and what the instruments have beside it.
    pub expected: Vec<f64>,
    /// Smoothed latent disturbances with the model as given.
    pub latents: Vec<Latents>,
    /// Smoothed pose and twist with the final model.
    pub motion: Vec<[f64; 6]>,
    /// Smoothed rates of the unstretched lengths with the final model (m/s).
    pub winch_speed: Vec<PerCable<f64>>,
}

/// Latent disturbances at one time: what the model misses there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Latents {
    /// Force x, y (N) and torque (N m) on the platform.
    pub wrench: [f64; 3],
    /// Pull at each winch (N).
    pub pull: PerCable<f64>,
}

impl Latents {
    /// From numbers in the order of the filter: the wrench, then the pulls.
    pub(crate) fn of(values: &[f64]) -> Self {
        let (wrench, pulls) = values.split_at(WRENCH);
        Self {
            wrench: std::array::from_fn(|axis| wrench[axis]),
            pull: PerCable::from_fn(pulls.len(), |cable| pulls[cable]),
        }
    }
}

/// The smallest size of an effect that the data would have shown.
#[derive(Clone, Debug, PartialEq)]
pub struct DetectionLimit {
    /// The effect as it was examined: where it acts, and its shape. Its size is the one at which its signature was taken.
    pub effect: EffectSpec,
    /// The parameter that is its size; of a vector the names of its parts.
    pub parameter: String,
    /// The unit of that.
    pub unit: &'static str,
    /// The size from which it would have been found in 99 of 100 repetitions; `None` where the data show nothing of it.
    pub size: Option<f64>,
    /// Whether it shows up to this size rather than from it on: a stiffness in series, an upper limit.
    pub at_most: bool,
    /// Whether it shows at a size that such a robot may have.
    pub excited: bool,
    /// Which of its parameters are the shape for which the size holds.
    pub shape: Vec<usize>,
}

/// The result of a discovery.
#[derive(Clone, Debug)]
pub struct Discovery {
    /// The outcome.
    pub verdict: Verdict,
    /// The model as given.
    pub base: Model,
    /// The model with what was found.
    pub model: Model,
    /// Information criterion of the final model on the training data: `-2 log L` and what its parameters cost.
    pub criterion: f64,
    /// Errors of its geometry, where they explain most of what is left without them, or where recordings cannot be read without them; `base` has
    /// them.
    pub survey: Vec<SurveyError>,
    /// Whether a few of these, each as a law, may do in the place of all.
    pub(crate) few_errors: bool,
    /// Catalogue effects found, the most important first.
    pub effects: Vec<Found>,
    /// Effects that the model as given has and `model` does not: the data show nothing of them.
    pub not_shown: Vec<EffectSpec>,
    /// Whether the search left something undone because its time was over.
    pub ended_early: bool,
    /// What is to be said where nothing explains the gap, but something changed between training and held-out data: a sentence.
    pub changed: Option<String>,
    /// Terms outside the catalogue (`expression` effects).
    pub terms: Vec<Found>,
    /// Where the model as given disagrees.
    pub located: Vec<Located>,
    /// Gaps over the horizons 1, 5 and 20 s, and over the main one if that is another.
    pub horizons: Vec<HorizonGap>,
    /// The main horizon (s): 5 s, or the longest below it over which the growth of errors lets a free run be judged.
    pub horizon: f64,
    /// What is left over 1, 5 and 20 s.
    pub remaining: Vec<Remaining>,
    /// What was held out, as a noun phrase.
    pub holdout_source: String,
    /// Whiteness by channel.
    pub whiteness: Vec<Whiteness>,
    /// What the instruments add, with the final model.
    pub instruments: Instruments,
    /// Root mean square of the latent force (N) and torque (N m), before and after.
    pub remainder_force: BeforeAfter,
    /// See `remainder_force`.
    pub remainder_torque: BeforeAfter,
    /// The trials with predictions.
    pub trials: Vec<Compared>,
    /// What chance did in the last weighing, after which nothing more was taken up.
    pub null_test: Option<NullTest>,
    /// Different explanations that were weighed, in all rounds together.
    pub candidates: usize,
    /// Outliers taken out.
    pub outliers: usize,
    /// The search as it went.
    pub journal: Vec<Entry>,
    /// What the data would have shown of every other law of the catalogue.
    pub detection_limits: Vec<DetectionLimit>,
    /// Remarks, each a sentence.
    pub remarks: Vec<String>,
    /// Computing time (s).
    pub seconds: f64,
}

impl Discovery {
    /// Whether the data show nothing of any law that needs motion, friction and drag; then nothing clears the machine of them.
    pub fn at_rest(&self) -> bool {
        at_rest(&self.detection_limits)
    }
}

pub(crate) fn at_rest(limits: &[DetectionLimit]) -> bool {
    let of_motion = |on: &DependsOn| matches!(on, DependsOn::Speed | DependsOn::Direction);
    let needs_motion =
        |limit: &&DetectionLimit| limit.effect.depends_on().is_ok_and(|on| !on.is_empty() && on.iter().all(of_motion));
    let mut laws = limits.iter().filter(needs_motion).peekable();
    laws.peek().is_some() && laws.all(|limit| !limit.excited)
}

/// The main horizon (s), unless errors grow too fast for it.
pub const HORIZON: f64 = 5.0;

/// Horizons of the verification (s).
pub const HORIZONS: [f64; 3] = [1.0, HORIZON, 20.0];

#[cfg(test)]
mod tests {
    use super::*;

    /// Stamps of a small robot came out as "0.111 ± 0.00 ms".
    #[test]
    fn instruments_are_said_to_the_second_digit_of_their_error() {
        let stamps = Some(Estimated { value: 1.110_4e-4, standard_error: Some(4.5e-6) });
        let winch_force = Some(Estimated { value: 21.36, standard_error: None });
        let late_forces = Some(Estimated { value: 0.0401, standard_error: Some(4e-4) });
        let smoothed_forces = Some(Estimated { value: 0.02, standard_error: Some(1e-3) });
        let channels = Vec::new();
        let slow_clock = Some(Estimated { value: -2e-3, standard_error: Some(1e-5) });
        let said = Instruments { channels, late_forces, smoothed_forces, slow_clock, winch_force, stamps }.remarks();
        assert_eq!(
            said,
            [
                "The recorded winch forces lag what is measured by 40.10 ± 0.40 ms.",
                "They are smoothed over 20.0 ± 1.0 ms (standard deviation of the response to an impulse), as behind a filter.",
                "The clock of the time stamps is fast by 0.2000 ± 0.0010 %.",
                "The recorded winch forces have a white error of 21.36 N.",
                "The time stamps jitter by 0.1110 ± 0.0045 ms."
            ]
        );
    }

    /// An encoder that slipped by 3 cm was taken for a drift, and nobody told.
    #[test]
    fn drifts_are_said_each_with_its_size() {
        let drifting = |channel: Channel, size: f64| ChannelInstrument {
            channel,
            white: 1e-3,
            coloured: None,
            time_constant: None,
            drift: (size > 0.0).then_some(Estimated { value: size, standard_error: Some(0.05 * size) }),
            origin: (size < 0.0).then_some(Estimated { value: -size, standard_error: None }),
            delay: None,
            resolution: None,
        };
        let of = |sizes: [f64; 2]| {
            let channels =
                vec![drifting(Channel::Pose(2), sizes[0]), drifting(Channel::UnstretchedLength(1), sizes[1])];
            Instruments { channels, ..Instruments::default() }.remarks()
        };
        assert_eq!(of([0.0, 0.0]), Vec::<String>::new());
        let said = "Measurements drift over a recording, or count from another zero in each: \
                    rotation φ 2.00 ± 0.10 mrad, unstretched length 2 14.00 ± 0.70 mm.";
        assert_eq!(of([2e-3, 14e-3]), [said]);
        let said = "Measurements count from another zero in each recording (standard deviation): unstretched length 2 14.00 mm.";
        assert_eq!(of([0.0, -14e-3]), [said]);
    }
}
