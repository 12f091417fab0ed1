//! `discovery.json`.
//!
//! The keys are a contract (schema 1): keys may be added, those here keep their names and meaning. A number that does
//! not exist is `null`. A place is written the same wherever it stands, that of an anchor or an attachment as its cable.

use std::collections::BTreeMap;

use cdpr::effect::{EffectSpec, Place};
use serde::Serialize;

use crate::data::Channel;
use crate::journal::Entry;
use crate::outcome::{
    Alternative, Block, ChannelInstrument, Compared, Discovery, Estimated, Found, Instruments, Located, NullTest,
    Onset, Remaining, Stability, SurveyError, Verdict,
};

use super::detection::{LimitEntry, cannot_tell, limit};
use super::label::place;
use super::trials::{all_channels, training_trials};

#[derive(Serialize)]
struct Document<'a> {
    schema: u32,
    verdict: &'static str,
    located: Vec<LocatedEntry>,
    effects: Vec<EffectEntry<'a>>,
    terms: Vec<TermEntry<'a>>,
    /// Errors of the geometry that were found together with these; none where the geometry as given does.
    calibration: Vec<SurveyEntry<'a>>,
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
    /// Against the recorded inputs.
    delay: Option<EstimatedEntry>,
    resolution: Option<f64>,
}

#[derive(Serialize)]
struct EstimatedEntry {
    value: f64,
    standard_error: Option<f64>,
}

/// When an effect begins and ends (s); `null` where it was there before, or stays.
#[derive(Serialize)]
struct OnsetEntry {
    from: Option<EstimatedEntry>,
    until: Option<EstimatedEntry>,
}

fn onset(onset: Onset) -> Option<OnsetEntry> {
    let Onset { from, until } = onset;
    (from.is_some() || until.is_some()).then(|| OnsetEntry { from: from.map(Into::into), until: until.map(Into::into) })
}

impl From<Estimated> for EstimatedEntry {
    fn from(size: Estimated) -> Self {
        Self { value: size.value, standard_error: size.standard_error }
    }
}

fn instruments(instruments: &Instruments) -> InstrumentsEntry {
    let channel = |c: &ChannelInstrument| InstrumentEntry {
        white: c.white,
        coloured: c.coloured.map(Into::into),
        time_constant: c.time_constant.map(Into::into),
        drift: c.drift.map(Into::into),
        delay: c.delay.map(Into::into),
        resolution: c.resolution,
    };
    InstrumentsEntry {
        channels: instruments.channels.iter().map(|c| (c.channel.name(), channel(c))).collect(),
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
struct ParameterEntry {
    value: f64,
    standard_error: Option<f64>,
    unit: &'static str,
}

#[derive(Serialize)]
struct SurveyEntry<'a> {
    id: &'a str,
    cable: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    channel: Option<&'a str>,
    parameters: BTreeMap<&'static str, ParameterEntry>,
}

#[derive(Serialize)]
struct EffectEntry<'a> {
    id: &'a str,
    cable: Option<usize>,
    /// The sensor, where the effect has several to choose from.
    #[serde(skip_serializing_if = "Option::is_none")]
    channel: Option<&'a str>,
    #[serde(rename = "where")]
    place: String,
    parameters: BTreeMap<&'static str, ParameterEntry>,
    /// Where it begins or ends.
    #[serde(skip_serializing_if = "Option::is_none")]
    onset: Option<OnsetEntry>,
    /// Whether it may be called what is missing.
    named: bool,
    delta_bic: f64,
    holdout_gap_without: Option<f64>,
    indistinguishable_from: Vec<AlternativeEntry<'a>>,
    /// Explanations that were tried in its place and are told apart by the data.
    worse: Vec<AlternativeEntry<'a>>,
    null_test: Option<NullTestEntry>,
    stability: Option<StabilityEntry>,
}

/// Candidates weighed against innovations shifted in time and frequency. Gains are falls of the information criterion by the best.
#[derive(Serialize)]
struct NullTestEntry {
    shifts: usize,
    /// Without a shift.
    gain: f64,
    largest_gain_by_chance: f64,
    /// Shifts with a gain as large.
    as_strong: usize,
    /// Shifts with a gain that the search would have followed.
    over_threshold: usize,
}

/// Size in blocks of time, in multiples of the size over all of them.
#[derive(Serialize)]
struct StabilityEntry {
    constant: bool,
    chi_square: f64,
    degrees_of_freedom: usize,
    p_value: f64,
    /// Standard deviation between blocks beyond what their errors explain.
    spread: f64,
    blocks: Vec<BlockEntry>,
}

#[derive(Serialize)]
struct BlockEntry {
    /// Index into `trials`.
    trial: usize,
    /// Start and end (s).
    when: [f64; 2],
    size: f64,
    standard_error: f64,
}

#[derive(Serialize)]
struct AlternativeEntry<'a> {
    id: &'a str,
    cable: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    channel: Option<&'a str>,
    #[serde(rename = "where")]
    place: String,
    parameters: BTreeMap<&'static str, ParameterEntry>,
    delta_bic: f64,
    correlation: Option<f64>,
    separate_by: &'a str,
}

