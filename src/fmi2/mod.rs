//! The plant as an FMI 2.0 co-simulation model: [`CablePlatform`].
//!
//! One table says what there is; every file here reads it. What is worth knowing beyond the standard:
//!
//! - The model is data: `resources/model.toml` is read when an instance is made.
//! - Outputs show what the sensors show. Setting `x` or `unstretched_length[1]` sets what they show at the start; the
//!   true value follows by taking the sensor's bias and scale off.
//! - `unstretched_length` and its rate are variables whatever the cable model. In rigid cables they follow from the
//!   pose; then their starts are not used, and a directional derivative with respect to them is zero.
//! - A directional derivative with respect to an output that is a state is with respect to the state as the sensor
//!   shows it. What a dead time holds back does not depend on present states and inputs: with `pose_sensor_delay` the
//!   outputs `x`, `y`, `phi`, with `winch_delay` everything with respect to that winch's force. `der(x)` is the present
//!   rate all the same.
//! - In Initialization Mode a directional derivative says how an initial unknown follows the start values, parameters,
//!   inputs and start time that can be set there, through whatever `initialization` computes. It is by differences, to
//!   about eight digits; once initialised they are exact.
//! - `relative_tolerance` follows the experiment's tolerance until it is changed.

mod dependencies;
mod derivatives;
mod initial_derivatives;
mod now;
mod parameters;
mod role;
mod saved;
mod shared;
mod table;
#[cfg(test)]
mod tests;
mod units;
mod values;

use std::fs;
use std::io::ErrorKind;
use std::path::Path;
use std::sync::Arc;

use fmi2_export::description::ModelDescription;
use fmi2_export::{Experiment, LogEntry, Model as FmiModel, ModelError, Status, StepError, Value};

use crate::dynamics::Inputs;
use crate::integrator::Solver;
use crate::model_file::Model;
use crate::parameters::{CableModel, Initialization};
use crate::per_cable::PerCable;
use crate::plant::Plant;
use crate::simulation::{Simulation, Tangent};
use now::Now;
use role::{Role, State};
use shared::Shared;
use table::{LOG_EVENTS, LOG_SOLVER};

/// Name of the model and of the binary.
const IDENTIFIER: &str = "CablePlatform";

/// The file in `resources` that holds the model.
const MODEL_FILE: &str = "model.toml";

/// Tolerances that the integrator works with.
const TOLERANCES: (f64, f64) = (1e-13, 1e-3);

/// Communication steps between two lines of statistics in the log.
const STEPS_PER_STATISTICS: u32 = 1000;

/// Changes between slack and taut that are logged, lest a chattering cable fill the host's log.
const LOGGED_EVENTS: u32 = 100;

/// The plant as an FMI model. See the module's documentation.
pub struct CablePlatform {
    shared: Arc<Shared>,
    settings: Settings,
    /// Room for those of a saved state before they are believed.
    spare_settings: Option<Box<Settings>>,
    phase: Phase,
    /// Running: the simulation. Before: a trial from the start values as they stand, made when it is asked for.
    simulation: Option<Simulation>,
    /// What was asked for of the present instant; it is forgotten once something has changed.
    now: Now,
    /// Derivatives at this instant, along the direction last asked for.
    tangent: Option<Box<Tangent>>,
    log: Vec<LogEntry>,
    steps: u32,
    events: u32,
    /// Slack cables, as last logged.
    slack: PerCable<bool>,
    /// A cable through the platform has been told of.
    blocked: bool,
    /// So has stiffness.
    stiff: bool,
}

/// What the host can set before the simulation runs.
#[derive(Clone, Debug, PartialEq)]
struct Settings {
    model: Model,
    /// Slopes of the inputs, until the simulation runs.
    slopes: Inputs,
}

