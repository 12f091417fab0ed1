//! C. Gosselin, M. Grenier, On the determination of the force distribution in overconstrained cable-driven parallel
//! mechanisms, Meccanica 46 (2011): the `p`-norm of the tensions about a reference is convex along the line of solutions; its
//! minimum is the root of a polynomial (degree 3 for p = 4), and tends to the minimax solution as `p` grows.

use cdpr::geometry::Geometry;
use cdpr::inverse::distribution::{Bounds, Distribution, Objective, TensionLine, structure_matrix};
use cdpr::parameters::Parameters;
use cdpr::per_cable::PerCable;

fn case(k: i32) -> (TensionLine, [f64; 3], [f64; 3]) {
    let s = f64::from(k);
    let pose = [200.0 * (1.1 * s).sin(), 200.0 * (0.6 * s).cos(), 0.3 * (1.9 * s).sin()];
    let wrench = [2e3 * (0.8 * s).sin(), 1.5e3 * s.cos(), 1e4 * (2.3 * s).sin()];
    let structure = structure_matrix(&Geometry::new(&Parameters::default()), &pose);
    (TensionLine::of(&structure, &wrench).unwrap(), pose, wrench)
}

const BOUNDS: (f64, f64) = (1e3, 21e3);

fn tensions(pose: [f64; 3], wrench: [f64; 3], p: f64) -> PerCable<f64> {
    let structure = structure_matrix(&Geometry::new(&Parameters::default()), &pose);
    let bounds = Bounds::new(BOUNDS.0, BOUNDS.1).unwrap();
    Distribution { objective: Objective::PNorm(p), bounds }.tensions(&structure, &wrench).unwrap()
}

#[test]
fn the_minimum_for_p_4_is_the_root_of_their_cubic() {
    for k in 0..40 {
        let (line, pose, wrench) = case(k);
        // Σ n_i (T_i - T_m + λ n_i)³ = 0, expanded.
        let mut c = [0.0; 4];
        for i in 0..4 {
            let (t, n) = (line.minimum_norm[i] - 0.5 * (BOUNDS.0 + BOUNDS.1), line.internal[i]);
            c[0] += n * t.powi(3);
            c[1] += 3.0 * n * n * t * t;
            c[2] += 3.0 * n.powi(3) * t;
            c[3] += n.powi(4);
        }
        let cubic = |x: f64| c[0] + x * (c[1] + x * (c[2] + x * c[3]));
        let (mut low, mut high) = (-1e6, 1e6);
        for _ in 0..200 {
            let middle = 0.5 * (low + high);
            if cubic(middle) < 0.0 { low = middle } else { high = middle }
        }
        let expected = line.at(low);
        for (a, b) in tensions(pose, wrench, 4.0).iter().zip(expected) {
            assert!((a - b).abs() < 1e-4, "{a} against {b}");
        }
    }
}

#[test]
fn with_a_growing_exponent_the_largest_distance_falls_to_the_minimax() {
    for k in 0..20 {
        let (line, pose, wrench) = case(k);
        let middle = 0.5 * (BOUNDS.0 + BOUNDS.1);
        let largest = |t: PerCable<f64>| t.into_iter().map(|t| (t - middle).abs()).fold(0.0, f64::max);
        // The largest distance is convex and piecewise linear in λ.
        let (mut a, mut b) = (-1e5, 1e5);
        for _ in 0..200 {
            let (c, d) = (a + (b - a) / 3.0, b - (b - a) / 3.0);
            if largest(line.at(c)) < largest(line.at(d)) { b = d } else { a = c }
        }
        let minimax = largest(line.at(a));
        let [second, fourth, high] = [2.0, 4.0, 60.0].map(|p| largest(tensions(pose, wrench, p)));
        assert!(high <= second.min(fourth) + 1e-6, "{second} {fourth} {high}");
        assert!(high >= minimax - 1e-6 && high <= 1.05 * minimax, "{high} against {minimax}");
    }
}
