//! What the plant's equations cost, by which the integrator's methods are compared: in evaluations of the rates of lumped masses
//! without effects (65 ns). Counted from the model, not timed, so that a run can be repeated bit for bit.

use crate::effect::LawPart;
use crate::integrator::Cost;

use super::{CableEffect, CableEffects, Plant};

/// What one effect adds to an evaluation on all cables, from motions of a plant with that effect alone; as far as rounded means
/// tell.
const LAG: f64 = 0.3;
const COMMAND: f64 = 0.1;
const LOSS: f64 = 0.6;
const PULL: f64 = 0.3;
const LAW: f64 = 0.5;
/// A law under which tension is found by iteration.
const ITERATED_LAW: f64 = 3.0;
const TRANSVERSE: f64 = 0.1;
/// A wrench on the platform.
const WRENCH: f64 = 0.15;
/// Tensions that depend on accelerations: massless springs, rigid cables.
const PLATFORM_SIDE: f64 = 0.4;

/// Derivatives without effects; those of cables that take dual numbers add [`DUALS`], and what is dearer in an evaluation is so
/// many times dearer in them, but for an iteration, whose derivatives need none.
const DERIVATIVES: f64 = 12.0;
const DUALS: f64 = 11.0;
const DEARER: f64 = 10.0;
const DEARER_BY_ITERATION: f64 = 3.5;

impl Plant {
    /// What its equations cost.
    pub(crate) fn cost(&self) -> Cost {
        let of_all = |on_cable: &dyn Fn(&CableEffects) -> f64| {
            self.cable.iter().map(on_cable).sum::<f64>() / self.cable.len() as f64
        };
        let iterated = |c: &CableEffects| c.law.that_change(LawPart::Shape).len();
        let on_cables = of_all(&|c| {
            let command = |(kind, _): &CableEffect| if kind.states() > 0 { LAG } else { COMMAND };
            let laws = c.law.len() - iterated(c);
            c.command.iter().map(command).sum::<f64>()
                + LOSS * c.loss.len() as f64
                + PULL * c.pull.len() as f64
                + LAW * laws as f64
                + TRANSVERSE * (c.transverse.len() + c.swing.len()) as f64
        });
        let iterated = ITERATED_LAW * of_all(&|c| iterated(c) as f64);
        let platform_side = if self.has.platform_side { PLATFORM_SIDE } else { 0.0 };
        let added = on_cables + WRENCH * self.wrench.len() as f64 + platform_side;
        let duals = DUALS * of_all(&|c| f64::from(u8::from(self.has.servo || !c.is_empty())));
        Cost {
            evaluation: 1.0 + added + iterated,
            derivatives: DERIVATIVES + duals + DEARER * added + DEARER_BY_ITERATION * iterated,
        }
    }
}
