//! What the host's logger gets, and when.

use std::ffi::{CStr, CString, c_char, c_void};
use std::ptr;
use std::sync::atomic::{AtomicPtr, AtomicU32, Ordering};

use crate::harness::*;

fn switch(fmu: &Fmu, on: bool, categories: &[&CStr]) -> i32 {
    let pointers: Vec<_> = categories.iter().map(|c| c.as_ptr()).collect();
    // SAFETY: as many strings as said.
    unsafe { fmi2SetDebugLogging(fmu.c, i32::from(on), pointers.len(), pointers.as_ptr()) }
}

/// A word, a warning, a discard, an error: the categories that come through.
fn provoke(fmu: &Fmu) -> Vec<(String, i32)> {
    let point = fmu.get(vr::TIME);
    for (fault, status) in [(fault::TELL, OK), (fault::WARN, OK), (fault::HALF, DISCARD)] {
        assert_eq!(fmu.set_integer(vr::FAULT, fault), OK);
        assert_eq!(fmu.step(fmu.get(vr::TIME), 0.5), status);
    }
    assert_eq!(fmu.step(point, -1.0), ERROR);
    fmu.log().into_iter().map(|m| (m.category, m.status)).collect()
}

/// What no switch keeps back, as `provoke` brings it about.
fn not_well() -> Vec<(String, i32)> {
    [("logModel", WARNING), ("logStatusDiscard", DISCARD), ("logStatusError", ERROR)].map(|(c, s)| (c.into(), s)).into()
}

#[test]
fn categories_decide_what_is_logged_of_what_is_well() {
    let fmu = Fmu::stepping();
    let everything = [vec![("logModel".to_owned(), OK)], not_well()].concat();
    assert_eq!(provoke(&fmu), everything);
    assert_eq!(switch(&fmu, false, &[]), OK);
    assert_eq!(provoke(&fmu), not_well(), "warnings, discards and errors always come through");
    assert_eq!(switch(&fmu, true, &[c"logStatusDiscard"]), OK);
    assert_eq!(provoke(&fmu), not_well());
    for category in [c"logModel", c"logAll"] {
        assert_eq!(switch(&fmu, true, &[category]), OK);
        assert_eq!(provoke(&fmu), everything);
    }
    assert_eq!(switch(&fmu, true, &[c"logNothing"]), ERROR);
    assert!(fmu.message().contains("log category `logNothing` is not one of"));
}

/// A host that did not ask for debug logging could not find out why its run ended.
#[test]
fn a_discard_without_logging_on_tells_its_reason() {
    let fmu = Fmu::with_logging(false);
    assert_eq!(fmu.setup(0.0, None), OK);
    assert_eq!(fmu.enter(), OK);
    assert_eq!(fmu.exit(), OK);
    assert_eq!(fmu.set_integer(vr::FAULT, fault::HALF), OK);
    assert_eq!(fmu.step(0.0, 0.5), DISCARD);
    assert!(fmu.message().contains("asked to stop half way"));
    assert_eq!(fmu.step(0.25, -1.0), ERROR);
    assert!(fmu.message().contains("not positive"));
    assert_eq!(fmu.set_integer(vr::FAULT, fault::TELL), OK);
    assert_eq!(fmu.step(0.25, 0.5), OK);
    assert_eq!(fmu.log(), [], "what is well needs logging on");
}

/// The harness passes each message through `printf`, as a logger in C does.
#[test]
fn percent_signs_survive_the_format() {
    let fmu = Fmu::stepping();
    assert_eq!(fmu.set_integer(vr::FAULT, fault::HALF), OK);
    assert_eq!(fmu.step(0.0, 0.5), DISCARD);
    let log = fmu.log();
    assert!(log[0].text.contains("at 50% of the step"), "{}", log[0].text);
    assert_eq!(log[0].instance, "an instance");

    let nasty = CString::new("%s%n%d 100% %%").unwrap();
    assert_eq!(switch(&fmu, true, &[&nasty]), ERROR);
    assert!(fmu.message().contains("`%s%n%d 100% %%`"));
}

#[test]
fn messages_name_the_function_and_the_state() {
    let fmu = Fmu::new();
    assert_eq!(fmu.step(0.0, 0.1), ERROR);
    assert_eq!(fmu.message(), "fmi2DoStep: not allowed in state `instantiated`");
}

/// The handle that `call_back` uses; each test process has one test that sets it.
static ASKED: AtomicPtr<c_void> = AtomicPtr::new(ptr::null_mut());
static CALLS: AtomicU32 = AtomicU32::new(0);

/// A logger that asks the instance for a value.
unsafe extern "C" fn call_back(_: Handle, _: *const c_char, _: i32, _: *const c_char, _: *const c_char) {
    let mut x = 0.0;
    let c = ASKED.load(Ordering::SeqCst);
    // SAFETY: any handle is allowed; one value.
    if unsafe { fmi2GetReal(c, &vr::X, 1, &raw mut x) } == OK {
        CALLS.fetch_add(1, Ordering::SeqCst);
    }
}

#[test]
fn a_logger_may_call_back() {
    let mut functions = callbacks(None);
    functions.logger = Some(as_logger(call_back));
    // SAFETY: sound pointers, no resources.
    unsafe {
        let c = fmi2Instantiate(c"a".as_ptr(), 1, guid().as_ptr(), ptr::null(), &raw const functions, 0, 1);
        ASKED.store(c, Ordering::SeqCst);
        assert_eq!(OK, fmi2SetupExperiment(c, 0, 0.0, 0.0, 0, 0.0));
        assert_eq!(OK, fmi2EnterInitializationMode(c));
        assert_eq!(ERROR, fmi2DoStep(c, 0.0, 1.0, 0));
        assert_eq!(CALLS.load(Ordering::SeqCst), 1);
        fmi2FreeInstance(c);
    }
}
