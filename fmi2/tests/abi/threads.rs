//! Instances on many threads, and one instance that many threads get hold of.

use std::thread;

use crate::harness::*;

fn trajectory(omega: f64) -> Vec<u64> {
    let fmu = Fmu::initialising();
    assert_eq!(fmu.set(vr::OMEGA, omega), OK);
    assert_eq!(fmu.exit(), OK);
    (0..500)
        .map(|i| {
            assert_eq!(fmu.step(0.01 * f64::from(i), 0.01), OK);
            fmu.get(vr::X).to_bits()
        })
        .collect()
}

#[test]
fn eight_threads_give_what_one_gives() {
    let alone: Vec<_> = (1..=8).map(|i| trajectory(f64::from(i))).collect();
    let threads: Vec<_> = (1..=8).map(|i| thread::spawn(move || trajectory(f64::from(i)))).collect();
    for (thread, alone) in threads.into_iter().zip(alone) {
        assert_eq!(thread.join().unwrap(), alone);
    }
}

/// A host must not do this; if it does, calls take turns and a freed instance is an error.
#[test]
fn one_instance_on_many_threads_is_an_error_at_worst() {
    let fmu = Fmu::stepping();
    let address = fmu.c.addr();
    thread::scope(|scope| {
        for thread in 0..4 {
            scope.spawn(move || {
                let c = std::ptr::without_provenance_mut(address);
                for i in 0..200 {
                    let mut value = f64::NAN;
                    // SAFETY: any handle is allowed; one value.
                    unsafe {
                        fmi2GetReal(c, &vr::X, 1, &raw mut value);
                        fmi2DoStep(c, 0.01 * f64::from(i), 0.01, 0);
                        if thread == 3 && i == 100 {
                            fmi2FreeInstance(c);
                        }
                    }
                }
            });
        }
    });
    assert_eq!(fmu.step(0.0, 0.01), ERROR);
}
