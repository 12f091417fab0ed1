//! How one cable's chord follows the platform: the derivatives of its kinematics by pose `q` and twist `v`.

use crate::kinematics::CableKinematics;

use super::super::matrix3::{Matrix3, add_outer, combine, dot};

/// A cable's kinematics and their first derivatives. Rows are by `[x, y, φ]` or `[vx, vy, φ̇]`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Chord {
    pub(super) kinematics: CableKinematics,
    /// `∂L/∂q = ∂L̇/∂v`: the row of `J_M`.
    pub(super) row: [f64; 3],
    /// `L` times the row of `J_α`.
    pub(super) normal: [f64; 3],
    /// `∂α/∂q = ∂α̇/∂v`: the row of `J_α`.
    pub(super) turn: [f64; 3],
    /// `∂L̇/∂q`.
    pub(super) speed_by_pose: [f64; 3],
    /// `∂f/∂q` of the straight part.
    pub(super) span_by_pose: [f64; 3],
    /// `∂α̇/∂q`.
    pub(super) turning_by_pose: [f64; 3],
    twist: [f64; 3],
}

impl Chord {
    pub(super) fn new(kinematics: &CableKinematics, twist: [f64; 3]) -> Self {
        let (row, normal) = (kinematics.jacobian_row(), kinematics.normal_row());
        let zero = [0.0; 3];
        let turn = normal.map(|n| n / kinematics.span);
        let kinematics = *kinematics;
        let span_by_pose = combine(1.0, &row, kinematics.pulley_radius, &turn);
        let mut chord =
            Self { kinematics, row, normal, turn, speed_by_pose: zero, span_by_pose, turning_by_pose: zero, twist };
        chord.speed_by_pose = chord.row_change(&twist);
        let inverse = 1.0 / kinematics.span;
        chord.turning_by_pose =
            combine(inverse, &chord.normal_change(&twist), -kinematics.angular_rate * inverse, &span_by_pose);
        chord
    }

    /// `∂(row · a)/∂q` for a fixed `a`, by (12).
    pub(super) fn row_change(&self, a: &[f64; 3]) -> [f64; 3] {
        let mut change = self.turn.map(|t| t * dot(&self.normal, a));
        change[2] -= self.kinematics.arm_dot_direction * a[2];
        change
    }

    /// `∂(normal · a)/∂q` for a fixed `a`, by (14).
    pub(super) fn normal_change(&self, a: &[f64; 3]) -> [f64; 3] {
        let mut change = self.turn.map(|t| -t * dot(&self.row, a));
        change[2] += self.kinematics.arm_cross_direction * a[2];
        change
    }

    /// Adds `factor ∂(rowᵀ)/∂q`: what a force along the cable does as it turns with it.
    pub(super) fn add_row_derivative(&self, m: &mut Matrix3<f64>, factor: f64) {
        add_outer(m, &self.normal, &self.turn, factor);
        m[2][2] -= factor * self.kinematics.arm_dot_direction;
    }

    /// Adds `factor ∂(normalᵀ)/∂q`: what a force across the cable does as it turns with it.
    pub(super) fn add_normal_derivative(&self, m: &mut Matrix3<f64>, factor: f64) {
        add_outer(m, &self.row, &self.turn, -factor);
        m[2][2] += factor * self.kinematics.arm_cross_direction;
    }

    /// Acceleration `L̈` of the cable's end along the chord, and its derivatives by pose and twist, at platform
    /// acceleration `a`: (12).
    pub(super) fn along(&self, a: &[f64; 3]) -> (f64, [f64; 3], [f64; 3]) {
        let k = &self.kinematics;
        let omega = self.twist[2];
        let value = k.length_acceleration(a, omega);
        let rate = k.angular_rate;
        let mut by_pose = self.row_change(a);
        let mut by_twist = self.normal.map(|n| 2.0 * rate * n);
        for c in 0..3 {
            by_pose[c] += rate * rate * self.span_by_pose[c] + 2.0 * k.span * rate * self.turning_by_pose[c];
            by_pose[c] += omega * omega * k.arm_cross_direction * self.turn[c];
        }
        by_pose[2] -= omega * omega * k.arm_cross_direction;
        by_twist[2] -= 2.0 * omega * k.arm_dot_direction;
        (value, by_pose, by_twist)
    }

    /// `f α̈ + 3 ḟ α̇` of the straight part `f`, the acceleration that a straight cable's mass across answers to, and its derivatives by pose and twist,
    /// at platform acceleration `a`: (14).
    pub(super) fn across(&self, a: &[f64; 3]) -> (f64, [f64; 3], [f64; 3]) {
        let k = &self.kinematics;
        let omega = self.twist[2];
        let given_off = 2.0 * k.pulley_radius * k.angular_rate;
        let value = k.acceleration_across(a, omega);
        let mut by_pose = self.normal_change(a);
        let mut by_twist = combine(k.angular_rate, &self.row, k.speed + 2.0 * given_off, &self.turn);
        for c in 0..3 {
            by_pose[c] +=
                k.angular_rate * self.speed_by_pose[c] + (k.speed + 2.0 * given_off) * self.turning_by_pose[c];
            by_pose[c] += omega * omega * k.arm_dot_direction * self.turn[c];
        }
        by_pose[2] -= omega * omega * k.arm_dot_direction;
        by_twist[2] -= 2.0 * omega * k.arm_dot_normal();
        (value, by_pose, by_twist)
    }
}
