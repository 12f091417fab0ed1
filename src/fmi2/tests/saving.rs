//! Saved states.

use fmi2_export::Model as _;

use super::*;

/// Effects with states and with a history.
fn memory() -> Vec<EffectSpec> {
    vec![
        EffectSpec::new("winch_lag", None, &[0.15]).unwrap(),
        EffectSpec::new("winch_delay", Some(2), &[0.137]).unwrap(),
        EffectSpec::new("pose_sensor_delay", None, &[0.08]).unwrap(),
        EffectSpec::new("cable_creep", Some(4), &[4e7, 3.0]).unwrap(),
        EffectSpec::new("winch_coulomb_friction", None, &[250.0, 1e-3, 0.0, 0.0, 5e4, 2e3, 0.02]).unwrap(),
    ]
}

fn run(platform: &mut CablePlatform, time: &mut f64, steps: &[f64]) {
    for (k, &step) in steps.iter().enumerate() {
        if k % 2 == 1 {
            set(platform, "winch_force[1]", 7000.0 + 100.0 * k as f64);
        }
        platform.step(*time, step).unwrap();
        *time += step;
    }
}

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|v| v.to_bits()).collect()
}

#[test]
fn a_restored_run_continues_bit_for_bit() {
    for cable_model in MODELS {
        let model = moving(cable_model, memory());
        let mut platform = CablePlatform::new(model.clone()).unwrap();
        set(&mut platform, "platform_mass", 2600.0);
        initialise(&mut platform, EXPERIMENT);
        let mut time = 0.0;
        run(&mut platform, &mut time, &[0.1, 0.033, 0.05, 0.01]);
        let slope = index(&platform, "winch_force[2]");
        platform.set_input_derivative(slope, 1, 300.0).unwrap();
        run(&mut platform, &mut time, &[0.021]);
        let (mut saved, then) = (Vec::new(), time);
        platform.save(&mut saved);
        let before = snapshot(&mut platform);
        run(&mut platform, &mut time, &[0.1, 0.2, 0.07]);
        let after = snapshot(&mut platform);

        // The same instance, an instance of its own, and one that was in the middle of something else.
        let fresh = CablePlatform::new(model.clone()).unwrap();
        let mut busy = CablePlatform::new(model).unwrap();
        initialise(&mut busy, EXPERIMENT);
        busy.step(0.0, 0.3).unwrap();
        for mut other in [platform, fresh, busy] {
            other.restore(&saved).unwrap();
            assert_eq!(bits(&snapshot(&mut other)), bits(&before), "{cable_model:?}");
            let mut again = Vec::new();
            other.save(&mut again);
            assert_eq!(again, saved);
            let mut time = then;
            run(&mut other, &mut time, &[0.1, 0.2, 0.07]);
            assert_eq!(bits(&snapshot(&mut other)), bits(&after), "{cable_model:?}");
        }
    }
}

#[test]
fn what_was_set_before_initialisation_is_saved_too() {
    let mut platform = CablePlatform::new(moving(CableModel::LumpedMass, memory())).unwrap();
    set(&mut platform, "x", 1.5);
    set(&mut platform, "effect.winch_lag.time_constant", 0.2);
    choose(&mut platform, "cable_model", 2);
    let mut saved = Vec::new();
    platform.save(&mut saved);
    let before = snapshot(&mut platform);
    platform.reset();
    assert_ne!(snapshot(&mut platform), before);
    platform.restore(&saved).unwrap();
    assert_eq!(snapshot(&mut platform), before);
}

#[test]
fn bytes_that_are_no_state_change_nothing() {
    let mut platform = CablePlatform::new(moving(CableModel::LumpedMass, memory())).unwrap();
    initialise(&mut platform, EXPERIMENT);
    let mut saved = Vec::new();
    platform.save(&mut saved);
    platform.step(0.0, 0.1).unwrap();
    let before = snapshot(&mut platform);
    for bytes in [&saved[..saved.len() - 1], &saved[..10], &[], &[saved.as_slice(), &[0]].concat()] {
        platform.restore(bytes).unwrap_err();
        assert_eq!(snapshot(&mut platform), before);
    }
}
