//! An axis: from values to places in the drawing, with round numbers along it.

use super::Scale;

/// Maps `low..high` to `start..end`.
#[derive(Clone, Copy)]
pub(super) struct Axis {
    low: f64,
    high: f64,
    start: f64,
    end: f64,
    scale: Scale,
}

impl Axis {
    /// An axis over the finite ones of `values`, with room on both sides unless `tight`.
    pub(super) fn over(values: impl Iterator<Item = f64>, (start, end): (f64, f64), scale: Scale, tight: bool) -> Self {
        let usable = values.map(|v| to_scale(v, scale)).filter(|v| v.is_finite());
        let (low, high) = usable.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        let (low, high) = match (low.is_finite(), scale) {
            (false, _) => (0.0, 1.0),
            (_, Scale::Logarithmic) => (low.floor(), high.ceil().max(low.floor() + 1.0)),
            // Values that differ by rounding only are one value.
            (_, Scale::Linear) if high - low <= 1e-9 * high.abs().max(low.abs()) => {
                let half = if high == 0.0 { 1.0 } else { 0.1 * high.abs() };
                (low - half, high + half)
            }
            _ => (low, high),
        };
        let room = if tight || scale == Scale::Logarithmic { 0.0 } else { 0.06 * (high - low) };
        Self { low: low - room, high: high + room, start, end, scale }
    }

    /// Place of a value; `None` where it has none.
    pub(super) fn at(&self, value: f64) -> Option<f64> {
        let value = to_scale(value, self.scale);
        let place = self.start + (value - self.low) / (self.high - self.low) * (self.end - self.start);
        place.is_finite().then_some(place)
    }

    /// About `count` round values and their texts.
    pub(super) fn ticks(&self, count: usize) -> Vec<(f64, String)> {
        let raw = (self.high - self.low) / count as f64;
        if self.scale == Scale::Logarithmic {
            let step = raw.ceil().max(1.0) as usize;
            let powers = (self.low as i32..=self.high as i32).step_by(step);
            return powers.map(|p| (10f64.powi(p), format!("1e{}", with_minus(&p.to_string())))).collect();
        }
        let power = 10f64.powf(raw.log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0].map(|m| m * power).into_iter().find(|s| *s >= raw * 0.999).unwrap_or(raw);
        let places = (-(step * 1.001).log10().floor()).max(0.0) as usize;
        let first = (self.low / step - 1e-9).ceil() as i64;
        let last = (self.high / step + 1e-9).floor() as i64;
        (first..=last)
            .map(|k| {
                let value = k as f64 * step;
                (value, with_minus(&format!("{value:.places$}")))
            })
            .collect()
    }
}

fn to_scale(value: f64, scale: Scale) -> f64 {
    match scale {
        Scale::Linear => value,
        Scale::Logarithmic if value > 0.0 => value.log10(),
        Scale::Logarithmic => f64::NAN,
    }
}

/// With a proper minus sign.
fn with_minus(number: &str) -> String {
    number.replace('-', "\u{2212}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(low: f64, high: f64, scale: Scale) -> Vec<String> {
        let axis = Axis::over([low, high].into_iter(), (0.0, 1.0), scale, true);
        axis.ticks(4).into_iter().map(|t| t.1).collect()
    }

    #[test]
    fn ticks_are_round() {
        assert_eq!(texts(0.0, 50.0, Scale::Linear), ["0", "20", "40"]);
        assert_eq!(texts(-0.1, 0.1, Scale::Linear), ["\u{2212}0.10", "\u{2212}0.05", "0.00", "0.05", "0.10"]);
        assert_eq!(texts(999.7, 1000.3, Scale::Linear), ["999.8", "1000.0", "1000.2"]);
        assert_eq!(
            texts(1e-10, 1e-6, Scale::Logarithmic),
            ["1e\u{2212}10", "1e\u{2212}9", "1e\u{2212}8", "1e\u{2212}7", "1e\u{2212}6"]
        );
        assert!(texts(3.0, 3.0, Scale::Linear).len() >= 2);
    }

    #[test]
    fn what_has_no_place_is_left_out() {
        let axis = Axis::over([1e-3, 1.0].into_iter(), (0.0, 3.0), Scale::Logarithmic, true);
        assert_eq!(axis.at(0.0), None);
        assert!((axis.at(1e-2).unwrap() - 1.0).abs() < 1e-12);
    }
}
