//! `discovery.json`.
//!
//! The keys are a contract (schema 1): keys may be added, those here keep their names and meaning. A number that does
//! not exist is `null`. A place is written the same wherever it stands, that of an anchor or an attachment as its cable.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::data::Channel;
use crate::journal::Entry;
use crate::outcome::{ChannelInstrument, Compared, Discovery, Found, Instruments, Located, Remaining, Verdict};

use super::detection::{LimitEntry, cannot_tell, limit};
use super::effect::{
    EffectEntry, EstimatedEntry, GivenEntry, NullTestEntry, TermEntry, effect, given, key, key_of, null_test, survey,
    term,
};
use super::trials::{all_channels, training_trials};

#[derive(Serialize)]
struct Document<'a> {
    schema: u32,
    verdict: &'static str,
    located: Vec<LocatedEntry>,
    /// Those that carry their name.
    effects: Vec<EffectEntry<'a>>,
    /// Effects of the model that explain a part and carry no name: no causes.
    candidates: Vec<EffectEntry<'a>>,
    /// Effects of the model as given of which the data show nothing: they were taken out.
    not_shown: Vec<GivenEntry<'a>>,
    /// Whether the search left something undone because its time was over.
    ended_early: bool,
    /// What changed between training and held-out data, where nothing explains the gap.
    changed: Option<&'a str>,
    terms: Vec<TermEntry<'a>>,
    /// Errors of the geometry that were found together with these; none where the geometry as given does.
    calibration: Vec<GivenEntry<'a>>,
    gap: GapEntry<'a>,
    remaining: Vec<RemainingEntry>,
    remainder: RemainderEntry,
    channels: BTreeMap<String, ChannelEntry>,
    instruments: InstrumentsEntry,
    detection_limits: Vec<LimitEntry<'a>>,
    /// Ids of the laws of which the data show nothing.
    cannot_tell: Vec<&'a str>,
    /// Whether they show nothing of any law that needs motion: no verdict clears the machine then.
    at_rest: bool,
    trials: Vec<TrialEntry<'a>>,
    search: SearchEntry,
    /// Each step of the search.
    journal: Vec<JournalEntry<'a>>,
    remarks: &'a [String],
}

/// What the instruments add to the recordings; what the data do not ask for is `null`.
#[derive(Serialize)]
struct InstrumentsEntry {
    channels: BTreeMap<String, InstrumentEntry>,
    /// How late the recorded winch forces are against those that act (s).
    winch_force_delay: Option<EstimatedEntry>,
    /// Standard deviation of the response to an impulse by which recording smooths them (s).
    winch_force_smoothing: Option<EstimatedEntry>,
    /// By which share the clock of the stamps is slow.
    slow_clock: Option<EstimatedEntry>,
    /// White error of each recorded winch force (N).
    winch_force_error: Option<EstimatedEntry>,
    /// Jitter of the time stamps (s).
    stamp_jitter: Option<EstimatedEntry>,
}

/// Sizes in the channel's unit, times in s.
#[derive(Serialize)]
struct InstrumentEntry {
    white: f64,
    coloured: Option<EstimatedEntry>,
    time_constant: Option<EstimatedEntry>,
    drift: Option<EstimatedEntry>,
    /// From recording to recording.
    origin: Option<EstimatedEntry>,
    /// Against the recorded inputs.
    delay: Option<EstimatedEntry>,
    resolution: Option<f64>,
}

fn instruments(instruments: &Instruments) -> InstrumentsEntry {
    let channel = |c: &ChannelInstrument| InstrumentEntry {
        white: c.white,
        coloured: c.coloured.map(Into::into),
        time_constant: c.time_constant.map(Into::into),
        drift: c.drift.map(Into::into),
        origin: c.origin.map(Into::into),
        delay: c.delay.map(Into::into),
        resolution: c.resolution,
    };
    InstrumentsEntry {
        channels: instruments.channels.iter().map(|c| (c.channel.name(), channel(c))).collect(),
        winch_force_delay: instruments.late_forces.map(Into::into),
        winch_force_smoothing: instruments.smoothed_forces.map(Into::into),
        slow_clock: instruments.slow_clock.map(Into::into),
        winch_force_error: instruments.winch_force.map(Into::into),
        stamp_jitter: instruments.stamps.map(Into::into),
    }
}

