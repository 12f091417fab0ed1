//! Methods that take turns.

use cdpr::dynamics::Inputs;

use crate::case::Case;
use crate::reference::Reference;

/// Longest that one entrant may take in all rounds together (s), once it has three.
const BUDGET: f64 = 6.0;

/// Processor time of this thread (s).
pub(crate) fn thread_time() -> f64 {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: there is room for one time.
    let failed = unsafe { libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &raw mut time) };
    assert_eq!(failed, 0, "the system has a clock for threads");
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

/// Inputs of step `k` from the states there; none at the end.
pub(crate) type Feed<'a> = dyn FnMut(usize, &[f64]) -> Option<Inputs> + 'a;

/// A method that can go through a case.
pub(crate) trait Method {
    /// Goes through the case from its start; the time (s) that it took, setting up aside.
    fn run(&self, case: &Case, feed: &mut Feed<'_>) -> Result<f64, String>;
}

/// A method at one tolerance.
pub(crate) struct Entrant<'a> {
    pub(crate) name: String,
    pub(crate) tolerance: f64,
    pub(crate) method: Box<dyn Method + 'a>,
}

/// What came of an entrant.
pub(crate) struct Outcome {
    pub(crate) name: String,
    pub(crate) tolerance: f64,
    /// Largest on the way (m), or why there is none.
    pub(crate) error: Result<f64, String>,
    /// Quartiles of the time of a step (s).
    pub(crate) time: [f64; 3],
    pub(crate) rounds: usize,
}

/// What came of a case.
pub(crate) struct Outcomes {
    pub(crate) title: String,
    pub(crate) outcomes: Vec<Outcome>,
    /// What errors are counted against.
    pub(crate) reference: String,
}

/// A case, gone through once by each with its own inputs: these are replayed when it is timed.
pub(crate) struct Race<'a> {
    case: &'a Case,
    entrants: Vec<(Entrant<'a>, Vec<Inputs>, Result<f64, String>)>,
    reference: String,
}

/// The inputs that a method was given, and the states that came of them, those at the start first.
pub(crate) fn turn(case: &Case, method: &dyn Method) -> Result<(Vec<Inputs>, Vec<Vec<f64>>), String> {
    let (mut inputs, mut states) = (Vec::new(), Vec::new());
    let mut inputting = case.inputting();
    method.run(case, &mut |k, y| {
        states.push(y.to_vec());
        if k == case.steps {
            return None;
        }
        inputs.push(inputting.at(k, y));
        inputs.last().copied()
    })?;
    Ok((inputs, states))
}

impl<'a> Race<'a> {
    pub(crate) fn new(case: &'a Case, entrants: Vec<Entrant<'a>>) -> Self {
        let exact = Reference::of(case);
        let mut entered = Vec::new();
        for entrant in entrants {
            let (inputs, error) = match turn(case, &*entrant.method) {
                Ok((inputs, states)) => (inputs, Ok(exact.difference(case, &states))),
                Err(reason) => (Vec::new(), Err(reason)),
            };
            let error = error.and_then(|error| if error < 1.0 { Ok(error) } else { Err("unstable".to_owned()) });
            entered.push((entrant, inputs, error));
        }
        Self { case, entrants: entered, reference: exact.words(case) }
    }

    /// Times everybody in `rounds` rounds.
    pub(crate) fn run(self, rounds: usize) -> Outcomes {
        let mut times: Vec<Vec<f64>> = vec![Vec::new(); self.entrants.len()];
        for _ in 0..rounds {
            for ((entrant, inputs, error), times) in self.entrants.iter().zip(&mut times) {
                if error.is_err() || times.len() >= 3 && times.iter().sum::<f64>() > BUDGET {
                    continue;
                }
                let took = entrant.method.run(self.case, &mut |k, _| inputs.get(k).copied());
                times.push(took.expect("as in the turn before"));
            }
        }
        let steps = self.case.steps as f64;
        let finish = |((entrant, _, error), times): ((Entrant<'_>, _, _), Vec<f64>)| {
            let time = quartiles(times.clone()).map(|time| time / steps);
            Outcome { name: entrant.name, tolerance: entrant.tolerance, error, time, rounds: times.len() }
        };
        let outcomes = self.entrants.into_iter().zip(times).map(finish).collect();
        Outcomes { title: self.case.title.clone(), outcomes, reference: self.reference }
    }
}

/// First quartile, median and third quartile; NaN of nothing.
pub(crate) fn quartiles(mut values: Vec<f64>) -> [f64; 3] {
    values.sort_by(f64::total_cmp);
    let last = values.len().saturating_sub(1) as f64;
    [0.25, 0.5, 0.75].map(|part| values.get((part * last).round() as usize).copied().unwrap_or(f64::NAN))
}
