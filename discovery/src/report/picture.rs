//! One static picture of the gap shrinking, for a README or a page without scripts.

use std::fmt::Write as _;

use super::axis::{Axis, range, widen};
use super::check::check;
use super::data::{BeforeAfter, Report, Series, Trial};
use super::number::{gap, plain, unit_text};
use super::place::channel_words;
use super::words::{best_gap, summary};
use super::{ReportError, escape};

const WIDTH: f64 = 860.0;
const HEIGHT: usize = 470;
/// Characters in a line of the headline.
const LINE: usize = 74;
const LEFT: f64 = 78.0;
/// Right end of the time panels.
const SPLIT: f64 = 620.0;
const STYLE: &str = include_str!("../../assets/picture.css");

/// Draws one channel of one trial (measured, predicted before and after; below it the error in multiples of the
/// noise) and beside it the gap before and after as bars. A complete SVG file, readable on light and dark pages.
///
/// # Errors
/// [`ReportError::UnknownChannel`] where the trial does not have the channel, and whatever [`check`] finds wrong with
/// the report.
pub fn gap_picture(report: &Report, trial: &Trial, channel: &str) -> Result<String, ReportError> {
    check(report)?;
    let series = trial.series.iter().find(|s| s.channel == channel).ok_or_else(|| ReportError::UnknownChannel {
        place: format!("the picture of trial `{}`", trial.name),
        channel: channel.to_owned(),
    })?;
    let facts = report.channels.iter().find(|c| c.name == channel);
    let unit = facts.map_or("", |c| c.unit.as_str());
    let headline = summary(report).headline;
    let head = lines(&headline, LINE);
    // Everything below makes room for a headline of more than one line.
    let shift = 24 * (head.len().max(1) - 1);
    let height = HEIGHT + shift;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"gap-picture\" viewBox=\"0 0 {WIDTH} {height}\" width=\"{WIDTH}\" height=\"{height}\" role=\"img\"><style>{STYLE}</style><rect class=\"gp-paper\" width=\"{WIDTH}\" height=\"{height}\"/><title>{}</title>",
        escape(&headline)
    );
    for (i, line) in head.iter().enumerate() {
        let y = 32 + 24 * i;
        let _ = write!(svg, "<text class=\"gp-head\" x=\"20\" y=\"{y}\">{}</text>", escape(line));
    }
    let _ = write!(svg, "<g transform=\"translate(0 {shift})\">");
    legend(&mut svg);
    values(&mut svg, trial, series, unit);
    errors(&mut svg, trial, series);
    bars(&mut svg, report);
    svg.push_str("</g></svg>\n");
    Ok(svg)
}

