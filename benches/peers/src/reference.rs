//! What a case should come to: its motion as another program has it, at some times on the way.

use cdpr::integrator::Solver;

use crate::case::Case;
use crate::ours::Ours;
use crate::race::turn;

/// A motion by `make_references.py`: pose and unstretched lengths.
pub(crate) struct Stored {
    /// How far off it may be (m).
    error: f64,
    /// Time (s), pose (m, rad) and lengths (m).
    samples: Vec<Vec<f64>>,
}

/// What errors are counted against.
pub(crate) enum Reference {
    Stored(Stored),
    /// All states after each step, by our own implicit method at 1e-13.
    Ours(Vec<Vec<f64>>),
}

impl Stored {
    /// The one of this name.
    fn read(name: &str) -> Self {
        let file = format!("{}/references/{name}.txt", env!("CARGO_MANIFEST_DIR"));
        let text = std::fs::read_to_string(&file).unwrap_or_else(|error| panic!("{file}: {error}"));
        let number = |word: &str| word.parse::<f64>().expect("a number in a stored reference");
        let (notes, rows): (Vec<&str>, Vec<&str>) = text.lines().partition(|line| line.starts_with('#'));
        let error = notes.first().and_then(|line| line.rsplit_once(": ")).map(|(_, error)| number(error));
        let samples = rows.iter().map(|line| line.split_whitespace().map(number).collect()).collect();
        Self { error: error.expect("a stored reference tells its error"), samples }
    }
}

impl Reference {
    pub(crate) fn of(case: &Case) -> Self {
        match case.stored {
            Some(name) => Self::Stored(Stored::read(name)),
            None => Self::Ours(by_ours(case)),
        }
    }

    /// Largest difference of pose and unstretched lengths (m), angles times the platform's radius. `states` are those at each
    /// communication point, the start included.
    pub(crate) fn difference(&self, case: &Case, states: &[Vec<f64>]) -> f64 {
        let nominal = case.nominal();
        let looked_at = case.looked_at();
        let worst = |worst: f64, error: f64| if error.is_nan() { f64::INFINITY } else { worst.max(error) };
        let of = |found: &[f64], exact: &[f64]| {
            let errors = looked_at.iter().zip(exact).map(|(at, exact)| (found[*at] - exact).abs() / nominal[*at]);
            errors.fold(0.0, worst)
        };
        match self {
            Self::Stored(Stored { samples, .. }) => {
                let step = |time: f64| (time / case.step).round() as usize;
                samples.iter().map(|sample| of(&states[step(sample[0])], &sample[1..])).fold(0.0, worst)
            }
            Self::Ours(exact) => {
                let looked = |exact: &[f64]| looked_at.iter().map(|at| exact[*at]).collect::<Vec<_>>();
                states.iter().zip(exact).map(|(found, exact)| of(found, &looked(exact))).fold(0.0, worst)
            }
        }
    }

    /// How far it can be relied on.
    pub(crate) fn words(&self, case: &Case) -> String {
        match self {
            Self::Stored(Stored { error, samples }) => format!(
                "Reference: {} instants by another program, good to {error:.1e} m; ours at 1e-13 differs from it by {:.1e} m.",
                samples.len(),
                self.difference(case, &by_ours(case))
            ),
            Self::Ours(_) => "Reference: our own implicit method at 1e-13, along the whole way.".to_owned(),
        }
    }
}

fn by_ours(case: &Case) -> Vec<Vec<f64>> {
    turn(case, &Ours { solver: Solver::Radau, tolerance: 1e-13 }).expect("the reference").1
}
