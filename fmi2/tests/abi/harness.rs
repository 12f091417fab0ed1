//! A small host: it owns an instance, calls the C functions and records what the logger gets.

use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::ptr;
use std::sync::Mutex;

use fmi2_export::Status;
use fmi2_export::abi::{CallbackFunctions, CallbackLogger};

use crate::oscillator::Oscillator;

pub(crate) type Handle = *mut c_void;

unsafe extern "C" {
    pub(crate) fn fmi2GetTypesPlatform() -> *const c_char;
    pub(crate) fn fmi2GetVersion() -> *const c_char;
    pub(crate) fn fmi2SetDebugLogging(c: Handle, on: c_int, n: usize, names: *const *const c_char) -> c_int;
    pub(crate) fn fmi2Instantiate(
        name: *const c_char,
        kind: c_int,
        guid: *const c_char,
        location: *const c_char,
        functions: *const CallbackFunctions,
        visible: c_int,
        logging_on: c_int,
    ) -> Handle;
    pub(crate) fn fmi2FreeInstance(c: Handle);
    pub(crate) fn fmi2SetupExperiment(
        c: Handle,
        tolerance_defined: c_int,
        tolerance: f64,
        start: f64,
        stop_defined: c_int,
        stop: f64,
    ) -> c_int;
    pub(crate) fn fmi2EnterInitializationMode(c: Handle) -> c_int;
    pub(crate) fn fmi2ExitInitializationMode(c: Handle) -> c_int;
    pub(crate) fn fmi2Terminate(c: Handle) -> c_int;
    pub(crate) fn fmi2Reset(c: Handle) -> c_int;
    pub(crate) fn fmi2GetReal(c: Handle, vr: *const u32, n: usize, value: *mut f64) -> c_int;
    pub(crate) fn fmi2GetInteger(c: Handle, vr: *const u32, n: usize, value: *mut c_int) -> c_int;
    pub(crate) fn fmi2GetBoolean(c: Handle, vr: *const u32, n: usize, value: *mut c_int) -> c_int;
    pub(crate) fn fmi2GetString(c: Handle, vr: *const u32, n: usize, value: *mut *const c_char) -> c_int;
    pub(crate) fn fmi2SetReal(c: Handle, vr: *const u32, n: usize, value: *const f64) -> c_int;
    pub(crate) fn fmi2SetInteger(c: Handle, vr: *const u32, n: usize, value: *const c_int) -> c_int;
    pub(crate) fn fmi2SetBoolean(c: Handle, vr: *const u32, n: usize, value: *const c_int) -> c_int;
    pub(crate) fn fmi2SetString(c: Handle, vr: *const u32, n: usize, value: *const *const c_char) -> c_int;
    pub(crate) fn fmi2GetFMUstate(c: Handle, state: *mut Handle) -> c_int;
    pub(crate) fn fmi2SetFMUstate(c: Handle, state: Handle) -> c_int;
    pub(crate) fn fmi2FreeFMUstate(c: Handle, state: *mut Handle) -> c_int;
    pub(crate) fn fmi2SerializedFMUstateSize(c: Handle, state: Handle, size: *mut usize) -> c_int;
    pub(crate) fn fmi2SerializeFMUstate(c: Handle, state: Handle, bytes: *mut c_char, size: usize) -> c_int;
    pub(crate) fn fmi2DeSerializeFMUstate(c: Handle, bytes: *const c_char, size: usize, state: *mut Handle) -> c_int;
    pub(crate) fn fmi2GetDirectionalDerivative(
        c: Handle,
        unknowns: *const u32,
        n_unknowns: usize,
        knowns: *const u32,
        n_knowns: usize,
        seed: *const f64,
        result: *mut f64,
    ) -> c_int;
    pub(crate) fn fmi2SetRealInputDerivatives(
        c: Handle,
        vr: *const u32,
        n: usize,
        order: *const c_int,
        value: *const f64,
    ) -> c_int;
    pub(crate) fn fmi2GetRealOutputDerivatives(
        c: Handle,
        vr: *const u32,
        n: usize,
        order: *const c_int,
        value: *mut f64,
    ) -> c_int;
    pub(crate) fn fmi2DoStep(c: Handle, point: f64, step: f64, no_set_prior: c_int) -> c_int;
    pub(crate) fn fmi2CancelStep(c: Handle) -> c_int;
    pub(crate) fn fmi2GetStatus(c: Handle, kind: c_int, value: *mut c_int) -> c_int;
    pub(crate) fn fmi2GetRealStatus(c: Handle, kind: c_int, value: *mut f64) -> c_int;
    pub(crate) fn fmi2GetIntegerStatus(c: Handle, kind: c_int, value: *mut c_int) -> c_int;
    pub(crate) fn fmi2GetBooleanStatus(c: Handle, kind: c_int, value: *mut c_int) -> c_int;
    pub(crate) fn fmi2GetStringStatus(c: Handle, kind: c_int, value: *mut *const c_char) -> c_int;

    /// From the C library: what a logger does with its message.
    fn snprintf(out: *mut c_char, size: usize, format: *const c_char, ...) -> c_int;
}

