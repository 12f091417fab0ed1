//! What a step costs, beside what it would cost otherwise. Run with `cargo bench --bench step`.
//!
//! Every figure is the best of many short batches, so that other work on the machine disturbs it little; ratios within
//! one run are what to compare between machines. The measured table stands in `docs/performance.md`.

mod dense;
mod explicit;

use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

use cdpr::dynamics::Inputs;
use cdpr::effect::EffectSpec;
use cdpr::integrator::Radau;
use cdpr::parameters::{CableModel, Parameters};
use cdpr::plant::Plant;
use cdpr::simulation::{Simulation, Start};

/// Communication step (s).
const STEP: f64 = 0.01;
/// Steps of one batch: 2 s of motion.
const BATCH: usize = 200;
/// Batches; the fastest counts.
const BATCHES: usize = 200;

/// Winch forces that a controller might ask for at step `k`: constant pretension and a slow weave, held over the step.
fn command(k: usize) -> Inputs {
    let t = STEP * k as f64;
    let weave = 200.0 * (0.5 * t).sin();
    Inputs { winch_force: [2e4 + weave, 2e4 - weave, 2e4 + weave, 2e4 - weave], disturbance: [0.0; 3] }
}

fn simulation(model: CableModel, effects: &[EffectSpec], tolerance: f64) -> Simulation {
    let parameters = Parameters { cable_model: model, ..Parameters::default() };
    let plant = Arc::new(Plant::new(parameters, effects.to_vec()).expect("a plant of the defaults"));
    let start = Start { pose: [0.1; 3], inputs: command(0), ..Start::default() };
    Simulation::new(plant, &start, tolerance).expect("a start inside the anchors")
}

/// Nanoseconds per step of `run`, which makes [`BATCH`] steps; the best of many.
fn best(mut run: impl FnMut()) -> f64 {
    let mut best = f64::INFINITY;
    for _ in 0..BATCHES {
        let begun = Instant::now();
        run();
        best = best.min(begun.elapsed().as_nanos() as f64 / BATCH as f64);
    }
    best
}

/// Advances a copy of `start` over a batch.
fn batch(start: &Simulation) -> Simulation {
    let mut simulation = start.clone();
    for k in 0..BATCH {
        simulation.set_inputs(command(k));
        simulation.advance(STEP).expect("the release can be simulated");
    }
    simulation
}

/// Largest difference of two poses, the angle times the platform's radius (m).
fn pose_error(a: &[f64], b: &[f64]) -> f64 {
    (a[0] - b[0]).abs().max((a[1] - b[1]).abs()).max((a[2] - b[2]).abs() * 10.0)
}

fn ours(reference: &Simulation) -> f64 {
    println!("Radau IIA(5), lumped_mass, 14 states, 10 ms between inputs");
    let mut at_default = f64::NAN;
    for tolerance in [1e-6, cdpr::simulation::DEFAULT_TOLERANCE, 1e-10] {
        let start = simulation(CableModel::LumpedMass, &[], tolerance);
        let end = batch(&start);
        let nanoseconds = best(|| {
            black_box(batch(black_box(&start)));
        });
        let s = end.statistics();
        println!(
            "  tolerance {tolerance:.0e}: {nanoseconds:7.0} ns a step, {:.2} evaluations, {:.2} Newton iterations, \
             {:.3} factorisations; pose error {:.1e} m after 2 s",
            s.evaluations as f64 / BATCH as f64,
            s.newton_iterations as f64 / BATCH as f64,
            s.factorisations as f64 / BATCH as f64,
            pose_error(end.states(), reference.states()),
        );
        if tolerance == cdpr::simulation::DEFAULT_TOLERANCE {
            at_default = nanoseconds;
        }
    }
    at_default
}

