//! A straight axis of a drawing: from data to drawing units, with round tick values.

use super::number::decimals;

/// Maps data from `low..high` to `start..end` of the drawing.
#[derive(Clone, Copy, Debug)]
pub(super) struct Axis {
    low: f64,
    high: f64,
    start: f64,
    end: f64,
}

impl Axis {
    /// An axis over `low..high`, widened where the two are equal or not finite.
    pub(super) fn new((low, high): (f64, f64), (start, end): (f64, f64)) -> Axis {
        let (low, high) = if low.is_finite() && high.is_finite() { (low, high) } else { (0.0, 1.0) };
        let (low, high) = if high > low {
            (low, high)
        } else {
            let half = if low == 0.0 { 1.0 } else { 0.5 * low.abs() };
            (low - half, low + half)
        };
        Axis { low, high, start, end }
    }

    /// Position of `value` in the drawing.
    pub(super) fn at(&self, value: f64) -> f64 {
        self.start + (value - self.low) / (self.high - self.low) * (self.end - self.start)
    }

    /// Whether `value` lies on the axis.
    pub(super) fn contains(&self, value: f64) -> bool {
        (self.low..=self.high).contains(&value)
    }

    /// About `count` round values on the axis with their texts.
    pub(super) fn ticks(&self, count: usize) -> Vec<(f64, String)> {
        let step = round_step((self.high - self.low) / count.max(1) as f64);
        let places = (-step.log10().floor()).max(0.0) as i32;
        let first = (self.low / step - 1e-9).ceil() as i64;
        let last = (self.high / step + 1e-9).floor() as i64;
        (first..=last)
            .map(|i| {
                let value = i as f64 * step;
                (value, decimals(value, places))
            })
            .collect()
    }
}

/// Smallest and largest finite value; `(NaN, NaN)` where there is none.
pub(super) fn range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.filter(|v| v.is_finite()).fold((f64::NAN, f64::NAN), |(low, high), v| (low.min(v), high.max(v)))
}

/// The range widened by `share` of itself on both sides.
pub(super) fn widen((low, high): (f64, f64), share: f64) -> (f64, f64) {
    let margin = share * (high - low);
    (low - margin, high + margin)
}

/// 1, 2 or 5 times a power of ten, at least `raw`.
fn round_step(raw: f64) -> f64 {
    let power = 10f64.powf(raw.log10().floor());
    [1.0, 2.0, 5.0, 10.0].into_iter().map(|m| m * power).find(|s| *s >= raw * (1.0 - 1e-9)).unwrap_or(10.0 * power)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        let texts = |low, high| -> Vec<String> {
            Axis::new((low, high), (0.0, 1.0)).ticks(5).into_iter().map(|t| t.1).collect()
        };
        assert_eq!(texts(-0.1, 0.1), ["−0.10", "−0.05", "0.00", "0.05", "0.10"]);
        assert_eq!(texts(0.0, 100.0), ["0", "20", "40", "60", "80", "100"]);
        assert!(texts(3.0, 3.0).len() >= 2);
        assert!(texts(f64::NAN, f64::NAN).len() >= 2);
    }

    #[test]
    fn maps_ends_to_ends() {
        let axis = Axis::new((2.0, 4.0), (100.0, 0.0));
        assert_eq!(axis.at(2.0), 100.0);
        assert_eq!(axis.at(4.0), 0.0);
        assert!(!axis.contains(5.0));
    }
}
