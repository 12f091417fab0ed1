//! What the plant's equations cost, by which the integrator's methods are compared: in evaluations of the rates of lumped masses
//! without effects (65 ns). Counted from the model, not timed, so that a run can be repeated bit for bit.

use crate::integrator::Cost;

use super::{CableEffect, CableEffects, Plant};

/// What one effect adds to an evaluation on all cables, from motions of a plant with that effect alone; as far as rounded means
/// tell.
const LAG: f64 = 0.6;
const COMMAND: f64 = 0.1;
const LOSS: f64 = 0.7;
const PULL: f64 = 0.4;
const LAW: f64 = 1.0;
/// A law under which tension is found by iteration.
const ITERATED_LAW: f64 = 3.0;
const TRANSVERSE: f64 = 0.2;
/// A wrench on the platform.
const WRENCH: f64 = 0.1;
/// Tensions that depend on accelerations: massless springs, rigid cables.
const PLATFORM_SIDE: f64 = 0.4;

/// Derivatives without effects; those of cables that take dual numbers add [`DUALS`], and what is dearer in an evaluation is so
/// many times dearer in them.
const DERIVATIVES: f64 = 12.0;
const DUALS: f64 = 11.0;
const DEARER: f64 = 4.0;

impl Plant {
    /// What its equations cost.
    pub(crate) fn cost(&self) -> Cost {
        let on_cable = |c: &CableEffects| {
            let command = |(kind, _): &CableEffect| if kind.states() > 0 { LAG } else { COMMAND };
            let law = |(kind, _): &CableEffect| if kind.has_chord_strain() { ITERATED_LAW } else { LAW };
            let across = c.transverse.len() + c.swing.len();
            c.command.iter().map(command).sum::<f64>()
                + LOSS * c.loss.len() as f64
                + PULL * c.pull.len() as f64
                + c.law.iter().map(law).sum::<f64>()
                + TRANSVERSE * across as f64
        };
        let on_cables = self.cable.iter().map(on_cable).sum::<f64>() / self.cable.len() as f64;
        let platform_side = if self.has.platform_side { PLATFORM_SIDE } else { 0.0 };
        let added = on_cables + WRENCH * self.wrench.len() as f64 + platform_side;
        let by_duals = self.cable.iter().filter(|c| self.has.servo || !c.is_empty()).count() as f64;
        let duals = DUALS * by_duals / self.cable.len() as f64;
        Cost { evaluation: 1.0 + added, derivatives: DERIVATIVES + duals + DEARER * added }
    }
}
