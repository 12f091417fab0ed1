//! What recording does to the winch forces, as the filter of a load cell or a log that is late.

/// The mean (s) and the variance (s²) of the response to an impulse by which winch forces are recorded: as they act where both are zero.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Recorder {
    /// How late the forces are recorded (s).
    pub delay: f64,
    /// What the recorder smooths (s²).
    pub variance: f64,
}

impl Recorder {
    /// Whether forces are recorded as they act.
    pub(crate) fn is_in_time(self) -> bool {
        self == Self::default()
    }

    /// How many numbers say what it does: none, its delay, or that and its variance.
    pub(crate) fn moments(self) -> usize {
        if self.is_in_time() { 0 } else { 1 + usize::from(self.variance > 0.0) }
    }

    /// One behind the other: delays and variances add up.
    pub(crate) fn behind(self, other: Self) -> Self {
        Self { delay: self.delay + other.delay, variance: self.variance + other.variance }
    }
}
