//! A step allocates nothing on the heap, counted by the allocator itself.
#![allow(unsafe_code)] // an allocator can be counted only by being one

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::sync::Arc;

use cdpr::dynamics::Inputs;
use cdpr::effect::EffectSpec;
use cdpr::parameters::{CableModel, Parameters};
use cdpr::plant::Plant;
use cdpr::simulation::{Simulation, Start};

struct Counting;

thread_local! {
    static ALLOCATIONS: Cell<usize> = const { Cell::new(0) };
}

// SAFETY: every call goes to the system's allocator unchanged; counting touches only a thread-local number without a
// destructor.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.set(ALLOCATIONS.get() + 1);
        // SAFETY: the caller keeps the contract of `alloc`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
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
        for effects in [vec![], effects()] {
            let parameters = Parameters { cable_model: model, ..Parameters::default() };
            let plant = Arc::new(Plant::new(parameters, effects).unwrap());
            let inputs = |k: u32| {
                // Cable 1 goes slack on the way.
                let first = if (40..50).contains(&k) { -500.0 } else { 2e4 + f64::from(k) };
                Inputs { winch_force: [first, 2e4, 2e4, 2e4].into(), disturbance: [10.0, 0.0, 0.0] }
            };
            let start = Start { pose: [1.0, 2.0, 0.05], inputs: inputs(0), ..Start::default() };
            let mut simulation = Simulation::new(plant, &start, 1e-8).unwrap();
            let before = ALLOCATIONS.get();
            for k in 0..200 {
                simulation.set_inputs(inputs(k));
                simulation.advance(0.01).unwrap();
                std::hint::black_box(simulation.outputs());
            }
            assert_eq!(ALLOCATIONS.get() - before, 0, "{model:?}, {} effects", simulation.plant().effects().len());
        }
    }
}
