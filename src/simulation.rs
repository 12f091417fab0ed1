//! A plant in motion: states, inputs with their history, and the integrator.

mod command;
mod equilibrium;
mod pose_history;
mod sensors;
mod snapshot;
mod start;
mod system;
mod tangent;

use std::sync::Arc;

pub use equilibrium::{load_at_rest, static_equilibrium, wrench_at_rest};
pub use sensors::Outputs;
pub(crate) use sensors::Shown;
use snapshot::Room;
pub use snapshot::SnapshotError;
pub use start::{Start, StartError};
pub use tangent::{Direction, Tangent};

use crate::dynamics::{Evaluation, Inputs, Reading};
use crate::integrator::{IntegrationError, Integrator, Solver, Statistics};
use crate::per_cable::PerCable;
use crate::plant::Plant;
use command::CommandHistory;
use pose_history::PoseHistory;
use system::{InputSegment, PlantSystem, Workspace};

/// Relative tolerance where none is asked for.
pub const DEFAULT_TOLERANCE: f64 = 1e-8;

/// Longest stretch between two points of the pose history (s), for a delayed pose sensor.
const HISTORY_STEP: f64 = 0.02;

/// A plant in motion. Everything a simulation is: set inputs, advance, read outputs, save and restore.
#[derive(Clone, Debug)]
pub struct Simulation {
    plant: Arc<Plant>,
    time: f64,
    /// What rounding has left out of `time` (s), so that an hour of steps of 1 ms ends after an hour.
    time_carry: f64,
    y: Vec<f64>,
    /// Which cables the equations in force take as slack.
    slack: PerCable<bool>,
    /// Inputs at `input_time` and their slopes, as commanded.
    inputs: Inputs,
    input_slopes: Inputs,
    /// Whether all slopes are zero.
    held: bool,
    input_time: f64,
    /// Force added to each winch command after its dead time.
    winch_disturbance: PerCable<f64>,
    commands: CommandHistory,
    poses: PoseHistory,
    integrator: Integrator,
    work: Workspace,
    room: Room,
}

impl Simulation {
    /// A simulation of `plant` from `start`.
    ///
    /// # Errors
    /// When the start pose is impossible or no equilibrium is found; see [`StartError`].
    pub fn new(plant: Arc<Plant>, start: &Start, relative_tolerance: f64) -> Result<Self, StartError> {
        let y = start.states(&plant)?;
        Ok(Self::from_states(plant, start.time, y, start.inputs, relative_tolerance))
    }

    /// A simulation from these states, laid out as in [`Plant::rates`].
    pub fn from_states(plant: Arc<Plant>, time: f64, y: Vec<f64>, inputs: Inputs, relative_tolerance: f64) -> Self {
        let (n, cables) = (plant.dimension(), plant.cables());
        let integrator = Integrator::new(n, plant.cables(), relative_tolerance);
        let work = Workspace::new(&plant);
        let commands = CommandHistory::new(&plant, time, inputs.winch_force);
        let poses = PoseHistory::new(plant.pose_delay, time, &y);
        let mut simulation = Self {
            plant,
            time,
            time_carry: 0.0,
            y,
            slack: PerCable::filled(cables, false),
            inputs,
            input_slopes: Inputs::none(cables),
            held: true,
            input_time: time,
            winch_disturbance: PerCable::filled(cables, 0.0),
            commands,
            poses,
            integrator,
            work,
            room: Room::default(),
        };
        simulation.slack = simulation.plant.slack_cables(time, &simulation.y, &simulation.inputs_at_plant());
        simulation
    }

    /// The same by another method than Radau IIA.
    #[must_use]
    pub fn with_solver(mut self, solver: Solver) -> Self {
        self.integrator.set_solver(solver);
        self
    }

    /// The same with the points kept that its steps lead to, see [`Simulation::path`].
    #[must_use]
    pub fn with_path(mut self) -> Self {
        self.integrator.keep_path();
        self
    }

    /// Where the integrator's steps of the last [`advance`](Self::advance) have led, the last of them to its end: a time (s) and the
    /// states there, one step after the other. Empty without [`Simulation::with_path`].
    pub fn path(&self) -> &[f64] {
        self.integrator.path()
    }

    /// The method that integrates.
    pub fn solver(&self) -> Solver {
        self.integrator.solver()
    }

