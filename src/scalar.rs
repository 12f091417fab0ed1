//! The number type of the physics: `f64`, or a dual number that carries an exact derivative.

use num_dual::DualNum;

/// A real number, or a dual number over the reals.
///
/// The equations of the plant are written once, generic over this trait. With `f64` they run in the integrator; with
/// [`num_dual::Dual64`] they give exact directional derivatives (linearisation, `fmi2GetDirectionalDerivative`).
pub trait Real: DualNum<Primitive = f64> + Copy {}

impl<T: DualNum<Primitive = f64> + Copy> Real for T {}

/// Hyperbolic tangent, with a finite derivative everywhere.
///
/// As `(e²ˣ - 1)/(e²ˣ + 1)`, where dual numbers take `sinh/cosh`, which are four exponentials and overflow from 710 on;
/// beyond 20 it is ±1 to the last digit.
#[inline]
pub fn tanh<S: Real>(x: S) -> S {
    if x.re().abs() > 20.0 {
        return S::from(x.re().signum());
    }
    let grown = (x * 2.0).exp_m1();
    grown / (grown + 2.0)
}

#[cfg(test)]
mod tests {
    use num_dual::Dual64;

    use super::*;

    #[test]
    fn tanh_is_continuous_and_finite() {
        assert_eq!(tanh(20.0_f64), 20.0_f64.tanh());
        assert_eq!(tanh(-1e4_f64), -1.0);
        let far = tanh(Dual64::new(1e4, 1.0));
        assert_eq!((far.re, far.eps), (1.0, 0.0));
        let near = tanh(Dual64::new(0.5, 1.0));
        assert!((near.eps - (1.0 - 0.5_f64.tanh().powi(2))).abs() < 1e-15);
        assert!(tanh(f64::NAN).is_nan());
    }
}
