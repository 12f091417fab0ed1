//! A. Pott, Cable-Driven Parallel Robots (2018), chapter 3: properties that a force distribution must have, and the bound on
//! the feasible internal tension of the closed form.

use cdpr::geometry::Geometry;
use cdpr::inverse::distribution::{Bounds, Distribution, Objective, TensionLine, structure_matrix};
use cdpr::parameters::Parameters;
use cdpr::statics::workspace::{RequiredWrenches, capacity_margin};

/// At the centre of a symmetric robot without load, the closed form gives the mean of the bounds in every cable.
#[test]
fn the_closed_form_at_the_centre_is_the_mean() {
    let structure = structure_matrix(&Geometry::new(&Parameters::default()), &[0.0; 3]);
    let bounds = Bounds::new(100.0, 2300.0).unwrap();
    let found = Distribution { objective: Objective::MidTension, bounds }.tensions(&structure, &[0.0; 3]).unwrap();
    for tension in found {
        assert!((tension - 1200.0).abs() < 1e-9, "{found:?}");
    }
}

/// The closed form stays within `√m/2 (T_max - T_min)` of the mean wherever it is feasible.
#[test]
fn feasible_closed_forms_stay_within_the_published_radius() {
    let geometry = Geometry::new(&Parameters::default());
    let bounds = Bounds::new(1e3, 8e3).unwrap();
    let radius = 0.5 * 4.0_f64.sqrt() * (bounds.upper() - bounds.lower());
    let mut feasible = 0;
    for k in 0..200 {
        let s = f64::from(k);
        let pose = [400.0 * (1.3 * s).sin(), 400.0 * (0.7 * s).cos(), 0.3 * (2.1 * s).sin()];
        let wrench = [4e3 * (0.9 * s).sin(), 4e3 * (1.7 * s).cos(), 3e4 * (3.1 * s).sin()];
        let structure = structure_matrix(&geometry, &pose);
        if let Ok(t) = (Distribution { objective: Objective::MidTension, bounds }).tensions(&structure, &wrench) {
            feasible += 1;
            let distance = t.iter().map(|t| (t - bounds.middle()).powi(2)).sum::<f64>().sqrt();
            assert!(distance <= radius + 1e-9, "{distance} above {radius}");
        }
    }
    assert!(feasible > 30, "{feasible} feasible cases say little");
}

/// A wrench just inside the capacity margin is feasible, one just outside is not.
#[test]
fn the_margin_is_the_distance_to_the_border() {
    let geometry = Geometry::new(&Parameters::default());
    let bounds = Bounds::new(1e3, 8e3).unwrap();
    let none = RequiredWrenches { centre: [0.0; 3], half_width: [0.0; 3] };
    for pose in [[0.0, 0.0, 0.0], [100.0, -50.0, 0.1], [-150.0, 120.0, -0.2]] {
        let structure = structure_matrix(&geometry, &pose);
        let margin = capacity_margin(&geometry, &pose, &bounds, &none);
        assert!(margin > 0.0);
        let arm = geometry.attachment_scale();
        let mut least = f64::INFINITY;
        for i in 0..40 {
            for j in 0..40 {
                let (a, b) = (f64::from(i) * 0.157, f64::from(j) * 0.0785 - std::f64::consts::FRAC_PI_2);
                let direction = [a.cos() * b.cos(), a.sin() * b.cos(), b.sin() * arm];
                let feasible = |size: f64| {
                    let line = TensionLine::of(&structure, &direction.map(|d| d * size)).unwrap();
                    line.feasible(&bounds).is_some()
                };
                assert!(feasible(0.999 * margin), "inside the margin of {margin} N along {direction:?}");
                let (mut low, mut high) = (margin, 1e6);
                for _ in 0..40 {
                    let middle = 0.5 * (low + high);
                    if feasible(middle) { low = middle } else { high = middle }
                }
                least = least.min(low);
            }
        }
        assert!(least < 1.02 * margin, "nearest border at {least} N, margin {margin} N");
    }
}
