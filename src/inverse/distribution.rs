//! Tension distribution: one of infinitely many sets of cable tensions that exert a given wrench.
//!
//! With four cables and three degrees of freedom the tensions that balance a wrench are a line `T = T₀ + λ n`, with `T₀` the
//! minimum-norm solution and `n` the unit vector of internal tension. Bounds cut an interval out of it, and every
//! convex objective has one minimum there, so the methods for four cables are closed forms or a scalar root. With three
//! cables there is nothing to choose; with more than four the choice is a convex problem, see the file `general`.

use nalgebra::{DMatrix, DVector, Matrix3xX, Vector3};

use crate::dynamics::matrix3;
use crate::geometry::Geometry;
use crate::kinematics::{self, CableKinematics};
use crate::parameters::ParameterError;
use crate::per_cable::PerCable;
use crate::scalar::Real;

mod general;

/// The structure matrix `A = -J_Mᵀ` (3×n): tensions `T` exert the wrench `A T` on the platform, equations (8), (26), (27).
pub fn structure_matrix(geometry: &Geometry, pose: &[f64; 3]) -> Matrix3xX<f64> {
    -kinematics::jacobian(geometry, pose).transpose()
}

/// The arm (m) by which torques are compared with forces: the largest of the cables at this pose, `max |E × S|`.
pub fn torque_arm(structure: &Matrix3xX<f64>) -> f64 {
    structure.row(2).amax().max(LEAST_ARM)
}

/// The least arm that is divided by (m).
const LEAST_ARM: f64 = 1e-9;

/// Rows of `J_M` of all cables: `jacobian[i]` is `[S_x, S_y, E × S]` of cable `i`.
pub(crate) fn rows<S: Real>(cables: &PerCable<CableKinematics<S>>) -> PerCable<[S; 3]> {
    cables.map(|c| c.jacobian_row())
}

/// Bounds of every tension (N).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    lower: f64,
    upper: f64,
}

impl Bounds {
    /// Tensions from `lower` to `upper` (N).
    ///
    /// # Errors
    /// `lower` negative (cables cannot push), `upper` not above `lower`, or not finite.
    pub fn new(lower: f64, upper: f64) -> Result<Self, ParameterError> {
        crate::parameters::check_range("tension_min", lower, 0.0, f64::INFINITY)?;
        if upper > lower && upper.is_finite() {
            Ok(Self { lower, upper })
        } else {
            Err(ParameterError::new("tension_max", upper, format!("a finite number above `tension_min` ({lower})")))
        }
    }

    /// Tensions that suit a platform of this mass (kg) where nothing is said of them: from 0.4 to 20 N for each kilogram, which
    /// is 1 to 50 kN for that of Table I. So a small robot's cables are not strained by what a large one takes.
    pub fn of_mass(mass: f64) -> Self {
        Self { lower: 0.4 * mass, upper: 20.0 * mass }
    }

    /// Smallest tension (N).
    pub fn lower(&self) -> f64 {
        self.lower
    }

    /// Largest tension (N).
    pub fn upper(&self) -> f64 {
        self.upper
    }

    /// Their mean (N).
    pub fn middle(&self) -> f64 {
        0.5 * (self.lower + self.upper)
    }

    /// The same for each of `cables` cables.
    pub fn of_each(&self, cables: usize) -> Limits {
        PerCable::filled(cables, [self.lower, self.upper])
    }
}

/// The smallest and the largest tension (N) of each cable: the bounds, and what else there is that narrows them.
pub type Limits<S = f64> = PerCable<[S; 2]>;

