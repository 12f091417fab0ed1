//! The number type of the physics: `f64`, or a dual number that carries an exact derivative.

use num_dual::DualNum;

/// A real number, or a dual number over the reals.
///
/// The equations of the plant are written once, generic over this trait. With `f64` they run in the integrator; with
/// [`num_dual::Dual64`] they give exact directional derivatives (linearisation, `fmi2GetDirectionalDerivative`).
pub trait Real: DualNum<Primitive = f64> + Copy {}

impl<T: DualNum<Primitive = f64> + Copy> Real for T {}
