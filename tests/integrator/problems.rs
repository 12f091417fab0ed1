//! Test problems with known answers, with dense exact Jacobians: shared by all tests of the integrator.

use cdpr::integrator::{Complex64, DenseFactors, System};
use nalgebra::DMatrix;

/// A test problem: equations, Jacobian, and what an error in each component weighs.
pub(crate) trait Problem {
    fn dimension(&self) -> usize;
    fn rates(&self, time: f64, y: &[f64], rates: &mut [f64]);
    fn jacobian(&self, time: f64, y: &[f64], jacobian: &mut DMatrix<f64>);
    fn scale(&self, y: &[f64], scale: &mut [f64]) {
        for (s, y) in scale.iter_mut().zip(y) {
            *s = y.abs().max(1.0);
        }
    }
    fn switches(&self) -> usize {
        0
    }
    fn switching_functions(&self, _y: &[f64], _values: &mut [f64]) {}
    fn switch(&mut self) {}
}

/// Errors of which each is with steps half as long as the one before must fall as a method of this order makes them.
pub(crate) fn assert_order(errors: &[f64], expected: f64) {
    for pair in errors.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        assert!((order - expected).abs() < 0.15, "order {order}, errors {errors:?}");
    }
}

/// A problem solved with dense LU factors.
pub(crate) struct Dense<P> {
    pub(crate) problem: P,
    jacobian: DMatrix<f64>,
    factors: DenseFactors,
}

impl<P: Problem> Dense<P> {
    pub(crate) fn new(problem: P) -> Self {
        let n = problem.dimension();
        Self { problem, jacobian: DMatrix::zeros(n, n), factors: DenseFactors::default() }
    }
}

impl<P: Problem> System for Dense<P> {
    fn dimension(&self) -> usize {
        self.problem.dimension()
    }
    fn rates(&mut self, time: f64, y: &[f64], rates: &mut [f64]) {
        self.problem.rates(time, y, rates);
    }
    fn scale(&self, y: &[f64], scale: &mut [f64]) {
        self.problem.scale(y, scale);
    }
    fn linearise(&mut self, time: f64, y: &[f64]) {
        self.problem.jacobian(time, y, &mut self.jacobian);
    }
    fn factor(&mut self, real: f64, complex: Complex64) {
        self.factors.factor(&self.jacobian, real, complex);
    }
    fn solve_real(&mut self, b: &mut [f64]) {
        assert!(self.factors.solve_real(b));
    }
    fn solve_complex(&mut self, re: &mut [f64], im: &mut [f64]) {
        assert!(self.factors.solve_complex(re, im));
    }
    fn switches(&self) -> usize {
        self.problem.switches()
    }
    fn switching_functions(&mut self, _time: f64, y: &[f64], values: &mut [f64]) {
        self.problem.switching_functions(y, values);
    }
    fn switch(&mut self, _time: f64, _y: &[f64]) {
        self.problem.switch();
    }
}

/// Van der Pol's equation, stiff: `y'' = ((1 - y²) y' - y)/ε`, ε = 1e-6, from (2, 0) (F. Mazzia, C. Magherini, Test set
/// for IVP solvers, 2008).
pub(crate) struct VanDerPol;

impl VanDerPol {
    pub(crate) const START: [f64; 2] = [2.0, 0.0];
    /// At t = 2, from the same test set.
    pub(crate) const AT_2: [f64; 2] = [1.706_167_732_170_483, -0.892_809_701_024_797_5];
    const EPSILON: f64 = 1e-6;
}

impl Problem for VanDerPol {
    fn dimension(&self) -> usize {
        2
    }
    fn rates(&self, _time: f64, y: &[f64], rates: &mut [f64]) {
        rates[0] = y[1];
        rates[1] = ((1.0 - y[0] * y[0]) * y[1] - y[0]) / Self::EPSILON;
    }
    fn jacobian(&self, _time: f64, y: &[f64], j: &mut DMatrix<f64>) {
        j[(0, 0)] = 0.0;
        j[(0, 1)] = 1.0;
        j[(1, 0)] = (-2.0 * y[0] * y[1] - 1.0) / Self::EPSILON;
        j[(1, 1)] = (1.0 - y[0] * y[0]) / Self::EPSILON;
    }
}