#[derive(Serialize)]
struct LocatedEntry {
    #[serde(rename = "where")]
    place: String,
    share_of_gap: f64,
    /// Stretches of time (s); none where it shows all the time.
    when: Vec<[f64; 2]>,
    /// The trial of each stretch, an index into `trials`.
    when_in: Vec<usize>,
    depends_on: Vec<&'static str>,
}

#[derive(Serialize)]
struct Pair {
    before: f64,
    after: f64,
}

impl From<crate::outcome::BeforeAfter> for Pair {
    fn from(pair: crate::outcome::BeforeAfter) -> Self {
        Self { before: pair.before, after: pair.after }
    }
}

#[derive(Serialize)]
struct GapEntry<'a> {
    horizon_s: f64,
    train: Option<Pair>,
    holdout: Option<Pair>,
    holdout_source: &'a str,
    /// On held-out data; on the data fitted for a channel that the held-out data lack.
    channels: BTreeMap<String, Pair>,
    /// The same over other horizons.
    horizons: Vec<HorizonEntry>,
}

#[derive(Serialize)]
struct HorizonEntry {
    horizon_s: f64,
    train: Pair,
    holdout: Pair,
    /// What a model without fault would leave on held-out data.
    attainable: f64,
    /// Whether that is near enough to the noise for the verdict to count this horizon.
    judged: bool,
}

/// What is left on held-out data: by how much free runs miss, without the noise, and the mean force that the model lacks.
#[derive(Serialize)]
struct RemainingEntry {
    horizon_s: f64,
    /// Of x and y.
    position_mm: Option<f64>,
    rotation_mrad: Option<f64>,
    /// Of the cables' lengths.
    length_mm: Option<f64>,
    #[serde(rename = "force_N")]
    force: f64,
    #[serde(rename = "torque_Nm")]
    torque: f64,
}

#[derive(Serialize)]
struct RemainderEntry {
    /// Root mean square of the latent force on the platform (N).
    force: Pair,
    /// The same for the torque (N m).
    torque: Pair,
}

#[derive(Serialize)]
struct ChannelEntry {
    unit: &'static str,
    noise: Option<f64>,
    samples: Option<usize>,
    /// Ljung-Box statistic of the innovations with the final model, and its limit.
    whiteness: Option<WhitenessEntry>,
}

#[derive(Serialize)]
struct WhitenessEntry {
    statistic: f64,
    limit: f64,
    pass: bool,
}

#[derive(Serialize)]
struct TrialEntry<'a> {
    name: &'a str,
    holdout: bool,
    samples: usize,
}

#[derive(Serialize)]
struct SearchEntry {
    candidates: usize,
    outliers: usize,
    seconds: f64,
    /// Of the last weighing, after which nothing more was taken up.
    null_test: Option<NullTestEntry>,
}

#[derive(Serialize)]
struct JournalEntry<'a> {
    id: Option<&'a str>,
    cable: Option<usize>,
    #[serde(rename = "where")]
    place: String,
    outcome: &'static str,
    delta_bic: Option<f64>,
    reason: &'a str,
}

