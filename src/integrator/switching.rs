//! Where the equations switch: the first crossing on the polynomial through a step.

use super::radau_coefficients::{C, transformed};
use super::vector::Work;
use super::{Integrator, System};

/// Fractions of a step at which switching functions are looked at.
const LOOKS: [f64; 6] = [0.0, C[0], 0.4, C[1], 0.85, 1.0];

/// The values of the switching functions at the looks.
#[derive(Clone, Debug, Default)]
pub(super) struct Looks {
    values: [Vec<f64>; LOOKS.len()],
    /// At one more place.
    between: Vec<f64>,
}

impl Looks {
    pub(super) fn new(switches: usize) -> Self {
        Self { values: std::array::from_fn(|_| vec![0.0; switches]), between: vec![0.0; switches] }
    }

    /// Whether a function has turned negative in `values`. One may be negative from the start, by rounding right after its own
    /// switch or at a step's end: then it counts as crossing where it falls further, not where it rises.
    fn crossed(&self, values: &[f64]) -> bool {
        values.iter().zip(&self.values[0]).any(|(v, start)| *v < start.min(0.0))
    }

    /// The first fraction of the step before look `last` where a parabola through a function at this look and the two before it
    /// is lowest, and below zero.
    fn dip_before(&self, last: usize) -> Option<f64> {
        let [first, middle] = [last.checked_sub(2)?, last - 1];
        let [x0, x1, x2] = [first, middle, last].map(|look| LOOKS[look]);
        let lowest = |s: usize| {
            let level = self.values[0][s].min(0.0);
            let [v0, v1, v2] = [first, middle, last].map(|look| self.values[look][s] - level);
            let (slope, next) = ((v1 - v0) / (x1 - x0), (v2 - v1) / (x2 - x1));
            let bend = (next - slope) / (x2 - x0);
            // Of `v0 + (x - x0) (slope + bend (x - x1))`.
            let x = 0.5 * (x0 + x1 - slope / bend);
            let value = v0 + (x - x0) * (slope + bend * (x - x1));
            (bend > 0.0 && x0 < x && x < x2 && value < 0.0).then_some(x)
        };
        (0..self.between.len()).filter_map(lowest).min_by(f64::total_cmp)
    }
}

impl Integrator {
    /// State at `fraction` of the step of `h` (s) just computed, into `stage`: on its collocation polynomial or dense output.
    pub(super) fn stage_at<const GROUPS: usize>(&self, work: &mut Work<GROUPS>, h: f64, fraction: f64) {
        if self.is_explicit() {
            return work.explicit_at(h, fraction);
        }
        let nodes = [0.0, C[0], C[1], C[2]];
        let mut weight = [0.0; 3];
        for s in 0..3 {
            let mut product = 1.0;
            for (m, node) in nodes.iter().enumerate() {
                if m != s + 1 {
                    product *= (fraction - node) / (nodes[s + 1] - node);
                }
            }
            weight[s] = product;
        }
        work.place(transformed(weight));
    }

    /// Fraction of the step at which a switching function first turns negative, to rounding.
    ///
    /// The functions are looked at in five places of the step, and between them where a parabola through three of the
    /// values dips below zero: one that turns negative and back is passed over only where it does so within what a parabola
    /// cannot show.
    pub(super) fn first_crossing<const GROUPS: usize>(
        &mut self,
        work: &mut Work<GROUPS>,
        system: &mut impl System,
        t: f64,
        h: f64,
    ) -> Option<f64> {
        if !system.suspects_switch() {
            return None;
        }
        let mut looks = std::mem::take(&mut self.looks);
        system.switching_functions(t, &work.start, &mut looks.values[0]);
        self.allowance.spend(1);
        let mut look = |integrator: &mut Self, fraction: f64, values: &mut [f64]| {
            integrator.stage_at(work, h, fraction);
            integrator.allowance.spend(1);
            system.switching_functions(t + fraction * h, &work.stage, values);
        };
        let mut bracket = None;
        for last in 1..LOOKS.len() {
            let mut values = std::mem::take(&mut looks.values[last]);
            look(self, LOOKS[last], &mut values);
            let crossed = looks.crossed(&values);
            looks.values[last] = values;
            if crossed {
                bracket = Some((LOOKS[last - 1], LOOKS[last]));
            }
            if let Some(dip) = looks.dip_before(last) {
                let mut values = std::mem::take(&mut looks.between);
                look(self, dip, &mut values);
                if looks.crossed(&values) {
                    bracket = Some((if dip < LOOKS[last - 1] { LOOKS[last - 2] } else { LOOKS[last - 1] }, dip));
                }
                looks.between = values;
            }
            if bracket.is_some() {
                break;
            }
        }
        let result = bracket.map(|(mut low, mut high)| {
            let mut values = std::mem::take(&mut looks.between);
            while high - low > 1e-12 && high * h - low * h > 1e-13 {
                let middle = 0.5 * (low + high);
                look(self, middle, &mut values);
                if looks.crossed(&values) {
                    high = middle;
                } else {
                    low = middle;
                }
            }
            looks.between = values;
            high
        });
        self.looks = looks;
        result
    }
}
