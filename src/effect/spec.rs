//! One `[[effect]]` entry of a model: the id, the cable, the parameter values.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::{CATALOGUE, EffectInfo, Scope, find};
use crate::per_cable::MAX_CABLES;

/// One `[[effect]]` entry. Build it with [`EffectSpec::new`] or read it from TOML; both check it.
#[derive(Clone, Debug, PartialEq)]
pub struct EffectSpec {
    /// Id in the catalogue.
    pub id: String,
    /// Cable, from 1; `None` acts on all.
    pub cable: Option<usize>,
    /// Parameter values, in the order of the catalogue entry.
    pub values: Vec<f64>,
    /// When it begins (s); `None` is before all time.
    pub from: Option<f64>,
    /// When it ends (s); `None` is never.
    pub until: Option<f64>,
    /// `length_sensor_bias` only: the measured channel, `unstretched_length` (default) or `cable_length`.
    pub channel: Option<String>,
    /// `expression` only: where the term acts.
    pub target: Option<String>,
    /// `expression` only: the term.
    pub expression: Option<String>,
}

/// An `[[effect]]` entry that makes no sense.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("effect `{id}`: {message}")]
pub struct SpecError {
    /// The entry's id.
    pub id: String,
    /// What was found and what was expected.
    pub message: String,
}

impl SpecError {
    pub(crate) fn new(id: &str, message: impl Into<String>) -> Self {
        Self { id: id.to_owned(), message: message.into() }
    }

    pub(crate) fn unknown_id(id: &str) -> Self {
        let known: Vec<&str> = CATALOGUE.iter().map(|e| e.id).collect();
        Self::new(id, format!("no effect has this id; expected one of {}", known.join(", ")))
    }
}

impl EffectSpec {
    /// An effect of the catalogue with `values` for its parameters (in order), on `cable` (from 1) or, with `None`, on all.
    /// Values left out at the end are the defaults.
    ///
    /// # Errors
    /// Unknown id, cable out of range or not taken by this effect, wrong count, value out of its bounds.
    pub fn new(id: &str, cable: Option<usize>, values: &[f64]) -> Result<Self, SpecError> {
        let mut spec = Self {
            id: id.to_owned(),
            cable,
            values: values.to_vec(),
            from: None,
            until: None,
            channel: None,
            target: None,
            expression: None,
        };
        let left_out = spec.info()?.parameters.iter().skip(values.len());
        spec.values.extend(left_out.map_while(|parameter| parameter.default));
        spec.check()?;
        Ok(spec)
    }

    /// A force, torque or winch-force term given as an expression; see [`super::Expression`].
    ///
    /// # Errors
    /// Unknown target, or an expression that cannot be read.
    pub fn expression(target: &str, expression: &str) -> Result<Self, SpecError> {
        let spec = Self {
            id: "expression".to_owned(),
            cable: None,
            values: Vec::new(),
            from: None,
            until: None,
            channel: None,
            target: Some(target.to_owned()),
            expression: Some(expression.to_owned()),
        };
        spec.check()?;
        Ok(spec)
    }

    /// The same effect, in force only from a time on, until a time (s).
    ///
    /// # Errors
    /// A time that is no number, an end that is not after the beginning, an effect that cannot begin or end.
    pub fn during(mut self, from: Option<f64>, until: Option<f64>) -> Result<Self, SpecError> {
        (self.from, self.until) = (from, until);
        self.check()?;
        Ok(self)
    }

    /// Whether it begins or ends.
    pub fn is_switched(&self) -> bool {
        self.from.is_some() || self.until.is_some()
    }

    /// Whether it is in force at `time` (s): at its beginning it is, at its end no longer.
    pub fn in_force(&self, time: f64) -> bool {
        self.from.is_none_or(|from| from <= time) && self.until.is_none_or(|until| time < until)
    }

    /// The time in which both are in force (s), as `from` and `until`; `None` where there is none.
    pub(crate) fn common_time(&self, other: &Self) -> Option<(Option<f64>, Option<f64>)> {
        let either = |a: Option<f64>, b: Option<f64>, pick: fn(f64, f64) -> f64| match (a, b) {
            (Some(a), Some(b)) => Some(pick(a, b)),
            _ => a.or(b),
        };
        let (from, until) = (either(self.from, other.from, f64::max), either(self.until, other.until, f64::min));
        from.zip(until).is_none_or(|(from, until)| from < until).then_some((from, until))
    }

