//! Reading and setting single variables.

use fmi2_export::{ModelError, Value};

use super::parameters::REALS;
use super::role::Instant;
use super::{CablePlatform, Now, Phase, Role, State};
use crate::dynamics::Inputs;
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
            Role::Slack(i) => Value::Boolean(self.now()?.1.outputs.slack[i]),
            Role::Time => Value::Real(self.present()?.time()),
            _ => Value::Real(self.computed(role)?),
        })
    }

    /// The simulation, everything evaluated at the present instant, and the rates of the states.
    fn now(&mut self) -> Result<(&Simulation, &Now, &[f64]), ModelError> {
        if self.now.is_none() {
            self.present()?;
        }
        if let (Some(simulation), None) = (&self.simulation, &self.now) {
            self.now = Some(Now::of(simulation, &mut self.rates));
        }
        match (&self.simulation, &self.now) {
            (Some(simulation), Some(now)) => Ok((simulation, now, &self.rates)),
            _ => Err(ModelError::new("there is no simulation")),
        }
    }

    fn computed(&mut self, role: Role) -> Result<f64, ModelError> {
        let (simulation, now, rates) = self.now()?;
        read(simulation, now, rates, role)
    }

    /// Gives the variable that stands for `role` a value.
    pub(super) fn set_value(&mut self, role: Role, value: &Value) -> Result<(), ModelError> {
        let running = matches!(self.phase, Phase::Running { .. });
        match (role, value) {
            (Role::WinchForce(_) | Role::Disturbance(_), Value::Real(value)) => self.set_input(role, *value, 0.0),
            _ if running => return Err(ModelError::new("only inputs can be set while the simulation runs")),
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

impl Now {
    /// The present instant of `simulation`, and the rates of its states.
    pub(super) fn of(simulation: &Simulation, rates: &mut Vec<f64>) -> Self {
        let evaluation = simulation.evaluate();
        let outputs = simulation.outputs_of(&evaluation);
        rates.resize(simulation.states().len(), 0.0);
        simulation.plant().write_rates(simulation.states(), &evaluation, rates);
        Self { evaluation, outputs }
    }
}

/// A real variable that follows from the states.
pub(super) fn read(simulation: &Simulation, now: &Now, rates: &[f64], role: Role) -> Result<f64, ModelError> {
    let along_motion;
    let acceleration = match role {
        Role::Rate(State::UnstretchedRate(_)) => {
            along_motion = simulation.unstretched_accelerations(&now.evaluation);
            &along_motion
        }
        _ => &now.evaluation.unstretched_acceleration,
    };
    let plant = simulation.plant().at(simulation.time());
    let instant = Instant { outputs: &now.outputs, states: simulation.states(), rates, acceleration, plant };
    instant.real(role).ok_or_else(|| ModelError::new("no real variable of the plant"))
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
