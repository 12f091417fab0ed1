//! Steps that are not taken in full, steps that cannot be asked for, and derivatives.

use std::ptr;

use crate::harness::*;

/// The statuses after a step: its own, the time reached, whether to end, and the message.
fn step_status(fmu: &Fmu) -> (i32, f64, i32, String) {
    let (mut own, mut reached, mut terminated, mut text) = (-1, f64::NAN, -1, ptr::null());
    // SAFETY: room for each value.
    unsafe {
        assert_eq!(OK, fmi2GetStatus(fmu.c, 0, &raw mut own));
        assert_eq!(OK, fmi2GetRealStatus(fmu.c, 2, &raw mut reached));
        assert_eq!(OK, fmi2GetBooleanStatus(fmu.c, 3, &raw mut terminated));
        assert_eq!(OK, fmi2GetStringStatus(fmu.c, 1, &raw mut text));
        (own, reached, terminated, string(text))
    }
}

#[test]
fn a_discarded_step_tells_where_it_got_to_and_can_be_gone_on_from() {
    let fmu = Fmu::stepping();
    assert_eq!(fmu.step(0.0, 0.25), OK);
    assert_eq!(step_status(&fmu).0, OK);
    assert_eq!(fmu.set_integer(vr::FAULT, fault::HALF), OK);
    assert_eq!(fmu.step(0.25, 0.5), DISCARD);
    let (own, reached, terminated, text) = step_status(&fmu);
    assert_eq!((own, reached, terminated), (DISCARD, 0.5, 0));
    assert!(text.contains("at 50% of the step"), "{text}");
    assert_eq!(fmu.get(vr::TIME), 0.5);

    assert_eq!(fmu.set_integer(vr::FAULT, fault::NONE), OK);
    assert_eq!(fmu.set(vr::U, 0.0), OK);
    assert_eq!(fmu.step(0.75, 0.1), ERROR, "the time reached is 0.5");
    assert_eq!(fmu.step(0.5, 0.25), OK);
    assert_eq!(step_status(&fmu).0, OK);

    let whole = Fmu::stepping();
    assert_eq!(whole.step(0.0, 0.75), OK);
    assert!((fmu.get(vr::X) - whole.get(vr::X)).abs() < 1e-14);
}

#[test]
fn a_discarded_step_can_be_taken_back() {
    let fmu = Fmu::stepping();
    assert_eq!(fmu.step(0.0, 0.25), OK);
    let before = fmu.get(vr::X);
    let state = fmu.save();
    assert_eq!(fmu.set_integer(vr::FAULT, fault::HALF), OK);
    assert_eq!(fmu.step(0.25, 0.5), DISCARD);
    assert_eq!(fmu.restore(state), OK);
    assert_eq!(fmu.get(vr::X).to_bits(), before.to_bits());
    assert_eq!(fmu.step(0.25, 0.5), OK, "the fault is taken back as well");
}

#[test]
fn a_model_can_ask_for_the_end() {
    let fmu = Fmu::initialising();
    assert_eq!(fmu.set(vr::WALL, 2.0), OK);
    assert_eq!(fmu.set(vr::V, 10.0), OK);
    assert_eq!(fmu.exit(), OK);
    assert_eq!(fmu.step(0.0, 1.0), DISCARD);
    let (own, reached, terminated, text) = step_status(&fmu);
    assert_eq!((own, terminated), (DISCARD, 1));
    assert!(text.contains("the wall at 2 m"), "{text}");
    assert!(reached > 0.0 && reached < 1.0);
    assert!((fmu.get(vr::X) - 2.0).abs() < 1e-9);
    // SAFETY: any handle is allowed.
    assert_eq!(OK, unsafe { fmi2Terminate(fmu.c) });
}

#[test]
fn a_panic_does_not_cross_and_is_healed_by_reset_or_restore() {
    let fmu = Fmu::stepping();
    let state = fmu.save();
    for heal in [true, false] {
        assert_eq!(fmu.set_integer(vr::FAULT, fault::PANIC), OK);
        assert_eq!(fmu.step(0.0, 0.1), ERROR);
        assert!(fmu.message().contains("the model panicked: asked to panic"));
        assert_eq!(fmu.step(0.0, 0.1), ERROR);
        assert!(fmu.message().contains("not allowed in state `error`"));
        if heal {
            assert_eq!(fmu.restore(state), OK);
        } else {
            assert_eq!(fmu.reset(), OK);
            assert_eq!(fmu.setup(0.0, None), OK);
            assert_eq!(fmu.enter(), OK);
            assert_eq!(fmu.exit(), OK);
        }
        assert_eq!(fmu.set_integer(vr::FAULT, fault::NONE), OK);
        let save = fmu.save();
        assert_eq!(fmu.step(0.0, 0.1), OK);
        assert_eq!(fmu.restore(save), OK);
    }
}

