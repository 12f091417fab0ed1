//! What an integration has cost, and why it stopped.

/// What the integration has cost so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Statistics {
    /// Steps accepted, among them those that end at a switch.
    pub steps: u64,
    /// Steps rejected by the error estimate.
    pub rejections: u64,
    /// Steps given up because Newton's method did not converge.
    pub newton_failures: u64,
    /// Newton iterations, the first guess not counted.
    pub newton_iterations: u64,
    /// Evaluations of the right-hand side, those to locate switches not counted.
    pub evaluations: u64,
    /// Jacobians.
    pub jacobians: u64,
    /// Factorisations (one real and one complex together).
    pub factorisations: u64,
    /// Switches located.
    pub switches: u64,
}

/// Why the integration stopped, with the time reached; the state handed in is the one at that time.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum IntegrationError {
    /// The duration asked for is negative or not finite.
    #[error("asked to advance by {duration} s at t = {time} s, expected a finite duration of 0 or more")]
    Duration {
        /// What was asked for (s).
        duration: f64,
        /// Time reached (s).
        time: f64,
    },
    /// The step size became too small.
    #[error("{reason} down to a step of {step:e} s at t = {time} s; state {state:?}")]
    StepTooSmall {
        /// What failed at the smallest step.
        reason: &'static str,
        /// Last step size tried (s).
        step: f64,
        /// Time reached (s).
        time: f64,
        /// State there.
        state: Vec<f64>,
    },
    /// The equations give no finite rates.
    #[error("the equations give no finite rates at t = {time} s; state {state:?}")]
    NotFinite {
        /// Time reached (s).
        time: f64,
        /// State there.
        state: Vec<f64>,
    },
    /// The equations do not hold at the state reached.
    #[error("{reason} at t = {time} s; state {state:?}")]
    OutOfBounds {
        /// What is wrong with the state.
        reason: &'static str,
        /// Time reached (s).
        time: f64,
        /// State there.
        state: Vec<f64>,
    },
    /// The time hardly moves on for all the work: the equations ask for steps too small to get anywhere.
    #[error(
        "{evaluations} evaluations have brought the time from {since} s to t = {time} s only, in {steps} steps; the forces or \
         their changes are too fast for the plant, or the tolerance is too tight; state {state:?}"
    )]
    TooMuchWork {
        /// Evaluations spent since the integration last kept up.
        evaluations: u64,
        /// Steps made with them.
        steps: u64,
        /// Time then (s).
        since: f64,
        /// Time reached (s).
        time: f64,
        /// State there.
        state: Vec<f64>,
    },
    /// The same, where most steps ended at a switch.
    #[error("{switches} switches have brought the time from {since} s to t = {time} s only; state {state:?}")]
    Chatter {
        /// Switches since the integration last kept up.
        switches: u64,
        /// Time then (s).
        since: f64,
        /// Time reached (s).
        time: f64,
        /// State there.
        state: Vec<f64>,
    },
}

impl IntegrationError {
    /// Time reached (s).
    pub fn time(&self) -> f64 {
        match self {
            Self::Duration { time, .. }
            | Self::StepTooSmall { time, .. }
            | Self::NotFinite { time, .. }
            | Self::OutOfBounds { time, .. }
            | Self::TooMuchWork { time, .. }
            | Self::Chatter { time, .. } => *time,
        }
    }
}
