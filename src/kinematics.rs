//! Kinematics of the 4RPR manipulator, equations (1)-(16).

use nalgebra::{DVector, MatrixXx3};

use crate::dynamics::matrix3::dot;
use crate::geometry::Geometry;
use crate::per_cable::{MAX_CABLES, PerCable};
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
    /// `L` (m), equation (4); round a pulley the straight part and what lies on the pulley more than at the pose zero.
    pub length: S,
    /// The straight part of it (m): the lever on which the cable turns.
    pub span: S,
    /// Radius of the pulley (m), as [`Geometry::pulley_radius`].
    pub pulley_radius: f64,
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
    /// The cable from `anchor` (m, fixed frame) to `attachment` (m, body frame) at `pose` `[x, y, φ]` with
    /// `rotation = [cos φ, sin φ]` and `twist` `[vx, vy, φ̇]`.
    #[inline(always)]
    pub(crate) fn new(
        anchor: [f64; 2],
        attachment: [f64; 2],
        pose: &[S; 3],
        [cos, sin]: [S; 2],
        twist: &[S; 3],
    ) -> Self {
        let ([anchor_x, anchor_y], [body_x, body_y]) = (anchor, attachment);
        let (arm_x, arm_y) = (cos * body_x - sin * body_y, sin * body_x + cos * body_y);
        let (x, y) = (pose[0] + arm_x - anchor_x, pose[1] + arm_y - anchor_y);
        let length = (x * x + y * y).sqrt();
        let inverse = length.recip();
        let (direction_x, direction_y) = (x * inverse, y * inverse);
        let cross = arm_x * direction_y - arm_y * direction_x;
        let dot = arm_x * direction_x + arm_y * direction_y;
        Self {
            arm: [arm_x, arm_y],
            direction: [direction_x, direction_y],
            length,
            span: length,
            pulley_radius: 0.0,
            speed: direction_x * twist[0] + direction_y * twist[1] + cross * twist[2],
            angular_rate: (direction_x * twist[1] - direction_y * twist[0] + dot * twist[2]) * inverse,
            arm_cross_direction: cross,
            arm_dot_direction: dot,
        }
    }

    /// The same cable where it leaves a pulley on a tangent.
    ///
    /// With `d` from the axis to the attachment point and the radius `r`, `d = f S + r N`: so `f = √(d² - r²)` is the straight
    /// part and `S = (f d - r K×d)/d²`. As `S` turns by `dα`, `-r dα` of the cable comes onto the pulley, and then
    /// `dL = df - r dα = S·dd`: the cable pulls along the gradient of its length. A. Pott, Cable-Driven Parallel Robots, 2018,
    /// chapter 7, with a pulley that stands in the plane.
    #[inline]
    fn round(
        pulley: &Pulley,
        anchor: [f64; 2],
        attachment: [f64; 2],
        pose: &[S; 3],
        rotation: [S; 2],
        twist: &[S; 3],
    ) -> Self {
        let straight = Self::new(anchor, attachment, pose, rotation, twist);
        let (radius, [home_x, home_y]) = (pulley.radius, pulley.home);
        let square = straight.length * straight.length;
        let span = (square - radius * radius).sqrt();
        let [along_x, along_y] = straight.direction.map(|s| s * straight.length);
        let x = (along_x * span + along_y * radius) / square;
        let y = (along_y * span - along_x * radius) / square;
        let turned = (y * home_x - x * home_y).atan2(x * home_x + y * home_y);
        let [arm_x, arm_y] = straight.arm;
        let cross = arm_x * y - arm_y * x;
        let dot = arm_x * x + arm_y * y;
        Self {
            arm: straight.arm,
            direction: [x, y],
            length: span - turned * radius,
            span,
            pulley_radius: radius,
            speed: x * twist[0] + y * twist[1] + cross * twist[2],
            angular_rate: (x * twist[1] - y * twist[0] + dot * twist[2]) / span,
            arm_cross_direction: cross,
            arm_dot_direction: dot,
        }
    }

    /// Rate of the straight part (m/s): `L̇`, and round a pulley what it gives off.
    #[inline]
    pub fn span_rate(&self) -> S {
        self.speed + self.angular_rate * self.pulley_radius
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

    /// `E · N` (m), the arm of the `φ̇²` term of (14).
    #[inline]
    pub fn arm_dot_normal(&self) -> S {
        self.arm[1] * self.direction[0] - self.arm[0] * self.direction[1]
    }

    /// `L̈ - J_M row · [ax, ay, φ̈]`: the velocity-dependent part of equation (12) (m/s²).
    #[inline]
    pub fn length_acceleration_bias(&self, omega: S) -> S {
        self.span * self.angular_rate * self.angular_rate - omega * omega * self.arm_dot_direction
    }

    /// `f α̈ - normal row · [ax, ay, φ̈]`: the velocity-dependent part of equation (14), times the straight part `f` (m/s²).
    #[inline]
    pub fn normal_acceleration_bias(&self, omega: S) -> S {
        -(omega * omega * self.arm_dot_normal()) - (self.speed + self.span_rate()) * self.angular_rate
    }

    /// `L̈` (m/s²), equation (12), at the platform's acceleration and angular rate.
    #[inline]
    pub(crate) fn length_acceleration(&self, acceleration: &[S; 3], omega: S) -> S {
        dot(&self.jacobian_row(), acceleration) + self.length_acceleration_bias(omega)
    }

    /// `f α̈ + 3 ḟ α̇` (m/s²) of the straight part `f`, the acceleration that a straight cable's mass across answers to, by (14).
    #[inline]
    pub(crate) fn acceleration_across(&self, acceleration: &[S; 3], omega: S) -> S {
        let turning = dot(&self.normal_row(), acceleration) + self.normal_acceleration_bias(omega);
        turning + self.span_rate() * self.angular_rate * 3.0
    }

    /// `α` (rad), equation (5).
    #[inline]
    pub fn angle(&self) -> S {
        self.direction[1].atan2(self.direction[0])
    }
}

