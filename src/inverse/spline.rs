//! Splines through samples: degree 7 for motions, monotone cubics for disturbances.

use nalgebra::{DMatrix, DVector};

use super::trajectory::Ends;

/// Derivatives fixed at each end of a piece: the value and orders 1 to 3.
const GIVEN: usize = 4;
/// Degree plus one.
const COEFFICIENTS: usize = 2 * GIVEN;

/// `j (j-1) ... (j-k+1)`: the factor of the `k`-th derivative of the power `j`.
fn falling(j: usize, k: usize) -> f64 {
    (0..k).map(|i| j as f64 - i as f64).product()
}

/// Coefficients of the piece on `[0, 1]` as a linear map (8×8) of value and derivatives 0 to 3 at both ends.
fn hermite() -> DMatrix<f64> {
    let conditions = DMatrix::from_fn(COEFFICIENTS, COEFFICIENTS, |row, j| {
        if row < GIVEN {
            if row == j { falling(j, row) } else { 0.0 }
        } else if j >= row - GIVEN {
            falling(j, row - GIVEN)
        } else {
            0.0
        }
    });
    let identity = DMatrix::identity(COEFFICIENTS, COEFFICIENTS);
    // The Hermite interpolation problem always has one solution.
    conditions.lu().solve(&identity).unwrap_or(identity)
}

fn piece_at(time: &[f64], t: f64) -> usize {
    time.partition_point(|knot| *knot <= t).clamp(1, time.len() - 1) - 1
}

/// A piecewise polynomial of degree 7 through values and, where given, derivatives at the knots.
#[derive(Clone, Debug)]
pub(super) struct Septic {
    time: Vec<f64>,
    /// Coefficients of each piece in `(t - t_i)/h_i`.
    pieces: Vec<[f64; COEFFICIENTS]>,
}

impl Septic {
    /// `given[k]` are the `k`-th derivatives at the knots, one to three columns; the rest follows from smoothness.
    pub(super) fn new(time: &[f64], given: &[Vec<f64>], ends: Ends) -> Self {
        let n = time.len();
        let known = given.len();
        let unknown = GIVEN - known;
        let hermite = hermite();
        let mean = (time[n - 1] - time[0]) / (n - 1) as f64;
        let width = |i: usize| (time[i + 1] - time[i]) / mean;
        // Response of the scaled derivative of order `r` at the `end` (0, 1) of piece `i` to derivative `k` at `side`.
        let response = |i: usize, end: usize, r: usize, side: usize, k: usize| {
            let column = side * GIVEN + k;
            let h = width(i);
            let sum: f64 = if end == 0 {
                falling(r, r) * hermite[(r, column)]
            } else {
                (r..COEFFICIENTS).map(|j| falling(j, r) * hermite[(j, column)]).sum()
            };
            sum * h.powi(k as i32) / h.powi(r as i32)
        };
        // Derivatives in units of the mean spacing.
        let mut data: Vec<[f64; GIVEN]> = (0..n)
            .map(|i| std::array::from_fn(|k| given.get(k).map_or(0.0, |column| column[i] * mean.powi(k as i32))))
            .collect();
        // Block tridiagonal: derivatives of order 4.. agree at inner knots.
        let block = |piece: usize, end: usize, side: usize| {
            DMatrix::from_fn(unknown, unknown, |r, k| response(piece, end, GIVEN + r, side, known + k))
        };
        let load = |piece: usize, end: usize| {
            DVector::from_fn(unknown, |r, _| {
                (0..2)
                    .flat_map(|side| (0..known).map(move |k| (side, k)))
                    .map(|(side, k)| response(piece, end, GIVEN + r, side, k) * data[piece + side][k])
                    .sum::<f64>()
            })
        };
        let rest = ends == Ends::Rest;
        let zero = || DMatrix::zeros(unknown, unknown);
        let mut upper: Vec<DMatrix<f64>> = Vec::with_capacity(n);
        let mut right: Vec<DVector<f64>> = Vec::with_capacity(n);
        for i in 0..n {
            let last = i == n - 1;
            let (lower, mut diagonal, mut above, mut b);
            if (i == 0 || last) && rest {
                (lower, diagonal, above, b) =
                    (zero(), DMatrix::identity(unknown, unknown), zero(), DVector::zeros(unknown));
            } else if i == 0 {
                (lower, diagonal, above, b) = (zero(), block(0, 0, 0), block(0, 0, 1), -load(0, 0));
            } else {
                (lower, diagonal, above, b) = (block(i - 1, 1, 0), block(i - 1, 1, 1), zero(), -load(i - 1, 1));
                if !last {
                    diagonal -= block(i, 0, 0);
                    above -= block(i, 0, 1);
                    b += load(i, 0);
                }
            }
            if i > 0 {
                diagonal -= &lower * &upper[i - 1];
                b -= &lower * &right[i - 1];
            }
            let lu = diagonal.lu();
            upper.push(lu.solve(&above).unwrap_or_else(zero));
            right.push(lu.solve(&b).unwrap_or_else(|| DVector::zeros(unknown)));
        }
        for i in (0..n).rev() {
            if i + 1 < n {
                let next = right[i + 1].clone();
                right[i] -= &upper[i] * next;
            }
            for k in 0..unknown {
                data[i][known + k] = right[i][k];
            }
        }
        let pieces = (0..n - 1)
            .map(|i| {
                let h = width(i);
                let ends =
                    DVector::from_fn(COEFFICIENTS, |c, _| data[i + c / GIVEN][c % GIVEN] * h.powi((c % GIVEN) as i32));
                let c = &hermite * ends;
                std::array::from_fn(|j| c[j])
            })
            .collect();
        Self { time: time.to_vec(), pieces }
    }

