//! Trajectories from the data alone, where no other fit is known to start from.

use cdpr::model_file::Model;

use crate::data::Trial;
use crate::filter::error::FitError;
use crate::filter::estimate::Fit;
use crate::filter::kalman::Randomness;
use crate::instruments;
use crate::instruments::latents::first_randomness;
use crate::journal::Journal;
use crate::model::examined::Examined;
use crate::strategy::fitted::Evidence;
use crate::strategy::policy::POLICY;

/// Trajectories of `model` on the training data, from these alone, and the sizes of what is random along them.
pub(crate) fn begun_by_data(evidence: &Evidence, model: &Model, journal: &Journal) -> Result<Fit, FitError> {
    let Evidence { train: trials, noise, instruments: known, .. } = evidence;
    let first = first_randomness(model, trials, noise);
    let randomness = match known {
        Some(known) => Randomness { force: first.force, winch: first.winch, ..known.clone() },
        None => {
            let examined = Examined::new(model).map_err(|e| FitError::Model(e.to_string()))?;
            Randomness { late: instruments::late_lengths(&examined, trials), ..first }
        }
    };
    let mut train = Fit::new(model, trials, &randomness, None)?;
    go_as_far(&mut train, trials, 1, journal)?;
    train.fit_randomness(trials, noise, true);
    // A model that has friction already is far from its trajectory at first.
    go_as_far(&mut train, trials, POLICY.first_moves, journal)?;
    Ok(train)
}

/// Trajectories of a model on the held-out data, from these alone.
pub(crate) fn held_by_data(evidence: &Evidence, train: &Fit, journal: &Journal) -> Result<Fit, FitError> {
    let held = &evidence.holdout;
    let mut holdout = Fit::new(&train.model, held, &train.randomness, None)?;
    go_as_far(&mut holdout, held, POLICY.first_moves, journal)?;
    Ok(holdout)
}

/// Settles trajectories that nothing else is known of, as far as they go: what is far from all that the model can do is
/// there to be explained.
fn go_as_far(fit: &mut Fit, trials: &[Trial], most: usize, journal: &Journal) -> Result<(), FitError> {
    let settled = fit.settle(trials, most);
    journal.or_remark("As it is, the model has no trajectory near the data", settled).map(|_| ())
}
