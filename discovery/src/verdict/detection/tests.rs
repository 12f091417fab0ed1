//! Limits against refinements, against searches for effects of their size, and of a machine at rest.

use super::*;
use crate::data::recording::{noise, record};
use crate::discover::{examine, prepare};
use crate::filter::estimate::noise_of_data;
use crate::outcome::{Discovery, Verdict};
use crate::strategy::fitted::Evidence;
use crate::strategy::time_limit::Hours;
use crate::verdict::by_block::ByBlock;
use cdpr::dynamics::Inputs;
use cdpr::model_file::Model;

fn evidence(hidden: &[EffectSpec], seed: u64) -> Evidence {
    let train = vec![record(hidden, 35.0, seed), record(hidden, 35.0, seed + 1)];
    let holdout = vec![record(hidden, 35.0, seed + 2)];
    let noise = noise_of_data(&[&train[..], &holdout[..]].concat());
    Evidence::new(train, holdout, noise)
}

fn effect(id: &str, cable: Option<usize>, values: &[f64]) -> EffectSpec {
    EffectSpec::new(id, cable, values).expect("an effect")
}

/// The limits where nothing is hidden.
fn limits(seed: u64) -> Vec<DetectionLimit> {
    let evidence = evidence(&[], seed);
    let begun = Context::begin(&evidence, &Model::default(), 0..0, &|_, _| {});
    let (context, base) = begun.expect("a fit");
    detection_limits(&context, &base)
}

fn limit(limits: &[DetectionLimit], id: &str, cable: Option<usize>) -> f64 {
    let found = limits.iter().find(|l| l.effect.id == id && l.effect.cable == cable);
    found.and_then(|l| l.size).unwrap_or_else(|| panic!("no limit of {id} on {cable:?}"))
}

fn discovery(train: Vec<Trial>, holdout: Vec<Trial>) -> Discovery {
    let ready = prepare(train, holdout).expect("recordings");
    examine(&Model::default(), None, 0, ready, Hours::from_now(None), &|_, _| {}).expect("a verdict")
}

/// Whether a search of recordings with this effect finds anything.
fn shows(hidden: EffectSpec, seed: u64) -> bool {
    let Evidence { train, holdout, .. } = evidence(&[hidden], seed);
    discovery(train, holdout).verdict != Verdict::NoMissingEffect
}