    /// Time (s) from which on the explicit method has found the equations to be stiff; `None` where it has not, or has not been
    /// used.
    pub fn stiff_since(&self) -> Option<f64> {
        self.integrator.stiff_since()
    }

    /// The plant.
    pub fn plant(&self) -> &Arc<Plant> {
        &self.plant
    }

    /// Time (s).
    pub fn time(&self) -> f64 {
        self.time
    }

    /// States, laid out as in [`Plant::rates`].
    pub fn states(&self) -> &[f64] {
        &self.y
    }

    /// Which cables carry nothing.
    pub fn slack(&self) -> PerCable<bool> {
        if self.plant.has.platform_side { self.slack_under(&self.inputs_at_plant()) } else { self.slack }
    }

    /// Which cables carry nothing under these inputs. Where tension follows the inputs directly, it may have changed with
    /// them since the last step.
    fn slack_under(&self, inputs: &Inputs) -> PerCable<bool> {
        if self.plant.has.platform_side { self.plant.slack_cables(self.time, &self.y, inputs) } else { self.slack }
    }

    /// Inputs as commanded now.
    pub fn inputs(&self) -> Inputs {
        if self.held {
            return self.inputs;
        }
        let at = |value: f64, slope: f64| value + slope * (self.time - self.input_time);
        let zip = |a: &[f64], b: &[f64], k: usize| at(a[k], b[k]);
        Inputs {
            winch_force: PerCable::from_fn(self.plant.cables(), |i| {
                zip(&self.inputs.winch_force, &self.input_slopes.winch_force, i)
            }),
            disturbance: std::array::from_fn(|k| zip(&self.inputs.disturbance, &self.input_slopes.disturbance, k)),
        }
    }

    /// Whether the inputs are held: no slope is set.
    pub fn holds_inputs(&self) -> bool {
        self.held
    }

    /// Slopes of the inputs as commanded (per second).
    pub fn input_slopes(&self) -> Inputs {
        self.input_slopes
    }

    /// Sets the inputs from now on, held constant.
    pub fn set_inputs(&mut self, inputs: Inputs) {
        if self.held && inputs == self.inputs {
            return;
        }
        self.change_rates(&inputs);
        if !self.held {
            self.input_slopes = Inputs::none(self.plant.cables());
            self.held = true;
        }
        self.take_inputs(inputs);
    }

    /// Sets the inputs from now on, changing at `slopes` (per second).
    pub fn set_inputs_with_slopes(&mut self, inputs: Inputs, slopes: Inputs) {
        if inputs == self.inputs() && slopes == self.input_slopes {
            return;
        }
        self.change_rates(&inputs);
        self.input_slopes = slopes;
        self.held = slopes.is_zero();
        self.take_inputs(inputs);
    }

    /// The inputs are about to become these: so do the rates, where forces at winches do nothing else.
    fn change_rates(&mut self, inputs: &Inputs) {
        let before = self.inputs();
        if !self.plant.pulls_apart || before.disturbance != inputs.disturbance {
            self.integrator.equations_changed();
        } else if let Some(rates) = self.integrator.rates_to_change() {
            self.plant.pull_harder(&self.y, |i| inputs.winch_force[i] - before.winch_force[i], rates);
        }
    }

    /// Takes up inputs; their slopes are there.
    fn take_inputs(&mut self, inputs: Inputs) {
        self.inputs = inputs;
        self.input_time = self.time;
        self.commands.push(self.time, &self.inputs, &self.input_slopes);
    }

    /// Replaces the states, as after a correction by measurements; the integrator starts afresh.
    pub fn set_states(&mut self, y: &[f64]) {
        self.y.copy_from_slice(y);
        self.integrator.restart();
        self.slack = self.plant.slack_cables(self.time, &self.y, &self.inputs_at_plant());
    }

    /// Moves the states a little, keeping the integrator's Jacobian and step size: for sensitivities by differences.
    pub fn nudge_states(&mut self, y: &[f64]) {
        self.integrator.state_changed();
        self.y.copy_from_slice(y);
    }

    /// Sets an unmeasured force (N) added to each winch command after its dead time, for state estimation.
    pub fn set_winch_disturbance(&mut self, force: PerCable<f64>) {
        self.integrator.equations_changed();
        self.winch_disturbance = force;
    }

    /// What the integration has cost so far.
    pub fn statistics(&self) -> Statistics {
        self.integrator.statistics()
    }

