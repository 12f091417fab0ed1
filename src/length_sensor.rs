//! What an encoder on a drum shows of the length that is paid out.

use crate::scalar::Real;

/// A drum whose lever is not one: its axis may lie beside its centre, and it gets smaller as it pays out. Where the encoder has counted
/// `s` the lever is `r + e sin(s/r + ψ) - r κ s`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drum {
    /// `e` (m), smaller than the radius.
    pub eccentricity: f64,
    /// `r` (m), of the wave.
    pub radius: f64,
    /// `ψ` (rad).
    pub phase: f64,
    /// `κ` (1/m): the share of its radius that the drum loses with each metre counted; not negative.
    pub shrink: f64,
}

impl Default for Drum {
    /// A round one of one layer.
    fn default() -> Self {
        Self { eccentricity: 0.0, radius: 1.0, phase: 0.0, shrink: 0.0 }
    }
}

impl Drum {
    /// The length (m) that is paid out where the encoder has counted `counted` (m): the lever summed over the angle.
    fn length<S: Real>(&self, counted: S) -> S {
        let angle = counted / self.radius + self.phase;
        counted - (angle.cos() - self.phase.cos()) * self.eccentricity - counted * counted * (0.5 * self.shrink)
    }

    /// Its derivative.
    fn slope<S: Real>(&self, counted: S) -> S {
        let wave = (counted / self.radius + self.phase).sin() * (self.eccentricity / self.radius);
        wave + 1.0 - counted * self.shrink
    }

    /// Its second derivative (1/m).
    fn curvature<S: Real>(&self, counted: S) -> S {
        let wave = (counted / self.radius + self.phase).cos() * (self.eccentricity / (self.radius * self.radius));
        wave - self.shrink
    }

    /// What the encoder has counted (m) where `length` (m) is paid out.
    fn counted<S: Real>(&self, length: S) -> S {
        // Without its wave: the smaller root of the square, all of the drum where it holds no more.
        let mut counted = 2.0 * length.re() / (1.0 + (1.0 - 2.0 * self.shrink * length.re()).max(0.0).sqrt());
        for _ in 0..50 {
            let step = (self.length(counted) - length.re()) / self.slope(counted);
            counted -= step;
            if step.abs() <= 1e-15 * counted.abs() {
                break;
            }
        }
        // Each Newton step in the given number type carries one more order of derivatives.
        let slope = self.slope(counted);
        let mut refined = S::from(counted);
        for _ in 0..S::NDERIV {
            refined -= (self.length(refined) - length) / slope;
        }
        refined
    }
}

/// A sensor of a paid-out length: `factor` and `bias` (m) of what the drum's encoder has counted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LengthSensor {
    pub(crate) factor: f64,
    pub(crate) bias: f64,
    pub(crate) drum: Option<Drum>,
}

impl Default for LengthSensor {
    /// One that shows the true length.
    fn default() -> Self {
        Self { factor: 1.0, bias: 0.0, drum: None }
    }
}

impl LengthSensor {
    /// What the encoder has counted (m).
    #[inline]
    pub(crate) fn counted<S: Real>(&self, length: S) -> S {
        self.drum.map_or(length, |drum| drum.counted(length))
    }

    /// Rate of what the encoder has counted (m/s), from true length and rate.
    #[inline]
    pub(crate) fn counted_rate<S: Real>(&self, length: S, rate: S) -> S {
        self.drum.map_or(rate, |drum| rate / drum.slope(drum.counted(length)))
    }

    /// What is shown (m).
    #[inline]
    pub(crate) fn shown<S: Real>(&self, length: S) -> S {
        self.counted(length) * self.factor + self.bias
    }

    /// The rate that is shown (m/s).
    #[inline]
    pub(crate) fn shown_rate<S: Real>(&self, length: S, rate: S) -> S {
        self.counted_rate(length, rate) * self.factor
    }

    /// Rate of the rate that is shown (m/s²), from what is shown and the true acceleration.
    pub(crate) fn shown_acceleration<S: Real>(&self, shown: S, shown_rate: S, acceleration: S) -> S {
        let Some(drum) = self.drum else { return acceleration * self.factor };
        let (counted, rate) = ((shown - self.bias) / self.factor, shown_rate / self.factor);
        (acceleration - rate * rate * drum.curvature(counted)) / drum.slope(counted) * self.factor
    }

    /// How what is shown changes with the true length.
    pub(crate) fn slope(&self, length: f64) -> f64 {
        self.drum.map_or(self.factor, |drum| self.factor / drum.slope(drum.counted(length)))
    }

    /// How the true rate changes with what is shown, the rate that is shown held (1/s).
    pub(crate) fn rate_by_shown(&self, length: f64, rate: f64) -> f64 {
        self.drum.map_or(0.0, |drum| {
            let counted = drum.counted(length);
            rate / drum.slope(counted) * drum.curvature(counted) / self.factor
        })
    }

    /// The true length (m) behind what is shown.
    pub(crate) fn behind(&self, shown: f64) -> f64 {
        let counted = (shown - self.bias) / self.factor;
        self.drum.map_or(counted, |drum| drum.length(counted))
    }

    /// The true rate (m/s) behind what is shown.
    pub(crate) fn rate_behind(&self, shown: f64, shown_rate: f64) -> f64 {
        let (counted, rate) = ((shown - self.bias) / self.factor, shown_rate / self.factor);
        self.drum.map_or(rate, |drum| rate * drum.slope(counted))
    }
}
