use std::sync::LazyLock;

use cdpr::effect::EffectSpec;
use cdpr::model_file::Model;

use super::{another_robot, check, windows};
use crate::data::recording::{Bench, of_channels, record, record_on};
use crate::data::{Channel, Trial};
use crate::model::examined::Examined;

/// What a check says of a trial, with the default robot: an error's lines.
fn said(trial: &Trial) -> String {
    check(&Model::default(), std::iter::once(trial)).err().unwrap_or_default()
}

/// A recording with nothing hidden.
static HEALTHY: LazyLock<Trial> = LazyLock::new(|| record(&[], 60.0, 11));

/// A recording of which each row was changed.
fn changed(change: impl Fn(&mut [f64], &mut [f64])) -> Trial {
    let mut trial = HEALTHY.clone();
    for (inputs, row) in trial.inputs.iter_mut().zip(&mut trial.measured) {
        change(&mut inputs.winch_force, row);
    }
    trial
}

/// Pose 0 to 2, then unstretched lengths.
const LENGTHS: std::ops::Range<usize> = 3..7;

#[test]
fn a_healthy_recording_passes() {
    assert_eq!(said(&HEALTHY), "");
}

#[test]
fn no_missing_effect_is_taken_for_a_wrong_reading() {
    let effect = |id: &str, cable: Option<usize>, values: &[f64]| EffectSpec::new(id, cable, values).unwrap();
    for hidden in [
        effect("winch_coulomb_friction", Some(1), &[250.0, 0.02]),
        effect("winch_coulomb_friction", None, &[300.0, 0.02]),
        effect("winch_viscous_friction", None, &[300.0]),
        effect("winch_force_gain", Some(2), &[0.05]),
        effect("winch_force_gain", Some(3), &[-0.3]),
        effect("winch_force_gain", None, &[0.3]),
        effect("winch_force_bias", Some(4), &[900.0]),
        effect("winch_delay", None, &[0.25]),
        effect("anchor_offset", Some(3), &[0.5, -0.4]),
        effect("anchor_offset", None, &[0.4, 0.3]),
        effect("attachment_offset", Some(1), &[0.3, 0.2]),
        effect("length_sensor_bias", Some(2), &[0.3]),
        effect("length_sensor_scale", Some(4), &[4e-4]),
        effect("pose_sensor_bias", None, &[0.3, -0.2, 5e-3]),
        effect("pose_sensor_delay", None, &[0.15]),
        effect("cable_stiffness", None, &[-0.2]),
        effect("platform_mass", None, &[500.0]),
        effect("platform_quadratic_drag", None, &[80.0]),
        effect("steady_wind", None, &[200.0, -100.0, 500.0]),
        effect("umbilical", None, &[12.0, 25.0, 8.0, -6.0]),
    ] {
        let trial = record(std::slice::from_ref(&hidden), 40.0, 12);
        assert_eq!(said(&trial), "", "{hidden:?}");
    }
}

/// On a small robot whose forces hardly vary it was refused: forces 1 and 3 were said to be exchanged.
#[test]
fn a_winch_that_pulls_too_little_is_no_exchange_of_columns() {
    let bench = Bench::laboratory();
    let model = Model { parameters: bench.parameters.clone(), ..Model::default() };
    for (cable, factor) in [(3, -0.05), (1, 0.04), (2, -0.08), (4, 0.1)] {
        let gain = EffectSpec::new("winch_force_gain", Some(cable), &[factor]).unwrap();
        for seed in 63..66 {
            let trial = record_on(&bench, std::slice::from_ref(&gain), 20.0, seed);
            let said = check(&model, std::iter::once(&trial)).err().unwrap_or_default();
            assert_eq!(said, "", "{gain:?}, {seed}");
        }
    }
    let mut exchanged = record_on(&bench, &[], 20.0, 63);
    exchanged.inputs.iter_mut().for_each(|inputs| inputs.winch_force.swap(0, 2));
    let said = check(&model, std::iter::once(&exchanged)).err().unwrap_or_default();
    assert!(said.contains("exchanged"), "{said}");
}

