//! The plant's equations as a peer calls them.

use std::sync::Arc;

use cdpr::dynamics::{Inputs, Jacobian};
use cdpr::per_cable::PerCable;
use cdpr::plant::Plant;

use crate::case::Case;

/// A plant under inputs that are held.
pub(crate) struct Rates {
    plant: Arc<Plant>,
    pub(crate) inputs: Inputs,
    taut: PerCable<bool>,
    slackens: bool,
    jacobian: Jacobian,
}

impl Rates {
    pub(crate) fn new(case: &Case) -> Self {
        let (plant, cables) = (case.plant().clone(), case.plant().cables());
        Self {
            plant,
            inputs: Inputs::none(cables),
            taut: PerCable::filled(cables, false),
            slackens: case.slackens,
            jacobian: Jacobian::default(),
        }
    }

    /// Rates at time `t` (s) and states `y`. Where cables go slack they are found anew at each evaluation: peers do not look for the
    /// time at which they do.
    #[inline]
    pub(crate) fn at(&self, t: f64, y: &[f64], rates: &mut [f64]) {
        self.plant.rates(t, y, &self.inputs, &self.slack(t, y), rates);
    }

    #[inline]
    fn slack(&self, t: f64, y: &[f64]) -> PerCable<bool> {
        if self.slackens { self.plant.slack_cables(t, y, &self.inputs) } else { self.taut }
    }

    /// The derivatives of the rates by the states there, by rows.
    #[cfg(feature = "sundials")]
    pub(crate) fn derivatives(&mut self, t: f64, y: &[f64]) -> &[f64] {
        let slack = self.slack(t, y);
        self.jacobian.update(&self.plant, t, y, &self.inputs, &slack);
        &self.jacobian.by_state
    }
}
