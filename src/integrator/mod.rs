//! Radau IIA of order 5 for stiff and implicit systems, and Dormand and Prince's explicit pair of orders 5 and 4 for others.
//!
//! One-step methods on purpose: inputs jump at every communication point, and saving the integrator is saving the
//! state, the last step sizes, the point of the last Jacobian and the rates at the end ([`Memory`]).
//!
//! The implicit method and its control follow E. Hairer, G. Wanner, *Solving Ordinary Differential Equations II*, 2nd ed., 1996,
//! sections IV.5 and IV.8; the step size control is K. Gustafsson's, *ACM Trans. Math. Softw.* 20 (1994).

mod advance;
mod allowance;
mod choice;
mod dense;
mod dormand_prince;
mod outcome;
mod radau;
mod radau_coefficients;
mod switching;
mod vector;

pub use advance::{Integrator, Memory};
pub use choice::{Choice, Cost};
pub use dense::DenseFactors;
pub use num_complex::Complex64;
pub use outcome::{IntegrationError, Statistics};
pub use radau::Contraction;
use serde::Deserialize;
pub use vector::MOST_STATES;

/// Which method integrates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Solver {
    /// Radau IIA of order 5: implicit, stable whatever the equations.
    #[default]
    Radau,
    /// Dormand and Prince's pair of orders 5 and 4: explicit. Where the equations are stiff, its steps are as short as stability
    /// asks for.
    DormandPrince,
    /// The one of the two that costs less for each second; Radau IIA at once where the equations prove to be stiff.
    Auto,
}

/// A system `ẏ = f(t, y)` that knows how to solve with its own Newton matrix, and where its equations switch.
pub trait System {
    /// Number of states.
    fn dimension(&self) -> usize;

    /// Writes `f(t, y)`.
    fn rates(&mut self, time: f64, y: &[f64], rates: &mut [f64]);

    /// What its equations cost: by this the methods are compared.
    fn cost(&self) -> Cost {
        Cost::default()
    }

    /// Writes the size of an error in each state that the relative tolerance 1 would allow.
    fn scale(&self, y: &[f64], scale: &mut [f64]);

    /// Whether the scale depends on the state; where it does not it is asked for once.
    fn scale_changes(&self) -> bool {
        true
    }

    /// Takes up `∂f/∂y` at this point, exactly or nearly.
    fn linearise(&mut self, time: f64, y: &[f64]);

    /// Factors `real I - ∂f/∂y` and `complex I - ∂f/∂y`.
    fn factor(&mut self, real: f64, complex: Complex64);

    /// Solves with the real factors, in place.
    fn solve_real(&mut self, b: &mut [f64]);

    /// Solves with the complex factors, in place; real and imaginary parts.
    fn solve_complex(&mut self, re: &mut [f64], im: &mut [f64]);

    /// Number of switching functions.
    fn switches(&self) -> usize {
        0
    }

    /// Whether a switching function may have turned negative since the last call, at the evaluations of the rates or between
    /// them; spares looking for crossings.
    fn suspects_switch(&mut self) -> bool {
        self.switches() > 0
    }

    /// Writes the switching functions: the equations in force hold while these are zero or positive.
    fn switching_functions(&mut self, _time: f64, _y: &[f64], _values: &mut [f64]) {}

    /// Changes over to the equations that hold from this point on.
    fn switch(&mut self, _time: f64, _y: &[f64]) {}

    /// Why the equations do not hold at this state, if they do not; asked after every step.
    fn out_of_bounds(&self, _y: &[f64]) -> Option<&'static str> {
        None
    }
}
