//! What the sensors show.

use crate::dynamics::{Evaluation, strain};
use crate::length_sensor::LengthSensor;
use crate::per_cable::PerCable;
use crate::plant::Plant;
use crate::scalar::Real;

/// What the sensors show at one instant. SI units, radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outputs<S = f64> {
    /// Measured pose `[x, y, φ]`.
    pub pose: [S; 3],
    /// Twist `[vx, vy, φ̇]`.
    pub twist: [S; 3],
    /// Measured geometric cable lengths, equation (4).
    pub cable_length: PerCable<S>,
    /// Measured unstretched lengths.
    pub unstretched_length: PerCable<S>,
    /// Rates of the unstretched lengths, by the same sensors.
    pub unstretched_length_rate: PerCable<S>,
    /// Measured tensions.
    pub tension: PerCable<S>,
    /// Strains `(L - l)/l`.
    pub strain: PerCable<S>,
    /// Directions of the cables, from the anchor: unit vectors.
    pub cable_direction: PerCable<[S; 2]>,
    /// Whether each cable is slack.
    pub slack: PerCable<bool>,
    /// Accelerations `[ax, ay, φ̈]` of the platform.
    pub acceleration: [S; 3],
    /// Angles of the drums, zero with nothing paid out, growing as they pay out.
    pub winch_angle: PerCable<S>,
    /// Angular rates of the drums.
    pub winch_rate: PerCable<S>,
}

impl<S: Real> Outputs<S> {
    /// Angle `α` (rad) of a cable (from 0), equation (5).
    pub fn cable_angle(&self, cable: usize) -> S {
        angle(self.cable_direction[cable])
    }

    /// Angles (rad) of all cables.
    pub fn cable_angles(&self) -> PerCable<S> {
        PerCable::from_fn(self.cable_direction.len(), |i| self.cable_angle(i))
    }
}

/// What the sensors make of a pose (their own delay behind it), a twist and an evaluation; each value is made when it is asked
/// for. The fields of [`Outputs`] say what they are.
#[derive(Clone, Copy)]
pub(crate) struct Shown<'a, S = f64> {
    pub(super) plant: &'a Plant,
    pub(super) pose: [S; 3],
    pub(super) twist: [S; 3],
    pub(super) e: &'a Evaluation<S>,
}

impl<S: Real> Shown<'_, S> {
    #[inline]
    fn drum(&self, i: usize) -> &LengthSensor {
        &self.plant.cable[i].unstretched_sensor
    }

    #[inline]
    pub(crate) fn pose(&self, axis: usize) -> S {
        self.plant.pose_sensor.shown(&self.pose)[axis]
    }

    #[inline]
    pub(crate) fn twist(&self, axis: usize) -> S {
        self.twist[axis]
    }

    #[inline]
    pub(crate) fn acceleration(&self, axis: usize) -> S {
        self.e.acceleration[axis]
    }

    /// Rate of one of the states that effects have on a cable.
    #[inline]
    pub(crate) fn effect_rate(&self, cable: usize, state: usize) -> S {
        self.e.effect_rate[cable][state]
    }

    #[inline]
    pub(crate) fn cable_length(&self, i: usize) -> S {
        self.plant.cable[i].shown_length(self.e.kinematics[i].length)
    }

    #[inline]
    pub(crate) fn unstretched_length(&self, i: usize) -> S {
        self.drum(i).shown(self.e.unstretched[i])
    }

    #[inline]
    pub(crate) fn unstretched_length_rate(&self, i: usize) -> S {
        self.drum(i).shown_rate(self.e.unstretched[i], self.e.unstretched_rate[i])
    }

    #[inline]
    pub(crate) fn tension(&self, i: usize) -> S {
        self.plant.cable[i].shown_tension(self.e.tension[i])
    }

    #[inline]
    pub(crate) fn strain(&self, i: usize) -> S {
        strain(self.e.kinematics[i].length, self.e.unstretched[i])
    }

    pub(crate) fn cable_angle(&self, i: usize) -> S {
        angle(self.e.kinematics[i].direction)
    }

    #[inline]
    pub(crate) fn slack(&self, i: usize) -> bool {
        self.e.slack[i]
    }

    #[inline]
    pub(crate) fn winch_angle(&self, i: usize) -> S {
        self.drum(i).counted(self.e.unstretched[i]) / self.plant.data.cables[i].winch.drum_radius
    }

    #[inline]
    pub(crate) fn winch_rate(&self, i: usize) -> S {
        let rate = self.drum(i).counted_rate(self.e.unstretched[i], self.e.unstretched_rate[i]);
        rate / self.plant.data.cables[i].winch.drum_radius
    }

    /// All of it.
    pub(crate) fn all(&self) -> Outputs<S> {
        let cables = self.plant.cables();
        let each = |value: &dyn Fn(usize) -> S| PerCable::from_fn(cables, value);
        Outputs {
            pose: self.plant.pose_sensor.shown(&self.pose),
            twist: self.twist,
            cable_length: each(&|i| self.cable_length(i)),
            unstretched_length: each(&|i| self.unstretched_length(i)),
            unstretched_length_rate: each(&|i| self.unstretched_length_rate(i)),
            tension: each(&|i| self.tension(i)),
            strain: each(&|i| self.strain(i)),
            cable_direction: PerCable::from_fn(cables, |i| self.e.kinematics[i].direction),
            slack: self.e.slack,
            acceleration: self.e.acceleration,
            winch_angle: each(&|i| self.winch_angle(i)),
            winch_rate: each(&|i| self.winch_rate(i)),
        }
    }
}

/// Angle (rad) of a direction against the x axis, equation (5).
fn angle<S: Real>([x, y]: [S; 2]) -> S {
    y.atan2(x)
}
