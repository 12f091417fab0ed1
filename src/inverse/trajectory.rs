//! Prescribed motions: pose and disturbance over time with the derivatives that inverse dynamics needs.

use super::Jet;
use super::spline::{Cubic, Septic};

/// A motion at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// `x`, `y` (m), `φ` (rad), each with its time derivatives of order 1 to 5.
    pub pose: [[f64; 6]; 3],
    /// `f_Dx`, `f_Dy` (N), `τ_D` (N m), each with its time derivatives of order 1 to 3.
    pub disturbance: [[f64; 4]; 3],
}

impl Motion {
    /// Derivatives of the pose of order `order` (0: the pose itself).
    pub fn derivative(&self, order: usize) -> [f64; 3] {
        self.pose.map(|p| p[order])
    }

    /// Pose, twist (`order` 1) or acceleration (2) as jets in time.
    pub(crate) fn jets(&self, order: usize) -> [Jet; 3] {
        self.pose.map(|p| Jet::new(p[order], p[order + 1], p[order + 2], p[order + 3]))
    }

    /// Disturbances as jets in time.
    pub(crate) fn disturbance_jets(&self) -> [Jet; 3] {
        self.disturbance.map(|d| Jet::new(d[0], d[1], d[2], d[3]))
    }
}

/// A prescribed motion over a span of time.
///
/// What is needed of it: with rigid cables and massless springs the acceleration, with `lumped_mass` also the jerk,
/// with a winch lag or without cable damping the derivatives above. Derivatives may jump where they must; a force that
/// depends on them then jumps too.
pub trait Trajectory {
    /// First and last time (s).
    fn span(&self) -> [f64; 2];

    /// The motion at `time` (s) within the span.
    fn motion(&self, time: f64) -> Motion;
}

/// How a trajectory given by samples ends where no rates are given.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Ends {
    /// Derivatives of order 4 to 6 are zero at both ends: a motion cut out of a longer one.
    #[default]
    Natural,
    /// At rest at both ends: speed, acceleration and jerk are zero.
    Rest,
}

/// Samples of a motion that make no trajectory.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TrajectoryError {
    /// Fewer than two samples.
    #[error("the trajectory has {0} samples, expected 2 or more")]
    TooShort(usize),
    /// Times do not increase.
    #[error("time {found} s of sample {sample} is not above the {previous} s before it")]
    Time {
        /// Sample, from 1.
        sample: usize,
        /// Its time (s).
        found: f64,
        /// The time before (s).
        previous: f64,
    },
    /// A number that is not finite.
    #[error("sample {sample} has {found} in `{column}`, expected a finite number")]
    NotFinite {
        /// Sample, from 1.
        sample: usize,
        /// Column.
        column: &'static str,
        /// The value.
        found: f64,
    },
    /// Columns of unlike length, or accelerations without speeds.
    #[error("{0}")]
    Shape(String),
}

/// Samples of a motion.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Samples {
    /// Times (s), strictly increasing.
    pub time: Vec<f64>,
    /// Poses (m, rad).
    pub pose: Vec<[f64; 3]>,
    /// Twists (m/s, rad/s), empty where not given.
    pub twist: Vec<[f64; 3]>,
    /// Accelerations (m/s², rad/s²), empty where not given; need the twists.
    pub acceleration: Vec<[f64; 3]>,
    /// Disturbances (N, N m), empty where there are none.
    pub disturbance: Vec<[f64; 3]>,
}

/// A trajectory through samples: a spline of degree 7 in the pose, a monotone cubic in the disturbance.
///
/// The pose is met at every sample, and so are twist and acceleration where they are given. It is smooth to order 6 with
/// poses alone, 5 with twists, 4 with accelerations too. The disturbance is smooth to order 1 and has no overshoot at
/// steps (Fritsch and Carlson, SIAM J. Numer. Anal. 17, 1980). High derivatives magnify rounding of the samples: space
/// them no closer than their digits carry (with 12 digits and 0.1 s the jerk is good to about 1e-9 m/s³).
#[derive(Clone, Debug)]
pub struct SplineTrajectory {
    pose: [Septic; 3],
    disturbance: Option<[Cubic; 3]>,
    span: [f64; 2],
}

impl SplineTrajectory {
    /// Fits the samples.
    ///
    /// # Errors
    /// Too few samples, times that do not increase, numbers that are not finite, columns of unlike length.
    pub fn new(samples: &Samples, ends: Ends) -> Result<Self, TrajectoryError> {
        let time = &samples.time;
        let n = time.len();
        if n < 2 {
            return Err(TrajectoryError::TooShort(n));
        }
        for (sample, pair) in time.windows(2).enumerate() {
            if pair[1] <= pair[0] || pair[0].is_nan() || pair[1].is_nan() {
                return Err(TrajectoryError::Time { sample: sample + 2, found: pair[1], previous: pair[0] });
            }
        }
        let columns: [(&[[f64; 3]], [&'static str; 3]); 4] = [
            (&samples.pose, ["x", "y", "phi"]),
            (&samples.twist, ["vx", "vy", "omega"]),
            (&samples.acceleration, ["ax", "ay", "alpha"]),
            (&samples.disturbance, ["disturbance_force_x", "disturbance_force_y", "disturbance_torque"]),
        ];
        for (k, (rows, names)) in columns.into_iter().enumerate() {
            if rows.len() != n && (k == 0 || !rows.is_empty()) {
                let (found, name) = (rows.len(), names[0]);
                return Err(TrajectoryError::Shape(format!("{found} values of `{name}` for {n} times")));
            }
            for (sample, row) in rows.iter().enumerate() {
                if let Some(axis) = (0..3).find(|a| !row[*a].is_finite()) {
                    let (column, found) = (names[axis], row[axis]);
                    return Err(TrajectoryError::NotFinite { sample: sample + 1, column, found });
                }
            }
        }
        if let Some(sample) = time.iter().position(|t| !t.is_finite()) {
            return Err(TrajectoryError::NotFinite { sample: sample + 1, column: "time", found: time[sample] });
        }
        if !samples.acceleration.is_empty() && samples.twist.is_empty() {
            return Err(TrajectoryError::Shape("accelerations are given without speeds; expected both".to_owned()));
        }
        let axis = |rows: &[[f64; 3]], k: usize| rows.iter().map(|r| r[k]).collect::<Vec<f64>>();
        let pose = std::array::from_fn(|k| {
            let mut given = vec![axis(&samples.pose, k)];
            for rows in [&samples.twist, &samples.acceleration] {
                if !rows.is_empty() {
                    given.push(axis(rows, k));
                }
            }
            Septic::new(time, &given, ends)
        });
        let disturbance = (!samples.disturbance.is_empty())
            .then(|| std::array::from_fn(|k| Cubic::new(time, &axis(&samples.disturbance, k))));
        Ok(Self { pose, disturbance, span: [time[0], time[n - 1]] })
    }
}

impl Trajectory for SplineTrajectory {
    fn span(&self) -> [f64; 2] {
        self.span
    }

    fn motion(&self, time: f64) -> Motion {
        Motion {
            pose: std::array::from_fn(|k| self.pose[k].derivatives(time)),
            disturbance: match &self.disturbance {
                Some(d) => std::array::from_fn(|k| d[k].derivatives(time)),
                None => [[0.0; 4]; 3],
            },
        }
    }
}
