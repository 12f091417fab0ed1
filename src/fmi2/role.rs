//! What each variable of the table stands for, and where its value is found.

use crate::per_cable::PerCable;
use crate::plant::Plant;
use crate::scalar::Real;
use crate::signal::Signal;
use crate::simulation::Shown;

/// What a variable stands for. Cables count from 0; `[x, y, φ]` are the axes 0 to 2.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Role {
    /// Time itself; the FMI layer answers for it.
    Time,
    /// Command of a winch: its force, torque, speed or length.
    WinchForce(usize),
    /// Force or torque from outside, by axis.
    Disturbance(usize),
    /// A state, as the sensors show it.
    State(State),
    /// The time derivative of a state as shown.
    Rate(State),
    /// A signal that is no state.
    Output(Signal),
    /// Whether a cable is slack.
    Slack(usize),
    /// A real parameter: place in [`crate::parameter::REALS`] and index.
    Parameter(usize, usize),
    /// A parameter of an effect: the effect and the parameter within it.
    EffectParameter(usize, usize),
    /// An enumeration.
    Choice(Choice),
}

/// A state of the plant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum State {
    /// `x`, `y`, `phi`.
    Pose(usize),
    /// `vx`, `vy`, `omega`.
    Twist(usize),
    /// Unstretched length of a cable; follows from the pose where cables are rigid.
    UnstretchedLength(usize),
    /// Its rate; a state of its own with lumped masses only.
    UnstretchedRate(usize),
    /// A state of an effect: cable, and index among the effect states of that cable.
    Effect(usize, usize),
}

impl State {
    /// The signal that shows it; effects' own states have none.
    pub(super) fn signal(self) -> Option<Signal> {
        Some(match self {
            Self::Pose(k) => Signal::Pose(k),
            Self::Twist(k) => Signal::Twist(k),
            Self::UnstretchedLength(i) => Signal::UnstretchedLength(i),
            Self::UnstretchedRate(i) => Signal::UnstretchedRate(i),
            Self::Effect(..) => return None,
        })
    }
}

impl From<Signal> for Role {
    fn from(signal: Signal) -> Self {
        match signal {
            Signal::Pose(k) => Self::State(State::Pose(k)),
            Signal::Twist(k) => Self::State(State::Twist(k)),
            Signal::UnstretchedLength(i) => Self::State(State::UnstretchedLength(i)),
            Signal::UnstretchedRate(i) => Self::State(State::UnstretchedRate(i)),
            Signal::CableLength(_)
            | Signal::Tension(_)
            | Signal::Strain(_)
            | Signal::CableAngle(_)
            | Signal::Acceleration(_)
            | Signal::WinchAngle(_)
            | Signal::WinchRate(_) => Self::Output(signal),
        }
    }
}

/// A parameter with named values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Choice {
    /// `cable_model`.
    CableModel,
    /// `cable_inertia`.
    CableInertia,
    /// `initialization`.
    Initialization,
    /// `solver`.
    Solver,
}

/// The plant at one instant, as values or as duals with derivatives.
pub(super) struct Instant<'a, S> {
    pub(super) shown: Shown<'a, S>,
    pub(super) states: &'a [S],
    /// Of the true unstretched lengths; `None` where nobody asks for them.
    pub(super) acceleration: Option<&'a PerCable<S>>,
    pub(super) plant: &'a Plant,
}

impl Role {
    /// Whether its value follows from the accelerations of the unstretched lengths.
    pub(super) fn is_unstretched_acceleration(self) -> bool {
        matches!(self, Self::Rate(State::UnstretchedRate(_)))
    }
}

impl<S: Real> Instant<'_, S> {
    /// The real quantity behind `role`; `None` where it does not follow from the plant's state.
    #[inline(always)]
    pub(super) fn real(&self, role: Role) -> Option<S> {
        let shown = &self.shown;
        Some(match role {
            Role::Output(signal) => signal.of(shown),
            Role::State(State::Pose(k)) => shown.pose(k),
            Role::State(State::Twist(k)) => shown.twist(k),
            Role::State(State::UnstretchedLength(i)) => shown.unstretched_length(i),
            Role::State(State::UnstretchedRate(i)) | Role::Rate(State::UnstretchedLength(i)) => {
                shown.unstretched_length_rate(i)
            }
            Role::State(State::Effect(i, k)) => self.states[self.plant.effect_states(i).start + k],
            Role::Rate(State::Pose(k)) => {
                let (pose, twist) = ([0, 1, 2].map(|k| self.states[k]), [3, 4, 5].map(|k| self.states[k]));
                self.plant.pose_sensor.shown_rate(&pose, &twist)[k]
            }
            Role::Rate(State::Twist(k)) => shown.acceleration(k),
            Role::Rate(State::UnstretchedRate(i)) => {
                let now = (shown.unstretched_length(i), shown.unstretched_length_rate(i));
                self.plant.cable[i].unstretched_sensor.shown_acceleration(now.0, now.1, self.acceleration?[i])
            }
            Role::Rate(State::Effect(i, k)) => shown.effect_rate(i, k),
            Role::Time
            | Role::WinchForce(_)
            | Role::Disturbance(_)
            | Role::Slack(_)
            | Role::Parameter(..)
            | Role::EffectParameter(..)
            | Role::Choice(_) => return None,
        })
    }
}