/// A pulley of a radius (m), and the direction in which the cable leaves it at the pose zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pulley {
    radius: f64,
    home: [f64; 2],
}

impl Pulley {
    /// That of `cable` (from 0), if there is one.
    #[inline]
    fn of(geometry: &Geometry, cable: usize) -> Option<Self> {
        let radius = geometry.pulley_radius[cable];
        (radius != 0.0).then(|| {
            let still = Self { radius, home: [1.0, 0.0] };
            let (anchor, end) = (geometry.anchor[cable], geometry.attachment[cable]);
            let home = CableKinematics::round(&still, anchor, end, &[0.0; 3], [1.0, 0.0], &[0.0; 3]);
            Self { radius, home: home.direction }
        })
    }
}

/// Where the cables begin and end, one array per coordinate; places beyond the last cable repeat the first.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CableEnds {
    anchor: [[f64; MAX_CABLES]; 2],
    attachment: [[f64; MAX_CABLES]; 2],
    /// The cables that leave a pulley.
    pulleys: Vec<(usize, Pulley)>,
}

impl CableEnds {
    pub(crate) fn new(geometry: &Geometry) -> Self {
        let arrays =
            |points: &[[f64; 2]]| [0, 1].map(|axis| std::array::from_fn(|i| points.get(i).unwrap_or(&points[0])[axis]));
        let pulley = |i| Pulley::of(geometry, i).map(|pulley| (i, pulley));
        Self {
            anchor: arrays(&geometry.anchor),
            attachment: arrays(&geometry.attachment),
            pulleys: (0..geometry.cables()).filter_map(pulley).collect(),
        }
    }

    #[inline(always)]
    fn anchor(&self, i: usize) -> [f64; 2] {
        [self.anchor[0][i], self.anchor[1][i]]
    }

    #[inline(always)]
    fn attachment(&self, i: usize) -> [f64; 2] {
        [self.attachment[0][i], self.attachment[1][i]]
    }
}

/// The same for all cables, one array per quantity, so that the processor works on several cables at once. Places beyond
/// the last cable repeat some cable.
///
/// Fields as in [`CableKinematics`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct CableArrays<S, const LANES: usize> {
    pub(crate) arm_x: [S; LANES],
    pub(crate) arm_y: [S; LANES],
    pub(crate) direction_x: [S; LANES],
    pub(crate) direction_y: [S; LANES],
    pub(crate) length: [S; LANES],
    pub(crate) span: [S; LANES],
    pub(crate) pulley_radius: [f64; LANES],
    pub(crate) speed: [S; LANES],
    pub(crate) angular_rate: [S; LANES],
    pub(crate) arm_cross_direction: [S; LANES],
    pub(crate) arm_dot_direction: [S; LANES],
}

