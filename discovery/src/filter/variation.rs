//! How deviations from a trajectory, and latent disturbances, grow over one sampling interval.

use cdpr::dynamics::{Inputs, Jacobian};
use cdpr::per_cable::PerCable;

use crate::filter::vector::{FULL, add, vectorised};
use crate::model::examined::Examined;

/// One sampling interval: a step of the model between two states, under inputs that are held.
pub(crate) struct Step<'a> {
    pub(crate) time: f64,
    pub(crate) interval: f64,
    pub(crate) from: &'a [f64],
    pub(crate) to: &'a [f64],
    pub(crate) felt: Inputs,
    pub(crate) slack: PerCable<bool>,
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
    /// Slopes by states and, beside them, by what is forced, `J₁ W₁` and `J₂ W₂`, by rows.
    slopes: [Vec<f64>; 2],
    /// The system and, beside it, its right-hand sides, by rows.
    system: Vec<f64>,
}

impl<'a> Variation<'a> {
    pub(crate) fn new(model: &'a Examined) -> Self {
        Self {
            model,
            point: vec![0.0; model.states()],
            inner: Jacobian::default(),
            end: Jacobian::default(),
            slopes: [Vec::new(), Vec::new()],
            system: Vec::new(),
        }
    }

    /// Writes `∂x(end)/∂(x, latents)(start)` by columns, each at the beginning of its part of `target`.
    pub(crate) fn transition(&mut self, step: &Step<'_>, target: &mut [f64]) {
        self.update(step);
        for (slopes, jacobian) in self.slopes.iter_mut().zip([&self.inner, &self.end]) {
            beside(slopes, jacobian, &jacobian.by_input, self.model.latents());
        }
        let (n, latents) = (self.inner.dimension, self.model.latents());
        let width = solve(&self.slopes, n, latents, step.interval, true, &mut self.system);
        let length = target.len() / (n + latents);
        let own = n.next_multiple_of(FULL);
        for (r, row) in self.system.chunks_exact(width).enumerate() {
            let values = row[own..own + n].iter().chain(&row[2 * own..]);
            for (value, column) in values.zip(target.chunks_exact_mut(length)) {
                column[r] = *value;
            }
        }
    }

    /// Writes what `forced` rates add to the states at the end of the interval, `states × columns` by rows.
    pub(crate) fn response(&mut self, step: &Step<'_>, forced: &Forced<'_>, target: &mut [f64]) {
        self.update(step);
        let (n, columns) = (self.inner.dimension, forced.columns);
        beside(&mut self.slopes[0], &self.inner, forced.inner, columns);
        beside(&mut self.slopes[1], &self.end, forced.end, columns);
        let width = solve(&self.slopes, n, columns, step.interval, false, &mut self.system);
        let own = n.next_multiple_of(FULL);
        for (row, out) in self.system.chunks_exact(width).zip(target.chunks_exact_mut(columns)) {
            out.copy_from_slice(&row[own..own + columns]);
        }
    }

    /// Takes up the slopes over an interval.
    fn update(&mut self, step: &Step<'_>) {
        step.inner_point(&mut self.point);
        let plant = &self.model.plant;
        self.inner.update(plant, step.inner_time(), &self.point, &step.felt, &step.slack);
        self.end.update(plant, step.end_time(), step.to, &step.felt, &step.slack);
    }
}

/// What is added to the rates of the states, `columns` numbers a state: a third into an interval and at its end.
pub(crate) struct Forced<'a> {
    pub(crate) inner: &'a [f64],
    pub(crate) end: &'a [f64],
    pub(crate) columns: usize,
}

/// Writes the slopes by states and, beside them, by what is forced, each part with zeros up to a full register.
fn beside(slopes: &mut Vec<f64>, jacobian: &Jacobian, forced: &[f64], columns: usize) {
    let n = jacobian.dimension;
    let own = n.next_multiple_of(FULL);
    let width = own + columns.next_multiple_of(FULL);
    slopes.resize(n * width, 0.0);
    let rows = jacobian.by_state.chunks_exact(n).zip(forced.chunks_exact(columns));
    for (target, (by_state, forced)) in slopes.chunks_exact_mut(width).zip(rows) {
        target[..n].copy_from_slice(by_state);
        target[own..own + columns].copy_from_slice(forced);
    }
}

