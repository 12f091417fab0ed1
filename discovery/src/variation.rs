//! How deviations from a trajectory, and latent disturbances, grow over one sampling interval.

use cdpr::dynamics::{Inputs, Jacobian};
use cdpr::parameters::CABLES;

use crate::model::{Examined, LATENTS};
use crate::vector::{add, vectorised};

/// One sampling interval: a step of the model between two states, under inputs that are held.
pub(crate) struct Step<'a> {
    pub(crate) time: f64,
    pub(crate) interval: f64,
    pub(crate) from: &'a [f64],
    pub(crate) to: &'a [f64],
    pub(crate) felt: Inputs,
    pub(crate) slack: [bool; CABLES],
}

/// Solver of the variational equation `Ẋ = (∂f/∂x) X + ∂f/∂w` over one interval, by the two-stage Radau IIA method.
///
/// Order 3 and L-stable: friction near rest and hard springs decay as they should. For a linear equation the two stages
/// reduce to one system, `(I - 5/12 hJ₁ - 1/4 hJ₂ + 1/6 h²J₁J₂) X = I + 1/3 hJ₁`, with `J₁` a third into the interval and
/// `J₂` at its end (the method: E. Hairer and G. Wanner, Solving Ordinary Differential Equations II, section IV.5).
pub(crate) struct Variation<'a> {
    model: &'a Examined,
    point: Vec<f64>,
    inner: Jacobian,
    end: Jacobian,
    /// The system and, beside it, its right-hand sides, by rows.
    system: Vec<f64>,
}

impl<'a> Variation<'a> {
    pub(crate) fn new(model: &'a Examined) -> Self {
        let n = model.states();
        let system = vec![0.0; n * (2 * n + LATENTS)];
        Self { model, point: vec![0.0; n], inner: Jacobian::default(), end: Jacobian::default(), system }
    }

    /// Writes `∂x(end)/∂(x, latents)(start)`, `states × (states + LATENTS)` by rows.
    pub(crate) fn transition(&mut self, step: &Step<'_>, target: &mut [f64]) {
        let h = step.interval;
        // A third of the way, a straight line is good enough to take slopes at.
        for (slot, (a, b)) in self.point.iter_mut().zip(step.from.iter().zip(step.to)) {
            *slot = (2.0 * a + b) / 3.0;
        }
        self.inner.update(&self.model.plant, step.time + h / 3.0, &self.point, &step.felt, step.slack);
        self.end.update(&self.model.plant, step.time + h, step.to, &step.felt, step.slack);
        let (inner, end, system) = (&self.inner, &self.end, &mut self.system);
        vectorised!(FUSED => solve::<FUSED>(inner, end, h, system, target));
    }
}

/// Sets the system up and solves it.
#[inline(always)]
fn solve<const FUSED: bool>(inner: &Jacobian, end: &Jacobian, h: f64, system: &mut [f64], target: &mut [f64]) {
    let n = inner.dimension;
    let width = 2 * n + LATENTS;
    for r in 0..n {
        let row = &mut system[r * width..(r + 1) * width];
        let (left, right) = row.split_at_mut(n);
        let (of_states, of_latents) = right.split_at_mut(n);
        left.fill(0.0);
        let slopes = &inner.by_state[r * n..(r + 1) * n];
        // J₁ J₂ and J₁ W₂, by the entries of J₁ that are not zero: most are.
        of_latents.fill(0.0);
        for (c, &slope) in slopes.iter().enumerate() {
            if slope != 0.0 {
                add::<FUSED>(left, slope, &end.by_state[c * n..(c + 1) * n]);
                add::<FUSED>(of_latents, slope, &end.by_input[c * LATENTS..(c + 1) * LATENTS]);
            }
        }
        for (c, slot) in left.iter_mut().enumerate() {
            *slot = h * h / 6.0 * *slot - 5.0 / 12.0 * h * slopes[c] - 0.25 * h * end.by_state[r * n + c];
        }
        left[r] += 1.0;
        for (slot, slope) in of_states.iter_mut().zip(slopes) {
            *slot = h / 3.0 * slope;
        }
        of_states[r] += 1.0;
        for (c, slot) in of_latents.iter_mut().enumerate() {
            let at = r * LATENTS + c;
            *slot = 0.75 * h * inner.by_input[at] + 0.25 * h * end.by_input[at] - h * h / 6.0 * *slot;
        }
    }
    eliminate::<FUSED>(system, n, width);
    for (row, out) in system.chunks_exact(width).zip(target.chunks_exact_mut(n + LATENTS)) {
        out.copy_from_slice(&row[n..]);
    }
}

/// Gauss-Jordan elimination with row pivoting of `n` rows of `width`, the matrix first, the right-hand sides after it.
///
/// Singular only for an unstable mode of exactly the wrong growth; a deviation that is not carried on is then lost for one
/// sample.
#[inline(always)]
fn eliminate<const FUSED: bool>(system: &mut [f64], n: usize, width: usize) {
    for c in 0..n {
        let size = |r: usize| system[r * width + c].abs();
        let Some(pivot) = (c..n).max_by(|a, b| size(*a).total_cmp(&size(*b))).filter(|r| size(*r) > 0.0) else {
            system.fill(0.0);
            return;
        };
        let (before, rest) = system.split_at_mut(c * width);
        let (row, after) = rest.split_at_mut(width);
        if pivot > c {
            row.swap_with_slice(&mut after[(pivot - c - 1) * width..(pivot - c) * width]);
        }
        let inverse = 1.0 / row[c];
        row[c..].iter_mut().for_each(|value| *value *= inverse);
        for other in before.chunks_exact_mut(width).chain(after.chunks_exact_mut(width)) {
            let factor = -other[c];
            if factor != 0.0 {
                add::<FUSED>(&mut other[c..], factor, &row[c..]);
            }
        }
    }
}
