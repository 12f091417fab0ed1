//! Motions against their limits, and expected differences against laws of which the answer is known, and against fits.

use cdpr::effect::EffectSpec;
use cdpr::model_file::Model;

use super::apart::{Bench, Pair};
use super::drive::drive;
use super::motion::{Family, GENES, Motion};
use super::question::{Instrument, Open, Question};
use super::*;
use crate::data::{Channel, Trial};
use crate::filter::estimate::noise_of_data;
use crate::strategy::context::Context;
use crate::strategy::fitted::Evidence;

const LIMITS: &str = "x = [-10, 12]\ny = [-8, 8]\nphi = [-0.05, 0.05]\nspeed = 0.8\nangular_speed = 0.01\n\
                      tension = [5000, 30000]\nduration = 60\ninterval = 0.1\n";

fn limits(text: &str) -> Limits {
    Limits::from_toml(text).expect("limits")
}

fn law(id: &str, cable: Option<usize>, values: &[f64]) -> EffectSpec {
    EffectSpec::new(id, cable, values).expect("an effect")
}

/// The default robot with pose and unstretched lengths measured, and these laws in question.
fn question(laws: &[EffectSpec]) -> Question {
    let base = Model::default();
    let cables = base.parameters.cables();
    let pose = (0..3).map(|axis| (Channel::Pose(axis), [2e-3, 2e-3, 5e-5][axis]));
    let lengths = (0..cables).map(|i| (Channel::UnstretchedLength(i), 2e-3));
    let instrument = |(channel, white)| Instrument { channel, white, memories: Vec::new() };
    let open = Open { base, given: 0, laws: laws.to_vec(), now: vec![0.0; laws.len()] };
    let instruments = pose.chain(lengths).map(instrument).collect();
    Question {
        verdict: "ambiguous".to_owned(),
        open: vec![open],
        limits: Vec::new(),
        given: 0,
        instruments,
        force_error: 0.0,
        jitter: 0.0,
    }
}

fn genes(seed: u64) -> Vec<f64> {
    let mut random = fastrand::Rng::with_seed(seed);
    (0..GENES).map(|_| random.f64()).collect()
}

/// Middle and extent of a coordinate are its last two numbers.
fn with_extent(mut genes: Vec<f64>, coordinate: usize, extent: f64) -> Vec<f64> {
    let numbers = (GENES - 1) / 4;
    genes[(coordinate + 1) * numbers - 2] = 0.5;
    genes[(coordinate + 1) * numbers - 1] = extent;
    genes
}

#[test]
fn no_motion_leaves_its_limits() {
    for text in [LIMITS.to_owned(), LIMITS.replace("speed = 0.8", "speed = 0.05") + "start = [11, -7.5, 0.04]\n"] {
        let limits = limits(&text);
        let family = Family::new(&Model::default(), &limits).expect("motions");
        for seed in 0..40 {
            let Ok(motion) = family.motion(&genes(seed)) else { continue };
            for k in 0..=6000 {
                let [pose, twist, _] = motion.at(f64::from(k) * 0.01);
                for (value, [low, high]) in pose.iter().zip(limits.pose) {
                    assert!((low - 1e-9..=high + 1e-9).contains(value), "{seed}: {pose:?}");
                }
                assert!(twist[0].hypot(twist[1]) <= limits.speed && twist[2].abs() <= limits.angular_speed, "{seed}");
            }
        }
    }
}

#[test]
fn a_motion_begins_and_ends_at_rest_at_its_start_and_its_rates_are_its_own() {
    let family = Family::new(&Model::default(), &limits(&(LIMITS.to_owned() + "start = [1, 2, 0.01]\n"))).unwrap();
    let motion = family.motion(&genes(3)).unwrap();
    for time in [0.0, 60.0] {
        let [pose, twist, acceleration] = motion.at(time);
        assert!(pose.iter().zip([1.0, 2.0, 0.01]).all(|(a, b)| (a - b).abs() < 1e-12), "{pose:?}");
        assert!(twist.iter().chain(&acceleration).all(|v| v.abs() < 1e-12), "{twist:?} {acceleration:?}");
    }
    let h = 1e-4;
    for time in [0.7, 5.0, 31.0, 58.5] {
        let [before, now, after] = [time - h, time, time + h].map(|t| motion.at(t));
        for order in 0..2 {
            for axis in 0..3 {
                let slope = (after[order][axis] - before[order][axis]) / (2.0 * h);
                assert!((slope - now[order + 1][axis]).abs() < 1e-5, "{time} {order} {axis}");
            }
        }
    }
}

