//! A value for each cable of a robot.

use std::fmt;
use std::ops::{Deref, DerefMut};

use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Most cables that a robot may have.
pub const MAX_CABLES: usize = 12;

/// One value for each of a robot's cables, in their order; at most [`MAX_CABLES`]. Kept inline, so that a simulation step
/// allocates nothing. It reads as a slice.
#[derive(Clone, Copy)]
pub struct PerCable<T> {
    values: [T; MAX_CABLES],
    count: usize,
}

impl<T: Copy> PerCable<T> {
    /// The values that `value` gives for cable `0..count`.
    ///
    /// # Panics
    /// When `count` is zero or above [`MAX_CABLES`]; [`crate::parameters::Parameters::check`] admits no such robot.
    #[inline]
    pub fn from_fn(count: usize, mut value: impl FnMut(usize) -> T) -> Self {
        let mut values = [value(0); MAX_CABLES];
        for (i, slot) in values.iter_mut().enumerate().take(count).skip(1) {
            *slot = value(i);
        }
        assert!((1..=MAX_CABLES).contains(&count), "{count} cables");
        Self { values, count }
    }

    /// The same value for `count` cables.
    #[inline]
    pub fn filled(count: usize, value: T) -> Self {
        assert!((1..=MAX_CABLES).contains(&count), "{count} cables");
        Self { values: [value; MAX_CABLES], count }
    }

    /// The values of `slice`, one a cable; `None` where that is none or more than [`MAX_CABLES`].
    pub fn from_slice(slice: &[T]) -> Option<Self> {
        (1..=MAX_CABLES).contains(&slice.len()).then(|| Self::from_fn(slice.len(), |i| slice[i]))
    }

    /// All places, those beyond the last cable filled up by some cable's value: for loops of a fixed length.
    #[inline]
    pub(crate) fn padded<const LANES: usize>(&self) -> [T; LANES] {
        const { assert!(LANES <= MAX_CABLES) };
        std::array::from_fn(|i| self.values[i])
    }

    /// What `f` makes of each value.
    #[inline]
    pub fn map<U: Copy>(&self, mut f: impl FnMut(T) -> U) -> PerCable<U> {
        PerCable::from_fn(self.count, |i| f(self.values[i]))
    }
}

impl<T> Deref for PerCable<T> {
    type Target = [T];

    #[inline]
    fn deref(&self) -> &[T] {
        &self.values[..self.count]
    }
}

impl<T> DerefMut for PerCable<T> {
    #[inline]
    fn deref_mut(&mut self) -> &mut [T] {
        &mut self.values[..self.count]
    }
}

impl<T: Copy, const N: usize> From<[T; N]> for PerCable<T> {
    /// As many cables as the array has entries.
    fn from(values: [T; N]) -> Self {
        const { assert!(0 < N && N <= MAX_CABLES) };
        Self::from_fn(N, |i| values[i])
    }
}

impl<T> IntoIterator for PerCable<T> {
    type Item = T;
    type IntoIter = std::iter::Take<std::array::IntoIter<T, MAX_CABLES>>;

    fn into_iter(self) -> Self::IntoIter {
        self.values.into_iter().take(self.count)
    }
}

impl<'a, T> IntoIterator for &'a PerCable<T> {
    type Item = &'a T;
    type IntoIter = std::slice::Iter<'a, T>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

impl<'a, T> IntoIterator for &'a mut PerCable<T> {
    type Item = &'a mut T;
    type IntoIter = std::slice::IterMut<'a, T>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter_mut()
    }
}

impl<T: PartialEq> PartialEq for PerCable<T> {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

impl<T: PartialEq, const N: usize> PartialEq<[T; N]> for PerCable<T> {
    fn eq(&self, other: &[T; N]) -> bool {
        **self == *other
    }
}

impl<T: fmt::Debug> fmt::Debug for PerCable<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(&**self).finish()
    }
}

impl<T: Serialize> Serialize for PerCable<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(&**self)
    }
}

impl<'de, T: Copy + Deserialize<'de>> Deserialize<'de> for PerCable<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let values = Vec::<T>::deserialize(deserializer)?;
        Self::from_slice(&values)
            .ok_or_else(|| serde::de::Error::invalid_length(values.len(), &"one entry for each cable, 2 to 12 of them"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_as_long_as_the_robot_has_cables() {
        let lengths = PerCable::from_fn(6, |i| i as f64);
        assert_eq!(lengths.len(), 6);
        assert_eq!(lengths.iter().sum::<f64>(), 15.0);
        assert_eq!(lengths.map(|l| 2.0 * l), [0.0, 2.0, 4.0, 6.0, 8.0, 10.0]);
        assert_eq!(PerCable::from_slice(&[0_u8; 13]), None);
        assert_eq!(PerCable::<u8>::from_slice(&[]), None);
    }

    #[test]
    fn what_lies_beyond_the_last_cable_is_not_compared() {
        let (mut a, b) = (PerCable::filled(3, 1.0), PerCable::from([1.0, 1.0, 1.0]));
        a.values[3] = 7.0;
        assert_eq!(a, b);
        assert_ne!(a, PerCable::filled(4, 1.0));
    }
}