/// Laws of every kind: their size, in the units of the limit, made an effect.
type Made = (&'static str, Option<usize>, fn(f64) -> Vec<f64>);
const LAWS: [Made; 8] = [
    ("winch_force_bias", Some(2), |size| vec![size]),
    ("winch_viscous_friction", Some(1), |size| vec![size]),
    ("winch_coulomb_friction", Some(3), |size| vec![size, 0.005]),
    ("platform_linear_drag", None, |size| vec![size]),
    ("platform_mass", None, |size| vec![size]),
    ("cable_stiffness", Some(4), |size| vec![size]),
    // Across the cable, where it shows least.
    ("anchor_offset", Some(1), |size| vec![0.707 * size, -0.707 * size]),
    ("length_sensor_bias", Some(4), |size| vec![size]),
];

/// How many of the laws show at this multiple of their limits.
fn shown_at(multiple: f64, laws: &[Made], seed: u64) -> usize {
    let limits = limits(seed);
    let shown = laws.iter().filter(|(id, cable, values)| {
        let size = multiple * limit(&limits, id, *cable);
        let shows = shows(effect(id, *cable, &values(size)), seed);
        println!("{multiple} x limit of {id}: {size:.4}, {shows}");
        shows
    });
    shown.count()
}

#[test]
fn twice_the_limit_shows_and_a_third_does_not() {
    let few = [LAWS[0], LAWS[3], LAWS[4]];
    assert_eq!(shown_at(2.0, &few, 61), 3);
    assert_eq!(shown_at(0.3, &few, 61), 0);
}

/// Counts over more laws and draws; long.
#[test]
#[ignore = "minutes of searches"]
fn counts_over_draws() {
    for multiple in [0.3, 1.0, 2.0] {
        let shown: usize = [71, 81, 91].iter().map(|seed| shown_at(multiple, &LAWS, *seed)).sum();
        println!("{multiple} x limit: {shown} of {}", 3 * LAWS.len());
    }
}

/// The length of a signature is one over the standard error of a refinement: the two are found in different ways, before and
/// after the effect stands in the model.
#[test]
fn a_limit_is_a_multiple_of_the_standard_error() {
    let nothing = evidence(&[], 51);
    let given = Model::default();
    let (context, base) = Context::begin(&nothing, &given, 0..0, &|_, _| {}).expect("a fit");
    let library = catalogue(&base.train.model, &situation(&context, &base.train));
    for (id, cable, size) in [("platform_mass", None, 5.0), ("winch_viscous_friction", Some(2), 5.0)] {
        let hidden = effect(id, cable, &[size]);
        let candidate = library.candidates.iter().position(|c| c.id == id && c.cable == cable).expect("a candidate");
        let seen = &visibility(&context, &base, &library, &[candidate])[0];
        let unit = library.candidates[candidate].effect(&[1.0]).expect("an effect").values[0];
        let foreseen = unit / seen.train[(0, 0)].sqrt();
        let with = evidence(std::slice::from_ref(&hidden), 51);
        let (context, without) = Context::begin(&with, &given, 0..0, &|_, _| {}).expect("a fit");
        let model = Model { effects: vec![hidden], ..Model::default() };
        let refined = context.fit(&model, &without).expect("a fit").train;
        let information: f64 = ByBlock::new(&refined, &with.train, 0).normals.iter().map(|normal| normal.gram[0]).sum();
        let found = 1.0 / information.sqrt();
        let ratio = foreseen / found;
        assert!((0.8..1.25).contains(&ratio), "{id}: {foreseen} foreseen, {found} found");
    }
}

/// A parameter that is free takes away what it can make up for itself.
#[test]
fn what_another_parameter_makes_up_for_shows_less() {
    let columns = 2;
    let mut normal = Normal::empty(3);
    normal.gram = vec![4.0, 0.0, 3.0, 0.0, 5.0, 0.0, 3.0, 0.0, 9.0];
    let nuisance = nuisance(&normal, columns);
    assert_eq!((nuisance.nrows(), nuisance.ncols()), (1, 2));
    assert!((nuisance[(0, 0)] - 1.0 / 3.0).abs() < 1e-12 && nuisance[(0, 1)].abs() < 1e-12, "{nuisance}");
    let forcing = Forcing { first: 0, columns: 3, step: vec![1.0, 2.0, 3.0], sensor: vec![0.5, 0.25, -1.5] };
    let clear = clear(&forcing, &nuisance);
    assert_eq!((clear.columns, clear.step, clear.sensor), (2, vec![0.0, 2.0], vec![1.0, 0.25]));
}

/// `duration` (s) of the default robot at rest in the middle.
fn at_rest(duration: f64, seed: u64) -> Trial {
    const INTERVAL: f64 = 0.1;
    let moving = record(&[], 1.0, seed);
    let (pull, count) = (2e4, (duration / INTERVAL) as usize);
    let parameters = &Model::default().parameters;
    let length = cdpr::kinematics::cable_lengths(&cdpr::geometry::Geometry::new(parameters), &[0.0; 3]);
    let unstretched = length.map(|length| length / (1.0 + pull / parameters.axial_stiffness()));
    let shown: Vec<f64> = [0.0; 3].into_iter().chain(unstretched).collect();
    let mut random = noise(count * shown.len(), seed);
    let size = [2e-3, 2e-3, 5e-5];
    let mut row = || -> Vec<f64> {
        let of = |(j, v): (usize, &f64)| v + size.get(j).unwrap_or(&2e-3) * random.next().expect("enough noise");
        shown.iter().enumerate().map(of).collect()
    };
    Trial {
        name: "at rest".to_owned(),
        time: (0..count).map(|k| k as f64 * INTERVAL).collect(),
        inputs: vec![Inputs { winch_force: moving.inputs[0].winch_force.map(|_| pull), ..moving.inputs[0] }; count],
        channels: moving.channels,
        measured: (0..count).map(|_| row()).collect(),
        taken_off: Vec::new(),
        undone: Vec::new(),
    }
}

#[test]
fn data_of_a_machine_at_rest_cannot_tell() {
    let found = discovery(vec![at_rest(60.0, 5), at_rest(60.0, 6)], vec![at_rest(60.0, 7)]);
    assert_eq!(found.verdict, Verdict::NoMissingEffect, "{:?}", found.effects);
    let excited = |id: &str| found.detection_limits.iter().any(|l| l.effect.id == id && l.excited);
    for id in ["platform_linear_drag", "winch_coulomb_friction", "winch_viscous_friction", "platform_mass"] {
        assert!(!excited(id), "{id}: {:?}", found.detection_limits.iter().find(|l| l.effect.id == id));
    }
    assert!(excited("length_sensor_bias") && excited("steady_wind"), "what is there at rest shows at rest");
    assert!(found.at_rest());
    assert!(found.remarks.iter().any(|remark| remark.starts_with("The machine hardly moves")), "{:?}", found.remarks);
}

#[test]
fn a_moving_machine_shows_all_laws_of_motion() {
    let limits = limits(31);
    assert!(!crate::outcome::at_rest(&limits));
    for l in &limits {
        println!("{} {:?} {} {:?} {} {}", l.effect.id, l.effect.cable, l.parameter, l.size, l.unit, l.excited);
        assert!(l.size.is_some(), "{l:?}");
        // Of these three more would have to be there than is met in practice.
        let faint = ["cable_damping", "cable_hysteresis", "winch_drum_eccentricity"];
        assert!(l.excited || faint.contains(&&l.effect.id[..]), "{l:?}");
    }
    let friction = limits.iter().find(|l| l.effect.id == "winch_coulomb_friction").expect("a limit");
    assert_eq!((friction.effect.values[1], &friction.shape[..]), (0.005, &[1][..]), "at the typical speed");
    let creep = limits.iter().find(|l| l.effect.id == "cable_creep").expect("a limit");
    assert!(creep.at_most, "the softer the Kelvin element, the more it shows");
    let sides: Vec<bool> =
        limits.iter().filter(|l| l.effect.id == "winch_saturation").map(|l| l.at_most).take(2).collect();
    assert_eq!(sides, [true, false], "an upper limit shows up to a force, a lower one from one on");
}

/// A friction that turned within micrometres a second had derivatives beyond the range of their numbers: the command panicked.
#[test]
fn what_has_no_derivative_makes_up_for_nothing() {
    let mut normal = crate::filter::whiten::Normal::empty(3);
    normal.gram = vec![4.0, 2.0, f64::NAN, 2.0, 2.0, f64::INFINITY, f64::NAN, f64::INFINITY, f64::NAN];
    let found = super::nuisance(&normal, 1);
    assert!((found[(0, 0)] - 1.0).abs() < 1e-9 && found[(1, 0)] == 0.0, "{found}");
    let forcing = crate::filter::whiten::Forcing {
        first: 0,
        columns: 3,
        step: vec![3.0, 1.0, f32::INFINITY],
        sensor: vec![5.0, 2.0, f32::NAN],
    };
    let cleared = super::clear(&forcing, &found);
    assert_eq!((&cleared.step[..], &cleared.sensor[..]), (&[2.0][..], &[3.0][..]));
}
