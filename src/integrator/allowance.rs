//! How much work one call may be.

use super::IntegrationError;

/// Evaluations that a call may use to get over one difficult moment.
///
/// Dry friction that reverses over 1e-6 m/s on two winches takes up to 3000, at a tolerance of 1e-11. What takes 200 000 is
/// stuck, and these last a fraction of a second.
const RESERVE: f64 = 2e5;

/// Evaluations that a call earns with each second (s) that its time moves on, until the reserve is full again.
///
/// One takes about a microsecond, so a call that earns less than it spends is slower than the robot itself. The default plant
/// needs 700 a second, massless springs with such friction 60 000 at that tolerance.
const PER_SECOND: f64 = 1e6;

/// What is left of the work that a call may be, and what has been done with it since the reserve was last full.
///
/// It grows with the time reached, not with the time asked for: a call that is stuck ends soon however long it was to be.
#[derive(Clone, Debug)]
pub(super) struct Allowance {
    left: f64,
    since: f64,
    evaluations: u64,
    steps: u64,
    switches: u64,
}

impl Allowance {
    /// The full reserve, at `time` (s).
    pub(super) fn full(time: f64) -> Self {
        Self { left: RESERVE, since: time, evaluations: 0, steps: 0, switches: 0 }
    }

    pub(super) fn spend(&mut self, evaluations: u64) {
        self.left -= evaluations as f64;
        self.evaluations += evaluations;
    }

    pub(super) fn count_switch(&mut self) {
        self.switches += 1;
    }

    /// A step of `h` (s) has brought the time to `time` (s).
    pub(super) fn earn(&mut self, h: f64, time: f64) {
        self.steps += 1;
        self.left += PER_SECOND * h;
        if self.left >= RESERVE {
            *self = Self::full(time);
        }
    }

    /// Whether there is something left; if not, what has become of it.
    ///
    /// # Errors
    /// Nothing is left at `time` (s), where the state is `y`.
    pub(super) fn check(&self, time: f64, y: &[f64]) -> Result<(), IntegrationError> {
        let Self { left, since, evaluations, steps, switches } = *self;
        if left >= 0.0 {
            return Ok(());
        }
        let state = y.to_vec();
        Err(if 2 * switches > steps {
            IntegrationError::Chatter { switches, since, time, state }
        } else {
            IntegrationError::TooMuchWork { evaluations, steps, since, time, state }
        })
    }
}
