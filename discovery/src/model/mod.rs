//! The model under examination: what its states are, what its sensors show, what is random beside it, and its sizes.

pub(crate) mod delayed;
pub(crate) mod examined;
pub(crate) mod randomness;
pub(crate) mod sizes;
pub(crate) mod state_size;
