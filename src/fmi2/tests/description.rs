//! The table and the XML made of it.

use std::path::Path;

use fmi2_export::Model as _;
use fmi2_export::description::Causality;

use super::*;

/// The description of the default model is kept in the repository, so that a change of the interface is seen in
/// review. `CDPR_WRITE_GOLDEN=1 cargo test golden` rewrites it.
#[test]
fn golden_description_is_up_to_date() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("modelDescription/CablePlatform.xml");
    let xml = CablePlatform::instantiate(None).unwrap().description().to_xml();
    if std::env::var_os("CDPR_WRITE_GOLDEN").is_some() {
        std::fs::write(&path, &xml).unwrap();
    }
    // A checkout may have turned the line ends.
    let golden = std::fs::read_to_string(&path).unwrap_or_default().replace("\r\n", "\n");
    let differs = golden.lines().zip(xml.lines()).position(|(a, b)| a != b);
    assert!(
        golden == xml,
        "{} is not what the table says (first difference in line {}); see this test for how to rewrite it",
        path.display(),
        differs.map_or(golden.lines().count().min(xml.lines().count()), |line| line + 1)
    );
}

#[test]
fn every_effect_fits_the_table() {
    for spec in one_of_each() {
        let model = Model { effects: vec![spec.clone()], ..Model::default() };
        let platform = CablePlatform::new(model).unwrap_or_else(|e| panic!("{}: {e}", spec.id));
        for k in 0..spec.values.len() {
            let name = spec.variable_name(k).unwrap();
            let variable = &platform.description().variables[index(&platform, &name)];
            assert_eq!(variable.causality, Causality::Parameter, "{name}");
            assert_eq!(variable.start_of(), Some(Value::Real(spec.values[k])), "{name}");
        }
    }
}

#[test]
fn value_references_do_not_move_when_effects_come() {
    let plain = CablePlatform::new(Model::default()).unwrap();
    let full = CablePlatform::new(Model { effects: one_of_each(), ..Model::default() }).unwrap();
    for variable in &plain.description().variables {
        let same = &full.description().variables[index(&full, &variable.name)];
        assert_eq!(same.value_reference, variable.value_reference, "{}", variable.name);
    }
}

#[test]
fn one_sensor_effect_on_both_channels_has_two_names() {
    let mut other = EffectSpec::new("length_sensor_bias", Some(1), &[0.2]).unwrap();
    other.channel = Some("cable_length".to_owned());
    let effects = vec![EffectSpec::new("length_sensor_bias", Some(1), &[0.1]).unwrap(), other];
    let mut platform = CablePlatform::new(Model { effects, ..Model::default() }).unwrap();
    assert_eq!(get(&mut platform, "effect.length_sensor_bias[1].bias"), 0.1);
    assert_eq!(get(&mut platform, "effect.length_sensor_bias[1].cable_length.bias"), 0.2);
}

#[test]
fn when_an_effect_begins_can_be_set() {
    let bias = EffectSpec::new("winch_force_bias", Some(3), &[500.0]).unwrap().during(Some(2.0), None).unwrap();
    let mut platform = CablePlatform::new(Model { effects: vec![bias], ..Model::default() }).unwrap();
    assert!(platform.description().find("effect.winch_force_bias[3].until").is_none());
    assert_eq!(get(&mut platform, "effect.winch_force_bias[3].from"), 2.0);
    set(&mut platform, "effect.winch_force_bias[3].from", 0.2);
    initialise(&mut platform, EXPERIMENT);
    let before = get(&mut platform, "tension[3]");
    platform.step(0.0, 0.3).unwrap();
    assert!((get(&mut platform, "tension[3]") - before).abs() > 1.0);
}

#[test]
fn an_effect_given_again_at_a_later_time_has_names_of_its_own() {
    let entry = |id: &str, cable: Option<usize>, values: &[f64], from: Option<f64>, until: Option<f64>| {
        EffectSpec::new(id, cable, values).unwrap().during(from, until).unwrap()
    };
    let effects = vec![
        entry("winch_lag", None, &[0.2], None, Some(1.0)),
        entry("winch_lag", Some(3), &[0.3], Some(1.0), Some(2.0)),
        entry("winch_lag", Some(3), &[0.4], Some(2.0), None),
    ];
    let mut platform = CablePlatform::new(Model { effects, ..Model::default() }).unwrap();
    for (name, expected) in [
        ("effect.winch_lag.time_constant", 0.2),
        ("effect.winch_lag.until", 1.0),
        ("effect.winch_lag[3].from", 1.0),
        ("effect.winch_lag[3].entry2.time_constant", 0.4),
        ("effect.winch_lag[3].entry2.from", 2.0),
    ] {
        assert_eq!(get(&mut platform, name), expected, "{name}");
    }
    for name in ["effect.winch_lag[2].state", "effect.winch_lag[3].state", "effect.winch_lag[3].entry3.state"] {
        assert!(platform.description().find(name).is_some(), "{name}");
    }
    assert_eq!(platform.description().validate(), Ok(()));
    // Times set so that two are in force at once are refused as in the model file.
    set(&mut platform, "effect.winch_lag[3].entry2.from", 1.5);
    let entered = platform.enter_initialisation(EXPERIMENT);
    let error = entered.and_then(|()| platform.initialise(EXPERIMENT)).unwrap_err().to_string();
    assert!(error.contains("from 1.5 s until 2 s"), "{error}");
}

/// With more cables every name of the default robot keeps its reference, and the others' parameters can be set.
#[test]
fn six_cables_have_variables_of_their_own() {
    use crate::parameters::{CableParameters, Parameters};
    use crate::simulation::Start;
    let mut cable = Parameters::default().on_circles();
    cable.push(CableParameters { density: Some(0.3), ..CableParameters::between([0.0, 800.0], [0.0, 10.0]) });
    cable.push(CableParameters::between([0.0, -800.0], [0.0, -10.0]));
    let parameters = Parameters { cable, ..Parameters::default() };
    let start = Start { pose: [0.1; 3], ..Start::pulling(6) };
    let mut platform = CablePlatform::new(Model { parameters, start, ..Model::default() }).unwrap();
    let plain = CablePlatform::new(Model::default()).unwrap();
    for variable in &plain.description().variables {
        if variable.name.starts_with("anchor_") || variable.name.starts_with("attachment_") {
            continue;
        }
        let same = &platform.description().variables[index(&platform, &variable.name)];
        assert_eq!(same.value_reference, variable.value_reference, "{}", variable.name);
    }
    set(&mut platform, "anchor_y[5]", 810.0);
    set(&mut platform, "own_density[5]", 0.25);
    assert_eq!(get(&mut platform, "attachment_y[6]"), -10.0);
    initialise(&mut platform, Experiment { start_time: 0.0, stop_time: None, tolerance: None });
    set(&mut platform, "winch_force[6]", 2000.0);
    platform.step(0.0, 0.1).unwrap();
    let expected = 810.0 - get(&mut platform, "y") - 10.0;
    assert!((get(&mut platform, "cable_length[5]") - expected).abs() < 1.0);
    assert!(get(&mut platform, "tension[6]") > 1000.0);
    let saved = snapshot(&mut platform);
    assert!(!saved.is_empty());
}