    /// Advances by `duration` (s) under the inputs as set. Times add up without drift.
    ///
    /// # Errors
    /// When the duration is negative or not finite, or the integrator cannot go on; the simulation then stands at the
    /// time named in the error, with the state there.
    pub fn advance(&mut self, duration: f64) -> Result<(), IntegrationError> {
        let (end, carry) = two_sum(self.time, duration + self.time_carry);
        self.advance_stretches(end, duration)?;
        self.time_carry = carry;
        Ok(())
    }

    /// Advances to `end` (s) under the inputs as set: for callers that keep the time themselves.
    ///
    /// # Errors
    /// As [`Simulation::advance`].
    pub fn advance_to(&mut self, end: f64) -> Result<(), IntegrationError> {
        self.advance_stretches(end, end - self.time)
    }

    /// Advances by `duration` to what is then called `end`, one stretch of steady inputs after the other.
    fn advance_stretches(&mut self, end: f64, duration: f64) -> Result<(), IntegrationError> {
        if !(duration >= 0.0 && duration.is_finite()) {
            return Err(IntegrationError::Duration { duration, time: self.time });
        }
        self.time_carry = 0.0;
        self.integrator.begin(self.time);
        let mut left = duration;
        while left > 0.0 {
            let mut part = left;
            if let Some(next) = self.commands.next_change(self.time) {
                part = part.min(next - self.time);
            }
            if self.poses.active() {
                part = part.min(HISTORY_STEP);
            }
            let switch = self.plant.next_switch(self.time);
            if let Some(next) = switch {
                part = part.min(next - self.time);
            }
            // Where the clock is so far on that it cannot tell so short a stretch, the rest is one.
            let last = part >= left - 4.0 * f64::EPSILON * end.abs() || self.time + part == self.time;
            let stop = match switch {
                _ if last => end,
                Some(next) if part == next - self.time => next,
                _ => self.time + part,
            };
            let start = self.time;
            self.advance_stretch(stop, if last { left } else { part })?;
            if switch.is_some_and(|next| next <= self.time) {
                self.switch_effects(start);
            }
            left = if last { 0.0 } else { end - self.time };
        }
        Ok(())
    }

    /// Advances by `duration` to `stop`, over which every input is linear in time.
    fn advance_stretch(&mut self, stop: f64, duration: f64) -> Result<(), IntegrationError> {
        let inputs = self.inputs_felt();
        if self.commands.delayed() {
            self.integrator.equations_changed();
        }
        if self.plant.has.platform_side {
            self.integrator.state_changed();
            self.slack = self.plant.slack_cables(self.time, &self.y, &inputs.at(self.time));
        }
        let plant = self.plant.at(self.time);
        let mut system = PlantSystem::new(plant, &inputs, &mut self.slack, &mut self.work);
        let result = self.integrator.advance_part(&mut system, self.time, &mut self.y, duration);
        self.time = match &result {
            Ok(()) => stop,
            Err(error) => error.time(),
        };
        self.poses.push(self.time, &self.y);
        result
    }

    /// Effects begin or end now, other than at `before` (s). The platform's and the cables' states go on as they are; an effect
    /// that begins has its own where they change nothing.
    fn switch_effects(&mut self, before: f64) {
        let inputs = self.inputs_at_plant();
        let plant = self.plant.at(self.time);
        let slack = plant.slack_cables(self.time, &self.y, &inputs);
        let forces = plant.drive_forces(self.time, &self.y, &inputs, &slack);
        plant.begin_effects(self.plant.at(before), &forces, &mut self.y);
        self.slack = plant.slack_cables(self.time, &self.y, &inputs);
        self.integrator.restart();
    }

    /// The inputs as the plant feels them from now to the next change: commands after their dead time, forces in place of
    /// torques.
    #[inline]
    fn inputs_felt(&self) -> InputSegment {
        if self.held && !self.commands.delayed() {
            return InputSegment::held(self.time, self.held_inputs_felt());
        }
        let (mut value, mut slope) = (self.inputs(), self.input_slopes);
        self.commands.delay(self.time, &mut value.winch_force, &mut slope.winch_force);
        if self.plant.has.torque {
            (value, slope) = (self.plant.driven(&value), self.plant.driven(&slope));
        }
        self.disturb(&mut value);
        InputSegment::new(self.time, value, slope)
    }

