//! The verdict: what may be said of what was found.
//!
//! Judging is a pure function of facts. A verdict claims no more than they carry: that nothing is missing only where the
//! model follows the data to their noise, or where what is left is a force at random too small to matter; an effect's name
//! alone only where nothing but noise is left beside it. How far a free run tells of the model at all depends on how fast
//! the robot lets an error grow; so gaps count in multiples of what a model without fault would leave.

pub(crate) mod alike;
pub(crate) mod by_block;
mod by_recording;
pub(crate) mod changed;
pub(crate) mod conclude;
pub(crate) mod detection;
mod doubted;
mod drifts;
mod facts;
mod free_runs;
pub(crate) mod gap;
mod growth;
mod judge;
mod one_clock;
mod policy;
mod remaining;
pub(crate) mod stability;
#[cfg(test)]
mod tests;
pub(crate) mod verify;
mod words;

pub(crate) use facts::{
    Disturbance, EffectFacts, Facts, HorizonFacts, left, out_of_range, relative_error, share_taken,
};
pub(crate) use free_runs::widened;
pub(crate) use growth::{Reach, Reaches, attainable};
pub(crate) use judge::{Judgement, beats, judge, may_be_chance, shows};
pub(crate) use policy::POLICY;
pub(crate) use remaining::remaining;
pub(crate) use words::{left_over, sentence};
