//! The product.

use cdpr::integrator::Solver;

use crate::case::Case;
use crate::race::{Entrant, Feed, Method, thread_time};

/// A solver at a tolerance.
pub(crate) struct Ours {
    pub(crate) solver: Solver,
    pub(crate) tolerance: f64,
}

impl Method for Ours {
    fn run(&self, case: &Case, feed: &mut Feed<'_>) -> Result<f64, String> {
        let mut simulation = case.simulation(self.solver, self.tolerance);
        let begun = thread_time();
        let mut k = 0;
        while let Some(inputs) = feed(k, simulation.states()) {
            simulation.set_inputs(inputs);
            simulation.advance(case.step).map_err(|error| error.to_string())?;
            k += 1;
        }
        Ok(thread_time() - begun)
    }
}

/// The default solver first.
pub(crate) fn entrants(_case: &Case) -> Vec<Entrant<'_>> {
    let mut entrants = Vec::new();
    for (name, solver) in [("cdpr radau", Solver::Radau), ("cdpr auto", Solver::Auto)] {
        for tolerance in [1e-8, 1e-6, 1e-10, 1e-12] {
            entrants.push(Entrant { name: name.to_owned(), tolerance, method: Box::new(Ours { solver, tolerance }) });
        }
    }
    entrants
}
