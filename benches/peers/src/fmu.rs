//! The FMU through its C functions.

use std::f64::consts::TAU;
use std::ffi::{CString, c_char, c_int, c_void};
use std::fmt::Write as _;
use std::ptr;
use std::sync::LazyLock;

use cdpr::dynamics::Inputs;
use cdpr::fmi2::CablePlatform;
use cdpr::integrator::Solver;
use cdpr::parameters::Parameters;
use cdpr::plant::Plant;
use cdpr::simulation::{DEFAULT_TOLERANCE, Simulation, Start};
use fmi2_export::Model as _;
use fmi2_export::abi::CallbackFunctions;

use crate::race::{quartiles, thread_time};

fmi2_export::export!(CablePlatform);

type Handle = *mut c_void;

unsafe extern "C" {
    fn fmi2Instantiate(
        name: *const c_char,
        kind: c_int,
        guid: *const c_char,
        location: *const c_char,
        functions: *const CallbackFunctions,
        visible: c_int,
        logging_on: c_int,
    ) -> Handle;
    fn fmi2SetupExperiment(
        c: Handle,
        has_tolerance: c_int,
        tolerance: f64,
        start: f64,
        has_stop: c_int,
        stop: f64,
    ) -> c_int;
    fn fmi2EnterInitializationMode(c: Handle) -> c_int;
    fn fmi2ExitInitializationMode(c: Handle) -> c_int;
    fn fmi2SetReal(c: Handle, references: *const u32, count: usize, values: *const f64) -> c_int;
    fn fmi2GetReal(c: Handle, references: *const u32, count: usize, values: *mut f64) -> c_int;
    fn fmi2DoStep(c: Handle, time: f64, step: f64, no_set_state_before: c_int) -> c_int;
    fn fmi2FreeInstance(c: Handle);
}

/// Communication step (s).
pub(crate) const STEP: f64 = 0.01;
const STEPS_OF_SWING: usize = 6283;
const INPUTS: [u32; 7] = [1, 2, 3, 4, 5, 6, 7];
/// Pose, twist, lengths, unstretched lengths and their rates, tensions, three strains: what there is of Real outputs, the first 25.
const OUTPUTS: [u32; 25] =
    [10, 11, 12, 13, 14, 15, 20, 21, 22, 23, 24, 25, 26, 27, 28, 29, 30, 31, 32, 33, 34, 35, 36, 37, 38];

/// An instance that steps.
pub(crate) struct Instance {
    handle: Handle,
    steps: usize,
}

/// Commands of step `k`: other ones at every step, about one swing in a minute. They are made before anything is timed.
fn commands(k: usize) -> &'static [f64; 7] {
    static SWING: LazyLock<Vec<[f64; 7]>> = LazyLock::new(|| {
        let at = |k: usize| 30.0 * (TAU * k as f64 / STEPS_OF_SWING as f64).sin();
        let commands = |swing: f64| [2e4 + swing, 2e4 - swing, 2e4 + 0.5 * swing, 2e4, 0.0, 0.0, 0.0];
        (0..STEPS_OF_SWING).map(|k| commands(at(k))).collect()
    });
    &SWING[k % STEPS_OF_SWING]
}

/// The GUID of the default model.
pub(crate) fn guid() -> CString {
    let model = CablePlatform::instantiate(None).expect("the default model");
    CString::new(model.description().guid()).expect("text")
}

impl Instance {
    pub(crate) fn new(guid: &CString) -> Self {
        let functions = CallbackFunctions {
            logger: None,
            allocate_memory: None,
            free_memory: None,
            step_finished: None,
            component_environment: ptr::null_mut(),
        };
        // SAFETY: strings and functions outlive the call, which keeps none of them.
        let handle =
            unsafe { fmi2Instantiate(c"bench".as_ptr(), 1, guid.as_ptr(), ptr::null(), &raw const functions, 0, 0) };
        assert!(!handle.is_null(), "the FMU can be instantiated");
        let mut instance = Self { handle, steps: 0 };
        // SAFETY: a live instance.
        unsafe {
            assert_eq!(fmi2SetupExperiment(handle, 0, 0.0, 0.0, 0, 0.0), 0);
            assert_eq!(fmi2EnterInitializationMode(handle), 0);
            instance.set();
            assert_eq!(fmi2ExitInitializationMode(handle), 0);
        }
        instance
    }

