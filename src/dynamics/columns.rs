//! Right-hand sides of Newton's systems, real or complex, and the parts of four cables in them, a lane for each, or of the platform's
//! three axes, so that the processor works on several of them in one instruction. Complex numbers keep their real parts together and their imaginary parts.

use std::array::from_fn;
use std::ops::{Add, Mul, Sub};

use num_complex::Complex64;
use wide::f64x4;

use super::matrix3::Field;

/// Cables in a group.
pub(super) const LANES: usize = 4;

/// A real number of each of four cables; or of the platform's three axes, and a zero.
pub(super) type Reals = f64x4;

/// A complex number of each.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pairs {
    re: Reals,
    im: Reals,
}

/// An `F` of each of four cables.
pub(super) trait Lanes<F>: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {
    const ZERO: Self;

    /// The same in all lanes.
    fn spread(value: F) -> Self;

    /// Real numbers.
    fn lift(values: Reals) -> Self;

    /// Times a real number in each lane.
    fn scale(self, factor: Reals) -> Self;

    /// One over each.
    fn recip(self) -> Self;

    /// Over all lanes.
    fn sum(self) -> F;

    fn get(self, lane: usize) -> F;

    fn set(&mut self, lane: usize, value: F);
}

impl Lanes<f64> for Reals {
    const ZERO: Self = Self::ZERO;

    #[inline(always)]
    fn spread(value: f64) -> Self {
        Self::splat(value)
    }

    #[inline(always)]
    fn lift(values: Reals) -> Self {
        values
    }

    #[inline(always)]
    fn scale(self, factor: Reals) -> Self {
        self * factor
    }

    #[inline(always)]
    fn recip(self) -> Self {
        Reals::ONE / self
    }

    #[inline(always)]
    fn sum(self) -> f64 {
        let [a, b, c, d] = self.to_array();
        (a + c) + (b + d)
    }

    #[inline(always)]
    fn get(self, lane: usize) -> f64 {
        self.to_array()[lane]
    }

    #[inline(always)]
    fn set(&mut self, lane: usize, value: f64) {
        self.as_mut_array()[lane] = value;
    }
}

impl Add for Pairs {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self { re: self.re + other.re, im: self.im + other.im }
    }
}

impl Sub for Pairs {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self { re: self.re - other.re, im: self.im - other.im }
    }
}

impl Mul for Pairs {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self { re: self.re * other.re - self.im * other.im, im: self.re * other.im + self.im * other.re }
    }
}

impl Lanes<Complex64> for Pairs {
    const ZERO: Self = Self { re: Reals::ZERO, im: Reals::ZERO };

    #[inline(always)]
    fn spread(value: Complex64) -> Self {
        Self { re: Reals::spread(value.re), im: Reals::spread(value.im) }
    }

    #[inline(always)]
    fn lift(values: Reals) -> Self {
        Self { re: values, im: Reals::ZERO }
    }

    #[inline(always)]
    fn scale(self, factor: Reals) -> Self {
        Self { re: self.re * factor, im: self.im * factor }
    }

    #[inline(always)]
    fn recip(self) -> Self {
        let inverse = Reals::ONE / (self.re * self.re + self.im * self.im);
        Self { re: self.re * inverse, im: Reals::ZERO - self.im * inverse }
    }

    #[inline(always)]
    fn sum(self) -> Complex64 {
        Complex64::new(self.re.sum(), self.im.sum())
    }

    #[inline(always)]
    fn get(self, lane: usize) -> Complex64 {
        Complex64::new(self.re.get(lane), self.im.get(lane))
    }

    #[inline(always)]
    fn set(&mut self, lane: usize, value: Complex64) {
        self.re.set(lane, value.re);
        self.im.set(lane, value.im);
    }
}

/// Where the states of four cables are, or of fewer.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    first: [usize; LANES],
    count: [usize; LANES],
    /// There are four, and each begins where the last one ended.
    in_a_row: bool,
}

impl Place {
    /// Of cables with up to `room` states.
    pub(super) fn new(states: &[std::ops::Range<usize>], room: usize) -> Self {
        let of = |i: usize| states.get(i).map_or(0..0, Clone::clone);
        let place = Self { first: from_fn(|i| of(i).start), count: from_fn(|i| of(i).len()), in_a_row: false };
        let in_a_row = (0..LANES).all(|i| place.count[i] == room && place.first[i] == place.first[0] + i * room);
        Self { in_a_row, ..place }
    }

