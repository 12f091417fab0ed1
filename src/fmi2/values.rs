//! Reading and setting single variables.

use fmi2_export::{ModelError, Value};

use super::role::Instant;
use super::{CablePlatform, Phase, Role, State};
use crate::dynamics::{Evaluation, Inputs};
use crate::parameter::REALS;
use crate::simulation::{Simulation, Start};

impl CablePlatform {
    /// The value of the variable that stands for `role`.
    pub(super) fn value(&mut self, role: Role) -> Result<Value, ModelError> {
        if self.phase == Phase::Instantiated
            && let Role::State(state) = role
            && let Some(start) = start_field(&mut self.settings.model.start, state)
        {
            return Ok(Value::Real(*start));
        }
        Ok(match role {
            Role::Parameter(place, i) => match (REALS[place].field)(&mut self.settings.model, i) {
                Some(value) => Value::Real(*value),
                None => return Err(ModelError::new("the model has no such parameter")),
            },
            Role::EffectParameter(effect, k) => match self.settings.model.effects[effect].number(k) {
                Some(value) => Value::Real(*value),
                None => return Err(ModelError::new("the effect has no such parameter")),
            },
            Role::Choice(choice) => Value::Integer(choice.get(&self.settings.model)),
            Role::WinchForce(_) | Role::Disturbance(_) => {
                let mut inputs = match (self.phase, &self.simulation) {
                    (Phase::Running { .. }, Some(simulation)) => simulation.inputs(),
                    _ => self.settings.model.start.inputs,
                };
                Value::Real(input_field(&mut inputs, role).map_or(0.0, |value| *value))
            }
            Role::Slack(i) => {
                let (simulation, evaluation) = self.evaluated()?;
                Value::Boolean(simulation.shown(evaluation).slack(i))
            }
            Role::Time => Value::Real(self.present()?.time()),
            _ => Value::Real(self.computed(role)?),
        })
    }

    /// The simulation, and everything evaluated at the present instant.
    fn evaluated(&mut self) -> Result<(&Simulation, &Evaluation), ModelError> {
        self.present()?;
        match &self.simulation {
            Some(simulation) => Ok((simulation, self.now.evaluation(simulation))),
            None => Err(ModelError::new("there is no simulation")),
        }
    }

    fn computed(&mut self, role: Role) -> Result<f64, ModelError> {
        let (simulation, evaluation) = self.evaluated()?;
        let mut value = [0.0];
        match read(simulation, evaluation, [role], &mut value) {
            None => Ok(value[0]),
            Some(_) => Err(no_real_variable()),
        }
    }

    /// The values of real variables. While the simulation runs, the instant is looked at once for all of them.
    pub(super) fn real_values(&mut self, indices: &[usize], values: &mut [f64]) -> Result<(), (usize, ModelError)> {
        if let (Phase::Running { .. }, Some(simulation)) = (&self.phase, &self.simulation) {
            let shared = &self.shared;
            if self.now.look_up(simulation, indices.iter().map(|index| shared.places[*index]), values) {
                return Ok(());
            }
            let roles = indices.iter().map(|index| shared.roles[*index]);
            if read(simulation, self.now.evaluation(simulation), roles, values).is_none() {
                return Ok(());
            }
        }
        for (place, (index, slot)) in indices.iter().zip(values).enumerate() {
            *slot = match self.value(self.shared.roles[*index]) {
                Ok(Value::Real(value)) => value,
                Ok(other) => return Err((place, ModelError::new(format!("it is {other:?}, no real number")))),
                Err(error) => return Err((place, error)),
            };
        }
        Ok(())
    }

    /// Sets real variables. While the simulation runs, they are inputs, and change together.
    pub(super) fn set_real_values(&mut self, assignments: &[(usize, f64)]) -> Result<(), (usize, ModelError)> {
        if let (Phase::Running { .. }, Some(simulation)) = (self.phase, &mut self.simulation) {
            if simulation.holds_inputs() {
                let mut inputs = simulation.inputs();
                for (place, (index, value)) in assignments.iter().enumerate() {
                    let field = input_field(&mut inputs, self.shared.roles[*index]);
                    *field.ok_or_else(|| (place, no_input()))? = *value;
                }
                simulation.set_inputs(inputs);
                self.changed();
                return Ok(());
            }
            let (mut inputs, mut slopes) = (simulation.inputs(), simulation.input_slopes());
            for (place, (index, value)) in assignments.iter().enumerate() {
                let role = self.shared.roles[*index];
                match (input_field(&mut inputs, role), input_field(&mut slopes, role)) {
                    (Some(input), Some(slope)) => (*input, *slope) = (*value, 0.0),
                    _ => return Err((place, no_input())),
                }
            }
            simulation.set_inputs_with_slopes(inputs, slopes);
            self.changed();
            return Ok(());
        }
        for (place, (index, value)) in assignments.iter().enumerate() {
            self.set_value(self.shared.roles[*index], &Value::Real(*value)).map_err(|error| (place, error))?;
        }
        Ok(())
    }

