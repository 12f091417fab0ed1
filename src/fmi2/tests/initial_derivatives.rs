//! Directional derivatives in Initialization Mode: of the initial unknowns with respect to what can be set there.

use std::collections::BTreeSet;

use fmi2_export::ModelError;
use fmi2_export::description::{Causality, Initial, Kind};

use super::*;
use crate::kinematics;
use crate::parameters::Initialization;

fn initialising(model: Model) -> CablePlatform {
    let mut platform = CablePlatform::new(model).unwrap();
    platform.enter_initialisation(EXPERIMENT).unwrap();
    platform
}

fn is_real(platform: &CablePlatform, index: usize) -> bool {
    matches!(platform.description().variables[index].kind, Kind::Real(_))
}

/// Real initial unknowns, as ModelStructure/InitialUnknowns lists them.
fn unknowns(platform: &CablePlatform) -> Vec<usize> {
    let description = platform.description();
    description.initial_unknowns().filter(|k| is_real(platform, *k)).collect()
}

/// Inputs, time and exact starts: what table 4.2 calls known in Initialization Mode.
fn knowns(platform: &CablePlatform) -> Vec<usize> {
    let variables = &platform.description().variables;
    let known = |k: &usize| {
        let variable = &variables[*k];
        is_real(platform, *k)
            && (matches!(variable.causality, Causality::Input | Causality::Independent)
                || variable.effective_initial() == Some(Initial::Exact))
    };
    (0..variables.len()).filter(known).collect()
}

fn columns(platform: &mut CablePlatform, unknowns: &[usize], known: usize) -> Result<Vec<f64>, ModelError> {
    let mut out = vec![f64::NAN; unknowns.len()];
    platform.directional_derivative(unknowns, &[known], &[1.0], &mut out).map(|()| out)
}

fn derivative(platform: &mut CablePlatform, unknown: &str, known: &str) -> f64 {
    let (unknown, known) = (index(platform, unknown), index(platform, known));
    columns(platform, &[unknown], known).unwrap()[0]
}

fn near(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance * expected.abs(), "{found}, expected {expected}");
}

#[test]
fn derivatives_are_refused_no_longer_in_initialization_mode() {
    for cable_model in MODELS {
        let mut platform = initialising(moving(cable_model, Vec::new()));
        let (unknowns, knowns) = (unknowns(&platform), knowns(&platform));
        assert!(unknowns.len() > 30 && knowns.len() > 30, "{} {}", unknowns.len(), knowns.len());
        for known in knowns {
            let found = columns(&mut platform, &unknowns, known).unwrap();
            assert!(found.iter().all(|value| value.is_finite()), "{}", platform.description().variables[known].name);
        }
    }
}

/// From states as set, what starts is the state itself: the exact derivatives after initialisation are the same.
#[test]
fn from_states_they_are_the_exact_ones_of_the_run() {
    for cable_model in [CableModel::MasslessSpring, CableModel::LumpedMass] {
        let model = moving(cable_model, Vec::new());
        let mut started = CablePlatform::new(model.clone()).unwrap();
        initialise(&mut started, EXPERIMENT);
        let mut model = model;
        for i in 0..4 {
            model.start.unstretched_length[i] = get(&mut started, &format!("unstretched_length[{}]", i + 1));
        }
        model.start.initialization = Initialization::FromStates;
        let mut platform = initialising(model.clone());
        let unknowns = unknowns(&platform);
        let mut run = CablePlatform::new(model).unwrap();
        initialise(&mut run, EXPERIMENT);
        for name in ["x", "phi", "vy", "unstretched_length[2]", "winch_force[3]", "disturbance_torque"] {
            let known = index(&platform, name);
            let found = columns(&mut platform, &unknowns, known).unwrap();
            let exact = columns(&mut run, &unknowns, known).unwrap();
            for (k, (found, exact)) in found.iter().zip(&exact).enumerate() {
                // Rounding of a tension, 1e-13 EA, over the width of a difference.
                let bound = 2e-7 * exact.abs() + 1e-9;
                let unknown = &platform.description().variables[unknowns[k]].name;
                assert!((found - exact).abs() <= bound, "{cable_model:?}: d {unknown} / d {name}: {found}, {exact}");
            }
        }
    }
}

