//! How deviations from a trajectory, and latent disturbances, grow over one sampling interval.

use cdpr::dynamics::Inputs;
use cdpr::parameters::CABLES;
use nalgebra::DMatrix;

use crate::model::{Examined, LATENTS};

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
    /// Steps by which states are moved for differences.
    pub(crate) steps: Vec<f64>,
    rates: Vec<f64>,
    moved_rates: Vec<f64>,
    inner: Slopes,
    end: Slopes,
}

/// A point, and `∂f/∂x` and `∂f/∂w` there.
struct Slopes {
    point: Vec<f64>,
    states: DMatrix<f64>,
    latents: DMatrix<f64>,
}

impl Slopes {
    fn zeros(n: usize) -> Self {
        Self { point: vec![0.0; n], states: DMatrix::zeros(n, n), latents: DMatrix::zeros(n, LATENTS) }
    }
}

impl<'a> Variation<'a> {
    pub(crate) fn new(model: &'a Examined, steps: Vec<f64>) -> Self {
        let n = model.states();
        let (rates, moved_rates) = (vec![0.0; n], vec![0.0; n]);
        Self { model, steps, rates, moved_rates, inner: Slopes::zeros(n), end: Slopes::zeros(n) }
    }

    /// Writes `∂x(end)/∂(x, latents)(start)`, `states × (states + LATENTS)` by rows.
    pub(crate) fn transition(&mut self, step: &Step<'_>, target: &mut [f64]) {
        let (n, h) = (self.model.states(), step.interval);
        // A third of the way, a straight line is good enough to take slopes at.
        for (slot, (a, b)) in self.inner.point.iter_mut().zip(step.from.iter().zip(step.to)) {
            *slot = (2.0 * a + b) / 3.0;
        }
        self.end.point.copy_from_slice(step.to);
        let (steps, rates) = (&self.steps, [&mut self.rates, &mut self.moved_rates]);
        slopes(self.model, steps, step, step.time + h / 3.0, &mut self.inner, rates);
        let rates = [&mut self.rates, &mut self.moved_rates];
        slopes(self.model, steps, step, step.time + h, &mut self.end, rates);
        let (inner, end) = (&self.inner, &self.end);
        let left = DMatrix::identity(n, n) - &inner.states * (5.0 / 12.0 * h) - &end.states * (0.25 * h)
            + &inner.states * &end.states * (h * h / 6.0);
        let mut solution = DMatrix::zeros(n, n + LATENTS);
        solution.columns_mut(0, n).copy_from(&(DMatrix::identity(n, n) + &inner.states * (h / 3.0)));
        solution.columns_mut(n, LATENTS).copy_from(
            &(&inner.latents * (0.75 * h) + &end.latents * (0.25 * h) - &inner.states * &end.latents * (h * h / 6.0)),
        );
        // Singular only for an unstable mode of exactly the wrong growth; a deviation that is not carried on is then lost
        // for one sample.
        if !left.lu().solve_mut(&mut solution) {
            solution.fill(0.0);
        }
        for r in 0..n {
            for c in 0..n + LATENTS {
                target[r * (n + LATENTS) + c] = solution[(r, c)];
            }
        }
    }
}

/// Slopes of the rates at `at.point`, by differences.
fn slopes(
    model: &Examined,
    steps: &[f64],
    step: &Step<'_>,
    time: f64,
    at: &mut Slopes,
    [rates, moved]: [&mut Vec<f64>; 2],
) {
    let n = model.states();
    model.plant.rates(time, &at.point, &step.felt, step.slack, rates);
    for c in 0..n {
        let value = at.point[c];
        at.point[c] = value + steps[c];
        model.plant.rates(time, &at.point, &step.felt, step.slack, moved);
        at.point[c] = value;
        for r in 0..n {
            at.states[(r, c)] = (moved[r] - rates[r]) / steps[c];
        }
    }
    for l in 0..LATENTS {
        let size = if l == 2 { 100.0 } else { 10.0 };
        let mut inputs = step.felt;
        if l < 3 {
            inputs.disturbance[l] += size;
        } else {
            inputs.winch_force[l - 3] += size;
        }
        model.plant.rates(time, &at.point, &inputs, step.slack, moved);
        for r in 0..n {
            at.latents[(r, l)] = (moved[r] - rates[r]) / size;
        }
    }
}
