//! The ends of a step without what rings in it.
//!
//! The light end of a short cable rings faster than samples are taken, and each new force starts it again: at a sample its force is
//! out of balance by as much as the force has jumped, between samples it is in balance. What a law adds by its acceleration, its
//! rate or the rate of its strain is then to be taken where it moves as the chord does, its force in balance with that: the slow
//! manifold of singular perturbations (P. Kokotović, H. K. Khalil, J. O'Reilly, Singular Perturbation Methods in Control, 1999).

use crate::filter::variation::{Moving, Step, Variation};
use crate::model::examined::Examined;

/// The states at both ends of each of so many steps of `base`, one after the other, without what rings in it; empty where nothing
/// rings.
pub(super) fn slow_ends<'s>(base: &Examined, steps: usize, step: impl Fn(usize) -> Step<'s>) -> Vec<f64> {
    let n = base.states();
    let mut variation = Variation::new(base);
    if steps == 0 || variation.ringing(&step(0)).1.iter().all(Option::is_none) {
        return Vec::new();
    }
    let mut ends = Vec::with_capacity(2 * n * steps);
    let mut rates = vec![0.0; n];
    for k in 0..steps {
        let step = step(k);
        let places = [(step.time, step.from), (step.end_time(), step.to)];
        let [before, after] = places.map(|(time, y)| base.plant.evaluate(time, y, &step.felt, &step.slack).kinematics);
        let (moving, ringing) = variation.ringing(&step);
        let of_cable = |(moving, stiffness): (&'_ Moving, Option<f64>)| {
            Some((moving.position, moving.rate, moving.cable?, stiffness?))
        };
        let ringing: Vec<(usize, usize, usize, f64)> = moving.iter().zip(ringing).filter_map(of_cable).collect();
        for ((time, y), kinematics) in places.into_iter().zip([&before, &after]) {
            let first = ends.len();
            ends.extend_from_slice(y);
            let y = &mut ends[first..];
            for (_, rate, cable, _) in &ringing {
                y[*rate] = kinematics[*cable].speed;
            }
            base.plant.rates(time, y, &step.felt, &step.slack, &mut rates);
            for (length, rate, cable, stiffness) in &ringing {
                let acceleration = (after[*cable].speed - before[*cable].speed) / step.interval;
                y[*length] += (rates[*rate] - acceleration) / stiffness;
            }
        }
    }
    ends
}
