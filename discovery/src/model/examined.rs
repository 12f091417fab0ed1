//! A model under examination on one trial: states, latent disturbances, and what the sensors show.

use std::sync::Arc;

use cdpr::dynamics::{Evaluation, Inputs};
use cdpr::integrator::Solver;
use cdpr::model_file::Model;
use cdpr::parameters::Initialization;
use cdpr::per_cable::PerCable;
use cdpr::plant::{Plant, PlantError};
use cdpr::simulation::{Simulation, Start};

use crate::data::line::{line, straight};
use crate::data::{Channel, Trial};
use crate::hypothesis::sensor::lateness_of_pose;

/// Latent disturbances on the platform, a wrench: the first ones. A force at each winch follows.
pub(crate) const WRENCH: usize = 3;

/// Tolerance of the simulations of one sample as a share of the robot's reach (1/m): a hundredth of the noise of instruments that
/// are off by a hundred-thousandth of it, as the best are. A tenth of that takes 1.5 times the steps on a robot of 4 m.
const TOLERANCE: f64 = 1e-7;
/// Largest tolerance, of robots of 100 m and more: a micrometre.
const LARGEST_TOLERANCE: f64 = 1e-6;

/// How long a trial is looked at for how straight its beginning is (s): as long as a line may be, on both sides, and twice that.
const BEGINNING: f64 = 1.0;
/// Rows that are looked at where these are fewer.
const FEWEST: usize = 20;

/// States of a plant at a time, under the inputs that it feels, with the cables in `slack` carrying nothing.
pub(crate) struct Moment<'a> {
    pub(crate) time: f64,
    pub(crate) y: &'a [f64],
    pub(crate) felt: &'a Inputs,
    pub(crate) slack: PerCable<bool>,
}

impl Moment<'_> {
    fn evaluate(&self, plant: &Plant) -> Evaluation {
        plant.evaluate(self.time, self.y, self.felt, &self.slack)
    }
}

/// A plant with what the sensors add to it.
#[derive(Clone, Debug)]
pub(crate) struct Examined {
    pub(crate) plant: Arc<Plant>,
    pose_delay: f64,
    /// Relative tolerance of its simulations.
    tolerance: f64,
}

impl Examined {
    pub(crate) fn new(model: &Model) -> Result<Self, PlantError> {
        let plant = model.plant()?;
        let pose_delay = model.effects.iter().filter_map(lateness_of_pose).sum();
        let tolerance = (TOLERANCE * plant.geometry().size()).min(LARGEST_TOLERANCE);
        Ok(Self { plant, pose_delay, tolerance })
    }

    /// Number of plant states.
    pub(crate) fn states(&self) -> usize {
        self.plant.dimension()
    }

    /// Number of latent disturbances.
    pub(crate) fn latents(&self) -> usize {
        WRENCH + self.plant.cables()
    }

    /// A simulation for a trial from the states `y` at sample `k` on, where its command history begins.
    pub(crate) fn simulation(&self, trial: &Trial, k: usize, y: &[f64]) -> Simulation {
        Simulation::from_states(self.plant.clone(), trial.time[k], y.to_vec(), trial.inputs[k], self.tolerance)
            .with_solver(Solver::Auto)
    }

    /// Writes `∂h/∂y`, channels by rows, at a time (s), where it is plain: poses and lengths. Else returns false.
    pub(crate) fn sensor_slopes(&self, time: f64, e: &Evaluation, channels: &[Channel], slopes: &mut [f64]) -> bool {
        if !self.plant.at(time).pose_sensor().is_plain() || channels.iter().any(|c| matches!(c, Channel::Tension(_))) {
            return false;
        }
        for (channel, slopes) in channels.iter().zip(slopes.chunks_exact_mut(self.states())) {
            slopes.fill(0.0);
            let (cable, sensor) = match *channel {
                Channel::CableLength(i) => (i, 0),
                Channel::UnstretchedLength(i) => (i, 1),
                Channel::Pose(k) => {
                    slopes[k] = 1.0;
                    continue;
                }
                Channel::Tension(_) => unreachable!("tensions were left to others"),
            };
            let factor = self.plant.at(time).length_sensor_slopes(cable, e.unstretched[cable])[sensor];
            match self.plant.unstretched_index(cable).filter(|_| sensor == 1) {
                Some(at) => slopes[at] = factor,
                None => {
                    let row = e.kinematics[cable].jacobian_row();
                    slopes.iter_mut().zip(row).for_each(|(slope, by)| *slope = factor * by);
                }
            }
        }
        true
    }

