//! `fmi2Instantiate` and `fmi2FreeInstance`: before an instance exists, and when it goes.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::ptr;
use std::sync::Arc;

use super::handles::{Held, Live};
use super::host::{CallbackFunctions, Host};
use super::{Boolean, Component, Enumeration, String as FmiString, arguments};
use crate::failure::{Failure, Outcome};
use crate::instance::{Instance, panic_text};
use crate::log::Message;
use crate::model::{Model, Status};
use crate::uri::{LocationError, resource_folder};

const CO_SIMULATION: Enumeration = 1;

/// `fmi2Instantiate`. Null where there is no instance, with the reason in the host's log.
///
/// # Safety
/// Pointers are null or as FMI 2.0 describes them.
#[expect(clippy::too_many_arguments, reason = "as many as the standard has, beside the instances")]
pub unsafe fn instantiate<M: Model>(
    live: &Live<M>,
    instance_name: FmiString,
    fmu_type: Enumeration,
    guid: FmiString,
    resource_location: FmiString,
    functions: *const CallbackFunctions,
    _visible: Boolean,
    logging_on: Boolean,
) -> Component {
    // SAFETY: the caller's promise.
    let Ok(functions) = (unsafe { arguments::input("functions", functions, 1, 1) }) else {
        return ptr::null_mut();
    };
    // SAFETY: the caller's promise.
    let name = unsafe { arguments::c_str("instanceName", instance_name) };
    let host = Host::new(&functions[0], name.as_ref().copied().unwrap_or_default());
    let build = || -> Outcome<(Instance<M>, Option<Message>)> {
        if name?.is_empty() {
            return Err(Failure::refused("instanceName is empty"));
        }
        if fmu_type != CO_SIMULATION {
            return Err(Failure::refused(format!(
                "fmuType {fmu_type}: this FMU is for co-simulation ({CO_SIMULATION}) only"
            )));
        }
        // SAFETY: the caller's promise.
        let guid = unsafe { arguments::text("fmuGUID", guid) }?;
        // SAFETY: the caller's promise.
        let (folder, message) = unsafe { resources(resource_location) };
        let instance = Instance::new(folder.as_deref(), guid, logging_on != 0)?;
        Ok((instance, message))
    };
    let outcome =
        catch_unwind(AssertUnwindSafe(build)).unwrap_or_else(|panic| Err(Failure::Broken(panic_text(panic.as_ref()))));
    match outcome {
        Ok((instance, message)) => {
            let message = message.filter(|message| instance.wants(message));
            host.deliver(message.as_slice());
            let host = Arc::new(host);
            let component = live.insert(Held { host: Arc::clone(&host), instance });
            if component.is_null() {
                let text = "fmi2Instantiate: too many instances are alive".to_owned();
                host.deliver(&[Message::of_layer(Status::Error, text)]);
            }
            component
        }
        Err(failure) => {
            let text = format!("fmi2Instantiate: {failure}");
            host.deliver(&[Message::of_layer(Status::Error, text)]);
            ptr::null_mut()
        }
    }
}

/// The resource folder, or none and why; a model that needs the folder refuses to be built.
///
/// # Safety
/// `location` is null or a C string.
unsafe fn resources(location: FmiString) -> (Option<PathBuf>, Option<Message>) {
    if location.is_null() {
        return (None, None);
    }
    let message = |status, problem: String| {
        let text = format!("fmi2Instantiate: {problem}");
        (None, Some(Message::of_layer(status, text)))
    };
    // SAFETY: the caller's promise.
    let text = match unsafe { arguments::text("fmuResourceLocation", location) } {
        Ok("") => return (None, None),
        Ok(text) => text,
        Err(failure) => return message(Status::Warning, failure.to_string()),
    };
    match resource_folder(text) {
        Ok(folder) => (Some(folder), None),
        Err(missing @ LocationError::Missing(_)) => message(Status::Ok, missing.to_string()),
        Err(unusable) => message(Status::Warning, unusable.to_string()),
    }
}

/// `fmi2FreeInstance`. Null, and what is no live instance, is ignored.
pub fn free_instance<M: Model>(live: &Live<M>, component: Component) {
    let held = live.remove(component);
    // A model may panic while it is dropped; there is nobody left to tell.
    let _ = catch_unwind(AssertUnwindSafe(|| drop(held)));
}
