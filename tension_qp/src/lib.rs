//! Cable tensions by quadratic programming, with the interior-point solver Clarabel.
//!
//! The same problems as the closed forms of [`cdpr::inverse::distribution`] have, posed as a quadratic programme: an
//! independent check of them, and the place to start from where constraints are added for which there is no closed form. It
//! is a crate of its own so that the solver stays out of the plant, which becomes an FMU's binary.

use cdpr::inverse::distribution::{
    Bounds, Distribution, DistributionError, Infeasible, Limits, Objective, Redundancy, Selection, TensionLine,
    torque_arm,
};
use cdpr::per_cable::PerCable;
use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettings, DefaultSolver, IPSolver as _, NonnegativeConeT, SolverStatus, SupportedConeT, ZeroConeT,
};
use nalgebra::{DMatrix, DVector, Matrix3xX, Vector3};

/// A tension distribution solved as a quadratic programme.
///
/// Takes the objectives that are quadratic: [`Objective::MinimumNorm`], [`Objective::MidTension`] and [`Objective::Near`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QuadraticProgramme {
    /// What is solved.
    pub distribution: Distribution,
}

/// Relative distance from a bound within which the solver's answer counts as on it.
const ON_BOUND: f64 = 1e-6;

fn sparse(matrix: &DMatrix<f64>) -> CscMatrix<f64> {
    let rows: Vec<Vec<f64>> = matrix.row_iter().map(|row| row.iter().copied().collect()).collect();
    CscMatrix::from(&rows)
}

/// `min ½ tᵀ P t + qᵀ t` with `E t = e` and `t` within the limits; `None` where the constraints contradict each other.
fn solve(
    p: &DMatrix<f64>,
    q: &[f64],
    (equality, right): (&DMatrix<f64>, &[f64]),
    limits: &Limits,
) -> Result<Option<Vec<f64>>, DistributionError> {
    let (n, m) = (q.len(), equality.nrows());
    let mut constraints = DMatrix::zeros(m + 2 * n, n);
    constraints.view_mut((0, 0), (m, n)).copy_from(equality);
    let mut bound = right.to_vec();
    for i in 0..n {
        constraints[(m + i, i)] = 1.0;
        constraints[(m + n + i, i)] = -1.0;
    }
    bound.extend(limits.iter().map(|[_, upper]| *upper));
    bound.extend(limits.iter().map(|[lower, _]| -lower));
    let mut cones: Vec<SupportedConeT<f64>> = Vec::new();
    if m > 0 {
        cones.push(ZeroConeT(m));
    }
    cones.push(NonnegativeConeT(2 * n));
    let settings = DefaultSettings {
        verbose: false,
        tol_gap_abs: 1e-12,
        tol_gap_rel: 1e-12,
        tol_feas: 1e-12,
        ..Default::default()
    };
    let failed = |what: String| DistributionError::NotSolved(what);
    let mut solver = DefaultSolver::new(&sparse(p), q, &sparse(&constraints), &bound, &cones, settings)
        .map_err(|error| failed(format!("the quadratic programme was not accepted: {error:?}")))?;
    solver.solve();
    match solver.solution.status {
        SolverStatus::Solved | SolverStatus::AlmostSolved | SolverStatus::InsufficientProgress => {
            Ok(Some(solver.solution.x.clone()))
        }
        SolverStatus::PrimalInfeasible | SolverStatus::AlmostPrimalInfeasible => Ok(None),
        status => Err(failed(format!("the quadratic programme ended with {status:?}"))),
    }
}

impl QuadraticProgramme {
    /// The tensions within the bounds whose wrench is nearest to `wrench`, a torque divided by the largest arm.
    ///
    /// # Errors
    /// A solver that gave up.
    pub fn nearest(
        structure: &Matrix3xX<f64>,
        wrench: &[f64; 3],
        bounds: &Bounds,
    ) -> Result<Infeasible, DistributionError> {
        Self::nearest_within(structure, wrench, &bounds.of_each(structure.ncols()))
    }

    fn nearest_within(
        structure: &Matrix3xX<f64>,
        wrench: &[f64; 3],
        limits: &Limits,
    ) -> Result<Infeasible, DistributionError> {
        let arm = torque_arm(structure);
        let scale = [1.0, 1.0, 1.0 / arm];
        let unit = limits.iter().fold(0.0_f64, |most, limits| most.max(limits[1]));
        let scaled = limits.map(|limits| limits.map(|limit| limit / unit));
        let a = DMatrix::from_fn(3, structure.ncols(), |r, c| structure[(r, c)] * scale[r]);
        let target = Vector3::from_fn(|k, _| wrench[k] * scale[k] / unit);
        let q = -(a.transpose() * target);
        let free = DMatrix::zeros(0, structure.ncols());
        let solution = solve(&(a.transpose() * &a), q.as_slice(), (&free, &[]), &scaled)?
            .ok_or_else(|| DistributionError::NotSolved("a box cannot be empty".to_owned()))?;
        let tension =
            DVector::from_fn(structure.ncols(), |i, _| (solution[i] * unit).clamp(limits[i][0], limits[i][1]));
        let reached = structure * &tension;
        Ok(Infeasible {
            wrench: *wrench,
            nearest_tension: PerCable::from_fn(structure.ncols(), |i| tension[i]),
            nearest_wrench: reached.into(),
            shortfall: std::array::from_fn(|k| wrench[k] - reached[k]),
        })
    }
}

impl Redundancy for QuadraticProgramme {
    fn distribution(&self) -> Distribution {
        self.distribution
    }