/// What is made smallest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Objective {
    /// `Σ T_i²`: the least tension that the bounds allow.
    MinimumNorm,
    /// `Σ T_i²/2 - w² [ln (T_i - T_min) + ln (T_max - T_i)]`: the least tension with its kinks rounded over about the width `w`
    /// (N), for winch forces that depend on the tensions' rates.
    SmoothNorm(f64),
    /// `Σ |T_i - T_m|^p`, `p` from 1.5 to 20, about the mean `T_m` of the bounds: 2 is [`Objective::MidTension`], and towards large `p`
    /// the tension nearest to a bound is kept as far from it as can be (Gosselin and Grenier, Meccanica 46, 2011). About zero
    /// every `p` would ask for the least internal tension, as [`Objective::MinimumNorm`] does.
    PNorm(f64),
    /// `Σ (T_i - T_m)²` about the mean `T_m` of the bounds: the closed form of Pott, Bruckmann and Mikelsons (Computational
    /// Kinematics, 2009); cut off at the bounds it is, with one degree of redundancy, Pott's improved closed form (Advances in
    /// Robot Kinematics, 2014).
    MidTension,
    /// `Σ (T_i - T_0)²` about a given tension `T_0` (N), the pretension.
    Near(f64),
    /// `-Σ ln (T_i - T_min) + ln (T_max - T_i)`: the analytic centre of the feasible set, smooth along a trajectory and never
    /// at a bound.
    AnalyticCentre,
}

/// How redundancy is resolved: an objective within bounds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distribution {
    /// What is made smallest.
    pub objective: Objective,
    /// Where the tensions must lie.
    pub bounds: Bounds,
}

/// For each cable the bound (N) that its tension sits at, `None` where it is free; enough to carry derivatives along a
/// trajectory.
pub type Selection = PerCable<Option<f64>>;

/// No tensions within the bounds exert the wrench.
#[derive(Clone, Debug, PartialEq)]
pub struct Infeasible {
    /// The wrench asked for `[f_x, f_y, τ]` (N, N m).
    pub wrench: [f64; 3],
    /// The tensions within the bounds whose wrench comes nearest (N); a torque counts divided by the arm.
    pub nearest_tension: PerCable<f64>,
    /// The wrench that they exert.
    pub nearest_wrench: [f64; 3],
    /// What is missing: wrench asked for minus the nearest (N, N m).
    pub shortfall: [f64; 3],
}

/// Why there is no distribution.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DistributionError {
    /// Not feasible within the bounds.
    #[error(
        "no tensions within the bounds exert [{:.6e}, {:.6e}] N, {:.6e} N m; the nearest are {:.6?} N, \
         short by [{:.3e}, {:.3e}] N, {:.3e} N m",
        .0.wrench[0], .0.wrench[1], .0.wrench[2], .0.nearest_tension, .0.shortfall[0], .0.shortfall[1], .0.shortfall[2]
    )]
    Infeasible(Box<Infeasible>),
    /// Fewer cables than the plane has directions of force and torque.
    #[error("{found} cables cannot exert every force and torque in the plane; expected 3 or more")]
    TooFewCables {
        /// Number of cables.
        found: usize,
    },
    /// The cables do not span all three directions.
    #[error("the pose is singular: the cables cannot exert every direction of force and torque")]
    Singular,
    /// A solver gave up.
    #[error("the tension distribution was not solved: {0}")]
    NotSolved(String),
}

/// Something that resolves redundancy: [`Distribution`] in closed form, or a solver from elsewhere.
pub trait Redundancy {
    /// The distribution problem that is solved.
    fn distribution(&self) -> Distribution;

    /// Where the answer lies for the tensions within `limits`, which lie within the bounds, that exert `wrench` (N, N m) through
    /// `structure` (3×n).
    ///
    /// # Errors
    /// No feasible tensions, a singular pose, a solver that gave up.
    fn select_within(
        &self,
        structure: &Matrix3xX<f64>,
        wrench: &[f64; 3],
        limits: &Limits,
    ) -> Result<(Selection, PerCable<f64>), DistributionError>;

    /// The same where nothing but the bounds limits the tensions.
    ///
    /// # Errors
    /// As [`Redundancy::select_within`].
    fn select(
        &self,
        structure: &Matrix3xX<f64>,
        wrench: &[f64; 3],
    ) -> Result<(Selection, PerCable<f64>), DistributionError> {
        self.select_within(structure, wrench, &self.distribution().bounds.of_each(structure.ncols()))
    }
}

/// Cables that leave one degree of redundancy, so that the tensions that exert a wrench are a line.
const FOUR: usize = 4;

/// A cable (from 0) at a bound, which decides the others' tensions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AtBound {
    /// The cable.
    pub cable: usize,
    /// Its tension (N).
    pub tension: f64,
}

