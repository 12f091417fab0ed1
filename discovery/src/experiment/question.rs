//! What an experiment is to answer: the explanations that a discovery could not tell apart, out of `discovery.json`.

use std::collections::BTreeMap;

use cdpr::effect::EffectSpec;
use cdpr::model_file::Model;
use serde::Deserialize;

use crate::data::Channel;

use super::PlanError;
use super::limits::Limits;

/// Explanations of one thing that are as good as each other on the recordings so far.
#[derive(Clone, Debug)]
pub(super) struct Open {
    /// The model without any of them.
    pub(super) base: Model,
    /// How many of its effects were in the model as given; the others were found, and are free.
    pub(super) given: usize,
    /// The explanations, that which the discovery took first.
    pub(super) laws: Vec<EffectSpec>,
    /// Difference of the criterion between the first and each, on the recordings so far.
    pub(super) now: Vec<f64>,
}

/// A detection limit of the recordings so far.
#[derive(Clone, Debug, Deserialize)]
pub(super) struct Known {
    pub(super) id: String,
    pub(super) cable: Option<usize>,
    pub(super) parameter: String,
    /// `null` where they show nothing of it.
    pub(super) size: Option<f64>,
    pub(super) unit: String,
    /// `from` this size on, or `up_to` it.
    pub(super) shows: String,
}

/// What the instruments of the recordings add, one channel.
#[derive(Clone, Debug)]
pub(super) struct Instrument {
    pub(super) channel: Channel,
    pub(super) white: f64,
    /// Standard deviation and time constant (s) of noise with memory; a drift has none.
    pub(super) memories: Vec<(f64, Option<f64>)>,
}

/// Everything of `discovery.json` that an experiment needs.
#[derive(Clone, Debug)]
pub(super) struct Question {
    pub(super) verdict: String,
    pub(super) open: Vec<Open>,
    pub(super) limits: Vec<Known>,
    /// How many of the model's effects were given.
    pub(super) given: usize,
    pub(super) instruments: Vec<Instrument>,
    /// White error of each recorded winch force (N).
    pub(super) force_error: f64,
    /// Jitter of the time stamps (s).
    pub(super) jitter: f64,
}

#[derive(Deserialize)]
struct Document {
    schema: u32,
    verdict: String,
    effects: Vec<Effect>,
    /// Effects of the model without a name.
    #[serde(default)]
    candidates: Vec<Effect>,
    terms: Vec<serde::de::IgnoredAny>,
    instruments: Instruments,
    #[serde(default)]
    detection_limits: Vec<Known>,
}

#[derive(Deserialize)]
struct Effect {
    #[serde(flatten)]
    law: Law,
    #[serde(default)]
    indistinguishable_from: Vec<Law>,
}

#[derive(Deserialize)]
struct Law {
    id: String,
    cable: Option<usize>,
    channel: Option<String>,
    parameters: BTreeMap<String, Size>,
    delta_bic: f64,
}

#[derive(Deserialize)]
struct Size {
    value: f64,
}

#[derive(Deserialize)]
struct Instruments {
    channels: BTreeMap<String, ChannelOf>,
    winch_force_error: Option<Size>,
    stamp_jitter: Option<Size>,
}

#[derive(Deserialize)]
struct ChannelOf {
    white: f64,
    coloured: Option<Size>,
    time_constant: Option<Size>,
    drift: Option<Size>,
    origin: Option<Size>,
}

impl Law {
    fn effect(&self) -> Result<EffectSpec, PlanError> {
        let bad = |message: String| PlanError::Discovery(format!("effect `{}`: {message}", self.id));
        let info = cdpr::effect::find(&self.id).ok_or_else(|| bad("no effect has this id".to_owned()))?;
        let value = |name: &str| self.parameters.get(name).map(|size| size.value);
        let values: Option<Vec<f64>> = info.parameters.iter().map(|p| value(p.name).or(p.default)).collect();
        let values = values.ok_or_else(|| bad("a parameter is missing".to_owned()))?;
        let mut spec = EffectSpec::new(&self.id, self.cable, &values).map_err(|e| bad(e.to_string()))?;
        spec.channel.clone_from(&self.channel);
        spec.check().map_err(|e| bad(e.to_string()))?;
        Ok(spec)
    }
}

