//! The size of what was found over time: a point with its error bar for each block.

use std::fmt::Write as _;

use serde::Serialize;

use super::axis::{Axis, range, widen};
use super::data::{Report, Stability};
use super::formula::printed;
use super::grammar::capital;
use super::number::{decimals, percent, significant};
use super::words::effect_phrase;
use super::{escape, phrase};

const WIDTH: f64 = 560.0;
const HEIGHT: f64 = 230.0;
const LEFT: f64 = 84.0;
const RIGHT: f64 = 12.0;
const TOP: f64 = 12.0;
const BOTTOM: f64 = 52.0;
/// Least half height of the axis, in multiples of the size: smaller differences do not matter and shall not look large.
const LEAST: f64 = 0.05;
/// Room between two trials on the axis of time, as a share of all trials.
const ROOM: f64 = 0.05;

/// One picture with its heading and what it says.
#[derive(Serialize)]
pub(super) struct Drawn {
    label: String,
    svg: String,
    words: String,
    constant: bool,
}

/// A picture for each effect and term that has blocks.
pub(super) fn draw(report: &Report) -> Vec<Drawn> {
    let effects = report.effects.iter().map(|e| (effect_phrase(e), &e.stability));
    let terms =
        report.terms.iter().map(|t| (phrase(&printed(&t.expression, &t.standard_errors), &t.target), &t.stability));
    effects
        .chain(terms)
        .filter_map(|(label, stability)| {
            let stability = stability.as_ref()?;
            let label = capital(&label);
            let svg = picture(report, stability, &label);
            Some(Drawn { label, svg, words: words(stability), constant: stability.constant })
        })
        .collect()
}

/// What the blocks say, in a sentence.
fn words(stability: &Stability) -> String {
    let test = format!(
        "χ² = {} with {} degree{} of freedom, p {}",
        significant(stability.chi_square, 3),
        stability.degrees,
        if stability.degrees == 1 { "" } else { "s" },
        match stability.p_value {
            p if p < 1e-6 => "< 10⁻⁶".to_owned(),
            p => format!("= {}", significant(p, 2)),
        }
    );
    if !stability.constant {
        return format!(
            "Not the same throughout: beyond its error bars the size differs from block to block by {} ({test}). The law is \
             not quite this one, or something changed.",
            percent(stability.spread)
        );
    }
    let worst = small_percent(stability.blocks.iter().map(|b| (b.size - 1.0).abs()).fold(0.0, f64::max));
    if stability.p_value < 1e-3 {
        return format!(
            "The same as far as it matters: off by no more than {worst}, though by more than its error ({test})."
        );
    }
    format!("The same throughout: no block is further off than {worst} ({test}).")
}

fn small_percent(share: f64) -> String {
    match share {
        s if s < 5e-4 => "0.1\u{a0}%".to_owned(),
        s if s < 0.1 => format!("{}\u{a0}%", decimals(100.0 * s, 1)),
        s => percent(s),
    }
}

/// One `<svg>`: the trials one after the other, the size in per cent.
fn picture(report: &Report, stability: &Stability, label: &str) -> String {
    let trials = trials(report, stability);
    let end = trials.last().map_or(1.0, |t| t.offset + t.end);
    let x = Axis::new((trials.first().map_or(0.0, |t| t.offset + t.start), end), (LEFT, WIDTH - RIGHT));
    let bars = stability.blocks.iter().map(|b| (b.size - 2.0 * b.standard_error, b.size + 2.0 * b.standard_error));
    let (low, high) = range(bars.flat_map(|(low, high)| [low, high]));
    let limits = (100.0 * low.clamp(-1.0, 1.0 - LEAST), 100.0 * high.clamp(1.0 + LEAST, 3.0));
    let y = Axis::new(widen(limits, 0.05), (HEIGHT - BOTTOM, TOP));
    let mut svg = format!(
        "<svg class=\"blocks\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"{}\">",
        escape(&format!("Size in blocks of time: {label}"))
    );
    grid(&mut svg, &x, &y, &trials);
    for block in &stability.blocks {
        let Some(trial) = trials.iter().find(|t| t.index == block.span.trial) else { continue };
        let at = x.at(trial.offset + 0.5 * (block.span.start + block.span.end));
        let (size, two) = (100.0 * block.size, 200.0 * block.standard_error);
        let told = format!(
            "{} to {} s: {} ± {} %",
            decimals(block.span.start, 0),
            decimals(block.span.end, 0),
            significant(size, 4),
            significant(0.5 * two, 2)
        );
        let _ = write!(
            svg,
            "<g><title>{}</title><line class=\"error\" x1=\"{at:.1}\" y1=\"{:.1}\" x2=\"{at:.1}\" y2=\"{:.1}\"/>",
            escape(&told),
            y.at((size - two).max(limits.0)),
            y.at((size + two).min(limits.1))
        );
        if y.contains(size) {
            let _ = write!(svg, "<circle class=\"mean\" cx=\"{at:.1}\" cy=\"{:.1}\" r=\"5\"/>", y.at(size));
        }
        svg.push_str("</g>");
    }
    svg.push_str("</svg>");
    svg
}

