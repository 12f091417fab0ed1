//! The paper's simulations.

use std::sync::Arc;

use crate::CABLES;
use cdpr::dynamics::Inputs;
use cdpr::effect::EffectSpec;
use cdpr::inverse::distribution::{Bounds, Distribution, Objective};
use cdpr::inverse::{Ends, Instant, InverseDynamics, Motion, Samples, SplineTrajectory, Trajectory};
use cdpr::kinematics;
use cdpr::parameters::{CableModel, Initialization, Parameters};
use cdpr::per_cable::PerCable;
use cdpr::plant::Plant;
use cdpr::simulation::{Outputs, Simulation, Start};

use crate::PaperError;
use crate::mismatch::Mismatch;

/// Winch force of the paper's simulations (N).
pub(crate) const FORCE: f64 = 1e3;
/// Start of Fig. 8.
pub(crate) const RELEASE: [f64; 3] = [0.1; 3];
/// Winch forces of Fig. 9 (N).
const PULL: [f64; CABLES] = [FORCE, FORCE, 0.0, 0.0];
/// Time of one sample (s).
const STEP: f64 = 0.1;
/// The same in Fig. 9.
const PULL_STEP: f64 = 0.02;
/// The same in the inverse dynamics simulation.
const INVERSE_STEP: f64 = 0.01;
/// Relative tolerance of every simulation.
const TOLERANCE: f64 = 1e-10;

/// The cross-section area.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Area {
    /// 4e-4 m²: a rope of 538 kg/m³.
    Physical,
    /// 4e-4 cm², as printed in Table II.
    Printed,
}

impl Area {
    pub(crate) fn parameters(self, cable_model: CableModel) -> Parameters {
        let base = match self {
            Self::Physical => Parameters::default(),
            Self::Printed => Parameters::as_printed(),
        };
        Parameters { cable_model, ..base }
    }

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Physical => "A = 4e-4 m²",
            Self::Printed => "A = 4e-4 cm² as printed",
        }
    }
}

/// A simulation's samples.
#[derive(Clone, Debug, Default)]
pub(crate) struct Series {
    pub(crate) time: Vec<f64>,
    pub(crate) pose: Vec<[f64; 3]>,
    pub(crate) length: Vec<PerCable<f64>>,
    pub(crate) unstretched: Vec<PerCable<f64>>,
    pub(crate) tension: Vec<PerCable<f64>>,
}

impl Series {
    fn push(&mut self, time: f64, o: &Outputs) {
        self.time.push(time);
        self.pose.push(o.pose);
        self.length.push(o.cable_length);
        self.unstretched.push(o.unstretched_length);
        self.tension.push(o.tension);
    }

    /// Strain of cable `i` at every sample.
    pub(crate) fn strain(&self, i: usize) -> impl Iterator<Item = f64> + '_ {
        self.length.iter().zip(&self.unstretched).map(move |(l, u)| (l[i] - u[i]) / u[i])
    }

    pub(crate) fn coordinate(&self, k: usize) -> impl Iterator<Item = f64> + '_ {
        self.pose.iter().map(move |p| p[k])
    }

    /// Largest deviation of the poses (m, rad) from another run's, over the samples that both have.
    pub(crate) fn deviation(&self, other: &Self) -> f64 {
        let pairs = self.pose.iter().zip(&other.pose);
        pairs.flat_map(|(a, b)| (0..3).map(|k| (a[k] - b[k]).abs())).fold(0.0, f64::max)
    }

    /// First time (s) at which a coordinate passes `level` from above, between samples by a straight line.
    pub(crate) fn first_below(&self, k: usize, level: f64) -> Option<f64> {
        let i = self.pose.iter().position(|p| p[k] < level)?;
        if i == 0 {
            return Some(self.time[0]);
        }
        let (a, b) = (self.pose[i - 1][k], self.pose[i][k]);
        Some(self.time[i - 1] + (self.time[i] - self.time[i - 1]) * (a - level) / (a - b))
    }
}

fn simulation(parameters: Parameters, start: &Start) -> Result<Simulation, PaperError> {
    simulation_with(parameters, Vec::new(), start)
}

fn simulation_with(parameters: Parameters, effects: Vec<EffectSpec>, start: &Start) -> Result<Simulation, PaperError> {
    let plant = Arc::new(Plant::new(parameters, effects).map_err(PaperError::model)?);
    Simulation::new(plant, start, TOLERANCE).map_err(PaperError::model)
}

/// Runs until `stop` (s), or until the platform is where no cable robot is: outside, or with a cable through it.
fn run(mut simulation: Simulation, stop: f64, step: f64) -> Result<Series, PaperError> {
    let mut series = Series::default();
    series.push(0.0, &simulation.outputs());
    for k in 1..=(stop / step).round() as usize {
        simulation.advance(step).map_err(PaperError::model)?;
        let outputs = simulation.outputs();
        if simulation.plant().geometry().check_pose(&outputs.pose).is_err() {
            break;
        }
        series.push(k as f64 * step, &outputs);
    }
    Ok(series)
}