/// A calibrated model with offsets of its encoders was refused: the check said to write them in the map once more.
#[test]
fn an_offset_that_the_model_has_is_no_other_origin() {
    let offset = |cable: usize| EffectSpec::new("length_sensor_bias", Some(cable), &[60.0]).unwrap();
    let effects: Vec<EffectSpec> = (1..=4).map(offset).collect();
    let trial = record(&effects, 40.0, 12);
    assert!(said(&trial).contains("lengths count from another zero"), "{}", said(&trial));
    let model = Model { effects, ..Model::default() };
    assert_eq!(check(&model, std::iter::once(&trial)).err().unwrap_or_default(), "");
    let mut alone = trial;
    alone.channels.drain(..3);
    alone.measured.iter_mut().for_each(|row| drop(row.drain(..3)));
    assert_eq!(check(&model, std::iter::once(&alone)).err().unwrap_or_default(), "");
}

#[test]
fn units_are_seen_by_size() {
    let degrees = changed(|_, row| row[2] = row[2].to_degrees());
    let millimetres = changed(|_, row| row[LENGTHS].iter_mut().for_each(|v| *v *= 1e3));
    let kilonewtons = changed(|forces, _| forces.iter_mut().for_each(|v| *v *= 1e-3));
    let one = changed(|_, row| row[5] *= 1e3);
    for (trial, part) in [
        (degrees, "phi is in deg by size, not in rad. Write unit = \"deg\" for it in the map"),
        (millimetres, "unstretched_length[3], unstretched_length[4] are in mm by size, not in m"),
        (kilonewtons, "winch_force[3], winch_force[4] are in kN by size, not in N. Write unit = \"kN\" for each"),
        (one, "made: unstretched_length[3] is in mm by size, not in m"),
    ] {
        assert!(said(&trial).contains(part), "{part}: {}", said(&trial));
    }
}

#[test]
fn two_units_at_once_are_seen() {
    let trial = changed(|forces, row| {
        forces.iter_mut().for_each(|v| *v *= 1e-3);
        row[2] = row[2].to_degrees();
    });
    let found = said(&trial);
    assert!(found.contains("are in kN by size") && found.contains("phi is in deg by size"), "{found}");
}

#[test]
fn kilonewtons_show_in_the_motion_alone() {
    let trial = of_channels(&changed(|forces, _| forces.iter_mut().for_each(|v| *v *= 1e-3)), &[0, 1, 2]);
    assert!(said(&trial).contains("are in kN by size"), "{}", said(&trial));
}

#[test]
fn forces_that_push_are_seen() {
    let all = changed(|forces, _| forces.iter_mut().for_each(|v| *v *= -1.0));
    let found = said(&all);
    assert!(found.contains("cables pull") && found.contains("Write scale = -1 for each in the map"), "{found}");
    let found = said(&changed(|forces, _| forces[2] *= -1.0));
    assert!(found.contains("winch_force[3] is of the other sign. Write scale = -1 for it"), "{found}");
}

#[test]
fn exchanged_columns_are_seen() {
    let found = said(&changed(|forces, _| forces.swap(0, 2)));
    assert!(found.contains("winch_force[1] stands in the column of winch_force[3]"), "{found}");
    let found = said(&changed(|_, row| row.swap(4, 6)));
    assert!(found.contains("unstretched_length[2] stands in the column of unstretched_length[4]"), "{found}");
}

#[test]
fn encoders_that_count_from_the_start_or_backwards_are_seen() {
    let start: Vec<f64> = HEALTHY.measured[0][LENGTHS].to_vec();
    let zeroed =
        |sign: f64| changed(|_, row| row[LENGTHS].iter_mut().zip(&start).for_each(|(v, s)| *v = sign * (*v - s)));
    let found = said(&zeroed(1.0));
    assert!(
        found.contains("lengths count from another zero") && found.contains("unstretched_length[1] offset = "),
        "{found}"
    );
    let found = said(&zeroed(-1.0));
    assert!(
        found.contains("lengths run backwards") && found.contains("unstretched_length[1] scale = -1, offset"),
        "{found}"
    );
}