/// A block on a rough floor, pulled harder and harder: `v' = 0.1 t - 0.2 tanh(v/w)`. It sticks until t = 2 s.
pub(crate) struct Dragged {
    pub(crate) width: f64,
}

impl Dragged {
    /// Speed at t = 10 s as the width goes to zero: 0.05 (10 - 2)².
    pub(crate) const AT_10: f64 = 3.2;
}

impl Problem for Dragged {
    fn dimension(&self) -> usize {
        1
    }
    fn rates(&self, time: f64, y: &[f64], rates: &mut [f64]) {
        rates[0] = 0.1 * time - 0.2 * (y[0] / self.width).tanh();
    }
    fn jacobian(&self, _time: f64, y: &[f64], j: &mut DMatrix<f64>) {
        let turn = (y[0] / self.width).tanh();
        j[(0, 0)] = -0.2 * (1.0 - turn * turn) / self.width;
    }
}

/// Robertson's reaction (H. H. Robertson, 1966).
pub(crate) struct Robertson;

impl Robertson {
    /// At t = 1e11 (F. Mazzia, C. Magherini, Test set for IVP solvers, 2008).
    pub(crate) const AT_1E11: [f64; 3] = [2.083_340_149_701_255e-8, 8.333_360_770_334_713e-14, 0.999_999_979_166_505];
}

impl Problem for Robertson {
    fn dimension(&self) -> usize {
        3
    }
    fn rates(&self, _time: f64, y: &[f64], rates: &mut [f64]) {
        let (slow, fast, middle) = (0.04 * y[0], 3e7 * y[1] * y[1], 1e4 * y[1] * y[2]);
        rates[0] = -slow + middle;
        rates[1] = slow - middle - fast;
        rates[2] = fast;
    }
    fn jacobian(&self, _time: f64, y: &[f64], j: &mut DMatrix<f64>) {
        let rows =
            [[-0.04, 1e4 * y[2], 1e4 * y[1]], [0.04, -1e4 * y[2] - 6e7 * y[1], -1e4 * y[1]], [0.0, 6e7 * y[1], 0.0]];
        for r in 0..3 {
            for c in 0..3 {
                j[(r, c)] = rows[r][c];
            }
        }
    }
    fn scale(&self, y: &[f64], scale: &mut [f64]) {
        for (s, y) in scale.iter_mut().zip(y) {
            *s = y.abs().max(1e-12);
        }
    }
}

/// `y' = λ (y - cos t) - sin t`, whose solution from 1 is `cos t` (A. Prothero, A. Robinson, 1974).
pub(crate) struct ProtheroRobinson {
    pub(crate) lambda: f64,
}

impl Problem for ProtheroRobinson {
    fn dimension(&self) -> usize {
        1
    }
    fn rates(&self, time: f64, y: &[f64], rates: &mut [f64]) {
        rates[0] = self.lambda * (y[0] - time.cos()) - time.sin();
    }
    fn jacobian(&self, _time: f64, _y: &[f64], j: &mut DMatrix<f64>) {
        j[(0, 0)] = self.lambda;
    }
}

/// The same so many times over that solving with the Newton matrix is dear; stiff up to `until`, also for a call that ends there,
/// and slow after it.
pub(crate) struct Easing {
    pub(crate) until: f64,
}

impl Easing {
    pub(crate) const COPIES: usize = 40;

    fn lambda(&self, time: f64) -> f64 {
        if time <= self.until { -1e6 } else { -1.0 }
    }
}

impl Problem for Easing {
    fn dimension(&self) -> usize {
        Self::COPIES
    }
    fn rates(&self, time: f64, y: &[f64], rates: &mut [f64]) {
        for (rate, y) in rates.iter_mut().zip(y) {
            *rate = self.lambda(time) * (y - time.cos()) - time.sin();
        }
    }
    fn jacobian(&self, time: f64, _y: &[f64], j: &mut DMatrix<f64>) {
        j.fill_with_identity();
        *j *= self.lambda(time);
    }
}

/// A damped oscillator, `y'' = -2 ζ ω y' - ω² y`.
pub(crate) struct Oscillator {
    pub(crate) frequency: f64,
    pub(crate) damping: f64,
}

