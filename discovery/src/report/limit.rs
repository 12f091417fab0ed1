//! What the data would have shown, in words.

use super::data::{Limit, Report};
use super::grammar::join;
use super::number;

/// What the data would have shown, of each kind of place the first law of the catalogue.
#[must_use]
pub fn would_show(report: &Report) -> Option<String> {
    let mut seen: Vec<&str> = Vec::new();
    let mut list: Vec<String> = Vec::new();
    for limit in report.limits.iter().filter(|l| l.excited && !l.at_most) {
        if !seen.contains(&limit.site.as_str()) {
            seen.push(&limit.site);
            list.push(format!("{} {}", without_number(&limit.label), shows(limit)));
        }
    }
    (!list.is_empty()).then(|| join(&list, "and"))
}

/// The laws of which the data show nothing.
#[must_use]
pub fn not_excited(report: &Report) -> Option<String> {
    let mut list: Vec<String> = Vec::new();
    for limit in report.limits.iter().filter(|l| !l.excited) {
        let law = without_number(&limit.label);
        if !list.contains(&law) {
            list.push(law);
        }
    }
    (!list.is_empty()).then(|| join(&list, "and"))
}

/// A law at the cable where it shows least is one at any.
pub(super) fn without_number(label: &str) -> String {
    match label.rsplit_once('\u{a0}') {
        Some((law, number)) if number.chars().all(|c| c.is_ascii_digit()) => {
            match (law.split_once(" the measured "), law.rsplit_once(' ')) {
                (Some((front, length)), _) => format!("{front} any measured {length}"),
                (None, Some((front, place))) => format!("{front} any {place}"),
                (None, None) => law.to_owned(),
            }
        }
        _ => label.to_owned(),
    }
}

/// The sizes at which a law shows: `from 12 N`, `up to 2 × 10⁸ N`, `not at any size met in practice`.
pub(super) fn shows(limit: &Limit) -> String {
    let Some(size) = limit.size.filter(|_| limit.excited) else { return "not at any size met in practice".to_owned() };
    format!("{} {}", if limit.at_most { "up to" } else { "from" }, number::rough(&limit.parameter, size, &limit.unit))
}