/// A trial's place on the axis of time.
struct Place<'a> {
    index: usize,
    name: &'a str,
    start: f64,
    end: f64,
    /// What to add to its times.
    offset: f64,
}

/// The trials that have blocks, one after the other.
fn trials<'a>(report: &'a Report, stability: &Stability) -> Vec<Place<'a>> {
    let mut out: Vec<Place<'a>> = Vec::new();
    let all: f64 = stability.blocks.iter().map(|b| b.span.end - b.span.start).sum();
    for block in &stability.blocks {
        match out.last_mut() {
            Some(last) if last.index == block.span.trial => last.end = block.span.end,
            last => {
                let from = last.map_or(block.span.start, |t| t.offset + t.end + ROOM * all);
                let name = report.trials.get(block.span.trial).map_or("", |t| t.name.as_str());
                let (index, start) = (block.span.trial, block.span.start);
                out.push(Place { index, name, start, end: block.span.end, offset: from - start });
            }
        }
    }
    out
}

fn grid(svg: &mut String, x: &Axis, y: &Axis, trials: &[Place<'_>]) {
    let bottom = HEIGHT - BOTTOM;
    for (value, text) in y.ticks(4) {
        let at = y.at(value);
        let class = if value == 100.0 { "zero" } else { "grid" };
        let _ = write!(
            svg,
            "<line class=\"{class}\" x1=\"{LEFT}\" y1=\"{at:.1}\" x2=\"{}\" y2=\"{at:.1}\"/><text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{text} %</text>",
            WIDTH - RIGHT,
            LEFT - 8.0,
            at + 5.0
        );
    }
    for (k, trial) in trials.iter().enumerate() {
        let last = k + 1 == trials.len();
        let (from, to) = (x.at(trial.offset + trial.start), x.at(trial.offset + trial.end));
        let mut ticks = Axis::new((trial.start, trial.end), (from, to)).ticks(if trials.len() > 2 { 2 } else { 4 });
        // The end of one trial and the beginning of the next are too near for two texts.
        ticks.retain(|(value, _)| last || *value < trial.end - 0.1 * (trial.end - trial.start));
        for (value, text) in ticks {
            let at = x.at(trial.offset + value);
            let _ = write!(
                svg,
                "<line class=\"grid\" x1=\"{at:.1}\" y1=\"{bottom}\" x2=\"{at:.1}\" y2=\"{}\"/><text x=\"{at:.1}\" y=\"{}\" text-anchor=\"middle\">{text}</text>",
                bottom + 5.0,
                bottom + 20.0
            );
        }
        let _ = write!(
            svg,
            "<line class=\"zero\" x1=\"{from:.1}\" y1=\"{bottom}\" x2=\"{to:.1}\" y2=\"{bottom}\"/><text class=\"title\" x=\"{:.1}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
            0.5 * (from + to),
            HEIGHT - 8.0,
            escape(&shortened(trial.name, 44 / trials.len()))
        );
    }
}

/// The text cut to so many letters.
fn shortened(text: &str, most: usize) -> String {
    if text.chars().count() <= most {
        return text.to_owned();
    }
    text.chars().take(most.saturating_sub(1)).chain(['…']).collect()
}

#[cfg(test)]
mod tests {
    use super::super::data::{Block, Span};
    use super::*;

    fn stability(p_value: f64, constant: bool) -> Stability {
        let block = |(k, size): (usize, f64)| Block {
            span: Span { trial: k, start: 10.0, end: 30.0 },
            size,
            standard_error: 0.002,
        };
        let blocks = [0.998, 1.0, 1.004].into_iter().enumerate().map(block).collect();
        Stability { blocks, chi_square: 5.0, degrees: 2, p_value, spread: 0.12, constant }
    }

    #[test]
    fn words_tell_chance_from_weight() {
        let said = |p, constant| words(&stability(p, constant)).replace('\u{a0}', " ");
        assert_eq!(
            said(0.08, true),
            "The same throughout: no block is further off than 0.4 % (χ² = 5.00 with 2 degrees of freedom, p = 0.080)."
        );
        assert!(said(1e-9, true).contains("by more than its error (χ² = 5.00 with 2 degrees of freedom, p < 10⁻⁶)"));
        assert!(
            said(1e-9, false).contains(
                "Not the same throughout: beyond its error bars the size differs from block to block by 12 %"
            )
        );
    }

    #[test]
    fn long_names_are_cut() {
        assert_eq!(shortened("run.csv", 7), "run.csv");
        assert_eq!(shortened("längere.csv", 5), "läng…");
    }
}
