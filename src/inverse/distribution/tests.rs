use super::*;
use crate::parameters::Parameters;

fn geometry() -> Geometry {
    Geometry::new(&Parameters::default())
}

/// A deterministic stream of numbers in `[-1, 1]`.
fn numbers() -> impl FnMut() -> f64 {
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

fn cases() -> Vec<(Matrix3xX<f64>, [f64; 3])> {
    let mut next = numbers();
    (0..200)
        .map(|_| {
            let pose = [300.0 * next(), 300.0 * next(), 0.4 * next()];
            (structure_matrix(&geometry(), &pose), [3e3 * next(), 3e3 * next(), 3e4 * next()])
        })
        .collect()
}

const OBJECTIVES: [Objective; 7] = [
    Objective::MinimumNorm,
    Objective::SmoothNorm(300.0),
    Objective::PNorm(4.0),
    Objective::PNorm(12.0),
    Objective::MidTension,
    Objective::Near(5e3),
    Objective::AnalyticCentre,
];

#[test]
fn tensions_exert_the_wrench_within_the_bounds() {
    let bounds = Bounds::new(1e3, 20e3).unwrap();
    let mut feasible = 0;
    for (structure, wrench) in cases() {
        for objective in OBJECTIVES {
            match (Distribution { objective, bounds }).tensions(&structure, &wrench) {
                Ok(tension) => {
                    feasible += 1;
                    let reached = &structure * DVector::from_column_slice(&tension);
                    let miss = (reached - Vector3::from(wrench)).norm();
                    assert!(miss < 1e-7, "{objective:?}: {miss:e}");
                    assert!(tension.iter().all(|t| (1e3 - 1e-6..=20e3 + 1e-6).contains(t)), "{tension:?}");
                }
                Err(DistributionError::Infeasible(found)) => {
                    let short = found.shortfall.iter().map(|s| s.abs()).fold(0.0, f64::max);
                    assert!(short > 1e-6, "infeasible, yet nothing is missing: {found:?}");
                }
                Err(error) => panic!("{error}"),
            }
        }
    }
    assert!(feasible > 300, "only {feasible} feasible cases: the test says little");
}

/// No other feasible point of the line is better: checked on a fine grid.
#[test]
fn the_objective_is_smallest_among_the_feasible() {
    let bounds = Bounds::new(1e3, 20e3).unwrap();
    for (structure, wrench) in cases().into_iter().take(60) {
        let line = TensionLine::of(&structure, &wrench).unwrap();
        let Some([low, high]) = line.feasible(&bounds) else { continue };
        for objective in OBJECTIVES {
            let cost = |tension: PerCable<f64>| -> f64 {
                tension
                    .iter()
                    .map(|t| match objective {
                        Objective::MinimumNorm => t * t,
                        Objective::PNorm(p) => ((t - bounds.middle()).abs() / 1e4).powf(p),
                        Objective::MidTension => (t - bounds.middle()).powi(2),
                        Objective::Near(tension) => (t - tension).powi(2),
                        Objective::SmoothNorm(w) => {
                            0.5 * t * t - w * w * ((t - 1e3).max(1e-9).ln() + (20e3 - t).max(1e-9).ln())
                        }
                        Objective::AnalyticCentre => -((t - 1e3).max(1e-9).ln() + (20e3 - t).max(1e-9).ln()),
                    })
                    .sum()
            };
            let best = cost(Distribution { objective, bounds }.tensions(&structure, &wrench).unwrap());
            for k in 0..=1000 {
                let other = cost(line.at(low.0 + (high.0 - low.0) * f64::from(k) / 1000.0));
                assert!(best <= other + 1e-9 * other.abs(), "{objective:?}: {best} against {other}");
            }
        }
    }
}

#[test]
fn tensions_are_continuous_along_a_path() {
    let bounds = Bounds::new(1e3, 20e3).unwrap();
    for objective in OBJECTIVES {
        let distribution = Distribution { objective, bounds };
        let tension = |s: f64| {
            let structure = structure_matrix(&geometry(), &[100.0 * s.sin(), 150.0 * (0.7 * s).cos(), 0.1 * s.sin()]);
            distribution.tensions(&structure, &[2e3 * (3.0 * s).sin(), 1.5e3 * s.cos(), 5e3 * (2.0 * s).sin()]).unwrap()
        };
        let mut last = tension(0.0);
        for k in 1..=6000 {
            let next = tension(1e-3 * f64::from(k));
            let jump = (0..4).map(|i| (next[i] - last[i]).abs()).fold(0.0, f64::max);
            assert!(jump < 30.0, "{objective:?}: {jump} N at step {k}");
            last = next;
        }
    }
}

/// Pott's improved closed form as published: fix the tension that violates its bound most, solve for the rest.
#[test]
fn cutting_off_is_potts_improved_closed_form() {
    let bounds = Bounds::new(1e3, 4e3).unwrap();
    let (mut fixed, mut plain) = (0, 0);
    for (structure, wrench) in cases() {
        let line = TensionLine::of(&structure, &wrench).unwrap();
        let middle = bounds.middle();
        let lambda: f64 = line.internal.iter().map(|n| n * middle).sum();
        let mut tension = line.at(lambda);
        let violation = |t: f64| (bounds.lower - t).max(t - bounds.upper);
        // With one degree of redundancy each fixing determines all; the cable to fix is the one whose fixing serves.
        if tension.iter().any(|t| violation(*t) > 0.0) {
            let candidates = (0..4).filter(|i| violation(tension[*i]) > 0.0).filter_map(|i| {
                let bound = if tension[i] < bounds.lower { bounds.lower } else { bounds.upper };
                let fixed = line.at((bound - line.minimum_norm[i]) / line.internal[i]);
                fixed.iter().all(|t| violation(*t) < 1e-9).then_some(fixed)
            });
            let Some(found) = candidates.into_iter().next() else { continue };
            tension = found;
            fixed += 1;
        } else {
            plain += 1;
        }
        let ours = Distribution { objective: Objective::MidTension, bounds }.tensions(&structure, &wrench).unwrap();
        for i in 0..4 {
            assert!((ours[i] - tension[i]).abs() < 1e-6, "{ours:?} {tension:?}");
        }
    }
    assert!(fixed > 10 && plain > 10, "{fixed} fixed, {plain} plain: the test says little");
}

#[test]
fn nearest_tensions_cannot_be_bettered() {
    let bounds = Bounds::new(1e3, 3e3).unwrap();
    let mut next = numbers();
    for (structure, wrench) in cases().into_iter().take(40) {
        let found = nearest(&structure, &wrench, &bounds);
        let arm = structure.row(2).amax();
        let miss = |t: &DVector<f64>| {
            let d = &structure * t - Vector3::from(wrench);
            (d[0] * d[0] + d[1] * d[1] + (d[2] / arm).powi(2)).sqrt()
        };
        let best = miss(&DVector::from_column_slice(&found.nearest_tension));
        for _ in 0..500 {
            let other = DVector::from_fn(4, |_, _| 2e3 + 1e3 * next());
            assert!(best <= miss(&other) + 1e-7, "{best} against {}", miss(&other));
        }
    }
}

#[test]
fn a_singular_pose_is_told() {
    let mut parameters = Parameters { attachment_radius: 0.0, ..Parameters::default() };
    parameters.attachment_angle = [0.0; 4].into();
    let structure = structure_matrix(&Geometry::new(&parameters), &[10.0, 20.0, 0.0]);
    let bounds = Bounds::new(1e3, 3e3).unwrap();
    let error = Distribution { objective: Objective::MidTension, bounds }.tensions(&structure, &[0.0; 3]);
    assert_eq!(error, Err(DistributionError::Singular));
}

#[test]
fn derivatives_are_there_even_with_all_tensions_at_the_mean() {
    use crate::inverse::Jet;
    let bounds = Bounds::new(1e3, 3e3).unwrap();
    let cables = crate::kinematics::cables(&geometry(), &[Jet::from(0.0); 3], &[Jet::from(0.0); 3]);
    // The wrench is zero now and rises at 1 N/s.
    let wrench = [Jet::new(0.0, 1.0, 0.0, 0.0), Jet::from(0.0), Jet::from(0.0)];
    for objective in [Objective::PNorm(1.5), Objective::PNorm(6.0), Objective::MidTension, Objective::AnalyticCentre] {
        let distribution = Distribution { objective, bounds };
        let structure = structure_matrix(&geometry(), &[0.0; 3]);
        let (selection, tension) = distribution.select(&structure, &[0.0; 3]).unwrap();
        let limits = bounds.of_each(4).map(|limits| limits.map(Jet::from));
        let lifted = distribution.lift(&rows(&cables), &wrench, &limits, (&selection, &tension)).unwrap();
        for (lifted, plain) in lifted.iter().zip(tension) {
            assert!(
                (lifted.re - plain).abs() < 1e-9 && lifted.v1.abs() < 1.0 && lifted.v1 != 0.0,
                "{objective:?}: {lifted:?}"
            );
        }
    }
}
