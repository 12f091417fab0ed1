//! Finds the physical effect a cable-robot simulation is missing.

pub mod data;
pub mod report;

mod candidates;
mod clean;
mod estimate;
mod gap;
mod kalman;
mod model;
pub mod outcome;
mod path;
mod regression;
mod search;
mod signature;
pub use search::probe;