#[test]
fn a_driven_motion_stays_near_it_with_tensions_within_their_limits() {
    let limits = limits(LIMITS);
    let model = Model::default();
    let family = Family::new(&model, &limits).unwrap();
    for seed in [1, 2, 3] {
        let motion = family.motion(&with_extent(genes(seed), 3, 1.0)).unwrap();
        let driven = drive(&model, &motion, &[Channel::Pose(0), Channel::Pose(1)], limits.interval).unwrap();
        let [low, high] = limits.tension;
        assert!(driven.tension.iter().flatten().all(|t| (low..=high).contains(t)), "{seed}");
        for (time, shown) in driven.trial.time.iter().zip(&driven.trial.measured) {
            let [wanted, ..] = motion.at(*time);
            assert!((shown[0] - wanted[0]).hypot(shown[1] - wanted[1]) < 0.5, "{seed}: {time} s");
        }
    }
}

fn pairs(question: &Question, limits: &Limits, motion: &Motion) -> Vec<Pair> {
    Bench::new(question, limits).pairs(motion, limits.interval).expect("a motion that can be driven")
}

/// A gain and a bias of a winch differ in what the force differs from its mean.
#[test]
fn a_gain_and_a_bias_are_told_apart_by_the_pretension() {
    // About the start, where the platform can stay.
    let limits = limits(&LIMITS.replace("[-10, 12]", "[-10, 10]"));
    let family = Family::new(&Model::default(), &limits).unwrap();
    let question = question(&[law("winch_force_gain", Some(2), &[3e-3]), law("winch_force_bias", Some(2), &[50.0])]);
    let still = with_extent(with_extent(with_extent(genes(5), 0, 0.0), 1, 0.0), 2, 0.0);
    let at = |extent: f64| pairs(&question, &limits, &family.motion(&with_extent(still.clone(), 3, extent)).unwrap());
    let (constant, swinging) = (at(0.0), at(1.0));
    for (constant, swinging) in constant.iter().zip(&swinging) {
        assert!(constant.reach() < 0.5 && swinging.reach() > 2.0, "{constant:?} {swinging:?}");
    }
}

#[test]
fn a_shift_of_the_pose_is_never_told_from_one_of_all_anchors() {
    let limits = limits(LIMITS);
    let family = Family::new(&Model::default(), &limits).unwrap();
    let twins = [law("pose_sensor_bias", None, &[0.06, -0.03, 0.0]), law("anchor_offset", None, &[0.06, -0.03])];
    let pairs = pairs(&question(&twins), &limits, &family.motion(&genes(2)).unwrap());
    // The bias has an angle that the anchors have not, here of size zero.
    assert!(pairs.iter().all(|pair| pair.reach() < 0.3), "{pairs:?}");
}

