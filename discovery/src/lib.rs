//! Finds the physical effect a cable-robot simulation is missing.
//!
//! Measured trials go in ([`data`]), a [`outcome::Discovery`] comes out ([`discover`]). The way there: the model is
//! linearised along the smoothed trajectory of the data; a Kalman filter whitens the innovations; the signature of every
//! effect of the catalogue passes through the same filter, so that least squares becomes generalised least squares; the
//! best is taken up, refined on the full model, compared with its rivals, and kept if it earns its place on held-out data.

pub mod calibrate;
pub mod data;
pub mod experiment;
pub mod journal;
mod onset;
pub mod outcome;
pub mod report;
pub mod write;

mod alike;
mod by_block;
mod candidates;
mod check;
mod clock_offset;
mod conclude;
mod delayed;
mod detection;
mod discover;
mod drift;
mod entrance;
mod estimate;
mod every_cable;
mod expected;
mod extension;
mod fitted;
mod form;
#[cfg(test)]
mod fuzz;
mod gap;
mod instruments;
mod kalman;
mod late;
mod likelihood_ratio;
mod limits;
mod model;
mod null_test;
mod pair;
mod path;
mod randomness;
mod refine;
mod regression;
mod rivals;
mod round;
mod search;
mod second_look;
mod sensor_slopes;
mod settle;
mod shelf;
mod signature;
mod sizes;
mod spectrum;
mod stability;
mod stream;
mod survey;
mod term;
mod variation;
mod vector;
mod verdict;
mod verify;
mod whiten;

pub use discover::{DiscoverError, Geometry, discover};
pub use estimate::FitError;
pub use search::Progress;
