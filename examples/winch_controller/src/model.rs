//! The controller as a model: samples at each step, holds in between.

use std::fs;
use std::io::ErrorKind;
use std::path::Path;
use std::sync::Arc;

use cdpr::model_file;
use cdpr::per_cable::PerCable;
use cdpr::winch::WinchCommand;
use fmi2_export::description::ModelDescription;
use fmi2_export::{Experiment, LogEntry, Model, ModelError, Status, StepError, Value};

use crate::control::{LowPass, Measurement, Pull, Robot, feedback};
use crate::reference::Motion;
use crate::settings::Settings;
use crate::table::{LOG_CATEGORY, Place, places, table};

/// The file in `resources` that holds the robot, the same as the plant's.
const MODEL_FILE: &str = "model.toml";

/// The controller: measured pose in, winch forces out.
#[derive(Debug)]
pub struct WinchController {
    table: Arc<ModelDescription>,
    places: Vec<Place>,
    /// What a reset goes back to.
    first: State,
    now: State,
    /// The robot of the settings, made when it is first needed.
    robot: Option<Robot>,
    log: Vec<LogEntry>,
}

/// Everything that a continuation needs.
#[derive(Clone, Debug, PartialEq)]
struct State {
    settings: Settings,
    measured: Measurement,
    low_pass: LowPass,
    start_time: f64,
    /// After initialisation the outputs change at samples only.
    running: bool,
    wanted: Motion,
    held: Pull,
}

impl State {
    /// Before anything was set.
    fn of(model: &model_file::Model) -> Self {
        let settings = Settings::of(model);
        let force = PerCable::filled(settings.robot.cables(), 0.0);
        Self {
            settings,
            measured: Measurement { pose: model.start.pose, twist: model.start.twist },
            low_pass: LowPass::default(),
            start_time: 0.0,
            running: false,
            wanted: Motion::default(),
            held: Pull { force, feasible: true },
        }
    }

    /// The robot that the settings tell of.
    fn robot(&self) -> Result<Robot, ModelError> {
        Robot::new(&self.settings.robot).map_err(|error| ModelError::new(error.to_string()))
    }

    /// The first sample: the feedback starts as it is, without a past to be smoothed with.
    fn start(&mut self, robot: &Robot) -> Result<(), ModelError> {
        self.settings.check().map_err(ModelError::new)?;
        let wanted = self.settings.reference.at(0.0);
        self.low_pass.value = feedback(&self.settings, &wanted, &self.measured);
        self.hold(robot, 0.0, wanted)
    }

    /// A sample at `time` (s), good for `step` (s).
    fn sample(&mut self, robot: &Robot, time: f64, step: f64) -> Result<(), ModelError> {
        let since_start = time - self.start_time;
        let wanted = self.settings.reference.at(since_start);
        let feedback = feedback(&self.settings, &wanted, &self.measured);
        self.low_pass.update(&feedback, step, self.settings.filter_time);
        self.hold(robot, since_start, wanted)
    }

    fn hold(&mut self, robot: &Robot, since_start: f64, wanted: Motion) -> Result<(), ModelError> {
        let acceleration = std::array::from_fn(|k| wanted.acceleration[k] + self.low_pass.value[k]);
        let bounds = self.settings.bounds_at(since_start);
        let held = robot.winch_forces(&bounds, &self.measured, &acceleration);
        self.held = held.map_err(|error| ModelError::new(error.to_string()))?;
        self.wanted = wanted;
        Ok(())
    }

    /// All numbers, in a fixed order.
    fn numbers(&mut self) -> Vec<&mut f64> {
        let Self { measured, low_pass, start_time, wanted, held, .. } = self;
        [start_time]
            .into_iter()
            .chain(&mut measured.pose)
            .chain(&mut measured.twist)
            .chain(&mut low_pass.value)
            .chain(&mut wanted.pose)
            .chain(&mut wanted.twist)
            .chain(&mut wanted.acceleration)
            .chain(&mut held.force)
            .collect()
    }

    fn to_bytes(&self, out: &mut Vec<u8>) {
        // The accessors give places to write to; a copy serves for reading.
        let mut copy = self.clone();
        for number in copy.numbers() {
            out.extend(number.to_le_bytes());
        }
        for entry in self.settings.entries() {
            out.extend(entry.place(&mut copy.settings).to_le_bytes());
        }
        out.extend([u8::from(self.running), u8::from(self.held.feasible)]);
    }

    /// What was saved of a controller of the same robot as this one.
    fn with_bytes(mut self, bytes: &[u8]) -> Result<Self, ModelError> {
        let entries = self.settings.entries();
        let count = self.numbers().len() + entries.len();
        let Some((numbers, &[running, feasible])) = bytes.split_at_checked(8 * count) else {
            let expected = 8 * count + 2;
            return Err(ModelError::new(format!("a saved controller has {expected} bytes, found {}", bytes.len())));
        };
        let mut numbers = numbers.chunks_exact(8).map(|b| f64::from_le_bytes(std::array::from_fn(|k| b[k])));
        for (place, number) in self.numbers().into_iter().zip(&mut numbers) {
            *place = number;
        }
        for (entry, number) in entries.iter().zip(numbers) {
            *entry.place(&mut self.settings) = number;
        }
        (self.running, self.held.feasible) = (running != 0, feasible != 0);
        Ok(self)
    }
}

