//! Where in the text of a `model.toml` something stands.

use std::collections::BTreeMap;

use serde::Deserialize;
use toml::Spanned;

/// The line, from 1, that a byte of a text is in.
pub(super) fn line_at(text: &str, byte: usize) -> usize {
    text.as_bytes()[..byte.min(text.len())].iter().filter(|b| **b == b'\n').count() + 1
}

/// Line of a key at the top or under `[start]`; `key` may carry an index, and an axis as in `gravity (x)`.
pub(super) fn line_of_key(text: &str, key: &str) -> Option<usize> {
    let key = key.split_once(" (").map_or(key, |(key, _)| key);
    if let Some((index, field)) = key.strip_prefix("cable[").and_then(|rest| rest.split_once("].")) {
        return line_in_cable(text, index.parse().ok()?, field);
    }
    let key = key.split('[').next()?;
    let top: BTreeMap<Spanned<String>, toml::Value> = toml::from_str(text).ok()?;
    if let Some(found) = top.keys().find(|k| k.get_ref() == key) {
        return Some(line_at(text, found.span().start));
    }
    #[derive(Deserialize)]
    struct Inner {
        #[serde(default)]
        start: BTreeMap<Spanned<String>, toml::Value>,
        #[serde(default)]
        winch: BTreeMap<Spanned<String>, toml::Value>,
    }
    let inner: Inner = toml::from_str(text).ok()?;
    let wanted = if key == "pose" { ["x", "y", "phi"].as_slice() } else { &[key] };
    let lines = inner.start.keys().chain(inner.winch.keys()).filter(|k| wanted.contains(&k.get_ref().as_str()));
    lines.map(|k| line_at(text, k.span().start)).min()
}

/// The line of a key of the cable of this number, from 1.
fn line_in_cable(text: &str, number: usize, key: &str) -> Option<usize> {
    #[derive(Deserialize)]
    struct Tables {
        cable: Vec<BTreeMap<Spanned<String>, toml::Value>>,
    }
    let tables: Tables = toml::from_str(text).ok()?;
    let mut keys = tables.cable.get(number.checked_sub(1)?)?.keys();
    keys.find(|k| k.get_ref() == key).map(|k| line_at(text, k.span().start))
}
