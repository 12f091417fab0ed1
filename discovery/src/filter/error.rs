//! Why a model cannot be fitted.

use cdpr::integrator::IntegrationError;

/// Why a model cannot be fitted.
#[derive(Debug, thiserror::Error)]
pub enum FitError {
    /// The model cannot be built.
    #[error("the model cannot be built: {0}")]
    Model(String),
    /// The model cannot be simulated along the data.
    #[error("the model cannot be simulated along the data: {}", without_states(.0))]
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
    /// The time of a search is over, and nothing is fitted any more.
    #[error("the time of the search is over")]
    OutOfTime,
}

/// What failed and when. The states there are a trajectory's on its way, which say nothing to a reader of recordings.
fn without_states(error: &IntegrationError) -> String {
    let text = error.to_string();
    text.split_once("; state ").map_or(text.clone(), |(said, _)| said.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::recording::{fitted, record};

    /// A remark of the report ended with eighteen numbers.
    #[test]
    fn why_a_simulation_failed_is_said_without_its_states() {
        let trials = [record(&[], 5.0, 1)];
        let fit = fitted(&[], &trials);
        let mut states = fit.trajectories[0].states(0).to_vec();
        states[fit.examined.plant.unstretched_index(2).expect("a length")] = -1.0;
        let mut simulation = fit.examined.simulation(&trials[0], 0, &states);
        let error = FitError::Simulation(simulation.advance(0.1).expect_err("a cable without length"));
        let text = error.to_string();
        assert!(text.contains("wound in to its end") && text.contains("at t = ") && !text.contains("state"), "{text}");
    }
}
