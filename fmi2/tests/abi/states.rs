//! Every function in every state, against the table of FMI 2.0.3, section 4.2.4, written out again here.

use std::ffi::c_int;
use std::ptr;

use crate::harness::*;

#[derive(Debug, Clone, Copy, PartialEq)]
enum State {
    Instantiated,
    Initialisation,
    StepComplete,
    StepFailed,
    Terminated,
    Error,
}

use State::{Error, Initialisation, Instantiated, StepComplete, StepFailed, Terminated};

const STATES: [State; 6] = [Instantiated, Initialisation, StepComplete, StepFailed, Terminated, Error];

fn instance_in(state: State) -> Fmu {
    let fmu = match state {
        Instantiated => Fmu::new(),
        Initialisation => Fmu::initialising(),
        _ => Fmu::stepping(),
    };
    match state {
        StepFailed => {
            assert_eq!(fmu.set_integer(vr::FAULT, fault::HALF), OK);
            assert_eq!(fmu.step(0.0, 0.5), DISCARD);
            assert_eq!(fmu.set_integer(vr::FAULT, fault::NONE), OK);
        }
        // SAFETY: any handle is allowed.
        Terminated => assert_eq!(OK, unsafe { fmi2Terminate(fmu.c) }),
        Error => {
            assert_eq!(fmu.set_integer(vr::FAULT, fault::PANIC), OK);
            assert_eq!(fmu.step(0.0, 0.5), ERROR);
        }
        _ => {}
    }
    fmu.log();
    fmu
}

/// A call with sound arguments.
type Call = fn(&Fmu) -> c_int;

const ANY: &[State] = &STATES;
const READING: &[State] = &[Initialisation, StepComplete, StepFailed, Terminated, Error];
// The standard stops at StepComplete; going on after a failed step is this layer's addition.
const WRITING: &[State] = &[Instantiated, Initialisation, StepComplete, StepFailed];
const STEPPING: &[State] = &[StepComplete, StepFailed];
const STATUS: &[State] = &[StepComplete, StepFailed, Terminated];

