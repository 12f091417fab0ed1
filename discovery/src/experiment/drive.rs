//! A model driven along a motion in simulation: what its sensors would show, without noise.

use std::f64::consts::TAU;

use cdpr::dynamics::Inputs;
use cdpr::geometry::Geometry;
use cdpr::model_file::Model;
use cdpr::parameters::Initialization;
use cdpr::per_cable::PerCable;
use cdpr::simulation::Start;

use crate::data::{Channel, Trial};
use crate::filter::path::Trajectory;
use crate::model::delayed::earlier;
use crate::model::examined::Examined;
use crate::model::sizes::Sizes;

use super::motion::{Motion, Statics};

/// Speed of the control loop times the period in which the platform swings on its cables, over 2π: well below the cables' own
/// vibration.
const LOOP: f64 = 0.15;
/// The same in sampling intervals, where these are long.
const SAMPLED: f64 = 0.12;
/// Its damping ratio.
const DAMPING: f64 = 0.8;
/// Speed of the observer over that of the loop: fast enough for the platform, and too slow to feed what the cables do by
/// themselves back into them.
const OBSERVER: f64 = 4.0;
/// How far from the motion asked for the platform has run away: a share of the robot's reach, and an angle (rad).
const ASTRAY: (f64, f64) = (0.05, 0.5);

/// A motion that was driven.
pub(super) struct Driven {
    /// What was commanded, and shown.
    pub(super) trial: Trial,
    /// The states it had.
    pub(super) trajectory: Trajectory,
    /// Tensions at each sample (N).
    pub(super) tension: Vec<PerCable<f64>>,
}

/// A controller of the ordinary kind: an observer of pose and twist, feedback of both, the tensions nearest to each other.
struct Controller<'a> {
    motion: &'a Motion,
    statics: Statics,
    /// Speed of the loop (1/s).
    rate: f64,
    interval: f64,
    /// Pose and twist as observed, and the acceleration asked for.
    pose: [f64; 3],
    twist: [f64; 3],
    acceleration: [f64; 3],
}

impl<'a> Controller<'a> {
    fn new(model: &Model, motion: &'a Motion, interval: f64) -> Self {
        let rate = LOOP * TAU / Sizes::of(&model.parameters).swing;
        Self {
            motion,
            statics: Statics::new(model, Geometry::new(&model.parameters)),
            rate: rate.min(SAMPLED / interval),
            interval,
            pose: motion.at(0.0)[0],
            twist: [0.0; 3],
            acceleration: [0.0; 3],
        }
    }

    /// The winch forces (N) from now on, by the pose that is seen.
    fn forces(&mut self, time: f64, seen: &[f64; 3]) -> Result<PerCable<f64>, String> {
        let [wanted, speed, acceleration] = self.motion.at(time);
        let (rate, observer, h) = (self.rate, OBSERVER * self.rate, self.interval);
        for k in 0..3 {
            let predicted = self.pose[k] + h * self.twist[k];
            let surprise = seen[k] - predicted;
            self.pose[k] = predicted + 2.0 * OBSERVED * observer * h * surprise;
            self.twist[k] += h * (self.acceleration[k] + observer * observer * surprise);
            self.acceleration[k] = acceleration[k]
                + rate * rate * (wanted[k] - self.pose[k])
                + 2.0 * DAMPING * rate * (speed[k] - self.twist[k]);
        }
        let line = self.statics.line(&self.pose, &self.twist, &self.acceleration);
        let line = line.ok_or_else(|| "the pose is singular".to_owned())?;
        Ok(line.of_mean(self.motion.mean_tension(time)))
    }
}

/// Damping ratio of the observer.
const OBSERVED: f64 = 0.7;

/// Drives `model` along `motion`, forces held over `interval` (s), by a controller that sees the pose.
pub(super) fn drive(model: &Model, motion: &Motion, channels: &[Channel], interval: f64) -> Result<Driven, String> {
    let cannot = |e: &dyn std::fmt::Display| format!("the model cannot be driven along the motion: {e}");
    let examined = Examined::new(model).map_err(|e| cannot(&e))?;
    let sizes = Sizes::of(&model.parameters);
    let mut controller = Controller::new(model, motion, interval);
    let cables = model.parameters.cables();
    let inputs = |force: PerCable<f64>| Inputs { winch_force: force, ..Inputs::none(cables) };
    let [start, ..] = motion.at(0.0);
    let first = inputs(controller.forces(0.0, &start)?);
    let mut controller = Controller::new(model, motion, interval);
    let model = Model {
        start: Start {
            pose: start,
            inputs: first,
            initialization: Initialization::FromWinchForces,
            ..Start::pulling(cables)
        },
        ..model.clone()
    };
    let mut simulation = model.simulation().map_err(|e| cannot(&e))?;
    let samples = (motion.duration() / interval * (1.0 + 1e-12)).floor() as usize + 1;
    let (states, width) = (examined.states(), examined.states() + examined.latents());
    let name = "planned".to_owned();
    let mut trial = Trial {
        name,
        time: vec![],
        inputs: vec![],
        channels: channels.to_vec(),
        measured: vec![],
        taken_off: vec![],
        undone: Vec::new(),
    };
    let mut trajectory = Trajectory { values: Vec::with_capacity(samples * width), width, states };
    let mut tension = Vec::with_capacity(samples);
    let mut shown = Vec::new();
    for k in 0..samples {
        let time = k as f64 * interval;
        simulation.advance_to(time).map_err(|e| cannot(&e))?;
        let y = simulation.states();
        let pose: [f64; 3] = std::array::from_fn(|k| y[k]);
        let [wanted, ..] = motion.at(time);
        let astray = (pose[0] - wanted[0]).hypot(pose[1] - wanted[1]);
        if astray.is_nan() || astray > ASTRAY.0 * sizes.reach || (pose[2] - wanted[2]).abs() > ASTRAY.1 {
            return Err(format!("at {time} s the platform has run away from the motion asked for"));
        }
        trajectory.values.extend_from_slice(y);
        trajectory.values.resize((k + 1) * width, 0.0);
        let input = inputs(controller.forces(time, &pose)?);
        simulation.set_inputs(input);
        examined.measure(&simulation, channels, &mut shown);
        tension.push(simulation.outputs().tension);
        trial.time.push(time);
        trial.inputs.push(input);
        trial.measured.push(shown.clone());
    }
    for (j, late) in channels.iter().map(|channel| examined.late(*channel)).enumerate().filter(|(_, late)| *late != 0.0)
    {
        let column: Vec<f64> = trial.measured.iter().map(|row| row[j]).collect();
        let then = earlier(&trial.time, &column, late);
        trial.measured.iter_mut().zip(then).for_each(|(row, then)| row[j] = then);
    }
    Ok(Driven { trial, trajectory, tension })
}