/// The line of tensions that exert a wrench.
#[derive(Clone, Copy, Debug)]
pub struct TensionLine<S = f64> {
    /// `T₀`: the minimum-norm solution, the pseudo-inverse's (N).
    pub minimum_norm: PerCable<S>,
    /// `n`: unit internal tension, `A n = 0`, its sum not negative.
    pub internal: PerCable<S>,
}

impl<S: Real> TensionLine<S> {
    /// The line for the rows of `J_M` and the wrench `[f_x, f_y, τ]` that the cables are to exert (N, N m).
    ///
    /// # Errors
    /// [`DistributionError::Singular`] where the rows have a rank below three.
    pub(crate) fn new(rows: &PerCable<[S; 3]>, wrench: &[S; 3]) -> Result<Self, DistributionError> {
        if rows.len() != FOUR {
            return Err(DistributionError::NotSolved(format!("{} cables, expected {FOUR}", rows.len())));
        }
        // n_i = ± determinant of the other three rows.
        let minor = |skip: usize| {
            let mut at = (0..FOUR).filter(|i| *i != skip);
            let [a, b, c] = std::array::from_fn(|_| rows[at.next().unwrap_or(0)]);
            let cross = [b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]];
            let det = matrix3::dot(&a, &cross);
            if skip.is_multiple_of(2) { det } else { -det }
        };
        let mut internal: PerCable<S> = PerCable::from_fn(FOUR, minor);
        let arm = rows.iter().map(|r| r[2].re().abs()).fold(0.0, f64::max);
        let norm = internal.iter().fold(S::from(0.0), |sum, n| sum + *n * *n).sqrt();
        // Unit rows and arms give minors of the order of the arm.
        if norm.re() <= 1e-12 * arm || norm.re().is_nan() {
            return Err(DistributionError::Singular);
        }
        let sign = if internal.iter().map(|n| n.re()).sum::<f64>() < 0.0 { -1.0 } else { 1.0 };
        for n in &mut internal {
            *n = *n / norm * sign;
        }
        // T₀ = Aᵀ (A Aᵀ)⁻¹ w with A = -Jᵀ.
        let mut gram = [[S::from(0.0); 3]; 3];
        for row in rows {
            matrix3::add_outer(&mut gram, row, row, S::from(1.0));
        }
        let multiplier = matrix3::product(&matrix3::inverse(&gram), wrench);
        Ok(Self { minimum_norm: PerCable::from_fn(FOUR, |i| -matrix3::dot(&rows[i], &multiplier)), internal })
    }

    /// The tensions at `λ` (N).
    pub fn at(&self, lambda: S) -> PerCable<S> {
        PerCable::from_fn(FOUR, |i| self.minimum_norm[i] + lambda * self.internal[i])
    }
}

impl TensionLine<f64> {
    /// The line for a structure matrix (3×4) and the wrench `[f_x, f_y, τ]` that the cables are to exert (N, N m).
    ///
    /// # Errors
    /// [`DistributionError::Singular`] where the matrix has a rank below three.
    pub fn of(structure: &Matrix3xX<f64>, wrench: &[f64; 3]) -> Result<Self, DistributionError> {
        let rows = PerCable::from_fn(structure.ncols(), |i| std::array::from_fn(|k| -structure[(k, i)]));
        Self::new(&rows, wrench)
    }

    /// The interval of `λ` (N) within the bounds, with the cable that makes each end; `None` where it is empty (Pott, *Cable-Driven
    /// Parallel Robots*, 2018, chapter 3).
    pub fn feasible(&self, bounds: &Bounds) -> Option<[(f64, Option<AtBound>); 2]> {
        self.feasible_within(&bounds.of_each(FOUR))
    }

    /// The same within each cable's own limits.
    pub fn feasible_within(&self, limits: &Limits) -> Option<[(f64, Option<AtBound>); 2]> {
        let (mut low, mut high) = ((f64::NEG_INFINITY, None), (f64::INFINITY, None));
        let slack = 1e-12 * limits.iter().fold(0.0_f64, |most, limits| most.max(limits[1]));
        for cable in 0..FOUR {
            let (t, n) = (self.minimum_norm[cable], self.internal[cable]);
            let [lower, upper] = limits[cable];
            if n.abs() < 1e-14 {
                if t < lower - slack || t > upper + slack {
                    return None;
                }
                continue;
            }
            let (first, last) = if n > 0.0 { (lower, upper) } else { (upper, lower) };
            let (a, b) = ((first - t) / n, (last - t) / n);
            if a > low.0 {
                low = (a, Some(AtBound { cable, tension: first }));
            }
            if b < high.0 {
                high = (b, Some(AtBound { cable, tension: last }));
            }
        }
        (low.0 <= high.0 + slack).then_some([low, high])
    }
}

