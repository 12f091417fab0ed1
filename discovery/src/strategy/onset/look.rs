//! Candidates that do not stand yet, at work for a part of the time.

use std::ops::Range;

use cdpr::effect::EffectSpec;

use super::SEGMENTS;
use super::segments::{self, Kind, Segments, entries, price};
use crate::filter::estimate::{Fit, FitError};
use crate::filter::kalman::Randomness;
use crate::hypothesis::candidates::Library;
use crate::journal::Outcome;
use crate::strategy::entrance::{Answer, Source};
use crate::strategy::fitted::Fitted;
use crate::strategy::round::effect_of;
use crate::strategy::search::{EVIDENCE, ROUNDS, Search};
use crate::weigh::regression::{Scored, ladder};

/// Segments in which candidates are weighed first, how many of these are, and how many of them go on.
const FEW_SEGMENTS: usize = 10;
const WEIGHED: usize = 30;
const FINALISTS: usize = 3;

impl Search<'_> {
    /// `fitted` with what stands at work for a part of the time only, or else a candidate, if one explains more than `gain` and
    /// what counts: what always is at work may explain nothing where this one explains all.
    pub(crate) fn for_a_while(
        &mut self,
        fitted: &Fitted,
        library: &Library,
        ranked: &[Scored],
        gain: f64,
    ) -> Result<Option<Fitted>, FitError> {
        // What stands may begin or end itself; another effect that does would only make up for that.
        let standing = self.onset(fitted.clone(), f64::NEG_INFINITY);
        if standing.score < fitted.score {
            return Ok(Some(standing));
        }
        (self.progress)("looking for what begins or ends", 0.2);
        let mut proposed = self.weighed_in_time(&fitted.train, library, ranked);
        proposed.retain(|(score, _)| *score < fitted.score - gain - EVIDENCE);
        let mut fits = Vec::new();
        for (k, (_, effect)) in proposed.iter().enumerate() {
            let at = fitted.train.model.effects.len();
            let mut model = fitted.train.model.clone();
            model.effects.push(effect.clone());
            match self.fit(&model, fitted, ROUNDS).and_then(|next| self.located(next, &[at])) {
                Ok(next) if next.score < fitted.score - gain - EVIDENCE && Self::helps(fitted, &next) => {
                    fits.push((k, next));
                }
                Ok(next) => {
                    let change = next.score - fitted.score;
                    self.journal.note(
                        effect,
                        Outcome::Refused,
                        change,
                        "at work for a while only, it does not explain enough",
                    );
                }
                Err(error) => {
                    self.journal.failed(effect, "at work for a while only", &error);
                }
            }
        }
        // What latent forces leave alike is told apart by the fits.
        fits.sort_by(|(_, a), (_, b)| a.score.total_cmp(&b.score));
        for (k, next) in fits {
            let others = proposed.iter().enumerate().filter(|(other, _)| *other != k).map(|(_, (_, effect))| effect);
            let rivals = others.cloned().collect();
            if self.enter(fitted, &next, vec![rivals], Source::Catalogue, "begins or ends")? == Answer::Enters {
                self.begin_in_force(&next.train.model);
                return Ok(Some(next));
            }
        }
        Ok(None)
    }

    /// The best candidates as they would be at work for a part of the time, each with the criterion that it promises, the best
    /// first.
    pub(super) fn weighed_in_time(&self, fit: &Fit, library: &Library, ranked: &[Scored]) -> Vec<(f64, EffectSpec)> {
        let chosen = one_of_each(library, ranked);
        let coarse = self.weigh(fit, library, &chosen, FEW_SEGMENTS, std::slice::from_ref(&fit.randomness));
        let finalists: Vec<usize> = coarse.iter().take(FINALISTS).map(|weighed| weighed.candidate).collect();
        let fine = self.weigh(fit, library, &finalists, SEGMENTS, &ladder(&fit.randomness));
        fine.into_iter().map(|weighed| (weighed.score, weighed.effect)).collect()
    }

    /// The best course of each of the `chosen` candidates over so many segments, the best candidate first.
    fn weigh(
        &self,
        fit: &Fit,
        library: &Library,
        chosen: &[usize],
        count: usize,
        sizes: &[Randomness],
    ) -> Vec<Weighed> {
        let trials = &self.evidence.train;
        let edges = segments::edges(fit, trials, count);
        let count = edges.len() - 1;
        // What the effects of the fit cost, and what the instruments do, is in its score and in theirs.
        let standing = self.score(fit, trials) - fit.minus_two_log_likelihood(trials, &fit.randomness);
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
                let cost = price(&course, count, parameters, self.penalty) + self.penalty.of(parameters);
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
}

/// A candidate in the best course of time that it may take.
struct Weighed {
    score: f64,
    candidate: usize,
    effect: EffectSpec,
}

/// Of each effect on each cable that can begin and end the best candidate, those first that explain most where they are always
/// at work.
fn one_of_each(library: &Library, ranked: &[Scored]) -> Vec<usize> {
    let mut chosen: Vec<usize> = Vec::new();
    for scored in ranked {
        let candidate = &library.candidates[scored.candidate];
        let same = |at: &usize| {
            let other = &library.candidates[*at];
            (other.id, other.cable) == (candidate.id, candidate.cable)
        };
        let switchable = || effect_of(library, scored).is_some_and(|effect| effect.during(Some(0.0), None).is_ok());
        if chosen.len() < WEIGHED && !chosen.iter().any(same) && switchable() {
            chosen.push(scored.candidate);
        }
    }
    chosen
}
