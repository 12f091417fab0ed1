//! What cannot be simulated is said, with the time and the state; nothing hangs, nothing turns into NaN.

use cdpr::dynamics::Inputs;
use cdpr::effect::EffectSpec;
use cdpr::integrator::IntegrationError;
use cdpr::parameters::{CableInertia, CableModel, Initialization};
use cdpr::simulation::{Simulation, Start, StartError};

use crate::random::{MODELS, plant};

fn simulation(model: CableModel) -> Simulation {
    Simulation::new(plant(model, CableInertia::Paper, &[]), &Start::default(), 1e-8).unwrap()
}

#[test]
fn durations_must_be_sensible() {
    for model in MODELS {
        let mut simulation = simulation(model);
        let before = simulation.states().to_vec();
        for bad in [-0.1, f64::NAN, f64::INFINITY] {
            let error = simulation.advance(bad).unwrap_err();
            assert!(matches!(error, IntegrationError::Duration { .. }), "{error}");
            assert_eq!(error.time(), 0.0);
        }
        assert!(simulation.advance_to(-1.0).is_err());
        simulation.advance(0.0).unwrap();
        assert_eq!((simulation.states(), simulation.time()), (&before[..], 0.0));
    }
}

#[test]
fn inputs_that_are_no_numbers_are_an_error_and_leave_the_state() {
    for model in MODELS {
        for bad in [f64::NAN, f64::INFINITY] {
            let mut simulation = simulation(model);
            simulation.advance(0.5).unwrap();
            let before = simulation.states().to_vec();
            let mut inputs = Inputs { winch_force: [1e3; 4].into(), disturbance: [0.0; 3] };
            inputs.winch_force[2] = bad;
            simulation.set_inputs(inputs);
            let error = simulation.advance(0.1).unwrap_err();
            assert_eq!(error.time(), 0.5, "{model:?}: {error}");
            assert!(error.to_string().contains("t = 0.5 s"), "{error}");
            assert_eq!(simulation.states(), before);
            // It can go on with other inputs.
            simulation.set_inputs(Inputs { winch_force: [1e3; 4].into(), disturbance: [0.0; 3] });
            simulation.advance(0.1).unwrap();
            assert!(simulation.states().iter().all(|v| v.is_finite()));
        }
    }
}

/// One winch pulls the platform to its anchor: an error or a finite motion, in a bounded number of steps.
#[test]
fn a_platform_pulled_to_an_anchor_ends_in_an_answer() {
    for model in MODELS {
        for inertia in [CableInertia::Paper, CableInertia::Reeled, CableInertia::None] {
            let start = Start { pose: [-500.0, -500.0, 0.0], ..Start::default() };
            let mut simulation = Simulation::new(plant(model, inertia, &[]), &start, 1e-8).unwrap();
            simulation.set_inputs(Inputs { winch_force: [5e4, 0.0, 0.0, 0.0].into(), disturbance: [0.0; 3] });
            let mut failed = None;
            for _ in 0..3000 {
                if let Err(error) = simulation.advance(0.01) {
                    failed = Some(error);
                    break;
                }
            }
            assert!(simulation.states().iter().all(|v| v.is_finite()), "{model:?} {inertia:?}");
            assert!(simulation.time().is_finite());
            let steps = simulation.statistics();
            assert!(steps.steps + steps.rejections + steps.newton_failures < 300_000, "{model:?}: {steps:?}");
            if let Some(error) = failed {
                assert_eq!(error.time(), simulation.time(), "{error}");
                assert!(error.to_string().contains("state ["), "{error}");
            }
        }
    }
}

#[test]
fn a_cable_wound_in_to_its_end_is_an_error() {
    let plant = plant(CableModel::LumpedMass, CableInertia::Paper, &[]);
    let mut simulation = Simulation::new(plant.clone(), &Start::default(), 1e-8).unwrap();
    let mut y = simulation.states().to_vec();
    y[plant.unstretched_index(0).unwrap()] = -1.0;
    simulation.set_states(&y);
    let error = simulation.advance(0.01).unwrap_err();
    assert!(matches!(error, IntegrationError::OutOfBounds { .. }), "{error}");
    assert!(error.to_string().contains("unstretched length is not positive"), "{error}");
    assert!(simulation.states().iter().all(|v| v.is_finite()), "{error}");
}

#[test]
fn starts_that_cannot_be_are_refused() {
    let lumped = plant(CableModel::LumpedMass, CableInertia::Paper, &[]);
    let outside = Start { pose: [1000.0, 0.0, 0.0], ..Start::default() };
    assert!(Simulation::new(lumped.clone(), &outside, 1e-8).is_err());
    let no_length = Start { initialization: Initialization::FromStates, ..Start::default() };
    let error = Simulation::new(lumped.clone(), &no_length, 1e-8).unwrap_err();
    assert!(error.to_string().contains("unstretched_length[1]"), "{error}");
    let pushed = Start {
        initialization: Initialization::StaticEquilibrium,
        inputs: Inputs { winch_force: [1e3; 4].into(), disturbance: [1e6, 0.0, 0.0] },
        ..Start::default()
    };
    let error = Simulation::new(lumped, &pushed, 1e-8).unwrap_err();
    assert!(matches!(error, StartError::NoEquilibrium { .. }), "{error}");
    let sag = EffectSpec::new("cable_sag", None, &[20.0, 1e5]).unwrap();
    let sagging = plant(CableModel::LumpedMass, CableInertia::Paper, &[sag]);
    let weak = Start { inputs: Inputs { winch_force: [1.0; 4].into(), disturbance: [0.0; 3] }, ..Start::default() };
    let error = Simulation::new(sagging, &weak, 1e-8).unwrap_err();
    assert!(matches!(error, StartError::NoLength { cable: 1, .. }), "{error}");
}

#[test]
fn an_equilibrium_stays() {
    for model in MODELS {
        let start = Start {
            initialization: Initialization::StaticEquilibrium,
            pose: [0.0; 3],
            inputs: Inputs { winch_force: [1e4, 1.01e4, 1e4, 1.01e4].into(), disturbance: [3.0, -2.0, 10.0] },
            ..Start::default()
        };
        let mut simulation = Simulation::new(plant(model, CableInertia::Paper, &[]), &start, 1e-10).unwrap();
        let before = simulation.states().to_vec();
        assert!(before[0].abs() > 1e-3, "the search must move");
        simulation.advance(1.0).unwrap();
        for (a, b) in simulation.states().iter().zip(&before) {
            assert!((a - b).abs() < 1e-6, "{model:?}: {a} {b}");
        }
    }
}
