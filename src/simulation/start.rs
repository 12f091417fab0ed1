//! Start states.

use crate::dynamics::{Inputs, MAX_EFFECT_STATES};
use crate::kinematics;
use crate::parameters::{Initialization, ParameterError, Parameters};
use crate::per_cable::PerCable;
use crate::plant::Plant;
use crate::winch::WinchCommand;

/// How a simulation begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Start {
    /// Start time (s).
    pub time: f64,
    /// How the states get their values.
    pub initialization: Initialization,
    /// Pose `[x, y, φ]` (m, rad); for `static_equilibrium` where the search begins.
    pub pose: [f64; 3],
    /// Twist `[vx, vy, φ̇]` (m/s, rad/s).
    pub twist: [f64; 3],
    /// Unstretched lengths (m), used by `from_states`.
    pub unstretched_length: PerCable<f64>,
    /// Rates of the unstretched lengths (m/s), used by `from_states`.
    pub unstretched_length_rate: PerCable<f64>,
    /// Inputs at the start; a winch with a dead time or lag has held its force for long.
    pub inputs: Inputs,
}

/// Pull of each winch (N) where a start says nothing of it.
const START_PULL: f64 = 1000.0;

impl Default for Start {
    /// That of the default robot.
    fn default() -> Self {
        Self::pulling(Parameters::default().cables())
    }
}

impl Start {
    /// At rest in the middle, each of `cables` winches pulling 1 kN.
    pub fn pulling(cables: usize) -> Self {
        Self {
            time: 0.0,
            initialization: Initialization::FromWinchForces,
            pose: [0.0; 3],
            twist: [0.0; 3],
            unstretched_length: PerCable::filled(cables, 0.0),
            unstretched_length_rate: PerCable::filled(cables, 0.0),
            inputs: Inputs::pulling(cables, START_PULL),
        }
    }
}

/// Why there is no start state.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StartError {
    /// A pose or length out of its range.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// The cable's law has no unstretched length under the winch's pull.
    #[error(
        "cable {cable} would need an unstretched length of {found} m to carry {pull} N at rest; the effects on it do \
         not hold at this tension"
    )]
    NoLength {
        /// Cable 1 to 4.
        cable: usize,
        /// Pull of the winch (N).
        pull: f64,
        /// Length found (m).
        found: f64,
    },
    /// No pose at rest near the given one.
    #[error(
        "no static equilibrium found from the pose given: {reason} (last pose [{:.6}, {:.6}, {:.6}], unbalanced \
         [{:.3e}, {:.3e}] N, {:.3e} N m)",
        pose[0], pose[1], pose[2], unbalanced[0], unbalanced[1], unbalanced[2]
    )]
    NoEquilibrium {
        /// What stopped the search.
        reason: &'static str,
        /// Last pose (m, rad).
        pose: [f64; 3],
        /// Force and torque left there (N, N m).
        unbalanced: [f64; 3],
    },
}

impl Start {
    /// These values taken as what the sensors of `plant` show at the start: the true ones behind them.
    ///
    /// A biased or scaled sensor shows another value than the true one; a delayed pose sensor shows the start pose.
    #[must_use]
    pub fn behind_sensors(&self, plant: &Plant) -> Self {
        let plant = plant.at(self.time);
        let sensor = |i: usize| &plant.cable[i].unstretched_sensor;
        Self {
            pose: plant.pose_sensor.behind(&self.pose),
            unstretched_length: PerCable::from_fn(plant.cables(), |i| sensor(i).behind(self.unstretched_length[i])),
            unstretched_length_rate: PerCable::from_fn(plant.cables(), |i| {
                sensor(i).rate_behind(self.unstretched_length[i], self.unstretched_length_rate[i])
            }),
            ..*self
        }
    }

    /// This start with commands and lengths in place of those that are left out (`None`), as the sensors show them: forces of
    /// 1 kN and torques that make them, a speed of zero, and for winches that follow a speed or a length what they have
    /// paid out when each cable carries 1 kN, or half of their limit where that is less.
    ///
    /// # Errors
    /// No such lengths, a pose that is impossible.
    pub(crate) fn with_defaults(
        mut self,
        plant: &Plant,
        [command, lengths]: [Option<PerCable<f64>>; 2],
    ) -> Result<Self, StartError> {
        let plant = plant.at(self.time);
        let winches = &plant.parameters().winch;
        let kind = winches.command;
        // A servo keeps what it can pull with: half its limit leaves as much to either side.
        let pull = if kind.is_servo() { START_PULL.min(0.5 * winches.force_limit) } else { START_PULL };
        let at_rest = if kind.is_servo() && (lengths.is_none() || command.is_none()) {
            let pose = self.behind_sensors(plant).pose;
            plant.geometry().check_pose(&pose)?;
            let mut shown = PerCable::filled(plant.cables(), 0.0);
            for (i, cable) in kinematics::cables(plant.geometry(), &pose, &[0.0; 3]).iter().enumerate() {
                let mut states = [0.0; MAX_EFFECT_STATES];
                plant.start_effect_states(i, pull, pull, &mut states);
                let length = plant.unstretched_length_for(i, self.time, cable.length, pull, &states);
                if !(length.is_finite() && length > 0.0) {
                    return Err(StartError::NoLength { cable: i + 1, pull, found: length });
                }
                shown[i] = plant.cable[i].unstretched_sensor.shown(length);
            }
            Some(shown)
        } else {
            None
        };
        let winch = |i: usize| &plant.data().cables[i].winch;
        let none = PerCable::filled(plant.cables(), 0.0);
        self.unstretched_length = lengths.or(at_rest).unwrap_or(none);
        self.inputs.winch_force = command.unwrap_or_else(|| match kind {
            WinchCommand::Force | WinchCommand::Torque => {
                PerCable::from_fn(plant.cables(), |i| pull / winch(i).force_per_command())
            }
            WinchCommand::Speed => none,
            WinchCommand::Length => at_rest.unwrap_or(none),
        });
        Ok(self)
    }