    /// Value and derivatives of order 1 to 5 at `t`.
    pub(super) fn derivatives(&self, t: f64) -> [f64; 6] {
        let i = piece_at(&self.time, t);
        let h = self.time[i + 1] - self.time[i];
        let s = (t - self.time[i]) / h;
        std::array::from_fn(|k| {
            let value = (k..COEFFICIENTS).rev().fold(0.0, |sum, j| sum * s + falling(j, k) * self.pieces[i][j]);
            value / h.powi(k as i32)
        })
    }
}

/// A monotone piecewise cubic (Fritsch and Carlson).
#[derive(Clone, Debug)]
pub(super) struct Cubic {
    time: Vec<f64>,
    /// Coefficients of each piece in `t - t_i`.
    pieces: Vec<[f64; 4]>,
}

impl Cubic {
    pub(super) fn new(time: &[f64], value: &[f64]) -> Self {
        let n = time.len();
        let h: Vec<f64> = time.windows(2).map(|w| w[1] - w[0]).collect();
        let secant: Vec<f64> = (0..n - 1).map(|i| (value[i + 1] - value[i]) / h[i]).collect();
        let mut slope = vec![0.0; n];
        slope[0] = secant[0];
        slope[n - 1] = secant[n - 2];
        for i in 1..n - 1 {
            let (a, b) = (secant[i - 1], secant[i]);
            if a * b > 0.0 {
                // Weighted harmonic mean: never steeper than three times the gentler side.
                let (wa, wb) = (2.0 * h[i] + h[i - 1], h[i] + 2.0 * h[i - 1]);
                slope[i] = (wa + wb) / (wa / a + wb / b);
            }
        }
        let pieces = (0..n - 1)
            .map(|i| {
                let (m, a, b, h) = (secant[i], slope[i], slope[i + 1], h[i]);
                [value[i], a, (3.0 * m - 2.0 * a - b) / h, (a + b - 2.0 * m) / (h * h)]
            })
            .collect();
        Self { time: time.to_vec(), pieces }
    }

    /// Value and derivatives of order 1 to 3 at `t`.
    pub(super) fn derivatives(&self, t: f64) -> [f64; 4] {
        let i = piece_at(&self.time, t);
        let [a, b, c, d] = self.pieces[i];
        let s = t - self.time[i];
        [a + s * (b + s * (c + s * d)), b + s * (2.0 * c + 3.0 * d * s), 2.0 * c + 6.0 * d * s, 6.0 * d]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn polynomial(t: f64, order: usize) -> f64 {
        // 1 + 2t - t³/2 + t⁵/10 - t⁶/60
        let c = [1.0, 2.0, 0.0, -0.5, 0.0, 0.1, -1.0 / 60.0];
        (order..7).map(|j| c[j] * falling(j, order) * t.powi((j - order) as i32)).sum()
    }

    #[test]
    fn given_rates_make_a_polynomial_exact() {
        // Ends are natural, so the polynomial is met in the middle and, with all rates given, nearly everywhere.
        let time: Vec<f64> = (0..41).map(|k| 0.1 * f64::from(k) + 0.01 * f64::from(k % 3)).collect();
        for known in 1..=3 {
            let given: Vec<Vec<f64>> = (0..known).map(|k| time.iter().map(|t| polynomial(*t, k)).collect()).collect();
            let spline = Septic::new(&time, &given, Ends::Natural);
            for t in [1.83, 2.004, 2.2] {
                let d = spline.derivatives(t);
                for k in 0..4 {
                    let error = (d[k] - polynomial(t, k)).abs();
                    assert!(error < [1e-8, 1e-7, 1e-5, 1e-3][k], "known {known}, order {k}, t {t}: {error:e}");
                }
            }
        }
    }

    #[test]
    fn it_is_smooth_at_the_knots_and_at_rest_at_its_ends() {
        let time: Vec<f64> = (0..11).map(f64::from).collect();
        let value: Vec<f64> = time.iter().map(|t| (0.6 * t).sin()).collect();
        let spline = Septic::new(&time, &[value], Ends::Rest);
        for knot in 1..10 {
            let t = f64::from(knot);
            let (before, after) = (spline.derivatives(t - 1e-9), spline.derivatives(t));
            for k in 0..6 {
                assert!(
                    (before[k] - after[k]).abs() < 1e-7 * (1.0 + 10.0 * after[k].abs()),
                    "knot {knot}, order {k}: {before:?} {after:?}"
                );
            }
        }
        for t in [0.0, 10.0] {
            let d = spline.derivatives(t);
            assert!(d[1..4].iter().all(|v| v.abs() < 1e-12), "{d:?}");
        }
    }

    #[test]
    fn the_cubic_does_not_overshoot_a_step() {
        let time: Vec<f64> = (0..10).map(f64::from).collect();
        let value: Vec<f64> = (0..10).map(|k| if k < 5 { 0.0 } else { 100.0 }).collect();
        let cubic = Cubic::new(&time, &value);
        for k in 0..=900 {
            let v = cubic.derivatives(0.01 * f64::from(k))[0];
            assert!((0.0..=100.0).contains(&v), "{v} at {k}");
        }
        let (before, after) = (cubic.derivatives(5.0 - 1e-12), cubic.derivatives(5.0));
        assert!((before[1] - after[1]).abs() < 1e-6);
    }
}
