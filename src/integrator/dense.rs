//! Newton's matrices as dense LU factors, for systems without a structure of their own.

use nalgebra::{DMatrix, DVector, Dyn, LU};

use super::Complex64;

/// Dense factors of the two matrices that a [`System`](super::System) solves with. Before they are formed, and where a matrix is
/// singular, solutions are not numbers: no step converges with them.
#[derive(Clone, Debug, Default)]
pub struct DenseFactors {
    real: Option<LU<f64, Dyn, Dyn>>,
    complex: Option<LU<Complex64, Dyn, Dyn>>,
}

impl DenseFactors {
    /// Factors `real I - J` and `complex I - J` of a square Jacobian `J`.
    pub fn factor(&mut self, jacobian: &DMatrix<f64>, real: f64, complex: Complex64) {
        let n = jacobian.nrows();
        self.real = Some((DMatrix::identity(n, n) * real - jacobian).lu());
        self.complex = Some((DMatrix::from_diagonal_element(n, n, complex) - jacobian.map(Complex64::from)).lu());
    }

    /// As [`System::solve_real`](super::System::solve_real). Returns whether the matrix is regular.
    pub fn solve_real(&self, b: &mut [f64]) -> bool {
        let mut v = DVector::from_column_slice(b);
        let regular = self.real.as_ref().is_some_and(|lu| lu.solve_mut(&mut v));
        if regular {
            b.copy_from_slice(v.as_slice());
        } else {
            b.fill(f64::NAN);
        }
        regular
    }

    /// As [`System::solve_complex`](super::System::solve_complex). Returns whether the matrix is regular.
    pub fn solve_complex(&self, re: &mut [f64], im: &mut [f64]) -> bool {
        let mut v = DVector::from_fn(re.len(), |k, _| Complex64::new(re[k], im[k]));
        let regular = self.complex.as_ref().is_some_and(|lu| lu.solve_mut(&mut v));
        if !regular {
            v.fill(Complex64::new(f64::NAN, f64::NAN));
        }
        for (k, value) in v.iter().enumerate() {
            (re[k], im[k]) = (value.re, value.im);
        }
        regular
    }
}
