//! The state as bytes: everything that was set, and the simulation.

use fmi2_export::description::Kind;
use fmi2_export::{Experiment, ModelError};

use super::role::Choice;
use super::{CablePlatform, Phase, Role, Settings, TOLERANCES};
use crate::model_file::Model;
use crate::parameter::REALS;
use crate::simulation::Simulation;

impl CablePlatform {
    /// Appends everything that a bit-identical continuation needs.
    pub(super) fn write_state(&self, out: &mut Vec<u8>) {
        let mut settings = self.settings.clone();
        for choice in Choice::ALL {
            out.extend(choice.get(&settings.model).to_le_bytes());
        }
        each_number(&mut settings, &mut |number| out.extend(number.to_le_bytes()));
        match (self.phase, &self.simulation) {
            (Phase::Running { tolerance }, Some(simulation)) => {
                out.push(2);
                out.extend(tolerance.to_le_bytes());
                simulation.save(out);
            }
            (Phase::Initialising(experiment), _) => {
                out.push(1);
                let absent_as_nan = |value: Option<f64>| value.unwrap_or(f64::NAN);
                let Experiment { start_time, stop_time, tolerance } = experiment;
                for number in [start_time, absent_as_nan(stop_time), absent_as_nan(tolerance)] {
                    out.extend(number.to_le_bytes());
                }
            }
            _ => out.push(0),
        }
    }

    /// Takes up what [`Self::write_state`] wrote; unchanged on error. A running simulation takes up another state of its own
    /// without allocating.
    pub(super) fn read_state(&mut self, bytes: &[u8]) -> Result<(), ModelError> {
        // Whatever a host can set is written over.
        let mut settings = self.spare_settings.take().unwrap_or_else(|| Box::new(Settings::new(&self.shared.model)));
        let result = self.read_state_with(bytes, &mut settings);
        if result.is_ok() {
            std::mem::swap(&mut self.settings, &mut settings);
            self.forget_instant();
        }
        self.spare_settings = Some(settings);
        result
    }

    /// The same but for the settings, which are read into `settings`.
    fn read_state_with(&mut self, bytes: &[u8], settings: &mut Settings) -> Result<(), ModelError> {
        let mut reader = Reader(bytes);
        for choice in Choice::ALL {
            let number = i32::from_le_bytes(reader.take()?);
            choice.set(&mut settings.model, number).ok_or_else(broken)?;
        }
        let mut read = Ok(());
        each_number(settings, &mut |number| match reader.number() {
            Ok(value) => *number = value,
            Err(error) => read = Err(error),
        });
        read?;
        self.check_settings(settings)?;
        let [phase] = reader.take()?;
        match phase {
            0 | 1 => {
                let phase = match phase {
                    0 => Phase::Instantiated,
                    _ => {
                        let [start_time, stop_time, tolerance] = [reader.number()?, reader.number()?, reader.number()?];
                        let there = |value: f64| (!value.is_nan()).then_some(value);
                        let (stop_time, tolerance) = (there(stop_time), there(tolerance));
                        if !start_time.is_finite()
                            || stop_time.is_some_and(|stop| !stop.is_finite() || stop < start_time)
                        {
                            return Err(impossible("the start or stop time", start_time));
                        }
                        if let Some(bad) = tolerance.filter(|value| !(value.is_finite() && *value > 0.0)) {
                            return Err(impossible("the tolerance", bad));
                        }
                        Phase::Initialising(Experiment { start_time, stop_time, tolerance })
                    }
                };
                if !reader.0.is_empty() {
                    return Err(broken());
                }
                self.phase = phase;
                self.simulation = None;
            }
            2 => {
                let tolerance = reader.number()?;
                if !(TOLERANCES.0..=TOLERANCES.1).contains(&tolerance) {
                    return Err(impossible("the tolerance", tolerance));
                }
                self.restore_running(&settings.model, tolerance, reader.0)?;
                self.phase = Phase::Running { tolerance };
            }
            _ => return Err(broken()),
        }
        Ok(())
    }