    /// Refuses a start from forces that the winches are not told.
    ///
    /// # Errors
    /// Winches that follow a speed or a length, and another `initialization` than `from_states`.
    pub fn check_initialization(&self, plant: &Plant) -> Result<(), ParameterError> {
        let command = plant.parameters().winch.command;
        if command.is_servo() && self.initialization != Initialization::FromStates {
            return Err(no_given_force(command));
        }
        Ok(())
    }

    /// The start states of `plant`.
    ///
    /// # Errors
    /// Pose outside the anchors, a cable through the platform, a length that is not positive, no equilibrium.
    pub fn states(&self, plant: &Plant) -> Result<Vec<f64>, StartError> {
        let plant = plant.at(self.time);
        let geometry = plant.geometry();
        geometry.check_pose(&self.pose)?;
        self.check_initialization(plant)?;
        let driven = plant.driven(&self.inputs);
        let mut y = vec![0.0; plant.dimension()];
        y[..3].copy_from_slice(&self.pose);
        y[3..6].copy_from_slice(&self.twist);
        if self.initialization == Initialization::StaticEquilibrium {
            let pose = super::static_equilibrium(plant, self.time, self.pose, &self.inputs)?;
            y[..3].copy_from_slice(&pose);
            y[3..6].fill(0.0);
        }
        let pose = [y[0], y[1], y[2]];
        let twist = [y[3], y[4], y[5]];
        let pulls = plant.at_rest(self.time, &pose, &self.inputs, |context| plant.pulls_at_rest(context));
        let cables = kinematics::cables(geometry, &pose, &twist);
        for i in 0..plant.cables() {
            let given = self.initialization == Initialization::FromStates && plant.unstretched_index(i).is_some();
            let tension = if given {
                let length = self.unstretched_length[i];
                if !(length.is_finite() && length > 0.0) {
                    let key = format!("unstretched_length[{}]", i + 1);
                    return Err(ParameterError::new(key, length, "greater than 0").into());
                }
                self.settled_tension(plant, i, cables[i].length)
            } else {
                pulls[i].max(0.0)
            };
            let mut states = [0.0; MAX_EFFECT_STATES];
            let force = if plant.has.servo { tension } else { driven.winch_force[i] };
            plant.start_effect_states(i, force, tension, &mut states);
            if let Some(at) = plant.unstretched_index(i) {
                y[at] = if given {
                    self.unstretched_length[i]
                } else {
                    let length = plant.unstretched_length_for(i, self.time, cables[i].length, pulls[i], &states);
                    if !(length.is_finite() && length > 0.0) {
                        return Err(StartError::NoLength { cable: i + 1, pull: pulls[i], found: length });
                    }
                    length
                };
            }
            if let Some(at) = plant.rate_index(i) {
                y[at] = if given { self.unstretched_length_rate[i] } else { cables[i].speed };
            }
            let range = plant.effect_states(i);
            let n = range.len();
            y[range].copy_from_slice(&states[..n]);
        }
        plant.straighten(&mut y);
        Ok(y)
    }

    /// The tension (N) of `cable` at its given unstretched length and this chord, with what that tension has done to the
    /// cable in a long time: creep takes off some of the strain that makes it creep.
    fn settled_tension(&self, plant: &Plant, cable: usize, chord: f64) -> f64 {
        let carried = |assumed: f64| {
            let mut states = [0.0; MAX_EFFECT_STATES];
            plant.start_effect_states(cable, self.inputs.winch_force[cable], assumed, &mut states);
            plant.tension_for(cable, self.time, chord, self.unstretched_length[cable], &states).max(0.0)
        };
        // The more is assumed, the less is carried: halving cannot miss the one tension that is both.
        let (mut low, mut high) = (0.0, carried(0.0));
        if carried(high) == high {
            return high;
        }
        loop {
            let middle = 0.5 * (low + high);
            if middle <= low || middle >= high {
                return middle;
            }
            if carried(middle) > middle { low = middle } else { high = middle }
        }
    }
}

/// Winches that follow a speed or a length make what force it takes.
pub(super) fn no_given_force(command: WinchCommand) -> ParameterError {
    ParameterError::new(
        "initialization",
        "not \"from_states\"",
        format!("\"from_states\": winches commanded by {} hold no given force", command.name()),
    )
}
