//! The residual as a picture of time × channel.

use std::fmt::Write as _;

use serde::Serialize;

use super::axis::Axis;
use super::data::{ResidualMap, ResidualRow, Trial};
use super::number::plain;
use super::place::channel_words;

/// Upper ends of the colour classes, in multiples of the noise; the last class is open.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scale([f64; CLASSES]);

/// Classes with an upper end.
const CLASSES: usize = 7;
/// Up to here an error is that of the noise.
const NOISE: f64 = 1.25;
/// The least error that the open class begins with: smaller ones shall not look large.
const LEAST: f64 = 20.0;
/// Share of the cells up to where the even steps lead.
const BELOW: f64 = 0.99;
/// Numbers that a reader takes for round.
const ROUND: [f64; 10] = [1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0];

impl Scale {
    /// The scale of all pictures of a report: even steps in the logarithm from the noise to nearly the largest error, so that
    /// the picture of a model that is far off shows where it is further off.
    pub(super) fn of(trials: &[Trial]) -> Self {
        let rows = trials.iter().flat_map(|t| &t.residuals.rows);
        let mut cells: Vec<f64> =
            rows.flat_map(|r| r.before.iter().chain(&r.after)).copied().filter(|v| v.is_finite()).collect();
        cells.sort_by(f64::total_cmp);
        let high = cells.get((BELOW * cells.len() as f64) as usize).map_or(LEAST, |v| v.max(LEAST));
        let step = (high / NOISE).powf(1.0 / CLASSES as f64);
        Self(std::array::from_fn(|i| if i == 0 { NOISE } else { round(NOISE * step.powi(i as i32)) }))
    }

    /// The colour key.
    pub(super) fn key(&self) -> Vec<Key> {
        let mut keys = vec![Key { class: 0, text: format!("up to {} (noise)", plain(NOISE)) }];
        let limits = self.0.iter().enumerate().skip(1);
        keys.extend(limits.map(|(class, limit)| Key { class, text: format!("to {}", plain(*limit)) }));
        keys.push(Key { class: CLASSES, text: "above".to_owned() });
        keys
    }

    /// Colour class of a residual.
    fn class_of(&self, value: f64) -> usize {
        self.0.iter().take_while(|limit| value > **limit).count()
    }
}

/// The nearest round number.
fn round(value: f64) -> f64 {
    let power = 10f64.powf(value.log10().floor());
    let near = ROUND.iter().chain(&[10.0]).map(|r| r * power);
    near.min_by(|a, b| (a / value).ln().abs().total_cmp(&(b / value).ln().abs())).unwrap_or(value)
}

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
pub(super) fn draw(scale: &Scale, index: usize, trial: &Trial) -> Option<HeatMap> {
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
        channels: map.rows.iter().map(|r| channel_words(&r.channel)).collect(),
        before: cells(scale, map, |r| &r.before),
        after: cells(scale, map, |r| &r.after),
        ticks: axis.ticks(6).into_iter().map(|(v, text)| (axis.at(v), text)).collect(),
    })
}

/// One `<svg>`, stretched by the page: x in seconds from the start, y in rows; one path per colour class. Neighbours
/// of the same class in a row become one rectangle.
fn cells(scale: &Scale, map: &ResidualMap, pick: impl Fn(&ResidualRow) -> &Vec<f64>) -> String {
    let origin = map.edges[0];
    let mut paths = vec![String::new(); CLASSES + 1];
    for (row, values) in map.rows.iter().map(pick).enumerate() {
        let mut i = 0;
        while i < values.len() {
            let start = i;
            let class = scale.class_of(values[start]);
            while i < values.len() && values[i].is_nan() == values[start].is_nan() && scale.class_of(values[i]) == class
            {
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

    fn trial(before: Vec<f64>, after: Vec<f64>) -> Trial {
        Trial {
            name: "a".to_owned(),
            holdout: false,
            time: vec![],
            series: vec![],
            residuals: ResidualMap {
                edges: (0..=before.len()).map(|k| 10.0 + 2.0 * k as f64).collect(),
                rows: vec![ResidualRow { channel: "x".to_owned(), before, after }],
            },
        }
    }

    #[test]
    fn equal_neighbours_share_a_rectangle_and_gaps_stay_empty() {
        let trial = trial(vec![30.0, 40.0, 1.0], vec![1.0, f64::NAN, 1.0]);
        let scale = Scale([1.25, 1.5, 2.0, 3.0, 5.0, 10.0, 20.0]);
        let map = draw(&scale, 0, &trial).expect("a picture");
        assert!(map.before.contains("class=\"h7\" d=\"M0.000 0h4.000v1h-4.000z\""), "{}", map.before);
        assert_eq!(map.after.matches("h2.000").count(), 2, "{}", map.after);
        assert_eq!((map.channels[0].as_str(), scale.key().len()), ("position x", CLASSES + 1));
    }

    #[test]
    fn classes_are_half_open() {
        let scale = Scale::of(&[]);
        assert_eq!(scale.class_of(0.2), 0);
        assert_eq!(scale.class_of(1.25), 0);
        assert_eq!(scale.class_of(1.26), 1);
        assert_eq!(scale.class_of(1e9), CLASSES);
    }

    #[test]
    fn a_model_that_is_far_off_is_no_wall_of_one_colour() {
        let before: Vec<f64> = (0..400).map(|k| 3.0 * 1.02_f64.powi(k)).collect();
        let scale = Scale::of(&[trial(before.clone(), vec![1.0; 400])]);
        assert!(scale.0.windows(2).all(|pair| pair[0] < pair[1]), "{scale:?}");
        for class in 1..=CLASSES {
            let share = before.iter().filter(|v| scale.class_of(**v) == class).count();
            assert!(share < 120, "{share} of 400 in class {class}: {scale:?}");
        }
        assert_eq!(scale.class_of(1.0), 0);
        // One that is near is not painted as if it were far.
        assert!(Scale::of(&[trial(vec![1.0, 2.0], vec![1.0, 1.0])]).class_of(2.0) <= 2);
    }
}
