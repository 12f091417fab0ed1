//! Tension distribution with any number of cables: one convex problem, by a primal-dual interior-point method.
//!
//! Counted from the middle of the bounds in units of half their width, tensions are `t_i`, in `[-1, 1]` or closer limits of their own, the objective is
//! `Σ f(t_i)`, and the wrench asks for `A t = b`, three rows whatever the number of cables. Its Hessian is diagonal, so a
//! Newton step is one 3×3 system (S. J. Wright, Primal-Dual Interior-Point Methods, 1997; with tensions as the unknowns
//! Borgstrom and others, IEEE Trans. Robot. 25, 2009). The cables that end at a bound are then fixed there and the rest is
//! solved once more, to rounding and with derivatives.

use super::{Distribution, DistributionError, Limits, Objective, Selection, nearer};
use crate::dynamics::matrix3;
use crate::per_cable::PerCable;
use crate::scalar::Real;

/// Most interior-point steps: a high p-norm converges by a factor `(p - 2)/(p - 1)` a step near its flat minimum.
const STEPS: usize = 1000;
/// Share of the way to a bound that a step may take.
const TO_THE_BOUND: f64 = 0.995;
/// Distance from the middle, in half widths of the bounds, below which all tensions count as at the middle.
const LEAST_REACH: f64 = 1e-6;
/// Share of the largest curvature below which a cable counts as flat.
const FLAT: f64 = 1e-3;
/// Complementarity at which a cable's place, at its bound or free, is told apart.
const SETTLED: f64 = 1e-12;
/// Steps of the last solution: three orders of derivatives and the value.
const LAST_STEPS: usize = 6;

/// What is made smallest, in the scaled tension.
struct Cost {
    /// Its tensions counted in half widths of the bounds.
    objective: Objective,
    /// The middle of the bounds over half their width.
    middle: f64,
    /// How far from the middle tensions lie, in the unit of a p-norm, so that its slopes are of the order of one.
    reach: f64,
}

impl Cost {
    fn slope<S: Real>(&self, t: S, [low, high]: [S; 2]) -> S {
        match self.objective {
            Objective::MinimumNorm => t + self.middle,
            Objective::MidTension => t,
            Objective::Near(tension) => t + (self.middle - tension),
            Objective::PNorm(p) => {
                if t.re() == 0.0 {
                    t
                } else {
                    t / self.reach * (t / self.reach).abs().powf(p - 2.0)
                }
            }
            Objective::SmoothNorm(width) => {
                t + self.middle + ((high - t).recip() - (t - low).recip()) * (width * width)
            }
            Objective::AnalyticCentre => (high - t).recip() - (t - low).recip(),
        }
    }

    /// The curvature; a p-norm's is bounded near the middle, where it is flat or sharp.
    fn curvature(&self, t: f64, [low, high]: [f64; 2]) -> f64 {
        let barrier = (high - t).powi(-2) + (t - low).powi(-2);
        match self.objective {
            Objective::MinimumNorm | Objective::MidTension | Objective::Near(_) => 1.0,
            Objective::PNorm(p) => (p - 1.0) / self.reach * (t.abs() / self.reach).max(1e-9).powf(p - 2.0),
            Objective::SmoothNorm(width) => 1.0 + width * width * barrier,
            Objective::AnalyticCentre => barrier,
        }
    }

    /// What a step of Newton's method far from the minimum divides by: for a p-norm below 2 the slope over `t`, with
    /// which it does not jump across the middle to and fro.
    fn majorant(&self, t: f64, limits: [f64; 2]) -> f64 {
        match self.objective {
            Objective::PNorm(p) if p < 2.0 => self.curvature(t, limits) / (p - 1.0),
            _ => self.curvature(t, limits),
        }
    }
}

/// The objective with its tensions counted in `unit` (N).
fn counted_in(unit: f64, objective: Objective) -> Objective {
    match objective {
        Objective::Near(tension) => Objective::Near(tension / unit),
        Objective::SmoothNorm(width) => Objective::SmoothNorm(width / unit),
        other => other,
    }
}

/// The problem in scaled tensions: `rows[i]` is what a unit of cable `i` exerts, torque over `arm`.
struct Scaled<S> {
    rows: PerCable<[S; 3]>,
    wrench: [S; 3],
    limits: Limits<S>,
}

