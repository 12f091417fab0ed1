//! Finds the physical effect a cable-robot simulation is missing.
//!
//! Measured trials go in ([`data`]), a [`outcome::Discovery`] comes out ([`discover`]). The way there: the model is
//! linearised along the smoothed trajectory of the data; a Kalman filter whitens the innovations; the signature of every
//! effect of the catalogue passes through the same filter, so that least squares becomes generalised least squares; the
//! best is taken up, refined on the full model, compared with its rivals, and kept if it earns its place on held-out data.
//!
//! The folders follow that way: `data`, `model` (states, sensors, what is random), `filter` (trajectories, linear models,
//! whitening), `instruments`, `hypothesis` (what each effect would add), `weigh` (regression, criterion, chance), `strategy` (the
//! steps of the search) and `verdict`.

pub mod calibrate;
pub mod data;
pub mod experiment;
pub mod journal;
pub mod outcome;
pub mod report;
pub mod write;

mod check;
mod discover;
mod filter;
#[cfg(test)]
mod fuzz;
mod hypothesis;
mod instruments;
mod model;
mod strategy;
mod verdict;
mod weigh;

pub use discover::{DiscoverError, Geometry, Settings, discover, usual_time_limit};
pub use filter::error::FitError;
pub use strategy::context::Progress;
