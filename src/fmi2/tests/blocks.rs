//! Real variables read and set many at once.

use fmi2_export::Model as _;
use fmi2_export::description::Kind;

use super::*;

/// Every real variable, in another order than the table's.
fn reals(platform: &CablePlatform) -> Vec<usize> {
    let variables = &platform.description().variables;
    let real = |index: &usize| matches!(variables[*index].kind, Kind::Real(_)) && variables[*index].name != "time";
    (0..variables.len()).rev().filter(real).collect()
}

#[test]
fn many_values_at_once_are_those_one_by_one() {
    for (cable_model, effects) in MODELS.into_iter().flat_map(|model| [(model, Vec::new()), (model, one_of_each())]) {
        let mut platform = CablePlatform::new(moving(cable_model, effects)).unwrap();
        for running in [false, true] {
            if running {
                initialise(&mut platform, EXPERIMENT);
                platform.step(0.0, 0.05).unwrap();
            }
            let all = reals(&platform);
            let outputs: Vec<usize> = platform.description().outputs().filter(|index| all.contains(index)).collect();
            let together: Vec<usize> = all
                .iter()
                .copied()
                .filter(|index| platform.shared.places[*index] != crate::fmi2::now::ELSEWHERE)
                .collect();
            assert!(together.len() >= 26, "pose, twist and five kinds of values of four cables");
            for indices in [all, outputs, together] {
                let mut values = vec![f64::NAN; indices.len()];
                platform.get_reals(&indices, &mut values).unwrap();
                for (index, value) in indices.iter().zip(values) {
                    let name = platform.description().variables[*index].name.clone();
                    assert_eq!(platform.get(*index).unwrap(), Value::Real(value), "{cable_model:?}: {name}");
                }
            }
        }
    }
}

#[test]
fn inputs_set_together_end_their_slopes_and_no_others() {
    let mut together = CablePlatform::new(moving(CableModel::LumpedMass, Vec::new())).unwrap();
    let mut singly = CablePlatform::new(moving(CableModel::LumpedMass, Vec::new())).unwrap();
    let inputs = ["winch_force[3]", "disturbance_torque"];
    for platform in [&mut together, &mut singly] {
        initialise(platform, EXPERIMENT);
        for name in ["winch_force[2]", "winch_force[3]"] {
            let index = index(platform, name);
            platform.set_input_derivative(index, 1, 300.0).unwrap();
        }
        platform.step(0.0, 0.1).unwrap();
    }
    let assignments: Vec<(usize, f64)> = inputs.iter().map(|name| (index(&together, name), 7500.0)).collect();
    together.set_reals(&assignments).unwrap();
    inputs.iter().for_each(|name| set(&mut singly, name, 7500.0));
    for platform in [&mut together, &mut singly] {
        platform.step(0.1, 0.1).unwrap();
    }
    assert_eq!(snapshot(&mut together), snapshot(&mut singly));
    assert!(get(&mut together, "winch_force[2]") > 9059.0 && get(&mut together, "winch_force[3]") == 7500.0);
    let wrong = [(index(&together, "winch_force[1]"), 1.0), (index(&together, "platform_mass"), 1.0)];
    let (place, error) = together.set_reals(&wrong).unwrap_err();
    assert!(place == 1 && error.message.contains("only inputs"), "{error}");
    assert_eq!(snapshot(&mut together), snapshot(&mut singly), "a refused set changes nothing");
}
