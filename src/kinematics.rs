//! Kinematics of the 4RPR manipulator, equations (1)-(16).

use nalgebra::{SMatrix, SVector};

use crate::geometry::Geometry;
use crate::parameters::CABLES;
use crate::scalar::Real;

/// One cable at one instant: vectors, length, and their first derivatives.
///
/// `direction` is `S` (from the anchor to the attachment point), the normal is `N = K × S`.
#[derive(Clone, Copy, Debug)]
pub struct CableKinematics<S = f64> {
    /// `E`: from the platform's reference point G to the attachment point, in the fixed frame (m).
    pub arm: [S; 2],
    /// `S`: unit vector from anchor to attachment point.
    pub direction: [S; 2],
    /// `L` (m), equation (4).
    pub length: S,
    /// `L̇` (m/s), equation (6).
    pub speed: S,
    /// `α̇` (rad/s), equation (10).
    pub angular_rate: S,
    /// `E × S` (m): the third entry of the row of `J_M`.
    pub arm_cross_direction: S,
    /// `E · S` (m): the third entry of `L` times the row of `J_α`.
    pub arm_dot_direction: S,
}

impl<S: Real> CableKinematics<S> {
    /// Kinematics of the cable from `anchor` (m, fixed frame) to `attachment` (m, body frame).
    ///
    /// `pose` is `[x, y, φ]` with `rotation = [cos φ, sin φ]`, `twist` is `[vx, vy, φ̇]`.
    #[inline]
    pub fn new(anchor: [f64; 2], attachment: [f64; 2], pose: &[S; 3], rotation: [S; 2], twist: &[S; 3]) -> Self {
        let [cos, sin] = rotation;
        let arm = [cos * attachment[0] - sin * attachment[1], sin * attachment[0] + cos * attachment[1]];
        let d = [pose[0] + arm[0] - anchor[0], pose[1] + arm[1] - anchor[1]];
        let length = (d[0] * d[0] + d[1] * d[1]).sqrt();
        let inverse = length.recip();
        let direction = [d[0] * inverse, d[1] * inverse];
        let arm_cross_direction = arm[0] * direction[1] - arm[1] * direction[0];
        let arm_dot_direction = arm[0] * direction[0] + arm[1] * direction[1];
        let speed = direction[0] * twist[0] + direction[1] * twist[1] + arm_cross_direction * twist[2];
        let angular_rate = (direction[0] * twist[1] - direction[1] * twist[0] + arm_dot_direction * twist[2]) * inverse;
        Self { arm, direction, length, speed, angular_rate, arm_cross_direction, arm_dot_direction }
    }

    /// Row of `J_M`, equation (8): `L̇ = J_M [vx, vy, φ̇]`. Units: 1, 1, m.
    #[inline]
    pub fn jacobian_row(&self) -> [S; 3] {
        [self.direction[0], self.direction[1], self.arm_cross_direction]
    }

    /// `L` times the row of `J_α`, equation (9): `L α̇ = [-S_y, S_x, E·S] [vx, vy, φ̇]`. Units: 1, 1, m.
    ///
    /// A force `q` along `N` at the attachment point has the wrench `q` times this row.
    #[inline]
    pub fn normal_row(&self) -> [S; 3] {
        [-self.direction[1], self.direction[0], self.arm_dot_direction]
    }

    /// `E · N` (m).
    #[inline]
    pub fn arm_dot_normal(&self) -> S {
        self.arm[1] * self.direction[0] - self.arm[0] * self.direction[1]
    }

    /// `L̈ - J_M row · [ax, ay, φ̈]`: the velocity-dependent part of equation (12) (m/s²).
    #[inline]
    pub fn length_acceleration_bias(&self, omega: S) -> S {
        self.length * self.angular_rate * self.angular_rate - omega * omega * self.arm_dot_direction
    }

    /// `L α̈ - normal row · [ax, ay, φ̈]`: the velocity-dependent part of equation (14), times `L` (m/s²).
    #[inline]
    pub fn normal_acceleration_bias(&self, omega: S) -> S {
        -(omega * omega * self.arm_dot_normal()) - self.speed * self.angular_rate * 2.0
    }

    /// `α` (rad), equation (5).
    #[inline]
    pub fn angle(&self) -> S {
        self.direction[1].atan2(self.direction[0])
    }
}

/// Kinematics of all cables at `pose` `[x, y, φ]` (m, rad) and `twist` `[vx, vy, φ̇]` (m/s, rad/s).
pub fn cables<S: Real>(geometry: &Geometry, pose: &[S; 3], twist: &[S; 3]) -> [CableKinematics<S>; CABLES] {
    let rotation = [pose[2].cos(), pose[2].sin()];
    std::array::from_fn(|i| CableKinematics::new(geometry.anchor[i], geometry.attachment[i], pose, rotation, twist))
}

