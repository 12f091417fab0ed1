use cdpr::effect::EffectSpec;
use cdpr::model_file::Model;

use super::locate::{switched, time_errors, vertex};
use super::look;
use super::segments::{self, Kind, Segments};
use super::times::{in_time, onset, settle_times};
use crate::data::recording::{fitted, record};
use crate::filter::estimate::noise_of_data;
use crate::hypothesis::extension::count_times;
use crate::strategy::candidates::signatures;
use crate::strategy::context::Context;
use crate::strategy::fitted::Evidence;
use crate::strategy::fixture::{begun, evidence, with};
use crate::strategy::standing::Standing;
use crate::weigh::criterion::EVIDENCE;
use crate::weigh::regression::{ladder, rank};
use crate::weigh::signatures::{Source, levels};

fn effect(id: &str, cable: Option<usize>, values: &[f64]) -> EffectSpec {
    EffectSpec::new(id, cable, values).expect("an effect")
}

fn during(effect: &EffectSpec, from: Option<f64>, until: Option<f64>) -> EffectSpec {
    effect.clone().during(from, until).expect("an effect that can begin and end")
}

/// Errors of the times at which an effect begins and ends.
type Times = [Option<f64>; 2];

/// The effects found in the place of `standing`, which is always at work, where `hidden` ones act; and the errors of
/// their times.
fn course_of(standing: &EffectSpec, hidden: &[EffectSpec]) -> Option<(Vec<EffectSpec>, Vec<Times>)> {
    let (train, holdout) = (vec![record(hidden, 60.0, 31)], vec![record(hidden, 50.0, 32)]);
    let noise = noise_of_data(&[&train[..], &holdout[..]].concat());
    let evidence = Evidence::new(train, holdout, noise);
    let begun = Context::begin(&evidence, &Model::default(), 0..0, &|_, _| {});
    let (context, base) = begun.expect("a fit");
    let model = Model { effects: vec![standing.clone()], ..Model::default() };
    let always = context.fit(&model, &base).expect("a fit");
    let found = in_time(&context, &always, 0).expect("a look")?;
    let errors = time_errors(&found.train, &evidence.train, 0, context.policy).expect("errors");
    Some((found.train.model.effects.clone(), errors))
}

#[test]
fn a_wind_that_rises_is_found_with_the_time_at_which_it_does() {
    let wind = effect("steady_wind", None, &[40.0, -25.0, 0.0]);
    let (found, errors) = course_of(&wind, &[during(&wind, Some(31.37), None)]).expect("a course");
    let [one] = &found[..] else { panic!("{found:?}") };
    let (from, error) = (one.from.expect("it begins"), errors[0][0].expect("an error"));
    assert!((from - 31.37).abs() < 3.0 * error && error < 0.5, "{from} {error}");
    assert!(one.until.is_none() && (one.values[0] - 40.0).abs() < 2.0, "{one:?}");
}

#[test]
fn a_gain_that_is_there_for_a_while_is_found_with_both_times() {
    let gain = effect("winch_force_gain", Some(2), &[0.01]);
    let (found, errors) = course_of(&gain, &[during(&gain, Some(18.2), Some(40.6))]).expect("a course");
    let [one] = &found[..] else { panic!("{found:?}") };
    for (time, truth, error) in [(one.from, 18.2, errors[0][0]), (one.until, 40.6, errors[0][1])] {
        let (time, error) = (time.expect("a time"), error.expect("an error"));
        assert!((time - truth).abs() < 3.0 * error && error < 0.5, "{time} of {truth}, {error}");
    }
}

#[test]
fn a_size_that_changes_makes_two_entries_that_follow_one_another() {
    let drag = |size| effect("platform_linear_drag", None, &[size]);
    let hidden = [during(&drag(60.0), None, Some(28.0)), during(&drag(240.0), Some(28.0), None)];
    let (found, _) = course_of(&drag(100.0), &hidden).expect("a course");
    let [before, after] = &found[..] else { panic!("{found:?}") };
    assert_eq!((before.from, before.until, after.until), (None, after.from, None));
    assert!((before.until.expect("an end") - 28.0).abs() < 0.5, "{before:?}");
    assert!((before.values[0] - 60.0).abs() < 6.0 && (after.values[0] - 240.0).abs() < 6.0, "{found:?}");
}

