//! The explicit pair, by itself and with the change over to the implicit method.

use std::sync::Arc;

use cdpr::dynamics::Inputs;
use cdpr::effect::EffectSpec;
use cdpr::integrator::{IntegrationError, Integrator, Solver};
use cdpr::parameters::{CableModel, Parameters};
use cdpr::plant::Plant;
use cdpr::simulation::{Simulation, Start};

use crate::circle::{self, Control};
use crate::problems::{
    Dense, Easing, Oscillator, Problem, ProtheroRobinson, TwoPulls, Unweighed, VanDerPol, assert_order,
};
use crate::scenarios::scenarios;

fn run(
    solver: Solver,
    problem: impl Problem,
    y: &mut [f64],
    tolerance: f64,
    stops: &[f64],
) -> Result<Integrator, IntegrationError> {
    let switches = problem.switches();
    let mut system = Dense::new(problem);
    let mut integrator = Integrator::new(y.len(), switches, tolerance);
    integrator.set_solver(solver);
    let mut time = 0.0;
    for stop in stops {
        integrator.advance(&mut system, time, y, stop - time)?;
        time = *stop;
    }
    Ok(integrator)
}

/// Equal steps: the error must fall by 2⁵ with each halving.
#[test]
fn order_is_five() {
    let error = |steps: u32| {
        let problem = Oscillator { frequency: 2.0, damping: 0.1 };
        let exact = problem.at(1.0);
        let mut y = [1.0, 0.0];
        let stops: Vec<f64> = (1..=steps).map(|k| f64::from(k) / f64::from(steps)).collect();
        let integrator = run(Solver::DormandPrince, Unweighed(problem), &mut y, 1e-8, &stops).unwrap();
        assert_eq!(integrator.statistics().steps, u64::from(steps));
        (y[0] - exact[0]).hypot(y[1] - exact[1])
    };
    let errors: Vec<f64> = [16, 32, 64, 128].map(error).to_vec();
    assert_order(&errors, 5.0);
}

#[test]
fn tolerances_are_kept_over_many_periods() {
    for tolerance in [1e-5, 1e-7, 1e-9, 1e-11] {
        let problem = Oscillator { frequency: 13.0, damping: 0.01 };
        let exact = problem.at(5.0);
        let mut y = [1.0, 0.0];
        run(Solver::DormandPrince, problem, &mut y, tolerance, &[5.0]).unwrap();
        let error = (y[0] - exact[0]).abs().max((y[1] - exact[1]).abs() / 13.0);
        assert!(error < 10.0 * tolerance, "tolerance {tolerance:e}: {error:e}");
    }
}

/// Parabolas are integrated exactly, so that all error is in the location of the switches.
#[test]
fn switches_are_located_to_rounding() {
    for stops in [vec![10.0], (1..=100).map(|k| 0.1 * f64::from(k)).collect()] {
        let mut y = [1.0, 0.0];
        run(Solver::DormandPrince, TwoPulls { above: true }, &mut y, 1e-6, &stops).unwrap();
        let exact = TwoPulls::at(10.0);
        for k in 0..2 {
            assert!((y[k] - exact[k]).abs() < 1e-10, "{} stops: {y:?}, {exact:?}", stops.len());
        }
    }
}

/// Whatever the step, the error in metres is at most ten times the tolerance, over all steps together; against the implicit
/// method at a tolerance of 1e-13.
#[test]
fn the_plant_keeps_its_tolerance_at_every_step() {
    for scenario in scenarios() {
        for step in [1e-3, 1e-2, 1e-1] {
            let (exact, _) = scenario.run(Solver::Radau, 1e-13, step);
            let runs =
                [1e-6, 1e-8, 1e-10].map(|tolerance| [Solver::DormandPrince, Solver::Auto].map(|s| (tolerance, s)));
            for (tolerance, solver) in runs.into_iter().flatten() {
                let (found, simulation) = scenario.run(solver, tolerance, step);
                let error = scenario.difference(&found, &exact);
                assert!(
                    error < 10.0 * tolerance,
                    "{}, {solver:?}, step {step} s, tolerance {tolerance:e}: {error:e} m",
                    scenario.name
                );
                assert!(step > 0.01 || simulation.stiff_since().is_none(), "{}, step {step} s", scenario.name);
            }
        }
    }
}

#[test]
fn stiff_problems_are_handed_over() {
    for (tolerance, allowed) in [(1e-5, 1e-3), (1e-8, 1e-6), (1e-11, 1e-9)] {
        let mut y = VanDerPol::START;
        let integrator = run(Solver::Auto, VanDerPol, &mut y, tolerance, &[2.0]).unwrap();
        assert!(integrator.stiff_since().is_some_and(|since| since < 1e-3), "{:?}", integrator.stiff_since());
        for k in 0..2 {
            assert!((y[k] - VanDerPol::AT_2[k]).abs() < allowed, "tolerance {tolerance:e}: {y:?}");
        }
    }
    for lambda in [-1.0, -1e3, -1e6, -1e9] {
        let mut y = [1.0];
        let integrator = run(Solver::Auto, ProtheroRobinson { lambda }, &mut y, 1e-9, &[10.0]).unwrap();
        // At 1e3 1/s it is still accuracy that bounds the steps, within stability.
        assert_eq!(integrator.stiff_since().is_some(), lambda < -1e3, "λ = {lambda:e}");
        let error = (y[0] - 10.0_f64.cos()).abs();
        assert!(error < if lambda < -100.0 { 5e-6 } else { 1e-7 }, "λ = {lambda:e}: {error:e}");
    }
}

