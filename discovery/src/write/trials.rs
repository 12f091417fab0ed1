//! Which channels and trials there are.

use crate::data::Channel;
use crate::outcome::{Compared, Discovery};

/// Every channel of any trial, in the order of [`Channel::all`].
pub(super) fn all_channels(discovery: &Discovery) -> Vec<Channel> {
    let cables = discovery.base.parameters.cables();
    Channel::all(cables).into_iter().filter(|c| discovery.trials.iter().any(|t| t.trial.channels.contains(c))).collect()
}

/// Where each training trial stands among all trials.
pub(super) fn training_trials(trials: &[Compared]) -> Vec<usize> {
    (0..trials.len()).filter(|t| !trials[*t].holdout).collect()
}