#[test]
fn what_is_always_there_gets_no_times() {
    let drag = effect("platform_linear_drag", None, &[120.0]);
    assert_eq!(course_of(&drag, std::slice::from_ref(&drag)), None);
}

/// The search comes back to the same fit, and times that were not found there would not be found again.
#[test]
fn times_are_looked_for_once_in_each_fit() {
    let wind = effect("steady_wind", None, &[40.0, -25.0, 0.0]);
    let evidence = evidence(&[during(&wind, Some(17.0), None)], 35);
    let (context, standing) = begun(&evidence, &Model::default());
    let standing = with(&context, standing, vec![(wind, Vec::new())]);
    let timeless = Standing { timeless: Some(standing.fit.score), ..standing.clone() };
    for (standing, times) in [(timeless, 0), (standing, 1)] {
        let found = onset(&context, standing, f64::NEG_INFINITY);
        assert_eq!(count_times(found.found(&context)), times);
        assert_eq!(found.timeless.is_some(), times == 0);
    }
}

/// A bias of a few seconds in a minute explains nothing as a bias that is always there.
#[test]
fn a_candidate_is_weighed_in_a_part_of_the_time() {
    let bias = during(&effect("winch_force_bias", Some(2), &[150.0]), Some(24.0), Some(30.0));
    let (train, holdout) =
        (vec![record(std::slice::from_ref(&bias), 60.0, 33)], vec![record(std::slice::from_ref(&bias), 50.0, 34)]);
    let noise = noise_of_data(&[&train[..], &holdout[..]].concat());
    let evidence = Evidence::new(train, holdout, noise);
    let begun = Context::begin(&evidence, &Model::default(), 0..0, &|_, _| {});
    let (context, base) = begun.expect("a fit");
    let standing = Standing::new(&context, base.clone());
    let signatures = signatures(&context, &standing, &base, Source::Catalogue);
    let sizes = ladder(&base.train.randomness);
    let levels = levels(&base.train, &evidence.train, &signatures, &sizes);
    let ranked = rank(&signatures.library, &levels, context.penalty);
    let proposed = look::weighed_in_time(&context, &base.train, &signatures.library, &ranked);
    let (score, best) = &proposed[0];
    assert_eq!(best.cable, Some(2), "{best:?}");
    assert!((best.from.expect("it begins") - 24.0).abs() < 2.0, "{best:?}");
    assert!((best.until.expect("it ends") - 30.0).abs() < 2.0, "{best:?}");
    assert!(*score < base.score - EVIDENCE);
}

/// An inertia from 2.7 to 3.1 s had its name where nothing was missing: the forces of a jerk had changed between two rows. The last third of
/// the recording was held out.
#[test]
fn what_acts_at_no_time_that_was_held_out_must_be_missed_while_training() {
    let shown = |size: f64, held_out: f64| {
        let bias = during(&effect("winch_force_bias", Some(2), &[size]), Some(24.0), Some(30.0));
        let recorded = |duration: f64, seed: u64| vec![record(std::slice::from_ref(&bias), duration, seed)];
        let (train, holdout) = (recorded(40.0, 33), recorded(held_out, 34));
        let noise = noise_of_data(&[&train[..], &holdout[..]].concat());
        let evidence = Evidence::new(train, holdout, noise);
        let begun = Context::begin(&evidence, &Model::default(), 0..0, &|_, _| {});
        let (context, base) = begun.expect("a fit");
        let model = Model { effects: vec![bias.clone()], ..Model::default() };
        let next = context.fit(&model, &base).expect("a fit");
        (evidence.holds_out(&model, &bias), look::shows(&context, &base, &next))
    };
    assert_eq!(shown(150.0, 36.0), (true, true));
    assert_eq!(shown(150.0, 20.0), (false, true));
    assert_eq!(shown(0.3, 20.0), (false, false));
}

/// A limit of the winches that held-out data refuse came back with an end three seconds before these begin.
#[test]
fn what_ends_must_be_shown_to_end_while_training() {
    let bias = effect("winch_force_bias", Some(2), &[150.0]);
    let shown = |until: f64| {
        let evidence = evidence(&[during(&bias, None, Some(until))], 36);
        let (context, base) = begun(&evidence, &Model::default());
        let last = evidence.train[0].time.last().copied().expect("samples");
        let model = Model { effects: vec![during(&bias, None, Some(until.min(last - 0.5)))], ..Model::default() };
        let next = context.fit(&model, &base.fit).expect("a fit");
        look::shows_when(&context, &next).expect("a fit")
    };
    assert_eq!([15.0, 1e3].map(shown), [true, false]);
}