/// fmusim, OMSimulator and PyFMI end a run at `fmi2Warning`.
#[test]
fn a_warning_is_logged_and_does_not_end_the_run() {
    for logging_on in [true, false] {
        let fmu = Fmu::with_logging(logging_on);
        assert_eq!(fmu.setup(0.0, None), OK);
        assert_eq!(fmu.enter(), OK);
        assert_eq!(fmu.exit(), OK);
        assert_eq!(fmu.set_integer(vr::FAULT, fault::WARN), OK);
        assert_eq!(fmu.step(0.0, 0.1), OK);
        let log = fmu.log();
        assert_eq!(log.len(), 1);
        assert_eq!((log[0].category.as_str(), log[0].text.as_str()), ("logModel", "asked to warn"));
        assert_eq!(log[0].status, WARNING);
        assert_eq!(fmu.step(0.1, 0.1), OK);
    }
}

#[test]
fn steps_that_make_no_sense_are_refused_and_change_nothing() {
    let fmu = Fmu::new();
    assert_eq!(fmu.setup(0.0, Some(1.0)), OK);
    assert_eq!(fmu.enter(), OK);
    assert_eq!(fmu.exit(), OK);
    assert_eq!(fmu.step(0.0, 0.5), OK);
    let before = fmu.get(vr::X);
    for (point, step) in [
        (0.5, 0.0),
        (0.5, -0.1),
        (0.5, f64::NAN),
        (0.5, f64::INFINITY),
        (0.5, 1e-300),
        (0.4, 0.1),
        (0.6, 0.1),
        (0.500_001, 0.1),
        (f64::NAN, 0.1),
        (f64::INFINITY, 0.1),
        (0.5, 0.500_01),
    ] {
        assert_eq!(fmu.step(point, step), ERROR, "{point} + {step}");
    }
    assert_eq!(fmu.get(vr::X).to_bits(), before.to_bits());
    assert_eq!(fmu.step(0.5 + 1e-15, 0.5), OK, "rounding is not a mistake");
}

#[test]
fn a_host_may_count_steps_in_its_own_way() {
    let fmu = Fmu::new();
    assert_eq!(fmu.setup(0.0, Some(100.0)), OK);
    assert_eq!(fmu.enter(), OK);
    assert_eq!(fmu.exit(), OK);
    for i in 0..100_000 {
        assert_eq!(fmu.step(f64::from(i) * 0.001, 0.001), OK, "step {i}");
    }
}

#[test]
fn an_input_slope_is_followed() {
    let fmu = Fmu::stepping();
    let (vr_u, order, slope) = (vr::U, 1, 2.0);
    assert_eq!(fmu.set(vr::U, 1.0), OK);
    // SAFETY: one value each.
    unsafe {
        let set = |order: i32, slope: f64| {
            fmi2SetRealInputDerivatives(fmu.c, &raw const vr_u, 1, &raw const order, &raw const slope)
        };
        assert_eq!(OK, set(order, slope));
        assert_eq!(ERROR, set(0, 1.0));
        assert_eq!(ERROR, set(-1, 1.0));
        assert_eq!(ERROR, set(2, 1.0));
        assert_eq!(ERROR, set(1, f64::NAN));
        let x = vr::X;
        let status = fmi2SetRealInputDerivatives(fmu.c, &raw const x, 1, &raw const order, &raw const slope);
        assert_eq!(ERROR, status, "x is not an input");
    }
    assert_eq!(fmu.step(0.0, 0.5), OK);
    assert_eq!(fmu.get(vr::U), 2.0);

    let stairs = Fmu::stepping();
    let n = 20_000;
    for i in 0..n {
        let middle = 0.5 * (f64::from(i) + 0.5) / f64::from(n);
        assert_eq!(stairs.set(vr::U, 1.0 + 2.0 * middle), OK);
        assert_eq!(stairs.step(0.5 * f64::from(i) / f64::from(n), 0.5 / f64::from(n)), OK);
    }
    assert!((fmu.get(vr::X) - stairs.get(vr::X)).abs() < 1e-9);
    assert!((fmu.get(vr::V) - stairs.get(vr::V)).abs() < 1e-9);
}

