//! One instance of a model under the rules of FMI: safe Rust, without the C types.

mod declared;
mod derivatives;
mod lifecycle;
mod named;
mod saving;
mod stepping;
mod variables;

pub(crate) use stepping::StatusKind;

use std::any::Any;
use std::collections::HashMap;
use std::ffi::CString;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::Arc;

use crate::failure::{Failure, Outcome};
use crate::log::{Filter, Message};
use crate::model::{Model, Status, Value};
use crate::snapshot::{Progress, Snapshot};
use crate::state::{Function, State};
use declared::Declared;
use named::Named;

/// A model and what the layer keeps beside it.
pub(crate) struct Instance<M> {
    model: M,
    declared: Arc<Declared>,
    progress: Progress,
    saved: HashMap<usize, Snapshot>,
    filter: Filter,
    /// Strings handed out by the last `fmi2GetString` and `fmi2GetStringStatus`; the host copies them
    /// before its next call.
    strings: Vec<CString>,
    /// Room for the values of a set call between checking and setting.
    checked: Vec<(usize, Value)>,
    /// The same for Real variables.
    assignments: Vec<(usize, f64)>,
    /// The Real variables that were read last, and those that were set last.
    read: Named,
    set: Named,
    /// Room for the values of a call that reads.
    numbers: Vec<f64>,
}

impl<M: Model> Instance<M> {
    /// A fresh instance.
    ///
    /// A panic of the model passes through; the caller is the one that guards.
    pub(crate) fn new(resources: Option<&Path>, guid: &str, logging_on: bool) -> Outcome<Self> {
        let model = M::instantiate(resources)
            .map_err(|error| Failure::refused(format!("the model cannot be built: {error}")))?;
        let table = model.description();
        if table.model_identifier != M::MODEL_IDENTIFIER {
            return Err(Failure::refused(format!(
                "the description names the model `{}`, the binary is `{}`",
                table.model_identifier,
                M::MODEL_IDENTIFIER
            )));
        }
        let declared = Declared::of(table);
        let own_guid = &declared.guid;
        if guid != own_guid {
            let looked = match resources {
                Some(folder) => format!("with the resources in {}", folder.display()),
                None => "without resources, since no usable fmuResourceLocation was given,".to_owned(),
            };
            let tool = table.generation_tool.as_deref().map_or(String::new(), |tool| format!(" with {tool}"));
            return Err(Failure::refused(format!(
                "GUID {guid} of modelDescription.xml does not match {own_guid}, which is this FMU's {looked}; where \
                 these were changed, pack the FMU anew{tool}: binary, resources and XML belong together"
            )));
        }
        Ok(Self {
            filter: Filter::new(Arc::clone(&declared.log_categories), logging_on),
            declared,
            progress: Progress::default(),
            saved: HashMap::new(),
            strings: Vec::new(),
            checked: Vec::new(),
            assignments: Vec::new(),
            read: Named::default(),
            set: Named::default(),
            numbers: Vec::new(),
            model,
        })
    }

    /// The guard around every call: checks the state, catches panics, settles status and messages.
    ///
    /// What the model warns of goes to the log only. Many hosts end a run at anything but `fmi2OK`, and a warning
    /// is no reason to.
    ///
    /// The messages are for the host's logger, to be delivered after the instance is free again, so
    /// that a logger that calls back does not block itself.
    pub(crate) fn call(
        &mut self,
        function: Function,
        body: impl FnOnce(&mut Self) -> Outcome,
    ) -> (Status, Vec<Message>) {
        let outcome = if function.is_legal_in(self.progress.state) {
            catch_unwind(AssertUnwindSafe(|| body(self)))
                .unwrap_or_else(|panic| Err(Failure::Broken(panic_text(panic.as_ref()))))
        } else {
            Err(Failure::Refused(format!("not allowed in state `{}`", self.progress.state.name())))
        };
        let from_model = catch_unwind(AssertUnwindSafe(|| self.model.take_log())).unwrap_or_default();
        let mut status = Status::Ok;
        let mut messages = Vec::new();
        for entry in from_model {
            messages.push(Message { status: entry.status, category: entry.category, text: entry.message });
        }
        if let Err(failure) = outcome {
            status = failure.status();
            if matches!(failure, Failure::Broken(_)) {
                self.progress.state = State::Error;
            }
            let text = format!("{}: {failure}", function.name());
            messages.push(Message::of_layer(status, text));
        }
        messages.retain(|message| self.filter.passes(message));
        (status, messages)
    }

    pub(crate) fn set_debug_logging(&mut self, on: bool, categories: &[&str]) -> Outcome {
        self.filter.switch(on, categories)
    }

    /// Is this message wanted by the host?
    pub(crate) fn wants(&self, message: &Message) -> bool {
        self.filter.passes(message)
    }

    /// The name of a variable, for messages.
    fn name(&self, index: usize) -> &str {
        &self.declared.table.variables[index].name
    }
}

/// What a panic said, for the log.
pub(crate) fn panic_text(panic: &(dyn Any + Send)) -> String {
    let said = panic
        .downcast_ref::<&str>()
        .copied()
        .or_else(|| panic.downcast_ref::<String>().map(String::as_str))
        .unwrap_or("no message");
    format!("the model panicked: {said}")
}
