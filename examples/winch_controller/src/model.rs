//! The controller as a model: samples at each step, holds in between.

use std::path::Path;
use std::sync::{Arc, LazyLock};

use fmi2_export::description::ModelDescription;
use fmi2_export::{Experiment, LogEntry, Model, ModelError, Status, StepError, Value};

use crate::control::{LowPass, Measurement, feedback, winch_forces};
use crate::reference::Motion;
use crate::settings::{SETTINGS, Settings};
use crate::table::{LOG_CATEGORY, Place, places, table};
use crate::tension::Distribution;

/// The controller: measured pose in, winch forces out.
pub struct WinchController {
    table: Arc<ModelDescription>,
    places: Vec<Place>,
    now: State,
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
    held: Distribution,
}

impl Default for State {
    fn default() -> Self {
        Self {
            settings: Settings::default(),
            measured: Measurement::default(),
            low_pass: LowPass::default(),
            start_time: 0.0,
            running: false,
            wanted: Motion::default(),
            held: Distribution { force: [0.0; 4], feasible: true },
        }
    }
}

const NO_WRENCH: &str = "the cables cannot give three independent wrenches at the measured pose";

impl State {
    /// The first sample: the feedback starts as it is, without a past to be smoothed with.
    fn start(&mut self) -> Result<(), ModelError> {
        self.settings.check().map_err(ModelError::new)?;
        let wanted = self.settings.reference.at(0.0);
        self.low_pass.value = feedback(&self.settings, &wanted, &self.measured);
        self.hold(0.0, wanted)
    }

    /// A sample at `time` (s), good for `step` (s).
    fn sample(&mut self, time: f64, step: f64) -> Result<(), ModelError> {
        let since_start = time - self.start_time;
        let wanted = self.settings.reference.at(since_start);
        let feedback = feedback(&self.settings, &wanted, &self.measured);
        self.low_pass.update(&feedback, step, self.settings.filter_time);
        self.hold(since_start, wanted)
    }

    fn hold(&mut self, since_start: f64, wanted: Motion) -> Result<(), ModelError> {
        let acceleration = std::array::from_fn(|k| wanted.acceleration[k] + self.low_pass.value[k]);
        let bounds = self.settings.bounds_at(since_start);
        let held = winch_forces(&self.settings, &bounds, &self.measured, &acceleration);
        self.held = held.ok_or_else(|| ModelError::new(NO_WRENCH))?;
        self.wanted = wanted;
        Ok(())
    }

    /// All numbers, in a fixed order.
    fn numbers(&mut self) -> impl Iterator<Item = &mut f64> {
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
    }

    fn to_bytes(&self, out: &mut Vec<u8>) {
        // The accessors give places to write to; a copy serves for reading.
        let mut copy = self.clone();
        for number in copy.numbers() {
            out.extend(number.to_le_bytes());
        }
        for setting in &SETTINGS {
            out.extend((setting.place)(&mut copy.settings).to_le_bytes());
        }
        out.extend([u8::from(self.running), u8::from(self.held.feasible)]);
    }

    fn from_bytes(bytes: &[u8]) -> Result<Self, ModelError> {
        let mut state = Self::default();
        let count = state.numbers().count() + SETTINGS.len();
        let Some((numbers, &[running, feasible])) = bytes.split_at_checked(8 * count) else {
            let expected = 8 * count + 2;
            return Err(ModelError::new(format!("a saved controller has {expected} bytes, found {}", bytes.len())));
        };
        let mut numbers = numbers.chunks_exact(8).map(|b| f64::from_le_bytes(std::array::from_fn(|k| b[k])));
        for (place, number) in state.numbers().zip(&mut numbers) {
            *place = number;
        }
        for (setting, number) in SETTINGS.iter().zip(numbers) {
            *(setting.place)(&mut state.settings) = number;
        }
        (state.running, state.held.feasible) = (running != 0, feasible != 0);
        Ok(state)
    }
}

impl WinchController {
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

    fn instantiate(_resources: Option<&Path>) -> Result<Self, ModelError> {
        // There is one such controller: its table serves all instances.
        static TABLE: LazyLock<Arc<ModelDescription>> = LazyLock::new(|| Arc::new(table()));
        Ok(Self { table: Arc::clone(&TABLE), places: places(), now: State::default(), log: Vec::new() })
    }

    fn description(&self) -> &Arc<ModelDescription> {
        &self.table
    }

    fn get(&mut self, index: usize) -> Result<Value, ModelError> {
        let (place, now) = (self.places[index], &mut self.now);
        let computed = matches!(place, Place::Force(_) | Place::Reference(_) | Place::Feasible);
        if computed && !now.running {
            now.start()?;
        }
        Ok(match place {
            Place::Pose(k) => Value::Real(now.measured.pose[k]),
            Place::Twist(k) => Value::Real(now.measured.twist[k]),
            Place::Force(i) => Value::Real(now.held.force[i]),
            Place::Reference(k) => Value::Real(now.wanted.pose[k]),
            Place::Feasible => Value::Boolean(now.held.feasible),
            Place::Setting(k) => Value::Real(*(SETTINGS[k].place)(&mut now.settings)),
        })
    }

    fn set(&mut self, index: usize, value: Value) -> Result<(), ModelError> {
        let (place, now) = (self.places[index], &mut self.now);
        let Value::Real(number) = value else {
            return Err(ModelError::new(format!("{place:?} cannot be {value:?}")));
        };
        match place {
            Place::Pose(k) => now.measured.pose[k] = number,
            Place::Twist(k) => now.measured.twist[k] = number,
            Place::Setting(k) => *(SETTINGS[k].place)(&mut now.settings) = number,
            Place::Force(_) | Place::Reference(_) | Place::Feasible => {
                return Err(ModelError::new("an output cannot be set"));
            }
        }
        Ok(())
    }

    fn initialise(&mut self, experiment: Experiment) -> Result<(), ModelError> {
        self.now.start_time = experiment.start_time;
        self.now.start()?;
        self.now.running = true;
        self.tell_change(true);
        Ok(())
    }

    fn step(&mut self, time: f64, step: f64) -> Result<(), StepError> {
        let feasible_before = self.now.held.feasible;
        self.now.sample(time, step).map_err(|error| StepError {
            reached: time,
            message: error.message,
            terminate: false,
        })?;
        self.tell_change(feasible_before);
        Ok(())
    }

    fn save(&self, out: &mut Vec<u8>) {
        self.now.to_bytes(out);
    }

    fn restore(&mut self, bytes: &[u8]) -> Result<(), ModelError> {
        self.now = State::from_bytes(bytes)?;
        Ok(())
    }

    fn reset(&mut self) {
        self.now = State::default();
        self.log.clear();
    }

    fn take_log(&mut self) -> Vec<LogEntry> {
        std::mem::take(&mut self.log)
    }
}