/// Steps of 10 ms, stiff for a second: after it the explicit method has its trials and goes on, as the cheaper one.
#[test]
fn the_explicit_method_comes_back_after_stiff_equations() {
    let run_to = |end: u32| {
        let stops: Vec<f64> = (1..=100 * end).map(|k| 0.01 * f64::from(k)).collect();
        let mut y = [1.0; Easing::COPIES];
        let integrator = run(Solver::Auto, Easing { until: 1.0 }, &mut y, 1e-9, &stops).unwrap();
        assert!(y.iter().all(|y| (y - f64::from(end).cos()).abs() < 1e-7), "{y:?}");
        integrator
    };
    let (first, before, after) = (run_to(1), run_to(19), run_to(20));
    assert!(first.stiff_since().is_some_and(|since| since < 0.01), "{:?}", first.stiff_since());
    assert_eq!(before.statistics().newton_iterations, after.statistics().newton_iterations);
}

/// Massless springs after jumps are not stiff, but dearer by explicit steps; without them implicit steps are never tried.
#[test]
fn the_cheaper_method_goes_on() {
    let cost = |name: &str, solver: Solver| {
        let scenario = scenarios().into_iter().find(|scenario| scenario.name == name).unwrap();
        scenario.run(solver, 1e-8, 0.01).1.statistics()
    };
    let [auto, explicit] = [Solver::Auto, Solver::DormandPrince].map(|solver| cost("jumps", solver));
    assert!(5 * auto.evaluations < 3 * explicit.evaluations, "{auto:?}, {explicit:?}");
    assert_eq!(cost("weave", Solver::Auto).jacobians, 0);
}

/// On the bench's circle: the poses, angles times the platform's radius, and the end.
fn on_the_circle(plant: Plant, solver: Solver, tolerance: f64) -> (Vec<[f64; 3]>, Simulation) {
    let plant = Arc::new(plant);
    let mut control = Control::new(*plant.geometry());
    let pose = circle::start_pose();
    let inputs = Control::new(*plant.geometry()).inputs(0, &[pose, [0.0; 3]].concat());
    let start = Start { pose, inputs, ..Start::default() };
    let mut simulation = Simulation::new(plant, &start, tolerance).unwrap().with_solver(solver);
    let step = |k: usize| {
        simulation.set_inputs(control.inputs(k, simulation.states()));
        simulation.advance(circle::STEP).unwrap();
        [simulation.states()[0], simulation.states()[1], 10.0 * simulation.states()[2]]
    };
    let poses = (0..circle::STEPS).map(step).collect();
    (poses, simulation)
}

/// Under sag tension is found by iteration, four times the price of another evaluation: implicit steps, which take fewer of
/// them, are the cheaper ones. The count took such a law for one like others, and stayed with explicit steps.
#[test]
fn a_law_that_is_iterated_counts_as_what_it_costs() {
    let sag = EffectSpec::new("cable_sag", None, &[2.0, 2e4]).unwrap();
    let plant = Plant::new(Parameters::default(), vec![sag]).unwrap();
    let statistics = on_the_circle(plant, Solver::Auto, 1e-8).1.statistics();
    assert!(10 * statistics.newton_iterations > 8 * statistics.steps, "{statistics:?}");
}

/// Massless springs: on trial or not, the tolerance holds.
#[test]
fn a_change_of_methods_keeps_the_tolerance() {
    let run = |solver: Solver, tolerance: f64| {
        let parameters = Parameters { cable_model: CableModel::MasslessSpring, ..Parameters::default() };
        on_the_circle(Plant::new(parameters, Vec::new()).unwrap(), solver, tolerance).0
    };
    let (exact, found) = (run(Solver::Radau, 1e-13), run(Solver::Auto, 1e-8));
    let apart = exact.iter().zip(&found).flat_map(|(a, b)| (0..3).map(|k| (a[k] - b[k]).abs())).fold(0.0, f64::max);
    assert!(apart < 5e-8, "{apart:e}");
}

/// By itself the explicit method says that the equations are stiff, and its work is limited.
#[test]
fn stiffness_without_a_way_out_ends_at_the_allowance() {
    let mut y = VanDerPol::START;
    let error = run(Solver::DormandPrince, VanDerPol, &mut y, 1e-8, &[2.0]).unwrap_err();
    assert!(matches!(error, IntegrationError::TooMuchWork { .. }), "{error}");
}

