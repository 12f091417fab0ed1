//! Where the equations switch: the first crossing on the polynomial through a step.

use super::radau_coefficients::C;
use super::{Integrator, System};

impl Integrator {
    /// State at `fraction` of the step of `h` (s) just computed, into `stage`: on its collocation polynomial or dense output.
    pub(super) fn stage_at(&mut self, y: &[f64], h: f64, fraction: f64) {
        if self.is_explicit() {
            return self.explicit_at(h, fraction);
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
        for k in 0..y.len() {
            self.stage[k] = y[k] + weight[0] * self.z[0][k] + weight[1] * self.z[1][k] + weight[2] * self.z[2][k];
        }
    }

    /// Fraction of the step at which a switching function first turns negative, to rounding.
    ///
    /// The functions are looked at in five places of the step: one that turns negative and back between two of them is
    /// passed over.
    pub(super) fn first_crossing(&mut self, system: &mut impl System, t: f64, y: &[f64], h: f64) -> Option<f64> {
        if !system.suspects_switch() {
            return None;
        }
        let mut values = std::mem::take(&mut self.switch_values);
        let mut start = std::mem::take(&mut self.switch_start);
        // One may be negative from the start, by rounding right after its own switch or at a step's end: then it counts as
        // crossing where it falls further, not where it rises.
        system.switching_functions(t, y, &mut start);
        self.allowance.spend(1);
        let mut check = |integrator: &mut Self, fraction: f64| {
            integrator.stage_at(y, h, fraction);
            integrator.allowance.spend(1);
            system.switching_functions(t + fraction * h, &integrator.stage, &mut values);
            values.iter().zip(&start).any(|(v, s)| *v < s.min(0.0))
        };
        let mut low = 0.0;
        let mut high = None;
        for fraction in [C[0], 0.4, C[1], 0.85, 1.0] {
            if check(self, fraction) {
                high = Some(fraction);
                break;
            }
            low = fraction;
        }
        let result = high.map(|mut high| {
            while high - low > 1e-12 && high * h - low * h > 1e-13 {
                let middle = 0.5 * (low + high);
                if check(self, middle) {
                    high = middle;
                } else {
                    low = middle;
                }
            }
            high
        });
        self.switch_values = values;
        self.switch_start = start;
        result
    }
}
