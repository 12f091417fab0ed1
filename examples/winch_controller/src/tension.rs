//! Four winch forces for three components of a wrench, within bounds.
//!
//! The structure matrix `A` (3×4) maps winch forces to the wrench, `w = A u`. One degree of redundancy is left: adding
//! a multiple of the null vector `h` (`A h = 0`) changes the pretension and nothing else. The forces nearest to the
//! mean `u_m` are `u_m + Aᵀ (A Aᵀ)⁻¹ (w - A u_m)` (closed form of A. Pott, T. Bruckmann, L. Mikelsons, "Closed-form
//! force distribution for parallel wire robots", Computational Kinematics, 2009). Where they leave the bounds, the
//! multiples of `h` that bring them back form an interval, computed exactly; the end nearest to zero is taken.

use nalgebra::{Matrix3, Matrix3x4, Vector3, Vector4};

/// Bounds of the winch forces and where to be between them (N).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Smallest force.
    pub min: f64,
    /// The force that each winch should be near.
    pub mean: f64,
    /// Largest force.
    pub max: f64,
}

/// Winch forces for a wrench.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distribution {
    /// Forces within the bounds (N).
    pub force: [f64; 4],
    /// Do they give the wrench? Where no forces within the bounds do, these are cut off at the bounds.
    pub feasible: bool,
}

/// Winch forces within `bounds` that give `wrench` (N, N, N m); `None` where the cables cannot give three independent
/// wrenches.
#[must_use]
pub fn distribute(structure: &Matrix3x4<f64>, wrench: &Vector3<f64>, bounds: &Bounds) -> Option<Distribution> {
    let null = null_vector(structure)?;
    let mean = Vector4::repeat(bounds.mean);
    let gram = structure * structure.transpose();
    let multipliers = gram.lu().solve(&(wrench - structure * mean))?;
    let nearest = mean + structure.transpose() * multipliers;

    let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
    let mut feasible = true;
    // A share of the null vector below this moves a force by less than rounding.
    let still = 1e-12;
    for (force, share) in nearest.iter().zip(&null) {
        let ends = [(bounds.min - force) / share, (bounds.max - force) / share];
        if share.abs() > still {
            low = low.max(ends[0].min(ends[1]));
            high = high.min(ends[0].max(ends[1]));
        } else {
            feasible &= (bounds.min..=bounds.max).contains(force);
        }
    }
    feasible &= low <= high;
    let multiple = if feasible { 0.0_f64.clamp(low, high) } else { 0.5 * (low + high) };
    let force = nearest + multiple * null;
    // Rounding may leave a force a hair outside.
    let force = std::array::from_fn(|i| force[i].clamp(bounds.min, bounds.max));
    Some(Distribution { force, feasible })
}

/// The unit vector that `structure` maps to nothing: its minors, with alternating signs.
fn null_vector(structure: &Matrix3x4<f64>) -> Option<Vector4<f64>> {
    let minor = |left_out: usize| {
        let kept: Vec<_> = (0..4).filter(|&i| i != left_out).map(|i| structure.column(i)).collect();
        let sign = [1.0, -1.0][left_out % 2];
        sign * Matrix3::from_columns(&[kept[0], kept[1], kept[2]]).determinant()
    };
    let null = Vector4::from_fn(|i, _| minor(i));
    let size = null.norm();
    // The minors are products of one length (the arm) and numbers up to 1.
    let scale = structure.row(2).amax();
    (size.is_finite() && size > 1e-9 * scale).then(|| null / size)
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOUNDS: Bounds = Bounds { min: 1e3, mean: 20e3, max: 60e3 };

    /// The crossed robot near its centre, in round numbers.
    fn structure() -> Matrix3x4<f64> {
        Matrix3x4::new(
            -0.70, 0.71, 0.705, -0.71, //
            -0.71, -0.70, 0.71, 0.705, //
            9.9, -10.0, 10.0, -9.95,
        )
    }

    #[test]
    fn a_modest_wrench_is_given_by_the_nearest_forces() {
        let a = structure();
        let null = null_vector(&a).unwrap();
        assert!((a * null).norm() < 1e-12);
        for wrench in [Vector3::zeros(), Vector3::new(500.0, -900.0, 20e3), Vector3::new(-8e3, 3e3, -50e3)] {
            let found = distribute(&a, &wrench, &BOUNDS).unwrap();
            let force = Vector4::from(found.force);
            assert!(found.feasible);
            assert!((a * force - wrench).norm() < 1e-8 * wrench.norm().max(1.0));
            // Nearest to the mean: no part of the difference lies along the null vector.
            assert!((force - Vector4::repeat(BOUNDS.mean)).dot(&null).abs() < 1e-6);
        }
    }

    #[test]
    fn a_strong_wrench_shifts_the_pretension_to_the_bound() {
        let a = structure();
        let wrench = Vector3::new(0.0, 0.0, 900e3);
        let found = distribute(&a, &wrench, &BOUNDS).unwrap();
        assert!(found.feasible);
        assert!((a * Vector4::from(found.force) - wrench).norm() < 1e-6);
        let on_bound = |f: &f64| (f - BOUNDS.min).abs() < 1e-6 || (f - BOUNDS.max).abs() < 1e-6;
        assert_eq!(found.force.iter().filter(|f| on_bound(f)).count(), 1, "{:?}", found.force);
    }

    #[test]
    fn an_impossible_wrench_is_cut_off_and_said_so() {
        let found = distribute(&structure(), &Vector3::new(0.0, 0.0, 5e6), &BOUNDS).unwrap();
        assert!(!found.feasible);
        assert!(found.force.iter().all(|f| (BOUNDS.min..=BOUNDS.max).contains(f)));
    }

    #[test]
    fn parallel_cables_have_no_answer() {
        let a = Matrix3x4::from_fn(|i, _| [1.0, 0.0, 0.0][i]);
        assert_eq!(distribute(&a, &Vector3::zeros(), &BOUNDS), None);
    }
}