impl<S: Real> Scaled<S> {
    /// From the rows of `J_M` and a wrench (N, N m).
    fn new(jacobian: &PerCable<[S; 3]>, wrench: &[S; 3], limits: &Limits<S>, distribution: &Distribution) -> Self {
        let bounds = distribution.bounds;
        let half = 0.5 * (bounds.upper - bounds.lower);
        let arm = jacobian.iter().map(|r| r[2].re().abs()).fold(0.0, f64::max).max(1e-9);
        let rows = jacobian.map(|r| [-r[0], -r[1], -r[2] / arm]);
        let mut rest = [wrench[0] / half, wrench[1] / half, wrench[2] / (arm * half)];
        for row in &rows {
            for k in 0..3 {
                rest[k] -= row[k] * (bounds.middle() / half);
            }
        }
        let limits = limits.map(|limits| limits.map(|limit| (limit - bounds.middle()) / half));
        Self { rows, wrench: rest, limits }
    }

    /// `b - A t`.
    fn missing(&self, t: &[S]) -> [S; 3] {
        let mut rest = self.wrench;
        for (row, t) in self.rows.iter().zip(t) {
            for k in 0..3 {
                rest[k] -= row[k] * *t;
            }
        }
        rest
    }
}

/// One over each cable's curvature, none so small that the largest leaves nothing of it: a step may be too short along a
/// flat cable, which does no harm.
fn weights(curvature: PerCable<f64>) -> PerCable<f64> {
    let least = FLAT * curvature.iter().fold(0.0_f64, |a, b| a.max(if b.is_finite() { *b } else { 0.0 }));
    curvature.map(|c| 1.0 / c.max(least))
}

/// The inverse of `A D⁻¹ Aᵀ` over the cables with a weight `1/D`; `None` where they span fewer than three directions.
fn normal_inverse(rows: &[[f64; 3]], weight: &[f64]) -> Option<[[f64; 3]; 3]> {
    let mut normal = [[0.0; 3]; 3];
    for (row, weight) in rows.iter().zip(weight) {
        matrix3::add_outer(&mut normal, row, row, *weight);
    }
    // Of a symmetric positive matrix: its determinant against what its diagonal would allow.
    let diagonal: f64 = (0..3).map(|k| normal[k][k]).product();
    let [a, b, c] = normal;
    let cross = [b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]];
    let determinant = matrix3::dot(&a, &cross);
    (determinant > 1e-18 * diagonal && determinant.is_finite()).then(|| matrix3::inverse(&normal))
}

/// Tensions (N) that exert the wrench within the bounds, and where each lies. The problem must be feasible.
///
/// # Errors
/// [`DistributionError::Singular`]; an iteration that does not settle.
pub(super) fn solve(
    distribution: &Distribution,
    jacobian: &PerCable<[f64; 3]>,
    wrench: &[f64; 3],
    limits: &Limits,
) -> Result<(Selection, PerCable<f64>), DistributionError> {
    let bounds = distribution.bounds;
    let problem = Scaled::new(jacobian, wrench, limits, distribution);
    let cables = jacobian.len();
    let half = 0.5 * (bounds.upper - bounds.lower);
    let mut cost =
        Cost { objective: counted_in(half, distribution.objective), middle: bounds.middle() / half, reach: 1.0 };
    if normal_inverse(&problem.rows, &[1.0; crate::per_cable::MAX_CABLES][..cables]).is_none() {
        return Err(DistributionError::Singular);
    }
    if matches!(cost.objective, Objective::PNorm(_)) {
        let squares = Cost { objective: Objective::MidTension, ..cost };
        let near = central_path(&squares, &problem)?;
        cost.reach = reach((0..cables).map(|i| near[i].scaled(problem.limits[i])));
    }
    let place = central_path(&cost, &problem)?;
    let bound = PerCable::from_fn(cables, |i| match place[i] {
        Place::Lower => Some(limits[i][0]),
        Place::Upper => Some(limits[i][1]),
        Place::Free(_) => None,
    });
    let near = PerCable::from_fn(cables, |i| place[i].scaled(problem.limits[i]));
    let t = finish(&cost, &problem, &bound, &near)?;
    Ok((bound, t.map(|t| bounds.middle() + half * t)))
}

/// The same in any number type, for a selection and tensions made on the real parts.
///
/// # Errors
/// As [`solve`].
pub(super) fn lift<S: Real>(
    distribution: &Distribution,
    jacobian: &PerCable<[S; 3]>,
    wrench: &[S; 3],
    limits: &Limits<S>,
    (selection, tension): (&Selection, &PerCable<f64>),
) -> Result<PerCable<S>, DistributionError> {
    let bounds = distribution.bounds;
    let half = 0.5 * (bounds.upper - bounds.lower);
    let problem = Scaled::new(jacobian, wrench, limits, distribution);
    let near = tension.map(|t| (t - bounds.middle()) / half);
    let reach = reach(near.iter().copied());
    let flat = reach <= LEAST_REACH;
    // With all tensions at the middle a p-norm is flat or sharp; the square's minimum passes through the same point.
    let objective = match distribution.objective {
        Objective::PNorm(_) if flat => Objective::MidTension,
        other => counted_in(half, other),
    };
    let cost = Cost { objective, middle: bounds.middle() / half, reach };
    let t = finish(&cost, &problem, selection, &near)?;
    Ok(t.map(|t| t * half + bounds.middle()))
}

