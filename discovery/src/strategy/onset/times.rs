//! The times between which effects that stand are at work.

use cdpr::model_file::Model;

use super::locate::{locate, switched};
use super::segments::{self, Course, Kind, Segments, entries, multiplied, price};
use crate::filter::error::FitError;
use crate::hypothesis::extension::count_in_use;
use crate::journal::Outcome;
use crate::strategy::context::{self, Context};
use crate::strategy::fitted::Fitted;
use crate::strategy::standing::{Accepted, Standing};
use crate::weigh::criterion::EVIDENCE;

/// What stands with the times between which its effects are at work, where that explains more than this share of the
/// evidence that is left.
pub(crate) fn onset(context: &Context<'_>, mut standing: Standing, share: f64) -> Standing {
    let silent = !standing.fit.train.randomness.has_latents() && standing.fit.gap[0] <= context.policy.nothing_left;
    if silent || standing.accepted.is_empty() || standing.timeless == Some(standing.fit.score) {
        return standing;
    }
    let mut timeless = true;
    (context.progress)("looking when the effects are at work", 0.2);
    for k in 0..standing.accepted.len() {
        let effect = standing.found(context)[k].clone();
        if effect.is_switched() || effect.clone().during(Some(0.0), None).is_err() {
            continue;
        }
        let trials = &context.evidence.train;
        let next = in_time(context, &standing.fit, context.at(k));
        timeless &= !matches!(next, Ok(Some(_)));
        match next {
            Ok(Some(next)) if context::share(standing.fit.score, &next.train, next.score, trials) > share => {
                standing = takes_its_course(context, standing, next, k);
            }
            Ok(_) => {}
            Err(error) => context.journal.failed(&effect, "no times to be at work", &error),
        }
    }
    if timeless {
        standing.timeless = Some(standing.fit.score);
    }
    standing
}

/// What is known of effect `k` once it has the times that it has in `next`.
fn takes_its_course(context: &Context<'_>, standing: Standing, next: Fitted, k: usize) -> Standing {
    let change = next.score - standing.fit.score;
    let more = next.train.model.effects.len() - standing.effects().len();
    let mut standing = standing.changed(next);
    let of_one = &mut standing.accepted[k];
    of_one.delta_bic += change;
    let copy = Accepted::new(of_one.rivals.clone(), of_one.delta_bic, of_one.null_test);
    standing.accepted.extend(std::iter::repeat_n(copy, more));
    context.journal.note(&standing.found(context)[k], Outcome::Extended, change, "begins or ends");
    standing.begin_in_force(context);
    standing
}

/// The model with effect `at` in the best course of time, if it is better by what counts.
pub(super) fn in_time(context: &Context<'_>, fitted: &Fitted, at: usize) -> Result<Option<Fitted>, FitError> {
    let trials = &context.evidence.train;
    let edges = segments::edges(&fitted.train, trials, context.policy.segments);
    let count = edges.len() - 1;
    let segments = Segments::of_standing(&fitted.train, trials, &[at], edges)?;
    let parameters = count_in_use(&fitted.train.model.effects[at]).max(1);
    let Some(always) = segments.along(&[(0, count)]) else { return Ok(None) };
    // A course is chosen among those of its kind by the likelihood, and among the kinds by what they cost.
    let priced = |course: Course| (course.value + price(&course, count, parameters, context.penalty), course);
    let best = Kind::ALL.into_iter().filter_map(|kind| segments.best(kind.courses(count)));
    let mut found: Vec<(f64, Course)> = best.map(priced).collect();
    found.retain(|(score, _)| *score < always.value - EVIDENCE);
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    for (_, course) in found {
        if let Some(next) = with_course(context, fitted, at, &course, &segments.edges)?
            && next.score < fitted.score - EVIDENCE
            && next.helps(fitted, context.policy)
        {
            return Ok(Some(next));
        }
    }
    Ok(None)
}

