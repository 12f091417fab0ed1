//! What a step costs, beside what it would cost otherwise. Run with `cargo bench --bench step`.
//!
//! The winch forces are those of a closed loop around the method that is timed, written down first and replayed, so that
//! the controller's own time is not counted. Methods take turns, and every stretch counts as the fastest of many runs took,
//! so that other work on the machine disturbs it little; ratios within one call are what to compare between machines. The measured
//! table stands in `docs/performance.md`.

mod circle;
mod dense;
mod dormand_prince;

use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

use cdpr::dynamics::Inputs;
use cdpr::effect::EffectSpec;
use cdpr::geometry::Geometry;
use cdpr::integrator::{Integrator, Solver};
use cdpr::parameters::{CableModel, Parameters};
use cdpr::plant::Plant;
use cdpr::simulation::{DEFAULT_TOLERANCE, Simulation, Start};

use circle::{Control, STEP, STEPS};
use dense::DenseSystem;
use dormand_prince::DormandPrince;

/// Runs of a turn.
const RUNS: usize = 50;
/// Ours, the default first.
const SOLVERS: [Solver; 3] = [Solver::Radau, Solver::DormandPrince, Solver::Auto];
/// Steps that are timed together.
const STRETCH: usize = 100;

/// Something that integrates the plant from one communication point to the next.
trait Method: Clone {
    fn states(&self) -> &[f64];
    fn advance(&mut self, inputs: &Inputs);
}

impl Method for Simulation {
    fn states(&self) -> &[f64] {
        Simulation::states(self)
    }

    fn advance(&mut self, inputs: &Inputs) {
        self.set_inputs(*inputs);
        Simulation::advance(self, STEP).expect("the circle can be simulated");
    }
}

impl Method for DormandPrince<'_> {
    fn states(&self) -> &[f64] {
        &self.states
    }

    fn advance(&mut self, inputs: &Inputs) {
        DormandPrince::advance(self, inputs, STEP);
    }
}

/// The same method as ours on a dense matrix.
#[derive(Clone)]
struct DenseRadau {
    system: DenseSystem,
    integrator: Integrator,
    states: Vec<f64>,
    steps: usize,
}

impl Method for DenseRadau {
    fn states(&self) -> &[f64] {
        &self.states
    }

    fn advance(&mut self, inputs: &Inputs) {
        self.system.inputs = *inputs;
        self.integrator.equations_changed();
        let time = STEP * self.steps as f64;
        self.integrator.advance(&mut self.system, time, &mut self.states, STEP).expect("as with the structured solve");
        self.steps += 1;
    }
}

fn simulation(model: CableModel, effects: &[EffectSpec], solver: Solver, tolerance: f64) -> Simulation {
    let parameters = Parameters { cable_model: model, ..Parameters::default() };
    let plant = Arc::new(Plant::new(parameters, effects.to_vec()).expect("a plant of the defaults"));
    let pose = circle::start_pose();
    let states = [pose, [0.0; 3]].concat();
    let inputs = control().inputs(0, &states);
    let start = Start { pose, inputs, ..Start::default() };
    Simulation::new(plant, &start, tolerance).expect("a start inside the anchors").with_solver(solver)
}

fn control() -> Control {
    Control::new(Geometry::new(&Parameters::default()))
}

/// A turn in the closed loop: the inputs of every step, and the states after it.
struct Turn {
    inputs: Vec<Inputs>,
    states: Vec<Vec<f64>>,
}

impl Turn {
    fn of<M: Method>(start: &M) -> Self {
        let (mut method, mut control) = (start.clone(), control());
        let mut turn = Self { inputs: Vec::new(), states: Vec::new() };
        for k in 0..STEPS {
            let inputs = control.inputs(k, method.states());
            method.advance(&inputs);
            turn.inputs.push(inputs);
            turn.states.push(method.states().to_vec());
        }
        turn
    }

