//! A value for each state, kept in groups of four, and what a call of the integrator works with.

use std::ops::{Deref, DerefMut};

use bytemuck::{cast_slice, cast_slice_mut};
use wide::f64x4;

/// Values of one group.
pub(super) type Group = f64x4;

/// Groups that a call works with, by the number of states: as few as suffice for the plant of four cables without effects, for one
/// with a state of effects on each cable or with two, twice as many as the first, or as many as the largest plant has
/// ([`MOST_STATES`]).
pub(super) const FEW: usize = 4;
pub(super) const FEW_AND_ONE: usize = 5;
pub(super) const SOME: usize = 6;
pub(super) const MORE: usize = 8;
pub(super) const MOST: usize = 32;

/// Most states that a system may have: those of twelve cables with all states that effects may have, and a few.
pub const MOST_STATES: usize = 4 * MOST;

/// A value for each state, room for `GROUPS` groups. It reads as a slice; the loops that a step spends its time in go over the
/// groups, the last one filled up with zeros, so that the compiler can work on several states at once.
#[derive(Clone, Copy, Debug)]
pub(super) struct Vector<const GROUPS: usize> {
    groups: [Group; GROUPS],
    len: usize,
}

impl<const GROUPS: usize> Vector<GROUPS> {
    #[inline(always)]
    pub(super) fn zeros(len: usize) -> Self {
        Self { groups: [Group::ZERO; GROUPS], len }
    }

    /// Groups that the loops go over: those in use, or all where these are few, so that the compiler can unroll them.
    #[inline]
    fn used(&self) -> usize {
        if GROUPS <= SOME { GROUPS } else { self.len.div_ceil(4) }
    }

    #[inline]
    pub(super) fn groups(&self) -> &[Group] {
        &self.groups[..self.used()]
    }

    /// Takes up what was kept.
    #[inline]
    pub(super) fn take_up(&mut self, kept: &Kept) {
        let groups = self.groups_mut();
        groups.copy_from_slice(&kept.groups[..groups.len()]);
    }

    #[inline]
    pub(super) fn groups_mut(&mut self) -> &mut [Group] {
        let used = self.used();
        &mut self.groups[..used]
    }
}

impl<const GROUPS: usize> Deref for Vector<GROUPS> {
    type Target = [f64];

    #[inline]
    fn deref(&self) -> &[f64] {
        &cast_slice(&self.groups)[..self.len]
    }
}

impl<const GROUPS: usize> DerefMut for Vector<GROUPS> {
    #[inline]
    fn deref_mut(&mut self) -> &mut [f64] {
        &mut cast_slice_mut(&mut self.groups)[..self.len]
    }
}

/// A value for each state, kept from one call to the next: in groups, as many as a call works with, so that it is copied at once.
#[derive(Clone, Debug)]
pub(super) struct Kept {
    groups: Vec<Group>,
    len: usize,
}

impl Kept {
    pub(super) fn zeros(len: usize) -> Self {
        let used = len.div_ceil(4);
        let groups = [FEW, FEW_AND_ONE, SOME].into_iter().find(|room| used <= *room).unwrap_or(used);
        Self { groups: vec![Group::ZERO; groups], len }
    }

    #[inline]
    pub(super) fn keep<const GROUPS: usize>(&mut self, vector: &Vector<GROUPS>) {
        let groups = vector.groups();
        self.groups[..groups.len()].copy_from_slice(groups);
    }
}

impl Deref for Kept {
    type Target = [f64];

    #[inline]
    fn deref(&self) -> &[f64] {
        &cast_slice(&self.groups)[..self.len]
    }
}

impl DerefMut for Kept {
    #[inline]
    fn deref_mut(&mut self) -> &mut [f64] {
        &mut cast_slice_mut(&mut self.groups)[..self.len]
    }
}

/// What a call works with and nothing after it needs: it lies on the stack, so that an instance carries only what it must keep,
/// and many that step in turn leave each other's in the processor's caches.
pub(super) struct Work<const GROUPS: usize> {
    /// What an error in each state weighs: one over its scale and the tolerance.
    pub(super) weight: Vector<GROUPS>,
    /// Rates at the start of the step.
    pub(super) rates: Vector<GROUPS>,
    /// Stage increments `Y_s - y` of an implicit step, transformed.
    pub(super) w: [Vector<GROUPS>; 3],
    /// What the corrections of Newton's method have added to the guess.
    pub(super) lead: [Vector<GROUPS>; 3],
    /// How much more that was than in the step before.
    pub(super) rise: [Vector<GROUPS>; 3],
    /// Rates at the three stages of an implicit step, or at the second to the seventh of an explicit one.
    pub(super) f: [Vector<GROUPS>; 6],
    pub(super) error: Vector<GROUPS>,
    /// Real and imaginary parts.
    pub(super) complex: [Vector<GROUPS>; 2],
    /// A state on the way of the step.
    pub(super) stage: Vector<GROUPS>,
    /// Start of the step, and the stages; the last one is its end.
    pub(super) start: Vector<GROUPS>,
    pub(super) full: [Vector<GROUPS>; 3],
}

impl<const GROUPS: usize> Work<GROUPS> {
    #[inline]
    pub(super) fn new(dimension: usize) -> Self {
        // Each made in its place: none is copied there.
        let zeros = || Vector::zeros(dimension);
        Self {
            weight: zeros(),
            rates: zeros(),
            w: [zeros(), zeros(), zeros()],
            lead: [zeros(), zeros(), zeros()],
            rise: [zeros(), zeros(), zeros()],
            f: [zeros(), zeros(), zeros(), zeros(), zeros(), zeros()],
            error: zeros(),
            complex: [zeros(), zeros()],
            stage: zeros(),
            start: zeros(),
            full: [zeros(), zeros(), zeros()],
        }
    }

    /// Root mean square of `values`, weighed.
    #[inline]
    pub(super) fn norm(&self, values: &Vector<GROUPS>) -> f64 {
        let mut sum = Group::ZERO;
        for (value, weight) in values.groups().iter().zip(self.weight.groups()) {
            let weighed = *value * *weight;
            sum += weighed * weighed;
        }
        root_mean(sum, values.len())
    }
}

/// Root mean square over `count` values of a sum of squares by groups.
#[inline]
pub(super) fn root_mean(sum: Group, count: usize) -> f64 {
    let [a, b, c, d] = sum.to_array();
    (((a + c) + (b + d)) / count as f64).sqrt()
}
