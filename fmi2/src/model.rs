//! What a model must offer to be exported: the [`Model`] trait and the values that cross it.

use std::borrow::Cow;
use std::path::Path;
use std::sync::Arc;

use crate::description::ModelDescription;

/// A model that can be exported as an FMI 2.0 co-simulation FMU.
///
/// The layer calls these methods only in an order that the FMI 2.0 state machine allows, with indices
/// inside `description().variables`, values of the variable's own type, finite, and within its bounds.
/// A panic in any of them is caught at the C border; the instance is then in FMI's error state until it
/// is reset, or a saved state is restored.
///
/// Variables are named by their index in `description().variables`, never by value reference.
pub trait Model: Send + Sized + 'static {
    /// FMI `modelIdentifier`; names the binary.
    const MODEL_IDENTIFIER: &'static str;

    /// A fresh instance in its start state.
    ///
    /// `resources` is the FMU's unpacked `resources` folder, or `None` where the host gave no usable
    /// location.
    ///
    /// # Errors
    /// Whatever keeps the model from being built, such as a broken file in `resources`.
    fn instantiate(resources: Option<&Path>) -> Result<Self, ModelError>;

    /// The one table: model name, variables, units, enumerations, log categories, default experiment
    /// and structure. Fixed for the life of the instance.
    ///
    /// Where instances share a table, what the layer makes of it is shared, too.
    fn description(&self) -> &Arc<ModelDescription>;

    /// The value of the variable at `index`; enumerations are [`Value::Integer`].
    ///
    /// The independent variable, if the table has one, is answered by the layer.
    ///
    /// # Errors
    /// The value cannot be computed.
    fn get(&mut self, index: usize) -> Result<Value, ModelError>;

    /// Give the variable at `index` a value.
    ///
    /// Setting a real input also ends the input derivatives given before.
    ///
    /// # Errors
    /// The value is refused; the model keeps the old one.
    fn set(&mut self, index: usize, value: Value) -> Result<(), ModelError>;

    /// The values of the Real variables at `indices`, in their order, into `values`; as [`Model::get`] gives them one by one.
    ///
    /// For models that can give many at once cheaper. The independent variable is never among them.
    ///
    /// # Errors
    /// The place in `indices` of a value that cannot be computed, and why.
    fn get_reals(&mut self, indices: &[usize], values: &mut [f64]) -> Result<(), (usize, ModelError)> {
        for (place, (index, slot)) in indices.iter().zip(values).enumerate() {
            *slot = match self.get(*index) {
                Ok(Value::Real(value)) => value,
                Ok(other) => return Err((place, ModelError::new(format!("it is {other:?}, no real number")))),
                Err(error) => return Err((place, error)),
            };
        }
        Ok(())
    }

    /// Give Real variables, each at its index, values; as [`Model::set`] does one by one.
    ///
    /// # Errors
    /// The place among the assignments of a value that is refused, and why; those before it may have been taken.
    fn set_reals(&mut self, assignments: &[(usize, f64)]) -> Result<(), (usize, ModelError)> {
        for (place, (index, value)) in assignments.iter().enumerate() {
            self.set(*index, Value::Real(*value)).map_err(|error| (place, error))?;
        }
        Ok(())
    }

    /// Entering initialisation mode. From here to [`Model::initialise`] the host may read outputs and
    /// derivatives, computed from the start values as they stand.
    ///
    /// # Errors
    /// The model cannot be initialised for this experiment.
    fn enter_initialisation(&mut self, experiment: Experiment) -> Result<(), ModelError> {
        let _ = experiment;
        Ok(())
    }

    /// Leaving initialisation mode: parameters, states and inputs are set; find consistent values.
    ///
    /// # Errors
    /// No consistent values exist or they could not be found.
    fn initialise(&mut self, experiment: Experiment) -> Result<(), ModelError>;

    /// Advance from `time` to `time + step` (s); `step` is positive and finite.
    ///
    /// # Errors
    /// The step could not be taken in full. The model is left at [`StepError::reached`], usable.
    fn step(&mut self, time: f64, step: f64) -> Result<(), StepError>;

    /// The time derivative of order `order` (1, 2, ...) of a real input, from now on and until the input
    /// is set again.
    ///
    /// Needed where [`Capabilities::can_interpolate_inputs`](crate::description::Capabilities) is true.
    ///
    /// # Errors
    /// The order or the input is not supported.
    fn set_input_derivative(&mut self, index: usize, order: u32, value: f64) -> Result<(), ModelError> {
        let _ = (index, order, value);
        Err(ModelError::new("input derivatives are not supported"))
    }

    /// The time derivative of order `order` (1, 2, ...) of a real output.
    ///
    /// Needed up to the order in
    /// [`Capabilities::max_output_derivative_order`](crate::description::Capabilities).
    ///
    /// # Errors
    /// The order or the output is not supported, or the value cannot be computed.
    fn output_derivative(&mut self, index: usize, order: u32) -> Result<f64, ModelError> {
        let _ = (index, order);
        Err(ModelError::new("output derivatives are not supported"))
    }

    /// `out = d(unknowns)/d(knowns) * seed`, at the present values.
    ///
    /// `seed` is as long as `knowns`, `out` as long as `unknowns`. Needed where
    /// [`Capabilities::provides_directional_derivative`](crate::description::Capabilities) is true.
    ///
    /// # Errors
    /// The pair is not supported, or the derivative cannot be computed.
    fn directional_derivative(
        &mut self,
        unknowns: &[usize],
        knowns: &[usize],
        seed: &[f64],
        out: &mut [f64],
    ) -> Result<(), ModelError> {
        let _ = (unknowns, knowns, seed, out);
        Err(ModelError::new("directional derivatives are not supported"))
    }

    /// Append everything that a bit-identical continuation needs: parameters, states, inputs, solver,
    /// histories. The layer adds its own header with version, GUID, FMI state and checksum.
    fn save(&self, out: &mut Vec<u8>);

    /// Take the state that [`Model::save`] wrote. A checksum keeps damaged bytes away, but not made-up ones: check what is
    /// read as if a host had set it.
    ///
    /// # Errors
    /// The bytes are not such a state; the model is then unchanged.
    fn restore(&mut self, bytes: &[u8]) -> Result<(), ModelError>;

    /// Back to the state after [`Model::instantiate`].
    fn reset(&mut self);

    /// Messages that the model wants logged since the last call.
    ///
    /// Those with [`Status::Warning`] reach the host whatever it switched on; the call's status stays `fmi2OK`, because
    /// many hosts end a run at `fmi2Warning`. So warn once, not at every step.
    fn take_log(&mut self) -> Vec<LogEntry> {
        Vec::new()
    }
}

