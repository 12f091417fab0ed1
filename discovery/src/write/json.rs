//! `discovery.json`.
//!
//! The keys are a contract (schema 1): keys may be added, those here keep their names and meaning. A number that does
//! not exist is `null`.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::data::Channel;
use crate::outcome::{Alternative, Compared, Discovery, Found, HORIZON, Located, SearchStep, Verdict};

use super::label::place;
use super::report::all_channels;

#[derive(Serialize)]
struct Document<'a> {
    schema: u32,
    verdict: &'static str,
    located: Vec<LocatedEntry<'a>>,
    effects: Vec<EffectEntry<'a>>,
    terms: Vec<TermEntry<'a>>,
    gap: GapEntry<'a>,
    remainder: RemainderEntry,
    channels: BTreeMap<String, ChannelEntry>,
    trials: Vec<TrialEntry<'a>>,
    search: SearchEntry<'a>,
    remarks: &'a [String],
}

#[derive(Serialize)]
struct LocatedEntry<'a> {
    #[serde(rename = "where")]
    place: &'a str,
    share_of_gap: f64,
    /// Stretches of time (s); none where it shows all the time.
    when: Vec<[f64; 2]>,
    /// The trial of each stretch, an index into `trials`.
    when_in: Vec<usize>,
    depends_on: &'a [String],
}

#[derive(Serialize)]
struct ParameterEntry {
    value: f64,
    standard_error: Option<f64>,
    unit: &'static str,
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
    delta_bic: f64,
    holdout_gap_without: Option<f64>,
    indistinguishable_from: Vec<AlternativeEntry<'a>>,
    /// Explanations that were tried in its place and are told apart by the data.
    worse: Vec<AlternativeEntry<'a>>,
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
struct SearchEntry<'a> {
    candidates: usize,
    outliers: usize,
    seconds: f64,
    steps: Vec<StepEntry<'a>>,
}

#[derive(Serialize)]
struct StepEntry<'a> {
    id: &'a str,
    cable: Option<usize>,
    #[serde(rename = "where")]
    place: String,
    outcome: &'a str,
    delta_bic: f64,
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
        effects: discovery.effects.iter().map(effect).collect(),
        terms: discovery.terms.iter().map(term).collect(),
        gap: gap(discovery),
        remainder: RemainderEntry {
            force: discovery.remainder_force.into(),
            torque: discovery.remainder_torque.into(),
        },
        channels: all_channels(discovery).into_iter().map(|c| (c.name(), channel(c, discovery))).collect(),
        trials: discovery
            .trials
            .iter()
            .map(|t| TrialEntry { name: &t.trial.name, holdout: t.holdout, samples: t.trial.len() })
            .collect(),
        search: SearchEntry {
            candidates: discovery.candidates,
            outliers: discovery.outliers,
            seconds: discovery.seconds,
            steps: discovery.steps.iter().map(step).collect(),
        },
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
        Verdict::Unnamed => "unnamed",
    }
}

/// Where each training trial stands among all trials.
pub(super) fn training_trials(trials: &[Compared]) -> Vec<usize> {
    (0..trials.len()).filter(|t| !trials[*t].holdout).collect()
}

fn located<'a>(located: &'a Located, trials: &[Compared]) -> LocatedEntry<'a> {
    let training = training_trials(trials);
    let known: Vec<_> = located.when.iter().filter_map(|w| Some((*training.get(w.0)?, [w.1, w.2]))).collect();
    LocatedEntry {
        place: &located.place,
        share_of_gap: located.share,
        when: known.iter().map(|(_, span)| *span).collect(),
        when_in: known.iter().map(|(trial, _)| *trial).collect(),
        depends_on: &located.depends_on,
    }
}

fn parameters(
    spec: &cdpr::effect::EffectSpec,
    standard_error: &[Option<f64>],
) -> BTreeMap<&'static str, ParameterEntry> {
    let Ok(info) = spec.info() else { return BTreeMap::new() };
    let entry = |k: usize, value: f64| ParameterEntry {
        value,
        standard_error: standard_error.get(k).copied().flatten(),
        unit: info.parameters[k].unit,
    };
    spec.values.iter().enumerate().map(|(k, value)| (info.parameters[k].name, entry(k, *value))).collect()
}

fn effect(found: &Found) -> EffectEntry<'_> {
    let (twins, worse): (Vec<_>, Vec<_>) = found.alternatives.iter().partition(|a| a.indistinguishable);
    EffectEntry {
        id: &found.effect.id,
        cable: found.effect.cable,
        channel: found.effect.channel.as_deref(),
        place: place(&found.effect),
        parameters: parameters(&found.effect, &found.standard_error),
        delta_bic: found.delta_bic,
        holdout_gap_without: found.holdout_gap_without,
        indistinguishable_from: twins.into_iter().map(alternative).collect(),
        worse: worse.into_iter().map(alternative).collect(),
    }
}

fn alternative(other: &Alternative) -> AlternativeEntry<'_> {
    AlternativeEntry {
        id: &other.effect.id,
        cable: other.effect.cable,
        channel: other.effect.channel.as_deref(),
        place: place(&other.effect),
        parameters: parameters(&other.effect, &[]),
        delta_bic: other.delta_bic,
        correlation: other.correlation,
        separate_by: &other.separate_by,
    }
}

fn term(found: &Found) -> TermEntry<'_> {
    TermEntry {
        target: found.effect.target.as_deref().unwrap_or_default(),
        expression: found.effect.expression.as_deref().unwrap_or_default(),
        standard_error: &found.standard_error,
        delta_bic: found.delta_bic,
        holdout_gap_without: found.holdout_gap_without,
    }
}

fn gap(discovery: &Discovery) -> GapEntry<'_> {
    let main = discovery.horizons.iter().find(|h| h.horizon == HORIZON);
    let channels = main.map_or(&[][..], |h| &h.channels);
    GapEntry {
        horizon_s: HORIZON,
        train: main.map(|h| h.train.into()),
        holdout: main.map(|h| h.holdout.into()),
        holdout_source: &discovery.holdout_source,
        channels: channels.iter().map(|(c, train, held_out)| (c.name(), held_out.unwrap_or(*train).into())).collect(),
        horizons: discovery
            .horizons
            .iter()
            .map(|h| HorizonEntry { horizon_s: h.horizon, train: h.train.into(), holdout: h.holdout.into() })
            .collect(),
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

fn step(step: &SearchStep) -> StepEntry<'_> {
    StepEntry {
        id: &step.effect.id,
        cable: step.effect.cable,
        place: place(&step.effect),
        outcome: &step.outcome,
        delta_bic: step.delta_bic,
        reason: &step.reason,
    }
}