/// Fig. 8: released at rest under equal forces, every spring carrying its force.
pub(crate) fn release(area: Area, cable_model: CableModel, stop: f64) -> Result<Series, PaperError> {
    let inputs = Inputs { winch_force: [FORCE; CABLES].into(), disturbance: [0.0; 3] };
    let start = Start { pose: RELEASE, inputs, ..Start::default() };
    run(simulation(area.parameters(cable_model), &start)?, stop, STEP)
}

/// Fig. 8 with cables that hang in catenaries, by their weight (N/m).
pub(crate) fn hanging_release(weight: f64, stop: f64) -> Result<Series, PaperError> {
    let inputs = Inputs { winch_force: [FORCE; CABLES].into(), disturbance: [0.0; 3] };
    let start = Start { pose: RELEASE, inputs, ..Start::default() };
    let catenary = EffectSpec::new("cable_catenary", None, &[weight]).map_err(PaperError::model)?;
    let parameters = Area::Physical.parameters(CableModel::LumpedMass);
    run(simulation_with(parameters, vec![catenary], &start)?, stop, STEP)
}

/// Fig. 8 with the moment's sign turned round.
pub(crate) fn mismatched_release(area: Area, cable_model: CableModel, stop: f64) -> Result<Series, PaperError> {
    mismatched(area, cable_model, (RELEASE, FORCE), [FORCE; CABLES], (STEP, stop))
}

/// Fig. 9 with the moment's sign turned round.
pub(crate) fn mismatched_pull(area: Area, cable_model: CableModel, stop: f64) -> Result<Series, PaperError> {
    mismatched(area, cable_model, ([0.0; 3], 0.0), PULL, (PULL_STEP, stop))
}

/// The model with the moment's sign turned round, at rest at a pose with springs that carry a force, then under `force`.
fn mismatched(
    area: Area,
    cable_model: CableModel,
    (pose, carried): ([f64; 3], f64),
    force: [f64; CABLES],
    (step, stop): (f64, f64),
) -> Result<Series, PaperError> {
    let parameters = area.parameters(cable_model);
    let geometry = cdpr::geometry::Geometry::new(&parameters);
    let (stiffness, damping) = (parameters.axial_stiffness(), parameters.cable_damping);
    let model = Mismatch::new(parameters);
    let states = model.run(&model.start(pose, carried), &force, step, stop).map_err(PaperError::model)?;
    let mut series = Series::default();
    for (k, y) in states.iter().enumerate() {
        let (pose, twist) = ([y[0], y[1], y[2]], [y[3], y[4], y[5]]);
        let cables = kinematics::cables(&geometry, &pose, &twist);
        series.time.push(k as f64 * step);
        series.pose.push(pose);
        series.length.push(cables.map(|c| c.length));
        let elastic = cable_model != CableModel::Rigid;
        let unstretched = PerCable::from_fn(CABLES, |i| if elastic { y[6 + 2 * i] } else { cables[i].length });
        series.unstretched.push(unstretched);
        series.tension.push(PerCable::from_fn(CABLES, |i| {
            if !elastic {
                return f64::NAN;
            }
            let l = unstretched[i];
            (stiffness * (cables[i].length - l) / l + damping / l * (cables[i].speed - y[7 + 2 * i])).max(0.0)
        }));
    }
    Ok(series)
}

/// Fig. 9: from rest at the centre with unloaded cables, two neighbouring winches pull.
pub(crate) fn pull_one_way(area: Area, cable_model: CableModel, stop: f64) -> Result<Series, PaperError> {
    let parameters = area.parameters(cable_model);
    let geometry = cdpr::geometry::Geometry::new(&parameters);
    let start = Start {
        initialization: Initialization::FromStates,
        unstretched_length: kinematics::cable_lengths(&geometry, &[0.0; 3]),
        inputs: Inputs { winch_force: PULL.into(), disturbance: [0.0; 3] },
        ..Start::default()
    };
    run(simulation(parameters, &start)?, stop, PULL_STEP)
}

/// The inverse dynamics simulation and the forward simulation under its forces.
pub(crate) struct Inverse {
    pub(crate) instants: Vec<Instant>,
    /// Largest deviation (m, rad) of the forward simulation from the trajectory.
    pub(crate) deviation: f64,
}

/// A motion through samples under a gust in closed form.
struct Gusty {
    motion: SplineTrajectory,
}

/// Amplitudes (N, N m) and frequencies (rad/s) of the gust along x, y and φ.
const GUST: [(f64, f64); 3] = [(100.0, 0.5), (60.0, 0.37), (400.0, 0.23)];

impl Trajectory for Gusty {
    fn span(&self) -> [f64; 2] {
        self.motion.span()
    }

    fn motion(&self, time: f64) -> Motion {
        let gust = GUST.map(|(amplitude, frequency)| {
            std::array::from_fn(|order: usize| {
                let phase = frequency * time + std::f64::consts::FRAC_PI_2 * order as f64;
                amplitude * frequency.powi(order as i32) * phase.sin()
            })
        });
        Motion { disturbance: gust, ..self.motion.motion(time) }
    }
}