/// What is expected without any fit is what fits of both laws to a recording of the motion come to.
#[test]
fn a_planned_difference_is_that_of_fits() {
    let limits = limits(LIMITS);
    let family = Family::new(&Model::default(), &limits).unwrap();
    let [linear, quadratic] =
        [law("platform_linear_drag", None, &[12.0]), law("platform_quadratic_drag", None, &[25.0])];
    let question = question(&[linear.clone(), quadratic.clone()]);
    let motion = family.motion(&genes(8)).unwrap();
    let planned = &pairs(&question, &limits, &motion)[0];
    let model = Model { effects: vec![linear.clone()], ..Model::default() };
    let bench = Bench::new(&question, &limits);
    let recorded = |seed: u64| -> Trial {
        let mut trial = drive(&model, &motion, &bench.channels(), limits.interval).unwrap().trial;
        bench.add_noise(&mut trial, limits.interval, seed);
        trial
    };
    let (train, holdout) = (vec![recorded(11)], vec![recorded(12)]);
    let noise = noise_of_data(&[&train[..], &holdout[..]].concat());
    let evidence = Evidence::new(train, holdout, noise);
    let begun = Context::begin(&evidence, &Model::default(), 0..0, &|_, _| {});
    let (context, base) = begun.expect("a fit");
    let fitted = |law: &EffectSpec| {
        let model = Model { effects: vec![law.clone()], ..Model::default() };
        let fit = context.fit(&model, &base).expect("a fit").train;
        fit.minus_two_log_likelihood(&evidence.train, &fit.randomness)
    };
    let found = fitted(&quadratic) - fitted(&linear);
    // Of noise it scatters by twice its root.
    let scatter = 2.0 * planned.difference.sqrt();
    assert!(planned.difference > 30.0, "{planned:?}");
    assert!((found - planned.difference).abs() < 3.0 * scatter + 0.2 * planned.difference, "{found} {planned:?}");
}

/// At half the speed drag is half as large all along.
#[test]
fn the_detection_limit_of_drag_falls_with_the_speed() {
    let question = question(&[]);
    let model = Model::default();
    let merit = |speed: &str| {
        let limits = limits(&LIMITS.replace("speed = 0.8", speed));
        let motion = Family::new(&model, &limits).unwrap().motion(&with_extent(genes(8), 2, 0.0)).unwrap();
        let bench = Bench::new(&question, &limits);
        let lower = Lower { bench: &bench, model: &model, given: 0, id: "platform_linear_drag", cable: None };
        lower.merit(&motion, limits.interval).unwrap()
    };
    let gained = merit("speed = 0.8") - merit("speed = 0.4");
    assert!((gained - 2.0_f64.ln()).abs() < 0.1, "{gained}");
}

#[test]
fn limits_that_make_no_sense_are_refused_with_their_line() {
    for (change, part) in [
        (("speed = 0.8", "speed = -1"), "line 4: `speed` is -1"),
        (("x = [-10, 12]", "x = [12, -10]"), "line 1: `x` is [12, -10]"),
        (("tension = [5000, 30000]", "tension = [-5, 30000]"), "line 6: `tension` is [-5, 30000]"),
        (("interval = 0.1", "interval = 1.0"), "60 samples, expected 200"),
        (("interval = 0.1", "interval = 0.1\nfastest = 5"), "`fastest` is 5 Hz, expected"),
        (("interval = 0.1", "interval = 0.1\nstart = [0, 9, 0]"), "`start`: y is 9, outside the limits of y, -8 to 8"),
        (("interval = 0.1", "interval = 0.1\nspede = 1"), "unknown field `spede`"),
        (("duration = 60\n", ""), "missing field `duration`"),
        (("interval = 0.1", "interval = 0.1\n[noise]\nx = 0"), "`x` is 0, expected a number above zero"),
    ] {
        let text = LIMITS.replace(change.0, change.1);
        let error = Limits::from_toml(&text).unwrap_err().to_string();
        assert!(error.contains(part), "{change:?}: {error}");
    }
}

#[test]
fn a_start_outside_the_limits_is_refused() {
    let mut model = Model::default();
    model.start.pose = [40.0, 0.0, 0.0];
    let error = Family::new(&model, &limits(LIMITS)).err().expect("refused").to_string();
    assert!(error.contains("the model's start pose: x is 40, outside the limits of x, -10 to 12"), "{error}");
    let far = limits(&LIMITS.replace("[-10, 12]", "[-10, 1200]"));
    let error = Family::new(&Model::default(), &far).err().expect("refused").to_string();
    assert!(error.contains("the corner x = 1200"), "{error}");
}