    /// How late a channel is by the model's effects (s).
    pub(crate) fn late(&self, channel: Channel) -> f64 {
        if matches!(channel, Channel::Pose(_)) { self.pose_delay } else { 0.0 }
    }

    /// What the sensors show of the simulation's present state, in the order of `channels`, those that are [`late`](Self::late)
    /// by then.
    pub(crate) fn measure(&self, simulation: &Simulation, channels: &[Channel], out: &mut Vec<f64>) {
        let felt = simulation.inputs_at_plant();
        let (time, y, slack) = (simulation.time(), simulation.states(), simulation.slack());
        self.measure_at(simulation, &Moment { time, y, felt: &felt, slack }, channels, out);
    }

    /// What the sensors show at a moment, and the plant there; `simulation` is any of this model.
    pub(crate) fn measure_at(
        &self,
        simulation: &Simulation,
        moment: &Moment<'_>,
        channels: &[Channel],
        out: &mut Vec<f64>,
    ) -> Evaluation {
        let e = moment.evaluate(&self.plant);
        let outputs = simulation.outputs_of(&e);
        let pose = std::array::from_fn(|k| moment.y[k]);
        let shown_pose = self.plant.at(moment.time).pose_sensor().shown(&pose);
        out.clear();
        for channel in channels {
            out.push(match *channel {
                Channel::Pose(k) => shown_pose[k],
                Channel::CableLength(i) => outputs.cable_length[i],
                Channel::UnstretchedLength(i) => outputs.unstretched_length[i],
                Channel::Tension(i) => outputs.tension[i],
            });
        }
        e
    }

    /// Start states of a trial from its beginning: pose by measurement or forward kinematics, cables in balance with their winches; they
    /// move with the platform where its pose is measured.
    pub(crate) fn first_states(&self, trial: &Trial) -> Vec<f64> {
        let moves = first_motion(trial);
        let guess = moves.map_or_else(|| self.first_pose(trial), |(pose, _)| pose);
        let start = Start {
            time: trial.time[0],
            initialization: Initialization::FromWinchForces,
            pose: guess,
            inputs: trial.inputs[0],
            ..Start::pulling(self.plant.cables())
        };
        // A pose that no start accepts (outside the anchors) can only be an outlier: begin at the centre.
        let mut centred = start;
        centred.pose = [0.0; 3];
        let mut y = start
            .states(&self.plant)
            .or_else(|_| centred.states(&self.plant))
            .unwrap_or_else(|_| vec![0.0; self.states()]);
        if let Some((_, twist)) = moves {
            y[3..6].copy_from_slice(&twist);
            let pose = [y[0], y[1], y[2]];
            for (i, cable) in cdpr::kinematics::cables(self.plant.geometry(), &pose, &twist).iter().enumerate() {
                if let Some(rate) = self.plant.rate_index(i) {
                    y[rate] = cable.speed;
                }
            }
        }
        for (j, channel) in trial.channels.iter().enumerate() {
            if let Channel::UnstretchedLength(i) = channel
                && let Some(at) = self.plant.unstretched_index(*i)
                && trial.measured[0][j].is_finite()
            {
                y[at] = trial.measured[0][j];
            }
        }
        y
    }

    fn first_pose(&self, trial: &Trial) -> [f64; 3] {
        let fifth_second = 1 + (0.2 / trial.interval().max(1e-6)) as usize;
        let mean = |wanted: Channel| {
            let j = trial.channels.iter().position(|c| *c == wanted)?;
            let window = trial.len().min(fifth_second.max(2 * trial.stride(j)));
            let value = crate::data::clean::median(trial.measured[..window].iter().map(|row| row[j]).collect());
            value.is_finite().then_some(value)
        };
        let mut pose: [Option<f64>; 3] = std::array::from_fn(|k| mean(Channel::Pose(k)));
        if pose.iter().any(Option::is_none) {
            let lengths = self.lengths(mean, &trial.inputs[0]);
            let known = pose.map(|p| p.unwrap_or(0.0));
            let found = gauss_newton_pose(self.plant.geometry(), &lengths, &pose, known);
            pose = found.map(Some);
        }
        pose.map(|p| p.unwrap_or(0.0))
    }

    /// Lengths from anchor to platform by what the sensors show, less what they show too much; a paid-out length stretches
    /// under its winch force.
    pub(crate) fn lengths(&self, shown: impl Fn(Channel) -> Option<f64>, inputs: &Inputs) -> Vec<Option<f64>> {
        let of_cable = |i: usize| {
            let [chord, paid_out] = self.plant.length_sensor_biases(i);
            shown(Channel::CableLength(i)).map(|length| length - chord).or_else(|| {
                let length = shown(Channel::UnstretchedLength(i))? - paid_out;
                let strain = inputs.winch_force[i].max(0.0) / self.plant.data().cables[i].axial_stiffness;
                Some(if self.plant.unstretched_index(i).is_some() { length * (1.0 + strain) } else { length })
            })
        };
        (0..self.plant.cables()).map(of_cable).collect()
    }
}