/// Where a cable ends: at a bound, or free at a scaled tension.
#[derive(Clone, Copy)]
enum Place {
    Lower,
    Upper,
    Free(f64),
}

impl Place {
    /// The scaled tension.
    fn scaled(self, [low, high]: [f64; 2]) -> f64 {
        match self {
            Self::Lower => low,
            Self::Upper => high,
            Self::Free(t) => t,
        }
    }
}

/// The largest distance from the middle.
fn reach(scaled: impl Iterator<Item = f64>) -> f64 {
    scaled.fold(LEAST_REACH, |most, t| most.max(t.abs()))
}

/// Follows the central path to the minimum.
fn central_path(cost: &Cost, problem: &Scaled<f64>) -> Result<PerCable<Place>, DistributionError> {
    let cables = problem.rows.len();
    let limits = &problem.limits;
    let mut t = limits.map(|[low, high]| 0.5 * (low + high));
    let below = |t: &PerCable<f64>, i: usize| t[i] - limits[i][0];
    let above = |t: &PerCable<f64>, i: usize| limits[i][1] - t[i];
    let (mut low, mut high) = (PerCable::filled(cables, 1.0), PerCable::filled(cables, 1.0));
    let mut multiplier = [0.0; 3];
    for _ in 0..STEPS {
        let gap: f64 = (0..cables).map(|i| low[i] * below(&t, i) + high[i] * above(&t, i)).sum();
        let missing = problem.missing(&t);
        let unmet = (0..cables)
            .map(|i| {
                (cost.slope(t[i], limits[i]) - matrix3::dot(&problem.rows[i], &multiplier) - low[i] + high[i]).abs()
            })
            .fold(0.0, f64::max);
        let size = missing.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
        let settled = gap < SETTLED * cables as f64 && size < SETTLED;
        if settled && unmet < 1e-9 * (1.0 + low.iter().chain(&high).fold(0.0_f64, |a, b| a.max(*b))) {
            return Ok(PerCable::from_fn(cables, |i| {
                if low[i] > below(&t, i) {
                    Place::Lower
                } else if high[i] > above(&t, i) {
                    Place::Upper
                } else {
                    Place::Free(t[i])
                }
            }));
        }
        let centre = 0.1 * gap / (2.0 * cables as f64);
        let free = weights(PerCable::from_fn(cables, |i| cost.majorant(t[i], limits[i])));
        let weight =
            PerCable::from_fn(cables, |i| 1.0 / (1.0 / free[i] + low[i] / below(&t, i) + high[i] / above(&t, i)));
        let pull = PerCable::from_fn(cables, |i| {
            matrix3::dot(&problem.rows[i], &multiplier) - cost.slope(t[i], limits[i]) + centre / below(&t, i)
                - centre / above(&t, i)
        });
        let Some(inverse) = normal_inverse(&problem.rows, &weight) else { break };
        let mut right = missing;
        for i in 0..cables {
            for k in 0..3 {
                right[k] -= problem.rows[i][k] * weight[i] * pull[i];
            }
        }
        let turn = matrix3::product(&inverse, &right);
        let step = PerCable::from_fn(cables, |i| weight[i] * (pull[i] + matrix3::dot(&problem.rows[i], &turn)));
        let low_step = PerCable::from_fn(cables, |i| (centre - low[i] * step[i]) / below(&t, i) - low[i]);
        let high_step = PerCable::from_fn(cables, |i| (centre + high[i] * step[i]) / above(&t, i) - high[i]);
        let room = |value: f64, step: f64| if step < 0.0 { -TO_THE_BOUND * value / step } else { 1.0 };
        let primal =
            (0..cables).map(|i| room(below(&t, i), step[i]).min(room(above(&t, i), -step[i]))).fold(1.0_f64, f64::min);
        let dual =
            (0..cables).map(|i| room(low[i], low_step[i]).min(room(high[i], high_step[i]))).fold(1.0_f64, f64::min);
        for i in 0..cables {
            t[i] += primal * step[i];
            low[i] += dual * low_step[i];
            high[i] += dual * high_step[i];
        }
        (0..3).for_each(|k| multiplier[k] += dual * turn[k]);
    }
    Err(DistributionError::NotSolved("the interior-point method does not settle".to_owned()))
}

