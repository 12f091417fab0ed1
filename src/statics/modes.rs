//! Natural modes: frequencies, damping ratios, shapes.

use nalgebra::{DMatrix, DVector, Matrix3, Schur};
use num_complex::Complex64;
use num_dual::Dual64;

use super::stiffness::tension_and_slope;
use super::{LinearModel, StaticsError};
use crate::dynamics::{Held, MAX_EFFECT_STATES};
use crate::inverse::wrench::{Prescribed, required};
use crate::kinematics;
use crate::parameters::CableModel;
use crate::per_cable::PerCable;
use crate::plant::Plant;

/// One natural mode: a real eigenvalue or a pair of complex ones.
#[derive(Clone, Debug, PartialEq)]
pub struct Mode {
    /// The eigenvalue with the positive imaginary part (1/s).
    pub eigenvalue: Complex64,
    /// How each state takes part, complex (phases), the largest of magnitude 1 after scaling lengths by 1 m and angles by
    /// the attachment radius.
    pub shape: Vec<Complex64>,
}

impl Mode {
    /// Whether it neither grows nor decays but stays where it is put: winches that follow a speed keep any length. Its
    /// eigenvalue is zero, and it has no damping ratio and no time constant.
    pub fn is_neutral(&self) -> bool {
        self.eigenvalue == Complex64::ZERO
    }

    /// Whether it oscillates.
    pub fn oscillates(&self) -> bool {
        self.eigenvalue.im > 0.0
    }

    /// Whether it grows.
    pub fn is_unstable(&self) -> bool {
        self.eigenvalue.re > 0.0
    }

    /// Natural angular frequency `|λ|` (rad/s).
    pub fn natural_frequency(&self) -> f64 {
        self.eigenvalue.norm()
    }

    /// Period of the oscillation `2π/|Im λ|` (s); infinite where there is none.
    pub fn period(&self) -> f64 {
        std::f64::consts::TAU / self.eigenvalue.im
    }

    /// Damping ratio `-Re λ/|λ|`: 1 for a decaying real mode, -1 for a growing one.
    pub fn damping_ratio(&self) -> f64 {
        -self.eigenvalue.re / self.eigenvalue.norm()
    }

    /// Time in which it decays or grows by the factor e (s).
    pub fn time_constant(&self) -> f64 {
        1.0 / self.eigenvalue.re.abs()
    }
}

/// The modes of `ẋ = A x`, slowest first; `size` is the unit of each state in the shapes.
///
/// # Errors
/// [`StaticsError::NoEigenvalues`].
pub fn modes_of(a: &DMatrix<f64>, size: &[f64]) -> Result<Vec<Mode>, StaticsError> {
    let n = a.nrows();
    let scaled = DMatrix::from_fn(n, n, |r, c| a[(r, c)] * size[c] / size[r]);
    let mut balanced = scaled.clone();
    nalgebra::linalg::balancing::balance_parlett_reinsch(&mut balanced);
    let size = balanced.norm();
    let values = eigenvalues(balanced)?;
    let mut modes: Vec<Mode> = values
        .iter()
        .map(|value| {
            let rounding = |part: f64| part.abs() <= ZERO * size;
            // Equal real eigenvalues may come as a pair a hair apart.
            let im = if rounding(value.im) { 0.0 } else { value.im };
            if rounding(value.norm()) { Complex64::ZERO } else { Complex64::new(value.re, im) }
        })
        .filter(|value| value.im >= 0.0)
        .map(|value| Mode { eigenvalue: value, shape: eigenvector(&scaled, value) })
        .collect();
    modes.sort_by(|a, b| a.natural_frequency().total_cmp(&b.natural_frequency()));
    Ok(modes)
}

/// What rounding leaves of an eigenvalue or an imaginary part that is zero, as a part of the matrix's norm.
const ZERO: f64 = 1e-12;

/// The eigenvalues of a balanced matrix, complex ones in pairs.
///
/// The iteration compares what is left below the diagonal with the diagonal beside it, and may not end where that is zero, as
/// winches that follow a speed have it. Then the matrix is moved away from zero by its norm, and its eigenvalues back: they are
/// good to rounding of the norm, as without.
fn eigenvalues(a: DMatrix<f64>) -> Result<Vec<Complex64>, StaticsError> {
    let (n, away) = (a.nrows(), a.norm());
    let schur = |a: DMatrix<f64>| Schur::try_new(a, f64::EPSILON, 10_000);
    let (found, moved) = match schur(a.clone()) {
        Some(found) => (found, 0.0),
        None => {
            let moved = a + DMatrix::from_diagonal_element(n, n, away);
            (schur(moved).ok_or(StaticsError::NoEigenvalues)?, away)
        }
    };
    Ok(found.complex_eigenvalues().iter().map(|value| Complex64::new(value.re - moved, value.im)).collect())
}

/// Inverse iteration, normalised to a largest component of 1.
fn eigenvector(a: &DMatrix<f64>, value: Complex64) -> Vec<Complex64> {
    let n = a.nrows();
    // A little off the eigenvalue the matrix is regular, and still amplifies its direction by far the most.
    let shift = value + Complex64::new(1e-9, 1e-9) * (value.norm() + 1e-6);
    let matrix = a.map(|v| Complex64::new(v, 0.0)) - DMatrix::from_diagonal_element(n, n, shift);
    let lu = matrix.lu();
    let mut v = DVector::from_fn(n, |i, _| Complex64::new(1.0 + 0.1 * i as f64, 0.05 * i as f64));
    for _ in 0..4 {
        let Some(next) = lu.solve(&v) else { break };
        let largest = next.iter().copied().fold(Complex64::default(), |a, b| if b.norm() > a.norm() { b } else { a });
        if largest.norm() == 0.0 || !largest.norm().is_finite() {
            break;
        }
        v = next / largest;
    }
    v.iter().copied().collect()
}

