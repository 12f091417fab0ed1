//! When an effect begins and ends: a fault comes while one records.
//!
//! Where an effect stands and something is left, its signature is cut into segments of time, and every course is weighed that
//! it may have taken: at work from a time on, until a time, between two, or with another size from a time on (generalised
//! likelihood ratio: A. S. Willsky and H. L. Jones, IEEE Trans. Automatic Control 21 (1976), 108). The best is fitted in full,
//! its times located on ever shorter segments. Times are on the clock of each trial and the same in all of them; the
//! held-out trials say whether that is so.

mod locate;
mod look;
mod segments;
#[cfg(test)]
mod tests;

use self::locate::{locate, switched};
use self::segments::{Course, Kind, Segments, entries, multiplied, price};
use crate::filter::estimate::FitError;
use crate::hypothesis::extension::count_in_use;
use crate::journal::Outcome;
use crate::strategy::fitted::Fitted;
use crate::strategy::search::{EVIDENCE, NOTHING_LEFT, ROUNDS, Search, Taken};

pub(crate) use self::locate::time_errors;

/// Segments into which the recordings are cut.
const SEGMENTS: usize = 40;
/// Most times that an estimate is located anew.
const MOST_LOCATIONS: usize = 6;
/// Moves of a time, in its standard errors, below which it has been located.
const LOCATED: f64 = 0.5;

impl Search<'_> {
    /// `fitted` with the times between which its effects are at work, where that explains more than this share of the
    /// evidence that is left.
    pub(crate) fn onset(&mut self, mut fitted: Fitted, share: f64) -> Fitted {
        let silent = !fitted.train.randomness.has_latents() && fitted.gap[0] <= NOTHING_LEFT;
        if silent || self.taken.is_empty() {
            return fitted;
        }
        (self.progress)("looking when the effects are at work", 0.2);
        for at in self.given..fitted.train.model.effects.len() {
            let effect = fitted.train.model.effects[at].clone();
            if effect.is_switched() || effect.clone().during(Some(0.0), None).is_err() {
                continue;
            }
            match self.in_time(&fitted, at) {
                Ok(Some(next)) if self.share(fitted.score, next.score, &self.evidence.train) > share => {
                    fitted = self.takes_its_course(fitted, next, at);
                }
                Ok(_) => {}
                Err(error) => self.journal.failed(&effect, "no times to be at work", &error),
            }
        }
        fitted
    }

    /// What is known of effect `at` once it has the times that it has in `next`.
    fn takes_its_course(&mut self, fitted: Fitted, next: Fitted, at: usize) -> Fitted {
        let change = next.score - fitted.score;
        let more = next.train.model.effects.len() - fitted.train.model.effects.len();
        self.taken.iter_mut().for_each(Taken::changed);
        let of_one = &mut self.taken[at - self.given];
        of_one.delta_bic += change;
        let copy = Taken::new(of_one.rivals.clone(), of_one.delta_bic, of_one.null_test);
        self.taken.extend(std::iter::repeat_n(copy, more));
        self.journal.note(&next.train.model.effects[at].clone(), Outcome::Extended, change, "begins or ends");
        self.begin_in_force(&next.train.model);
        next
    }

    /// The model with effect `at` in the best course of time, if it is better by what counts.
    fn in_time(&self, fitted: &Fitted, at: usize) -> Result<Option<Fitted>, FitError> {
        let trials = &self.evidence.train;
        let edges = segments::edges(&fitted.train, trials, SEGMENTS);
        let count = edges.len() - 1;
        let segments = Segments::of_standing(&fitted.train, trials, &[at], edges)?;
        let parameters = count_in_use(&fitted.train.model.effects[at]).max(1);
        let Some(always) = segments.along(&[(0, count)]) else { return Ok(None) };
        // A course is chosen among those of its kind by the likelihood, and among the kinds by what they cost.
        let priced = |course: Course| (course.value + price(&course, count, parameters, self.penalty), course);
        let best = Kind::ALL.into_iter().filter_map(|kind| segments.best(kind.courses(count)));
        let mut found: Vec<(f64, Course)> = best.map(priced).collect();
        found.retain(|(score, _)| *score < always.value - EVIDENCE);
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (_, course) in found {
            if let Some(next) = self.with_course(fitted, at, &course, &segments.edges)?
                && next.score < fitted.score - EVIDENCE
                && Self::helps(fitted, &next)
            {
                return Ok(Some(next));
            }
        }
        Ok(None)
    }

    /// The model with effect `at` in a course of time, fitted, and its times located.
    fn with_course(
        &self,
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
        let fit = self.fit(&model, fitted, ROUNDS)?;
        self.located(fit, &group).map(Some)
    }

    /// `fitted` with the times of the effects `group` where the data say that they are.
    fn located(&self, mut fitted: Fitted, group: &[usize]) -> Result<Fitted, FitError> {
        for _ in 0..MOST_LOCATIONS {
            let found = locate(&fitted.train, &self.evidence.train, group)?;
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
                located.is_some_and(|located| (located.time - before).abs() > LOCATED * located.error)
            });
            if !moved || model.check().is_err() {
                break;
            }
            let next = self.fit(&model, &fitted, ROUNDS)?;
            if next.score >= fitted.score {
                break;
            }
            fitted = next;
        }
        Ok(fitted)
    }

    /// `fitted` with its effects always at work again where that is as good, and else with their times located beside all
    /// that was found since.
    pub(crate) fn settle_times(&mut self, mut fitted: Fitted) -> Fitted {
        for group in switched(&fitted.train.model, self.given) {
            let [at, others @ ..] = &group[..] else { continue };
            if others.is_empty() {
                let mut model = fitted.train.model.clone();
                (model.effects[*at].from, model.effects[*at].until) = (None, None);
                match self.fit_without(&model, &fitted, ROUNDS) {
                    Ok(always) if always.score < fitted.score + EVIDENCE => {
                        let change = always.score - fitted.score;
                        self.journal.note(
                            &always.train.model.effects[*at].clone(),
                            Outcome::Simplified,
                            change,
                            "always at work",
                        );
                        self.taken.iter_mut().for_each(Taken::changed);
                        fitted = always;
                        continue;
                    }
                    Ok(_) => {}
                    Err(error) => {
                        self.journal.failed(&model.effects[*at], "always at work", &error);
                    }
                }
            }
            match self.located(fitted.clone(), &group) {
                Ok(located) => fitted = located,
                Err(error) => {
                    let effect = fitted.train.model.effects[*at].clone();
                    self.journal.failed(&effect, "its times cannot be located", &error);
                }
            }
        }
        self.begin_in_force(&fitted.train.model);
        fitted
    }
}
