//! Weighing: how well candidates explain the innovations, by which criterion, and what chance would explain.

pub(crate) mod likelihood_ratio;
pub(crate) mod null_test;
pub(crate) mod refine;
pub(crate) mod regression;
