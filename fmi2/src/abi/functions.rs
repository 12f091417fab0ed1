//! The functions on an instance: arguments in, one guarded call, results out.

use std::ffi::{c_char, c_int};
use std::sync::Arc;

use super::{
    Boolean, Byte, Component, Enumeration, FmuState, Integer, Live, Real, String as FmiString, ValueReference,
    arguments, handles,
};
use crate::description::BaseType;
use crate::failure::{Failure, Outcome};
use crate::instance::Instance;
use crate::model::{Experiment, Model, Status, Value};
use crate::state::Function;

/// `fmi2GetTypesPlatform`.
#[must_use]
pub fn get_types_platform() -> FmiString {
    c"default".as_ptr()
}

/// `fmi2GetVersion`.
#[must_use]
pub fn get_version() -> FmiString {
    c"2.0".as_ptr()
}

/// The single way in: find the instance, run the body under its guard, hand messages to the host.
///
/// They get them once the instance is free again, so that a logger that calls back does not block itself.
fn enter<M: Model>(
    live: &Live<M>,
    component: Component,
    function: Function,
    body: impl FnOnce(&mut Instance<M>) -> Outcome,
) -> c_int {
    let called = live.with(component, |held| {
        let (status, messages) = held.instance.call(function, body);
        let telling = (!messages.is_empty()).then(|| (Arc::clone(&held.host), messages));
        (status, telling)
    });
    // Without an instance there is no logger to tell.
    let (status, telling) = called.unwrap_or((Status::Error, None));
    if let Some((host, messages)) = telling {
        host.deliver(&messages);
    }
    status as c_int
}