pub(crate) const OK: c_int = Status::Ok as c_int;
pub(crate) const WARNING: c_int = Status::Warning as c_int;
pub(crate) const DISCARD: c_int = Status::Discard as c_int;
pub(crate) const ERROR: c_int = Status::Error as c_int;

/// Value references of the oscillator; the order of the table fixes them.
pub(crate) mod vr {
    pub(crate) const TIME: u32 = 0;
    pub(crate) const U: u32 = 1;
    pub(crate) const X: u32 = 2;
    pub(crate) const V: u32 = 3;
    pub(crate) const DER_X: u32 = 4;
    pub(crate) const DER_V: u32 = 5;
    pub(crate) const ENERGY: u32 = 6;
    pub(crate) const OMEGA: u32 = 7;
    pub(crate) const ZETA: u32 = 8;
    pub(crate) const GAIN: u32 = 9;
    pub(crate) const WALL: u32 = 10;
    pub(crate) const FAULT: u32 = 0;
    pub(crate) const STEPS: u32 = 1;
    pub(crate) const DIMENSIONS: u32 = 2;
    pub(crate) const INSIDE: u32 = 0;
    pub(crate) const HOLD: u32 = 1;
    pub(crate) const LABEL: u32 = 0;
    pub(crate) const REPORT: u32 = 1;
}

/// Values of the oscillator's `fault`.
pub(crate) mod fault {
    pub(crate) const NONE: i32 = 1;
    pub(crate) const HALF: i32 = 2;
    pub(crate) const PANIC: i32 = 3;
    pub(crate) const WARN: i32 = 4;
    pub(crate) const TELL: i32 = 5;
}

/// One message, as formatted by `printf`.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Logged {
    pub(crate) instance: String,
    pub(crate) status: c_int,
    pub(crate) category: String,
    pub(crate) text: String,
}

pub(crate) type Log = Mutex<Vec<Logged>>;

/// Formats the message without arguments, as a logger in C would, and records it in the environment.
unsafe extern "C" fn record(
    environment: Handle,
    instance: *const c_char,
    status: c_int,
    category: *const c_char,
    message: *const c_char,
) {
    let mut text = [0; 2000];
    // SAFETY: the buffer has that size and the format stands alone; the strings are the layer's.
    let (instance, category, text) = unsafe {
        snprintf(text.as_mut_ptr(), text.len(), message);
        (string(instance), string(category), string(text.as_ptr()))
    };
    // SAFETY: the environment is the log that the host passed, which lives as long as the test.
    let log = unsafe { &*environment.cast::<Log>() };
    log.lock().unwrap().push(Logged { instance, status, category, text });
}

/// # Safety
/// A NUL-terminated string.
pub(crate) unsafe fn string(pointer: *const c_char) -> String {
    // SAFETY: the caller's promise.
    unsafe { CStr::from_ptr(pointer) }.to_str().unwrap().into()
}