#[test]
fn a_profile_has_its_minimum_between_its_points() {
    let parabola = |time: f64| (time, 3.0 + ((time - 10.3) / 0.8).powi(2));
    let values: Vec<(f64, f64)> = (0..40).map(|k| parabola(6.0 + 0.25 * f64::from(k))).collect();
    let best = (0..values.len()).min_by(|a, b| values[*a].1.total_cmp(&values[*b].1)).expect("points");
    let (time, error) = vertex(&values, best, 1.0);
    assert!((time - 10.3).abs() < 1e-9, "{time}");
    assert!((error.expect("an error") - 0.8).abs() < 0.05, "{error:?}");
    // It does not rise to one side.
    let (_, one_sided) = vertex(&values[..best + 1], best, 1.0);
    assert!((one_sided.expect("an error") - 0.8).abs() < 0.2, "{one_sided:?}");
    assert_eq!(vertex(&values[best - 1..best + 2], 1, 1.0).1, None);
}

#[test]
fn one_time_of_change_is_counted_once() {
    let drag = effect("platform_linear_drag", None, &[100.0]);
    let entries = [during(&drag, None, Some(20.0)), during(&drag, Some(20.0), Some(30.0)), drag.clone()];
    assert_eq!(count_times(&entries[..1]), 1);
    assert_eq!(count_times(&entries), 2);
    assert_eq!(count_times(&[]), 0);
    let model = Model { effects: entries.to_vec(), ..Model::default() };
    assert_eq!(switched(&model, 0), [vec![0, 1]]);
}

/// What is cut and put together again is whole.
#[test]
fn segments_add_up_to_the_whole() {
    let trials = [record(&[], 30.0, 35)];
    let fit = fitted(&[], &trials);
    let wind = effect("steady_wind", None, &[10.0, 0.0, 0.0]);
    let [one, ten] =
        [1, 10].map(|count| Segments::of(&fit, &trials, &wind, segments::even(&trials, count)).along(&[(0, count)]));
    let (one, ten) = (one.expect("a course"), ten.expect("a course"));
    assert!((one.value - ten.value).abs() < 1e-6 * one.value.abs() && (one.sizes[0][0] - ten.sizes[0][0]).abs() < 1e-6);
    assert_eq!(Kind::Between.courses(4), [vec![(1, 2)], vec![(1, 3)], vec![(2, 3)]]);
}

/// An anchor that slips shows at one instant and is followed by forces at random before and after.
#[test]
fn what_is_sudden_is_an_edge() {
    let slip = during(&effect("anchor_offset", Some(1), &[0.08, -0.05]), Some(17.31), None);
    let [quiet, slipped] = [vec![], vec![slip]].map(|effects| {
        let trials = [record(&effects, 30.0, 36), record(&effects, 30.0, 37)];
        let fit = fitted(&[], &trials);
        (segments::even(&trials, 10), segments::edges(&fit, &trials, 10))
    });
    assert_eq!(quiet.0, quiet.1);
    let nearest = slipped.1.iter().map(|edge| (edge - 17.31).abs()).fold(f64::INFINITY, f64::min);
    assert!(nearest <= 2.0 * record(&[], 1.0, 36).interval(), "{:?}", slipped.1);
}

/// Beside a geometry that was off, friction of 180 N was two laws, one until 18.3 s and one from then on, of 180 N each.
#[test]
fn a_law_that_does_not_change_is_one_again() {
    let gain = effect("winch_force_gain", Some(2), &[0.01]);
    let other = effect("platform_linear_drag", None, &[60.0]);
    let evidence = evidence(&[gain.clone(), other.clone()], 85);
    let (context, standing) = begun(&evidence, &Model::default());
    let entries = [during(&gain, Some(17.0), None), other.clone(), during(&gain, None, Some(17.0))];
    let found = entries.into_iter().map(|effect| (effect, Vec::new())).collect();
    let standing = settle_times(&context, with(&context, standing, found));
    let [one, drag] = standing.found(&context) else { panic!("{:?}", standing.found(&context)) };
    assert!(!one.is_switched() && (one.values[0] - 0.01).abs() < 1e-3, "{one:?}");
    assert_eq!((&drag.id, standing.accepted.len()), (&other.id, 2));
}
