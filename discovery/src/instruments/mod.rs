//! What the instruments add to recordings beside white noise, and how it is found.

mod before;
mod clock;
pub(crate) mod clock_offset;
pub(crate) mod clocks;
mod exchange;
pub(crate) mod expected;
pub(crate) mod latents;
pub(crate) mod mismatch;
mod origins;
mod scoring;
mod sizing;
mod summary;
#[cfg(test)]
mod tests;
pub(crate) mod undoing;
mod wandering;

pub(crate) use clock::late_lengths;
pub(crate) use sizing::{Sizing, less_by_one, less_drifts_of_lengths, parameters};
pub(crate) use summary::summary;