impl WinchController {
    fn of(model: &model_file::Model) -> Result<Self, ModelError> {
        let command = model.parameters.winch.command;
        if command != WinchCommand::Force {
            return Err(ModelError::new(format!(
                "`command` of the winches is \"{}\"; this controller gives forces, expected \"force\"",
                command.name()
            )));
        }
        let first = State::of(model);
        let table = Arc::new(table(&first.settings, &first.measured));
        let places = places(&first.settings);
        Ok(Self { table, places, now: first.clone(), first, robot: None, log: Vec::new() })
    }

    /// The first sample, of what was set so far.
    fn start(&mut self) -> Result<(), ModelError> {
        let robot = match &self.robot {
            Some(robot) => robot,
            None => self.robot.insert(self.now.robot()?),
        };
        self.now.start(robot)
    }

    /// Tell the host when the bounds begin or cease to be in the way.
    fn tell_change(&mut self, feasible_before: bool) {
        let feasible = self.now.held.feasible;
        if feasible == feasible_before {
            return;
        }
        let (status, message) = if feasible {
            (Status::Ok, "the wanted wrench is within the bounds of the winch forces again")
        } else {
            (Status::Warning, "the wanted wrench is beyond the bounds of the winch forces")
        };
        self.log.push(LogEntry { category: LOG_CATEGORY.into(), status, message: message.into() });
    }
}

impl Model for WinchController {
    const MODEL_IDENTIFIER: &'static str = "WinchController";

    /// For the robot of `resources/model.toml`; without such a file, or without resources, for the default robot.
    fn instantiate(resources: Option<&Path>) -> Result<Self, ModelError> {
        let Some(folder) = resources else { return Self::of(&model_file::Model::default()) };
        let path = folder.join(MODEL_FILE);
        let failed = |error: &dyn std::fmt::Display| ModelError::new(format!("{}: {error}", path.display()));
        match fs::read_to_string(&path) {
            Ok(text) => {
                let model = model_file::Model::from_toml(&text).map_err(|error| failed(&error))?;
                Self::of(&model).map_err(|error| failed(&error.message))
            }
            Err(error) if error.kind() == ErrorKind::NotFound => Self::of(&model_file::Model::default()),
            Err(error) => Err(failed(&error)),
        }
    }

    fn description(&self) -> &Arc<ModelDescription> {
        &self.table
    }

    fn get(&mut self, index: usize) -> Result<Value, ModelError> {
        let place = self.places[index];
        let computed = matches!(place, Place::Force(_) | Place::Reference(_) | Place::Feasible);
        if computed && !self.now.running {
            self.start()?;
        }
        let now = &mut self.now;
        Ok(match place {
            Place::Pose(k) => Value::Real(now.measured.pose[k]),
            Place::Twist(k) => Value::Real(now.measured.twist[k]),
            Place::Force(i) => Value::Real(now.held.force[i]),
            Place::Reference(k) => Value::Real(now.wanted.pose[k]),
            Place::Feasible => Value::Boolean(now.held.feasible),
            Place::Setting(entry) => Value::Real(*entry.place(&mut now.settings)),
        })
    }

    fn set(&mut self, index: usize, value: Value) -> Result<(), ModelError> {
        let (place, now) = (self.places[index], &mut self.now);
        let Value::Real(number) = value else {
            let name = &self.table.variables[index].name;
            return Err(ModelError::new(format!("`{name}` is a real number, found {value:?}")));
        };
        match place {
            Place::Pose(k) => now.measured.pose[k] = number,
            Place::Twist(k) => now.measured.twist[k] = number,
            Place::Setting(entry) => {
                *entry.place(&mut now.settings) = number;
                if !entry.setting.tunable {
                    self.robot = None;
                }
            }
            Place::Force(_) | Place::Reference(_) | Place::Feasible => {
                return Err(ModelError::new("an output cannot be set"));
            }
        }
        Ok(())
    }

    fn initialise(&mut self, experiment: Experiment) -> Result<(), ModelError> {
        self.now.start_time = experiment.start_time;
        self.start()?;
        self.now.running = true;
        self.tell_change(true);
        Ok(())
    }

    fn step(&mut self, time: f64, step: f64) -> Result<(), StepError> {
        let failed = |error: ModelError| StepError { reached: time, message: error.message, terminate: false };
        let feasible_before = self.now.held.feasible;
        let robot = match &self.robot {
            Some(robot) => robot,
            None => self.robot.insert(self.now.robot().map_err(failed)?),
        };
        self.now.sample(robot, time, step).map_err(failed)?;
        self.tell_change(feasible_before);
        Ok(())
    }

    fn save(&self, out: &mut Vec<u8>) {
        self.now.to_bytes(out);
    }

    fn restore(&mut self, bytes: &[u8]) -> Result<(), ModelError> {
        self.now = self.first.clone().with_bytes(bytes)?;
        self.robot = None;
        Ok(())
    }

    fn reset(&mut self) {
        self.now = self.first.clone();
        self.robot = None;
        self.log.clear();
    }

    fn take_log(&mut self) -> Vec<LogEntry> {
        std::mem::take(&mut self.log)
    }
}