/// 30 m in 60 s, from rest to rest.
fn motion() -> Result<Gusty, PaperError> {
    let (steps, duration) = (120, 60.0);
    let mut samples = Samples::default();
    for k in 0..=steps {
        let s = f64::from(k) / f64::from(steps);
        // Of degree 9, at rest to order 4 at both ends.
        let p = s.powi(5) * (126.0 + s * (-420.0 + s * (540.0 + s * (-315.0 + 70.0 * s))));
        samples.time.push(duration * s);
        samples.pose.push([30.0 * p, 15.0 * p, 0.1 * p]);
    }
    let motion = SplineTrajectory::new(&samples, Ends::Rest).map_err(PaperError::model)?;
    Ok(Gusty { motion })
}

/// How tensions are chosen: between 0.5 and 2.5 kN, about their mean.
fn tensions() -> Result<Distribution, PaperError> {
    let bounds = Bounds::new(500.0, 2500.0).map_err(PaperError::model)?;
    Ok(Distribution { objective: Objective::MidTension, bounds })
}

fn inverse_times() -> Vec<f64> {
    (0..=6000).map(|k| INVERSE_STEP * f64::from(k)).collect()
}

/// Winch forces along [`motion`], and a forward simulation under them.
pub(crate) fn inverse(area: Area, cable_model: CableModel) -> Result<Inverse, PaperError> {
    let plant = Arc::new(Plant::new(area.parameters(cable_model), Vec::new()).map_err(PaperError::model)?);
    let (trajectory, distribution) = (motion()?, tensions()?);
    let problem = InverseDynamics::new(plant.clone(), &trajectory, &distribution).map_err(PaperError::model)?;
    let instants = problem.run(&inverse_times(), TOLERANCE).map_err(PaperError::model)?;
    let deviation = forward(plant, &instants, &trajectory)?;
    Ok(Inverse { instants, deviation })
}

/// Largest deviation (m, rad) from the trajectory under these forces, held linear between instants. It is measured until
/// the platform is where no cable robot is.
fn forward(plant: Arc<Plant>, instants: &[Instant], trajectory: &Gusty) -> Result<f64, PaperError> {
    let first = &instants[0];
    let inputs = |instant: &Instant| Inputs {
        winch_force: instant.winch_force,
        disturbance: trajectory.motion(instant.time).disturbance.map(|d| d[0]),
    };
    let mut forward = Simulation::from_states(plant, 0.0, first.states.clone(), inputs(first), TOLERANCE);
    let mut deviation = 0.0_f64;
    for pair in instants.windows(2) {
        let (a, b) = (inputs(&pair[0]), inputs(&pair[1]));
        let slopes = Inputs {
            winch_force: PerCable::from_fn(CABLES, |i| (b.winch_force[i] - a.winch_force[i]) / INVERSE_STEP),
            disturbance: std::array::from_fn(|k| (b.disturbance[k] - a.disturbance[k]) / INVERSE_STEP),
        };
        forward.set_inputs_with_slopes(a, slopes);
        forward.advance(INVERSE_STEP).map_err(PaperError::model)?;
        let asked = trajectory.motion(pair[1].time).derivative(0);
        let reached = forward.outputs().pose;
        deviation = (0..3).map(|k| (reached[k] - asked[k]).abs()).fold(deviation, f64::max);
        if !forward.plant().geometry().holds(&reached) {
            break;
        }
    }
    Ok(deviation)
}

/// The motion with a torque added at each instant. Only its value counts: forces of rigid cables do not depend on its rate.
struct Turned {
    trajectory: Gusty,
    torque: Vec<f64>,
}

impl Trajectory for Turned {
    fn span(&self) -> [f64; 2] {
        self.trajectory.span()
    }

    fn motion(&self, time: f64) -> Motion {
        let mut motion = self.trajectory.motion(time);
        motion.disturbance[2][0] += self.torque[(time / INVERSE_STEP).round() as usize];
        motion
    }
}

/// How far (m, rad) rigid cables leave the trajectory under forces that were computed with the moment's sign turned round.
pub(crate) fn mismatched_inverse(consistent: &Inverse) -> Result<f64, PaperError> {
    let parameters = Area::Physical.parameters(CableModel::Rigid);
    let plant = Arc::new(Plant::new(parameters, Vec::new()).map_err(PaperError::model)?);
    // With the sign turned round tensions are thought to exert the opposite moment, so the opposite one is asked of them.
    let torque = consistent.instants.iter().map(|i| 2.0 * i.wrench[2]).collect();
    let (trajectory, distribution) = (Turned { trajectory: motion()?, torque }, tensions()?);
    let problem = InverseDynamics::new(plant.clone(), &trajectory, &distribution).map_err(PaperError::model)?;
    let instants = problem.run(&inverse_times(), TOLERANCE).map_err(PaperError::model)?;
    forward(plant, &instants, &trajectory.trajectory)
}
