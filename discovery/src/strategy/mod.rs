//! The strategy: the steps of the search, a file each, and the loop that takes them.

pub(crate) mod drift;
pub(crate) mod entrance;
pub(crate) mod every_cable;
pub(crate) mod fitted;
pub(crate) mod form;
pub(crate) mod limits;
pub(crate) mod onset;
pub(crate) mod pair;
pub(crate) mod rivals;
pub(crate) mod round;
pub(crate) mod search;
pub(crate) mod second_look;
pub(crate) mod settle;
