//! Right-hand sides of Newton's systems, real or complex, and one cable's part of them. Complex ones keep their real parts together
//! and their imaginary parts, so that the processor works on several states in one instruction.

use std::array::from_fn;

use num_complex::Complex64;

use super::matrix3::Field;

/// Real numbers of one cable's states.
pub(super) type Reals<const N: usize> = [f64; N];

/// Complex numbers of one cable's states.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pairs<const N: usize> {
    re: Reals<N>,
    im: Reals<N>,
}

impl<const N: usize> Pairs<N> {
    pub(super) const ZERO: Self = Self { re: [0.0; N], im: [0.0; N] };
}

/// Numbers of one cable's `N` states, each an `F`.
pub(super) trait Part<F: Field, const N: usize>: Copy {
    /// What `value` gives for each state.
    fn from_fn(value: impl FnMut(usize) -> F) -> Self;

    /// `self + matrix v`, of a real matrix by columns.
    fn plus<const M: usize>(self, matrix: &[Reals<N>; M], v: &[F; M]) -> Self;

    /// `matrix self`, by columns.
    fn under(self, matrix: &[Self; N]) -> Self;

    /// The row `self` times a column.
    fn dot(&self, column: &Self) -> F;
}

impl<const N: usize> Part<f64, N> for Reals<N> {
    #[inline(always)]
    fn from_fn(value: impl FnMut(usize) -> f64) -> Self {
        from_fn(value)
    }

    #[inline(always)]
    fn plus<const M: usize>(self, matrix: &[Reals<N>; M], v: &[f64; M]) -> Self {
        let mut sum = matrix[0].map(|entry| entry * v[0]);
        for (column, v) in matrix.iter().zip(v).skip(1) {
            sum = from_fn(|c| sum[c] + column[c] * v);
        }
        from_fn(|c| self[c] + sum[c])
    }

    #[inline(always)]
    fn under(self, matrix: &[Self; N]) -> Self {
        let mut sum = [0.0; N];
        for (column, v) in matrix.iter().zip(self) {
            sum = from_fn(|r| sum[r] + column[r] * v);
        }
        sum
    }

    #[inline(always)]
    fn dot(&self, column: &Self) -> f64 {
        self.iter().zip(column).fold(0.0, |sum, (a, b)| sum + a * b)
    }
}

impl<const N: usize> Part<Complex64, N> for Pairs<N> {
    #[inline(always)]
    fn from_fn(value: impl FnMut(usize) -> Complex64) -> Self {
        let values: [Complex64; N] = from_fn(value);
        Self { re: values.map(|v| v.re), im: values.map(|v| v.im) }
    }

    #[inline(always)]
    fn plus<const M: usize>(self, matrix: &[Reals<N>; M], v: &[Complex64; M]) -> Self {
        Self { re: self.re.plus(matrix, &v.map(|v| v.re)), im: self.im.plus(matrix, &v.map(|v| v.im)) }
    }

    #[inline(always)]
    fn under(self, matrix: &[Self; N]) -> Self {
        let mut sum = Self::ZERO;
        for (c, column) in matrix.iter().enumerate() {
            let (re, im) = (self.re[c], self.im[c]);
            sum.re = from_fn(|r| sum.re[r] + (column.re[r] * re - column.im[r] * im));
            sum.im = from_fn(|r| sum.im[r] + (column.re[r] * im + column.im[r] * re));
        }
        sum
    }

    #[inline(always)]
    fn dot(&self, column: &Self) -> Complex64 {
        (0..N).fold(Complex64::ZERO, |sum, c| {
            sum + Complex64::new(self.re[c], self.im[c]) * Complex64::new(column.re[c], column.im[c])
        })
    }
}

/// The real and the imaginary parts of a complex right-hand side.
pub(super) struct Split<'a> {
    pub(super) re: &'a mut [f64],
    pub(super) im: &'a mut [f64],
}

/// A right-hand side, in whose place the solution goes.
pub(super) trait Column<F: Field> {
    /// One cable's part.
    type Part<const N: usize>: Part<F, N>;

    fn get(&self, at: usize) -> F;

    fn set(&mut self, at: usize, value: F);

    /// The `count` states from `first` on, and zeros.
    fn take<const N: usize>(&self, first: usize, count: usize) -> Self::Part<N>;

    /// Puts them back.
    fn put<const N: usize>(&mut self, first: usize, count: usize, part: &Self::Part<N>);
}

impl Column<f64> for [f64] {
    type Part<const N: usize> = Reals<N>;

    #[inline(always)]
    fn get(&self, at: usize) -> f64 {
        self[at]
    }

    #[inline(always)]
    fn set(&mut self, at: usize, value: f64) {
        self[at] = value;
    }

    #[inline(always)]
    fn take<const N: usize>(&self, first: usize, count: usize) -> Reals<N> {
        let states = &self[first..first + count];
        from_fn(|c| if c < count { states[c] } else { 0.0 })
    }

    #[inline(always)]
    fn put<const N: usize>(&mut self, first: usize, count: usize, part: &Reals<N>) {
        self[first..first + count].copy_from_slice(&part[..count]);
    }
}

impl Column<Complex64> for Split<'_> {
    type Part<const N: usize> = Pairs<N>;

    #[inline(always)]
    fn get(&self, at: usize) -> Complex64 {
        Complex64::new(self.re[at], self.im[at])
    }

    #[inline(always)]
    fn set(&mut self, at: usize, value: Complex64) {
        (self.re[at], self.im[at]) = (value.re, value.im);
    }

    #[inline(always)]
    fn take<const N: usize>(&self, first: usize, count: usize) -> Pairs<N> {
        Pairs { re: self.re.take(first, count), im: self.im.take(first, count) }
    }

    #[inline(always)]
    fn put<const N: usize>(&mut self, first: usize, count: usize, part: &Pairs<N>) {
        self.re.put(first, count, &part.re);
        self.im.put(first, count, &part.im);
    }
}
