//! When an effect begins and ends: a fault comes while one records.
//!
//! Where an effect stands and something is left, its signature is cut into segments of time, and every course is weighed that
//! it may have taken: at work from a time on, until a time, between two, or with another size from a time on (generalised
//! likelihood ratio: A. S. Willsky and H. L. Jones, IEEE Trans. Automatic Control 21 (1976), 108). The best is fitted in full,
//! its times located on ever shorter segments. Times are on the clock of each trial and the same in all of them; the
//! held-out trials say whether that is so.

mod locate;
mod look;
mod segments;
#[cfg(test)]
mod tests;
mod times;

pub(crate) use locate::time_errors;
pub(crate) use look::for_a_while;
pub(crate) use times::{onset, settle_times};