/// The model with effect `at` in a course of time, fitted, and its times located.
fn with_course(
    context: &Context<'_>,
    fitted: &Fitted,
    at: usize,
    course: &Course,
    edges: &[f64],
) -> Result<Option<Fitted>, FitError> {
    let effect = &fitted.train.model.effects[at];
    let Some(mut entries) = entries(course, edges, |by| Some(multiplied(effect, by[0]))) else { return Ok(None) };
    let mut model = fitted.train.model.clone();
    model.effects[at] = entries.remove(0);
    let mut group = vec![at];
    group.extend(model.effects.len()..model.effects.len() + entries.len());
    model.effects.extend(entries);
    if model.check().is_err() {
        return Ok(None);
    }
    fitted_in_time(context, &model, fitted, &group)
}

/// `model`, whose effects `group` begin or end, fitted and their times located; none where it is no better than `fitted`, which has none
/// of these times: near the right ones it is.
pub(super) fn fitted_in_time(
    context: &Context<'_>,
    model: &Model,
    fitted: &Fitted,
    group: &[usize],
) -> Result<Option<Fitted>, FitError> {
    let (trials, rounds) = (&context.evidence.train, context.policy.rounds);
    let trained = context.train(model, &fitted.train, trials, rounds, None)?;
    if trained.score >= fitted.score {
        return Ok(None);
    }
    located(context, context.verified(trained, fitted)?, group).map(Some)
}

/// `fitted` with the times of the effects `group` where the data say that they are.
pub(super) fn located(context: &Context<'_>, mut fitted: Fitted, group: &[usize]) -> Result<Fitted, FitError> {
    for _ in 0..context.policy.most_locations {
        let found = locate(&fitted.train, &context.evidence.train, group, context.policy)?;
        let mut model = fitted.train.model.clone();
        for at in group {
            let effect = &mut model.effects[*at];
            for time in [&mut effect.from, &mut effect.until].into_iter().flatten() {
                if let Some((_, Some(located))) = found.iter().find(|(before, _)| before == time) {
                    *time = located.time;
                }
            }
        }
        let moved = found.iter().any(|(before, located)| {
            located.is_some_and(|located| (located.time - before).abs() > context.policy.located * located.error)
        });
        if !moved || model.check().is_err() {
            break;
        }
        let next = context.fit(&model, &fitted)?;
        if next.score >= fitted.score {
            break;
        }
        fitted = next;
    }
    Ok(fitted)
}

/// What stands with its effects always at work again where that is as good, those that change their size with one size; and
/// else with their times located beside all that was found since.
pub(crate) fn settle_times(context: &Context<'_>, mut standing: Standing) -> Standing {
    let mut settled = 0;
    while let Some(group) = switched(&standing.fit.train.model, context.given).into_iter().nth(settled) {
        if let Some(always) = always_at_work(context, &standing.fit, &group) {
            // It is in no group any more.
            standing = with_one_of(context, standing.changed(always), &group);
            continue;
        }
        match located(context, standing.fit.clone(), &group) {
            Ok(located) => standing.fit = located,
            Err(error) => {
                context.journal.failed(&standing.effects()[group[0]], "its times cannot be located", &error);
            }
        }
        settled += 1;
    }
    standing.begin_in_force(context);
    standing
}

/// What is known of the effects, of the first alone of those that were a `group`.
fn with_one_of(context: &Context<'_>, mut standing: Standing, group: &[usize]) -> Standing {
    let known = std::mem::take(&mut standing.accepted).into_iter().enumerate();
    standing.accepted = known.filter(|(k, _)| !group[1..].contains(&context.at(*k))).map(|(_, known)| known).collect();
    standing
}

/// `fitted` with the first of the effects `group`, which are one law at different times, always at work in the place of all, if
/// that is as good.
fn always_at_work(context: &Context<'_>, fitted: &Fitted, group: &[usize]) -> Option<Fitted> {
    let mut model = fitted.train.model.clone();
    (model.effects[group[0]].from, model.effects[group[0]].until) = (None, None);
    for at in group[1..].iter().rev() {
        model.effects.remove(*at);
    }
    let effect = &model.effects[group[0]];
    let always = context.fit_without(&model, fitted, context.policy.rounds);
    let always = context.journal.tried(effect, "always at work", always)?;
    let as_good = always.score < fitted.score + EVIDENCE;
    if !as_good {
        return None;
    }
    let change = always.score - fitted.score;
    context.journal.note(&always.train.model.effects[group[0]], Outcome::Simplified, change, "always at work");
    Some(always)
}