    /// Largest difference of pose and unstretched lengths anywhere on the way (m), the angle times the platform's radius.
    fn error(&self, reference: &Self, plant: &Plant) -> f64 {
        let lengths: Vec<usize> = (0..4).filter_map(|i| plant.unstretched_index(i)).collect();
        let of = |a: &[f64], b: &[f64]| {
            let pose = [(0, 1.0), (1, 1.0), (2, 10.0)].into_iter();
            let all = pose.chain(lengths.iter().map(|at| (*at, 1.0)));
            all.map(|(at, arm)| arm * (a[at] - b[at]).abs())
                .fold(0.0, |worst: f64, e| if e.is_nan() { f64::INFINITY } else { worst.max(e) })
        };
        self.states.iter().zip(&reference.states).map(|(a, b)| of(a, b)).fold(0.0, f64::max)
    }

    /// The same turn again; `fastest` takes up what each stretch of it took (ns), where that is less than before.
    fn replay<M: Method>(&self, start: &M, fastest: &mut [f64]) {
        let mut method = start.clone();
        for (inputs, fastest) in self.inputs.chunks(STRETCH).zip(fastest) {
            let begun = Instant::now();
            inputs.iter().for_each(|inputs| method.advance(inputs));
            *fastest = fastest.min(begun.elapsed().as_nanos() as f64);
        }
        assert_eq!(method.states(), self.states.last().expect("a turn has steps").as_slice(), "not the same turn");
    }
}

/// Methods that are timed side by side, in rounds: what else the machine does then strikes all of them. Each stretch of a turn
/// counts as its fastest run took: a turn is too long to be left alone by other work, a stretch is not.
struct Race<'a> {
    exact: &'a Turn,
    entrants: Vec<Entrant<'a>>,
}

/// A run of a turn; takes up what each stretch of it took (ns).
type Run<'a> = Box<dyn FnMut(&mut [f64]) + 'a>;

struct Entrant<'a> {
    name: String,
    error: f64,
    counts: String,
    run: Run<'a>,
    fastest: Vec<f64>,
}

impl<'a> Race<'a> {
    fn against(exact: &'a Turn) -> Self {
        Self { exact, entrants: Vec::new() }
    }

    fn enter<M: Method + 'a>(&mut self, name: String, start: M, plant: &Plant, counts: impl FnOnce(&Turn) -> String) {
        let turn = Turn::of(&start);
        let error = turn.error(self.exact, plant);
        if !error.is_finite() || error > 1.0 {
            println!("  {name}: unstable");
            return;
        }
        let counts = counts(&turn);
        let run = Box::new(move |fastest: &mut [f64]| turn.replay(&start, fastest));
        self.entrants.push(Entrant { name, error, counts, run, fastest: vec![f64::INFINITY; STEPS / STRETCH] });
    }

    /// Ours, with what it counts.
    fn enter_ours(&mut self, model: CableModel, effects: &[EffectSpec], solver: Solver, tolerance: f64) {
        let start = simulation(model, effects, solver, tolerance);
        let plant = start.plant().clone();
        let mut end = start.clone();
        let counts = |turn: &Turn| {
            turn.inputs.iter().for_each(|inputs| Method::advance(&mut end, inputs));
            let s = end.statistics();
            let each = |count: u64| count as f64 / STEPS as f64;
            let [steps, evaluations, iterations, factors] =
                [s.steps, s.evaluations, s.newton_iterations, s.factorisations].map(each);
            let stiff = end.stiff_since().map_or(String::new(), |since| format!(", stiff since {since} s"));
            format!(
                "{steps:.2} steps, {evaluations:.2} evaluations, {iterations:.2} Newton iterations, {factors:.4} \
                 factorisations, {} Jacobians in all{stiff}",
                s.jacobians
            )
        };
        self.enter(format!("{solver:?}, tolerance {tolerance:.0e}"), start, &plant, counts);
    }

    /// Dormand and Prince's method by itself at fixed steps.
    fn enter_fixed(&mut self, origin: &'a Simulation) {
        for parts in [1, 2, 4, 8] {
            let name = format!("Dormand-Prince, {parts} fixed steps in one");
            self.enter(name, DormandPrince::new(origin, parts), origin.plant(), |_| String::new());
        }
    }

    /// Prints nanoseconds a step, as ratios to the first as well.
    fn run(mut self) {
        for _ in 0..RUNS {
            self.entrants.iter_mut().for_each(|entrant| (entrant.run)(&mut entrant.fastest));
        }
        let mut first = f64::NAN;
        for Entrant { name, error, counts, fastest, .. } in self.entrants {
            let nanoseconds = fastest.iter().sum::<f64>() / STEPS as f64;
            if first.is_nan() {
                first = nanoseconds;
            }
            println!("  {name}: {nanoseconds:.0} ns a step, ratio {:.2}, error {error:.1e} m", nanoseconds / first);
            if !counts.is_empty() {
                println!("    {counts}");
            }
        }
    }
}