#[test]
fn output_slopes_agree_with_differences() {
    let fmu = Fmu::stepping();
    assert_eq!(fmu.step(0.0, 0.4), OK);
    let outputs = [vr::X, vr::V, vr::ENERGY];
    let mut slopes = [f64::NAN; 3];
    let get = |orders: [i32; 3], slopes: &mut [f64; 3]| {
        // SAFETY: three values each.
        unsafe { fmi2GetRealOutputDerivatives(fmu.c, outputs.as_ptr(), 3, orders.as_ptr(), slopes.as_mut_ptr()) }
    };
    assert_eq!(get([1; 3], &mut slopes), OK);
    let before = outputs.map(|vr| fmu.get(vr));
    assert_eq!(fmu.step(0.4, 1e-7), OK);
    for (i, vr) in outputs.into_iter().enumerate() {
        let difference = (fmu.get(vr) - before[i]) / 1e-7;
        assert!((slopes[i] - difference).abs() < 1e-5, "{slopes:?} {difference}");
    }
    for order in [0, 2, -1] {
        assert_eq!(get([1, 1, order], &mut slopes), ERROR, "order {order}");
    }
}

#[test]
fn directional_derivatives_give_the_state_matrix() {
    let fmu = Fmu::stepping();
    let unknowns = [vr::DER_X, vr::DER_V, vr::X];
    let knowns = [vr::X, vr::V, vr::U, vr::TIME];
    let get = |unknowns: &[u32], knowns: &[u32], seed: &[f64]| {
        let mut out = vec![f64::NAN; unknowns.len()];
        // SAFETY: arrays of the given lengths.
        let status = unsafe {
            fmi2GetDirectionalDerivative(
                fmu.c,
                unknowns.as_ptr(),
                unknowns.len(),
                knowns.as_ptr(),
                knowns.len(),
                seed.as_ptr(),
                out.as_mut_ptr(),
            )
        };
        (status == OK).then_some(out)
    };
    let column = |i: usize| {
        let mut seed = [0.0; 4];
        seed[i] = 1.0;
        get(&unknowns, &knowns, &seed).unwrap()
    };
    assert_eq!(column(0), [0.0, -4.0, 1.0]);
    assert_eq!(column(1), [1.0, -0.4, 0.0]);
    assert_eq!(column(2), [0.0, 1.0, 0.0]);
    assert_eq!(column(3), [0.0, 0.0, 0.0]);
    assert_eq!(get(&unknowns, &[vr::X, vr::V], &[1.0, 2.0]).unwrap(), [2.0, -4.8, 1.0]);
    assert_eq!(get(&[], &[], &[]).unwrap(), []);
    assert_eq!(get(&[vr::DER_V], &[], &[]).unwrap(), [0.0]);

    assert_eq!(get(&[vr::U], &[vr::X], &[1.0]), None, "an input is no unknown");
    assert_eq!(get(&[vr::X], &[vr::OMEGA], &[1.0]), None, "a parameter is no known");
    assert_eq!(get(&[vr::X], &[vr::X], &[f64::NAN]), None);
    assert_eq!(get(&[99], &[vr::X], &[1.0]), None);
}

/// Value references count by type: 0 is the Boolean `inside` and, as Real, time.
#[test]
fn a_boolean_reference_asked_for_a_derivative_is_named_as_such() {
    let fmu = Fmu::stepping();
    let ask = |unknown: u32, known: u32| {
        let (seed, mut out) = (1.0, f64::NAN);
        // SAFETY: one value each.
        let status = unsafe {
            fmi2GetDirectionalDerivative(
                fmu.c,
                &raw const unknown,
                1,
                &raw const known,
                1,
                &raw const seed,
                &raw mut out,
            )
        };
        assert_eq!(status, ERROR);
        fmu.message()
    };
    let told = ask(vr::INSIDE, vr::X);
    assert!(told.contains("Real `time` (value reference 0) is not an unknown"), "{told}");
    assert!(told.contains("as Boolean it is `inside`"), "{told}");
    let told = ask(vr::X, vr::HOLD + 100);
    assert!(told.contains("no variable of type Real has the value reference 101"), "{told}");
}

#[test]
fn exact_starts_are_knowns_while_initialising() {
    let fmu = Fmu::initialising();
    let (unknown, known, seed) = (vr::DER_V, vr::OMEGA, 1.0);
    let mut out = f64::NAN;
    // SAFETY: one value each.
    let status = unsafe {
        fmi2GetDirectionalDerivative(fmu.c, &raw const unknown, 1, &raw const known, 1, &raw const seed, &raw mut out)
    };
    assert_eq!((status, out), (OK, -4.0));
}