impl Objective {
    /// Slope of the objective along the line, positive beyond the minimum.
    fn slope<S: Real>(&self, line: &TensionLine<S>, lambda: S, bounds: &Bounds, limits: &Limits<S>) -> S {
        let tension = line.at(lambda);
        let mut sum = S::from(0.0);
        for ((t, n), [lower, upper]) in tension.into_iter().zip(line.internal).zip(limits) {
            sum += n * match self {
                Self::MinimumNorm => t,
                // Scaled, so that high powers stay within range.
                Self::PNorm(p) => {
                    let t = (t - bounds.middle()) / (bounds.upper - bounds.middle());
                    if t.re() == 0.0 { t } else { t * t.abs().powf(p - 2.0) }
                }
                Self::MidTension => t - bounds.middle(),
                Self::Near(tension) => t - *tension,
                Self::SmoothNorm(width) => t + ((*upper - t).recip() - (t - *lower).recip()) * (width * width),
                Self::AnalyticCentre => (*upper - t).recip() - (t - *lower).recip(),
            };
        }
        sum
    }

    /// The `λ` of the objective's own minimum, within the open interval `(low, high)` for those that never reach a bound.
    fn minimum(&self, line: &TensionLine<f64>, [low, high]: [f64; 2], bounds: &Bounds, limits: &Limits) -> f64 {
        match self {
            Self::MinimumNorm => 0.0,
            Self::MidTension => line.internal.iter().map(|n| n * bounds.middle()).sum(),
            Self::Near(tension) => line.internal.iter().map(|n| n * tension).sum(),
            // The slope rises monotonically: bisection cannot fail, and costs a microsecond.
            Self::PNorm(_) | Self::AnalyticCentre | Self::SmoothNorm(_) => {
                let (mut a, mut b) = (low, high);
                let inward = 1e-13 * (high - low);
                if matches!(self, Self::PNorm(_)) {
                    if self.slope(line, a, bounds, limits) >= 0.0 {
                        return a - 1.0;
                    }
                    if self.slope(line, b, bounds, limits) <= 0.0 {
                        return b + 1.0;
                    }
                } else {
                    (a, b) = (a + inward, b - inward);
                }
                for _ in 0..200 {
                    let middle = 0.5 * (a + b);
                    if middle <= a || middle >= b {
                        break;
                    }
                    if self.slope(line, middle, bounds, limits) < 0.0 {
                        a = middle;
                    } else {
                        b = middle;
                    }
                }
                0.5 * (a + b)
            }
        }
    }

    /// `λ` at the minimum in any number type, from its real part: two derivatives a step by the implicit function theorem.
    fn minimum_with_derivatives<S: Real>(
        &self,
        line: &TensionLine<S>,
        lambda: f64,
        bounds: &Bounds,
        limits: &Limits<S>,
    ) -> S {
        let real =
            TensionLine { minimum_norm: line.minimum_norm.map(|t| t.re()), internal: line.internal.map(|n| n.re()) };
        let curvature = match self {
            Self::MinimumNorm | Self::MidTension | Self::Near(_) => 1.0,
            Self::PNorm(_) | Self::AnalyticCentre | Self::SmoothNorm(_) => {
                let dual = num_dual::Dual64::from_re(lambda).derivative();
                let line = TensionLine {
                    minimum_norm: real.minimum_norm.map(num_dual::Dual64::from_re),
                    internal: real.internal.map(num_dual::Dual64::from_re),
                };
                let limits = limits.map(|limits| limits.map(|limit| limit.re().into()));
                self.slope(&line, dual, bounds, &limits).eps
            }
        };
        if matches!(self, Self::PNorm(_)) && curvature * bounds.upper < 1e-250 {
            // With all tensions at the mean a high power is flat; the square's minimum passes through the same point.
            return Self::MidTension.minimum_with_derivatives(line, lambda, bounds, limits);
        }
        let mut refined = S::from(lambda);
        for _ in 0..3 {
            refined -= self.slope(line, refined, bounds, limits) / curvature;
        }
        refined
    }
}

