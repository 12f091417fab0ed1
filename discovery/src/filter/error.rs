//! Why a model cannot be fitted.

use cdpr::integrator::IntegrationError;

/// Why a model cannot be fitted.
#[derive(Debug, thiserror::Error)]
pub enum FitError {
    /// The model cannot be built.
    #[error("the model cannot be built: {0}")]
    Model(String),
    /// The model cannot be simulated along the data.
    #[error("the model cannot be simulated along the data: {0}")]
    Simulation(IntegrationError),
    /// The trajectory that should fit the data has run away from them.
    #[error("{trial}: the model's trajectory does not settle near the data at {time} s")]
    Diverged {
        /// The trial.
        trial: String,
        /// Time in it (s).
        time: f64,
    },
    /// A variation of the model has rates, or shows something, that is no number.
    #[error("{trial}: it gives values that are not finite")]
    NotFinite {
        /// The trial.
        trial: String,
    },
}
