//! A host's ordinary way through an instance's life, against the closed form.

use crate::harness::*;

/// Position and velocity of the undriven oscillator with the default parameters.
fn closed_form(t: f64) -> (f64, f64) {
    let (omega, zeta) = (2.0_f64, 0.1_f64);
    let damped = omega * (1.0 - zeta * zeta).sqrt();
    let envelope = (-zeta * omega * t).exp();
    let sine = (damped * t).sin();
    let x = envelope * ((damped * t).cos() + zeta * omega / damped * sine);
    (x, -envelope * omega * omega / damped * sine)
}

#[test]
fn a_whole_life() {
    // SAFETY: these two return static strings.
    unsafe {
        assert_eq!(string(fmi2GetVersion()), "2.0");
        assert_eq!(string(fmi2GetTypesPlatform()), "default");
    }
    let fmu = Fmu::new();
    assert_eq!(fmu.setup(0.0, Some(5.0)), OK);
    assert_eq!(fmu.enter(), OK);
    assert_eq!(fmu.get(vr::DER_V), -4.0, "outputs can be read while initialising");
    assert_eq!(fmu.exit(), OK);
    for i in 0..50 {
        assert_eq!(fmu.step(0.1 * f64::from(i), 0.1), OK);
        let (x, v) = closed_form(0.1 * f64::from(i + 1));
        assert!((fmu.get(vr::X) - x).abs() < 1e-13, "x after step {i}");
        assert!((fmu.get(vr::V) - v).abs() < 1e-13, "v after step {i}");
    }
    assert!((fmu.get(vr::TIME) - 5.0).abs() < 1e-12);
    assert_eq!(fmu.get_integer(vr::STEPS), 50);
    // SAFETY: any handle is allowed.
    assert_eq!(OK, unsafe { fmi2Terminate(fmu.c) });
    assert_eq!(fmu.get_integer(vr::STEPS), 50, "values stay readable");
    assert_eq!(fmu.log(), []);
}

#[test]
fn steps_of_any_size_lead_to_the_same_place() {
    let fmu = Fmu::stepping();
    let mut time = 0.0;
    for step in [0.3, 1e-6, 0.7, 0.001, 1.5] {
        assert_eq!(fmu.step(time, step), OK);
        time += step;
    }
    assert!((fmu.get(vr::X) - closed_form(time).0).abs() < 1e-12);
}

#[test]
fn reset_brings_the_start_back() {
    let fmu = Fmu::new();
    for _ in 0..2 {
        assert_eq!(fmu.get_after_setup(), 1.0);
        assert_eq!(fmu.set(vr::OMEGA, 5.0), OK);
        assert_eq!(fmu.exit(), OK);
        assert_eq!(fmu.step(0.0, 0.1), OK);
        assert_ne!(fmu.get(vr::X), 1.0);
        assert_eq!(fmu.reset(), OK);
        assert_eq!(fmu.enter(), ERROR, "the experiment has to be set up again");
        assert!(fmu.message().contains("fmi2SetupExperiment"));
    }
}

impl Fmu {
    fn get_after_setup(&self) -> f64 {
        assert_eq!(self.setup(0.0, None), OK);
        assert_eq!(self.enter(), OK);
        assert_eq!(self.get(vr::OMEGA), 2.0);
        self.get(vr::X)
    }
}

#[test]
fn two_instances_do_not_mix() {
    let (a, b) = (Fmu::stepping(), Fmu::stepping());
    assert_eq!(a.set(vr::U, 1.0), OK);
    for i in 0..10 {
        assert_eq!(a.step(f64::from(i), 1.0), OK);
        assert_eq!(b.step(f64::from(i), 1.0), OK);
    }
    assert!((b.get(vr::X) - closed_form(10.0).0).abs() < 1e-12);
    assert!((a.get(vr::X) - b.get(vr::X)).abs() > 0.1);
}

#[test]
fn an_undefined_stop_time_and_tolerance_are_not_looked_at() {
    let fmu = Fmu::new();
    // SAFETY: plain values.
    let status = unsafe { fmi2SetupExperiment(fmu.c, 0, f64::NAN, 1.0, 0, -5.0) };
    assert_eq!(status, OK);
    assert_eq!(fmu.enter(), OK);
    assert_eq!(fmu.exit(), OK);
    assert_eq!(fmu.get(vr::TIME), 1.0);
    assert_eq!(fmu.step(1.0, 100.0), OK);
}

#[test]
fn experiments_that_cannot_be_are_refused() {
    let fmu = Fmu::new();
    for (tolerance_defined, tolerance, start, stop_defined, stop) in [
        (0, 0.0, f64::NAN, 0, 0.0),
        (0, 0.0, f64::INFINITY, 0, 0.0),
        (0, 0.0, 1.0, 1, 0.5),
        (0, 0.0, 1.0, 1, f64::NAN),
        (1, 0.0, 0.0, 0, 0.0),
        (1, -1e-6, 0.0, 0, 0.0),
        (1, f64::NAN, 0.0, 0, 0.0),
    ] {
        // SAFETY: plain values.
        let status = unsafe { fmi2SetupExperiment(fmu.c, tolerance_defined, tolerance, start, stop_defined, stop) };
        assert_eq!(status, ERROR, "{tolerance} {start} {stop}");
    }
    assert_eq!(fmu.setup(0.0, Some(0.0)), OK, "an experiment without length is allowed");
}

#[test]
fn an_initialisation_that_fails_breaks_the_instance_until_reset() {
    let fmu = Fmu::initialising();
    assert_eq!(fmu.set(vr::WALL, 0.5), OK);
    assert_eq!(fmu.exit(), ERROR);
    assert!(fmu.message().contains("starts beyond the wall at 0.5"));
    assert_eq!(fmu.step(0.0, 0.1), ERROR);
    assert_eq!(fmu.reset(), OK);
    assert_eq!(fmu.setup(0.0, None), OK);
    assert_eq!(fmu.enter(), OK);
    assert_eq!(fmu.exit(), OK);
}
