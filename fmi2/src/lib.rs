#![doc = include_str!("../README.md")]

pub mod abi;
pub mod description;
mod failure;
mod instance;
mod log;
mod lookup;
mod model;
mod snapshot;
mod state;
mod uri;

pub use model::{Experiment, LogEntry, Model, ModelError, Status, StepError, Value};

/// The names of all C functions that [`export!`] defines, for those who pack or check a binary.
pub fn exported_functions() -> impl Iterator<Item = &'static str> {
    const WITHOUT_INSTANCE: [&str; 4] =
        ["fmi2GetTypesPlatform", "fmi2GetVersion", "fmi2Instantiate", "fmi2FreeInstance"];
    let on_instance = state::Function::ALL.iter().map(|function| function.name());
    WITHOUT_INSTANCE.into_iter().chain(on_instance)
}
