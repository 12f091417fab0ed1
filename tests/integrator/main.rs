//! The integrator on problems with known answers.

mod accuracy;
mod cost;
mod explicit;
mod failures;
mod problems;
mod scenarios;