#[derive(Serialize)]
struct TermEntry<'a> {
    target: &'a str,
    expression: &'a str,
    /// Of each coefficient, in the order in which they stand in the expression.
    standard_error: &'a [Option<f64>],
    delta_bic: f64,
    holdout_gap_without: Option<f64>,
    null_test: Option<NullTestEntry>,
    stability: Option<StabilityEntry>,
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
pub fn discovery_json(discovery: &Discovery) -> Result<String, serde_json::Error> {
    let document = Document {
        schema: 1,
        verdict: verdict(discovery.verdict),
        located: discovery.located.iter().map(|l| located(l, &discovery.trials)).collect(),
        effects: discovery.effects.iter().map(|found| effect(found, &discovery.trials)).collect(),
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

/// A place as its cable where it is one of a cable's ends.
fn key(place: &Place) -> String {
    match place {
        Place::Anchor(cable) | Place::Attachment(cable) => Place::Cable(*cable).to_string(),
        other => other.to_string(),
    }
}

/// Where an effect acts.
fn key_of(spec: &EffectSpec) -> String {
    match spec.places().as_deref() {
        Ok([one]) => key(one),
        _ => place(spec),
    }
}

fn parameters(spec: &EffectSpec, standard_error: &[Option<f64>]) -> BTreeMap<&'static str, ParameterEntry> {
    let Ok(info) = spec.info() else { return BTreeMap::new() };
    let entry = |k: usize, value: f64| ParameterEntry {
        value,
        standard_error: standard_error.get(k).copied().flatten(),
        unit: info.parameters[k].unit,
    };
    spec.values.iter().enumerate().map(|(k, value)| (info.parameters[k].name, entry(k, *value))).collect()
}

fn effect<'a>(found: &'a Found, trials: &[Compared]) -> EffectEntry<'a> {
    let (twins, worse): (Vec<_>, Vec<_>) = found.alternatives.iter().partition(|a| a.indistinguishable);
    EffectEntry {
        id: &found.effect.id,
        cable: found.effect.cable,
        channel: found.effect.channel.as_deref(),
        place: key_of(&found.effect),
        parameters: parameters(&found.effect, &found.standard_error),
        onset: onset(found.onset),
        named: found.named,
        delta_bic: found.delta_bic,
        holdout_gap_without: found.holdout_gap_without,
        indistinguishable_from: twins.into_iter().map(alternative).collect(),
        worse: worse.into_iter().map(alternative).collect(),
        null_test: found.null_test.as_ref().map(null_test),
        stability: found.stability.as_ref().map(|s| stability(s, trials)),
    }
}

fn survey(error: &SurveyError) -> SurveyEntry<'_> {
    SurveyEntry {
        id: &error.effect.id,
        cable: error.effect.cable,
        channel: error.effect.channel.as_deref(),
        parameters: parameters(&error.effect, &error.standard_error),
    }
}

fn null_test(test: &NullTest) -> NullTestEntry {
    NullTestEntry {
        shifts: test.shifts,
        gain: test.found,
        largest_gain_by_chance: test.largest,
        as_strong: test.as_strong,
        over_threshold: test.over_threshold,
    }
}

fn stability(stability: &Stability, trials: &[Compared]) -> StabilityEntry {
    let training = training_trials(trials);
    let block = |b: &Block| {
        let trial = *training.get(b.trial)?;
        Some(BlockEntry { trial, when: [b.start, b.end], size: b.size, standard_error: b.standard_error })
    };
    StabilityEntry {
        constant: !stability.varies(),
        chi_square: stability.chi_square,
        degrees_of_freedom: stability.degrees,
        p_value: stability.p_value,
        spread: stability.spread,
        blocks: stability.blocks.iter().filter_map(block).collect(),
    }
}

fn alternative(other: &Alternative) -> AlternativeEntry<'_> {
    AlternativeEntry {
        id: &other.effect.id,
        cable: other.effect.cable,
        channel: other.effect.channel.as_deref(),
        place: key_of(&other.effect),
        parameters: parameters(&other.effect, &[]),
        delta_bic: other.delta_bic,
        correlation: other.correlation,
        separate_by: &other.separate_by,
    }
}

fn term<'a>(found: &'a Found, trials: &[Compared]) -> TermEntry<'a> {
    TermEntry {
        target: found.effect.target.as_deref().unwrap_or_default(),
        expression: found.effect.expression.as_deref().unwrap_or_default(),
        standard_error: &found.standard_error,
        delta_bic: found.delta_bic,
        holdout_gap_without: found.holdout_gap_without,
        null_test: found.null_test.as_ref().map(null_test),
        stability: found.stability.as_ref().map(|s| stability(s, trials)),
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
        place: effect.map_or_else(|| "instruments".to_owned(), key_of),
        outcome: entry.outcome.name(),
        delta_bic: entry.delta_bic,
        reason: &entry.reason,
    }
}
