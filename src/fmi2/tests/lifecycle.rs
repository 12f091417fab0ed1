//! From start values to the end of a run.

use fmi2_export::{Model as _, Status};

use super::*;
use crate::release::RELEASE;

/// `item` of the enumeration `initialization`.
const FROM_STATES: i32 = 2;
const STATIC_EQUILIBRIUM: i32 = 3;

#[test]
fn release_matches_the_table() {
    let mut platform = CablePlatform::instantiate(None).unwrap();
    for name in ["x", "y", "phi"] {
        set(&mut platform, name, 0.1);
    }
    set(&mut platform, "relative_tolerance", 1e-12);
    initialise(&mut platform, EXPERIMENT);
    let mut step = 0;
    for row in &RELEASE {
        while f64::from(step) * 0.1 < row.time - 0.05 {
            platform.step(f64::from(step) * 0.1, 0.1).unwrap();
            step += 1;
        }
        for (k, name) in ["x", "y", "phi"].into_iter().enumerate() {
            let value = get(&mut platform, name);
            assert!((value - row.pose[k]).abs() < 2e-10, "{name} at {}: {value}", row.time);
        }
        for i in 0..4 {
            let length = get(&mut platform, &format!("unstretched_length[{}]", i + 1));
            assert!((length - row.unstretched_length[i]).abs() < 1e-7, "l{} at {}: {length}", i + 1, row.time);
            let tension = get(&mut platform, &format!("tension[{}]", i + 1));
            assert!((tension - row.tension[i]).abs() < 2e-6, "T{} at {}: {tension}", i + 1, row.time);
        }
    }
}

#[test]
fn parameters_and_states_read_back() {
    for cable_model in MODELS {
        let mut platform = CablePlatform::new(moving(cable_model, one_of_each())).unwrap();
        let before = snapshot(&mut platform);
        let settable: Vec<usize> = (0..platform.description().variables.len())
            .filter(|&k| platform.description().variables[k].settable_before_initialisation())
            .collect();
        for &k in &settable {
            let value = platform.get(k).unwrap();
            assert_eq!(platform.description().variables[k].start_of().as_ref(), Some(&value));
            let changed = match value {
                Value::Real(value) => Value::Real(value * 1.001 + 1e-6),
                other => other,
            };
            platform.set(k, changed.clone()).unwrap();
            assert_eq!(platform.get(k).unwrap(), changed, "{}", platform.description().variables[k].name);
        }
        platform.reset();
        assert_eq!(snapshot(&mut platform), before);
    }
}

#[test]
fn setting_what_a_sensor_shows_sets_the_truth_behind_it() {
    let effects = vec![
        EffectSpec::new("pose_sensor_bias", None, &[0.5, -0.25, 0.01]).unwrap(),
        EffectSpec::new("length_sensor_scale", None, &[0.001]).unwrap(),
        EffectSpec::new("length_sensor_bias", Some(2), &[0.12]).unwrap(),
    ];
    let mut platform = CablePlatform::new(moving(CableModel::LumpedMass, effects)).unwrap();
    choose(&mut platform, "initialization", FROM_STATES);
    set(&mut platform, "x", 3.0);
    set(&mut platform, "unstretched_length[2]", 897.5);
    set(&mut platform, "unstretched_length_rate[2]", 0.3);
    initialise(&mut platform, EXPERIMENT);
    for (name, value) in [("x", 3.0), ("unstretched_length[2]", 897.5), ("unstretched_length_rate[2]", 0.3)] {
        assert!((get(&mut platform, name) - value).abs() < 1e-12 * value, "{name}");
    }
    let states = platform.simulation.as_ref().unwrap().states().to_vec();
    assert!((states[0] - 2.5).abs() < 1e-12);
    assert!((states[8] - (897.5 - 0.12) / 1.001).abs() < 1e-9, "{}", states[8]);
}

#[test]
fn outputs_follow_start_values_in_initialisation_mode() {
    let mut platform = CablePlatform::instantiate(None).unwrap();
    choose(&mut platform, "cable_model", 1);
    platform.enter_initialisation(EXPERIMENT).unwrap();
    for force in [5000.0, 9000.0] {
        for i in 1..=4 {
            set(&mut platform, &format!("winch_force[{i}]"), force);
        }
        let tension = get(&mut platform, "tension[1]");
        assert!((tension / force - 1.0).abs() < 1e-3, "{tension}");
    }
}

#[test]
fn equilibrium_is_found_or_refused() {
    let mut platform = CablePlatform::instantiate(None).unwrap();
    choose(&mut platform, "initialization", STATIC_EQUILIBRIUM);
    set(&mut platform, "disturbance_force_x", 5.0);
    initialise(&mut platform, EXPERIMENT);
    assert!(get(&mut platform, "x") > 0.1);
    assert!(get(&mut platform, "der(vx)").abs() < 1e-9);

    platform.reset();
    choose(&mut platform, "initialization", STATIC_EQUILIBRIUM);
    for i in 1..=4 {
        set(&mut platform, &format!("winch_force[{i}]"), 0.0);
    }
    set(&mut platform, "disturbance_force_x", 5.0);
    platform.enter_initialisation(EXPERIMENT).unwrap();
    let error = platform.initialise(EXPERIMENT).unwrap_err();
    assert!(error.message.contains("equilibrium"), "{error}");
}

