//! Small initial value problems on the library's integrator, with a numerical Jacobian; and Runge-Kutta beside it.

use cdpr::integrator::{Complex64, DenseFactors, IntegrationError, Integrator, System};
use nalgebra::DMatrix;

/// `ẏ = f(t, y)` with a dense numerical Jacobian.
pub(crate) struct Dense<F> {
    rates: F,
    dimension: usize,
    jacobian: DMatrix<f64>,
    factors: DenseFactors,
}

impl<F: FnMut(f64, &[f64], &mut [f64])> Dense<F> {
    pub(crate) fn new(dimension: usize, rates: F) -> Self {
        Self { rates, dimension, jacobian: DMatrix::zeros(dimension, dimension), factors: DenseFactors::default() }
    }
}

impl<F: FnMut(f64, &[f64], &mut [f64])> System for Dense<F> {
    fn dimension(&self) -> usize {
        self.dimension
    }

    fn rates(&mut self, time: f64, y: &[f64], rates: &mut [f64]) {
        (self.rates)(time, y, rates);
    }

    fn scale(&self, _y: &[f64], scale: &mut [f64]) {
        scale.fill(1.0);
    }

    fn linearise(&mut self, time: f64, y: &[f64]) {
        let n = self.dimension;
        let mut point = y.to_vec();
        let (mut ahead, mut behind) = (vec![0.0; n], vec![0.0; n]);
        for c in 0..n {
            let h = 1e-6 * y[c].abs().max(1e-2);
            point[c] = y[c] + h;
            (self.rates)(time, &point, &mut ahead);
            point[c] = y[c] - h;
            (self.rates)(time, &point, &mut behind);
            point[c] = y[c];
            for r in 0..n {
                self.jacobian[(r, c)] = (ahead[r] - behind[r]) / (2.0 * h);
            }
        }
    }

    fn factor(&mut self, real: f64, complex: Complex64) {
        self.factors.factor(&self.jacobian, real, complex);
    }

    fn solve_real(&mut self, b: &mut [f64]) {
        self.factors.solve_real(b);
    }

    fn solve_complex(&mut self, re: &mut [f64], im: &mut [f64]) {
        self.factors.solve_complex(re, im);
    }
}

/// States of `ẏ = f(t, y)` at every multiple of `step` (s) up to `stop` (s), by Radau IIA.
pub(crate) fn integrate(
    rates: impl FnMut(f64, &[f64], &mut [f64]),
    start: &[f64],
    step: f64,
    stop: f64,
    tolerance: f64,
) -> Result<Vec<Vec<f64>>, IntegrationError> {
    let mut system = Dense::new(start.len(), rates);
    let mut integrator = Integrator::new(start.len(), 0, tolerance);
    let mut y = start.to_vec();
    let mut states = vec![y.clone()];
    for k in 0..(stop / step).round() as usize {
        integrator.advance(&mut system, k as f64 * step, &mut y, step)?;
        states.push(y.clone());
    }
    Ok(states)
}

/// The last state of `ẏ = f(t, y)` after `steps` steps of the classical Runge-Kutta method.
pub fn runge_kutta(mut rates: impl FnMut(f64, &[f64], &mut [f64]), start: &[f64], step: f64, steps: usize) -> Vec<f64> {
    let n = start.len();
    let mut y = start.to_vec();
    let mut k = [vec![0.0; n], vec![0.0; n], vec![0.0; n], vec![0.0; n]];
    let mut point = vec![0.0; n];
    for s in 0..steps {
        let t = s as f64 * step;
        for stage in 0..4 {
            let c = [0.0, 0.5, 0.5, 1.0][stage];
            for i in 0..n {
                point[i] = y[i] + if stage > 0 { c * step * k[stage - 1][i] } else { 0.0 };
            }
            rates(t + c * step, &point, &mut k[stage]);
        }
        for i in 0..n {
            y[i] += step / 6.0 * (k[0][i] + 2.0 * k[1][i] + 2.0 * k[2][i] + k[3][i]);
        }
    }
    y
}