/// The text of `discovery.json`.
///
/// # Errors
/// Not for any discovery: every part of it has a place in JSON.
pub fn discovery_json<'a>(discovery: &'a Discovery) -> Result<String, serde_json::Error> {
    let (effects, candidates): (Vec<&Found>, Vec<&Found>) = discovery.effects.iter().partition(|found| found.named);
    let entries = |found: Vec<&'a Found>| found.into_iter().map(|found| effect(found, &discovery.trials)).collect();
    let document = Document {
        schema: 1,
        verdict: verdict(discovery.verdict),
        located: discovery.located.iter().map(|l| located(l, &discovery.trials)).collect(),
        effects: entries(effects),
        candidates: entries(candidates),
        not_shown: discovery.not_shown.iter().map(given).collect(),
        ended_early: discovery.ended_early,
        changed: discovery.changed.as_deref(),
        terms: discovery.terms.iter().map(|found| term(found, &discovery.trials)).collect(),
        calibration: discovery.survey.iter().map(survey).collect(),
        gap: gap(discovery),
        remaining: discovery.remaining.iter().map(remaining).collect(),
        remainder: RemainderEntry {
            force: discovery.remainder_force.into(),
            torque: discovery.remainder_torque.into(),
        },
        channels: all_channels(discovery).into_iter().map(|c| (c.name(), channel(c, discovery))).collect(),
        instruments: instruments(&discovery.instruments),
        detection_limits: discovery.detection_limits.iter().map(limit).collect(),
        cannot_tell: cannot_tell(&discovery.detection_limits),
        at_rest: discovery.at_rest(),
        trials: discovery
            .trials
            .iter()
            .map(|t| TrialEntry { name: &t.trial.name, holdout: t.holdout, samples: t.trial.len() })
            .collect(),
        search: SearchEntry {
            candidates: discovery.candidates,
            outliers: discovery.outliers,
            seconds: discovery.seconds,
            null_test: discovery.null_test.as_ref().map(null_test),
        },
        journal: discovery.journal.iter().map(journal_entry).collect(),
        remarks: &discovery.remarks,
    };
    let mut text = serde_json::to_string_pretty(&document)?;
    text.push('\n');
    Ok(text)
}

/// The verdict as in `discovery.json`.
pub(super) fn verdict(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::NoMissingEffect => "no_missing_effect",
        Verdict::Named => "named",
        Verdict::Ambiguous => "ambiguous",
        Verdict::PartlyNamed => "partly_named",
        Verdict::Unnamed => "unnamed",
    }
}

fn located(located: &Located, trials: &[Compared]) -> LocatedEntry {
    let training = training_trials(trials);
    let known: Vec<_> = located.when.iter().filter_map(|w| Some((*training.get(w.0)?, [w.1, w.2]))).collect();
    LocatedEntry {
        place: key(&located.place),
        share_of_gap: located.share,
        when: known.iter().map(|(_, span)| *span).collect(),
        when_in: known.iter().map(|(trial, _)| *trial).collect(),
        depends_on: located.depends_on.iter().map(|on| on.name()).collect(),
    }
}

fn gap(discovery: &Discovery) -> GapEntry<'_> {
    let main = discovery.horizons.iter().find(|h| h.horizon == discovery.horizon);
    let channels = main.map_or(&[][..], |h| &h.channels);
    GapEntry {
        horizon_s: discovery.horizon,
        train: main.map(|h| h.train.into()),
        holdout: main.map(|h| h.holdout.into()),
        holdout_source: &discovery.holdout_source,
        channels: channels.iter().map(|(c, train, held_out)| (c.name(), held_out.unwrap_or(*train).into())).collect(),
        horizons: discovery
            .horizons
            .iter()
            .map(|h| HorizonEntry {
                horizon_s: h.horizon,
                train: h.train.into(),
                holdout: h.holdout.into(),
                attainable: h.attainable,
                judged: h.judged,
            })
            .collect(),
    }
}

fn remaining(left: &Remaining) -> RemainingEntry {
    let thousandths = |value: Option<f64>| value.map(|v| 1e3 * v);
    RemainingEntry {
        horizon_s: left.horizon,
        position_mm: thousandths(left.position),
        rotation_mrad: thousandths(left.rotation),
        length_mm: thousandths(left.length),
        force: left.force,
        torque: left.torque,
    }
}

fn channel(channel: Channel, discovery: &Discovery) -> ChannelEntry {
    let test = discovery.whiteness.iter().find(|w| w.channel == channel);
    ChannelEntry {
        unit: channel.unit(),
        noise: test.map(|w| w.noise),
        samples: test.map(|w| w.samples),
        whiteness: test.map(|w| WhitenessEntry {
            statistic: w.statistic,
            limit: w.limit,
            pass: w.statistic <= w.limit,
        }),
    }
}

fn journal_entry(entry: &Entry) -> JournalEntry<'_> {
    let effect = entry.effect.as_ref();
    JournalEntry {
        id: effect.map(|effect| effect.id.as_str()),
        cable: effect.and_then(|effect| effect.cable),
        place: effect.map_or_else(|| entry.about().to_owned(), key_of),
        outcome: entry.outcome.name(),
        delta_bic: entry.delta_bic,
        reason: &entry.reason,
    }
}