impl<S: Real, const LANES: usize> CableArrays<S, LANES> {
    /// Kinematics of the cables at `pose` `[x, y, φ]` with `rotation = [cos φ, sin φ]` and `twist` `[vx, vy, φ̇]`; `pulleys` says
    /// whether there are any.
    #[inline(always)]
    pub(crate) fn new(ends: &CableEnds, pulleys: bool, pose: &[S; 3], rotation: [S; 2], twist: &[S; 3]) -> Self {
        let zeros = [S::from(0.0); LANES];
        let mut k = Self {
            arm_x: zeros,
            arm_y: zeros,
            direction_x: zeros,
            direction_y: zeros,
            length: zeros,
            span: zeros,
            pulley_radius: [0.0; LANES],
            speed: zeros,
            angular_rate: zeros,
            arm_cross_direction: zeros,
            arm_dot_direction: zeros,
        };
        for i in 0..LANES {
            k.set(i, &CableKinematics::new(ends.anchor(i), ends.attachment(i), pose, rotation, twist));
        }
        if pulleys {
            for (i, pulley) in &ends.pulleys {
                let (anchor, attachment) = (ends.anchor(*i), ends.attachment(*i));
                k.set(*i, &CableKinematics::round(pulley, anchor, attachment, pose, rotation, twist));
            }
        }
        k
    }

    #[inline(always)]
    fn set(&mut self, i: usize, one: &CableKinematics<S>) {
        [self.arm_x[i], self.arm_y[i]] = one.arm;
        [self.direction_x[i], self.direction_y[i]] = one.direction;
        self.length[i] = one.length;
        self.span[i] = one.span;
        self.pulley_radius[i] = one.pulley_radius;
        self.speed[i] = one.speed;
        self.angular_rate[i] = one.angular_rate;
        self.arm_cross_direction[i] = one.arm_cross_direction;
        self.arm_dot_direction[i] = one.arm_dot_direction;
    }

    /// One cable's part.
    #[inline]
    pub(crate) fn cable(&self, i: usize) -> CableKinematics<S> {
        CableKinematics {
            arm: [self.arm_x[i], self.arm_y[i]],
            direction: [self.direction_x[i], self.direction_y[i]],
            length: self.length[i],
            span: self.span[i],
            pulley_radius: self.pulley_radius[i],
            speed: self.speed[i],
            angular_rate: self.angular_rate[i],
            arm_cross_direction: self.arm_cross_direction[i],
            arm_dot_direction: self.arm_dot_direction[i],
        }
    }
}

/// Kinematics of all cables at `pose` `[x, y, φ]` (m, rad) and `twist` `[vx, vy, φ̇]` (m/s, rad/s): equations (1)-(10), (30), (31).
pub fn cables<S: Real>(geometry: &Geometry, pose: &[S; 3], twist: &[S; 3]) -> PerCable<CableKinematics<S>> {
    let (sin, cos) = pose[2].sin_cos();
    PerCable::from_fn(geometry.cables(), |i| {
        let (anchor, attachment, rotation) = (geometry.anchor[i], geometry.attachment[i], [cos, sin]);
        match Pulley::of(geometry, i) {
            Some(pulley) => CableKinematics::round(&pulley, anchor, attachment, pose, rotation, twist),
            None => CableKinematics::new(anchor, attachment, pose, rotation, twist),
        }
    })
}

/// Inverse kinematics: the cable lengths (m) at `pose`, equation (4).
pub fn cable_lengths(geometry: &Geometry, pose: &[f64; 3]) -> PerCable<f64> {
    cables(geometry, pose, &[0.0; 3]).map(|cable| cable.length)
}

/// The manipulator Jacobian `J_M` (n×3), equation (8): `L̇ = J_M Ẋ`. The structure matrix is `-J_Mᵀ`.
pub fn jacobian(geometry: &Geometry, pose: &[f64; 3]) -> MatrixXx3<f64> {
    let cables = cables(geometry, pose, &[0.0; 3]);
    MatrixXx3::from_fn(cables.len(), |i, j| cables[i].jacobian_row()[j])
}