/// Springs that carry their winch force: closed forms.
#[test]
fn from_winch_forces_they_follow_the_cable_law() {
    let mut model = Model::default();
    model.start.inputs.winch_force = [20_000.0; 4].into();
    let parameters = model.parameters.clone();
    let mut platform = initialising(model);
    let length = get(&mut platform, "cable_length[1]");
    let stiffness = parameters.axial_stiffness();
    let strain = 20_000.0 / stiffness;
    near(derivative(&mut platform, "tension[1]", "winch_force[1]"), 1.0, 1e-7);
    let l = length / (1.0 + strain);
    near(derivative(&mut platform, "unstretched_length[1]", "winch_force[1]"), -l / (1.0 + strain) / stiffness, 1e-6);
    let by_modulus = l / (1.0 + strain) * strain / parameters.youngs_modulus;
    near(derivative(&mut platform, "unstretched_length[1]", "youngs_modulus"), by_modulus, 1e-6);
    near(derivative(&mut platform, "strain[1]", "cable_area"), -strain / parameters.cable_area, 1e-6);
    assert_eq!(derivative(&mut platform, "tension[1]", "winch_force[2]"), 0.0);
    // Not a guess that from_winch_forces takes no notice of.
    assert_eq!(derivative(&mut platform, "tension[1]", "unstretched_length[1]"), 0.0);
}

/// At rest under given forces the platform gives way to a push by the inverse of the geometric stiffness.
#[test]
fn at_rest_the_pose_follows_a_push_by_the_stiffness() {
    let mut model = Model::default();
    model.start.inputs.winch_force = [20_000.0; 4].into();
    model.start.initialization = Initialization::StaticEquilibrium;
    let geometry = crate::geometry::Geometry::new(&model.parameters);
    let stiffness = crate::statics::geometric_stiffness(&geometry, &[0.0; 3], &[20_000.0; 4].into());
    let mut platform = initialising(model);
    let compliance = stiffness.try_inverse().unwrap();
    // The pose itself is exact there: what moves are lengths.
    let along = kinematics::cables(&geometry, &[0.0; 3], &[0.0; 3])[0].jacobian_row();
    let expected = along[0] * compliance[(0, 0)] + along[1] * compliance[(1, 0)] + along[2] * compliance[(2, 0)];
    near(derivative(&mut platform, "cable_length[1]", "disturbance_force_x"), expected, 1e-5);
}

#[test]
fn a_start_at_its_bound_says_why_it_has_no_derivative() {
    let mut model = Model::default();
    model.parameters.cable_damping = 0.0;
    let mut platform = initialising(model);
    let (tension, damping) = (index(&platform, "tension[1]"), index(&platform, "cable_damping"));
    let error = columns(&mut platform, &[tension], damping).unwrap_err();
    assert!(error.message.contains("both ways") && error.message.contains("cable_damping"), "{error}");
}

#[test]
fn declared_initial_dependencies_cover_what_shows() {
    let mut moving = moving(CableModel::LumpedMass, Vec::new());
    moving.start.initialization = Initialization::FromWinchForces;
    let mut at_rest = Model::default();
    at_rest.start.initialization = Initialization::StaticEquilibrium;
    at_rest.start.inputs.winch_force = [20_000.0; 4].into();
    at_rest.start.inputs.disturbance = [200.0, -150.0, 900.0];
    for model in [moving, at_rest] {
        let mut platform = initialising(model);
        let (unknowns, knowns) = (unknowns(&platform), knowns(&platform));
        for known in knowns {
            let found = columns(&mut platform, &unknowns, known).unwrap();
            for (unknown, value) in unknowns.iter().zip(found) {
                let variable = &platform.description().variables[*unknown];
                let Some(list) = &variable.initial_dependencies else { continue };
                let declared: BTreeSet<usize> = list.iter().map(|d| d.index).collect();
                let name = &platform.description().variables[known].name;
                // What is left of a search that stopped at 1e-9 of the forces is no dependency.
                assert!(declared.contains(&known) || value.abs() < 1e-9, "d {} / d {name} = {value}", variable.name);
            }
        }
    }
}