#[test]
fn another_frame_of_the_pose_is_seen() {
    let shifted = said(&changed(|_, row| row[0] -= 300.0));
    assert!(shifted.contains("shifted by 300.0 m") && shifted.contains("Write offset = 300.0"), "{shifted}");
    let turned = said(&changed(|_, row| (row[0], row[1]) = (-row[1], row[0])));
    assert!(turned.contains("turned by -90.00 deg"), "{turned}");
    let left_handed = said(&changed(|_, row| row[1..3].iter_mut().for_each(|v| *v *= -1.0)));
    assert!(left_handed.contains("mirrored (y and phi of the other sign)"), "{left_handed}");
}

#[test]
fn a_clock_that_was_set_is_seen() {
    let mut trial = HEALTHY.clone();
    trial.time.iter_mut().skip(300).for_each(|t| *t += 3600.0);
    let found = said(&trial);
    assert!(found.contains("the clock jumps by 3600.100 s"), "{found}");
}

#[test]
fn minutes_show_in_the_motion() {
    let mut trial = HEALTHY.clone();
    trial.time.iter_mut().for_each(|t| *t /= 60.0);
    assert!(said(&trial).contains("time is in min by the motion and the forces"), "{}", said(&trial));
}

#[test]
fn rows_that_are_missing_are_no_clock_that_was_set() {
    let mut trial = HEALTHY.clone();
    for k in (250..290).rev() {
        trial.time.remove(k);
        trial.inputs.remove(k);
        trial.measured.remove(k);
    }
    assert_eq!(check(&Model::default(), std::iter::once(&trial)), Ok(Vec::new()));
}

#[test]
fn another_robot_is_seen() {
    let outside = changed(|_, row| row[0] += 2000.0);
    let found = another_robot(&Examined::new(&Model::default()).unwrap(), &outside, &windows(&outside)).unwrap();
    assert!(found.contains("outside the model's anchors, which are at most 900.000 m"), "{found}");
    let found = said(&changed(|_, row| row[3] = 200.0 * row[0]));
    assert!(found.contains("unstretched_length[1] is") && found.contains("Is it the recordings' robot"), "{found}");
    // Near its centre a larger robot differs from a smaller one by what it has paid out.
    let smaller = Model::from_toml("anchor_radius = 300.0\n").unwrap();
    let found = check(&smaller, std::iter::once(&*HEALTHY)).unwrap_err();
    assert!(found.contains("or the model is of another robot: "), "{found}");
}

#[test]
fn lengths_alone_are_checked_by_each_other() {
    let only_lengths = |mut trial: Trial| {
        trial.channels = (0..4).map(Channel::UnstretchedLength).collect();
        trial.measured.iter_mut().for_each(|row| *row = row[LENGTHS].to_vec());
        trial
    };
    assert_eq!(said(&only_lengths(HEALTHY.clone())), "");
    let millimetres = only_lengths(changed(|_, row| row[LENGTHS].iter_mut().for_each(|v| *v *= 1e3)));
    assert!(said(&millimetres).contains("are in mm by size"), "{}", said(&millimetres));
}

/// Of a real log of which one drum had not been zeroed all lengths were said to be in cm, from another zero each: such ones fit
/// any geometry.
#[test]
fn lengths_alone_that_disagree_are_in_no_smaller_unit() {
    let bench = Bench::laboratory();
    let model = Model { parameters: bench.parameters.clone(), ..Model::default() };
    let only_lengths = |one: f64, scale: f64| {
        let mut trial = record_on(&bench, &[], 20.0, 63);
        trial.channels = (0..4).map(Channel::UnstretchedLength).collect();
        trial.measured.iter_mut().for_each(|row| {
            *row = row[LENGTHS].iter().map(|length| scale * length).collect();
            row[0] += scale * one;
        });
        check(&model, std::iter::once(&trial)).err().unwrap_or_default()
    };
    let found = only_lengths(0.46, 1.0);
    assert!(!found.contains("by size") && found.contains("the lengths fit no pose of the model's geometry"), "{found}");
    // An error of a survey is for the search.
    assert_eq!(only_lengths(0.02, 1.0), "");
    for (factor, unit) in [(1e3, "mm"), (1e2, "cm"), (1.0 / 0.3048, "ft")] {
        let found = only_lengths(0.0, factor);
        assert!(found.contains(&format!("are in {unit} by size")), "{found}");
    }
}