fn reference(model: CableModel, effects: &[EffectSpec]) -> Turn {
    Turn::of(&simulation(model, effects, Solver::Radau, 1e-13))
}

fn variants() {
    let effect = |id: &str, values: &[f64]| EffectSpec::new(id, None, values).expect("in range");
    let lag = effect("winch_lag", &[0.05]);
    let friction = effect("winch_coulomb_friction", &[250.0, 0.01]);
    let drag = effect("platform_quadratic_drag", &[20.0, 0.0, 0.0]);
    for (name, model, effects) in [
        ("rigid", CableModel::Rigid, vec![]),
        ("lumped_mass with drag", CableModel::LumpedMass, vec![drag.clone()]),
        ("lumped_mass with friction", CableModel::LumpedMass, vec![friction.clone()]),
        ("lumped_mass with capstan loss", CableModel::LumpedMass, vec![effect("pulley_capstan_loss", &[0.01, 0.02])]),
        ("lumped_mass with sag", CableModel::LumpedMass, vec![effect("cable_sag", &[2.0, 2e4])]),
        ("lumped_mass with lag, friction, drag", CableModel::LumpedMass, vec![lag, friction, drag]),
    ] {
        println!("{name}");
        let exact = reference(model, &effects);
        let mut race = Race::against(&exact);
        SOLVERS.into_iter().for_each(|solver| race.enter_ours(model, &effects, solver, DEFAULT_TOLERANCE));
        race.run();
    }
}

fn single_evaluation() -> f64 {
    let start = simulation(CableModel::LumpedMass, &[], Solver::Radau, DEFAULT_TOLERANCE);
    let (plant, inputs) = (start.plant(), start.inputs());
    let mut rates = vec![0.0; plant.dimension()];
    let mut fastest = f64::INFINITY;
    for _ in 0..100 * RUNS {
        let begun = Instant::now();
        for _ in 0..STRETCH {
            plant.rates(0.0, black_box(start.states()), black_box(&inputs), &Simulation::slack(&start), &mut rates);
            black_box(&rates);
        }
        fastest = fastest.min(begun.elapsed().as_nanos() as f64 / STRETCH as f64);
    }
    fastest
}

fn main() {
    println!("a circle of 5 m in 60 s at 20 kN, closed loop, forces held over 10 ms; errors: largest on the way");
    println!("one evaluation of the rates: {:.0} ns", single_evaluation());
    println!("lumped_mass");
    let exact = reference(CableModel::LumpedMass, &[]);
    let start = simulation(CableModel::LumpedMass, &[], Solver::Radau, DEFAULT_TOLERANCE);
    let n = start.states().len();
    let mut race = Race::against(&exact);
    for tolerance in [DEFAULT_TOLERANCE, 1e-6, 1e-10] {
        SOLVERS.into_iter().for_each(|solver| race.enter_ours(CableModel::LumpedMass, &[], solver, tolerance));
    }
    race.enter_fixed(&start);
    let dense = DenseRadau {
        system: DenseSystem::new(start.plant().clone()),
        integrator: Integrator::new(n, 0, DEFAULT_TOLERANCE),
        states: start.states().to_vec(),
        steps: 0,
    };
    race.enter("Radau with a dense LU".to_owned(), dense, start.plant(), |_| String::new());
    race.run();

    println!("massless_spring");
    let exact = reference(CableModel::MasslessSpring, &[]);
    let start = simulation(CableModel::MasslessSpring, &[], Solver::Radau, DEFAULT_TOLERANCE);
    let mut race = Race::against(&exact);
    SOLVERS.into_iter().for_each(|solver| race.enter_ours(CableModel::MasslessSpring, &[], solver, DEFAULT_TOLERANCE));
    race.enter_fixed(&start);
    race.run();
    variants();
}