    /// The number at `index`: the parameters in their order, then when it begins and when it ends, where it does.
    pub fn number(&mut self, index: usize) -> Option<&mut f64> {
        match index.checked_sub(self.values.len()) {
            None => self.values.get_mut(index),
            Some(0) => self.from.as_mut(),
            Some(1) => self.until.as_mut(),
            Some(_) => None,
        }
    }

    /// The catalogue entry.
    ///
    /// # Errors
    /// Unknown id.
    pub fn info(&self) -> Result<&'static EffectInfo, SpecError> {
        find(&self.id).ok_or_else(|| SpecError::unknown_id(&self.id))
    }

    /// Name of the FMU variable of the number at `index`: `effect.<id>.<parameter>` or `effect.<id>[cable].<parameter>`.
    pub fn variable_name(&self, index: usize) -> Option<String> {
        let parameters = self.info().ok()?.parameters;
        let parameter = match index.checked_sub(parameters.len()) {
            None => parameters[index].name,
            Some(beyond) => ["from", "until"].get(beyond)?,
        };
        Some(match self.cable {
            Some(cable) => format!("effect.{}[{cable}].{parameter}", self.id),
            None => format!("effect.{}.{parameter}", self.id),
        })
    }

    /// Whether parameter `index` takes part in the law: not an extension that is left out, and not idle beside another or without it.
    pub fn takes_part(&self, index: usize) -> bool {
        let Some(parameters) = self.info().ok().map(|info| info.parameters) else { return false };
        let Some((parameter, value)) = parameters.get(index).zip(self.values.get(index)) else { return false };
        let is_there = |other: &str| parameters.iter().zip(&self.values).any(|(p, v)| p.name == other && *v != 0.0);
        let idle =
            parameter.idle_beside.is_some_and(is_there) || parameter.idle_without.is_some_and(|other| !is_there(other));
        !idle && !parameter.leaves_out(*value)
    }

    /// Checks the entry against the catalogue.
    ///
    /// # Errors
    /// As [`EffectSpec::new`].
    pub fn check(&self) -> Result<(), SpecError> {
        let info = self.info()?;
        match (info.scope, self.cable) {
            (Scope::Whole, Some(cable)) => {
                return Err(SpecError::new(&self.id, format!("`cable` is {cable}, but this effect takes no cable")));
            }
            (Scope::EachCable, Some(cable)) if !(1..=MAX_CABLES).contains(&cable) => {
                return Err(SpecError::new(&self.id, format!("`cable` is {cable}, expected 1 to {MAX_CABLES}")));
            }
            _ => {}
        }
        if self.values.len() != info.parameters.len() {
            return Err(SpecError::new(
                &self.id,
                format!("{} parameter values, expected {}", self.values.len(), info.parameters.len()),
            ));
        }
        for (parameter, value) in info.parameters.iter().zip(&self.values) {
            crate::parameters::check_range(parameter.name, *value, parameter.min, parameter.max)
                .map_err(|e| SpecError::new(&self.id, e.to_string()))?;
        }
        if let Some(channel) = &self.channel {
            if self.id != "length_sensor_bias" {
                return Err(SpecError::new(&self.id, "takes no `channel`"));
            }
            if !["unstretched_length", "cable_length"].contains(&channel.as_str()) {
                return Err(SpecError::new(
                    &self.id,
                    format!("`channel` is {channel:?}, expected \"unstretched_length\" or \"cable_length\""),
                ));
            }
        }
        if self.id == "winch_saturation" && self.values[0] >= self.values[1] {
            return Err(SpecError::new(
                &self.id,
                format!("`lower` is {}, expected less than `upper` ({})", self.values[0], self.values[1]),
            ));
        }
        self.check_times(info)?;
        super::EffectKind::new(self).map(|_| ())
    }

    fn check_times(&self, info: &EffectInfo) -> Result<(), SpecError> {
        for (key, time) in [("from", self.from), ("until", self.until)] {
            let Some(time) = time else { continue };
            if !time.is_finite() {
                return Err(SpecError::new(&self.id, format!("`{key}` is {time}, expected a time in s")));
            }
            if let Some(reason) = info.nature().always {
                return Err(SpecError::new(&self.id, format!("takes no `{key}`, it is always there: {reason}")));
            }
        }
        match (self.from, self.until) {
            (Some(from), Some(until)) if until <= from => {
                Err(SpecError::new(&self.id, format!("`until` is {until} s, expected after `from` ({from} s)")))
            }
            _ => Ok(()),
        }
    }
}

