//! A value for each state, kept in groups of four.

use std::ops::{Deref, DerefMut};

/// Values of one group.
pub(super) type Group<T = f64> = [T; 4];

/// A value for each state. It reads as a slice; the loops that a step spends its time in go over the groups, the last one filled
/// up with zeros, so that the compiler can work on several states at once.
#[derive(Clone, Debug)]
pub(super) struct Vector {
    groups: Vec<Group>,
    len: usize,
}

impl Vector {
    pub(super) fn zeros(len: usize) -> Self {
        Self { groups: vec![[0.0; 4]; len.div_ceil(4)], len }
    }

    #[inline]
    pub(super) fn groups(&self) -> &[Group] {
        &self.groups
    }

    #[inline]
    pub(super) fn groups_mut(&mut self) -> &mut [Group] {
        &mut self.groups
    }
}

impl Deref for Vector {
    type Target = [f64];

    #[inline]
    fn deref(&self) -> &[f64] {
        &self.groups.as_flattened()[..self.len]
    }
}

impl DerefMut for Vector {
    #[inline]
    fn deref_mut(&mut self) -> &mut [f64] {
        &mut self.groups.as_flattened_mut()[..self.len]
    }
}

/// `f` of the values in each place of a group.
#[inline(always)]
pub(super) fn each<T>(f: impl FnMut(usize) -> T) -> Group<T> {
    std::array::from_fn(f)
}

/// Root mean square over `count` values of a sum of squares by groups.
#[inline]
pub(super) fn root_mean(sum: Group, count: usize) -> f64 {
    (((sum[0] + sum[2]) + (sum[1] + sum[3])) / count as f64).sqrt()
}