    /// Gives the variable that stands for `role` a value.
    pub(super) fn set_value(&mut self, role: Role, value: &Value) -> Result<(), ModelError> {
        let running = matches!(self.phase, Phase::Running { .. });
        match (role, value) {
            (Role::WinchForce(_) | Role::Disturbance(_), Value::Real(value)) => self.set_input(role, *value, 0.0),
            _ if running => return Err(no_input()),
            (Role::Parameter(place, i), Value::Real(value)) => {
                match (REALS[place].field)(&mut self.settings.model, i) {
                    Some(field) => *field = *value,
                    None => return Err(ModelError::new("the model has no such parameter")),
                }
            }
            (Role::EffectParameter(effect, k), Value::Real(value)) => {
                match self.settings.model.effects[effect].number(k) {
                    Some(number) => *number = *value,
                    None => return Err(ModelError::new("the effect has no such parameter")),
                }
            }
            (Role::Choice(choice), Value::Integer(number)) => {
                choice
                    .set(&mut self.settings.model, *number)
                    .ok_or_else(|| ModelError::new(format!("{number} is no item of the enumeration")))?;
            }
            (Role::State(state), Value::Real(value)) => {
                let field = start_field(&mut self.settings.model.start, state)
                    .ok_or_else(|| ModelError::new("the states of effects have no start value"))?;
                *field = *value;
            }
            _ => return Err(ModelError::new(format!("cannot be set to {value:?}"))),
        }
        self.changed();
        Ok(())
    }

    /// The slope of an input, from now on.
    pub(super) fn set_slope(&mut self, role: Role, slope: f64) -> Result<(), ModelError> {
        let Value::Real(value) = self.value(role)? else {
            return Err(ModelError::new("no real input"));
        };
        if !matches!(role, Role::WinchForce(_) | Role::Disturbance(_)) {
            return Err(ModelError::new("no input"));
        }
        self.set_input(role, value, slope);
        self.changed();
        Ok(())
    }

    fn set_input(&mut self, role: Role, value: f64, slope: f64) {
        let put = |inputs: &mut Inputs, value: f64| {
            if let Some(field) = input_field(inputs, role) {
                *field = value;
            }
        };
        match (self.phase, &mut self.simulation) {
            (Phase::Running { .. }, Some(simulation)) => {
                let mut inputs = simulation.inputs();
                put(&mut inputs, value);
                if slope == 0.0 && simulation.holds_inputs() {
                    simulation.set_inputs(inputs);
                } else {
                    let mut slopes = simulation.input_slopes();
                    put(&mut slopes, slope);
                    simulation.set_inputs_with_slopes(inputs, slopes);
                }
            }
            _ => {
                put(&mut self.settings.model.start.inputs, value);
                put(&mut self.settings.slopes, slope);
            }
        }
    }
}

/// Real variables that follow from the states, into `values`. Returns the first role that does not.
pub(super) fn read(
    simulation: &Simulation,
    evaluation: &Evaluation,
    roles: impl IntoIterator<Item = Role, IntoIter: Clone>,
    values: &mut [f64],
) -> Option<Role> {
    let plant = simulation.plant().at(simulation.time());
    let (shown, states) = (simulation.shown(evaluation), simulation.states());
    let roles = roles.into_iter();
    // Only massless springs have others than the evaluation.
    let asked = plant.has.platform_side && roles.clone().any(Role::is_unstretched_acceleration);
    let along_motion = asked.then(|| simulation.unstretched_accelerations(evaluation));
    let acceleration = Some(along_motion.as_ref().unwrap_or(&evaluation.unstretched_acceleration));
    let instant = Instant { shown, states, acceleration, plant };
    for (role, value) in roles.zip(values) {
        match instant.real(role) {
            Some(real) => *value = real,
            None => return Some(role),
        }
    }
    None
}

fn no_input() -> ModelError {
    ModelError::new("only inputs can be set while the simulation runs")
}

pub(super) fn no_real_variable() -> ModelError {
    ModelError::new("no real variable of the plant")
}

/// Where the start value of a state is kept.
pub(super) fn start_field(start: &mut Start, state: State) -> Option<&mut f64> {
    Some(match state {
        State::Pose(k) => &mut start.pose[k],
        State::Twist(k) => &mut start.twist[k],
        State::UnstretchedLength(i) => &mut start.unstretched_length[i],
        State::UnstretchedRate(i) => &mut start.unstretched_length_rate[i],
        State::Effect(..) => return None,
    })
}

/// Where an input is kept; `None` for what is no input.
pub(super) fn input_field(inputs: &mut Inputs, role: Role) -> Option<&mut f64> {
    match role {
        Role::WinchForce(i) => Some(&mut inputs.winch_force[i]),
        Role::Disturbance(k) => Some(&mut inputs.disturbance[k]),
        _ => None,
    }
}
