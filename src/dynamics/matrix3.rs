//! Three by three linear algebra over any field, without pivoting loops or allocation.

use num_traits::NumAssign;

/// `f64`, complex or dual numbers.
pub(crate) trait Field: NumAssign + Copy {}
impl<T: NumAssign + Copy> Field for T {}

pub(crate) type Matrix3<F> = [[F; 3]; 3];

/// Inverse by cofactors. The matrices here are mass matrices plus small terms, far from singular.
#[inline]
pub(crate) fn inverse<F: Field>(m: &Matrix3<F>) -> Matrix3<F> {
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
pub(crate) fn product<F: Field>(m: &Matrix3<F>, v: &[F; 3]) -> [F; 3] {
    [dot(&m[0], v), dot(&m[1], v), dot(&m[2], v)]
}

#[inline]
pub(crate) fn dot<F: Field>(a: &[F; 3], b: &[F; 3]) -> F {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// `m += a bᵀ · factor`.
#[inline]
pub(crate) fn add_outer<F: Field>(m: &mut Matrix3<F>, a: &[F; 3], b: &[F; 3], factor: F) {
    for (row, &ai) in m.iter_mut().zip(a) {
        let scaled = ai * factor;
        for (entry, &bj) in row.iter_mut().zip(b) {
            *entry += scaled * bj;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
