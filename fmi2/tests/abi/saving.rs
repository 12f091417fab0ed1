//! Saved states: bit for bit, in memory and as bytes, and what is refused.

use std::ptr;

use crate::harness::*;

/// Ten steps under changing inputs; the bits of everything that can be read after each.
fn run(fmu: &Fmu, from: f64) -> Vec<u64> {
    let mut bits = Vec::new();
    for i in 0..10 {
        let time = from + 0.125 * f64::from(i);
        assert_eq!(fmu.set(vr::U, (3.0 * time).sin()), OK);
        assert_eq!(fmu.step(time, 0.125), OK);
        bits.extend([vr::TIME, vr::X, vr::V, vr::DER_V, vr::ENERGY].map(|vr| fmu.get(vr).to_bits()));
        bits.push(fmu.get_integer(vr::STEPS) as u64);
    }
    bits
}

#[test]
fn a_restored_run_continues_bit_for_bit() {
    let fmu = Fmu::stepping();
    run(&fmu, 0.0);
    let state = fmu.save();
    let first = run(&fmu, 1.25);
    assert_eq!(fmu.restore(state), OK);
    assert_eq!(run(&fmu, 1.25), first);
    assert_eq!(fmu.restore(state), OK, "as often as wanted");
    assert_eq!(run(&fmu, 1.25), first);
}

#[test]
fn a_serialised_run_continues_bit_for_bit_in_another_instance() {
    let fmu = Fmu::initialising();
    assert_eq!(fmu.set(vr::OMEGA, 3.7), OK);
    assert_eq!(fmu.set_string(vr::LABEL, c"the first"), OK);
    assert_eq!(fmu.exit(), OK);
    run(&fmu, 0.0);
    let bytes = fmu.serialise(fmu.save());
    let first = run(&fmu, 1.25);

    let other = Fmu::new();
    let state = other.deserialise(&bytes).unwrap();
    assert_eq!(other.serialise(state), bytes);
    assert_eq!(other.restore(state), OK, "a fresh instance takes the state as it is");
    assert_eq!(other.get_string(vr::LABEL), "the first");
    assert_eq!(run(&other, 1.25), first);
}

#[test]
fn a_state_brings_its_place_in_the_life_back() {
    let fmu = Fmu::initialising();
    let initialising = fmu.save();
    assert_eq!(fmu.exit(), OK);
    assert_eq!(fmu.step(0.0, 0.5), OK);
    assert_eq!(fmu.restore(initialising), OK);
    assert_eq!(fmu.step(0.0, 0.5), ERROR);
    assert_eq!(fmu.set(vr::OMEGA, 1.0), OK, "parameters can be set again");
    assert_eq!(fmu.exit(), OK);
    assert_eq!(fmu.step(0.0, 0.5), OK);
}

#[test]
fn a_state_that_is_there_is_used_again() {
    let fmu = Fmu::stepping();
    let mut state = fmu.save();
    let first = state;
    assert_eq!(fmu.step(0.0, 0.5), OK);
    let later = fmu.get(vr::X);
    // SAFETY: a handle that may be changed.
    assert_eq!(OK, unsafe { fmi2GetFMUstate(fmu.c, &raw mut state) });
    assert_eq!(state, first);
    assert_eq!(fmu.step(0.5, 0.5), OK);
    assert_eq!(fmu.restore(state), OK);
    assert_eq!(fmu.get(vr::X), later);
}