fn variants() {
    println!("the other models and effects, default tolerance");
    let lag = EffectSpec::new("winch_lag", None, &[0.05]).expect("in range");
    let friction = EffectSpec::new("winch_coulomb_friction", None, &[250.0, 0.01]).expect("in range");
    let drag = EffectSpec::new("platform_quadratic_drag", None, &[20.0, 0.0, 0.0]).expect("in range");
    for (name, model, effects) in [
        ("rigid", CableModel::Rigid, vec![]),
        ("massless_spring", CableModel::MasslessSpring, vec![]),
        ("lumped_mass with drag", CableModel::LumpedMass, vec![drag.clone()]),
        ("lumped_mass with lag, friction, drag", CableModel::LumpedMass, vec![lag, friction, drag]),
    ] {
        let start = simulation(model, &effects, cdpr::simulation::DEFAULT_TOLERANCE);
        let nanoseconds = best(|| {
            black_box(batch(black_box(&start)));
        });
        let s = batch(&start).statistics();
        println!(
            "  {name}: {nanoseconds:.0} ns a step, {:.2} evaluations, {:.2} iterations",
            s.evaluations as f64 / BATCH as f64,
            s.newton_iterations as f64 / BATCH as f64
        );
    }
}

fn single_evaluation() -> f64 {
    let start = simulation(CableModel::LumpedMass, &[], 1e-8);
    let (plant, u) = (start.plant(), command(1));
    let mut rates = vec![0.0; plant.dimension()];
    best(|| {
        for _ in 0..BATCH {
            plant.rates(0.0, black_box(start.states()), black_box(&u), [false; 4], &mut rates);
            black_box(&rates);
        }
    })
}

fn dense_radau(reference: &Simulation) -> f64 {
    let start = simulation(CableModel::LumpedMass, &[], cdpr::simulation::DEFAULT_TOLERANCE);
    let run = || {
        let mut system = dense::DenseSystem::new(start.plant().clone());
        let mut radau = Radau::new(start.states().len(), 0, cdpr::simulation::DEFAULT_TOLERANCE);
        let mut y = start.states().to_vec();
        for k in 0..BATCH {
            system.inputs = command(k);
            radau.advance(&mut system, STEP * k as f64, &mut y, STEP).expect("as with the structured solve");
        }
        y
    };
    let error = pose_error(&run(), reference.states());
    let nanoseconds = best(|| {
        black_box(run());
    });
    println!("the same method with a dense LU: {nanoseconds:.0} ns a step; pose error {error:.1e} m");
    nanoseconds
}

/// Largest difference of two pose and length states (m), the angle times the platform's radius.
fn state_error(plant: &Plant, a: &[f64], b: &[f64]) -> f64 {
    let lengths = (0..4).filter_map(|i| plant.unstretched_index(i)).map(|at| (a[at] - b[at]).abs());
    lengths.fold(pose_error(a, b), |worst, e| if e.is_nan() { f64::INFINITY } else { worst.max(e) })
}

fn explicit_methods() {
    for model in [CableModel::LumpedMass, CableModel::MasslessSpring] {
        let start = simulation(model, &[], cdpr::simulation::DEFAULT_TOLERANCE);
        let reference = batch(&simulation(model, &[], 1e-13));
        let error = state_error(start.plant(), batch(&start).states(), reference.states());
        let ours = best(|| {
            black_box(batch(black_box(&start)));
        });
        println!("{model:?}, pose and lengths: ours {ours:.0} ns a step, error {error:.1e} m");
        for parts in [1, 2, 4, 8, 16] {
            let run = || explicit::runge_kutta_4(start.plant(), start.states(), BATCH, parts, STEP, command);
            let error = state_error(start.plant(), &run(), reference.states());
            if error > 1e3 {
                println!("  RK4, {parts} per step: unstable");
                continue;
            }
            let nanoseconds = best(|| {
                black_box(run());
            });
            let ratio = nanoseconds / ours;
            println!("  RK4, {parts} per step: {nanoseconds:.0} ns a step ({ratio:.2} of ours), error {error:.1e} m");
        }
    }
}

fn main() {
    let reference = batch(&simulation(CableModel::LumpedMass, &[], 1e-13));
    let step = ours(&reference);
    let evaluation = single_evaluation();
    println!("one evaluation of the rates: {evaluation:.0} ns, a step is {:.1} of them", step / evaluation);
    variants();
    let dense = dense_radau(&reference);
    println!("structured against dense solve: {:.2} times faster", dense / step);
    explicit_methods();
}
