//! Get and set of each type, and which variable may be set when.

use crate::harness::*;

#[test]
fn each_type_reads_back_what_was_set() {
    let fmu = Fmu::initialising();
    assert_eq!(fmu.set(vr::ZETA, 0.25), OK);
    assert_eq!(fmu.set_integer(vr::FAULT, fault::WARN), OK);
    assert_eq!(fmu.set_boolean(vr::HOLD, 1), OK);
    assert_eq!(fmu.set_string(vr::LABEL, c"größe 100%"), OK);
    assert_eq!(fmu.get(vr::ZETA), 0.25);
    assert_eq!(fmu.get_integer(vr::FAULT), fault::WARN);
    assert_eq!(fmu.get_boolean(vr::HOLD), 1);
    assert_eq!(fmu.get_string(vr::LABEL), "größe 100%");
    assert_eq!(fmu.get_string(vr::REPORT), "größe 100% at 1 m");
    assert_eq!(fmu.get_boolean(vr::INSIDE), 1);
    assert_eq!(fmu.get_integer(vr::DIMENSIONS), 1);
}

#[test]
fn several_at_once_in_any_order() {
    let fmu = Fmu::initialising();
    let references = [vr::V, vr::U, vr::X];
    let values = [3.0, 1.0, 2.0];
    // SAFETY: three values each.
    let status = unsafe { fmi2SetReal(fmu.c, references.as_ptr(), 3, values.as_ptr()) };
    assert_eq!(status, OK);
    let mut read = [0.0; 3];
    let references = [vr::U, vr::X, vr::V];
    // SAFETY: three values each.
    let status = unsafe { fmi2GetReal(fmu.c, references.as_ptr(), 3, read.as_mut_ptr()) };
    assert_eq!(status, OK);
    assert_eq!(read, [1.0, 2.0, 3.0]);
}

#[test]
fn one_bad_value_and_none_is_set() {
    let fmu = Fmu::initialising();
    let references = [vr::U, vr::X, vr::OMEGA];
    for bad in [f64::NAN, f64::INFINITY, -1.0] {
        let values = [7.0, 7.0, bad];
        // SAFETY: three values each.
        let status = unsafe { fmi2SetReal(fmu.c, references.as_ptr(), 3, values.as_ptr()) };
        assert_eq!(status, ERROR);
        assert!(fmu.message().contains("`omega`"));
    }
    assert_eq!([fmu.get(vr::U), fmu.get(vr::X), fmu.get(vr::OMEGA)], [0.0, 1.0, 2.0]);
}

/// Finite inputs and parameters of which the model makes none.
#[test]
fn infinity_is_never_read_as_ok() {
    let fmu = Fmu::initialising();
    assert_eq!(fmu.set(vr::GAIN, 1e200), OK);
    assert_eq!(fmu.set(vr::U, 1e200), OK);
    let mut value = 0.0;
    // SAFETY: one value.
    let status = unsafe { fmi2GetReal(fmu.c, &vr::DER_V, 1, &mut value) };
    assert_eq!((status, value), (ERROR, 0.0));
    assert!(fmu.message().contains("`der(v)` is inf at t = 0 s"), "{}", fmu.message());
    assert_eq!(fmu.set(vr::U, 1.0), OK, "it can go on");
    assert!(fmu.get(vr::DER_V).is_finite());
}

#[test]
fn values_out_of_bounds_are_refused() {
    let fmu = Fmu::initialising();
    assert_eq!(fmu.set(vr::ZETA, 1.5), ERROR);
    assert!(fmu.message().contains("`zeta`: 1.5 is above the maximum 0.99"));
    assert_eq!(fmu.set_integer(vr::FAULT, 9), ERROR);
    assert!(fmu.message().contains("not the value of an item of `Fault`"));
    assert_eq!(fmu.set_boolean(vr::HOLD, 2), ERROR);
    assert!(fmu.message().contains("neither fmi2True nor fmi2False"));
    assert_eq!(fmu.set_string(vr::LABEL, c"\xff"), ERROR);
    assert!(fmu.message().contains("not UTF-8"));
    assert_eq!(fmu.set_string(vr::LABEL, c""), ERROR);
    assert!(fmu.message().contains("`label`: a label cannot be empty"));
}

/// For each real variable: may it be set before, in and after initialisation?
#[test]
fn what_may_be_set_when() {
    let table = [
        (vr::TIME, [false, false, false]),
        (vr::U, [true, true, true]),
        (vr::X, [true, true, false]),
        (vr::V, [true, true, false]),
        (vr::DER_X, [false, false, false]),
        (vr::ENERGY, [false, false, false]),
        (vr::OMEGA, [true, true, false]),
        (vr::GAIN, [true, true, true]),
    ];
    let states = [Fmu::new(), Fmu::initialising(), Fmu::stepping()];
    for (reference, allowed) in table {
        for (fmu, allowed) in states.iter().zip(allowed) {
            let status = fmu.set(reference, 0.5);
            assert_eq!(status == OK, allowed, "{reference}: {:?}", fmu.log());
        }
    }
    for fmu in &states {
        assert_eq!(fmu.set_integer(vr::DIMENSIONS, 1), ERROR, "a constant");
        assert_eq!(fmu.set_integer(vr::STEPS, 1), ERROR, "an output");
    }
    assert_eq!(states[2].set_string(vr::LABEL, c"late"), ERROR, "a fixed parameter");
    let said = states[2].log().last().unwrap().text.clone();
    assert!(said.contains("cannot be set in state") && said.contains("(causality "), "{said}");
    assert!(!said.contains("Some("), "{said}");
}

/// The list of references is looked up once while it stays the same; a refused one must not stand for the next.
#[test]
fn a_list_that_was_refused_is_not_taken_for_the_last_one() {
    let fmu = Fmu::stepping();
    assert_eq!(fmu.set(vr::U, 3.0), OK);
    let read = |references: &[u32]| {
        let mut values = vec![f64::NAN; references.len()];
        // SAFETY: as much room as references.
        let status = unsafe { fmi2GetReal(fmu.c, references.as_ptr(), references.len(), values.as_mut_ptr()) };
        (status, values)
    };
    let (status, first) = read(&[vr::U, vr::TIME, vr::OMEGA]);
    assert_eq!((status, first[0], first[1]), (OK, 3.0, 0.0));
    for _ in 0..2 {
        assert_eq!(read(&[vr::OMEGA, 9999]).0, ERROR);
    }
    assert_eq!(read(&[vr::OMEGA]), (OK, vec![first[2]]));
    assert_eq!(fmu.step(0.0, 0.25), OK);
    assert_eq!(read(&[vr::U, vr::TIME, vr::OMEGA]), (OK, vec![3.0, 0.25, first[2]]));
}
