//! What a host can get wrong: each returns `fmi2Error`, and the host lives.

use std::ffi::{CStr, c_char, c_int, c_void};
use std::ptr;

use crate::harness::*;

fn instantiate(name: *const c_char, kind: c_int, guid: *const c_char, with_functions: bool) -> (Handle, Vec<Logged>) {
    let log = new_log();
    let functions = callbacks(Some(log));
    let functions = if with_functions { &raw const functions } else { ptr::null() };
    // SAFETY: null or sound pointers.
    let c = unsafe { fmi2Instantiate(name, kind, guid, ptr::null(), functions, 0, 0) };
    (c, std::mem::take(&mut *log.lock().unwrap()))
}

#[test]
fn instances_that_cannot_be() {
    let guid = guid();
    let guid = guid.as_ptr();
    let name = c"a name with spaces".as_ptr();
    let null = ptr::null();
    let wrong = c"{wrong}".as_ptr();
    for (name, kind, guid, expected) in [
        (null, 1, guid, "instanceName is null"),
        (c"".as_ptr(), 1, guid, "instanceName is empty"),
        (name, 0, guid, "co-simulation"),
        (name, 7, guid, "co-simulation"),
        (name, 1, null, "fmuGUID is null"),
        (name, 1, wrong, "GUID {wrong}"),
        (name, 1, c"\xff".as_ptr(), "fmuGUID is not UTF-8"),
    ] {
        let (c, log) = instantiate(name, kind, guid, true);
        assert!(c.is_null(), "{expected}");
        assert_eq!(log.len(), 1, "{expected}");
        assert!(log[0].text.contains(expected), "{} for {expected}", log[0].text);
        assert_eq!((log[0].status, log[0].category.as_str()), (ERROR, "logStatusError"));
    }
    assert!(instantiate(name, 1, guid, false).0.is_null(), "no callbacks");
    let (c, log) = instantiate(name, 1, guid, true);
    assert!(!c.is_null());
    assert_eq!(log, []);
    // SAFETY: any handle is allowed.
    unsafe { fmi2FreeInstance(c) };
}

#[test]
fn handles_that_are_none() {
    let freed = {
        let fmu = Fmu::stepping();
        fmu.c
    };
    let mut foreign = 5_u64;
    let made_up: *mut c_void = ptr::without_provenance_mut(0xdead_beef);
    for c in [ptr::null_mut(), freed, ptr::from_mut(&mut foreign).cast(), made_up] {
        let mut value = 0.0;
        let mut state = ptr::null_mut();
        // SAFETY: any handle is allowed.
        unsafe {
            assert_eq!(ERROR, fmi2DoStep(c, 0.0, 0.1, 0));
            assert_eq!(ERROR, fmi2GetReal(c, &vr::X, 1, &raw mut value));
            assert_eq!(ERROR, fmi2SetReal(c, &vr::U, 1, &raw const value));
            assert_eq!(ERROR, fmi2GetFMUstate(c, &raw mut state));
            assert_eq!(ERROR, fmi2Reset(c));
            assert_eq!(ERROR, fmi2Terminate(c));
            assert_eq!(ERROR, fmi2SetDebugLogging(c, 1, 0, ptr::null()));
            fmi2FreeInstance(c);
            fmi2FreeInstance(c);
        }
    }
    assert_eq!(foreign, 5);
}

#[test]
fn a_handle_is_of_one_instance_and_never_of_another() {
    let mut freed = Vec::new();
    for _ in 0..50 {
        let [first, second] = [Fmu::stepping(), Fmu::stepping()];
        let mut state = ptr::null_mut();
        // SAFETY: any handle is allowed; a place for a state.
        assert_eq!(OK, unsafe { fmi2GetFMUstate(first.c, &raw mut state) });
        for c in [first.c, second.c, state] {
            assert!(!freed.contains(&c), "{c:?} was handed out before");
        }
        for &c in freed.iter().chain([&state]) {
            // SAFETY: any handle is allowed.
            unsafe {
                assert_eq!(ERROR, fmi2DoStep(c, 0.0, 0.1, 0));
                fmi2FreeInstance(c);
            }
        }
        assert_eq!([OK, OK], [first.step(0.0, 0.1), second.step(0.0, 0.1)], "others' handles do nothing to these");
        freed.extend([first.c, second.c, state]);
    }
}

#[test]
fn references_that_are_none() {
    let fmu = Fmu::stepping();
    let mut value = 0.0;
    for reference in [11, 99, u32::MAX] {
        // SAFETY: one value each.
        unsafe {
            let status = fmi2GetReal(fmu.c, &raw const reference, 1, &raw mut value);
            assert_eq!(status, ERROR);
            assert!(fmu.message().contains(&format!("value reference {reference}")));
            let status = fmi2SetReal(fmu.c, &raw const reference, 1, &raw const value);
            assert_eq!(status, ERROR);
            let mut integer = 0;
            let status = fmi2GetInteger(fmu.c, &raw const reference, 1, &raw mut integer);
            assert_eq!(status, ERROR);
            fmu.log();
        }
    }
    assert_eq!(fmu.step(0.0, 0.1), OK, "a mistake in a call is not the end");
}