    fn set(&mut self) {
        let values = commands(self.steps);
        // SAFETY: a live instance, as many values as references.
        assert_eq!(unsafe { fmi2SetReal(self.handle, INPUTS.as_ptr(), INPUTS.len(), values.as_ptr()) }, 0);
    }

    pub(crate) fn set_and_step(&mut self) {
        self.set();
        // SAFETY: a live instance.
        assert_eq!(unsafe { fmi2DoStep(self.handle, STEP * self.steps as f64, STEP, 1) }, 0);
        self.steps += 1;
    }

    fn get(&mut self) -> [f64; OUTPUTS.len()] {
        let mut values = [0.0; OUTPUTS.len()];
        // SAFETY: a live instance, as much room as references.
        assert_eq!(unsafe { fmi2GetReal(self.handle, OUTPUTS.as_ptr(), OUTPUTS.len(), values.as_mut_ptr()) }, 0);
        values
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        // SAFETY: a live instance, freed once.
        unsafe { fmi2FreeInstance(self.handle) };
    }
}

/// The plant of the FMU without it, from the same start.
fn bare() -> Simulation {
    let plant = Plant::new(Parameters::default(), Vec::new()).expect("the default plant").into();
    let [a, b, c, d, ..] = *commands(0);
    let inputs = Inputs { winch_force: [a, b, c, d].into(), disturbance: [0.0; 3] };
    Simulation::new(plant, &Start { inputs, ..Start::default() }, DEFAULT_TOLERANCE)
        .expect("a start")
        .with_solver(Solver::Radau)
}

/// What calls cost, in turns of 1000 steps.
pub(crate) fn report(rounds: usize) -> String {
    const STEPS: usize = 1000;
    let guid = guid();
    let mut times: [Vec<f64>; 4] = Default::default();
    let [mut stepped, mut read, mut set] = [(); 3].map(|()| Instance::new(&guid));
    let mut simulation = bare();
    let mut inputs = simulation.inputs();
    let mut checksum = 0.0;
    for round in 0..rounds {
        let mut time = |place: usize, work: &mut dyn FnMut(usize)| {
            let begun = thread_time();
            (0..STEPS).for_each(|k| work(round * STEPS + k));
            times[place].push((thread_time() - begun) / STEPS as f64);
        };
        time(0, &mut |k| {
            inputs.winch_force.copy_from_slice(&commands(k)[..4]);
            simulation.set_inputs(inputs);
            simulation.advance(STEP).expect("it can be simulated");
        });
        time(1, &mut |_| stepped.set_and_step());
        time(2, &mut |_| {
            read.set_and_step();
            checksum += read.get()[0];
        });
        time(3, &mut |_| {
            set.set();
            set.steps += 1;
        });
    }
    assert!(f64::is_finite(checksum));
    let [bare, stepped, read, set] = times.map(quartiles);
    let mut text =
        String::from("### The FMU through its C functions\n\n| call | ns | quartiles |\n| --- | --- | --- |\n");
    for (name, [low, median, high]) in [
        ("the plant alone: inputs and step", bare),
        ("set 7", set),
        ("set 7, step", stepped),
        ("set 7, step, get 25", read),
    ] {
        let _ = writeln!(text, "| {name} | {:.0} | {:.0} to {:.0} |", 1e9 * median, 1e9 * low, 1e9 * high);
    }
    let _ = writeln!(
        text,
        "\nAll three over the step through C alone: {:.2}; over the plant alone: {:.2}.\n",
        read[1] / (stepped[1] - set[1]),
        read[1] / bare[1]
    );
    text
}