/// Defines the C-facing functions on an instance. All of them return `fmi2Status`, and all have the
/// same safety contract.
macro_rules! on_instance {
    ($(
        $(#[$doc:meta])*
        fn $name:ident($function:ident; $($argument:ident: $type:ty),*) |$instance:ident| $body:block
    )*) => {$(
        $(#[$doc])*
        ///
        /// # Safety
        /// Pointers other than `component` are null or as FMI 2.0 describes them.
        #[allow(clippy::too_many_arguments, reason = "as many as the standard has, beside the instances")]
        pub unsafe fn $name<M: Model>(live: &Live<M>, component: Component, $($argument: $type),*) -> c_int {
            enter(live, component, Function::$function, |$instance: &mut Instance<M>| $body)
        }
    )*};
}

on_instance! {
    /// `fmi2SetDebugLogging`.
    fn set_debug_logging(
        SetDebugLogging; logging_on: Boolean, count: usize, categories: *const FmiString
    ) |instance| {
        // SAFETY: the caller's promise. No host has a reason for more categories than this.
        let categories = unsafe { arguments::input("categories", categories, count, 1 << 10) }?;
        let names: Outcome<Vec<&str>> = categories
            .iter()
            // SAFETY: the caller's promise.
            .map(|&name| unsafe { arguments::text("a category", name) })
            .collect();
        instance.set_debug_logging(logging_on != 0, &names?)
    }

    /// `fmi2SetupExperiment`.
    fn setup_experiment(
        SetupExperiment; tolerance_defined: Boolean, tolerance: Real, start_time: Real,
        stop_time_defined: Boolean, stop_time: Real
    ) |instance| {
        instance.setup_experiment(Experiment {
            start_time,
            stop_time: (stop_time_defined != 0).then_some(stop_time),
            tolerance: (tolerance_defined != 0).then_some(tolerance),
        })
    }

    /// `fmi2EnterInitializationMode`.
    fn enter_initialization_mode(EnterInitializationMode;) |instance| {
        instance.enter_initialisation()
    }

    /// `fmi2ExitInitializationMode`.
    fn exit_initialization_mode(ExitInitializationMode;) |instance| {
        instance.exit_initialisation()
    }

    /// `fmi2Terminate`.
    fn terminate(Terminate;) |instance| { instance.terminate() }

    /// `fmi2Reset`.
    fn reset(Reset;) |instance| { instance.reset() }

    /// `fmi2GetReal`.
    fn get_real(
        GetReal; references: *const ValueReference, count: usize, values: *mut Real
    ) |instance| {
        let limit = instance.count(BaseType::Real);
        // SAFETY: the caller's promise.
        let references = unsafe { arguments::input("vr", references, count, limit) }?;
        // SAFETY: the caller's promise.
        let out = unsafe { arguments::output("value", values, count, limit) }?;
        instance.read_reals(references, |values| {
            for (place, value) in out.iter_mut().zip(values) {
                place.write(*value);
            }
        })
    }

    /// `fmi2GetInteger`.
    fn get_integer(
        GetInteger; references: *const ValueReference, count: usize, values: *mut Integer
    ) |instance| {
        let limit = instance.count(BaseType::Integer);
        // SAFETY: the caller's promise.
        let references = unsafe { arguments::input("vr", references, count, limit) }?;
        // SAFETY: the caller's promise.
        let out = unsafe { arguments::output("value", values, count, limit) }?;
        instance.read(BaseType::Integer, references, |place, value| {
            if let Value::Integer(value) = value {
                out[place].write(value);
            }
            Ok(())
        })
    }

    /// `fmi2GetBoolean`.
    fn get_boolean(
        GetBoolean; references: *const ValueReference, count: usize, values: *mut Boolean
    ) |instance| {
        let limit = instance.count(BaseType::Boolean);
        // SAFETY: the caller's promise.
        let references = unsafe { arguments::input("vr", references, count, limit) }?;
        // SAFETY: the caller's promise.
        let out = unsafe { arguments::output("value", values, count, limit) }?;
        instance.read(BaseType::Boolean, references, |place, value| {
            if let Value::Boolean(value) = value {
                out[place].write(c_int::from(value));
            }
            Ok(())
        })
    }

    /// `fmi2GetString`. The strings are valid until the next call on the instance.
    fn get_string(
        GetString; references: *const ValueReference, count: usize, values: *mut FmiString
    ) |instance| {
        let limit = instance.count(BaseType::String);
        // SAFETY: the caller's promise.
        let references = unsafe { arguments::input("vr", references, count, limit) }?;
        // SAFETY: the caller's promise.
        let out = unsafe { arguments::output("value", values, count, limit) }?;
        let strings = instance.read_strings(references)?;
        for (place, string) in out.iter_mut().zip(strings) {
            place.write(string.as_ptr());
        }
        Ok(())
    }

    /// `fmi2SetReal`.
    fn set_real(
        SetReal; references: *const ValueReference, count: usize, values: *const Real
    ) |instance| {
        let limit = instance.count(BaseType::Real);
        // SAFETY: the caller's promise.
        let references = unsafe { arguments::input("vr", references, count, limit) }?;
        // SAFETY: the caller's promise.
        let values = unsafe { arguments::input("value", values, count, limit) }?;
        instance.write_reals(references, values)
    }

    /// `fmi2SetInteger`.
    fn set_integer(
        SetInteger; references: *const ValueReference, count: usize, values: *const Integer
    ) |instance| {
        let limit = instance.count(BaseType::Integer);
        // SAFETY: the caller's promise.
        let references = unsafe { arguments::input("vr", references, count, limit) }?;
        // SAFETY: the caller's promise.
        let values = unsafe { arguments::input("value", values, count, limit) }?;
        instance.write(BaseType::Integer, references, |place| Ok(Value::Integer(values[place])))
    }

    /// `fmi2SetBoolean`.
    fn set_boolean(
        SetBoolean; references: *const ValueReference, count: usize, values: *const Boolean
    ) |instance| {
        let limit = instance.count(BaseType::Boolean);
        // SAFETY: the caller's promise.
        let references = unsafe { arguments::input("vr", references, count, limit) }?;
        // SAFETY: the caller's promise.
        let values = unsafe { arguments::input("value", values, count, limit) }?;
        instance.write(BaseType::Boolean, references, |place| {
            arguments::boolean(values[place]).map(Value::Boolean)
        })
    }

    /// `fmi2SetString`.
    fn set_string(
        SetString; references: *const ValueReference, count: usize, values: *const FmiString
    ) |instance| {
        let limit = instance.count(BaseType::String);
        // SAFETY: the caller's promise.
        let references = unsafe { arguments::input("vr", references, count, limit) }?;
        // SAFETY: the caller's promise.
        let values = unsafe { arguments::input("value", values, count, limit) }?;
        instance.write(BaseType::String, references, |place| {
            // SAFETY: the caller's promise.
            let text = unsafe { arguments::text("the text", values[place]) }?;
            Ok(Value::String(text.to_owned()))
        })
    }

    /// `fmi2GetFMUstate`. A state that is there already is overwritten.
    fn get_fmu_state(GetFmuState; state: *mut FmuState) |instance| {
        // SAFETY: the caller's promise; the standard asks for null or an earlier state in it.
        let state = unsafe { arguments::value("FMUstate", state) }?;
        let reuse = (!state.is_null()).then(|| state.addr());
        let handle = instance.save_state(reuse, handles::new_state)?;
        *state = handles::as_pointer(handle);
        Ok(())
    }

    /// `fmi2SetFMUstate`.
    fn set_fmu_state(SetFmuState; state: FmuState) |instance| {
        instance.restore_state(state.addr())
    }

    /// `fmi2FreeFMUstate`. Null is ignored.
    fn free_fmu_state(FreeFmuState; state: *mut FmuState) |instance| {
        if state.is_null() {
            return Ok(());
        }
        // SAFETY: the caller's promise.
        let state = unsafe { arguments::value("FMUstate", state) }?;
        if !state.is_null() {
            instance.free_state(state.addr())?;
            *state = std::ptr::null_mut();
        }
        Ok(())
    }

    /// `fmi2SerializedFMUstateSize`.
    fn serialized_fmu_state_size(
        SerializedFmuStateSize; state: FmuState, size: *mut usize
    ) |instance| {
        // SAFETY: the caller's promise.
        let place = unsafe { arguments::place("size", size) }?;
        place.write(instance.serialised_size(state.addr())?);
        Ok(())
    }

    /// `fmi2SerializeFMUstate`.
    fn serialize_fmu_state(
        SerializeFmuState; state: FmuState, bytes: *mut Byte, size: usize
    ) |instance| {
        let needed = instance.serialised_size(state.addr())?;
        if size != needed {
            return Err(Failure::refused(format!(
                "room for {size} bytes, but the state takes {needed}"
            )));
        }
        // SAFETY: the caller's promise.
        let out = unsafe { arguments::output("serializedState", bytes, size, needed) }?;
        for (place, byte) in out.iter_mut().zip(instance.serialise(state.addr())?) {
            place.write(byte.cast_signed() as c_char);
        }
        Ok(())
    }

    /// `fmi2DeSerializeFMUstate`. A state that is there already is overwritten.
    fn de_serialize_fmu_state(
        DeSerializeFmuState; bytes: *const Byte, size: usize, state: *mut FmuState
    ) |instance| {
        // SAFETY: the caller's promise; a byte is a byte whatever its sign.
        let bytes =
            unsafe { arguments::input("serializedState", bytes.cast::<u8>(), size, usize::MAX) }?;
        // SAFETY: the caller's promise; the standard asks for null or an earlier state in it.
        let state = unsafe { arguments::value("FMUstate", state) }?;
        let reuse = (!state.is_null()).then(|| state.addr());
        let handle = instance.deserialise(bytes, reuse, handles::new_state)?;
        *state = handles::as_pointer(handle);
        Ok(())
    }

    /// `fmi2GetDirectionalDerivative`.
    fn get_directional_derivative(
        GetDirectionalDerivative; unknowns: *const ValueReference, unknown_count: usize,
        knowns: *const ValueReference, known_count: usize, seed: *const Real, result: *mut Real
    ) |instance| {
        let limit = instance.count(BaseType::Real);
        // SAFETY: the caller's promise.
        let unknowns = unsafe { arguments::input("vUnknown_ref", unknowns, unknown_count, limit) }?;
        // SAFETY: the caller's promise.
        let knowns = unsafe { arguments::input("vKnown_ref", knowns, known_count, limit) }?;
        // SAFETY: the caller's promise.
        let seed = unsafe { arguments::input("dvKnown", seed, known_count, limit) }?;
        // SAFETY: the caller's promise.
        let out = unsafe { arguments::output("dvUnknown", result, unknown_count, limit) }?;
        let values = instance.directional_derivative(unknowns, knowns, seed)?;
        for (place, value) in out.iter_mut().zip(values) {
            place.write(value);
        }
        Ok(())
    }

    /// `fmi2SetRealInputDerivatives`.
    fn set_real_input_derivatives(
        SetRealInputDerivatives; references: *const ValueReference, count: usize,
        orders: *const Integer, values: *const Real
    ) |instance| {
        let limit = instance.count(BaseType::Real);
        // SAFETY: the caller's promise.
        let references = unsafe { arguments::input("vr", references, count, limit) }?;
        // SAFETY: the caller's promise.
        let orders = unsafe { arguments::input("order", orders, count, limit) }?;
        // SAFETY: the caller's promise.
        let values = unsafe { arguments::input("value", values, count, limit) }?;
        instance.set_input_derivatives(references, orders, values)
    }

    /// `fmi2GetRealOutputDerivatives`.
    fn get_real_output_derivatives(
        GetRealOutputDerivatives; references: *const ValueReference, count: usize,
        orders: *const Integer, values: *mut Real
    ) |instance| {
        let limit = instance.count(BaseType::Real);
        // SAFETY: the caller's promise.
        let references = unsafe { arguments::input("vr", references, count, limit) }?;
        // SAFETY: the caller's promise.
        let orders = unsafe { arguments::input("order", orders, count, limit) }?;
        // SAFETY: the caller's promise.
        let out = unsafe { arguments::output("value", values, count, limit) }?;
        instance.output_derivatives(references, orders, |place, value| {
            out[place].write(value);
        })
    }

    /// `fmi2DoStep`. The instance keeps what it needs to go back, whatever the host says of that.
    fn do_step(
        DoStep; point: Real, step: Real, _no_set_fmu_state_prior_to_current_point: Boolean
    ) |instance| {
        instance.do_step(point, step)
    }

    /// `fmi2CancelStep`. Steps never run in the background, so the state table refuses it.
    fn cancel_step(CancelStep;) |_instance| { Ok(()) }

    /// `fmi2GetStatus`.
    fn get_status(GetStatus; kind: Enumeration, result: *mut Enumeration) |instance| {
        // SAFETY: the caller's promise.
        let place = unsafe { arguments::place("value", result) }?;
        place.write(instance.step_status(arguments::status_kind(kind)?)? as Enumeration);
        Ok(())
    }

    /// `fmi2GetRealStatus`.
    fn get_real_status(GetRealStatus; kind: Enumeration, result: *mut Real) |instance| {
        // SAFETY: the caller's promise.
        let place = unsafe { arguments::place("value", result) }?;
        place.write(instance.real_status(arguments::status_kind(kind)?)?);
        Ok(())
    }

    /// `fmi2GetIntegerStatus`.
    fn get_integer_status(GetIntegerStatus; kind: Enumeration, result: *mut Integer) |instance| {
        // SAFETY: the caller's promise.
        let place = unsafe { arguments::place("value", result) }?;
        place.write(instance.integer_status(arguments::status_kind(kind)?)?);
        Ok(())
    }

    /// `fmi2GetBooleanStatus`.
    fn get_boolean_status(GetBooleanStatus; kind: Enumeration, result: *mut Boolean) |instance| {
        // SAFETY: the caller's promise.
        let place = unsafe { arguments::place("value", result) }?;
        place.write(c_int::from(instance.boolean_status(arguments::status_kind(kind)?)?));
        Ok(())
    }

    /// `fmi2GetStringStatus`. The string is valid until the next call on the instance.
    fn get_string_status(GetStringStatus; kind: Enumeration, result: *mut FmiString) |instance| {
        // SAFETY: the caller's promise.
        let place = unsafe { arguments::place("value", result) }?;
        let text = instance.string_status(arguments::status_kind(kind)?)?;
        place.write(instance.keep_string(text)?.as_ptr());
        Ok(())
    }
}
