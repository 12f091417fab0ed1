//! Normal equations, solved.

use nalgebra::{DMatrix, DVector};

use crate::filter::whiten::Normal;

/// Least squares by scaled Cholesky: step and covariance; columns that say nothing get zero.
pub(crate) fn solve(normal: &Normal) -> (Vec<f64>, DMatrix<f64>) {
    let n = normal.columns;
    let scale: Vec<f64> = (0..n).map(|i| normal.gram[i * n + i].sqrt()).collect();
    let live: Vec<usize> = (0..n).filter(|i| scale[*i] > 1e-9).collect();
    let mut out = vec![0.0; n];
    let mut covariance = DMatrix::from_diagonal_element(n, n, f64::INFINITY);
    for i in 0..n {
        for j in 0..n {
            if i != j {
                covariance[(i, j)] = 0.0;
            }
        }
    }
    let k = live.len();
    if k == 0 {
        return (out, covariance);
    }
    let g = DMatrix::from_fn(k, k, |r, c| {
        normal.gram[live[r] * n + live[c]] / (scale[live[r]] * scale[live[c]]) + if r == c { 1e-10 } else { 0.0 }
    });
    let b = DVector::from_fn(k, |r, _| normal.right[live[r]] / scale[live[r]]);
    if let Some(cholesky) = g.cholesky() {
        let x = cholesky.solve(&b);
        let inverse = cholesky.inverse();
        for r in 0..k {
            out[live[r]] = x[r] / scale[live[r]];
            for c in 0..k {
                covariance[(live[r], live[c])] = inverse[(r, c)] / (scale[live[r]] * scale[live[c]]);
            }
        }
    }
    (out, covariance)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::recording::noise;

    /// A straight line through points with unit noise: amplitudes and covariances as a textbook has them, and nothing of a
    /// column that is empty.
    #[test]
    fn a_straight_line_has_the_errors_of_the_textbook() {
        let points: Vec<(f64, f64)> = noise(400, 5).enumerate().map(|(k, e)| (k as f64 / 100.0, e)).collect();
        let mut normal = Normal::empty(3);
        for (x, e) in &points {
            normal.push(&[1.0, *x, 0.0], 2.0 - 3.0 * x + e);
        }
        normal.mirror();
        let (found, covariance) = solve(&normal);
        let n = points.len() as f64;
        let [x, xx, y, xy] = points.iter().fold([0.0; 4], |[x, xx, y, xy], (at, e)| {
            let value = 2.0 - 3.0 * at + e;
            [x + at, xx + at * at, y + value, xy + at * value]
        });
        let determinant = n * xx - x * x;
        let wanted = [(xx * y - x * xy) / determinant, (n * xy - x * y) / determinant];
        assert!((found[0] - wanted[0]).abs() < 1e-6 && (found[1] - wanted[1]).abs() < 1e-6, "{found:?} {wanted:?}");
        let errors = [xx / determinant, n / determinant];
        for k in 0..2 {
            assert!((covariance[(k, k)] / errors[k] - 1.0).abs() < 1e-6, "{covariance}");
        }
        assert_eq!((found[2], covariance[(2, 2)]), (0.0, f64::INFINITY));
    }
}
