//! Normal equations, solved.

use std::ops::RangeInclusive;

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

/// Least squares where each unknown has a range, which zero is in: the fall of the sum of squares is the largest that is to be
/// had there. What ends at a bound changes what is best of the others.
///
/// By active sets (P. B. Stark and R. L. Parker, Bounded-variable least squares: an algorithm and applications, Computational
/// Statistics 10, 1995), from the unknowns at zero. `free` is the solution without bounds, by [`solve`].
pub(crate) fn solve_within(normal: &Normal, free: &[f64], ranges: &[RangeInclusive<f64>]) -> Vec<f64> {
    let n = normal.columns;
    let inside = |values: &[f64]| values.iter().zip(ranges).all(|(value, range)| range.contains(value));
    if inside(free) {
        return free.to_vec();
    }
    let (mut x, mut held) = (vec![0.0; n], vec![false; n]);
    // Each unknown may come to a bound and leave it again.
    for _ in 0..3 * n {
        // To the best place of those that are not held, or as far as the first bound on the way there.
        let wanted = best_of_those_not(&held, &x, normal);
        let share = |at: usize| {
            let (change, range) = (wanted[at] - x[at], &ranges[at]);
            let room = if change < 0.0 { range.start() - x[at] } else { range.end() - x[at] };
            if change == 0.0 || room.abs() >= change.abs() { 1.0 } else { room / change }
        };
        let first = (0..n).map(|at| (at, share(at))).min_by(|a, b| a.1.total_cmp(&b.1));
        let Some((at, share)) = first else { break };
        x.iter_mut().zip(&wanted).for_each(|(value, wanted)| *value += share * (wanted - *value));
        if share < 1.0 {
            let range = &ranges[at];
            x[at] = if wanted[at] < x[at] { *range.start() } else { *range.end() };
            held[at] = true;
            continue;
        }
        // The one that would gain most by going back from its bound.
        let inwards = |at: usize| {
            let acting: f64 = (0..n).map(|other| normal.gram[at * n + other] * x[other]).sum();
            let pull = (normal.right[at] - acting) / normal.gram[at * n + at].sqrt();
            if x[at] == *ranges[at].start() { pull } else { -pull }
        };
        let back = (0..n).filter(|at| held[*at] && ranges[*at].start() < ranges[*at].end());
        let back = back.map(|at| (at, inwards(at))).max_by(|a, b| a.1.total_cmp(&b.1));
        match back.filter(|(_, pull)| *pull > NO_PULL) {
            Some((at, _)) => held[at] = false,
            None => break,
        }
    }
    x
}

/// Pull of a bound, in standard deviations of an unknown whose others are known, that is rounding.
const NO_PULL: f64 = 1e-6;

/// The least squares of the unknowns that are not `held`, with the others as they are.
fn best_of_those_not(held: &[bool], x: &[f64], normal: &Normal) -> Vec<f64> {
    let n = normal.columns;
    let own: Vec<usize> = (0..n).filter(|at| !held[*at]).collect();
    let others = || (0..n).filter(|at| held[*at]);
    let mut rest = Normal::empty(own.len());
    for (a, at) in own.iter().enumerate() {
        rest.right[a] = normal.right[*at] - others().map(|other| normal.gram[at * n + other] * x[other]).sum::<f64>();
        for (b, other) in own.iter().enumerate() {
            rest.gram[a * own.len() + b] = normal.gram[at * n + other];
        }
    }
    let mut out = x.to_vec();
    own.iter().zip(solve(&rest).0).for_each(|(at, value)| out[*at] = value);
    out
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

    /// Against all ways in which the unknowns may be at their bounds, of which the best that is within them is the solution.
    #[test]
    fn within_bounds_no_other_place_is_better() {
        let mut random = noise(100_000, 6);
        let mut next = || random.next().expect("noise");
        let mut at_bounds = 0;
        for _ in 0..200 {
            let n = 4;
            let mut normal = Normal::empty(n);
            for _ in 0..8 {
                let row: Vec<f64> = (0..n).map(|_| next()).collect();
                normal.push(&row, 3.0 * next());
            }
            normal.mirror();
            let ranges: Vec<RangeInclusive<f64>> = (0..n).map(|_| -next().abs()..=next().max(0.0)).collect();
            let left = |x: &[f64]| -> f64 {
                let by = |r: usize| (0..n).map(|c| normal.gram[r * n + c] * x[c]).sum::<f64>() - 2.0 * normal.right[r];
                (0..n).map(|r| x[r] * by(r)).sum()
            };
            let within = |x: &[f64]| {
                x.iter().zip(&ranges).all(|(x, range)| (range.start() - 1e-9..=range.end() + 1e-9).contains(x))
            };
            let place = |way: usize| {
                let of = |at: usize| way / 3_usize.pow(at as u32) % 3;
                let held: Vec<bool> = (0..n).map(|at| of(at) > 0).collect();
                let x: Vec<f64> = (0..n).map(|at| [0.0, *ranges[at].start(), *ranges[at].end()][of(at)]).collect();
                best_of_those_not(&held, &x, &normal)
            };
            let best = (0..81).map(place).filter(|x| within(x)).map(|x| left(&x)).fold(f64::INFINITY, f64::min);
            let free = solve(&normal).0;
            let found = solve_within(&normal, &free, &ranges);
            assert!(within(&found), "{found:?} {ranges:?}");
            assert!((left(&found) - best).abs() < 1e-6 * best.abs().max(1.0), "{} {best}", left(&found));
            at_bounds += usize::from(found != free);
        }
        assert!(at_bounds > 100, "{at_bounds}");
    }
}