    fn select_within(
        &self,
        structure: &Matrix3xX<f64>,
        wrench: &[f64; 3],
        limits: &Limits,
    ) -> Result<(Selection, PerCable<f64>), DistributionError> {
        let Distribution { objective, bounds } = self.distribution;
        let unit = bounds.upper();
        let reference = match objective {
            Objective::MinimumNorm => 0.0,
            Objective::MidTension => bounds.middle() / unit,
            Objective::Near(tension) => tension / unit,
            other => {
                let text =
                    format!("{other:?} is not quadratic; a quadratic programme takes MinimumNorm, MidTension or Near");
                return Err(DistributionError::NotSolved(text));
            }
        };
        let line = TensionLine::of(structure, wrench)?;
        let arm = torque_arm(structure);
        let scale = [1.0, 1.0, 1.0 / arm];
        let equality = DMatrix::from_fn(3, structure.ncols(), |r, c| structure[(r, c)] * scale[r]);
        let right: Vec<f64> = (0..3).map(|k| wrench[k] * scale[k] / unit).collect();
        let scaled = limits.map(|limits| limits.map(|limit| limit / unit));
        let identity = DMatrix::identity(structure.ncols(), structure.ncols());
        let Some(t) = solve(&identity, &vec![-reference; structure.ncols()], (&equality, &right), &scaled)? else {
            return Err(DistributionError::Infeasible(Box::new(Self::nearest_within(structure, wrench, limits)?)));
        };
        // The solver's answer is put on the line of exact solutions: at the bound that it touches, or at its own place.
        let touched = (0..structure.ncols())
            .flat_map(|i| scaled[i].map(|bound| (i, bound)))
            .map(|(i, bound)| (i, bound, (t[i] - bound).abs()))
            .min_by(|a, b| a.2.total_cmp(&b.2));
        let own: f64 = line.internal.iter().map(|n| n * reference * unit).sum();
        if let Some((cable, bound, distance)) = touched
            && distance < ON_BOUND
            && line.internal[cable].abs() > 1e-9
        {
            let tension = bound * unit;
            let lambda = (tension - line.minimum_norm[cable]) / line.internal[cable];
            // At its own minimum by chance on a bound, the answer is interior all the same.
            if (lambda - own).abs() > ON_BOUND * unit {
                let mut bound = PerCable::filled(t.len(), None);
                bound[cable] = Some(tension);
                return Ok((bound, line.at(lambda)));
            }
        }
        let lambda = (0..structure.ncols()).map(|i| t[i] * unit * line.internal[i]).sum();
        Ok((PerCable::filled(t.len(), None), line.at(lambda)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use cdpr::geometry::Geometry;
    use cdpr::inverse::distribution::{nearest, structure_matrix};
    use cdpr::parameters::Parameters;

    #[test]
    fn it_agrees_with_the_closed_forms() {
        let geometry = Geometry::new(&Parameters::default());
        let (mut interior, mut bound, mut infeasible) = (0, 0, 0);
        for k in 0..150 {
            let s = f64::from(k);
            let pose = [250.0 * (1.3 * s).sin(), 250.0 * (0.7 * s).cos(), 0.4 * (2.1 * s).sin()];
            let wrench = [2.5e3 * (0.9 * s).sin(), 2.5e3 * (1.7 * s).cos(), 2.5e4 * (3.1 * s).sin()];
            let structure = structure_matrix(&geometry, &pose);
            for objective in [Objective::MinimumNorm, Objective::MidTension, Objective::Near(1.7e3)] {
                let distribution = Distribution { objective, bounds: Bounds::new(1e3, 4e3).unwrap() };
                let closed = distribution.select(&structure, &wrench);
                let solved = QuadraticProgramme { distribution }.select(&structure, &wrench);
                match (closed, solved) {
                    (Ok((_, a)), Ok((selection, b))) => {
                        if selection.iter().any(Option::is_some) {
                            bound += 1;
                        } else {
                            interior += 1;
                        }
                        for i in 0..a.len() {
                            assert!((a[i] - b[i]).abs() < 1e-3, "{objective:?}: {a:?} {b:?}");
                        }
                    }
                    (Err(DistributionError::Infeasible(a)), Err(DistributionError::Infeasible(b))) => {
                        infeasible += 1;
                        for k in 0..3 {
                            assert!((a.shortfall[k] - b.shortfall[k]).abs() < 1e-2, "{a:?} {b:?}");
                        }
                    }
                    (a, b) => panic!("{a:?} against {b:?}"),
                }
            }
        }
        assert!(interior > 20 && bound > 20 && infeasible > 20, "{interior} {bound} {infeasible}");
    }

    #[test]
    fn nearest_tensions_agree() {
        let structure = structure_matrix(&Geometry::new(&Parameters::default()), &[100.0, -50.0, 0.2]);
        let bounds = Bounds::new(1e3, 3e3).unwrap();
        let wrench = [9e3, 1e3, -4e4];
        let (a, b) = (nearest(&structure, &wrench, &bounds), QuadraticProgramme::nearest(&structure, &wrench, &bounds));
        let b = b.unwrap();
        for k in 0..3 {
            assert!((a.shortfall[k] - b.shortfall[k]).abs() < 1e-3, "{a:?} {b:?}");
        }
    }

    #[test]
    fn an_objective_that_is_not_quadratic_is_refused() {
        let distribution = Distribution { objective: Objective::PNorm(4.0), bounds: Bounds::new(1e3, 3e3).unwrap() };
        let structure = structure_matrix(&Geometry::new(&Parameters::default()), &[0.0; 3]);
        let error = QuadraticProgramme { distribution }.select(&structure, &[0.0; 3]).unwrap_err();
        assert!(error.to_string().contains("not quadratic"), "{error}");
    }
}
