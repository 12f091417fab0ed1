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
    // Items of `solver`: radau and auto.
    for (cable_model, solver) in MODELS.into_iter().flat_map(|model| [(model, 1), (model, 3)]) {
        let model = moving(cable_model, memory());
        let mut platform = CablePlatform::new(model.clone()).unwrap();
        choose(&mut platform, "solver", solver);
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

/// It was left out, so that another instance, or the same after a reset, could not take up the state.
#[test]
fn when_an_effect_begins_is_saved_too() {
    let bias = EffectSpec::new("winch_force_bias", Some(3), &[500.0]).unwrap().during(Some(2.0), None).unwrap();
    let model = moving(CableModel::LumpedMass, vec![bias]);
    let mut platform = CablePlatform::new(model.clone()).unwrap();
    set(&mut platform, "effect.winch_force_bias[3].from", 0.2);
    initialise(&mut platform, EXPERIMENT);
    platform.step(0.0, 0.1).unwrap();
    let mut saved = Vec::new();
    platform.save(&mut saved);
    platform.step(0.1, 0.3).unwrap();
    let mut other = CablePlatform::new(model).unwrap();
    for _ in 0..2 {
        other.restore(&saved).unwrap();
        assert_eq!(get(&mut other, "effect.winch_force_bias[3].from"), 0.2);
        other.step(0.1, 0.3).unwrap();
        assert_eq!(bits(&snapshot(&mut other)), bits(&snapshot(&mut platform)));
        other.reset();
        assert_eq!(get(&mut other, "effect.winch_force_bias[3].from"), 2.0);
    }
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

/// Where the bytes of a running platform say with which tolerance it was started.
fn tolerance_at(saved: &[u8]) -> usize {
    let tolerance = 1e-8_f64.to_le_bytes();
    // The first is the parameter; the flag of the phase stands before the other.
    (0..saved.len() - 8).rfind(|at| saved[*at..].starts_with(&tolerance) && saved[at - 1] == 2).unwrap()
}

#[test]
fn a_saved_tolerance_of_nan_or_1e_30_is_refused() {
    let mut platform = CablePlatform::new(moving(CableModel::LumpedMass, memory())).unwrap();
    initialise(&mut platform, EXPERIMENT);
    let mut saved = Vec::new();
    platform.save(&mut saved);
    platform.step(0.0, 0.1).unwrap();
    let before = snapshot(&mut platform);
    let at = tolerance_at(&saved);
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e-30, 0.0, -1e-8, 1.0] {
        let mut bytes = saved.clone();
        bytes[at..at + 8].copy_from_slice(&bad.to_le_bytes());
        let error = platform.restore(&bytes).unwrap_err();
        assert!(error.message.contains("tolerance"), "{bad}: {error}");
        assert_eq!(snapshot(&mut platform), before);
    }
    platform.restore(&saved).unwrap();
}

/// Every number in the bytes, one after the other, made into one that a host cannot set.
#[test]
fn saved_numbers_that_are_none_are_refused() {
    for started in [false, true] {
        let mut platform = CablePlatform::new(moving(CableModel::LumpedMass, memory())).unwrap();
        if started {
            initialise(&mut platform, EXPERIMENT);
            platform.step(0.0, 0.1).unwrap();
        }
        let mut saved = Vec::new();
        platform.save(&mut saved);
        let before = snapshot(&mut platform);
        // Behind four enumerations numbers of 8 bytes until the flag of the phase.
        let settings = if started { tolerance_at(&saved) - 1 } else { saved.len() - 1 };
        assert_eq!((settings - 16) % 8, 0);
        for at in (16..settings).step_by(8) {
            for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                let mut bytes = saved.clone();
                bytes[at..at + 8].copy_from_slice(&bad.to_le_bytes());
                let error = platform.restore(&bytes).unwrap_err();
                assert!(error.message.contains("could not have been set"), "byte {at}: {error}");
            }
        }
        assert_eq!(snapshot(&mut platform), before);
    }
}

/// Made-up bytes anywhere: refused, or a state that can be read and stepped in an instant, whatever comes of it.
#[test]
fn made_up_states_are_refused_or_end_in_an_answer() {
    let mut platform = CablePlatform::new(moving(CableModel::LumpedMass, memory())).unwrap();
    initialise(&mut platform, EXPERIMENT);
    platform.step(0.0, 0.1).unwrap();
    let mut saved = Vec::new();
    platform.save(&mut saved);
    let patterns = [f64::NAN, f64::INFINITY, 0.0, -1.0, 1e-300, 1e300].map(f64::to_le_bytes);
    let (mut refused, mut taken) = (0, 0);
    for at in (0..saved.len() - 8).step_by(4) {
        for (k, pattern) in patterns.iter().enumerate() {
            let mut bytes = saved.clone();
            bytes[at..at + 8].copy_from_slice(pattern);
            if platform.restore(&bytes).is_err() {
                refused += 1;
                continue;
            }
            taken += 1;
            for index in 0..platform.description().variables.len() {
                let _either_is_fine = platform.get(index);
            }
            if k % 3 == 0 {
                let time = platform.simulation.as_ref().unwrap().time();
                let _either_is_fine = platform.step(time, 1e-3);
            }
        }
    }
    assert!(refused > 100 && taken > 100, "{refused} refused, {taken} taken");
}