    /// The same of inputs that are held and do not come late.
    #[inline]
    fn held_inputs_felt(&self) -> Inputs {
        let mut value = if self.plant.has.torque { self.plant.driven(&self.inputs) } else { self.inputs };
        self.disturb(&mut value);
        value
    }

    /// Adds the disturbances of the winches.
    #[inline]
    fn disturb(&self, inputs: &mut Inputs) {
        for (force, added) in inputs.winch_force.iter_mut().zip(&self.winch_disturbance) {
            *force += added;
        }
    }

    /// The inputs as the plant feels them now: commands after their dead time, forces in place of torques.
    pub fn inputs_at_plant(&self) -> Inputs {
        if self.held && !self.commands.delayed() { self.held_inputs_felt() } else { self.inputs_felt().value }
    }

    /// Everything known of the plant now.
    pub fn evaluate(&self) -> Evaluation {
        let inputs = self.inputs_at_plant();
        self.plant.evaluate(self.time, &self.y, &inputs, &self.slack_under(&inputs))
    }

    /// The same, in place of an evaluation of a plant with as many cables.
    pub(crate) fn evaluate_into(&self, out: &mut Evaluation) {
        let inputs = self.inputs_at_plant();
        self.plant.evaluate_into(self.time, &self.y, &inputs, &self.slack_under(&inputs), out);
    }

    /// Hands what sensors read of each cable now to `see`.
    #[inline(always)]
    pub(crate) fn see_cables(&self, see: impl FnMut(usize, Reading)) {
        let plant = self.plant.at(self.time);
        if plant.plain {
            // Nothing of it follows from the inputs.
            return plant.see_cables(self.time, &self.y, &self.inputs, &self.slack, see);
        }
        let inputs = self.inputs_at_plant();
        plant.see_cables(self.time, &self.y, &inputs, &self.slack_under(&inputs), see);
    }

    /// Rates of the states now.
    pub fn rates(&self) -> Vec<f64> {
        let mut rates = vec![0.0; self.y.len()];
        let inputs = self.inputs_at_plant();
        self.plant.rates(self.time, &self.y, &inputs, &self.slack_under(&inputs), &mut rates);
        rates
    }

    /// What the sensors show now.
    pub fn outputs(&self) -> Outputs {
        self.outputs_of(&self.evaluate())
    }

    /// What the sensors show, from an evaluation of this instant.
    pub fn outputs_of(&self, e: &Evaluation) -> Outputs {
        self.shown(e).all()
    }

    /// The same, each value made when it is asked for.
    pub(crate) fn shown<'a>(&'a self, e: &'a Evaluation) -> Shown<'a> {
        Shown { plant: self.plant.at(self.time), pose: self.pose_seen(), twist: self.twist(), e }
    }

    /// The pose that the pose sensor sees: its own delay behind the present one.
    pub(crate) fn pose_seen(&self) -> [f64; 3] {
        let y = &self.y;
        self.poses.at(self.time - self.plant.pose_delay).unwrap_or([y[0], y[1], y[2]])
    }

    pub(crate) fn twist(&self) -> [f64; 3] {
        let y = &self.y;
        [y[3], y[4], y[5]]
    }
}

/// The rounded sum of two numbers and what rounding took from it (D. E. Knuth).
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let b_part = sum - a;
    (sum, (a - (sum - b_part)) + (b - b_part))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model_file::Model;

    #[test]
    fn a_path_leads_step_by_step_to_the_end_and_changes_nothing() {
        let plain = Model::default().simulation().expect("a start");
        let (mut plain, mut kept) = (plain.clone(), plain.with_path());
        assert!(kept.path().is_empty());
        for _ in 0..3 {
            for simulation in [&mut plain, &mut kept] {
                simulation.set_inputs(Inputs::pulling(4, 3e4));
                simulation.advance(2.0).expect("a motion");
            }
            assert!(plain.states() == kept.states() && plain.path().is_empty());
            let width = plain.states().len() + 1;
            let times: Vec<f64> = kept.path().chunks_exact(width).map(|point| point[0]).collect();
            assert!(times.len() > 2 && times.is_sorted_by(|a, b| a < b) && times[0] > kept.time() - 2.0, "{times:?}");
            assert_eq!(kept.path()[kept.path().len() - width..], [&[kept.time()], kept.states()].concat());
        }
    }
}
