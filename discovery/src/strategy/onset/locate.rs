//! The times at which effects begin and end, located on shorter and shorter segments of time.

use cdpr::effect::EffectSpec;
use cdpr::model_file::Model;

use super::segments::{Course, Segments, span};
use crate::data::Trial;
use crate::filter::error::FitError;
use crate::filter::estimate::Fit;
use crate::strategy::policy::Policy;

/// The effects of `model` from index `first` on that begin or end, those together that are one which changes its size.
pub(super) fn switched(model: &Model, first: usize) -> Vec<Vec<usize>> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for at in (first..model.effects.len()).filter(|at| model.effects[*at].is_switched()) {
        let one = |other: &Vec<usize>| {
            let (a, b) = (&model.effects[other[0]], &model.effects[at]);
            (&a.id, a.cable, &a.expression) == (&b.id, b.cable, &b.expression)
        };
        match groups.iter_mut().find(|group| one(group)) {
            Some(group) => group.push(at),
            None => groups.push(vec![at]),
        }
    }
    groups
}

/// A time of an effect, located.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Located {
    /// (s)
    pub(crate) time: f64,
    /// Its standard error (s).
    pub(crate) error: f64,
}

/// The times of the effects `at` located on shorter and shorter segments, in the order in which they come; `None` where the
/// data do not tell one.
pub(super) fn locate(
    fit: &Fit,
    trials: &[Trial],
    at: &[usize],
    policy: &Policy,
) -> Result<Vec<(f64, Option<Located>)>, FitError> {
    let effects: Vec<&EffectSpec> = at.iter().map(|at| &fit.model.effects[*at]).collect();
    let mut times: Vec<f64> = effects.iter().flat_map(|e| [e.from, e.until]).flatten().collect();
    times.sort_by(f64::total_cmp);
    times.dedup();
    let mut out = Vec::new();
    for time in &times {
        out.push((*time, locate_one(fit, trials, at, (&times, *time), policy)?));
    }
    Ok(out)
}

/// One time of all `times` of the effects `at`, the others as they are.
fn locate_one(
    fit: &Fit,
    trials: &[Trial],
    at: &[usize],
    (times, time): (&[f64], f64),
    policy: &Policy,
) -> Result<Option<Located>, FitError> {
    let (first, last) = span(trials);
    let shortest = trials.iter().map(Trial::interval).fold(f64::INFINITY, f64::min);
    // A stretch shorter than a segment was not weighed, and where the recordings begin it is the filter's own transient.
    let segment = (last - first) / policy.segments as f64;
    let mut step = segment / 4.0;
    let mut now = time;
    loop {
        let fine = (0..=2 * policy.around).map(|k| now + step * (k as f64 - policy.around as f64));
        let inside = |edge: &f64| {
            let beyond = |other: &f64| *other != time && (*other - now) * (*other - edge) <= 0.0;
            *edge >= first + segment && *edge <= last - segment && !times.iter().any(beyond)
        };
        let fine: Vec<f64> = fine.filter(inside).collect();
        let mut edges = [&fine[..], &[first, last]].concat();
        edges.extend(times.iter().filter(|other| **other != time));
        edges.sort_by(f64::total_cmp);
        let place = |wanted: f64| edges.iter().position(|edge| *edge == wanted).unwrap_or_default();
        let course = |moved: f64| -> Vec<(usize, usize)> {
            let end =
                |edge: Option<f64>, or: f64| place(edge.map_or(or, |edge| if edge == time { moved } else { edge }));
            let effects = at.iter().map(|at| &fit.model.effects[*at]);
            effects.map(|e| (end(e.from, first), end(e.until, last))).collect()
        };
        let segments = Segments::of_standing(fit, trials, at, edges.clone())?;
        let courses: Vec<(f64, Course)> =
            fine.iter().filter_map(|edge| Some((*edge, segments.along(&course(*edge))?))).collect();
        let values: Vec<(f64, f64)> = courses.iter().map(|(edge, course)| (*edge, course.value)).collect();
        let Some(best) = (0..values.len()).min_by(|a, b| values[*a].1.total_cmp(&values[*b].1)) else {
            return Ok(None);
        };
        let (vertex, error) = vertex(&values, best, courses[best].1.left.max(1.0));
        now = vertex;
        // Down to where its error is some segments wide, or a sample is left to look at.
        if error.is_some_and(|error| error > 1.5 * step) || step <= shortest {
            let error = error.unwrap_or(f64::INFINITY).max(shortest / 12.0_f64.sqrt());
            return Ok(error.is_finite().then_some(Located { time: now, error }));
        }
        step = (step / 4.0).max(shortest);
    }
}

/// Where a profile of `-2 log L` has its minimum, between its points, and half the width over which it is within
/// `spread` of it: one standard error. None where it does not rise by that on either side.
pub(super) fn vertex(values: &[(f64, f64)], best: usize, spread: f64) -> (f64, Option<f64>) {
    let (time, least) = values[best];
    let crossing = |points: &mut dyn Iterator<Item = &(f64, f64)>| {
        let mut before = (time, least);
        for point in points {
            if point.1 > least + spread {
                let share = (least + spread - before.1) / (point.1 - before.1);
                return Some(before.0 + share * (point.0 - before.0));
            }
            before = *point;
        }
        None
    };
    let below = crossing(&mut values[..best].iter().rev());
    let above = crossing(&mut values[best + 1..].iter());
    let error = match (below, above) {
        (Some(below), Some(above)) => Some(0.5 * (above - below)),
        (one, other) => one.or(other).map(|edge| (edge - time).abs()),
    };
    let turn = || {
        let [(_, left), _, (right_time, right)] = values.get(best.checked_sub(1)?..best + 2)? else { return None };
        let bend = left - 2.0 * least + right;
        (bend > 0.0).then(|| time + 0.5 * (right_time - time) * (left - right) / bend)
    };
    (turn().unwrap_or(time), error)
}

/// The standard errors (s) of the times that effects of a fit begin and end at, by effect from index `first` on.
pub(crate) fn time_errors(
    fit: &Fit,
    trials: &[Trial],
    first: usize,
    policy: &Policy,
) -> Result<Vec<[Option<f64>; 2]>, FitError> {
    let mut out = vec![[None; 2]; fit.model.effects.len()];
    for group in switched(&fit.model, first) {
        let located = locate(fit, trials, &group, policy)?;
        let error = |time: Option<f64>| {
            let (_, found) = located.iter().find(|(known, _)| Some(*known) == time)?;
            found.map(|found| found.error)
        };
        for at in group {
            let effect = &fit.model.effects[at];
            out[at] = [error(effect.from), error(effect.until)];
        }
    }
    Ok(out.split_off(first))
}