/// Newton's method on the free cables from `near`, those at a bound kept there: exact but for rounding, one order of
/// derivatives a step.
fn finish<S: Real>(
    cost: &Cost,
    problem: &Scaled<S>,
    bound: &Selection,
    near: &PerCable<f64>,
) -> Result<PerCable<S>, DistributionError> {
    let cables = near.len();
    let real = problem.rows.map(|row| row.map(|v| v.re()));
    // Those at a bound do not count: their curvature is without end.
    let weight = weights(PerCable::from_fn(cables, |i| match bound[i] {
        Some(_) => f64::INFINITY,
        None => cost.curvature(near[i], problem.limits[i].map(|limit| limit.re())),
    }));
    let inverse = normal_inverse(&real, &weight).ok_or_else(|| {
        DistributionError::NotSolved("so many cables are at a bound that the others cannot balance the wrench".into())
    })?;
    let inverse = inverse.map(|row| row.map(S::from));
    let mut t = PerCable::from_fn(cables, |i| match bound[i] {
        Some(_) => nearer(near[i], &problem.limits[i]),
        None => S::from(near[i]),
    });
    let mut multiplier = [S::from(0.0); 3];
    for _ in 0..LAST_STEPS {
        let pull = PerCable::from_fn(cables, |i| {
            matrix3::dot(&problem.rows[i], &multiplier) - cost.slope(t[i], problem.limits[i])
        });
        let mut right = problem.missing(&t);
        for i in 0..cables {
            for k in 0..3 {
                right[k] -= problem.rows[i][k] * pull[i] * weight[i];
            }
        }
        let turn = matrix3::product(&inverse, &right);
        for i in 0..cables {
            t[i] += (pull[i] + matrix3::dot(&problem.rows[i], &turn)) * weight[i];
        }
        (0..3).for_each(|k| multiplier[k] += turn[k]);
    }
    Ok(t)
}

#[cfg(test)]
mod tests {
    use super::super::{Bounds, Redundancy, rows, structure_matrix};
    use super::*;
    use crate::geometry::Geometry;
    use crate::parameters::{CableParameters, Parameters};

    const OBJECTIVES: [Objective; 8] = [
        Objective::MinimumNorm,
        Objective::SmoothNorm(150.0),
        Objective::MidTension,
        Objective::Near(1.7e3),
        Objective::PNorm(1.5),
        Objective::PNorm(4.0),
        Objective::PNorm(12.0),
        Objective::AnalyticCentre,
    ];

    /// Anchors on an ellipse, attachments crossed on a platform of 0.3 m.
    fn robot(cables: usize) -> Geometry {
        let cable = (0..cables).map(|i| {
            let angle = std::f64::consts::TAU * (i as f64 + 0.3) / cables as f64;
            let on_body = angle + if i % 2 == 0 { 1.1 } else { -1.1 };
            CableParameters::between([3.0 * angle.cos(), 2.0 * angle.sin()], [0.3 * on_body.cos(), 0.2 * on_body.sin()])
        });
        Geometry::new(&Parameters { cable: cable.collect(), ..Parameters::default() })
    }

    #[test]
    fn with_four_cables_it_agrees_with_the_closed_forms() {
        let geometry = Geometry::new(&Parameters::default());
        let mut compared = 0;
        for k in 0..60 {
            let s = f64::from(k);
            let pose = [250.0 * (1.3 * s).sin(), 250.0 * (0.7 * s).cos(), 0.4 * (2.1 * s).sin()];
            let wrench = [2.5e3 * (0.9 * s).sin(), 2.5e3 * (1.7 * s).cos(), 2.5e4 * (3.1 * s).sin()];
            let structure = structure_matrix(&geometry, &pose);
            let rows = rows(&crate::kinematics::cables(&geometry, &pose, &[0.0; 3]));
            for objective in OBJECTIVES {
                let distribution = Distribution { objective, bounds: Bounds::new(1e3, 4e3).unwrap() };
                let Ok((_, closed)) = distribution.select(&structure, &wrench) else { continue };
                let limits = distribution.bounds.of_each(4);
                let (_, found) = solve(&distribution, &rows, &wrench, &limits).unwrap();
                let worst = closed.iter().zip(&found).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(worst < 1e-3, "{objective:?}: {closed:?} {found:?}");
                compared += 1;
            }
        }
        assert!(compared > 100, "only {compared} compared: the test says little");
    }