/// Inverse kinematics: the four cable lengths (m) at `pose`, equation (4).
pub fn cable_lengths(geometry: &Geometry, pose: &[f64; 3]) -> SVector<f64, CABLES> {
    let cables = cables(geometry, pose, &[0.0; 3]);
    SVector::from_fn(|i, _| cables[i].length)
}

/// The manipulator Jacobian `J_M` (4×3), equation (8): `L̇ = J_M Ẋ`. The structure matrix is `-J_Mᵀ`.
pub fn jacobian(geometry: &Geometry, pose: &[f64; 3]) -> SMatrix<f64, CABLES, 3> {
    let cables = cables(geometry, pose, &[0.0; 3]);
    SMatrix::from_fn(|i, j| cables[i].jacobian_row()[j])
}

/// `J_α` (4×3), equation (9): `α̇ = J_α Ẋ`.
pub fn angular_jacobian(geometry: &Geometry, pose: &[f64; 3]) -> SMatrix<f64, CABLES, 3> {
    let cables = cables(geometry, pose, &[0.0; 3]);
    SMatrix::from_fn(|i, j| cables[i].normal_row()[j] / cables[i].length)
}

/// Accelerations of lengths `L̈` (m/s²) and angles `α̈` (rad/s²), equations (12) and (14).
pub fn accelerations(
    geometry: &Geometry,
    pose: &[f64; 3],
    twist: &[f64; 3],
    acceleration: &[f64; 3],
) -> ([f64; CABLES], [f64; CABLES]) {
    let cables = cables(geometry, pose, twist);
    let dot = |row: [f64; 3]| row.iter().zip(acceleration).map(|(a, b)| a * b).sum::<f64>();
    let length = cables.map(|c| dot(c.jacobian_row()) + c.length_acceleration_bias(twist[2]));
    let angle = cables.map(|c| (dot(c.normal_row()) + c.normal_acceleration_bias(twist[2])) / c.length);
    (length, angle)
}

/// Why forward kinematics has no answer.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ForwardKinematicsError {
    /// Gauss-Newton did not settle.
    #[error("forward kinematics did not converge in {iterations} iterations (last step {last_step:e} m or rad)")]
    NotConverged {
        /// Iterations done.
        iterations: usize,
        /// Size of the last step.
        last_step: f64,
    },
    /// The four lengths contradict each other beyond the tolerance: no pose has them.
    #[error("no pose has these cable lengths: the best one misses them by {residual:e} m (tolerance {tolerance:e} m)")]
    Inconsistent {
        /// Root mean square misfit of the lengths (m).
        residual: f64,
        /// The tolerance asked for (m).
        tolerance: f64,
    },
}

/// Forward kinematics: the pose whose four cable lengths fit `lengths` (m) best, by Gauss-Newton from `guess`.
///
/// Four lengths for three unknowns: redundant, so the misfit tells whether the lengths belong together.
///
/// # Errors
/// When the iteration does not settle, or the root mean square misfit of the result is above `tolerance` (m).
pub fn forward_kinematics(
    geometry: &Geometry,
    lengths: &[f64; CABLES],
    guess: [f64; 3],
    tolerance: f64,
) -> Result<[f64; 3], ForwardKinematicsError> {
    const ITERATIONS: usize = 50;
    let target = SVector::<f64, CABLES>::from(*lengths);
    let mut pose = guess;
    let mut last_step = f64::INFINITY;
    for _ in 0..ITERATIONS {
        let misfit = target - cable_lengths(geometry, &pose);
        let j = jacobian(geometry, &pose);
        // The arm scales the angle to a length, so that one step limit serves all three.
        let Some(step) = (j.transpose() * j).cholesky().map(|c| c.solve(&(j.transpose() * misfit))) else { break };
        let arm = geometry.attachment_scale();
        last_step = step[0].abs().max(step[1].abs()).max(step[2].abs() * arm);
        let damping = (0.5 * arm / last_step).min(1.0).max(0.05);
        for k in 0..3 {
            pose[k] += damping * step[k];
        }
        if !last_step.is_finite() {
            break;
        }
        if last_step < 1e-11 * geometry.size() {
            let residual = (target - cable_lengths(geometry, &pose)).norm() / (CABLES as f64).sqrt();
            if residual > tolerance {
                return Err(ForwardKinematicsError::Inconsistent { residual, tolerance });
            }
            return Ok(pose);
        }
    }
    Err(ForwardKinematicsError::NotConverged { iterations: ITERATIONS, last_step })
}