/// The value of one variable. Enumerations are integers.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// `fmi2Real`, in the variable's unit.
    Real(f64),
    /// `fmi2Integer`, or the value of an enumeration's item.
    Integer(i32),
    /// `fmi2Boolean`.
    Boolean(bool),
    /// `fmi2String`.
    String(String),
}

/// The experiment that the host announced.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Experiment {
    /// Start time, s.
    pub start_time: f64,
    /// Stop time, s, where the host defined one; no step goes beyond it.
    pub stop_time: Option<f64>,
    /// Relative tolerance, where the host defined one.
    pub tolerance: Option<f64>,
}

impl Experiment {
    /// What no experiment can be, in words, if this is such a one.
    pub(crate) fn check(&self) -> Result<(), String> {
        let Self { start_time: start, stop_time, tolerance } = *self;
        if !start.is_finite() {
            return Err(format!("start time {start} is not finite"));
        }
        if let Some(stop) = stop_time
            && !(stop.is_finite() && stop >= start)
        {
            return Err(format!("stop time {stop} is not a time at or after the start time {start}"));
        }
        if let Some(tolerance) = tolerance
            && !(tolerance.is_finite() && tolerance > 0.0)
        {
            return Err(format!("tolerance {tolerance} is not positive"));
        }
        Ok(())
    }
}

/// Why a model refused a request.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct ModelError {
    /// What was found and what was expected, for the host's log.
    pub message: String,
}

impl ModelError {
    /// An error with this message.
    pub fn new(message: impl Into<String>) -> Self {
        Self { message: message.into() }
    }
}

/// Why a step was not taken in full.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{message} (reached t = {reached} s)")]
pub struct StepError {
    /// The time up to which the model advanced, s; it stands there, usable.
    pub reached: f64,
    /// What went wrong, for the host's log.
    pub message: String,
    /// The model asks for the simulation to end here, as a regular result.
    pub terminate: bool,
}

/// One message for the host's log.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LogEntry {
    /// A category of [`ModelDescription::log_categories`] or one of the layer's own.
    pub category: Cow<'static, str>,
    /// The message's own status.
    pub status: Status,
    /// Plain text; the layer escapes what the host's logger would read as a format.
    pub message: String,
}

/// `fmi2Status`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[repr(i32)]
pub enum Status {
    /// All well.
    Ok = 0,
    /// Not quite right, but the computation can go on.
    Warning = 1,
    /// The step was not taken in full.
    Discard = 2,
    /// The call failed.
    Error = 3,
    /// All instances of the process are broken; never returned by this layer.
    Fatal = 4,
    /// The step goes on in the background; never returned by this layer.
    Pending = 5,
}
