//! The choice of the solver.

use fmi2_export::{Model as _, Status};

use super::super::table::LOG_SOLVER;
use super::*;

/// `item` of the enumeration `solver`.
const SOLVERS: [(i32, &str); 3] = [(1, "radau"), (2, "dormand_prince"), (3, "auto")];

/// A second in steps of 10 ms, with what is logged of stiffness: category and status.
fn run(model: Model, solver: i32, changes: bool) -> (CablePlatform, Vec<(String, Status)>) {
    let mut platform = CablePlatform::new(model).unwrap();
    choose(&mut platform, "solver", solver);
    initialise(&mut platform, EXPERIMENT);
    let mut told = Vec::new();
    for k in 0..100 {
        if changes {
            set(&mut platform, "winch_force[1]", 8000.0 + 500.0 * f64::from(k).sin());
        }
        platform.step(0.01 * f64::from(k), 0.01).unwrap();
        let entries = platform.take_log().into_iter().filter(|entry| entry.message.contains("stiff"));
        told.extend(entries.map(|entry| (entry.category.into_owned(), entry.status)));
    }
    (platform, told)
}

#[test]
fn every_solver_gives_the_same_answer() {
    for cable_model in MODELS {
        let answers = SOLVERS.map(|(solver, name)| {
            let (mut platform, told) = run(moving(cable_model, Vec::new()), solver, true);
            assert_eq!(told, [], "{cable_model:?}, {name}");
            ["x", "y", "phi"].map(|name| get(&mut platform, name))
        });
        for answer in &answers[1..] {
            let apart = answer.iter().zip(&answers[0]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(apart < 1e-7, "{cable_model:?}: {answers:?}");
        }
    }
}

#[test]
fn stiffness_is_told_once_and_as_a_warning_where_nothing_is_done_about_it() {
    let friction = EffectSpec::new("winch_coulomb_friction", None, &[250.0, 1e-5]).unwrap();
    let told = |solver: i32| run(moving(CableModel::LumpedMass, vec![friction.clone()]), solver, false).1;
    assert_eq!(told(1), []);
    assert_eq!(told(2), [("logStatusWarning".to_owned(), Status::Warning)]);
    assert_eq!(told(3), [(LOG_SOLVER.to_owned(), Status::Ok)]);
}