    /// No feasible neighbour along any internal tension is better.
    #[test]
    fn nothing_near_by_is_better_with_more_cables() {
        let bounds = Bounds::new(10.0, 200.0).unwrap();
        for cables in [5, 6, 8, 12] {
            let geometry = robot(cables);
            for (pose, wrench) in [([0.0; 3], [5.0, -20.0, 1.0]), ([0.4, -0.3, 0.2], [30.0, 60.0, -4.0])] {
                let structure = structure_matrix(&geometry, &pose);
                for objective in OBJECTIVES {
                    let distribution = Distribution { objective, bounds };
                    let (place, tension) = distribution.select(&structure, &wrench).unwrap();
                    let reached = &structure * nalgebra::DVector::from_column_slice(&tension);
                    assert!((0..3).all(|k| (reached[k] - wrench[k]).abs() < 1e-8), "{cables} {objective:?} {reached}");
                    assert!(tension.iter().all(|t| (10.0 - 1e-9..=200.0 + 1e-9).contains(t)), "{tension:?}");
                    let objective = counted_in(95.0, objective);
                    let cost = Cost { objective, middle: bounds.middle() / 95.0, reach: 1.0 };
                    // Slopes along the null space of the free cables vanish: f' is in the row space of A.
                    let free: Vec<usize> = (0..cables).filter(|i| place[*i].is_none()).collect();
                    let slope = nalgebra::DVector::from_iterator(
                        free.len(),
                        free.iter().map(|i| cost.slope((tension[*i] - bounds.middle()) / 95.0, [-1.0, 1.0])),
                    );
                    let a = nalgebra::DMatrix::from_fn(free.len(), 3, |r, c| structure[(c, free[r])]);
                    let fitted = a.clone().svd(true, true).solve(&slope, 1e-12).unwrap();
                    let left = (&a * &fitted - &slope).norm();
                    assert!(left < 1e-6 * (1.0 + slope.norm()), "{cables} {objective:?}: {left}");
                    // And a cable at its bound would have to push beyond it.
                    for i in (0..cables).filter(|i| place[*i].is_some()) {
                        let t = (tension[i] - bounds.middle()) / 95.0;
                        let force = (structure.column(i).transpose() * nalgebra::Vector3::from_fn(|k, _| fitted[k]))[0];
                        let excess = cost.slope(t, [-1.0, 1.0]) - force;
                        assert!(excess * t.signum() < 1e-6, "{cables} {objective:?}: cable {i} {excess}");
                    }
                }
            }
        }
    }

    #[test]
    fn derivatives_along_a_path_are_those_of_the_tensions() {
        use crate::inverse::Jet;
        let bounds = Bounds::new(10.0, 120.0).unwrap();
        for cables in [3, 6, 8] {
            let geometry = robot(cables);
            for objective in [
                Objective::MidTension,
                Objective::MinimumNorm,
                Objective::Near(40.0),
                Objective::PNorm(4.0),
                Objective::AnalyticCentre,
            ] {
                let distribution = Distribution { objective, bounds };
                let at = |time: f64| {
                    let pose = [0.2 * time, 0.1 * time * time, 0.05 * time];
                    let wrench = [4.0 * time, 10.0, 0.1 * time];
                    (pose, wrench)
                };
                let tension = |time: f64| {
                    let (pose, wrench) = at(time);
                    distribution.select(&structure_matrix(&geometry, &pose), &wrench)
                };
                let Ok((selection, plain)) = tension(0.7) else { continue };
                let time = Jet::new(0.7, 1.0, 0.0, 0.0);
                let pose = [time * 0.2, time * time * 0.1, time * 0.05];
                let wrench = [time * 4.0, Jet::from(10.0), time * 0.1];
                let rows = rows(&crate::kinematics::cables(&geometry, &pose, &[Jet::from(0.0); 3]));
                let limits = bounds.of_each(cables).map(|limits| limits.map(Jet::from));
                let lifted = distribution.lift(&rows, &wrench, &limits, (&selection, &plain)).unwrap();
                let h = 1e-4;
                let (ahead, behind) = (tension(0.7 + h).unwrap().1, tension(0.7 - h).unwrap().1);
                for i in 0..cables {
                    let slope = (ahead[i] - behind[i]) / (2.0 * h);
                    let bend = (ahead[i] - 2.0 * plain[i] + behind[i]) / (h * h);
                    assert!((lifted[i].re - plain[i]).abs() < 1e-8, "{cables} {objective:?}");
                    assert!((lifted[i].v1 - slope).abs() < 1e-4 * (1.0 + slope.abs()), "{cables} {objective:?} {i}");
                    assert!((lifted[i].v2 - bend).abs() < 0.05 * (1.0 + bend.abs()), "{cables} {objective:?} {i}");
                }
            }
        }
    }
}
