//! The derivative `∂f/∂y` of the plant's rates, in the structure that the plant has.
//!
//! A cable's own states reach the rest only through the force at its end, and the platform reaches them only through the cable's
//! length, its rate, its acceleration and the angular rate. So the matrix is a 6×6 part of the platform, a block for each cable and
//! a few rows between them; it is never formed. Left out is what an expression says of other cables than its own, and of a
//! cable's own states where it is a force on the platform. Newton's method checks its own convergence.

mod chord;
mod local;

use num_dual::DualSVec64;

use crate::effect::PlatformContext;
use crate::per_cable::PerCable;
use crate::plant::Plant;

use super::matrix3::{Matrix3, add_outer, combine};
use super::{Evaluation, Inputs, MAX_EFFECT_STATES};
use chord::Chord;
use local::{Derivatives, Local, OUTSIDE, derivatives};

/// Largest number of states of one cable.
pub(super) const BLOCK: usize = 2 + MAX_EFFECT_STATES;

/// One cable's part of the derivatives. Rows are by pose `q`, twist `v`, the platform's acceleration along the cable (`row · v̇`),
/// own states.
#[derive(Clone, Debug, Default)]
pub(super) struct CableBlock {
    /// Row of `J_M`: the tension `T` is the wrench `-T row`.
    pub(super) row: [f64; 3],
    /// `L` times the row of `J_α`: a transverse force `N` is the wrench `N normal`.
    pub(super) normal: [f64; 3],
    /// Tension and transverse force by the winch force.
    pub(super) force_by_command: [f64; 2],
    /// As many as it has.
    pub(super) states: Vec<StateBlock>,
}

/// What one of a cable's own states does, and what is done to it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct StateBlock {
    /// The tension by this state.
    pub(super) tension: f64,
    /// The transverse force by it; slow, and left out of Newton's matrix.
    pub(super) transverse: f64,
    pub(super) rate_by_command: f64,
    pub(super) rate_by_acceleration: f64,
    pub(super) rate_by_pose: [f64; 3],
    pub(super) rate_by_twist: [f64; 3],
    /// By the cable's states in their order.
    pub(super) rate_by_state: [f64; BLOCK],
}

/// First derivatives of the plant at one state.
#[derive(Clone, Debug, Default)]
pub(crate) struct Linearisation {
    pub(super) mass: Matrix3<f64>,
    /// Of the wrench less mass matrix times acceleration, the cables' own states held.
    pub(super) force_by_pose: Matrix3<f64>,
    pub(super) force_by_twist: Matrix3<f64>,
    pub(super) cables: Vec<CableBlock>,
}

impl Linearisation {
    /// Room for the cables of `plant`.
    pub(crate) fn new(plant: &Plant) -> Self {
        let block = |states: usize| CableBlock { states: vec![StateBlock::default(); states], ..CableBlock::default() };
        let cables = plant.states_of_cables().iter().map(|states| block(states.len())).collect();
        Self { cables, ..Self::default() }
    }

    /// Linearises the plant at this instant.
    pub(crate) fn update(&mut self, plant: &Plant, time: f64, y: &[f64], u: &Inputs, slack: &PerCable<bool>) {
        let e = plant.evaluate(time, y, u, slack);
        self.linearise(plant, time, y, u, &e);
    }

    /// Linearises the plant at the instant that `e` is the evaluation of.
    pub(super) fn linearise(&mut self, plant: &Plant, time: f64, y: &[f64], u: &Inputs, e: &Evaluation) {
        let pose = [y[0], y[1], y[2]];
        let twist = [y[3], y[4], y[5]];
        self.mass = e.mass;
        self.linearise_platform(plant, pose[2], twist[2], e.acceleration);
        self.linearise_wrench(plant, time, &pose, &twist, u, e);
        self.cables.resize_with(plant.cables(), CableBlock::default);
        for i in 0..plant.cables() {
            let chord = Chord::new(&e.kinematics[i], twist);
            let (acceleration, by_pose, by_twist) = chord.along(&e.acceleration);
            let states = plant.offset[i]..plant.effect_states(i).end;
            let size = states.len();
            let mut own = [0.0; BLOCK];
            own[..size].copy_from_slice(&y[states]);
            let local =
                Local { plant, cable: i, time, u, slack: e.slack[i], pose, twist, evaluation: e, acceleration, own };
            let d = local.derivatives();
            self.add_inertia(plant, i, &chord, e);
            self.add_cable(i, size, &chord, e.tension[i], &d, [&by_pose, &by_twist]);
        }
    }

    /// The platform's own mass about its centre, and its weight, as they turn.
    fn linearise_platform(&mut self, plant: &Plant, phi: f64, omega: f64, [ax, ay, spin]: [f64; 3]) {
        let [cx, cy] = plant.com_arm([phi.cos(), phi.sin()]).map(|c| c * plant.data.mass);
        let [gravity_x, gravity_y] = plant.data.gravity;
        let (pull_x, pull_y) = (gravity_x - ax, gravity_y - ay);
        self.force_by_pose = [[0.0; 3]; 3];
        self.force_by_twist = [[0.0; 3]; 3];
        // The arm's own derivative is (-cy, cx).
        self.force_by_pose[0][2] = -omega * omega * cy + spin * cx;
        self.force_by_pose[1][2] = omega * omega * cx + spin * cy;
        self.force_by_pose[2][2] = -(cx * pull_x + cy * pull_y);
        self.force_by_twist[0][2] = 2.0 * omega * cx;
        self.force_by_twist[1][2] = 2.0 * omega * cy;
    }