/// A discovery that left drag open, of a model with another effect given.
fn discovery(effects: &str) -> String {
    format!(
        r#"{{"schema": 1, "verdict": "ambiguous", "effects": [{effects}], "terms": [],
        "instruments": {{"channels": {{"x": {{"white": 0.002, "coloured": null, "time_constant": null, "drift": null}}}},
        "winch_force_error": null, "stamp_jitter": {{"value": 0.001, "standard_error": null}}}}}}"#
    )
}

const DRAG: &str = r#"{"id": "platform_linear_drag", "cable": null, "delta_bic": -2000.0,
    "parameters": {"coefficient": {"value": 6.25, "standard_error": 0.1, "unit": "N.s/m"}},
    "indistinguishable_from": [{"id": "winch_viscous_friction", "cable": null, "delta_bic": 8.5,
    "parameters": {"coefficient": {"value": 3.0, "standard_error": null, "unit": "N.s/m"}}}]}"#;

#[test]
fn rivals_are_built_again_from_the_discovery() {
    let mass = law("platform_mass", None, &[20.0]);
    let model = Model { effects: vec![mass.clone(), law("platform_linear_drag", None, &[6.25])], ..Model::default() };
    let limits = limits(&(LIMITS.to_owned() + "[noise]\nunstretched_length = 0.001\n"));
    let question = Question::read(&discovery(DRAG), &model, &limits).unwrap();
    let [open] = &question.open[..] else { panic!("{question:?}") };
    assert_eq!((&open.base.effects[..], open.given), (&[mass][..], 1));
    assert_eq!(open.laws, [law("platform_linear_drag", None, &[6.25]), law("winch_viscous_friction", None, &[3.0])]);
    assert_eq!((&open.now[..], question.jitter), (&[0.0, 8.5][..], 0.001));
    assert_eq!(question.instruments.len(), 1 + model.parameters.cables(), "x, and the lengths that the limits add");
    // What the model got without a name is no given one.
    let candidate = r#""candidates": [{"id": "platform_mass", "cable": null, "delta_bic": -40.0, "parameters": {"mass": {"value": 20.0}}}],"#;
    let text = discovery(DRAG).replace(r#""terms""#, &format!(r#"{candidate} "terms""#));
    assert_eq!(Question::read(&text, &model, &limits).unwrap().open[0].given, 0);
}

#[test]
fn what_is_no_open_discovery_of_the_model_is_refused() {
    let with_drag = Model { effects: vec![law("platform_linear_drag", None, &[6.25])], ..Model::default() };
    let limits = limits(LIMITS);
    let error = |text: &str, model: &Model| Question::read(text, model, &limits).unwrap_err();
    let named = discovery(DRAG).replace("indistinguishable_from", "worse").replace("ambiguous", "named");
    let plan = |aim: &Aim| plan(&named, &with_drag, &limits, aim, &|_, _| {}).unwrap_err();
    assert!(matches!(plan(&Aim::TellApart), PlanError::NothingOpen(verdict) if verdict == "named"));
    let lower = plan(&Aim::Lower { id: "platform_mass".to_owned(), cable: None }).to_string();
    assert!(lower.contains("no detection limit of `platform_mass`"), "{lower}");
    for (text, model, part) in [
        ("x = 3", &with_drag, "expected a discovery.json"),
        (&discovery(DRAG)[..200], &with_drag, "expected a discovery.json"),
        (&discovery(DRAG).replace("\"schema\": 1", "\"schema\": 2"), &with_drag, "schema 2, expected 1"),
        (&discovery(DRAG).replace("winch_viscous", "winch_vicious"), &with_drag, "no effect has this id"),
        (&discovery(DRAG), &Model::default(), "expected the model.toml that was written beside it"),
        (&discovery(DRAG).replace("6.25", "6.5"), &with_drag, "coefficient = 6.5, which the model does not have"),
        (&discovery(DRAG).replace(r#""x""#, r#""tension[9]""#), &with_drag, "`tension[9]` is no channel"),
    ] {
        let error = error(text, model).to_string();
        assert!(error.contains(part), "{part}: {error}");
    }
}
