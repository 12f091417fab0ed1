//! The explicit method of order 5 of Dormand and Prince with a fixed step, as a measure for the implicit one.

use cdpr::dynamics::Inputs;
use cdpr::simulation::Simulation;

/// Rows of the method's triangular matrix; the last one are the weights of order 5.
const TABLEAU: [&[f64]; 6] = [
    &[1.0 / 5.0],
    &[3.0 / 40.0, 9.0 / 40.0],
    &[44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0],
    &[19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0],
    &[9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0],
    &[35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0],
];

/// States of a taut plant whose rates do not depend on time, and room for the stages.
#[derive(Clone)]
pub(crate) struct DormandPrince<'a> {
    origin: &'a Simulation,
    pub(crate) states: Vec<f64>,
    parts: usize,
    stage: Vec<f64>,
    rates: [Vec<f64>; 6],
}

impl<'a> DormandPrince<'a> {
    /// Starts where `origin` stands; `parts` equal steps between two communication points.
    pub(crate) fn new(origin: &'a Simulation, parts: usize) -> Self {
        let states = origin.states().to_vec();
        let zero = vec![0.0; states.len()];
        Self { origin, states, parts, stage: zero.clone(), rates: std::array::from_fn(|_| zero.clone()) }
    }

    /// Over one communication step (s) under these inputs. They jump at its start, so no stage of the last step serves.
    pub(crate) fn advance(&mut self, inputs: &Inputs, step: f64) {
        let plant = self.origin.plant();
        let taut = Simulation::slack(self.origin);
        let h = step / self.parts as f64;
        for _ in 0..self.parts {
            plant.rates(0.0, &self.states, inputs, &taut, &mut self.rates[0]);
            for (row, weights) in TABLEAU.iter().enumerate() {
                for (at, value) in self.stage.iter_mut().enumerate() {
                    let slope: f64 = weights.iter().zip(&self.rates).map(|(w, rates)| w * rates[at]).sum();
                    *value = self.states[at] + h * slope;
                }
                match self.rates.get_mut(row + 1) {
                    Some(rates) => plant.rates(0.0, &self.stage, inputs, &taut, rates),
                    None => self.states.copy_from_slice(&self.stage),
                }
            }
        }
    }
}