/// Unit of each state in mode shapes: metres, and angles over the attachment radius.
fn sizes(plant: &Plant, n: usize) -> Vec<f64> {
    let arm = plant.geometry().attachment_scale();
    let mut size = vec![1.0; n];
    size[2] = 1.0 / arm;
    size[5] = 1.0 / arm;
    size
}

/// Modes with every winch holding its force, from the linear model of the whole plant: eigenvalues of (29) or
/// (41) linearised.
///
/// # Errors
/// [`StaticsError::NoEigenvalues`].
pub fn force_controlled_modes(plant: &Plant, linear: &LinearModel) -> Result<Vec<Mode>, StaticsError> {
    modes_of(&linear.a, &sizes(plant, linear.a.nrows()))
}

/// The platform on locked winches: `M ẍ + C ẋ + K x = 0`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LockedModel {
    /// Mass matrix with the cables' transverse inertia (kg, kg m, kg m²).
    pub mass: Matrix3<f64>,
    /// Damping (N s/m, N s, N m s).
    pub damping: Matrix3<f64>,
    /// Stiffness (N/m, N, N m).
    pub stiffness: Matrix3<f64>,
    arm: f64,
}

impl LockedModel {
    /// Modes over the states `[x, y, φ, vx, vy, φ̇]`, slowest first.
    ///
    /// # Errors
    /// [`StaticsError::NoEigenvalues`].
    pub fn modes(&self) -> Result<Vec<Mode>, StaticsError> {
        let inverse = self.mass.try_inverse().ok_or(StaticsError::NoEigenvalues)?;
        let (k, c) = (inverse * self.stiffness, inverse * self.damping);
        let a = DMatrix::from_fn(6, 6, |row, column| match (row, column) {
            (0..3, 3..6) => f64::from(u8::from(column == row + 3)),
            (3..6, 0..3) => -k[(row - 3, column)],
            (3..6, 3..6) => -c[(row - 3, column - 3)],
            _ => 0.0,
        });
        modes_of(&a, &[1.0, 1.0, 1.0 / self.arm, 1.0, 1.0, 1.0 / self.arm])
    }
}

/// The platform at rest at `pose` (m, rad) on locked winches, its cables carrying `tension` (N), linearised exactly: (26), (27), (32), (33).
///
/// The winch ends stand still, so only the transverse inertia of the cables moves. Cables without tension are slack. States
/// of elastic laws (creep) are held.
///
/// # Errors
/// [`StaticsError::Rigid`].
pub fn locked_model(
    plant: &Plant,
    time: f64,
    pose: &[f64; 3],
    tension: &PerCable<f64>,
) -> Result<LockedModel, StaticsError> {
    let plant = plant.at(time);
    let data = plant.data();
    if data.cables.iter().any(|c| c.model == CableModel::Rigid) {
        return Err(StaticsError::Rigid);
    }
    let lengths = kinematics::cable_lengths(plant.geometry(), pose);
    let mut unstretched = PerCable::filled(plant.cables(), 0.0);
    let mut states = PerCable::filled(plant.cables(), [0.0; MAX_EFFECT_STATES]);
    for i in 0..plant.cables() {
        plant.start_effect_states(i, tension[i], tension[i].max(0.0), &mut states[i]);
        unstretched[i] = plant.unstretched_length_for(i, time, lengths[i], tension[i], &states[i]);
        debug_assert!(
            tension[i] <= 0.0
                || (tension_and_slope(plant, i, time, lengths[i], unstretched[i], &states[i]).0 - tension[i]).abs()
                    < 1e-4 * (1.0 + tension[i])
        );
    }
    // What is missing in the balance of the platform, as a function of pose, twist and acceleration.
    let missing = |pose: [Dual64; 3], twist: [Dual64; 3], acceleration: [Dual64; 3]| {
        let motion = Prescribed { time: time.into(), pose, twist, acceleration, disturbance: [Dual64::from(0.0); 3] };
        let cables = kinematics::cables(plant.geometry(), &motion.pose, &motion.twist);
        let mut wrench = required(plant, &motion, &cables);
        for i in (0..plant.cables()).filter(|i| tension[*i] > 0.0) {
            let (k, states) = (&cables[i], states[i].map(Dual64::from));
            let (chord, paid_out) = ([k.length, k.speed], [unstretched[i].into(), Dual64::from(0.0)]);
            let (angular_rate, slack, states) = (k.angular_rate, false, &states[..]);
            let held = Held { time: time.into(), chord, paid_out, angular_rate, slack, states };
            let tension = plant.chain(i).carried(&held);
            for (sum, row) in wrench.iter_mut().zip(cables[i].jacobian_row()) {
                *sum += tension * row;
            }
        }
        wrench
    };
    let derivative = |place: usize| {
        let mut matrix = Matrix3::zeros();
        for column in 0..3 {
            let mut motion = [pose.map(Dual64::from_re), [Dual64::from(0.0); 3], [Dual64::from(0.0); 3]];
            motion[place][column].eps = 1.0;
            let [pose, twist, acceleration] = motion;
            for (row, value) in missing(pose, twist, acceleration).iter().enumerate() {
                matrix[(row, column)] = value.eps;
            }
        }
        matrix
    };
    Ok(LockedModel {
        mass: derivative(2),
        damping: derivative(1),
        stiffness: derivative(0),
        arm: plant.geometry().attachment_scale(),
    })
}