impl Oscillator {
    /// From (1, 0).
    pub(crate) fn at(&self, time: f64) -> [f64; 2] {
        let (w, z) = (self.frequency, self.damping);
        let (decay, wd) = (z * w, w * (1.0 - z * z).sqrt());
        let (sin, cos) = (wd * time).sin_cos();
        let e = (-decay * time).exp();
        [e * (cos + decay / wd * sin), -e * w * w / wd * sin]
    }
}

impl Problem for Oscillator {
    fn dimension(&self) -> usize {
        2
    }
    fn rates(&self, _time: f64, y: &[f64], rates: &mut [f64]) {
        rates[0] = y[1];
        rates[1] = -2.0 * self.damping * self.frequency * y[1] - self.frequency * self.frequency * y[0];
    }
    fn jacobian(&self, _time: f64, _y: &[f64], j: &mut DMatrix<f64>) {
        j[(0, 0)] = 0.0;
        j[(0, 1)] = 1.0;
        j[(1, 0)] = -self.frequency * self.frequency;
        j[(1, 1)] = -2.0 * self.damping * self.frequency;
    }
}

/// The oscillator with errors that weigh nothing: steps are as long as asked for.
pub(crate) struct Unweighed(pub(crate) Oscillator);

impl Problem for Unweighed {
    fn dimension(&self) -> usize {
        2
    }
    fn rates(&self, time: f64, y: &[f64], rates: &mut [f64]) {
        self.0.rates(time, y, rates);
    }
    fn jacobian(&self, time: f64, y: &[f64], j: &mut DMatrix<f64>) {
        self.0.jacobian(time, y, j);
    }
    fn scale(&self, _y: &[f64], scale: &mut [f64]) {
        scale.fill(1e9);
    }
}

/// The unweighed oscillator, watched for being lower than -`level`.
pub(crate) struct Dipping {
    pub(crate) oscillator: Oscillator,
    pub(crate) level: f64,
    pub(crate) below: bool,
}

impl Problem for Dipping {
    fn dimension(&self) -> usize {
        2
    }
    fn rates(&self, time: f64, y: &[f64], rates: &mut [f64]) {
        self.oscillator.rates(time, y, rates);
    }
    fn jacobian(&self, time: f64, y: &[f64], j: &mut DMatrix<f64>) {
        self.oscillator.jacobian(time, y, j);
    }
    fn scale(&self, _y: &[f64], scale: &mut [f64]) {
        scale.fill(1e9);
    }
    fn switches(&self) -> usize {
        1
    }
    fn switching_functions(&self, y: &[f64], values: &mut [f64]) {
        let above = y[0] + self.level;
        values[0] = if self.below { -above } else { above };
    }
    fn switch(&mut self) {
        self.below = !self.below;
    }
}

/// A weight between two constant pulls, `y'' = -sign y`: parabolas that meet where it passes zero.
pub(crate) struct TwoPulls {
    pub(crate) above: bool,
}

impl TwoPulls {
    /// From (1, 0): four parabolas of duration √2 in one period.
    pub(crate) fn at(time: f64) -> [f64; 2] {
        let quarter = 2.0_f64.sqrt();
        let phase = time.rem_euclid(4.0 * quarter);
        if phase < quarter {
            [1.0 - 0.5 * phase * phase, -phase]
        } else if phase < 3.0 * quarter {
            let s = phase - 2.0 * quarter;
            [0.5 * s * s - 1.0, s]
        } else {
            let s = phase - 4.0 * quarter;
            [1.0 - 0.5 * s * s, -s]
        }
    }
}

impl Problem for TwoPulls {
    fn dimension(&self) -> usize {
        2
    }
    fn rates(&self, _time: f64, y: &[f64], rates: &mut [f64]) {
        rates[0] = y[1];
        rates[1] = if self.above { -1.0 } else { 1.0 };
    }
    fn jacobian(&self, _time: f64, _y: &[f64], j: &mut DMatrix<f64>) {
        j.fill(0.0);
        j[(0, 1)] = 1.0;
    }
    fn switches(&self) -> usize {
        1
    }
    fn switching_functions(&self, y: &[f64], values: &mut [f64]) {
        values[0] = if self.above { y[0] } else { -y[0] };
    }
    fn switch(&mut self) {
        self.above = !self.above;
    }
}