#[test]
fn a_tolerance_that_was_set_goes_before_that_of_the_experiment() {
    let loose = Experiment { tolerance: Some(1e-4), ..EXPERIMENT };
    let used = |own: Option<f64>, experiment: Experiment| {
        let mut platform = CablePlatform::instantiate(None).unwrap();
        if let Some(own) = own {
            set(&mut platform, "relative_tolerance", own);
        }
        initialise(&mut platform, experiment);
        platform.phase
    };
    let running = |tolerance| super::super::Phase::Running { tolerance };
    assert_eq!(used(None, EXPERIMENT), running(1e-8));
    assert_eq!(used(None, loose), running(1e-4));
    assert_eq!(used(Some(1e-11), loose), running(1e-11));
    assert_eq!(used(None, Experiment { tolerance: Some(0.5), ..EXPERIMENT }), running(1e-3));
}

fn warnings(platform: &mut CablePlatform) -> Vec<String> {
    platform.take_log().into_iter().filter(|e| e.status == Status::Warning).map(|e| e.message).collect()
}

#[test]
fn lengths_that_will_not_be_used_are_said_so() {
    let mut platform = CablePlatform::instantiate(None).unwrap();
    set(&mut platform, "unstretched_length[1]", 880.0);
    initialise(&mut platform, EXPERIMENT);
    assert!(warnings(&mut platform)[0].contains("from_states"));
    assert!(get(&mut platform, "unstretched_length[1]") > 890.0);
}

#[test]
fn a_cable_that_goes_slack_is_logged() {
    let mut platform = CablePlatform::new(moving(CableModel::Rigid, Vec::new())).unwrap();
    initialise(&mut platform, EXPERIMENT);
    set(&mut platform, "winch_force[3]", -3000.0);
    platform.step(0.0, 0.1).unwrap();
    let slack = index(&platform, "slack[3]");
    assert_eq!(platform.get(slack), Ok(Value::Boolean(true)));
    assert_eq!(get(&mut platform, "tension[3]"), 0.0);
    let log = platform.take_log();
    assert!(log.iter().any(|e| e.message.contains("cable 3")), "{log:?}");
}

#[test]
fn a_cable_through_the_platform_is_told_once() {
    let mut platform = CablePlatform::instantiate(None).unwrap();
    set(&mut platform, "omega", 0.5);
    initialise(&mut platform, EXPERIMENT);
    let mut told = 0;
    for k in 0..40 {
        platform.step(f64::from(k) * 0.1, 0.1).unwrap();
        told += warnings(&mut platform).iter().filter(|w| w.contains("runs through the platform")).count();
    }
    assert!(get(&mut platform, "phi") > 1.5);
    assert_eq!(told, 1);
}

#[test]
fn a_platform_that_leaves_the_anchors_ends_the_run() {
    let mut platform = CablePlatform::instantiate(None).unwrap();
    initialise(&mut platform, EXPERIMENT);
    set(&mut platform, "disturbance_force_y", 5e6);
    let mut time = 0.0;
    let error = loop {
        match platform.step(time, 0.5) {
            Ok(()) => time += 0.5,
            Err(error) => break error,
        }
        assert!(time < 30.0, "nothing stopped it");
    };
    assert!(error.terminate, "{error}");
    assert!(error.reached > time && error.reached <= time + 0.5);
}

#[test]
fn resources_are_read_and_checked() {
    let folder = std::env::temp_dir().join(format!("cdpr-fmi2-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let mut platform = CablePlatform::instantiate(Some(&folder)).unwrap();
    assert!(warnings(&mut platform)[0].contains("model.toml is missing"));
    std::fs::write(folder.join("model.toml"), "platform_mass = 2600.0\n").unwrap();
    let mut platform = CablePlatform::instantiate(Some(&folder)).unwrap();
    assert_eq!(get(&mut platform, "platform_mass"), 2600.0);
    std::fs::write(folder.join("model.toml"), "platform_mass = -2600.0\n").unwrap();
    let error = CablePlatform::instantiate(Some(&folder)).err().unwrap();
    assert!(error.message.contains("model.toml: line 1: `platform_mass` is -2600"), "{error}");
    std::fs::remove_dir_all(&folder).unwrap();
    let error = CablePlatform::instantiate(Some(&folder)).err().unwrap();
    assert!(error.message.contains("model.toml"), "{error}");
}

/// The description lists the states, so a parameter cannot add one or take one away.
#[test]
fn presliding_stays_on_or_off_as_packed() {
    for (packed, changed) in [(0.0, 5e4), (5e4, 0.0)] {
        let values = [250.0, 0.01, 0.0, 0.0, packed];
        let friction = EffectSpec::new("winch_coulomb_friction", Some(3), &values).unwrap();
        let mut platform = CablePlatform::new(moving(CableModel::LumpedMass, vec![friction])).unwrap();
        let listed = platform.description().find("effect.winch_coulomb_friction[3].state");
        assert_eq!(listed.is_some(), packed > 0.0);
        let name = "effect.winch_coulomb_friction[3].presliding_stiffness";
        set(&mut platform, name, changed);
        let error = platform.initialise(EXPERIMENT).unwrap_err().to_string();
        assert!(error.contains("presliding_stiffness") && error.contains("cable 3"), "{error}");
        set(&mut platform, name, 1.5 * packed);
        initialise(&mut platform, EXPERIMENT);
    }
}