fn simulation(model: CableModel, effects: Vec<EffectSpec>, solver: Solver) -> Simulation {
    let parameters = Parameters { cable_model: model, ..Parameters::default() };
    let plant = Arc::new(Plant::new(parameters, effects).unwrap());
    let start = Start { pose: [0.1; 3], inputs: Inputs::pulling(4, 2e4), ..Start::default() };
    Simulation::new(plant, &start, 1e-8).unwrap().with_solver(solver)
}

/// Six evaluations a step; the rates at the end serve the next step as long as nothing changes but forces at winches that do no more
/// than accelerate the ends of their cables.
#[test]
fn a_step_costs_six_evaluations_and_one_where_the_equations_change() {
    let drag = EffectSpec::new("platform_quadratic_drag", None, &[20.0, 0.0, 0.0]).unwrap();
    let gain = EffectSpec::new("winch_force_gain", None, &[0.01]).unwrap();
    let count = |effects: &[EffectSpec], inputs: &dyn Fn(u32) -> Inputs| {
        let mut simulation = simulation(CableModel::LumpedMass, effects.to_vec(), Solver::DormandPrince);
        for k in 0..100 {
            simulation.set_inputs(inputs(k));
            simulation.advance(0.01).unwrap();
        }
        (simulation.statistics().steps, simulation.statistics().evaluations)
    };
    let jump = |k: u32| f64::from(k % 2);
    let pulled = |k: u32| Inputs::pulling(4, 2e4 + jump(k));
    let pushed = |k: u32| Inputs { disturbance: [jump(k), 0.0, 0.0], ..Inputs::pulling(4, 2e4) };
    assert_eq!(count(&[], &|_| Inputs::pulling(4, 2e4)), (100, 601));
    assert_eq!(count(&[], &pulled), (100, 601));
    assert_eq!(count(&[], &pushed), (100, 700));
    assert_eq!(count(&[drag], &pulled), (100, 601));
    assert_eq!(count(&[gain], &pulled), (100, 700));
}

/// Commands that jump, and that then rise.
#[test]
fn rates_that_follow_the_winch_forces_are_those_of_an_evaluation() {
    // Of states between those of the cables as well.
    let creep = EffectSpec::new("cable_creep", Some(2), &[1e8, 10.0]).unwrap();
    for (solver, most) in [(Solver::DormandPrince, 1e-12), (Solver::Radau, 1e-10)] {
        let mut followed = simulation(CableModel::LumpedMass, vec![creep.clone()], solver);
        let mut evaluated = followed.clone();
        for k in 0..300_u32 {
            let pull = |by: f64| Inputs::pulling(4, 2e4 + 300.0 * (by * f64::from(k)).sin());
            let slopes = Inputs { winch_force: [500.0, -300.0, 100.0, 0.0].into(), disturbance: [0.0; 3] };
            for simulation in [&mut followed, &mut evaluated] {
                if k % 3 == 0 {
                    simulation.set_inputs_with_slopes(pull(0.3), slopes);
                } else if k % 3 == 1 {
                    simulation.set_inputs(pull(0.7));
                }
            }
            let states = evaluated.states().to_vec();
            evaluated.nudge_states(&states);
            followed.advance(0.01).unwrap();
            evaluated.advance(0.01).unwrap();
        }
        let saved = evaluated.statistics().evaluations - followed.statistics().evaluations;
        assert!((290..=299).contains(&saved), "{solver:?}: {saved} evaluations");
        for (a, b) in followed.states().iter().zip(evaluated.states()) {
            assert!((a - b).abs() < most * a.abs().max(1.0), "{solver:?}: {a}, with evaluations {b}");
        }
    }
}

/// Winches with friction so steep that the fastest rate is some 5e5 1/s while they stand.
#[test]
fn a_stiff_plant_ends_where_the_implicit_method_does() {
    let friction = EffectSpec::new("winch_coulomb_friction", None, &[250.0, 1e-5]).unwrap();
    for (model, effects) in
        [(CableModel::LumpedMass, vec![friction.clone()]), (CableModel::MasslessSpring, vec![friction])]
    {
        let [auto, radau] = [Solver::Auto, Solver::Radau].map(|solver| {
            let mut simulation = simulation(model, effects.clone(), solver);
            for k in 0..200 {
                let weave = 400.0 * (0.05 * f64::from(k)).sin();
                let force = [2e4 + weave, 2e4 - weave, 2e4 + weave, 2e4 - weave];
                simulation.set_inputs(Inputs { winch_force: force.into(), disturbance: [0.0; 3] });
                simulation.advance(0.01).unwrap();
            }
            simulation
        });
        assert!(auto.stiff_since().is_some(), "{model:?}");
        assert_eq!(radau.stiff_since(), None);
        let apart = auto.states().iter().zip(radau.states()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(apart < 1e-6, "{model:?}: {apart:e}");
    }
}
