//! Finds the physical effect a cable-robot simulation is missing.

pub mod report;
