//! Three by three linear algebra over any field, without pivoting loops or allocation.

use std::ops::Neg;

use num_complex::Complex64;
use num_traits::NumAssign;

/// `f64`, complex or dual numbers.
pub(crate) trait Arithmetic: NumAssign + Neg<Output = Self> + Copy {}
impl<T: NumAssign + Neg<Output = Self> + Copy> Arithmetic for T {}

/// The real or complex numbers, with a product by a real number that costs no more than it must.
pub(crate) trait Field: Arithmetic + From<f64> {
    fn scale(self, factor: f64) -> Self;
}

impl Field for f64 {
    #[inline]
    fn scale(self, factor: f64) -> Self {
        self * factor
    }
}

impl Field for Complex64 {
    #[inline]
    fn scale(self, factor: f64) -> Self {
        Self::new(self.re * factor, self.im * factor)
    }
}

pub(crate) type Matrix3<F> = [[F; 3]; 3];

/// Inverse by cofactors. The matrices here are mass matrices plus small terms, far from singular.
#[inline]
pub(crate) fn inverse<F: Arithmetic>(m: &Matrix3<F>) -> Matrix3<F> {
    let c00 = m[1][1] * m[2][2] - m[1][2] * m[2][1];
    let c01 = m[1][2] * m[2][0] - m[1][0] * m[2][2];
    let c02 = m[1][0] * m[2][1] - m[1][1] * m[2][0];
    let scale = F::one() / (m[0][0] * c00 + m[0][1] * c01 + m[0][2] * c02);
    [
        [c00 * scale, (m[0][2] * m[2][1] - m[0][1] * m[2][2]) * scale, (m[0][1] * m[1][2] - m[0][2] * m[1][1]) * scale],
        [c01 * scale, (m[0][0] * m[2][2] - m[0][2] * m[2][0]) * scale, (m[0][2] * m[1][0] - m[0][0] * m[1][2]) * scale],
        [c02 * scale, (m[0][1] * m[2][0] - m[0][0] * m[2][1]) * scale, (m[0][0] * m[1][1] - m[0][1] * m[1][0]) * scale],
    ]
}

#[inline]
pub(crate) fn product<F: Arithmetic>(m: &Matrix3<F>, v: &[F; 3]) -> [F; 3] {
    [dot(&m[0], v), dot(&m[1], v), dot(&m[2], v)]
}

#[inline]
pub(crate) fn dot<F: Arithmetic>(a: &[F; 3], b: &[F; 3]) -> F {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// `a x + b y`.
#[inline]
pub(crate) fn combine(a: f64, x: &[f64; 3], b: f64, y: &[f64; 3]) -> [f64; 3] {
    std::array::from_fn(|k| a * x[k] + b * y[k])
}

/// `m += a bᵀ · factor`.
#[inline]
pub(crate) fn add_outer<F: Arithmetic>(m: &mut Matrix3<F>, a: &[F; 3], b: &[F; 3], factor: F) {
    for (row, &ai) in m.iter_mut().zip(a) {
        let scaled = ai * factor;
        for (entry, &bj) in row.iter_mut().zip(b) {
            *entry += scaled * bj;
        }
    }
}

/// A symmetric matrix by its upper triangle: `[m00, m01, m02, m11, m12, m22]`.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Symmetric3<F>(pub(crate) [F; 6]);

impl<F: Arithmetic> Symmetric3<F> {
    /// `self += a aᵀ · factor`.
    #[inline]
    pub(crate) fn add_square(&mut self, a: &[F; 3], factor: F) {
        let scaled = [a[0] * factor, a[1] * factor, a[2] * factor];
        self.0[0] += scaled[0] * a[0];
        self.0[1] += scaled[0] * a[1];
        self.0[2] += scaled[0] * a[2];
        self.0[3] += scaled[1] * a[1];
        self.0[4] += scaled[1] * a[2];
        self.0[5] += scaled[2] * a[2];
    }

    /// The solution `x` of `self x = b`, by cofactors.
    #[inline]
    pub(crate) fn solve(&self, b: &[F; 3]) -> [F; 3] {
        let [m00, m01, m02, m11, m12, m22] = self.0;
        let c00 = m11 * m22 - m12 * m12;
        let c01 = m02 * m12 - m01 * m22;
        let c02 = m01 * m12 - m02 * m11;
        let c11 = m00 * m22 - m02 * m02;
        let c12 = m01 * m02 - m00 * m12;
        let c22 = m00 * m11 - m01 * m01;
        let scale = F::one() / (m00 * c00 + m01 * c01 + m02 * c02);
        [
            (c00 * b[0] + c01 * b[1] + c02 * b[2]) * scale,
            (c01 * b[0] + c11 * b[1] + c12 * b[2]) * scale,
            (c02 * b[0] + c12 * b[1] + c22 * b[2]) * scale,
        ]
    }

    /// All nine entries.
    pub(crate) fn full(&self) -> Matrix3<F> {
        let [m00, m01, m02, m11, m12, m22] = self.0;
        [[m00, m01, m02], [m01, m11, m12], [m02, m12, m22]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn symmetric_solution_satisfies_the_system() {
        let mut m = Symmetric3([4.0_f64, 0.5, -1.0, 3.0, 0.25, 5.0]);
        m.add_square(&[1.0, -2.0, 0.5], 0.75);
        let b = [1.0, -2.0, 3.0];
        let back = product(&m.full(), &m.solve(&b));
        for k in 0..3 {
            assert!((back[k] - b[k]).abs() < 1e-14, "{back:?}");
        }
    }

    #[test]
    fn inverse_times_matrix_is_identity() {
        let m = [[4.0, 1.0, -2.0], [0.5, 3.0, 0.25], [-1.0, 2.0, 5.0]];
        let i = inverse(&m);
        for r in 0..3 {
            let column = [m[0][r], m[1][r], m[2][r]];
            let p = product(&i, &column);
            for k in 0..3 {
                assert!((p[k] - f64::from(u8::from(k == r))).abs() < 1e-15, "{p:?}");
            }
        }
    }
}