#[test]
fn arrays_that_are_none() {
    let fmu = Fmu::stepping();
    let reference = vr::X;
    let mut value = 0.0;
    let mut room = [0_u64; 4];
    // SAFETY: a place inside the room, off the alignment of a double.
    let crooked = unsafe { room.as_mut_ptr().cast::<u8>().add(1) };
    let null_vr: *const u32 = ptr::null();
    // SAFETY: null, crooked and over-long arrays are refused before they are followed.
    unsafe {
        assert_eq!(OK, fmi2GetReal(fmu.c, null_vr, 0, ptr::null_mut()), "nothing of nothing");
        assert_eq!(OK, fmi2SetReal(fmu.c, null_vr, 0, ptr::null()));
        assert_eq!(OK, fmi2SetString(fmu.c, null_vr, 0, ptr::null()));
        assert_eq!(fmu.log(), []);
        let calls = [
            (fmi2GetReal(fmu.c, null_vr, 1, &raw mut value), "vr is null"),
            (fmi2GetReal(fmu.c, &raw const reference, 1, ptr::null_mut()), "value is null"),
            (fmi2SetReal(fmu.c, null_vr, 1, &raw const value), "vr is null"),
            (fmi2SetReal(fmu.c, &vr::U, 1, ptr::null()), "value is null"),
            (fmi2GetInteger(fmu.c, null_vr, 1, &mut 0), "vr is null"),
            (fmi2SetInteger(fmu.c, &vr::FAULT, 1, ptr::null()), "value is null"),
            (fmi2GetBoolean(fmu.c, &vr::INSIDE, 1, ptr::null_mut()), "value is null"),
            (fmi2SetBoolean(fmu.c, null_vr, 1, &1), "vr is null"),
            (fmi2GetString(fmu.c, &vr::LABEL, 1, ptr::null_mut()), "value is null"),
            (fmi2GetReal(fmu.c, &raw const reference, 1, crooked.cast()), "not aligned"),
            (fmi2GetReal(fmu.c, &raw const reference, 12, &raw mut value), "at most 11"),
            (fmi2GetReal(fmu.c, &raw const reference, usize::MAX, &raw mut value), "at most 11"),
            (fmi2SetReal(fmu.c, &raw const reference, usize::MAX, &raw const value), "at most 11"),
            (fmi2GetFMUstate(fmu.c, ptr::null_mut()), "FMUstate is null"),
            (fmi2GetStatus(fmu.c, 0, ptr::null_mut()), "value is null"),
            (fmi2GetRealStatus(fmu.c, 2, ptr::null_mut()), "value is null"),
            (fmi2GetStatus(fmu.c, 17, &mut 0), "no fmi2StatusKind"),
            (fmi2GetStringStatus(fmu.c, -1, &mut ptr::null()), "no fmi2StatusKind"),
            (fmi2SetDebugLogging(fmu.c, 1, 1, ptr::null()), "categories is null"),
            (fmi2SetRealInputDerivatives(fmu.c, &vr::U, 1, ptr::null(), &raw const value), "order is null"),
            (fmi2GetRealOutputDerivatives(fmu.c, &vr::X, 1, ptr::null(), &raw mut value), "order is null"),
            (fmi2GetDirectionalDerivative(fmu.c, &vr::X, 1, &vr::X, 1, ptr::null(), &raw mut value), "dvKnown is null"),
        ];
        let log = fmu.log();
        assert_eq!(log.len(), calls.len());
        for ((status, expected), logged) in calls.into_iter().zip(log) {
            assert!(logged.text.contains(expected), "{expected}: {}", logged.text);
            assert_eq!(status, ERROR, "{expected}");
        }
    }
    assert_eq!(fmu.step(0.0, 0.1), OK);
}

#[test]
fn a_null_string_among_strings() {
    let fmu = Fmu::initialising();
    let strings: [*const c_char; 1] = [ptr::null()];
    // SAFETY: one reference, one pointer that is null.
    let status = unsafe { fmi2SetString(fmu.c, &vr::LABEL, 1, strings.as_ptr()) };
    assert_eq!(status, ERROR);
    assert!(fmu.message().contains("`label`: the text is null"));
}

#[test]
fn statuses_that_there_are_none_of() {
    let fmu = Fmu::stepping();
    // SAFETY: room for each value.
    unsafe {
        for kind in 0..4 {
            assert_eq!(DISCARD, fmi2GetIntegerStatus(fmu.c, kind, &mut 0));
        }
        assert_eq!(DISCARD, fmi2GetRealStatus(fmu.c, 3, &mut 0.0));
        assert_eq!(DISCARD, fmi2GetBooleanStatus(fmu.c, 0, &mut 0));
    }
    assert_eq!(fmu.step(0.0, 0.1), OK);
}

#[test]
fn no_logger_is_no_trouble() {
    let functions = callbacks(None);
    let guid = guid();
    let make = |guid: &CStr| {
        // SAFETY: sound pointers; the logger is null.
        unsafe { fmi2Instantiate(c"quiet".as_ptr(), 1, guid.as_ptr(), ptr::null(), &raw const functions, 1, 1) }
    };
    assert!(make(c"{wrong}").is_null());
    let c = make(&guid);
    // SAFETY: any handle is allowed.
    unsafe {
        assert_eq!(ERROR, fmi2DoStep(c, 0.0, 0.1, 0));
        fmi2FreeInstance(c);
    }
}