/// `J_α` (n×3), equation (9): `α̇ = J_α Ẋ`.
pub fn angular_jacobian(geometry: &Geometry, pose: &[f64; 3]) -> MatrixXx3<f64> {
    let cables = cables(geometry, pose, &[0.0; 3]);
    MatrixXx3::from_fn(cables.len(), |i, j| cables[i].normal_row()[j] / cables[i].span)
}

/// Accelerations of lengths `L̈` (m/s²) and angles `α̈` (rad/s²), equations (12) and (14).
pub fn accelerations(
    geometry: &Geometry,
    pose: &[f64; 3],
    twist: &[f64; 3],
    acceleration: &[f64; 3],
) -> (PerCable<f64>, PerCable<f64>) {
    let cables = cables(geometry, pose, twist);
    let length = cables.map(|c| c.length_acceleration(acceleration, twist[2]));
    let angle = cables.map(|c| (dot(&c.normal_row(), acceleration) + c.normal_acceleration_bias(twist[2])) / c.span);
    (length, angle)
}

/// Why forward kinematics has no answer.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ForwardKinematicsError {
    /// A length is no length.
    #[error("length of cable {cable} is {found} m, expected a finite number greater than 0")]
    BadLength {
        /// Cable, from 1.
        cable: usize,
        /// What was found (m).
        found: f64,
    },
    /// Gauss-Newton did not settle.
    #[error("forward kinematics did not converge in {iterations} iterations (last step {last_step:e} m)")]
    NotConverged {
        /// Iterations done.
        iterations: usize,
        /// Size of the last step (m; an angle counts by the platform's largest arm).
        last_step: f64,
    },
    /// The lengths contradict each other beyond the tolerance: no pose nearby has them.
    #[error("no pose has these cable lengths: the best one misses them by {residual:e} m (tolerance {tolerance:e} m)")]
    Inconsistent {
        /// Root mean square misfit of the lengths (m).
        residual: f64,
        /// The tolerance asked for (m).
        tolerance: f64,
    },
}

/// Forward kinematics: the pose whose cable lengths fit `lengths` (m) best, by Gauss-Newton from `guess`.
///
/// With more lengths than three unknowns the misfit tells whether the lengths belong together. Of several poses
/// with the same lengths (the mirror images of the platform) the iteration takes the one that `guess` leads to.
///
/// # Errors
/// When a length is not positive, the iteration does not settle, or the root mean square misfit of the result is above
/// `tolerance` (m).
pub fn forward_kinematics(
    geometry: &Geometry,
    lengths: &PerCable<f64>,
    guess: [f64; 3],
    tolerance: f64,
) -> Result<[f64; 3], ForwardKinematicsError> {
    const ITERATIONS: usize = 50;
    if let Some(i) = lengths.iter().position(|l| !(*l > 0.0 && l.is_finite())) {
        return Err(ForwardKinematicsError::BadLength { cable: i + 1, found: lengths[i] });
    }
    let misfit_at = |pose: &[f64; 3]| {
        let shown = cable_lengths(geometry, pose);
        DVector::from_fn(shown.len(), |i, _| lengths[i] - shown[i])
    };
    // The arm turns the angle into a length, so that one step limit serves all three.
    let arm = geometry.attachment_scale();
    let mut pose = guess;
    let (mut iterations, mut last_step) = (0, f64::NAN);
    while iterations < ITERATIONS {
        iterations += 1;
        let misfit = misfit_at(&pose);
        let j = jacobian(geometry, &pose);
        let Some(step) = j.tr_mul(&j).cholesky().map(|c| c.solve(&j.tr_mul(&misfit))) else { break };
        last_step = step[0].abs().max(step[1].abs()).max(step[2].abs() * arm);
        if !last_step.is_finite() {
            break;
        }
        let damping = if last_step > 0.0 { (0.5 * arm / last_step).clamp(0.05, 1.0) } else { 1.0 };
        for k in 0..3 {
            pose[k] += damping * step[k];
        }
        if last_step < 1e-11 * geometry.size() {
            let residual = misfit_at(&pose).norm() / (geometry.cables() as f64).sqrt();
            if residual > tolerance {
                return Err(ForwardKinematicsError::Inconsistent { residual, tolerance });
            }
            return Ok(pose);
        }
    }
    Err(ForwardKinematicsError::NotConverged { iterations, last_step })
}
