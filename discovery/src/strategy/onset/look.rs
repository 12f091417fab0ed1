//! Candidates that do not stand yet, at work for a part of the time.

use std::ops::Range;

use cdpr::effect::EffectSpec;

use super::segments::{self, Kind, Segments, entries, price};
use super::times::{fitted_in_time, onset};
use crate::filter::error::FitError;
use crate::filter::estimate::Fit;
use crate::filter::kalman::Randomness;
use crate::hypothesis::candidates::Library;
use crate::journal::Outcome;
use crate::strategy::context::Context;
use crate::strategy::entrance::enter;
use crate::strategy::fitted::Fitted;
use crate::strategy::standing::Standing;
use crate::weigh::criterion::EVIDENCE;
use crate::weigh::regression::{Scored, ladder};
use crate::weigh::signatures::Source;

/// What stands with its effects at work for a part of the time only, or else with a candidate that is, if one explains more
/// than `gain` and what counts: what always is at work may explain nothing where this one explains all.
pub(crate) fn for_a_while(
    context: &Context<'_>,
    standing: &Standing,
    library: &Library,
    ranked: &[Scored],
    gain: f64,
) -> Result<Option<Standing>, FitError> {
    let fitted = &standing.fit;
    // What stands may begin or end itself; another effect that does would only make up for that.
    let switched = onset(context, standing.clone(), f64::NEG_INFINITY);
    if switched.fit.score < fitted.score {
        return Ok(Some(switched));
    }
    (context.progress)("looking for what begins or ends", 0.2);
    let mut proposed = weighed_in_time(context, &fitted.train, library, ranked);
    // What begins within a segment promises less than it explains once its time is known.
    proposed.retain(|(score, _)| *score < fitted.score - context.policy.rival * gain - EVIDENCE);
    let mut fits = Vec::new();
    for (number, (_, effect)) in proposed.iter().enumerate() {
        let at = fitted.train.model.effects.len();
        let mut model = fitted.train.model.clone();
        model.effects.push(effect.clone());
        let next = fitted_in_time(context, &model, fitted, &[at]);
        let Some(next) = context.journal.tried(effect, "at work for a while only", next) else { continue };
        let change = next.as_ref().map_or(0.0, |next| next.score - fitted.score);
        let next = next.filter(|next| change < -gain - EVIDENCE && shows(context, fitted, next));
        let Some(next) = next else {
            let reason = "at work for a while only, it does not explain enough";
            context.journal.note(effect, Outcome::Refused, change, reason);
            continue;
        };
        match shows_when(context, &next) {
            Ok(true) => fits.push((number, next)),
            Ok(false) => {
                let reason = "the data do not show that it is at work for a while only";
                context.journal.note(effect, Outcome::Refused, change, reason);
            }
            Err(error) => context.journal.failed(effect, "always at work", &error),
        }
    }
    // What latent forces leave alike is told apart by the fits.
    fits.sort_by(|(_, a), (_, b)| a.score.total_cmp(&b.score));
    for (number, next) in fits {
        let others = proposed.iter().enumerate().filter(|(other, _)| *other != number);
        let rivals = others.map(|(_, (_, effect))| effect.clone()).collect();
        let entered = enter(context, standing, next, vec![rivals], Source::Catalogue, "begins or ends")?.entered();
        if let Some(mut entered) = entered {
            entered.begin_in_force(context);
            return Ok(Some(entered));
        }
    }
    Ok(None)
}

/// Whether other data than those by which its last effect was found show what `next` has more than `fitted`: held-out data, where that
/// acts there. Else more must be missing while training than free runs of such data leave: a jerk that the rows of a log did not catch
/// made an inertia from 2.7 to 3.1 s likelier by 239 where nothing was missing.
pub(super) fn shows(context: &Context<'_>, fitted: &Fitted, next: &Fitted) -> bool {
    let model = &next.train.model;
    let held_out = model.effects.last().is_some_and(|law| context.evidence.holds_out(model, law));
    if held_out { next.helps(fitted, context.policy) } else { context.misses_while_training(fitted) }
}

