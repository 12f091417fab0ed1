//! The host's side: its callbacks.

use std::ffi::{CStr, CString, c_int, c_void};

use super::{ComponentEnvironment, Enumeration, String as FmiString};
use crate::log::Message;

/// `fmi2CallbackLogger`.
pub type CallbackLogger = unsafe extern "C" fn(
    environment: ComponentEnvironment,
    instance_name: FmiString,
    status: Enumeration,
    category: FmiString,
    message: FmiString,
    ...
);

/// `fmi2CallbackFunctions`. The memory functions and `stepFinished` are not used.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct CallbackFunctions {
    /// Takes messages; may be null.
    pub logger: Option<CallbackLogger>,
    /// Not used: the FMU has its own memory.
    pub allocate_memory: Option<unsafe extern "C" fn(usize, usize) -> *mut c_void>,
    /// Not used: the FMU has its own memory.
    pub free_memory: Option<unsafe extern "C" fn(*mut c_void)>,
    /// Not used: steps do not run in the background.
    pub step_finished: Option<unsafe extern "C" fn(ComponentEnvironment, Enumeration)>,
    /// Handed back with each message.
    pub component_environment: ComponentEnvironment,
}

/// Where an instance's messages go.
pub(super) struct Host {
    logger: Option<CallbackLogger>,
    environment: ComponentEnvironment,
    name: CString,
}

// SAFETY: the environment is the host's own and only ever handed back to it, and the logger is called
// on whatever thread the host itself calls from, as the standard has it.
unsafe impl Send for Host {}
// SAFETY: as above; nothing here changes after it was made.
unsafe impl Sync for Host {}

impl Host {
    pub(super) fn new(functions: &CallbackFunctions, name: &CStr) -> Self {
        Self { logger: functions.logger, environment: functions.component_environment, name: name.to_owned() }
    }

    pub(super) fn deliver(&self, messages: &[Message]) {
        let Some(logger) = self.logger else {
            return;
        };
        for message in messages {
            let category = c_text(&message.category);
            let text = c_text(&escaped(&message.text));
            let status = message.status as c_int;
            // SAFETY: the host gave this function for this use; the strings are NUL-terminated, live
            // through the call, and the text holds no format that would read further arguments.
            unsafe {
                logger(self.environment, self.name.as_ptr(), status, category.as_ptr(), text.as_ptr());
            }
        }
    }
}

/// The logger reads its message as a `printf` format. Doubling each `%` also suits hosts that print
/// the message as it comes, for which `"%s"` and an argument would be lost.
fn escaped(text: &str) -> String {
    text.replace('%', "%%")
}

/// For C: a NUL inside would end the text early.
fn c_text(text: &str) -> CString {
    CString::new(text.replace('\0', "\u{fffd}")).unwrap_or_default()
}