impl EffectSpec {
    /// Checks the entry as one of a robot with `cables` cables.
    ///
    /// # Errors
    /// As [`EffectSpec::check`]; a cable that the robot does not have.
    pub fn check_on(&self, cables: usize) -> Result<(), SpecError> {
        self.check()?;
        let wrong = |key: &str, cable: usize| {
            Err(SpecError::new(&self.id, format!("`{key}` names cable {cable}, but the robot has {cables} cables")))
        };
        match self.cable {
            Some(cable) if cable > cables => return wrong("cable", cable),
            _ => {}
        }
        if let super::EffectKind::Expression(expression) = super::EffectKind::new(self)? {
            match (expression.winch(), expression.formula().last_cable()) {
                (Some(winch), _) if winch >= cables => return wrong("target", winch + 1),
                (_, Some(cable)) if cable >= cables => return wrong("expression", cable + 1),
                _ => {}
            }
        }
        Ok(())
    }
}

impl<'de> Deserialize<'de> for EffectSpec {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        use serde::de::Error;
        let mut table = toml::Table::deserialize(deserializer)?;
        let text = |table: &mut toml::Table, key: &str| match table.remove(key) {
            None => Ok(None),
            Some(toml::Value::String(text)) => Ok(Some(text)),
            Some(other) => Err(D::Error::custom(format!("effect: `{key}` is {other}, expected a string"))),
        };
        let id = text(&mut table, "id")?
            .ok_or_else(|| D::Error::custom("effect: no `id`; expected an id as listed by `cdpr effects`"))?;
        let channel = text(&mut table, "channel")?;
        let target = text(&mut table, "target")?;
        let expression = text(&mut table, "expression")?;
        let cable = match table.remove("cable") {
            None => None,
            Some(toml::Value::Integer(cable)) => Some(usize::try_from(cable).unwrap_or(usize::MAX)),
            Some(other) => {
                return Err(D::Error::custom(format!("effect `{id}`: `cable` is {other}, expected 1 to {MAX_CABLES}")));
            }
        };
        let info = find(&id).ok_or_else(|| D::Error::custom(SpecError::unknown_id(&id)))?;
        let time = |table: &mut toml::Table, key: &str| match table.remove(key) {
            None => Ok(None),
            Some(toml::Value::Float(value)) => Ok(Some(value)),
            Some(toml::Value::Integer(value)) => Ok(Some(value as f64)),
            Some(other) => Err(D::Error::custom(format!("effect `{id}`: `{key}` is {other}, expected a time in s"))),
        };
        let (from, until) = (time(&mut table, "from")?, time(&mut table, "until")?);
        let mut values = Vec::new();
        for parameter in info.parameters {
            values.push(match table.remove(parameter.name) {
                Some(toml::Value::Float(value)) => value,
                Some(toml::Value::Integer(value)) => value as f64,
                Some(other) => {
                    return Err(D::Error::custom(format!(
                        "effect `{id}`: `{}` is {other}, expected a number in {}",
                        parameter.name, parameter.unit
                    )));
                }
                None => parameter.default.ok_or_else(|| {
                    D::Error::custom(format!(
                        "effect `{id}`: no `{}`, expected a number in {}",
                        parameter.name, parameter.unit
                    ))
                })?,
            });
        }
        if let Some(key) = table.keys().next() {
            let known: Vec<&str> = info.parameters.iter().map(|p| p.name).collect();
            return Err(D::Error::custom(format!(
                "effect `{id}`: unknown key `{key}`, expected `cable`, `from`, `until` or one of: {}",
                known.join(", ")
            )));
        }
        let spec = Self { id, cable, values, from, until, channel, target, expression };
        spec.check().map_err(D::Error::custom)?;
        Ok(spec)
    }
}

impl Serialize for EffectSpec {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        use serde::ser::{Error, SerializeMap};
        let info = self.info().map_err(S::Error::custom)?;
        let mut map = serializer.serialize_map(None)?;
        map.serialize_entry("id", &self.id)?;
        if let Some(cable) = self.cable {
            map.serialize_entry("cable", &cable)?;
        }
        for (key, time) in [("from", self.from), ("until", self.until)] {
            if let Some(time) = time {
                map.serialize_entry(key, &time)?;
            }
        }
        for (key, value) in [("channel", &self.channel), ("target", &self.target), ("expression", &self.expression)] {
            if let Some(value) = value {
                map.serialize_entry(key, value)?;
            }
        }
        for (parameter, value) in info.parameters.iter().zip(&self.values) {
            map.serialize_entry(parameter.name, value)?;
        }
        map.end()
    }
}
