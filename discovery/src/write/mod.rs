//! What a discovery is written as: `discovery.json`, `gap.csv`, and the report's data.
//!
//! Everything here makes text or plain data out of a [`Discovery`](crate::outcome::Discovery); nothing touches files.

mod detection;
mod effect;
mod json;
mod label;
mod moment;
mod report;
mod series;
mod signature;
mod table;
mod trials;

pub use json::discovery_json;
pub use label::{errors, label, law, parameters, place, sizes};
pub(crate) use label::{in_numbers, in_place};
pub use report::{About, report};
pub use table::{COLUMNS, gap_csv};

#[cfg(test)]
pub(crate) mod fixture;
#[cfg(test)]
mod tests;