// SAFETY of all calls here: sound arguments, or handles, of which any is allowed.
const TABLE: &[(&str, Call, &[State])] = &[
    ("SetDebugLogging", |f| unsafe { fmi2SetDebugLogging(f.c, 1, 0, ptr::null()) }, ANY),
    ("SetupExperiment", |f| f.setup(0.0, None), &[Instantiated]),
    (
        "EnterInitializationMode",
        |f| {
            f.setup(0.0, None);
            f.enter()
        },
        &[Instantiated],
    ),
    ("ExitInitializationMode", Fmu::exit, &[Initialisation]),
    ("Terminate", |f| unsafe { fmi2Terminate(f.c) }, STEPPING),
    ("Reset", Fmu::reset, ANY),
    ("GetReal", |f| f.try_get(vr::X).map_or_else(|s| s, |_| OK), READING),
    ("GetInteger", |f| unsafe { fmi2GetInteger(f.c, &vr::STEPS, 1, &mut 0) }, READING),
    ("GetBoolean", |f| unsafe { fmi2GetBoolean(f.c, &vr::INSIDE, 1, &mut 0) }, READING),
    ("GetString", |f| unsafe { fmi2GetString(f.c, &vr::LABEL, 1, &mut ptr::null()) }, READING),
    ("SetReal", |f| f.set(vr::U, 1.0), WRITING),
    ("SetInteger", |f| f.set_integer(vr::FAULT, fault::NONE), WRITING),
    ("SetBoolean", |f| f.set_boolean(vr::HOLD, 1), WRITING),
    ("SetString", |f| f.set_string(vr::LABEL, c"a"), &[Instantiated, Initialisation]),
    ("GetFMUstate", |f| unsafe { fmi2GetFMUstate(f.c, &mut ptr::null_mut()) }, ANY),
    ("SetFMUstate", |f| f.restore(f.save()), ANY),
    ("FreeFMUstate", |f| f.free_state(&mut f.save()), ANY),
    ("SerializedFMUstateSize", |f| unsafe { fmi2SerializedFMUstateSize(f.c, f.save(), &mut 0) }, ANY),
    ("SerializeFMUstate", |f| c_int::from(f.serialise(f.save()).is_empty()), ANY),
    ("DeSerializeFMUstate", |f| f.deserialise(&f.serialise(f.save())).map_or_else(|s| s, |_| OK), ANY),
    (
        "GetDirectionalDerivative",
        |f| unsafe { fmi2GetDirectionalDerivative(f.c, &vr::DER_V, 1, &vr::X, 1, &1.0, &mut 0.0) },
        READING,
    ),
    ("SetRealInputDerivatives", |f| unsafe { fmi2SetRealInputDerivatives(f.c, &vr::U, 1, &1, &1.0) }, WRITING),
    (
        "GetRealOutputDerivatives",
        |f| unsafe { fmi2GetRealOutputDerivatives(f.c, &vr::X, 1, &1, &mut 0.0) },
        &[StepComplete, StepFailed, Terminated, Error],
    ),
    ("DoStep", |f| f.step(f.try_get(vr::TIME).unwrap_or(0.0), 0.25), STEPPING),
    ("CancelStep", |f| unsafe { fmi2CancelStep(f.c) }, &[]),
    ("GetStatus", |f| unsafe { fmi2GetStatus(f.c, 0, &mut 0) }, STATUS),
    ("GetRealStatus", |f| unsafe { fmi2GetRealStatus(f.c, 2, &mut 0.0) }, STATUS),
    ("GetIntegerStatus", |f| unsafe { fmi2GetIntegerStatus(f.c, 0, &mut 0) }, STATUS),
    ("GetBooleanStatus", |f| unsafe { fmi2GetBooleanStatus(f.c, 3, &mut 0) }, STATUS),
    ("GetStringStatus", |f| unsafe { fmi2GetStringStatus(f.c, 1, &mut ptr::null()) }, STATUS),
];

#[test]
fn every_function_in_every_state() {
    for (name, call, legal) in TABLE {
        for state in STATES {
            let fmu = instance_in(state);
            let status = call(&fmu);
            let expected = legal.contains(&state);
            let log = fmu.log();
            assert_eq!(status != ERROR, expected, "{name} in {state:?}: {log:?}");
            assert_eq!(log.iter().any(|m| m.status == ERROR), !expected, "{name} in {state:?}");
        }
    }
}

#[test]
fn a_refused_call_leaves_the_state_as_it_was() {
    // In each state, a call that is legal in no other tells that the state is still the same.
    let witnesses: [(State, Call); 3] = [
        (Instantiated, |f| f.setup(0.0, None)),
        (Initialisation, Fmu::exit),
        (StepComplete, |f| f.step(f.get(vr::TIME), 0.25)),
    ];
    for (state, witness) in witnesses {
        for (name, call, legal) in TABLE.iter().filter(|(_, _, legal)| !legal.contains(&state)) {
            let fmu = instance_in(state);
            assert_eq!(call(&fmu), ERROR, "{name} {legal:?}");
            assert_eq!(witness(&fmu), OK, "{state:?} after {name}");
        }
    }
}

#[test]
fn the_table_is_complete() {
    let in_table = TABLE.iter().map(|(name, _, _)| format!("fmi2{name}"));
    let others = ["GetTypesPlatform", "GetVersion", "Instantiate", "FreeInstance"];
    let mut all: Vec<String> = in_table.chain(others.map(|n| format!("fmi2{n}"))).collect();
    let mut exported: Vec<String> = fmi2_export::exported_functions().map(String::from).collect();
    all.sort();
    exported.sort();
    assert_eq!(all, exported);
    assert_eq!(exported.len(), 34);
}
