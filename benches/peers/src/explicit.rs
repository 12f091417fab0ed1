//! diffsol's explicit method of order 5 (Tsitouras).

use std::cell::RefCell;
use std::rc::Rc;

use diffsol::{NalgebraMat, NalgebraVec, OdeBuilder, OdeSolverMethod, OdeSolverStopReason, Vector};

use crate::case::Case;
use crate::race::{Entrant, Feed, Method, thread_time};
use crate::rates::Rates;

struct Tsitouras {
    tolerance: f64,
}

impl Method for Tsitouras {
    fn run(&self, case: &Case, feed: &mut Feed<'_>) -> Result<f64, String> {
        let rates = Rc::new(RefCell::new(Rates::new(case)));
        let (called, start) = (Rc::clone(&rates), case.states().to_vec());
        let count = start.len();
        let problem = OdeBuilder::<NalgebraMat<f64>>::new()
            .rtol(0.0)
            .atol(case.nominal().into_iter().map(|size| size * self.tolerance).collect::<Vec<_>>())
            .rhs_implicit(
                move |y: &[f64], _: &[f64], t: f64, out: &mut [f64]| called.borrow().at(t, y, out),
                |_: &[f64], _: &[f64], _: f64, _: &[f64], _: &mut [f64]| unreachable!("an explicit method"),
            )
            .init(move |_: &[f64], _: f64, y: &mut [f64]| y.copy_from_slice(&start), count)
            .build()
            .map_err(|error| error.to_string())?;
        let mut solver = problem.tsit45().map_err(|error| error.to_string())?;
        let mut here: NalgebraVec<f64> = solver.state().y.clone();
        let begun = thread_time();
        let mut k = 0;
        while let Some(inputs) = feed(k, here.batch_as_slice(0)) {
            rates.borrow_mut().inputs = inputs;
            let time = k as f64 * case.step;
            // The rates of the step before are those of other inputs.
            let state = solver.state_mut();
            rates.borrow().at(time, here.batch_as_slice(0), state.dy.batch_as_mut_slice(0));
            *state.t = time;
            solver.set_stop_time(time + case.step).map_err(|error| error.to_string())?;
            while !matches!(solver.step().map_err(|error| error.to_string())?, OdeSolverStopReason::TstopReached) {}
            here.copy_from(solver.state().y);
            k += 1;
        }
        Ok(thread_time() - begun)
    }
}

pub(crate) fn entrants(_case: &Case) -> Vec<Entrant<'_>> {
    let entrant = |tolerance: f64| Entrant {
        name: "diffsol tsit45".to_owned(),
        tolerance,
        method: Box::new(Tsitouras { tolerance }),
    };
    [1e-6, 1e-8, 1e-10].map(entrant).into()
}
