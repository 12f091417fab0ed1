//! What the data would have shown: `detection_limits` of `discovery.json`, and the rows of the report.

use std::collections::BTreeMap;

use cdpr::effect::EffectSpec;
use serde::Serialize;

use crate::outcome::DetectionLimit;
use crate::report;

use super::label::{label, parameters, place, unit};

#[derive(Serialize)]
pub(super) struct LimitEntry<'a> {
    id: &'a str,
    cable: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    channel: Option<&'a str>,
    parameter: &'a str,
    /// `null` where the data show nothing of it.
    size: Option<f64>,
    unit: &'static str,
    /// Whether it shows `from` this size on or `up_to` it.
    shows: &'static str,
    /// Whether that is a size that such a robot may have.
    excited: bool,
    /// The shape for which it holds.
    at: BTreeMap<&'static str, f64>,
}

pub(super) fn limit(limit: &DetectionLimit) -> LimitEntry<'_> {
    let spec = &limit.effect;
    let name = |k: usize| spec.info().ok().map(|info| info.parameters[k].name);
    LimitEntry {
        id: &spec.id,
        cable: spec.cable,
        channel: spec.channel.as_deref(),
        parameter: &limit.parameter,
        size: limit.size,
        unit: limit.unit,
        shows: if limit.at_most { "up_to" } else { "from" },
        excited: limit.excited,
        at: limit.shape.iter().filter_map(|k| Some((name(*k)?, spec.values[*k]))).collect(),
    }
}

/// A row for each law and size: that of the cable where it shows least.
pub(super) fn rows(limits: &[DetectionLimit]) -> Vec<report::Limit> {
    let key = |l: &DetectionLimit| (l.effect.id.clone(), l.effect.channel.clone(), l.parameter.clone());
    let mut worst: Vec<&DetectionLimit> = Vec::new();
    for limit in limits {
        match worst.iter_mut().find(|known| key(known) == key(limit)) {
            Some(known) if shows_less(limit, known) => *known = limit,
            Some(_) => {}
            None => worst.push(limit),
        }
    }
    worst.into_iter().map(row).collect()
}

fn shows_less(one: &DetectionLimit, other: &DetectionLimit) -> bool {
    match (one.size, other.size) {
        (None, _) => true,
        (_, None) => false,
        (Some(one), Some(than)) if other.at_most => one < than,
        (Some(one), Some(than)) => one > than,
    }
}

fn row(limit: &DetectionLimit) -> report::Limit {
    let spec = &limit.effect;
    let shape = |name: &str| {
        let at = |k: &usize| spec.info().is_ok_and(|info| info.parameters[*k].name == name);
        limit.shape.iter().any(at)
    };
    report::Limit {
        label: report::phrase(&label(spec), &place(spec)),
        site: place(spec).split(['[', '.']).next().unwrap_or_default().to_owned(),
        parameter: limit.parameter.clone(),
        size: limit.size,
        unit: unit(limit.unit),
        at_most: limit.at_most,
        excited: limit.excited,
        shape: parameters(spec, &[]).into_iter().filter(|p| shape(&p.name)).collect(),
    }
}

/// The laws of which the data show nothing on any cable.
pub(super) fn cannot_tell(limits: &[DetectionLimit]) -> Vec<&str> {
    let mut out: Vec<&str> = Vec::new();
    for DetectionLimit { effect: EffectSpec { id, .. }, .. } in limits {
        let shown = limits.iter().any(|l| l.effect.id == *id && l.excited);
        if !shown && !out.contains(&id.as_str()) {
            out.push(id);
        }
    }
    out
}