impl Settings {
    fn new(model: &Model) -> Self {
        Self { model: model.clone(), slopes: Inputs::none(model.parameters.cables()) }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Phase {
    Instantiated,
    Initialising(Experiment),
    /// With the tolerance that the integrator was made with.
    Running {
        tolerance: f64,
    },
}

impl CablePlatform {
    /// An instance of `model`.
    ///
    /// # Errors
    /// The plant cannot be built, or a start value is out of its bounds.
    pub fn new(model: Model) -> Result<Self, ModelError> {
        let plant = model.build().map_err(|e| ModelError::new(e.to_string()))?;
        Shared::new(model, plant).map(|shared| Self::of(Arc::new(shared)))
    }

    fn of(shared: Arc<Shared>) -> Self {
        Self {
            settings: Settings::new(&shared.model),
            spare_settings: None,
            phase: Phase::Instantiated,
            simulation: None,
            now: Now::default(),
            tangent: None,
            log: Vec::new(),
            steps: 0,
            events: 0,
            slack: PerCable::filled(shared.plant.cables(), false),
            blocked: false,
            stiff: false,
            shared,
        }
    }

    fn note(&mut self, category: &'static str, status: Status, message: String) {
        self.log.push(LogEntry { category: category.into(), status, message });
    }

    fn warn(&mut self, message: String) {
        self.note("logStatusWarning", Status::Warning, message);
    }

    fn running(&mut self) -> Result<&mut Simulation, ModelError> {
        match (&self.phase, &mut self.simulation) {
            (Phase::Running { .. }, Some(simulation)) => Ok(simulation),
            _ => Err(ModelError::new("the simulation has not been initialised")),
        }
    }

    /// The model to be simulated, its tolerance and start time settled.
    fn settled(&self, experiment: Experiment) -> Model {
        let mut model = self.settings.model.clone();
        model.start.time = experiment.start_time;
        if let Some(tolerance) = self.asked_tolerance(experiment) {
            model.relative_tolerance = tolerance.clamp(TOLERANCES.0, TOLERANCES.1);
        }
        model
    }

    /// The experiment's tolerance, unless the host changed the parameter: hosts pass on a default tolerance even where
    /// their user set the parameter.
    fn asked_tolerance(&self, experiment: Experiment) -> Option<f64> {
        let untouched = self.settings.model.relative_tolerance == self.shared.model.relative_tolerance;
        experiment.tolerance.filter(|_| untouched)
    }

    /// The plant of `model`, whose every value is checked.
    fn checked(&self, model: &Model) -> Result<Arc<Plant>, ModelError> {
        let failed = |error: &dyn std::fmt::Display| ModelError::new(error.to_string());
        model.check_values().map_err(|e| failed(&e))?;
        let plant = self.shared.plant_of(model).map_err(|e| failed(&e))?;
        model.check_start(&plant).map_err(|e| failed(&e))?;
        Ok(plant)
    }

    /// Whether the host set other start values for the unstretched lengths or their rates than the table's.
    fn lengths_were_set(&self) -> bool {
        let (now, then) = (&self.settings.model.start, &self.shared.model.start);
        now.unstretched_length != then.unstretched_length || now.unstretched_length_rate != then.unstretched_length_rate
    }

    /// Refuses parameters under which effects have other states than those that the description lists.
    fn same_states(&self, simulation: &Simulation) -> Result<(), ModelError> {
        let (listed, found) = (self.shared.plant.states_of_effects(), simulation.plant().states_of_effects());
        match (0..listed.len().max(found.len())).find(|k| listed.get(*k) != found.get(*k)) {
            None => Ok(()),
            Some(k) => {
                let place = listed.get(k).or(found.get(k)).expect("one of the two has it");
                let effect = &self.shared.model.effects[place.effect];
                Err(ModelError::new(format!(
                    "effect `{}` on cable {} has a state or none as it was packed; a parameter cannot change that \
                     (`presliding_stiffness` from or to 0)",
                    effect.id,
                    place.cable + 1
                )))
            }
        }
    }

    /// The simulation now; before the run a trial from the start values as they stand.
    fn present(&mut self) -> Result<&Simulation, ModelError> {
        if self.simulation.is_none() {
            let model = match self.phase {
                Phase::Initialising(experiment) => self.settled(experiment),
                _ => self.settings.model.clone(),
            };
            let failed = |error: &dyn std::fmt::Display| ModelError::new(error.to_string());
            let plant = self.shared.plant_of(&model).map_err(|e| failed(&e))?;
            let simulation = model.simulation_of(plant).map_err(|e| failed(&e))?;
            self.same_states(&simulation)?;
            self.simulation = Some(simulation);
        }
        Ok(self.simulation.as_ref().expect("it has just been made"))
    }

    /// What was computed for the instant before is of no use.
    fn forget_instant(&mut self) {
        self.now.forget();
        self.tangent = None;
    }

    /// Something changed that values follow from.
    fn changed(&mut self) {
        self.forget_instant();
        if !matches!(self.phase, Phase::Running { .. }) {
            self.simulation = None;
        }
    }

    fn log_slack(&mut self, after: PerCable<bool>, time: f64) {
        let before = std::mem::replace(&mut self.slack, after);
        for i in (0..after.len()).filter(|i| before[*i] != after[*i]) {
            if self.events == 0 && after[i] && self.settings.model.parameters.cable_model == CableModel::Rigid {
                self.warn(format!(
                    "cable {} went slack before t = {time} s; a rigid cable that becomes taut again takes up no speed",
                    i + 1
                ));
            }
            self.events += 1;
            if self.events <= LOGGED_EVENTS {
                let what = if after[i] { "slack" } else { "taut" };
                let last = if self.events == LOGGED_EVENTS { "; later changes are not logged" } else { "" };
                self.note(LOG_EVENTS, Status::Ok, format!("cable {} is {what} at t = {time} s{last}", i + 1));
            }
        }
    }

    fn log_stiffness(&mut self, since: f64) {
        let found = format!("the model is stiff, as found at t = {since} s");
        match self.settings.model.solver {
            Solver::DormandPrince => self.warn(format!(
                "{found}: the explicit solver takes steps as short as its fastest motion asks for; `solver` auto or \
                 radau does not"
            )),
            _ => self.note(LOG_SOLVER, Status::Ok, format!("{found}; the implicit solver goes on from there")),
        }
    }

    fn log_statistics(&mut self) {
        if let Some(simulation) = &self.simulation {
            let (time, s) = (simulation.time(), simulation.statistics());
            let text = format!(
                "t = {time} s: {} steps, {} rejected, {} given up, {} Newton iterations, {} evaluations, {} Jacobians, \
                 {} factorisations, {} switches",
                s.steps,
                s.rejections,
                s.newton_failures,
                s.newton_iterations,
                s.evaluations,
                s.jacobians,
                s.factorisations,
                s.switches
            );
            self.note(LOG_SOLVER, Status::Ok, text);
        }
    }
}

impl FmiModel for CablePlatform {
    const MODEL_IDENTIFIER: &'static str = IDENTIFIER;

    /// The model of `resources/model.toml`; without such a file, or without resources, the default model.
    fn instantiate(resources: Option<&Path>) -> Result<Self, ModelError> {
        let Some(folder) = resources else { return Shared::of(None).map(Self::of) };
        let path = folder.join(MODEL_FILE);
        match fs::read_to_string(&path) {
            Ok(text) => {
                let shared = Shared::of(Some(text));
                shared.map(Self::of).map_err(|e| ModelError::new(format!("{}: {}", path.display(), e.message)))
            }
            Err(error) if error.kind() == ErrorKind::NotFound && folder.is_dir() => {
                let mut platform = Shared::of(None).map(Self::of)?;
                platform.warn(format!("{} is missing; this is the default model", path.display()));
                Ok(platform)
            }
            Err(error) => Err(ModelError::new(format!("{}: {error}", path.display()))),
        }
    }

    fn description(&self) -> &Arc<ModelDescription> {
        &self.shared.description
    }

    fn get(&mut self, index: usize) -> Result<Value, ModelError> {
        self.value(self.shared.roles[index])
    }

    fn set(&mut self, index: usize, value: Value) -> Result<(), ModelError> {
        self.set_value(self.shared.roles[index], &value)
    }

    fn get_reals(&mut self, indices: &[usize], values: &mut [f64]) -> Result<(), (usize, ModelError)> {
        self.real_values(indices, values)
    }

    fn set_reals(&mut self, assignments: &[(usize, f64)]) -> Result<(), (usize, ModelError)> {
        self.set_real_values(assignments)
    }

    fn enter_initialisation(&mut self, experiment: Experiment) -> Result<(), ModelError> {
        self.phase = Phase::Initialising(experiment);
        self.changed();
        Ok(())
    }

    fn initialise(&mut self, experiment: Experiment) -> Result<(), ModelError> {
        let failed = |error: &dyn std::fmt::Display| ModelError::new(error.to_string());
        let model = self.settled(experiment);
        let plant = self.checked(&model)?;
        let mut simulation = model.simulation_of(plant).map_err(|e| failed(&e))?;
        self.same_states(&simulation)?;
        simulation.set_inputs_with_slopes(model.start.inputs, self.settings.slopes);
        let slack = simulation.slack();
        let time = simulation.time();
        self.phase = Phase::Running { tolerance: model.relative_tolerance };
        self.simulation = Some(simulation);
        self.forget_instant();
        if let Some(wanted) = self.asked_tolerance(experiment)
            && wanted < TOLERANCES.0
        {
            self.warn(format!("the tolerance {wanted} is below what rounding allows; {} is used", TOLERANCES.0));
        }
        if self.lengths_were_set() && model.start.initialization != Initialization::FromStates {
            self.warn(
                "unstretched lengths were set, but are computed: `initialization` is not `from_states`".to_owned(),
            );
        }
        self.log_slack(slack, time);
        Ok(())
    }

    fn step(&mut self, time: f64, step: f64) -> Result<(), StepError> {
        let stopped = |reached: f64, message: String, terminate: bool| StepError { reached, message, terminate };
        let told = self.blocked;
        let simulation = self.running().map_err(|e| stopped(time, e.message, false))?;
        let end = time + step;
        let advanced = simulation.advance_to(end);
        let (reached, after) = (simulation.time(), simulation.slack());
        let stiff = simulation.stiff_since();
        let y = simulation.states();
        let pose = [y[0], y[1], y[2]];
        let plant = simulation.plant();
        let inside = plant.holds(&pose);
        let blocked = if told { None } else { plant.blocked_cable(&pose) };
        self.forget_instant();
        self.steps += 1;
        self.log_slack(after, reached);
        if let Some(i) = blocked {
            self.blocked = true;
            self.warn(format!(
                "cable {} runs through the platform from t = {reached} s on, which the equations take no notice of",
                i + 1
            ));
        }
        if let Some(since) = stiff.filter(|_| !self.stiff) {
            self.stiff = true;
            self.log_stiffness(since);
        }
        if advanced.is_err() || self.steps.is_multiple_of(STEPS_PER_STATISTICS) {
            self.log_statistics();
        }
        advanced.map_err(|error| stopped(reached, error.to_string(), false))?;
        if !inside {
            return Err(stopped(reached, "the platform has left the space between the anchors".to_owned(), true));
        }
        Ok(())
    }

    fn set_input_derivative(&mut self, index: usize, order: u32, value: f64) -> Result<(), ModelError> {
        if order != 1 {
            return Err(ModelError::new(format!("inputs have derivatives of order 1, not {order}")));
        }
        self.set_slope(self.shared.roles[index], value)
    }

    fn output_derivative(&mut self, index: usize, order: u32) -> Result<f64, ModelError> {
        if order != 1 {
            return Err(ModelError::new(format!("outputs have derivatives of order 1, not {order}")));
        }
        self.rate(self.shared.roles[index])
    }

    fn directional_derivative(
        &mut self,
        unknowns: &[usize],
        knowns: &[usize],
        seed: &[f64],
        out: &mut [f64],
    ) -> Result<(), ModelError> {
        match self.phase {
            Phase::Initialising(experiment) => self.along_starts(experiment, unknowns, knowns, seed, out),
            _ => self.along(unknowns, knowns, seed, out),
        }
    }

    fn save(&self, out: &mut Vec<u8>) {
        self.write_state(out);
    }

    fn restore(&mut self, bytes: &[u8]) -> Result<(), ModelError> {
        self.read_state(bytes)
    }

    fn reset(&mut self) {
        self.settings = Settings::new(&self.shared.model);
        self.phase = Phase::Instantiated;
        self.simulation = None;
        self.forget_instant();
        self.log.clear();
        (self.steps, self.events, self.slack) = (0, 0, self.slack.map(|_| false));
        (self.blocked, self.stiff) = (false, false);
    }

    fn take_log(&mut self) -> Vec<LogEntry> {
        std::mem::take(&mut self.log)
    }
}