/// The text in lines of at most `width` characters, broken at spaces.
fn lines(text: &str, width: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split(' ') {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= width => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

/// The trial and channel that show the change best: the largest error before, held-out data preferred.
pub fn most_telling(report: &Report) -> Option<(&Trial, &str)> {
    let trial = report.trials.iter().find(|t| t.holdout).or(report.trials.first())?;
    let score = |s: &Series| {
        let mut sum = 0.0;
        for ((m, b), a) in s.measured.iter().zip(&s.before).zip(&s.after) {
            let change = (b - m).powi(2) - (a - m).powi(2);
            if change.is_finite() {
                sum += change;
            }
        }
        sum / s.expected.powi(2)
    };
    let best = trial.series.iter().max_by(|a, b| score(a).total_cmp(&score(b)))?;
    Some((trial, &best.channel))
}

fn legend(svg: &mut String) {
    let entries = [("gp-measured", "measured"), ("gp-before", "model before"), ("gp-after", "model after")];
    for (i, (class, text)) in entries.into_iter().enumerate() {
        let x = LEFT + 140.0 * i as f64;
        let _ = write!(
            svg,
            "<line class=\"{class}\" x1=\"{x}\" y1=\"60\" x2=\"{}\" y2=\"60\"/><text x=\"{}\" y=\"65\">{text}</text>",
            x + 24.0,
            x + 30.0
        );
    }
}

fn values(svg: &mut String, trial: &Trial, series: &Series, unit: &str) {
    let all = series.measured.iter().chain(&series.before).chain(&series.after).copied();
    let x = Axis::new(range(trial.time.iter().copied()), (LEFT, SPLIT));
    let y = Axis::new(widen(range(all), 0.05), (250.0, 80.0));
    let name = match unit {
        "" | "1" => channel_words(&series.channel),
        unit => format!("{} ({})", channel_words(&series.channel), unit_text(unit)),
    };
    frame(svg, &x, &y, (80.0, 250.0), &name, false);
    trace(svg, "gp-measured", &x, &y, &trial.time, series.measured.iter().copied());
    trace(svg, "gp-before", &x, &y, &trial.time, series.before.iter().copied());
    trace(svg, "gp-after", &x, &y, &trial.time, series.after.iter().copied());
}

fn errors(svg: &mut String, trial: &Trial, series: &Series) {
    let error =
        |p: &'_ [f64]| -> Vec<f64> { p.iter().zip(&series.measured).map(|(p, m)| (p - m) / series.expected).collect() };
    let (before, after) = (error(&series.before), error(&series.after));
    let x = Axis::new(range(trial.time.iter().copied()), (LEFT, SPLIT));
    let y = Axis::new(widen(range(before.iter().chain(&after).copied()), 0.05), (420.0, 280.0));
    frame(svg, &x, &y, (280.0, 420.0), "error / noise", true);
    trace(svg, "gp-before", &x, &y, &trial.time, before.into_iter());
    trace(svg, "gp-after", &x, &y, &trial.time, after.into_iter());
}

fn frame(svg: &mut String, x: &Axis, y: &Axis, (top, bottom): (f64, f64), name: &str, time: bool) {
    for (value, text) in y.ticks(4) {
        let at = y.at(value);
        let _ = write!(
            svg,
            "<line class=\"gp-grid\" x1=\"{LEFT}\" y1=\"{at:.1}\" x2=\"{SPLIT}\" y2=\"{at:.1}\"/><text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{text}</text>",
            LEFT - 8.0,
            at + 5.0
        );
    }
    let _ = write!(
        svg,
        "<text transform=\"translate(18 {}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
        0.5 * (top + bottom),
        escape(name)
    );
    if !time {
        return;
    }
    for (value, text) in x.ticks(8) {
        let _ =
            write!(svg, "<text x=\"{:.1}\" y=\"{}\" text-anchor=\"middle\">{text}</text>", x.at(value), bottom + 20.0);
    }
    let _ = write!(
        svg,
        "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">time (s)</text>",
        0.5 * (LEFT + SPLIT),
        bottom + 42.0
    );
}

fn trace(svg: &mut String, class: &str, x: &Axis, y: &Axis, time: &[f64], values: impl Iterator<Item = f64>) {
    let _ = write!(svg, "<path class=\"{class}\" d=\"");
    let mut pen = 'M';
    for (t, v) in time.iter().zip(values) {
        if v.is_finite() {
            let _ = write!(svg, "{pen}{:.1} {:.1}", x.at(*t), y.at(v));
            pen = 'L';
        } else {
            pen = 'M';
        }
    }
    svg.push_str("\"/>");
}

fn bars(svg: &mut String, report: &Report) {
    let (BeforeAfter { before, after }, held_out) = best_gap(report);
    let top = before.max(after).max(1.2);
    let y = Axis::new((0.0, top), (392.0, 146.0));
    let (left, right) = (SPLIT + 50.0, WIDTH - 24.0);
    let width = 56.0;
    let _ = write!(
        svg,
        "<text class=\"gp-bold\" x=\"{left}\" y=\"90\">error / noise</text><text x=\"{left}\" y=\"109\">{}, {} s ahead</text>",
        if held_out { "held-out data" } else { "fitted data" },
        plain(report.gap.horizon_s)
    );
    for (i, (class, name, value)) in
        [("gp-bar-before", "before", before), ("gp-bar-after", "after", after)].into_iter().enumerate()
    {
        let x = left + 12.0 + 88.0 * i as f64;
        let at = y.at(value);
        let _ = write!(
            svg,
            "<rect class=\"{class}\" x=\"{x}\" y=\"{at:.1}\" width=\"{width}\" height=\"{:.1}\"/><text class=\"gp-bold\" x=\"{}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text><text x=\"{}\" y=\"412\" text-anchor=\"middle\">{name}</text>",
            392.0 - at,
            x + 0.5 * width,
            at - 8.0,
            gap(value),
            x + 0.5 * width
        );
    }
    let floor = y.at(1.0);
    let _ = write!(
        svg,
        "<line class=\"gp-floor\" x1=\"{left}\" y1=\"{floor:.1}\" x2=\"{right}\" y2=\"{floor:.1}\"/><text x=\"{right}\" y=\"444\" text-anchor=\"end\">dashed: noise floor, 1</text>"
    );
}
