//! The residual against the variable it depends on, with the fitted law through it.

use std::cmp::Ordering;
use std::fmt::Write as _;

use super::axis::{Axis, range, widen};
use super::data::Signature;
use super::escape;
use super::number::unit_text;

const WIDTH: f64 = 560.0;
const HEIGHT: f64 = 330.0;
const LEFT: f64 = 84.0;
const RIGHT: f64 = 12.0;
const TOP: f64 = 12.0;
const BOTTOM: f64 = 28.0;
/// Most points drawn; more are thinned evenly, the means still use all.
const POINTS: usize = 3000;
/// Bins of the means.
const BINS: usize = 24;
/// Fewest points for a mean.
const LEAST: usize = 5;

/// One `<svg>`; `None` where there is nothing to draw.
pub(super) fn draw(signature: &Signature) -> Option<String> {
    let points: Vec<[f64; 2]> =
        signature.points.iter().filter(|p| p[0].is_finite() && p[1].is_finite()).copied().collect();
    if points.is_empty() && signature.law.is_empty() {
        return None;
    }
    let xs = range(points.iter().chain(&signature.law).map(|p| p[0]));
    let x = Axis::new(widen(xs, 0.02), (LEFT, WIDTH - RIGHT));
    let y = Axis::new(widen(y_range(&points, &signature.law), 0.06), (HEIGHT - BOTTOM, TOP));
    let mut svg = format!(
        "<svg class=\"signature\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"{}\">",
        escape(&format!("{} against {}", signature.y_name, signature.x_name))
    );
    grid(&mut svg, &x, &y);
    cloud(&mut svg, &x, &y, &points);
    law(&mut svg, &x, &y, &signature.law);
    means(&mut svg, &x, &y, &points);
    svg.push_str("</svg>");
    Some(svg)
}

/// All of the law and the middle 99 % of the points: one outlier must not flatten the picture.
fn y_range(points: &[[f64; 2]], law: &[[f64; 2]]) -> (f64, f64) {
    let mut values: Vec<f64> = points.iter().map(|p| p[1]).collect();
    values.sort_by(f64::total_cmp);
    let cut = values.len() / 200;
    let middle = &values[cut..values.len() - cut];
    range(middle.iter().copied().chain(law.iter().map(|p| p[1])))
}

fn grid(svg: &mut String, x: &Axis, y: &Axis) {
    let bottom = HEIGHT - BOTTOM;
    for (value, text) in y.ticks(6) {
        let at = y.at(value);
        let class = if value == 0.0 { "zero" } else { "grid" };
        let _ = write!(
            svg,
            "<line class=\"{class}\" x1=\"{LEFT}\" y1=\"{at:.1}\" x2=\"{}\" y2=\"{at:.1}\"/><text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{text}</text>",
            WIDTH - RIGHT,
            LEFT - 8.0,
            at + 5.0
        );
    }
    for (value, text) in x.ticks(6) {
        let at = x.at(value);
        let class = if value == 0.0 { "zero" } else { "grid" };
        let _ = write!(
            svg,
            "<line class=\"{class}\" x1=\"{at:.1}\" y1=\"{TOP}\" x2=\"{at:.1}\" y2=\"{bottom}\"/><text x=\"{at:.1}\" y=\"{}\" text-anchor=\"middle\">{text}</text>",
            bottom + 20.0
        );
    }
}

/// The names of the two axes with their units, across and up.
pub(super) fn titles(signature: &Signature) -> [String; 2] {
    [(&signature.x_name, &signature.x_unit), (&signature.y_name, &signature.y_unit)]
        .map(|(name, unit)| title(name, unit))
}

fn title(name: &str, unit: &str) -> String {
    match unit {
        "" | "1" => name.to_owned(),
        unit => format!("{name} ({})", unit_text(unit)),
    }
}

fn cloud(svg: &mut String, x: &Axis, y: &Axis, points: &[[f64; 2]]) {
    svg.push_str("<path class=\"cloud\" d=\"");
    for p in points.iter().step_by(points.len().div_ceil(POINTS).max(1)) {
        if y.contains(p[1]) {
            let _ = write!(svg, "M{:.1} {:.1}h0", x.at(p[0]), y.at(p[1]));
        }
    }
    svg.push_str("\"/>");
}

fn law(svg: &mut String, x: &Axis, y: &Axis, law: &[[f64; 2]]) {
    let points: Vec<String> = law
        .iter()
        .filter(|p| p[0].is_finite() && p[1].is_finite())
        .map(|p| format!("{:.1},{:.1}", x.at(p[0]), y.at(p[1])))
        .collect();
    if !points.is_empty() {
        let d = points.join(" ");
        let _ = write!(svg, "<polyline class=\"law-edge\" points=\"{d}\"/><polyline class=\"law\" points=\"{d}\"/>");
    }
}

/// Means over equal stretches of the variable, with plus and minus one standard error.
fn means(svg: &mut String, x: &Axis, y: &Axis, points: &[[f64; 2]]) {
    let (low, high) = range(points.iter().map(|p| p[0]));
    if high.partial_cmp(&low) != Some(Ordering::Greater) {
        return;
    }
    let mut bins = vec![Vec::new(); BINS];
    for p in points {
        let i = ((p[0] - low) / (high - low) * BINS as f64) as usize;
        bins[i.min(BINS - 1)].push(*p);
    }
    for bin in bins.iter().filter(|b| b.len() >= LEAST) {
        let n = bin.len() as f64;
        let mean = |k: usize| bin.iter().map(|p| p[k]).sum::<f64>() / n;
        let (mx, my) = (mean(0), mean(1));
        let error = (bin.iter().map(|p| (p[1] - my).powi(2)).sum::<f64>() / (n * (n - 1.0))).sqrt();
        if y.contains(my) {
            let at = x.at(mx);
            let _ = write!(
                svg,
                "<line class=\"error\" x1=\"{at:.1}\" y1=\"{:.1}\" x2=\"{at:.1}\" y2=\"{:.1}\"/><circle class=\"mean\" cx=\"{at:.1}\" cy=\"{:.1}\" r=\"4\"/>",
                y.at(my - error),
                y.at(my + error),
                y.at(my)
            );
        }
    }
}
