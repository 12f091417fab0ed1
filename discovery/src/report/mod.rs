//! The report: one self-contained HTML file for a person with two minutes.

mod data;

pub use data::*;