impl Distribution {
    /// Tensions in any number type for a [`Selection`] and tensions made on the real parts, from the rows of `J_M`, the wrench and
    /// the limits.
    ///
    /// # Errors
    /// See [`Redundancy::select`].
    pub(crate) fn lift<S: Real>(
        &self,
        rows: &PerCable<[S; 3]>,
        wrench: &[S; 3],
        limits: &Limits<S>,
        (selection, tension): (&Selection, &PerCable<f64>),
    ) -> Result<PerCable<S>, DistributionError> {
        if rows.len() != FOUR {
            return general::lift(self, rows, wrench, limits, (selection, tension));
        }
        let line = TensionLine::new(rows, wrench)?;
        let at_bound = selection.iter().enumerate().find_map(|(cable, bound)| bound.map(|tension| (cable, tension)));
        if let Some((cable, tension)) = at_bound {
            let limit = nearer(tension, &limits[cable]);
            return Ok(line.at((limit - line.minimum_norm[cable]) / line.internal[cable]));
        }
        let lambda: f64 = (0..FOUR).map(|i| (tension[i] - line.minimum_norm[i].re()) * line.internal[i].re()).sum();
        Ok(line.at(self.objective.minimum_with_derivatives(&line, lambda, &self.bounds, limits)))
    }

    /// The tensions (N) that exert `wrench` (N, N m) through `structure` (3×n): (26), (27) solved for them.
    ///
    /// # Errors
    /// See [`Redundancy::select`].
    pub fn tensions(&self, structure: &Matrix3xX<f64>, wrench: &[f64; 3]) -> Result<PerCable<f64>, DistributionError> {
        self.select(structure, wrench).map(|(_, tension)| tension)
    }
}

/// That of a cable's limits (N) at which its tension is.
fn nearer<S: Real>(tension: f64, [lower, upper]: &[S; 2]) -> S {
    if (tension - lower.re()).abs() <= (tension - upper.re()).abs() { *lower } else { *upper }
}

impl Redundancy for Distribution {
    fn distribution(&self) -> Distribution {
        *self
    }

    fn select_within(
        &self,
        structure: &Matrix3xX<f64>,
        wrench: &[f64; 3],
        limits: &Limits,
    ) -> Result<(Selection, PerCable<f64>), DistributionError> {
        let cables = structure.ncols();
        if cables < 3 {
            return Err(DistributionError::TooFewCables { found: cables });
        }
        let infeasible = |found| Err(DistributionError::Infeasible(Box::new(found)));
        if cables != FOUR {
            let found = nearest_within(structure, wrench, limits);
            let arm = torque_arm(structure);
            let [x, y, torque] = found.shortfall;
            if x.abs().max(y.abs()).max(torque.abs() / arm) > 1e-9 * self.bounds.upper {
                return infeasible(found);
            }
            let rows = PerCable::from_fn(cables, |i| std::array::from_fn(|k| -structure[(k, i)]));
            return general::solve(self, &rows, wrench, limits);
        }
        let line = TensionLine::of(structure, wrench)?;
        let Some([low, high]) = line.feasible_within(limits) else {
            return infeasible(nearest_within(structure, wrench, limits));
        };
        let own = self.objective.minimum(&line, [low.0, high.0], &self.bounds, limits);
        let (lambda, selection) = if own <= low.0 {
            (low.0, low.1)
        } else if own >= high.0 {
            (high.0, high.1)
        } else {
            (own, None)
        };
        let mut bound = PerCable::filled(FOUR, None);
        if let Some(AtBound { cable, tension }) = selection {
            bound[cable] = Some(tension);
        }
        Ok((bound, line.at(lambda)))
    }
}