    /// Their states, and zeros.
    #[inline(always)]
    fn gather<const N: usize>(&self, values: &[f64]) -> [Reals; N] {
        if self.in_a_row {
            let values = &values[self.first[0]..self.first[0] + LANES * N];
            from_fn(|c| Reals::new(from_fn(|i| values[i * N + c])))
        } else {
            let value = |i: usize, c: usize| if c < self.count[i] { values[self.first[i] + c] } else { 0.0 };
            from_fn(|c| Reals::new(from_fn(|i| value(i, c))))
        }
    }

    /// Puts them back.
    #[inline(always)]
    fn scatter<const N: usize>(&self, values: &mut [f64], part: &[Reals; N]) {
        let part = part.map(Reals::to_array);
        if self.in_a_row {
            let values = &mut values[self.first[0]..self.first[0] + LANES * N];
            for i in 0..LANES {
                for c in 0..N {
                    values[i * N + c] = part[c][i];
                }
            }
        } else {
            for i in 0..LANES {
                for c in 0..self.count[i].min(N) {
                    values[self.first[i] + c] = part[c][i];
                }
            }
        }
    }
}

/// The real and the imaginary parts of a complex right-hand side.
pub(super) struct Split<'a> {
    pub(super) re: &'a mut [f64],
    pub(super) im: &'a mut [f64],
}

/// A row times a column.
#[inline(always)]
pub(super) fn dot<F, L: Lanes<F>, const N: usize>(row: &[L; N], column: &[L; N]) -> L {
    let mut products = row.iter().zip(column).map(|(a, b)| *a * *b);
    products.next().map_or(L::ZERO, |first| products.fold(first, |sum, product| sum + product))
}

/// A matrix, by columns, times a vector of the platform's three axes.
#[inline(always)]
pub(super) fn times<F, L: Lanes<F>>(matrix: &[L; 3], vector: L) -> L {
    dot(matrix, &from_fn(|k| L::spread(vector.get(k))))
}

/// A right-hand side, in whose place the solution goes.
pub(super) trait Column<F: Field> {
    /// One number of each of four cables.
    type Lanes: Lanes<F>;

    /// The platform's three states from `first` on, and a zero.
    fn three(&self, first: usize) -> Self::Lanes;

    /// Puts them back.
    fn set_three(&mut self, first: usize, values: Self::Lanes);

    /// The states of four cables.
    fn gather<const N: usize>(&self, place: &Place) -> [Self::Lanes; N];

    /// Puts them back.
    fn scatter<const N: usize>(&mut self, place: &Place, part: &[Self::Lanes; N]);
}

impl Column<f64> for [f64] {
    type Lanes = Reals;

    #[inline(always)]
    fn three(&self, first: usize) -> Reals {
        let values = &self[first..first + 3];
        Reals::new([values[0], values[1], values[2], 0.0])
    }

    #[inline(always)]
    fn set_three(&mut self, first: usize, values: Reals) {
        self[first..first + 3].copy_from_slice(&values.to_array()[..3]);
    }

    #[inline(always)]
    fn gather<const N: usize>(&self, place: &Place) -> [Reals; N] {
        place.gather(self)
    }

    #[inline(always)]
    fn scatter<const N: usize>(&mut self, place: &Place, part: &[Reals; N]) {
        place.scatter(self, part);
    }
}

impl Column<Complex64> for Split<'_> {
    type Lanes = Pairs;

    #[inline(always)]
    fn three(&self, first: usize) -> Pairs {
        Pairs { re: self.re.three(first), im: self.im.three(first) }
    }

    #[inline(always)]
    fn set_three(&mut self, first: usize, values: Pairs) {
        self.re.set_three(first, values.re);
        self.im.set_three(first, values.im);
    }

    #[inline(always)]
    fn gather<const N: usize>(&self, place: &Place) -> [Pairs; N] {
        let (re, im) = (place.gather::<N>(self.re), place.gather::<N>(self.im));
        from_fn(|c| Pairs { re: re[c], im: im[c] })
    }

    #[inline(always)]
    fn scatter<const N: usize>(&mut self, place: &Place, part: &[Pairs; N]) {
        place.scatter(self.re, &part.map(|pair| pair.re));
        place.scatter(self.im, &part.map(|pair| pair.im));
    }
}