/// Sets the system up and solves it, in the place of its right-hand sides: for the states at the start, if asked for, and
/// for what is forced. Returns the width of a row: the matrix, then each right-hand side, each part as wide as full registers
/// are, and what is left over.
fn solve(slopes: &[Vec<f64>; 2], n: usize, columns: usize, h: f64, states: bool, system: &mut Vec<f64>) -> usize {
    let own = n.next_multiple_of(FULL);
    let width = if states { 2 * own } else { own } + columns.next_multiple_of(FULL);
    macro_rules! in_rows_of {
        ($($size:literal)*) => {
            match width {
                $(..=$size => {
                    vectorised!(FUSED => in_rows::<$size, FUSED>(slopes, n, columns, h, states, system));
                    $size
                })*
                _ => unreachable!("the largest model has fewer states than this"),
            }
        };
    }
    // Rows of a fixed width, which the compiler puts into registers.
    in_rows_of!(16 24 32 40 56 64 72 136 232)
}

#[inline(always)]
fn in_rows<const ROW: usize, const FUSED: bool>(
    [inner, end]: &[Vec<f64>; 2],
    n: usize,
    columns: usize,
    h: f64,
    states: bool,
    system: &mut Vec<f64>,
) {
    let own = n.next_multiple_of(FULL);
    let given = own + columns.next_multiple_of(FULL);
    let first_forced = if states { 2 * own } else { own };
    system.resize(n * ROW, 0.0);
    let rows = system.as_chunks_mut::<ROW>().0;
    for (r, (row, (slopes, end_slopes))) in
        rows.iter_mut().zip(inner.chunks_exact(given).zip(end.chunks_exact(given))).enumerate()
    {
        row.fill(0.0);
        let (left, right) = row.split_at_mut(own);
        let (of_states, of_forced) = right.split_at_mut(first_forced - own);
        // J₁ J₂ and J₁ W₂, by the entries of J₁ that are not zero: most are.
        for (slope, end) in slopes[..n].iter().zip(end.chunks_exact(given)) {
            if *slope != 0.0 {
                add::<FUSED>(left, *slope, &end[..own]);
                add::<FUSED>(of_forced, *slope, &end[own..]);
            }
        }
        for (slot, (slope, end)) in left.iter_mut().zip(slopes.iter().zip(end_slopes)) {
            *slot = h * h / 6.0 * *slot - 5.0 / 12.0 * h * slope - 0.25 * h * end;
        }
        left[r] += 1.0;
        if states {
            for (slot, slope) in of_states.iter_mut().zip(slopes) {
                *slot = h / 3.0 * slope;
            }
            of_states[r] += 1.0;
        }
        for (slot, (inner, end)) in of_forced.iter_mut().zip(slopes[own..].iter().zip(&end_slopes[own..])) {
            *slot = 0.75 * h * inner + 0.25 * h * end - h * h / 6.0 * *slot;
        }
    }
    eliminate::<ROW, FUSED>(rows);
}

/// Gauss-Jordan elimination with row pivoting: as many columns as there are rows, the right-hand sides after them.
///
/// Singular only for an unstable mode of exactly the wrong growth; a deviation that is not carried on is then lost for one
/// sample.
#[inline(always)]
fn eliminate<const ROW: usize, const FUSED: bool>(rows: &mut [[f64; ROW]]) {
    for c in 0..rows.len() {
        let mut pivot = c;
        for r in c + 1..rows.len() {
            if rows[r][c].abs() > rows[pivot][c].abs() {
                pivot = r;
            }
        }
        if rows[pivot][c] == 0.0 {
            rows.fill([0.0; ROW]);
            return;
        }
        rows.swap(c, pivot);
        let inverse = 1.0 / rows[c][c];
        let row = rows[c].map(|value| value * inverse);
        for other in rows.iter_mut() {
            let factor = -other[c];
            if factor != 0.0 {
                for i in 0..ROW {
                    other[i] = if FUSED { factor.mul_add(row[i], other[i]) } else { other[i] + factor * row[i] };
                }
            }
        }
        rows[c] = row;
    }
}