/// Whether the training data show that the last effect of `fitted` begins or ends: always at work it must be less likely by what counts. On
/// a real log a law that held-out data refuse came back with an end three seconds before these begin.
pub(super) fn shows_when(context: &Context<'_>, fitted: &Fitted) -> Result<bool, FitError> {
    let mut always = fitted.train.model.clone();
    if let Some(effect) = always.effects.last_mut() {
        (effect.from, effect.until) = (None, None);
    }
    let always = context.train(&always, &fitted.train, &context.evidence.train, context.policy.rounds, None)?;
    Ok(fitted.score < always.score - EVIDENCE)
}

/// The best candidates as they would be at work for a part of the time, each with the criterion that it promises, the best
/// first.
pub(super) fn weighed_in_time(
    context: &Context<'_>,
    fit: &Fit,
    library: &Library,
    ranked: &[Scored],
) -> Vec<(f64, EffectSpec)> {
    let policy = context.policy;
    let chosen = one_of_each(library, ranked, policy.weighed_in_time);
    let coarse = weigh(context, fit, library, &chosen, policy.few_segments, std::slice::from_ref(&fit.randomness));
    let finalists: Vec<usize> = coarse.iter().take(policy.finalists_in_time).map(|weighed| weighed.candidate).collect();
    let fine = weigh(context, fit, library, &finalists, policy.segments, &ladder(&fit.randomness));
    fine.into_iter().map(|weighed| (weighed.score, weighed.effect)).collect()
}

/// The best course of each of the `chosen` candidates over so many segments, the best candidate first.
fn weigh(
    context: &Context<'_>,
    fit: &Fit,
    library: &Library,
    chosen: &[usize],
    count: usize,
    sizes: &[Randomness],
) -> Vec<Weighed> {
    let (trials, penalty) = (&context.evidence.train, context.penalty);
    let edges = segments::edges(fit, trials, count);
    let count = edges.len() - 1;
    // What the effects of the fit cost, and what the instruments do, is in its score and in theirs.
    let standing = context.score(fit, trials) - fit.minus_two_log_likelihood(trials, &fit.randomness);
    let of = |at: &usize| &library.candidates[*at];
    let part = library.of_columns(&chosen.iter().flat_map(|at| of(at).columns.clone()).collect::<Vec<_>>());
    let mut next = 0;
    let range = |at: &usize| {
        next += of(at).columns.len();
        next - of(at).columns.len()..next
    };
    let ranges: Vec<Range<usize>> = chosen.iter().map(range).collect();
    let all = Segments::of_each(fit, trials, (&part.variations, &part.columns), &ranges, &edges, sizes);
    let best = |(segments, at): (&Segments, &usize)| {
        let parameters = of(at).columns.len() + of(at).tried;
        let weighed = |kind: Kind| {
            let course = segments.best(kind.courses(count))?;
            let cost = price(&course, count, parameters, penalty) + penalty.of(parameters);
            let effect = entries(&course, &edges, |amplitudes| of(at).effect(amplitudes))?.remove(0);
            Some(Weighed { score: standing + course.value + cost, candidate: *at, effect })
        };
        let kinds = [Kind::From, Kind::Until, Kind::Between].into_iter();
        kinds.filter_map(weighed).min_by(|a, b| a.score.total_cmp(&b.score))
    };
    let mut weighed: Vec<Weighed> = all.iter().zip(chosen).filter_map(best).collect();
    weighed.sort_by(|a, b| a.score.total_cmp(&b.score));
    weighed
}

/// A candidate in the best course of time that it may take.
struct Weighed {
    score: f64,
    candidate: usize,
    effect: EffectSpec,
}

/// Of each effect on each cable that can begin and end the best candidate, those first that explain most where they are always
/// at work.
fn one_of_each(library: &Library, ranked: &[Scored], most: usize) -> Vec<usize> {
    let mut chosen: Vec<usize> = Vec::new();
    for scored in ranked {
        let candidate = &library.candidates[scored.candidate];
        let same = |at: &usize| {
            let other = &library.candidates[*at];
            (other.id, other.cable) == (candidate.id, candidate.cable)
        };
        let switchable = || scored.effect(library).is_some_and(|effect| effect.during(Some(0.0), None).is_ok());
        if chosen.len() < most && !chosen.iter().any(same) && switchable() {
            chosen.push(scored.candidate);
        }
    }
    chosen
}