#[test]
fn states_are_freed_in_any_order_and_once() {
    let fmu = Fmu::stepping();
    let mut states: Vec<Handle> = Vec::new();
    let mut values = Vec::new();
    for i in 0..4 {
        states.push(fmu.save());
        values.push(fmu.get(vr::X));
        assert_eq!(fmu.step(f64::from(i), 1.0), OK);
    }
    let mut freed = states[1];
    assert_eq!(fmu.free_state(&mut freed), OK);
    assert!(freed.is_null());
    assert_eq!(fmu.free_state(&mut freed), OK, "null is ignored");
    // SAFETY: null is ignored.
    assert_eq!(OK, unsafe { fmi2FreeFMUstate(fmu.c, ptr::null_mut()) });
    assert_eq!(fmu.restore(states[3]), OK);
    assert_eq!(fmu.get(vr::X), values[3]);
    assert_eq!(fmu.restore(states[0]), OK);
    assert_eq!(fmu.get(vr::X), values[0]);

    let mut stale = states[1];
    assert_eq!(fmu.free_state(&mut stale), ERROR, "freed before");
    assert_eq!(stale, states[1]);
    assert_eq!(fmu.restore(stale), ERROR);
    assert_eq!(fmu.get(vr::X), values[0], "nothing has changed");
}

#[test]
fn foreign_states_are_refused() {
    let (fmu, other) = (Fmu::stepping(), Fmu::stepping());
    let theirs = other.save();
    let mut number = 7_u64;
    let made_up: Handle = ptr::from_mut(&mut number).cast();
    for mut state in [theirs, made_up, ptr::null_mut()] {
        let mut size = 0;
        assert_eq!(fmu.restore(state), ERROR);
        // SAFETY: any handle is allowed.
        unsafe {
            let status = fmi2SerializedFMUstateSize(fmu.c, state, &raw mut size);
            assert_eq!(status, ERROR);
            let status = fmi2SerializeFMUstate(fmu.c, state, [0; 8].as_mut_ptr(), 8);
            assert_eq!(status, ERROR);
            if !state.is_null() {
                assert_eq!(ERROR, fmi2FreeFMUstate(fmu.c, &raw mut state));
                assert_eq!(ERROR, fmi2GetFMUstate(fmu.c, &raw mut state));
            }
        }
    }
    assert_eq!(number, 7);
    assert_eq!(other.restore(theirs), OK);
    assert_eq!(fmu.step(0.0, 0.1), OK);
}

#[test]
fn damaged_bytes_are_refused_and_change_nothing() {
    let fmu = Fmu::stepping();
    assert_eq!(fmu.step(0.0, 0.5), OK);
    let bytes = fmu.serialise(fmu.save());
    let before = fmu.get(vr::X);
    for at in 0..bytes.len() {
        let mut damaged = bytes.clone();
        damaged[at] ^= 1;
        assert_eq!(fmu.deserialise(&damaged), Err(ERROR), "byte {at}");
    }
    for length in [0, 1, 8, 20, bytes.len() / 2, bytes.len() - 1] {
        assert_eq!(fmu.deserialise(&bytes[..length]), Err(ERROR), "cut to {length}");
    }
    let mut longer = bytes.clone();
    longer.extend([0; 3]);
    assert_eq!(fmu.deserialise(&longer), Err(ERROR));
    fmu.log();
    let mut other_format = bytes.clone();
    other_format[8] += 1;
    assert_eq!(fmu.deserialise(&other_format), Err(ERROR));
    assert!(fmu.message().contains("of format 2, expected format 1"));
    assert_eq!(fmu.get(vr::X).to_bits(), before.to_bits());
    assert!(fmu.deserialise(&bytes).is_ok());
}

#[test]
fn the_size_has_to_be_the_one_told() {
    let fmu = Fmu::stepping();
    let state = fmu.save();
    let needed = fmu.serialise(state).len();
    let mut bytes = vec![0; needed + 8];
    for size in [0, needed - 1, needed + 1, usize::MAX] {
        // SAFETY: sizes that are refused before anything is written.
        let status = unsafe { fmi2SerializeFMUstate(fmu.c, state, bytes.as_mut_ptr(), size) };
        assert_eq!(status, ERROR, "{size}");
    }
    // SAFETY: null is refused.
    let status = unsafe { fmi2SerializeFMUstate(fmu.c, state, ptr::null_mut(), needed) };
    assert_eq!(status, ERROR);
    assert!(bytes.iter().all(|&b| b == 0));
}
