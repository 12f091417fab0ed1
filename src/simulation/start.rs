//! Start states.

use nalgebra::{Matrix3, Vector3};

use crate::dynamics::{Inputs, MAX_EFFECT_STATES};
use crate::kinematics;
use crate::parameters::{Initialization, ParameterError, Parameters};
use crate::per_cable::PerCable;
use crate::plant::Plant;

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
            inputs: Inputs::pulling(cables, 1000.0),
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
        let sensor = |i: usize| plant.cable[i].unstretched_sensor;
        Self {
            pose: std::array::from_fn(|k| self.pose[k] - plant.pose_bias[k]),
            unstretched_length: PerCable::from_fn(plant.cables(), |i| {
                (self.unstretched_length[i] - sensor(i).1) / sensor(i).0
            }),
            unstretched_length_rate: PerCable::from_fn(plant.cables(), |i| {
                self.unstretched_length_rate[i] / sensor(i).0
            }),
            ..*self
        }
    }

    /// The start states of `plant`.
    ///
    /// # Errors
    /// Pose outside the anchors, a cable through the platform, a length that is not positive, no equilibrium.
    pub fn states(&self, plant: &Plant) -> Result<Vec<f64>, StartError> {
        let geometry = plant.geometry();
        geometry.check_pose(&self.pose)?;
        let mut y = vec![0.0; plant.dimension()];
        y[..3].copy_from_slice(&self.pose);
        y[3..6].copy_from_slice(&self.twist);
        if self.initialization == Initialization::StaticEquilibrium {
            let pose = static_equilibrium(plant, self.time, self.pose, &self.inputs)?;
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
            plant.start_effect_states(i, self.inputs.winch_force[i], tension, &mut states);
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

/// The pose at rest near `guess` where the cables carry their winch forces, by Newton's method with step limits.
///
/// # Errors
/// When the search leaves the anchors, meets a singular stiffness or does not settle.
pub fn static_equilibrium(plant: &Plant, time: f64, guess: [f64; 3], inputs: &Inputs) -> Result<[f64; 3], StartError> {
    let scale = plant.geometry().attachment_scale();
    // Pull and disturbance set the size of a balanced force.
    let size = inputs.winch_force.iter().chain(&inputs.disturbance).fold(1.0_f64, |a, b| a.max(b.abs()));
    let unbalanced = |pose: [f64; 3]| wrench_at_rest(plant, time, pose, inputs);
    let mut pose = guess;
    let fail = |reason, pose: [f64; 3]| StartError::NoEquilibrium { reason, pose, unbalanced: unbalanced(pose) };
    for _ in 0..100 {
        let force = unbalanced(pose);
        let step_size = [1e-4, 1e-4, 1e-4 / scale];
        let mut stiffness = Matrix3::zeros();
        for c in 0..3 {
            let (mut ahead, mut behind) = (pose, pose);
            ahead[c] += step_size[c];
            behind[c] -= step_size[c];
            let (a, b) = (unbalanced(ahead), unbalanced(behind));
            for r in 0..3 {
                stiffness[(r, c)] = (a[r] - b[r]) / (2.0 * step_size[c]);
            }
        }
        let Some(step) = stiffness.lu().solve(&-Vector3::from(force)) else {
            return Err(fail("the stiffness matrix is singular", pose));
        };
        let length = step[0].abs().max(step[1].abs()).max(step[2].abs() * scale);
        if !length.is_finite() {
            return Err(fail("the stiffness matrix is singular", pose));
        }
        // At most a fifth of the workspace and 2 rad in one step.
        let limit = (0.2 * plant.geometry().size() / length).min(2.0 / step[2].abs()).min(1.0);
        for k in 0..3 {
            pose[k] += limit * step[k];
        }
        if plant.geometry().check_pose(&pose).is_err() {
            return Err(fail("the search leaves the space between the anchors", pose));
        }
        let left = unbalanced(pose);
        let small = left[0].abs().max(left[1].abs()).max(left[2].abs() / scale) <= 1e-9 * size;
        if small && limit == 1.0 && length < 1e-6 * scale {
            return Ok(pose);
        }
    }
    Err(fail("the search does not settle", pose))
}

/// Force and torque (N, N m) left on the platform at rest at `pose` with every cable carrying its winch's pull.
pub fn wrench_at_rest(plant: &Plant, time: f64, pose: [f64; 3], inputs: &Inputs) -> [f64; 3] {
    let weight = plant.weight([pose[2].cos(), pose[2].sin()]);
    let mut wrench: [f64; 3] = std::array::from_fn(|k| inputs.disturbance[k] + weight[k]);
    let pulls = plant.at_rest(time, &pose, inputs, |context| {
        for kind in &plant.wrench {
            for (sum, added) in wrench.iter_mut().zip(kind.wrench(context)) {
                *sum += added;
            }
        }
        plant.pulls_at_rest(context)
    });
    for (cable, pull) in kinematics::cables(plant.geometry(), &pose, &[0.0; 3]).iter().zip(pulls) {
        for (sum, row) in wrench.iter_mut().zip(cable.jacobian_row()) {
            *sum -= pull.max(0.0) * row;
        }
    }
    wrench
}
