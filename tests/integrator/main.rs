//! The integrator on problems with known answers.

mod accuracy;
#[path = "../../benches/step/circle.rs"]
mod circle;
mod cost;
mod explicit;
mod failures;
mod problems;
mod scenarios;