/// A logger of fixed arguments, as the standard declares it.
type FixedLogger = unsafe extern "C" fn(Handle, *const c_char, c_int, *const c_char, *const c_char);

pub(crate) fn as_logger(logger: FixedLogger) -> CallbackLogger {
    // SAFETY: on the platforms that the tests run on, a function of fixed arguments can be called as a
    // variadic one when no further arguments are passed.
    unsafe { std::mem::transmute::<FixedLogger, CallbackLogger>(logger) }
}

pub(crate) fn callbacks(log: Option<&'static Log>) -> CallbackFunctions {
    CallbackFunctions {
        logger: log.map(|_| as_logger(record)),
        allocate_memory: None,
        free_memory: None,
        step_finished: None,
        component_environment: log.map_or(ptr::null_mut(), |log| ptr::from_ref(log).cast_mut().cast()),
    }
}

pub(crate) fn new_log() -> &'static Log {
    Box::leak(Box::default())
}

pub(crate) fn guid() -> CString {
    CString::new(Oscillator::table().guid()).unwrap()
}

/// An instance of the oscillator, freed at the end.
pub(crate) struct Fmu {
    pub(crate) c: Handle,
    log: &'static Log,
}

impl Drop for Fmu {
    fn drop(&mut self) {
        // SAFETY: any handle is allowed.
        unsafe { fmi2FreeInstance(self.c) };
    }
}

impl Fmu {
    pub(crate) fn new() -> Self {
        Self::with_logging(true)
    }

    pub(crate) fn with_logging(on: bool) -> Self {
        let log = new_log();
        let functions = callbacks(Some(log));
        // SAFETY: valid strings and callbacks, no resources.
        let c = unsafe {
            fmi2Instantiate(
                c"an instance".as_ptr(),
                1,
                guid().as_ptr(),
                ptr::null(),
                &raw const functions,
                0,
                c_int::from(on),
            )
        };
        assert!(!c.is_null(), "{:?}", log.lock().unwrap());
        Self { c, log }
    }

    /// Set up from 0 without stop time, in initialisation mode.
    pub(crate) fn initialising() -> Self {
        let fmu = Self::new();
        assert_eq!(fmu.setup(0.0, None), OK);
        assert_eq!(fmu.enter(), OK);
        fmu
    }

    /// Ready for the first step.
    pub(crate) fn stepping() -> Self {
        let fmu = Self::initialising();
        assert_eq!(fmu.exit(), OK);
        fmu
    }

    pub(crate) fn setup(&self, start: f64, stop: Option<f64>) -> c_int {
        let defined = c_int::from(stop.is_some());
        // SAFETY: plain values.
        unsafe { fmi2SetupExperiment(self.c, 0, 0.0, start, defined, stop.unwrap_or(f64::NAN)) }
    }

    pub(crate) fn enter(&self) -> c_int {
        // SAFETY: any handle is allowed.
        unsafe { fmi2EnterInitializationMode(self.c) }
    }

    pub(crate) fn exit(&self) -> c_int {
        // SAFETY: any handle is allowed.
        unsafe { fmi2ExitInitializationMode(self.c) }
    }

    pub(crate) fn step(&self, point: f64, step: f64) -> c_int {
        // SAFETY: plain values.
        unsafe { fmi2DoStep(self.c, point, step, 1) }
    }

    pub(crate) fn reset(&self) -> c_int {
        // SAFETY: any handle is allowed.
        unsafe { fmi2Reset(self.c) }
    }

    pub(crate) fn set(&self, vr: u32, value: f64) -> c_int {
        // SAFETY: one reference, one value.
        unsafe { fmi2SetReal(self.c, &raw const vr, 1, &raw const value) }
    }

    pub(crate) fn set_integer(&self, vr: u32, value: c_int) -> c_int {
        // SAFETY: one reference, one value.
        unsafe { fmi2SetInteger(self.c, &raw const vr, 1, &raw const value) }
    }