/// The unbounded minimum-norm tensions (N), the pseudo-inverse's: some are negative unless the wrench is zero.
///
/// # Errors
/// [`DistributionError::Singular`].
pub fn minimum_norm(structure: &Matrix3xX<f64>, wrench: &[f64; 3]) -> Result<PerCable<f64>, DistributionError> {
    TensionLine::of(structure, wrench).map(|line| line.minimum_norm)
}

/// The tensions within `bounds` whose wrench is nearest to `wrench`, a torque divided by the largest arm.
///
/// Least squares in a box by active sets: the free cables solve what the bound ones leave, the first bound met on the way
/// stops the step, and a bound is let go where that would bring the wrench nearer (P. B. Stark, R. L. Parker,
/// Computational Statistics 10, 1995).
pub fn nearest(structure: &Matrix3xX<f64>, wrench: &[f64; 3], bounds: &Bounds) -> Infeasible {
    nearest_within(structure, wrench, &bounds.of_each(structure.ncols()))
}

/// The same within each cable's own limits.
pub fn nearest_within(structure: &Matrix3xX<f64>, wrench: &[f64; 3], limits: &Limits) -> Infeasible {
    let arm = torque_arm(structure);
    let scale = Vector3::new(1.0, 1.0, 1.0 / arm);
    let a = Matrix3xX::from_fn(structure.ncols(), |r, c| structure[(r, c)] * scale[r]);
    let target = Vector3::from(*wrench).component_mul(&scale);
    let cables = a.ncols();
    let [lower, upper] = [0, 1].map(|side| limits.map(|limits| limits[side]));
    let largest = upper.iter().fold(0.0_f64, |most, limit| most.max(*limit));
    let mut tension = DVector::from_column_slice(&lower);
    let mut free = vec![false; cables];
    // Each round frees one cable and lowers the misfit, so no set of free cables comes back; 3ⁿ is far beyond need.
    for _ in 0..100 * cables {
        let slope = a.tr_mul(&(target - &a * &tension));
        let gain = |i: &usize| if tension[*i] <= lower[*i] { slope[*i] } else { -slope[*i] };
        let best = (0..cables).filter(|i| !free[*i]).max_by(|i, j| gain(i).total_cmp(&gain(j)));
        match best {
            Some(i) if gain(&i) > 1e-12 * target.norm().max(largest) => free[i] = true,
            _ => break,
        }
        while let Some(step) = step_of_free(&a, &target, &tension, &free) {
            let reach = |i: usize| {
                let room = if step[i] > 0.0 { upper[i] - tension[i] } else { lower[i] - tension[i] };
                if step[i] == 0.0 { 1.0 } else { (room / step[i]).max(0.0) }
            };
            let blocking = (0..cables).filter(|i| free[*i]).min_by(|i, j| reach(*i).total_cmp(&reach(*j)));
            let Some(i) = blocking.filter(|i| reach(*i) < 1.0) else {
                tension += step;
                break;
            };
            tension += &step * reach(i);
            tension[i] = if step[i] > 0.0 { upper[i] } else { lower[i] };
            free[i] = false;
        }
    }
    let reached = structure * &tension;
    Infeasible {
        wrench: *wrench,
        nearest_tension: PerCable::from_fn(cables, |i| tension[i].clamp(lower[i], upper[i])),
        nearest_wrench: reached.into(),
        shortfall: std::array::from_fn(|k| wrench[k] - reached[k]),
    }
}

/// The change of the free cables' tensions that brings the wrench nearest to `target`, the least of several; `None`
/// without a free cable.
fn step_of_free(
    a: &Matrix3xX<f64>,
    target: &Vector3<f64>,
    tension: &DVector<f64>,
    free: &[bool],
) -> Option<DVector<f64>> {
    let places: Vec<usize> = (0..free.len()).filter(|i| free[*i]).collect();
    if places.is_empty() {
        return None;
    }
    let columns = DMatrix::from_fn(3, places.len(), |r, c| a[(r, places[c])]);
    let rest = DVector::from_column_slice((target - a * tension).as_slice());
    let solution = columns.svd(true, true).solve(&rest, 1e-12).ok()?;
    let mut step = DVector::zeros(free.len());
    for (k, i) in places.into_iter().enumerate() {
        step[i] = solution[k];
    }
    Some(step)
}

#[cfg(test)]
mod tests;
