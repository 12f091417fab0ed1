//! What reaches the host's log.

use std::borrow::Cow;
use std::collections::HashSet;
use std::sync::Arc;

use crate::failure::{Failure, Outcome};
use crate::model::Status;

/// A message that passed the filter.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Message {
    pub(crate) status: Status,
    pub(crate) category: Cow<'static, str>,
    pub(crate) text: String,
}

impl Message {
    /// A message of the layer, under the standard's category for its status.
    pub(crate) fn of_layer(status: Status, text: String) -> Self {
        let category = match status {
            Status::Ok => "logAll",
            Status::Warning => "logStatusWarning",
            Status::Discard => "logStatusDiscard",
            Status::Error | Status::Fatal | Status::Pending => "logStatusError",
        };
        Self { status, category: category.into(), text }
    }
}

/// Which categories the host switched on.
#[derive(Debug)]
pub(crate) struct Filter {
    known: Arc<[String]>,
    on: HashSet<String>,
}

impl Filter {
    /// All categories on, or all off.
    pub(crate) fn new(known: Arc<[String]>, logging_on: bool) -> Self {
        let mut filter = Self { known, on: HashSet::new() };
        if logging_on {
            filter.on.extend(filter.known.iter().cloned());
        }
        filter
    }

    /// `fmi2SetDebugLogging`: on for exactly these categories (all, if there are none), or off.
    pub(crate) fn switch(&mut self, logging_on: bool, categories: &[&str]) -> Outcome {
        if let Some(unknown) = categories.iter().find(|wanted| !self.known.iter().any(|known| known == *wanted)) {
            return Err(Failure::refused(format!("log category `{unknown}` is not one of {}", self.known.join(", "))));
        }
        self.on.clear();
        if logging_on && categories.is_empty() {
            self.on.extend(self.known.iter().cloned());
        } else if logging_on {
            self.on.extend(categories.iter().map(|&c| c.to_owned()));
        }
        Ok(())
    }

    /// What is not well always passes. A host that gets `fmi2Error` or `fmi2Discard` must be able to find out why, and
    /// a warning is told nowhere else: the call returns `fmi2OK`. The categories choose among the rest.
    pub(crate) fn passes(&self, message: &Message) -> bool {
        message.status > Status::Ok || self.on.contains("logAll") || self.on.contains(message.category.as_ref())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(status: Status, category: &'static str) -> Message {
        Message { status, category: category.into(), text: String::new() }
    }

    fn passing(filter: &Filter) -> Vec<&'static str> {
        ["logEvents", "logSolver"].into_iter().filter(|c| filter.passes(&message(Status::Ok, c))).collect()
    }

    #[test]
    fn categories_switch_on_and_off() {
        let known = ["logEvents", "logSolver", "logAll"];
        let mut filter = Filter::new(known.map(String::from).into(), false);
        assert!(passing(&filter).is_empty());

        filter.switch(true, &["logEvents"]).unwrap();
        assert_eq!(passing(&filter), ["logEvents"]);

        filter.switch(true, &[]).unwrap();
        assert_eq!(passing(&filter), ["logEvents", "logSolver"]);

        filter.switch(true, &["logEvents", "noSuch"]).unwrap_err();
        assert_eq!(passing(&filter).len(), 2, "a refused call changes nothing");

        filter.switch(true, &["logAll"]).unwrap();
        assert_eq!(passing(&filter), ["logEvents", "logSolver"]);

        filter.switch(false, &["logEvents"]).unwrap();
        assert!(passing(&filter).is_empty());
    }

    #[test]
    fn what_is_not_well_passes_whatever_is_switched_on() {
        let filter = Filter::new(["logModel".into()].into(), false);
        for status in [Status::Warning, Status::Discard, Status::Error] {
            assert!(filter.passes(&Message::of_layer(status, String::new())), "{status:?}");
            assert!(filter.passes(&message(status, "logModel")), "{status:?}");
        }
    }
}
