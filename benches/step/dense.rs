//! The plant for the same integrator, with an exact Jacobian and dense LU factors: what the structure is worth.

use std::sync::Arc;

use cdpr::dynamics::Inputs;
use cdpr::integrator::{Complex64, System};
use cdpr::plant::Plant;
use nalgebra::{DMatrix, DVector, Dyn, LU};
use num_dual::Dual64;

/// A taut plant, its Jacobian and factors as dense matrices.
#[derive(Clone)]
pub(crate) struct DenseSystem {
    plant: Arc<Plant>,
    pub(crate) inputs: Inputs,
    jacobian: DMatrix<f64>,
    real: Option<LU<f64, Dyn, Dyn>>,
    complex: Option<LU<Complex64, Dyn, Dyn>>,
}

impl DenseSystem {
    pub(crate) fn new(plant: Arc<Plant>) -> Self {
        let n = plant.dimension();
        Self { plant, inputs: Inputs::none(4), jacobian: DMatrix::zeros(n, n), real: None, complex: None }
    }
}

impl System for DenseSystem {
    fn dimension(&self) -> usize {
        self.plant.dimension()
    }

    fn rates(&mut self, time: f64, y: &[f64], rates: &mut [f64]) {
        self.plant.rates(time, y, &self.inputs, &[false; 4].into(), rates);
    }

    fn scale(&self, _y: &[f64], scale: &mut [f64]) {
        scale.fill(1.0);
        scale[2] = 0.1;
        scale[5] = 0.1;
    }

    fn linearise(&mut self, time: f64, y: &[f64]) {
        let n = y.len();
        let mut rates = vec![Dual64::from(0.0); n];
        for column in 0..n {
            let seeded: Vec<Dual64> =
                y.iter().enumerate().map(|(k, v)| Dual64::new(*v, f64::from(u8::from(k == column)))).collect();
            self.plant.rates(Dual64::from(time), &seeded, &self.inputs.lift(), &[false; 4].into(), &mut rates);
            for row in 0..n {
                self.jacobian[(row, column)] = rates[row].eps;
            }
        }
    }

    fn factor(&mut self, real: f64, complex: Complex64) {
        let n = self.jacobian.nrows();
        self.real = Some((DMatrix::identity(n, n) * real - &self.jacobian).lu());
        self.complex = Some((DMatrix::identity(n, n) * complex - self.jacobian.map(|v| Complex64::new(v, 0.0))).lu());
    }

    fn solve_real(&mut self, b: &mut [f64]) {
        let mut x = DVector::from_column_slice(b);
        self.real.as_ref().expect("factored").solve_mut(&mut x);
        b.copy_from_slice(x.as_slice());
    }

    fn solve_complex(&mut self, re: &mut [f64], im: &mut [f64]) {
        let mut x = DVector::from_fn(re.len(), |k, _| Complex64::new(re[k], im[k]));
        self.complex.as_ref().expect("factored").solve_mut(&mut x);
        for (k, value) in x.iter().enumerate() {
            (re[k], im[k]) = (value.re, value.im);
        }
    }
}
