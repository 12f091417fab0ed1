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

impl Step<'_> {
    /// A third of the way, where a straight line is good enough to take slopes at.
    pub(crate) fn inner_point(&self, point: &mut [f64]) {
        for (slot, (a, b)) in point.iter_mut().zip(self.from.iter().zip(self.to)) {
            *slot = (2.0 * a + b) / 3.0;
        }
    }

    pub(crate) fn inner_time(&self) -> f64 {
        self.time + self.interval / 3.0
    }

    pub(crate) fn end_time(&self) -> f64 {
        self.time + self.interval
    }
}

/// Solver of the variational equation `Ẋ = (∂f/∂x) X + ∂f/∂w` (`w`: latents or parameters) over one interval, by the two-stage Radau IIA method.
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
        Self { model, point: vec![0.0; n], inner: Jacobian::default(), end: Jacobian::default(), system: Vec::new() }
    }

    /// Writes `∂x(end)/∂(x, latents)(start)`, `states × (states + LATENTS)` by rows.
    pub(crate) fn transition(&mut self, step: &Step<'_>, target: &mut [f64]) {
        self.update(step);
        let (inner, end, system) = (&self.inner, &self.end, &mut self.system);
        let forced = Forced { inner: &inner.by_input, end: &end.by_input, columns: LATENTS };
        vectorised!(FUSED => solve::<FUSED>(inner, end, step.interval, &forced, true, system, target));
    }

    /// Writes what `forced` rates add to the states at the end of the interval, `states × columns` by rows.
    pub(crate) fn response(&mut self, step: &Step<'_>, forced: &Forced<'_>, target: &mut [f64]) {
        self.update(step);
        let (inner, end, system) = (&self.inner, &self.end, &mut self.system);
        vectorised!(FUSED => solve::<FUSED>(inner, end, step.interval, forced, false, system, target));
    }

    /// Takes up the slopes over an interval.
    fn update(&mut self, step: &Step<'_>) {
        step.inner_point(&mut self.point);
        let plant = &self.model.plant;
        self.inner.update(plant, step.inner_time(), &self.point, &step.felt, step.slack);
        self.end.update(plant, step.end_time(), step.to, &step.felt, step.slack);
    }
}

/// What is added to the rates of the states, `columns` numbers a state: a third into an interval and at its end.
pub(crate) struct Forced<'a> {
    pub(crate) inner: &'a [f64],
    pub(crate) end: &'a [f64],
    pub(crate) columns: usize,
}

/// Sets the system up and solves it: for the states at the start, if asked for, and for what is forced.
#[inline(always)]
fn solve<const FUSED: bool>(
    inner: &Jacobian,
    end: &Jacobian,
    h: f64,
    forced: &Forced<'_>,
    states: bool,
    system: &mut Vec<f64>,
    target: &mut [f64],
) {
    let (n, columns) = (inner.dimension, forced.columns);
    let own = if states { n } else { 0 };
    let width = n + own + columns;
    system.resize(n * width, 0.0);
    for (r, row) in system.chunks_exact_mut(width).enumerate() {
        let (left, right) = row.split_at_mut(n);
        let (of_states, of_forced) = right.split_at_mut(own);
        left.fill(0.0);
        let slopes = &inner.by_state[r * n..(r + 1) * n];
        // J₁ J₂ and J₁ W₂, by the entries of J₁ that are not zero: most are.
        of_forced.fill(0.0);
        for (c, &slope) in slopes.iter().enumerate() {
            if slope != 0.0 {
                add::<FUSED>(left, slope, &end.by_state[c * n..(c + 1) * n]);
                add::<FUSED>(of_forced, slope, &forced.end[c * columns..(c + 1) * columns]);
            }
        }
        for (c, slot) in left.iter_mut().enumerate() {
            *slot = h * h / 6.0 * *slot - 5.0 / 12.0 * h * slopes[c] - 0.25 * h * end.by_state[r * n + c];
        }
        left[r] += 1.0;
        for (slot, slope) in of_states.iter_mut().zip(slopes) {
            *slot = h / 3.0 * slope;
        }
        if states {
            of_states[r] += 1.0;
        }
        for (c, slot) in of_forced.iter_mut().enumerate() {
            let at = r * columns + c;
            *slot = 0.75 * h * forced.inner[at] + 0.25 * h * forced.end[at] - h * h / 6.0 * *slot;
        }
    }
    eliminate::<FUSED>(system, n, width);
    for (row, out) in system.chunks_exact(width).zip(target.chunks_exact_mut(own + columns)) {
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
