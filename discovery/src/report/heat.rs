//! The residual as a picture of time × channel.

use std::fmt::Write as _;

use serde::Serialize;

use super::axis::Axis;
use super::data::{ResidualMap, ResidualRow, Trial};
use super::number::decimals;

/// Upper ends of the colour classes, in multiples of the noise; the last class is open.
const CLASSES: [f64; 7] = [1.25, 1.5, 2.0, 3.0, 5.0, 10.0, 20.0];

/// One trial's picture, before and after.
#[derive(Serialize)]
pub(super) struct HeatMap {
    /// Number of the trial, from 0.
    index: usize,
    trial: String,
    holdout: bool,
    channels: Vec<String>,
    before: String,
    after: String,
    /// Position along the time axis (per cent) and text.
    ticks: Vec<(f64, String)>,
}

/// One entry of the colour key: class number and what it stands for.
#[derive(Serialize)]
pub(super) struct Key {
    class: usize,
    text: String,
}

/// Draws a trial's residuals; `None` where it has none.
pub(super) fn draw((index, trial): (usize, &Trial)) -> Option<HeatMap> {
    let map = &trial.residuals;
    let (first, last) = (*map.edges.first()?, *map.edges.last()?);
    if map.rows.is_empty() {
        return None;
    }
    let axis = Axis::new((first, last), (0.0, 100.0));
    Some(HeatMap {
        index,
        trial: trial.name.clone(),
        holdout: trial.holdout,
        channels: map.rows.iter().map(|r| r.channel.clone()).collect(),
        before: cells(map, |r| &r.before),
        after: cells(map, |r| &r.after),
        ticks: axis.ticks(6).into_iter().map(|(v, text)| (axis.at(v), text)).collect(),
    })
}

/// The colour key.
pub(super) fn key() -> Vec<Key> {
    let short = |v: f64| {
        decimals(
            v,
            if v.fract() == 0.0 {
                0
            } else if v == 1.5 {
                1
            } else {
                2
            },
        )
    };
    let mut keys = vec![Key { class: 0, text: format!("up to {} (noise)", short(CLASSES[0])) }];
    for (i, pair) in CLASSES.windows(2).enumerate() {
        keys.push(Key { class: i + 1, text: format!("to {}", short(pair[1])) });
    }
    keys.push(Key { class: CLASSES.len(), text: "above".to_owned() });
    keys
}

/// Colour class of a residual.
fn class_of(value: f64) -> usize {
    CLASSES.iter().take_while(|limit| value > **limit).count()
}

/// One `<svg>`, stretched by the page: x in seconds from the start, y in rows; one path per colour class. Neighbours
/// of the same class in a row become one rectangle.
fn cells(map: &ResidualMap, pick: impl Fn(&ResidualRow) -> &Vec<f64>) -> String {
    let origin = map.edges[0];
    let mut paths = vec![String::new(); CLASSES.len() + 1];
    for (row, values) in map.rows.iter().map(pick).enumerate() {
        let mut i = 0;
        while i < values.len() {
            let start = i;
            let class = class_of(values[start]);
            while i < values.len() && values[i].is_nan() == values[start].is_nan() && class_of(values[i]) == class {
                i += 1;
            }
            if values[start].is_nan() {
                continue;
            }
            let (from, to) = (map.edges[start] - origin, map.edges[i] - origin);
            let _ = write!(paths[class], "M{from:.3} {row}h{:.3}v1h{:.3}z", to - from, from - to);
        }
    }
    let length = map.edges[map.edges.len() - 1] - origin;
    let mut svg = format!(
        "<svg class=\"cells\" viewBox=\"0 0 {length:.3} {}\" preserveAspectRatio=\"none\" shape-rendering=\"crispEdges\" aria-hidden=\"true\">",
        map.rows.len()
    );
    for (class, path) in paths.iter().enumerate().filter(|(_, p)| !p.is_empty()) {
        let _ = write!(svg, "<path class=\"h{class}\" d=\"{path}\"/>");
    }
    svg.push_str("</svg>");
    svg
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_neighbours_share_a_rectangle_and_gaps_stay_empty() {
        let trial = Trial {
            name: "a".to_owned(),
            holdout: false,
            time: vec![],
            series: vec![],
            residuals: ResidualMap {
                edges: vec![10.0, 12.0, 14.0, 16.0],
                rows: vec![ResidualRow {
                    channel: "x".to_owned(),
                    before: vec![30.0, 40.0, 1.0],
                    after: vec![1.0, f64::NAN, 1.0],
                }],
            },
        };
        let map = draw((0, &trial)).expect("a picture");
        assert!(map.before.contains("class=\"h7\" d=\"M0.000 0h4.000v1h-4.000z\""), "{}", map.before);
        assert_eq!(map.after.matches("h2.000").count(), 2, "{}", map.after);
        assert_eq!(key().len(), CLASSES.len() + 1);
    }

    #[test]
    fn classes_are_half_open() {
        assert_eq!(class_of(0.2), 0);
        assert_eq!(class_of(1.25), 0);
        assert_eq!(class_of(1.26), 1);
        assert_eq!(class_of(1e9), CLASSES.len());
    }
}
