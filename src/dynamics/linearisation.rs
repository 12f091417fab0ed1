//! The derivative `∂f/∂y` of the plant's rates, in the structure that the plant has.
//!
//! A cable's own states reach the rest only through its tension, and the platform reaches them only through the cable's
//! length, its rate and the angular rate. The linearisation is approximate: the derivatives of the mass matrix and of
//! the centrifugal and Coriolis forces are left out, as are dependences of an expression on other cables and the slow
//! force of a cable's own swinging. Newton's method checks its own convergence.

use num_dual::DualSVec64;

use crate::effect::{PlatformContext, SwingContext, WinchContext};
use crate::parameters::CableModel;
use crate::per_cable::PerCable;
use crate::plant::{Plant, axial_states};
use crate::scalar::Real;

use super::instant::{swing_tension, winch_pull};
use super::matrix3::{self, Matrix3};
use super::{Evaluation, Inputs, MAX_EFFECT_STATES, elastic};

/// Largest number of states of one cable.
pub(super) const BLOCK: usize = 2 + MAX_EFFECT_STATES;

/// One cable's part: rows of derivatives with respect to length `L`, its rate, angular rate, and own states.
#[derive(Clone, Debug, Default)]
pub(super) struct CableBlock {
    pub(super) size: usize,
    pub(super) jacobian: [f64; 3],
    pub(super) normal_over_length: [f64; 3],
    /// `(∂²L/∂q²) v`.
    pub(super) curvature: [f64; 3],
    pub(super) tension_by_state: [f64; BLOCK],
    /// By the winch force.
    pub(super) tension_by_command: f64,
    pub(super) rates_by_command: [f64; BLOCK],
    /// What Newton's matrix leaves out: the transverse force, along `normal` in the platform's coordinates, and its
    /// derivatives by length and own states; the angular rate by the pose; tension and transverse force by the angular rate.
    pub(super) normal: [f64; 3],
    pub(super) transverse: f64,
    pub(super) transverse_by_length: f64,
    pub(super) transverse_by_state: [f64; BLOCK],
    pub(super) turning_by_pose: [f64; 3],
    pub(super) by_turning: [f64; 2],
    /// By length, its rate, angular rate.
    pub(super) rates_by_motion: [[f64; 3]; BLOCK],
    pub(super) rates_by_state: [[f64; BLOCK]; BLOCK],
}

/// First derivatives of the plant at one state.
#[derive(Clone, Debug, Default)]
pub(crate) struct Linearisation {
    pub(super) mass: Matrix3<f64>,
    pub(super) force_by_pose: Matrix3<f64>,
    pub(super) force_by_twist: Matrix3<f64>,
    pub(super) cables: Vec<CableBlock>,
}

/// A cable seen on its own: the platform through three scalars, the rest of the plant frozen.
struct Local<'a> {
    plant: &'a Plant,
    cable: usize,
    time: f64,
    u: &'a Inputs,
    slack: bool,
    pose: [f64; 3],
    twist: [f64; 3],
    evaluation: &'a Evaluation,
}

/// Quantities by which derivatives are taken at once: those of a cable with two states of its own, and of a wrench.
const AT_ONCE: usize = 6;

type Gradient = DualSVec64<AT_ONCE>;

/// A quantity, and the column of its derivative if that is among those taken from `first` on.
fn seeded(value: f64, column: usize, first: usize) -> Gradient {
    let quantity = Gradient::from(value);
    match column.checked_sub(first) {
        Some(at) if at < AT_ONCE => quantity.derivative(at),
        _ => quantity,
    }
}

/// The derivatives that a result carries.
fn derivatives(result: &Gradient) -> [f64; AT_ONCE] {
    result.eps.0.map_or([0.0; AT_ONCE], |eps| eps.data.0[0].map(finite))
}

/// A derivative for Newton's matrix, which may be approximate: none where there is none, as of a root at zero.
fn finite(derivative: f64) -> f64 {
    if derivative.is_finite() { derivative } else { 0.0 }
}

struct LocalRates<S> {
    tension: S,
    transverse: S,
    rates: [S; BLOCK],
}

