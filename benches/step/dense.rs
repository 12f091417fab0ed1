//! The plant for the same integrator, with an exact Jacobian and dense LU factors: what the structure is worth.

use std::sync::Arc;

use cdpr::dynamics::Inputs;
use cdpr::integrator::{Complex64, DenseFactors, System};
use cdpr::plant::Plant;
use nalgebra::DMatrix;
use num_dual::Dual64;

/// A taut plant, its Jacobian and factors as dense matrices.
#[derive(Clone)]
pub(crate) struct DenseSystem {
    plant: Arc<Plant>,
    pub(crate) inputs: Inputs,
    jacobian: DMatrix<f64>,
    factors: DenseFactors,
}

impl DenseSystem {
    pub(crate) fn new(plant: Arc<Plant>) -> Self {
        let n = plant.dimension();
        Self { plant, inputs: Inputs::none(4), jacobian: DMatrix::zeros(n, n), factors: DenseFactors::default() }
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
        self.factors.factor(&self.jacobian, real, complex);
    }

    fn solve_real(&mut self, b: &mut [f64]) {
        self.factors.solve_real(b);
    }

    fn solve_complex(&mut self, re: &mut [f64], im: &mut [f64]) {
        self.factors.solve_complex(re, im);
    }
}
