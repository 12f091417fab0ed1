//! Export a Rust model as an FMI 2.0 co-simulation FMU.

pub mod description;
mod model;

pub use model::{Experiment, LogEntry, Model, ModelError, Status, StepError, Value};
