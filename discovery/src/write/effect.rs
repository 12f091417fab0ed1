//! Effects and terms in `discovery.json`.

use std::collections::BTreeMap;

use cdpr::effect::{EffectSpec, Place};
use serde::Serialize;

use super::label::place;
use super::trials::training_trials;
use crate::outcome::{Alternative, Block, Compared, Estimated, Found, NullTest, Onset, Stability, SurveyError};

#[derive(Serialize)]
pub(super) struct EstimatedEntry {
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

#[derive(Serialize)]
struct ParameterEntry {
    value: f64,
    standard_error: Option<f64>,
    unit: &'static str,
}

#[derive(Serialize)]
pub(super) struct GivenEntry<'a> {
    id: &'a str,
    cable: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    channel: Option<&'a str>,
    parameters: BTreeMap<&'static str, ParameterEntry>,
}

#[derive(Serialize)]
pub(super) struct EffectEntry<'a> {
    id: &'a str,
    cable: Option<usize>,
    /// The sensor, where the effect has several to choose from.
    #[serde(skip_serializing_if = "Option::is_none")]
    channel: Option<&'a str>,
    #[serde(rename = "where")]
    place: String,
    parameters: BTreeMap<&'static str, ParameterEntry>,
    /// Those of the model as given, where that has it with other numbers.
    #[serde(skip_serializing_if = "Option::is_none")]
    given: Option<BTreeMap<&'static str, ParameterEntry>>,
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
pub(super) struct NullTestEntry {
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
pub(super) struct TermEntry<'a> {
    target: &'a str,
    expression: &'a str,
    /// Of each coefficient, in the order in which they stand in the expression.
    standard_error: &'a [Option<f64>],
    delta_bic: f64,
    holdout_gap_without: Option<f64>,
    null_test: Option<NullTestEntry>,
    stability: Option<StabilityEntry>,
}

/// A place as its cable where it is one of a cable's ends.
pub(super) fn key(place: &Place) -> String {
    match place {
        Place::Anchor(cable) | Place::Attachment(cable) => Place::Cable(*cable).to_string(),
        other => other.to_string(),
    }
}

/// Where an effect acts.
pub(super) fn key_of(spec: &EffectSpec) -> String {
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

pub(super) fn effect<'a>(found: &'a Found, trials: &[Compared]) -> EffectEntry<'a> {
    let (twins, worse): (Vec<_>, Vec<_>) = found.alternatives.iter().partition(|a| a.indistinguishable);
    EffectEntry {
        id: &found.effect.id,
        cable: found.effect.cable,
        channel: found.effect.channel.as_deref(),
        place: key_of(&found.effect),
        parameters: parameters(&found.effect, &found.standard_error),
        given: found.given.as_ref().map(|given| parameters(given, &[])),
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

pub(super) fn survey(error: &SurveyError) -> GivenEntry<'_> {
    in_numbers(&error.effect, &error.standard_error)
}

/// An effect of the model as given.
pub(super) fn given(effect: &EffectSpec) -> GivenEntry<'_> {
    in_numbers(effect, &[])
}

fn in_numbers<'a>(effect: &'a EffectSpec, standard_error: &[Option<f64>]) -> GivenEntry<'a> {
    GivenEntry {
        id: &effect.id,
        cable: effect.cable,
        channel: effect.channel.as_deref(),
        parameters: parameters(effect, standard_error),
    }
}

pub(super) fn null_test(test: &NullTest) -> NullTestEntry {
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

pub(super) fn term<'a>(found: &'a Found, trials: &[Compared]) -> TermEntry<'a> {
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