impl Local<'_> {
    fn rates<S: Real>(&self, length: S, speed: S, turning: S, own: &[S; BLOCK], command: S) -> LocalRates<S> {
        let zero = S::from(0.0);
        let i = self.cable;
        let data = &self.plant.data.cables[i];
        let effects = &self.plant.cable[i];
        let axial = axial_states(data.model);
        let mut states = [zero; MAX_EFFECT_STATES];
        states[..effects.states].copy_from_slice(&own[axial..axial + effects.states]);
        let mut rates = [zero; BLOCK];
        let mut effect_rates = [zero; MAX_EFFECT_STATES];
        let (unstretched, unstretched_rate) = match data.model {
            CableModel::Rigid => (length, speed),
            CableModel::MasslessSpring => (own[0], speed),
            CableModel::LumpedMass => (own[0], own[1]),
        };
        let time = S::from(self.time);
        let mut added = zero;
        if !effects.pull.is_empty() {
            let e = self.evaluation;
            let replaced = |values: PerCable<f64>, own: S| {
                let mut values = values.map(S::from);
                values[i] = own;
                values
            };
            let context = PlatformContext {
                time,
                pose: &self.pose.map(S::from),
                twist: &self.twist.map(S::from),
                inputs: &self.u.lift(),
                cable_length: &replaced(e.kinematics.map(|k| k.length), length),
                cable_speed: &replaced(e.kinematics.map(|k| k.speed), speed),
                unstretched_length: &replaced(e.unstretched, unstretched),
                unstretched_rate: &replaced(e.unstretched_rate, unstretched_rate),
            };
            added = effects.pull.iter().fold(added, |sum, kind| sum + kind.pull(&context));
        }
        let winch = WinchContext { time, speed: unstretched_rate };
        let pull = winch_pull(self.plant, i, command, added, &winch, &states, &mut effect_rates);
        let elastic = |unstretched| elastic::tension(data, &effects.law, time, length, unstretched, &states);
        let mut tension = match data.model {
            CableModel::LumpedMass => {
                elastic(unstretched) + data.damper_force(length, speed, unstretched, unstretched_rate)
            }
            CableModel::Rigid | CableModel::MasslessSpring => {
                pull + data.axial_bias(length, speed, turning)
                    + data.axial_mass(length) * self.evaluation.unstretched_acceleration[i]
            }
        };
        if self.slack {
            tension = zero;
        }
        match data.model {
            CableModel::Rigid => {}
            CableModel::MasslessSpring => {
                let opening = (elastic(unstretched) - tension) * unstretched / data.damping;
                rates[0] = (speed + opening) / data.paid_out_share(length, unstretched);
            }
            CableModel::LumpedMass => {
                rates[0] = unstretched_rate;
                rates[1] = (tension - pull - data.axial_bias(unstretched, unstretched_rate, turning))
                    / data.axial_mass(unstretched);
            }
        }
        for (kind, at) in &effects.law {
            kind.strain_rates(tension, &states[*at..], &mut effect_rates[*at..]);
        }
        let mut transverse =
            effects.transverse.iter().fold(zero, |sum, kind| sum + kind.transverse_force(length, turning));
        let carried = swing_tension(data.model, tension, pull, self.slack);
        let swing = SwingContext { length, angular_rate: turning, tension: carried };
        for (kind, at) in &effects.swing {
            transverse += kind.swing(&swing, &states[*at..], &mut effect_rates[*at..]);
        }
        rates[axial..axial + effects.states].copy_from_slice(&effect_rates[..effects.states]);
        LocalRates { tension, transverse, rates }
    }
}

impl Linearisation {
    /// Room for `cables` cables.
    pub(crate) fn new(cables: usize) -> Self {
        Self { cables: vec![CableBlock::default(); cables], ..Self::default() }
    }

    /// Linearises the plant at this instant.
    pub(crate) fn update(&mut self, plant: &Plant, time: f64, y: &[f64], u: &Inputs, slack: &PerCable<bool>) {
        let e = plant.evaluate(time, y, u, slack);
        self.linearise(plant, time, y, u, &e);
    }

    /// Linearises the plant at the instant that `e` is the evaluation of.
    pub(super) fn linearise(&mut self, plant: &Plant, time: f64, y: &[f64], u: &Inputs, e: &Evaluation) {
        self.mass = e.mass;
        self.force_by_pose = [[0.0; 3]; 3];
        self.force_by_twist = [[0.0; 3]; 3];
        let pose = [y[0], y[1], y[2]];
        let twist = [y[3], y[4], y[5]];
        // The weight's torque turns with its arm.
        let [arm_x, arm_y] = plant.com_arm([pose[2].cos(), pose[2].sin()]);
        let [weight_x, weight_y] = plant.data.gravity.map(|g| g * plant.data.mass);
        self.force_by_pose[2][2] -= arm_x * weight_x + arm_y * weight_y;
        self.linearise_wrench(plant, time, &pose, &twist, u, e);
        self.cables.resize_with(plant.cables(), CableBlock::default);
        for i in 0..plant.cables() {
            let local = Local { plant, cable: i, time, u, slack: e.slack[i], pose, twist, evaluation: e };
            self.linearise_cable(&local, y);
        }
    }

