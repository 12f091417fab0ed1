//! A step allocates nothing on the heap, counted by the allocator itself.
#![allow(unsafe_code)] // an allocator can be counted only by being one

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::sync::Arc;

use cdpr::dynamics::Inputs;
use cdpr::effect::EffectSpec;
use cdpr::fmi2::CablePlatform;
use cdpr::integrator::Solver;
use cdpr::model_file::Model;
use cdpr::parameters::{CableModel, Parameters};
use cdpr::plant::Plant;
use cdpr::simulation::{Simulation, Start};
use cdpr::winch::{WinchCommand, WinchParameters};
use fmi2_export::{Experiment, Model as _};

struct Counting;

thread_local! {
    static ALLOCATIONS: Cell<usize> = const { Cell::new(0) };
    /// Bytes held.
    static HELD: Cell<isize> = const { Cell::new(0) };
}

/// An object in memory is no larger than half of it.
fn bytes(layout: Layout) -> isize {
    layout.size().cast_signed()
}

// SAFETY: every call goes to the system's allocator unchanged; counting touches only thread-local numbers without
// a destructor.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.set(ALLOCATIONS.get() + 1);
        HELD.set(HELD.get() + bytes(layout));
        // SAFETY: the caller keeps the contract of `alloc`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        HELD.set(HELD.get() - bytes(layout));
        // SAFETY: the caller keeps the contract of `dealloc`; `pointer` came from `System`.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn effects() -> Vec<EffectSpec> {
    let effect = |id: &str, values: &[f64]| EffectSpec::new(id, None, values).unwrap();
    vec![
        effect("winch_lag", &[0.05]),
        effect("winch_delay", &[0.03]),
        effect("winch_coulomb_friction", &[250.0, 0.05]),
        effect("cable_creep", &[1e8, 10.0]),
        effect("cable_sag", &[2.0, 2e4]),
        effect("platform_quadratic_drag", &[20.0, 0.0, 0.0]),
        EffectSpec::expression("platform.force_x", "-3*vx + sin(time)").unwrap(),
    ]
}

#[test]
fn counting_counts() {
    let before = ALLOCATIONS.get();
    std::hint::black_box(Vec::<u8>::with_capacity(10));
    assert_eq!(ALLOCATIONS.get() - before, 1);
}

#[test]
fn a_step_does_not_allocate() {
    for model in [CableModel::Rigid, CableModel::MasslessSpring, CableModel::LumpedMass] {
        for (effects, solver) in [
            (vec![], Solver::Radau),
            (vec![], Solver::DormandPrince),
            (effects(), Solver::Radau),
            (effects(), Solver::Auto),
        ] {
            let parameters = Parameters { cable_model: model, ..Parameters::default() };
            let plant = Arc::new(Plant::new(parameters, effects).unwrap());
            let inputs = |k: u32| {
                // Cable 1 goes slack on the way.
                let first = if (40..50).contains(&k) { -500.0 } else { 2e4 + f64::from(k) };
                Inputs { winch_force: [first, 2e4, 2e4, 2e4].into(), disturbance: [10.0, 0.0, 0.0] }
            };
            let start = Start { pose: [1.0, 2.0, 0.05], inputs: inputs(0), ..Start::default() };
            let mut simulation = Simulation::new(plant, &start, 1e-8).unwrap().with_solver(solver);
            let before = ALLOCATIONS.get();
            for k in 0..200 {
                simulation.set_inputs(inputs(k));
                simulation.advance(0.01).unwrap();
                std::hint::black_box(simulation.outputs());
            }
            assert_eq!(
                ALLOCATIONS.get() - before,
                0,
                "{model:?}, {solver:?}, {} effects",
                simulation.plant().effects().len()
            );
        }
    }
}

/// Nor does one with winches that are told torques, speeds or lengths.
#[test]
fn a_step_of_driven_winches_does_not_allocate() {
    for command in [WinchCommand::Torque, WinchCommand::Speed, WinchCommand::Length] {
        let winch = WinchParameters { command, rotor_inertia: Some(2.0), ..WinchParameters::default() };
        let parameters = Parameters { winch, ..Parameters::default() };
        let plant = Arc::new(Plant::new(parameters, Vec::new()).unwrap());
        let lengths = [899.0; 4];
        let told = |k: u32| match command {
            WinchCommand::Torque => 1e4 + f64::from(k),
            WinchCommand::Length => lengths[0] - 1e-3 * f64::from(k),
            _ => 0.1 * f64::from(k).sin(),
        };
        let mut y = vec![0.0; plant.dimension()];
        for (i, length) in lengths.into_iter().enumerate() {
            y[plant.unstretched_index(i).unwrap()] = length;
        }
        let mut simulation = Simulation::from_states(plant, 0.0, y, Inputs::pulling(4, told(0)), 1e-8);
        let before = ALLOCATIONS.get();
        for k in 0..200 {
            simulation.set_inputs(Inputs::pulling(4, told(k)));
            simulation.advance(0.01).unwrap();
            std::hint::black_box(simulation.outputs());
        }
        assert_eq!(ALLOCATIONS.get() - before, 0, "{command:?}");
    }
}

/// Going back to a saved state over and over, as an iteration over one communication step does.
#[test]
fn going_back_to_a_saved_state_does_not_allocate() {
    for solver in [Solver::Radau, Solver::Auto] {
        let mut model = Model { effects: effects(), solver, ..Model::default() };
        model.start.inputs = Inputs::pulling(4, 2e4);
        let mut platform = CablePlatform::new(model).unwrap();
        let experiment = Experiment { start_time: 0.0, stop_time: None, tolerance: None };
        platform.enter_initialisation(experiment).unwrap();
        platform.initialise(experiment).unwrap();
        platform.step(0.0, 0.1).unwrap();
        let mut saved = Vec::new();
        platform.save(&mut saved);
        platform.restore(&saved).unwrap();
        let before = ALLOCATIONS.get();
        for _ in 0..10 {
            platform.step(0.1, 0.1).unwrap();
            platform.restore(&saved).unwrap();
        }
        assert_eq!(ALLOCATIONS.get() - before, 0, "{solver:?}");
    }
}

/// What a thousand instances step through in turn is to stay in the processor's caches: the work of a call is on the stack, and
/// factors are as large as the robot.
#[test]
fn an_instance_keeps_no_more_than_it_must() {
    let start = Start { inputs: Inputs::pulling(4, 2e4), ..Start::default() };
    let plant = Arc::new(Plant::new(Parameters::default(), Vec::new()).unwrap());
    let before = HELD.get();
    let mut simulation = Box::new(Simulation::new(plant, &start, 1e-8).unwrap());
    simulation.advance(0.01).unwrap();
    let held = HELD.get() - before;
    assert!(held < 7_700, "{held} bytes");
}
