//! What integrations cost, counted: a change that makes them dearer must be seen, one that makes them cheaper recorded.

use std::sync::Arc;

use cdpr::dynamics::Inputs;
use cdpr::effect::EffectSpec;
use cdpr::integrator::{Integrator, Solver, Statistics};
use cdpr::parameters::{CableModel, Parameters};
use cdpr::plant::Plant;
use cdpr::simulation::{Simulation, Start};

use crate::problems::{Dense, Problem, Robertson, VanDerPol};
use crate::scenarios::scenarios;

/// Steps, rejections, Newton iterations, Jacobians, factorisations, evaluations.
type Cost = [u64; 6];

fn cost(s: Statistics) -> Cost {
    [s.steps, s.rejections, s.newton_iterations, s.jacobians, s.factorisations, s.evaluations]
}

/// Counts within 2 % and 3 of what is recorded: rounding may differ between mathematical libraries.
fn check(name: &str, found: Cost, recorded: Cost) {
    let near = |f: u64, r: u64| f.abs_diff(r) <= 3 + r / 50;
    assert!(found.into_iter().zip(recorded).all(|(f, r)| near(f, r)), "{name}: {found:?}, recorded {recorded:?}");
}

fn problem(problem: impl Problem, y: &mut [f64], stops: &[f64]) -> Cost {
    let mut system = Dense::new(problem);
    let mut integrator = Integrator::new(y.len(), 0, 1e-8);
    let mut time = 0.0;
    for stop in stops {
        integrator.advance(&mut system, time, y, stop - time).unwrap();
        time = *stop;
    }
    cost(integrator.statistics())
}

/// Ten seconds at 10 ms between changing inputs.
fn plant(model: CableModel, effects: Vec<EffectSpec>) -> Cost {
    let parameters = Parameters { cable_model: model, ..Parameters::default() };
    let plant = Arc::new(Plant::new(parameters, effects).unwrap());
    let command = |k: u32| {
        let weave = 200.0 * (5e-3 * f64::from(k)).sin();
        Inputs { winch_force: [2e4 + weave, 2e4 - weave, 2e4 + weave, 2e4 - weave].into(), disturbance: [0.0; 3] }
    };
    let start = Start { pose: [0.1; 3], inputs: command(0), ..Start::default() };
    let mut simulation = Simulation::new(plant, &start, 1e-8).unwrap();
    for k in 0..1000 {
        simulation.set_inputs(command(k));
        simulation.advance(0.01).unwrap();
    }
    cost(simulation.statistics())
}

#[test]
fn problems_cost_what_they_did() {
    let decades: Vec<f64> = (-2..=11).map(|k| 10.0_f64.powi(k)).collect();
    check("Van der Pol", problem(VanDerPol, &mut VanDerPol::START.clone(), &[2.0]), [1475, 8, 3506, 232, 896, 10527]);
    check("Robertson", problem(Robertson, &mut [1.0, 0.0, 0.0], &decades), [902, 2, 2161, 111, 347, 6486]);
}

#[test]
fn the_plant_costs_what_it_did() {
    let effect = |id: &str, values: &[f64]| EffectSpec::new(id, None, values).unwrap();
    let some = vec![
        effect("winch_lag", &[0.05]),
        effect("winch_coulomb_friction", &[250.0, 0.01]),
        effect("platform_quadratic_drag", &[20.0, 0.0, 0.0]),
    ];
    check("rigid", plant(CableModel::Rigid, vec![]), [1000, 0, 1000, 1, 1, 4000]);
    check("massless_spring", plant(CableModel::MasslessSpring, vec![]), [4289, 979, 5707, 86, 3763, 18522]);
    check("lumped_mass", plant(CableModel::LumpedMass, vec![]), [1000, 0, 1029, 1, 1, 3088]);
    check("lumped_mass with effects", plant(CableModel::LumpedMass, some), [1001, 0, 1030, 2, 4, 4090]);
}

/// Inputs that jump are no trend of the error: the step after the one that felt the jump is as long as before it.
#[test]
fn forces_that_jump_cost_few_shorter_steps() {
    let six = scenarios().into_iter().find(|scenario| scenario.name == "six effects").unwrap();
    let (_, simulation) = six.run(Solver::Radau, 1e-8, 0.01);
    check("six effects", cost(simulation.statistics()), [1075, 20, 1555, 67, 121, 4765]);
}