    /// Refuses what a host could not have set.
    fn check_settings(&self, settings: &mut Settings) -> Result<(), ModelError> {
        let mut bad = None;
        each_number(settings, &mut |number| {
            if !number.is_finite() {
                bad = Some(*number);
            }
        });
        if let Some(bad) = bad {
            return Err(impossible("a number", bad));
        }
        for (role, variable) in self.shared.roles.iter().zip(&self.shared.description.variables) {
            let value = match *role {
                Role::Parameter(place, i) => (REALS[place].field)(&mut settings.model, i).copied(),
                Role::EffectParameter(effect, k) => settings.model.effects[effect].number(k).copied(),
                _ => None,
            };
            if let Some(value) = value
                && let Kind::Real(real) = &variable.kind
                && !(real.min.is_none_or(|min| value >= min) && real.max.is_none_or(|max| value <= max))
            {
                return Err(impossible(&variable.name, value));
            }
        }
        Ok(())
    }

    /// Makes the simulation one of `model` in the saved state. The present one serves where it is of the same plant.
    fn restore_running(&mut self, model: &Model, tolerance: f64, bytes: &[u8]) -> Result<(), ModelError> {
        let failed = |error: &dyn std::fmt::Display| ModelError::new(error.to_string());
        let same = |simulation: &Simulation| {
            let plant = simulation.plant();
            let same_plant = *plant.parameters() == model.parameters && plant.effects() == model.effects;
            same_plant && simulation.solver() == model.solver
        };
        if let (Phase::Running { tolerance: present }, Some(simulation)) = (self.phase, &mut self.simulation)
            && present == tolerance
            && same(simulation)
        {
            return simulation.restore(bytes).map_err(|e| failed(&e));
        }
        let plant = self.shared.plant_of(model).map_err(|e| failed(&e))?;
        let start = model.start.behind_sensors(&plant);
        let mut y = vec![1.0; plant.dimension()];
        y[..3].copy_from_slice(&start.pose);
        let simulation = Simulation::from_states(plant, start.time, y, start.inputs, tolerance);
        let mut simulation = simulation.with_solver(model.solver);
        self.same_states(&simulation)?;
        simulation.restore(bytes).map_err(|e| failed(&e))?;
        self.simulation = Some(simulation);
        Ok(())
    }
}

/// Shows every number among the settings to `look`, in a fixed order.
fn each_number(settings: &mut Settings, look: &mut dyn FnMut(&mut f64)) {
    let Settings { model, slopes } = settings;
    for parameter in &REALS {
        for i in 0..parameter.count(model.parameters.cables()) {
            if let Some(value) = (parameter.field)(model, i) {
                look(value);
            }
        }
    }
    let Model { start, effects, .. } = model;
    look(&mut start.time);
    let kept: [&mut [f64]; 8] = [
        &mut start.pose,
        &mut start.twist,
        &mut start.unstretched_length,
        &mut start.unstretched_length_rate,
        &mut start.inputs.winch_force,
        &mut start.inputs.disturbance,
        &mut slopes.winch_force,
        &mut slopes.disturbance,
    ];
    kept.into_iter().flatten().for_each(&mut *look);
    for effect in effects {
        // Its parameters, and when it begins and ends.
        (0..effect.values.len() + 2).for_each(|k| effect.number(k).into_iter().for_each(&mut *look));
    }
}

struct Reader<'a>(&'a [u8]);

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N], ModelError> {
        let (head, tail) = self.0.split_first_chunk::<N>().ok_or_else(broken)?;
        self.0 = tail;
        Ok(*head)
    }

    fn number(&mut self) -> Result<f64, ModelError> {
        Ok(f64::from_le_bytes(self.take()?))
    }
}

fn impossible(what: &str, found: f64) -> ModelError {
    ModelError::new(format!(
        "the saved state is not of this model: {what} in it is {found}, which could not have been set"
    ))
}

fn broken() -> ModelError {
    ModelError::new("the saved state is not of this model")
}