    fn linearise_wrench(
        &mut self,
        plant: &Plant,
        time: f64,
        pose: &[f64; 3],
        twist: &[f64; 3],
        u: &Inputs,
        e: &Evaluation,
    ) {
        if plant.wrench.is_empty() {
            return;
        }
        let lift = |values: PerCable<f64>| values.map(Gradient::from);
        let context = PlatformContext {
            time: Gradient::from(time),
            pose: &std::array::from_fn(|k| seeded(pose[k], k, 0)),
            twist: &std::array::from_fn(|k| seeded(twist[k], 3 + k, 0)),
            inputs: &u.lift(),
            cable_length: &lift(e.kinematics.map(|k| k.length)),
            cable_speed: &lift(e.kinematics.map(|k| k.speed)),
            unstretched_length: &lift(e.unstretched),
            unstretched_rate: &lift(e.unstretched_rate),
        };
        for kind in &plant.wrench {
            for (r, component) in kind.wrench(&context).iter().enumerate() {
                for (c, derivative) in derivatives(component).into_iter().enumerate() {
                    let target = if c < 3 { &mut self.force_by_pose } else { &mut self.force_by_twist };
                    target[r][c % 3] += derivative;
                }
            }
        }
    }

    fn linearise_cable(&mut self, local: &Local<'_>, y: &[f64]) {
        let (plant, i, e) = (local.plant, local.cable, local.evaluation);
        let k = &e.kinematics[i];
        let block = &mut self.cables[i];
        block.size = plant.effect_states(i).end - plant.offset[i];
        block.jacobian = k.jacobian_row();
        let normal = k.normal_row();
        block.normal = normal;
        block.normal_over_length = normal.map(|n| n / k.length);
        // ∂²L/∂q² = n nᵀ/L - (E·S) e₃ e₃ᵀ, by (12).
        let mut hessian = [[0.0; 3]; 3];
        matrix3::add_outer(&mut hessian, &normal, &normal, 1.0 / k.length);
        hessian[2][2] -= k.arm_dot_direction;
        block.curvature = matrix3::product(&hessian, &local.twist);
        let mut own = [0.0; BLOCK];
        own[..block.size].copy_from_slice(&y[plant.offset[i]..plant.offset[i] + block.size]);
        // Columns: length, its rate, angular rate, winch force, own states.
        let columns = 4 + block.size;
        let (mut tension_by, mut transverse_by) = ([0.0; 4 + BLOCK], [0.0; 4 + BLOCK]);
        let mut rates_by = [[0.0; 4 + BLOCK]; BLOCK];
        for first in (0..columns).step_by(AT_ONCE) {
            let s = |value: f64, column: usize| seeded(value, column, first);
            let states: [Gradient; BLOCK] = std::array::from_fn(|k| s(own[k], 4 + k));
            let command = s(local.u.winch_force[i], 3);
            let by = local.rates(s(k.length, 0), s(k.speed, 1), s(k.angular_rate, 2), &states, command);
            let count = AT_ONCE.min(columns - first);
            let copy = |from: &Gradient, to: &mut [f64; 4 + BLOCK]| {
                to[first..first + count].copy_from_slice(&derivatives(from)[..count])
            };
            block.transverse = by.transverse.re;
            copy(&by.tension, &mut tension_by);
            copy(&by.transverse, &mut transverse_by);
            for (from, to) in by.rates.iter().zip(&mut rates_by).take(block.size) {
                copy(from, to);
            }
        }
        // α̇ = n·v/L: n turns with the cable and, in φ, with the platform.
        block.turning_by_pose =
            std::array::from_fn(|c| -(k.speed * normal[c] / k.length + k.angular_rate * block.jacobian[c]) / k.length);
        block.turning_by_pose[2] += local.twist[2] * block.jacobian[2] / k.length;
        block.transverse_by_length = transverse_by[0];
        block.by_turning = [tension_by[2], transverse_by[2]];
        block.tension_by_command = tension_by[3];
        block.tension_by_state.copy_from_slice(&tension_by[4..]);
        block.transverse_by_state.copy_from_slice(&transverse_by[4..]);
        for (r, by) in rates_by.iter().enumerate() {
            block.rates_by_motion[r] = [by[0], by[1], by[2]];
            block.rates_by_command[r] = by[3];
            block.rates_by_state[r].copy_from_slice(&by[4..]);
        }
        let (row, pose, twist) = (block.jacobian, &mut self.force_by_pose, &mut self.force_by_twist);
        for r in 0..3 {
            for c in 0..3 {
                pose[r][c] -= e.tension[i] * hessian[r][c];
            }
        }
        matrix3::add_outer(pose, &row, &row, -tension_by[0]);
        matrix3::add_outer(pose, &row, &block.curvature, -tension_by[1]);
        matrix3::add_outer(twist, &row, &row, -tension_by[1]);
        matrix3::add_outer(twist, &row, &block.normal_over_length, -tension_by[2]);
        matrix3::add_outer(twist, &normal, &block.normal_over_length, transverse_by[2]);
    }
}
