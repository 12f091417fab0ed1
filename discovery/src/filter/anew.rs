//! Trajectories that are begun anew where those that are there do not settle.

use cdpr::model_file::Model;
use rayon::prelude::*;

use crate::data::Trial;
use crate::filter::error::FitError;
use crate::filter::estimate::{Fit, for_trial};
use crate::filter::kalman::Randomness;
use crate::filter::kalman::forward::forward;
use crate::model::examined::Examined;

/// Most moves of trajectories that are begun anew: they begin near where they settle, if the model is near the data.
const MOVES: usize = 4;

impl Fit {
    /// Trajectories of `model` by a filter that runs forward with it, from the data alone.
    ///
    /// # Errors
    /// When the model cannot be simulated from where the data leave it.
    pub(crate) fn forward(model: &Model, trials: &[Trial], randomness: &Randomness) -> Result<Self, FitError> {
        let examined = Examined::new(model).map_err(|e| FitError::Model(e.to_string()))?;
        let forward = |trial: &Trial| {
            let first = examined.first_states(trial);
            let trajectory = forward(&examined, trial, &first, &for_trial(randomness, trial))?;
            Ok((first, trajectory))
        };
        let begun = trials.par_iter().map(forward).collect::<Result<Vec<_>, FitError>>()?;
        Self::along_trajectories(model, examined, trials, begun, randomness.clone())
    }

    /// Takes trajectories that are begun anew in the place of its own, if they are better. Where they cannot be had its own stay, and
    /// say what there is to say.
    pub(crate) fn or_anew(&mut self, trials: &[Trial]) {
        let anew = Self::forward(&self.model, trials, &self.randomness).and_then(|mut anew| {
            anew.settle(trials, MOVES)?;
            Ok(anew)
        });
        if let Ok(anew) = anew
            && anew.stands_before(self, trials)
        {
            *self = anew;
        }
    }

    /// Whether its trajectories are to be taken before those of another fit of the same model: what has not settled has no likelihood.
    pub(crate) fn stands_before(&self, other: &Self, trials: &[Trial]) -> bool {
        let value = |fit: &Self| fit.minus_two_log_likelihood(trials, &fit.randomness);
        match (self.has_settled(), other.has_settled()) {
            (true, false) => true,
            (false, true) => false,
            _ => value(self) < value(other),
        }
    }
}