impl Question {
    /// Reads the text of `discovery.json` that was written with `model`.
    pub(super) fn read(text: &str, model: &Model, limits: &Limits) -> Result<Self, PlanError> {
        let document: Document = serde_json::from_str(text)
            .map_err(|e| PlanError::Discovery(format!("{e}; expected a discovery.json of `cdpr discover`")))?;
        if document.schema != 1 {
            return Err(PlanError::Discovery(format!("schema {}, expected 1", document.schema)));
        }
        let of_model = || document.effects.iter().chain(&document.candidates);
        let found: Result<Vec<EffectSpec>, PlanError> = of_model().map(|e| e.law.effect()).collect();
        let found = found?;
        let given = (model.effects.len()).checked_sub(found.len() + document.terms.len());
        let given = given.ok_or_else(|| not_of(&found[0]))?;
        let mut open = Vec::new();
        for (law, effect) in found.iter().zip(of_model()) {
            let at = model.effects.iter().skip(given).position(|known| same(known, law)).ok_or_else(|| not_of(law))?;
            if effect.indistinguishable_from.is_empty() {
                continue;
            }
            let mut base = model.clone();
            base.effects.remove(given + at);
            let rivals: Result<Vec<EffectSpec>, PlanError> =
                effect.indistinguishable_from.iter().map(Law::effect).collect();
            open.push(Open {
                base,
                given,
                laws: [vec![law.clone()], rivals?].concat(),
                now: std::iter::once(0.0).chain(effect.indistinguishable_from.iter().map(|r| r.delta_bic)).collect(),
            });
        }
        let cables = model.parameters.cables();
        if let Some(name) = limits.unknown_noise(cables) {
            let known: Vec<String> = Channel::all(cables).iter().map(|c| c.name()).collect();
            let message =
                format!("[noise]: `{name}` is no channel of this robot, expected one of {}", known.join(", "));
            return Err(PlanError::Limits(message));
        }
        Ok(Self {
            verdict: document.verdict,
            open,
            limits: document.detection_limits,
            given,
            instruments: instruments(&document.instruments, limits, cables)?,
            force_error: document.instruments.winch_force_error.map_or(0.0, |size| size.value),
            jitter: document.instruments.stamp_jitter.map_or(0.0, |size| size.value),
        })
    }
}

impl Question {
    /// The detection limits of an effect, on one cable or on each.
    pub(super) fn limits_of(&self, id: &str, cable: Option<usize>) -> Result<Vec<Known>, PlanError> {
        let asked = |known: &&Known| known.id == id && (cable.is_none() || known.cable == cable);
        let found: Vec<Known> = self.limits.iter().filter(asked).cloned().collect();
        if found.is_empty() {
            let mut ids: Vec<&str> = self.limits.iter().map(|known| known.id.as_str()).collect();
            ids.dedup();
            let place = cable.map_or(String::new(), |cable| format!(" on cable {cable}"));
            return Err(PlanError::Discovery(format!(
                "no detection limit of `{id}`{place}: it is in the model, or not looked for; expected one of {}",
                ids.join(", ")
            )));
        }
        Ok(found)
    }
}

/// The channels that were measured, and those for which the limits give a noise.
fn instruments(given: &Instruments, limits: &Limits, cables: usize) -> Result<Vec<Instrument>, PlanError> {
    let mut out = Vec::new();
    for channel in Channel::all(cables) {
        let known = given.channels.get(&channel.name());
        let own = limits.noise_of(channel);
        let Some(white) = own.or(known.map(|c| c.white)) else { continue };
        let of = |size: &Option<Size>, time: Option<f64>| size.as_ref().map(|size| (size.value, time));
        let memories = known.map_or(Vec::new(), |c| {
            let time = c.time_constant.as_ref().map(|size| size.value);
            [of(&c.coloured, time), of(&c.drift, None), of(&c.origin, Some(f64::INFINITY))]
                .into_iter()
                .flatten()
                .collect()
        });
        out.push(Instrument { channel, white, memories });
    }
    if let Some(name) = given.channels.keys().find(|name| !Channel::all(cables).iter().any(|c| c.name() == **name)) {
        return Err(PlanError::Discovery(format!("`{name}` is no channel of the model's robot")));
    }
    if out.is_empty() {
        return Err(PlanError::Discovery("no channel under `instruments`".to_owned()));
    }
    Ok(out)
}

/// Whether two entries are one, but for the digits that are written.
fn same(one: &EffectSpec, other: &EffectSpec) -> bool {
    let near = |(a, b): (&f64, &f64)| (a - b).abs() <= 1e-9 * a.abs().max(b.abs());
    (&one.id, one.cable, &one.channel) == (&other.id, other.cable, &other.channel)
        && one.values.iter().zip(&other.values).all(near)
}

fn not_of(law: &EffectSpec) -> PlanError {
    let size = law.values.first().copied().unwrap_or_default();
    let name = law.info().ok().and_then(|info| info.parameters.first()).map_or("value", |p| p.name);
    PlanError::Discovery(format!(
        "found `{}` with {name} = {size}, which the model does not have; expected the model.toml that was written beside it",
        law.id
    ))
}
