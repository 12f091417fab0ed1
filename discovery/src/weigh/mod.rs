//! Weighing: how well candidates explain the innovations, by which criterion, and what chance would explain.

pub(crate) mod chance;
pub(crate) mod criterion;
pub(crate) mod likelihood_ratio;
pub(crate) mod lost;
pub(crate) mod proposal;
pub(crate) mod refine;
pub(crate) mod regression;
pub(crate) mod signatures;
pub(crate) mod solve;