/// Pose and twist in which a trial begins, by straight lines through the first measurements, where all of the pose is measured.
fn first_motion(trial: &Trial) -> Option<([f64; 3], [f64; 3])> {
    let (mut pose, mut twist) = ([0.0; 3], [0.0; 3]);
    for axis in 0..3 {
        let j = trial.channels.iter().position(|c| *c == Channel::Pose(axis))?;
        let end = trial.time.partition_point(|time| *time - trial.time[0] <= BEGINNING);
        let beginning = trial.part(0..end.max(FEWEST).min(trial.len()), String::new());
        let rows = 0..(2 * straight(&beginning, j) + 1).min(trial.len());
        (pose[axis], twist[axis]) = line(trial, j, rows, 0)?;
    }
    Some((pose, twist))
}

/// The pose that fits the lengths and coordinates known, in the least squares sense.
pub(crate) fn gauss_newton_pose(
    geometry: &cdpr::geometry::Geometry,
    lengths: &[Option<f64>],
    known: &[Option<f64>; 3],
    guess: [f64; 3],
) -> [f64; 3] {
    use nalgebra::{Matrix3, Vector3};
    let mut pose = guess;
    // So far a step may lead out of a guess that is far off.
    let farthest = geometry.size() / 18.0;
    for _ in 0..30 {
        let rows = cdpr::kinematics::jacobian(geometry, &pose);
        let model = cdpr::kinematics::cable_lengths(geometry, &pose);
        let mut normal = Matrix3::identity() * 1e-9;
        let mut right = Vector3::zeros();
        for (i, length) in lengths.iter().enumerate() {
            if let Some(length) = length {
                let row = rows.row(i).transpose();
                normal += row * row.transpose();
                right += row * (length - model[i]);
            }
        }
        for (k, value) in known.iter().enumerate() {
            if let Some(value) = value {
                normal[(k, k)] += 1e4;
                right[k] += 1e4 * (value - pose[k]);
            }
        }
        let Some(step) = normal.cholesky().map(|c| c.solve(&right)) else { break };
        for k in 0..3 {
            pose[k] += step[k].clamp(-farthest, farthest);
        }
        if step.norm() < 1e-9 {
            break;
        }
    }
    pose
}

/// Inputs of a sample with latent disturbances applied.
pub(crate) fn disturb(simulation: &mut Simulation, inputs: &Inputs, latents: &[f64]) {
    let mut inputs = *inputs;
    let (wrench, pulls) = latents.split_at(WRENCH);
    for (slot, latent) in inputs.disturbance.iter_mut().zip(wrench) {
        *slot += latent;
    }
    simulation.set_inputs(inputs);
    simulation.set_winch_disturbance(PerCable::from_fn(pulls.len(), |i| pulls[i]));
}

#[cfg(test)]
mod tests {

    use super::*;
    use crate::data::recording::{Bench, record_on};

    /// The recording repeated in simulation, sample by sample, against one a thousand times finer: a tolerance in metres and
    /// radians that is far below the noise of a large robot is not that of a small one.
    #[test]
    fn a_small_robot_is_simulated_as_exactly_as_its_sensors_ask_for() {
        let bench = Bench::laboratory();
        let trial = record_on(&bench, &[], 1.0, 3);
        let model = Model { parameters: bench.parameters, ..Model::default() };
        let examined = Examined::new(&model).unwrap();
        let start = examined.first_states(&trial);
        let run = |tolerance: f64| {
            let (time, inputs) = (trial.time[0], trial.inputs[0]);
            let mut simulation =
                Simulation::from_states(examined.plant.clone(), time, start.clone(), inputs, tolerance);
            let mut states = Vec::new();
            for (time, inputs) in trial.time.iter().zip(&trial.inputs) {
                simulation.advance_to(*time).unwrap();
                simulation.set_inputs(*inputs);
                states.push(simulation.states().to_vec());
            }
            states
        };
        let (own, exact) = (run(examined.tolerance), run(1e-3 * examined.tolerance));
        for axis in 0..3 {
            let errors = own.iter().zip(&exact).map(|(a, b)| (a[axis] - b[axis]).abs());
            let worst = errors.fold(0.0, f64::max);
            // A two-hundredth of the noise (m, m, rad).
            assert!(worst < 1e-6, "axis {axis}: {worst}");
        }
    }
}
