//! The strategy: the steps of the search, a file each, and the loop that takes them.

pub(crate) mod asked;
pub(crate) mod begin;
pub(crate) mod candidates;
pub(crate) mod context;
pub(crate) mod drift;
mod each_cable;
pub(crate) mod elasticity;
pub(crate) mod entrance;
pub(crate) mod every_cable;
pub(crate) mod evident_delay;
pub(crate) mod fitted;
pub(crate) mod fitting;
#[cfg(test)]
pub(crate) mod fixture;
pub(crate) mod form;
pub(crate) mod geometry;
pub(crate) mod given_sizes;
pub(crate) mod instruments;
pub(crate) mod late_winches;
pub(crate) mod lost_forces;
pub(crate) mod one_friction;
pub(crate) mod onset;
pub(crate) mod other_optimum;
pub(crate) mod pair;
pub(crate) mod policy;
pub(crate) mod prune;
pub(crate) mod rivals;
pub(crate) mod round;
pub(crate) mod rounds;
pub(crate) mod search;
pub(crate) mod second_look;
pub(crate) mod settle;
pub(crate) mod standing;
pub(crate) mod terms;
pub(crate) mod time_limit;
pub(crate) mod undoing;