    /// Effects that are forces on the platform.
    fn linearise_wrench(
        &mut self,
        plant: &Plant,
        time: f64,
        pose: &[f64; 3],
        twist: &[f64; 3],
        u: &Inputs,
        e: &Evaluation,
    ) {
        type Gradient = DualSVec64<6>;
        if plant.wrench.is_empty() {
            return;
        }
        let with = |value: f64, slopes: [f64; 6]| {
            Gradient::new(value, num_dual::Derivative::some(nalgebra::SVector::from(slopes)))
        };
        let chord = e.kinematics.map(|k| Chord::new(&k, *twist));
        let by_pose = |[a, b, c]: [f64; 3]| [a, b, c, 0.0, 0.0, 0.0];
        let speed = |c: Chord| {
            let ([a, b, p], [d, f, q]) = (c.speed_by_pose, c.row);
            with(c.kinematics.speed, [a, b, p, d, f, q])
        };
        let context = PlatformContext {
            time: Gradient::from(time),
            geometry: &plant.data.geometry,
            pose: &std::array::from_fn(|k| Gradient::from(pose[k]).derivative(k)),
            twist: &std::array::from_fn(|k| Gradient::from(twist[k]).derivative(3 + k)),
            inputs: &u.lift(),
            cable_length: &chord.map(|c| with(c.kinematics.length, by_pose(c.row))),
            cable_speed: &chord.map(speed),
            unstretched_length: &e.unstretched.map(Gradient::from),
            unstretched_rate: &e.unstretched_rate.map(Gradient::from),
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

    /// The inertia of a cable that moves with the platform whatever the cable's own states do: across, and a mass at its end.
    fn add_inertia(&mut self, plant: &Plant, i: usize, chord: &Chord, e: &Evaluation) {
        let data = &plant.data.cables[i];
        let (pose, twist) = (&mut self.force_by_pose, &mut self.force_by_twist);
        let (length, span) = (chord.kinematics.length, chord.kinematics.span);
        let (across, by_pose, by_twist) = chord.across(&e.acceleration);
        let density = data.straight_density;
        chord.add_normal_derivative(pose, -density * span * across);
        add_outer(pose, &chord.normal, &combine(across, &chord.span_by_pose, span, &by_pose), -density);
        add_outer(twist, &chord.normal, &by_twist, -density * span);
        if data.end_density != 0.0 {
            let (along, by_pose, by_twist) = chord.along(&e.acceleration);
            chord.add_row_derivative(pose, -data.end_density * length * along);
            add_outer(pose, &chord.row, &combine(along, &chord.row, length, &by_pose), -data.end_density);
            add_outer(twist, &chord.row, &by_twist, -data.end_density * length);
        }
    }

    /// A cable's forces on the platform, and its own block; `acceleration_by` are the derivatives of `L̈` by pose and twist.
    fn add_cable(
        &mut self,
        i: usize,
        size: usize,
        chord: &Chord,
        tension: f64,
        d: &Derivatives,
        acceleration_by: [&[f64; 3]; 2],
    ) {
        let by_pose = |by: &[f64]| -> [f64; 3] {
            std::array::from_fn(|c| {
                by[0] * chord.row[c]
                    + by[1] * chord.speed_by_pose[c]
                    + by[2] * chord.turning_by_pose[c]
                    + by[3] * acceleration_by[0][c]
                    + by[5] * chord.turn[c]
            })
        };
        let by_twist = |by: &[f64]| -> [f64; 3] {
            std::array::from_fn(|c| by[1] * chord.row[c] + by[2] * chord.turn[c] + by[3] * acceleration_by[1][c])
        };
        let (pose, twist) = (&mut self.force_by_pose, &mut self.force_by_twist);
        chord.add_row_derivative(pose, -tension);
        add_outer(pose, &chord.row, &by_pose(&d.tension_by), -1.0);
        add_outer(twist, &chord.row, &by_twist(&d.tension_by), -1.0);
        chord.add_normal_derivative(pose, d.transverse);
        add_outer(pose, &chord.normal, &by_pose(&d.transverse_by), 1.0);
        add_outer(twist, &chord.normal, &by_twist(&d.transverse_by), 1.0);
        let block = &mut self.cables[i];
        block.row = chord.row;
        block.normal = chord.normal;
        block.force_by_command = [d.tension_by[4], d.transverse_by[4]];
        block.states.resize_with(size, StateBlock::default);
        for (c, (state, by)) in block.states.iter_mut().zip(&d.rates_by).enumerate() {
            *state = StateBlock {
                tension: d.tension_by[OUTSIDE + c],
                transverse: d.transverse_by[OUTSIDE + c],
                rate_by_command: by[4],
                rate_by_acceleration: by[3],
                rate_by_pose: by_pose(by),
                rate_by_twist: by_twist(by),
                rate_by_state: std::array::from_fn(|k| by[OUTSIDE + k]),
            };
        }
    }
}