    pub(crate) fn set_boolean(&self, vr: u32, value: c_int) -> c_int {
        // SAFETY: one reference, one value.
        unsafe { fmi2SetBoolean(self.c, &raw const vr, 1, &raw const value) }
    }

    pub(crate) fn set_string(&self, vr: u32, value: &CStr) -> c_int {
        let pointer = value.as_ptr();
        // SAFETY: one reference, one string.
        unsafe { fmi2SetString(self.c, &raw const vr, 1, &raw const pointer) }
    }

    pub(crate) fn try_get(&self, vr: u32) -> Result<f64, c_int> {
        let mut value = f64::NAN;
        // SAFETY: one reference, room for one value.
        match unsafe { fmi2GetReal(self.c, &raw const vr, 1, &raw mut value) } {
            OK => Ok(value),
            status => Err(status),
        }
    }

    pub(crate) fn get(&self, vr: u32) -> f64 {
        self.try_get(vr).unwrap()
    }

    pub(crate) fn get_integer(&self, vr: u32) -> c_int {
        let mut value = -1;
        // SAFETY: one reference, room for one value.
        assert_eq!(OK, unsafe { fmi2GetInteger(self.c, &raw const vr, 1, &raw mut value) });
        value
    }

    pub(crate) fn get_boolean(&self, vr: u32) -> c_int {
        let mut value = -1;
        // SAFETY: one reference, room for one value.
        assert_eq!(OK, unsafe { fmi2GetBoolean(self.c, &raw const vr, 1, &raw mut value) });
        value
    }

    pub(crate) fn get_string(&self, vr: u32) -> String {
        let mut value = ptr::null();
        // SAFETY: one reference, room for one pointer, read before the next call.
        unsafe {
            assert_eq!(OK, fmi2GetString(self.c, &raw const vr, 1, &raw mut value));
            string(value)
        }
    }

    pub(crate) fn save(&self) -> Handle {
        let mut state = ptr::null_mut();
        // SAFETY: room for a handle.
        assert_eq!(OK, unsafe { fmi2GetFMUstate(self.c, &raw mut state) });
        assert!(!state.is_null());
        state
    }

    pub(crate) fn restore(&self, state: Handle) -> c_int {
        // SAFETY: any handle is allowed.
        unsafe { fmi2SetFMUstate(self.c, state) }
    }

    pub(crate) fn free_state(&self, state: &mut Handle) -> c_int {
        // SAFETY: a handle that may be changed.
        unsafe { fmi2FreeFMUstate(self.c, state) }
    }

    pub(crate) fn serialise(&self, state: Handle) -> Vec<u8> {
        let mut size = 0;
        // SAFETY: room for the size, and for as many bytes as were asked for.
        unsafe {
            assert_eq!(OK, fmi2SerializedFMUstateSize(self.c, state, &raw mut size));
            let mut bytes = vec![0; size];
            let status = fmi2SerializeFMUstate(self.c, state, bytes.as_mut_ptr().cast(), size);
            assert_eq!(OK, status);
            bytes
        }
    }

    pub(crate) fn deserialise(&self, bytes: &[u8]) -> Result<Handle, c_int> {
        let mut state = ptr::null_mut();
        let pointer = bytes.as_ptr().cast();
        // SAFETY: as many bytes as said, room for a handle.
        match unsafe { fmi2DeSerializeFMUstate(self.c, pointer, bytes.len(), &raw mut state) } {
            OK => Ok(state),
            status => Err(status),
        }
    }

    /// The messages since the last call.
    pub(crate) fn log(&self) -> Vec<Logged> {
        std::mem::take(&mut self.log.lock().unwrap())
    }

    /// The text of the only message since the last call.
    pub(crate) fn message(&self) -> String {
        let log = self.log();
        assert_eq!(log.len(), 1, "{log:?}");
        log[0].text.clone()
    }
}
