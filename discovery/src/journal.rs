//! The journal of a search: what each step tried, how that came out and why, also where it could not be tried.

use std::collections::HashSet;
use std::error::Error;
use std::sync::{Mutex, MutexGuard, PoisonError};

use cdpr::effect::EffectSpec;

use crate::filter::error::FitError;

/// How a step came out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Outcome {
    /// The effect came in.
    Added,
    /// Its law got more: a shape, a second limit, times.
    Extended,
    /// Its law got on without a part that it had.
    Simplified,
    /// It came in for another one.
    Replaced,
    /// It was taken out again.
    Removed,
    /// It did not earn its place.
    Refused,
    /// It could not be tried.
    Failed,
    /// The search began again on another ground; the steps before are those of the search that ended there.
    Restarted,
}

impl Outcome {
    /// The outcome as in `discovery.json`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Added => "added",
            Self::Extended => "extended",
            Self::Simplified => "simplified",
            Self::Replaced => "replaced",
            Self::Removed => "removed",
            Self::Refused => "refused",
            Self::Failed => "failed",
            Self::Restarted => "restarted",
        }
    }
}

/// One step of the search.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// What was tried; none where it was what the instruments have beside white noise, or where the search began again.
    pub effect: Option<EffectSpec>,
    /// How that came out.
    pub outcome: Outcome,
    /// Information criterion with it minus without it; none where it could not be tried.
    pub delta_bic: Option<f64>,
    /// Why, a phrase; may be empty.
    pub reason: String,
}

impl Entry {
    /// That the search begins again `with` something, a phrase.
    pub(crate) fn restarted(with: &str) -> Self {
        Self { effect: None, outcome: Outcome::Restarted, delta_bic: None, reason: with.to_owned() }
    }

    /// What it is about where that is no effect.
    pub(crate) fn about(&self) -> &'static str {
        if self.outcome == Outcome::Restarted { "search" } else { "instruments" }
    }
}

/// The entries so far. Steps that run side by side write to it as well.
#[derive(Debug, Default)]
pub(crate) struct Journal {
    entries: Mutex<Vec<Entry>>,
    /// Laws that were refused because they are not certain enough, though the data are likelier by them.
    doubted: Mutex<Vec<(EffectSpec, f64)>>,
    /// The last laws by which the data were as likely, and no more, as with the drifts of instruments that stood, and by how much (criterion
    /// with them minus without).
    as_likely: Mutex<Option<(Vec<EffectSpec>, f64)>>,
    /// The law that the held-out data contradict and that explains the most of the training data, if that is most of what is left there, and
    /// by how much (criterion with it minus without).
    only_trained: Mutex<Option<(EffectSpec, f64)>>,
    /// What a reader should know of the way that the search went, a sentence each.
    remarks: Mutex<Vec<String>>,
    /// The names of all candidates weighed so far.
    weighed: Mutex<HashSet<String>>,
}

/// Why a law is refused that makes the training data likelier and not those held out.
pub(crate) const NOT_HELD_OUT: &str = "it does not predict the held-out data better";

/// What a journal has in the end.
pub(crate) struct Written {
    pub(crate) entries: Vec<Entry>,
    pub(crate) remarks: Vec<String>,
    /// The number of candidates weighed.
    pub(crate) candidates: usize,
}

impl Journal {
    pub(crate) fn note(&self, effect: &EffectSpec, outcome: Outcome, delta_bic: f64, reason: &str) {
        let (effect, delta_bic) = (Some(effect.clone()), Some(delta_bic));
        self.write(Entry { effect, outcome, delta_bic, reason: reason.to_owned() });
    }

    /// That an effect is refused because it is not certain enough, and how much likelier the data are by it: it may be there.
    pub(crate) fn doubt(&self, effect: &EffectSpec, delta_bic: f64, reason: &str) {
        self.note(effect, Outcome::Refused, delta_bic, reason);
        locked(&self.doubted).push((effect.clone(), delta_bic));
    }

    /// What was refused so, with the fall of the criterion by it then.
    pub(crate) fn doubted(&self) -> Vec<(EffectSpec, f64)> {
        locked(&self.doubted).clone()
    }

    /// That an effect explains most of what is left in the training data, and the held-out data contradict it.
    pub(crate) fn contradicted(&self, effect: &EffectSpec, delta_bic: f64) {
        let mut most = locked(&self.only_trained);
        if most.as_ref().is_none_or(|(_, most)| delta_bic < *most) {
            *most = Some((effect.clone(), delta_bic));
        }
    }

    /// The one of which that was said that explains the most.
    pub(crate) fn only_trained(&self) -> Option<EffectSpec> {
        locked(&self.only_trained).as_ref().map(|(effect, _)| effect.clone())
    }

    /// That these laws together are as likely as drifts of instruments that stand, by so much.
    pub(crate) fn as_likely_as_drifts(&self, laws: &[EffectSpec], delta_bic: f64) {
        for law in laws {
            self.note(law, Outcome::Refused, delta_bic, "a drift of an instrument is as likely");
        }
        *locked(&self.as_likely) = Some((laws.to_vec(), delta_bic));
    }

    /// The last of what was said so.
    pub(crate) fn last_as_likely(&self) -> Option<(Vec<EffectSpec>, f64)> {
        locked(&self.as_likely).clone()
    }

    /// That `what` was to be tried of an effect and why it could not be.
    pub(crate) fn failed(&self, effect: &EffectSpec, what: &str, error: &dyn Error) {
        self.write(failure(Some(effect.clone()), what, error));
    }

    /// That `what` was to be tried of the instruments and why it could not be.
    pub(crate) fn instruments_failed(&self, what: &str, error: &dyn Error) {
        self.write(failure(None, what, error));
    }

    /// What was tried of an effect, or nothing and an entry where it could not be.
    pub(crate) fn tried<T, E: Error>(&self, effect: &EffectSpec, what: &str, tried: Result<T, E>) -> Option<T> {
        tried.map_err(|error| self.failed(effect, what, &error)).ok()
    }

    /// Does work in which steps run side by side; their entries are put in an order that does not depend on which came first.
    pub(crate) fn side_by_side<T>(&self, work: impl FnOnce() -> T) -> T {
        let from = self.locked(|entries| entries.len());
        let done = work();
        self.locked(|entries| entries[from..].sort_by_cached_key(|entry| format!("{entry:?}")));
        done
    }

    pub(crate) fn len(&self) -> usize {
        self.locked(|entries| entries.len())
    }

    /// Puts the steps of searches that ended where this one begins before its own.
    pub(crate) fn begins_with(&self, steps: Vec<Entry>) {
        self.locked(|entries| entries.splice(0..0, steps).for_each(drop));
    }

    /// Says of what came in or changed since there were `from` entries that it was refused after all.
    pub(crate) fn refuse_since(&self, from: usize, reason: &str) {
        self.locked(|entries| {
            let taken = |outcome| {
                !matches!(outcome, Outcome::Removed | Outcome::Refused | Outcome::Failed | Outcome::Restarted)
            };
            for entry in entries[from..].iter_mut().filter(|entry| taken(entry.outcome)) {
                (entry.outcome, entry.reason) = (Outcome::Refused, reason.to_owned());
            }
        });
    }

    /// What came of a step that may fail because the model has no trajectory near the data; that is remarked, once.
    pub(crate) fn or_remark<T>(&self, what: &str, result: Result<T, FitError>) -> Result<Option<T>, FitError> {
        match result {
            Ok(done) => Ok(Some(done)),
            Err(error @ (FitError::Diverged { .. } | FitError::Simulation(_))) => {
                self.remark(format!("{what}: {error}."));
                Ok(None)
            }
            Err(error) => Err(error),
        }
    }

    /// The law that would make the training data the likeliest of all that were refused because of the held-out data, and by how much
    /// (criterion with it minus without); and how many laws could not be tried.
    pub(crate) fn refused_and_failed(&self) -> (Option<(EffectSpec, f64)>, usize) {
        self.locked(|entries| {
            let refused =
                entries.iter().filter(|entry| entry.outcome == Outcome::Refused && entry.reason == NOT_HELD_OUT);
            let likeliest = refused.filter_map(|entry| Some((entry.effect.clone()?, entry.delta_bic?)));
            let failed = entries.iter().filter(|entry| entry.outcome == Outcome::Failed);
            let laws: HashSet<_> =
                failed.filter_map(|entry| entry.effect.as_ref()).map(|law| (law.id.clone(), law.cable)).collect();
            (likeliest.min_by(|a, b| a.1.total_cmp(&b.1)), laws.len())
        })
    }

    /// What a reader is to know, once.
    pub(crate) fn remark(&self, remark: String) {
        let mut remarks = locked(&self.remarks);
        if !remarks.contains(&remark) {
            remarks.push(remark);
        }
    }

    /// That candidates of these names were weighed.
    pub(crate) fn weighed(&self, names: impl Iterator<Item = String>) {
        locked(&self.weighed).extend(names);
    }

    /// The entries so far.
    pub(crate) fn entries(&self) -> Vec<Entry> {
        self.locked(|entries| entries.clone())
    }

    pub(crate) fn written(self) -> Written {
        Written {
            candidates: locked(&self.weighed).len(),
            entries: self.entries.into_inner().unwrap_or_else(PoisonError::into_inner),
            remarks: self.remarks.into_inner().unwrap_or_else(PoisonError::into_inner),
        }
    }

    /// That an effect says nothing along the fit at hand, and why; once, though it be weighed in every round.
    pub(crate) fn silent(&self, effect: &EffectSpec, error: &dyn Error) {
        self.once(failure(Some(effect.clone()), "its signature", error));
    }

    /// That a refinement of these effects ended where no step of their parameters could be taken, and why, if it did; once.
    pub(crate) fn stuck(&self, effects: &[EffectSpec], why: Option<FitError>) {
        if let Some(error) = why {
            self.once(failure(effects.last().cloned(), "no step of the parameters goes with the data", &error));
        }
    }

    fn once(&self, entry: Entry) {
        self.locked(|entries| {
            if !entries.contains(&entry) {
                entries.push(entry);
            }
        });
    }

    fn write(&self, entry: Entry) {
        self.locked(|entries| entries.push(entry));
    }

    fn locked<T>(&self, work: impl FnOnce(&mut Vec<Entry>) -> T) -> T {
        work(&mut locked(&self.entries))
    }
}

/// Entries are whole whatever panicked while somebody held them.
fn locked<T>(part: &Mutex<T>) -> MutexGuard<'_, T> {
    part.lock().unwrap_or_else(PoisonError::into_inner)
}

fn failure(effect: Option<EffectSpec>, what: &str, error: &dyn Error) -> Entry {
    Entry { effect, outcome: Outcome::Failed, delta_bic: None, reason: format!("{what}: {error}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drag(value: f64) -> EffectSpec {
        EffectSpec::new("platform_linear_drag", None, &[value]).expect("an effect")
    }

    #[test]
    fn what_cannot_be_tried_says_why() {
        let journal = Journal::default();
        assert_eq!(journal.tried(&drag(1.0), "on held-out data", Ok::<_, FitError>(3)), Some(3));
        let error = FitError::Model("no cables".to_owned());
        let text = error.to_string();
        assert_eq!(journal.tried::<(), _>(&drag(2.0), "on held-out data", Err(error)), None);
        let [entry] = &journal.written().entries[..] else { panic!("one entry") };
        assert_eq!((entry.outcome, entry.delta_bic, &entry.effect), (Outcome::Failed, None, &Some(drag(2.0))));
        assert_eq!(entry.reason, format!("on held-out data: {text}"));
    }

    #[test]
    fn what_held_out_data_refused_and_what_could_not_be_tried_are_known_in_the_end() {
        let journal = Journal::default();
        assert_eq!(journal.refused_and_failed(), (None, 0));
        for (value, delta_bic, why) in
            [(1.0, -20.0, NOT_HELD_OUT), (2.0, -90.0, NOT_HELD_OUT), (3.0, -900.0, "it acts on the noise")]
        {
            journal.note(&drag(value), Outcome::Refused, delta_bic, why);
        }
        for _ in 0..2 {
            journal.failed(&drag(4.0), "it cannot be fitted", &FitError::Model("no cables".to_owned()));
        }
        assert_eq!(journal.refused_and_failed(), (Some((drag(2.0), -90.0)), 1));
    }

    #[test]
    fn a_refinement_that_could_go_nowhere_is_told_once() {
        let journal = Journal::default();
        let diverged = || FitError::Diverged { trial: "first.csv".to_owned(), time: 3.0 };
        journal.stuck(&[drag(1.0), drag(2.0)], None);
        (0..2).for_each(|_| journal.stuck(&[drag(1.0), drag(2.0)], Some(diverged())));
        let [entry] = &journal.written().entries[..] else { panic!("one entry") };
        assert_eq!((entry.outcome, &entry.effect), (Outcome::Failed, &Some(drag(2.0))));
        assert!(entry.reason.contains("first.csv"), "{}", entry.reason);
    }

    /// A step that fails since the model goes nowhere near the data is remarked; other failures end the search.
    #[test]
    fn what_does_not_go_with_the_data_is_remarked_once() {
        let journal = Journal::default();
        let diverged = || Err::<(), _>(FitError::Diverged { trial: "first.csv".to_owned(), time: 3.0 });
        (0..2).for_each(|_| assert!(matches!(journal.or_remark("There", diverged()), Ok(None))));
        assert!(journal.or_remark("There", Err::<(), _>(FitError::Model("no cables".to_owned()))).is_err());
        journal.weighed(["drag", "wind", "drag"].into_iter().map(str::to_owned));
        let written = journal.written();
        assert_eq!((written.remarks.len(), written.candidates), (1, 2));
    }

    #[test]
    fn a_law_that_cannot_be_weighed_in_any_round_is_said_once() {
        let journal = Journal::default();
        let error = FitError::NotFinite { trial: "first.csv".to_owned() };
        (0..3).for_each(|_| journal.silent(&drag(1.0), &error));
        journal.silent(&drag(2.0), &error);
        let reasons: Vec<String> = journal.written().entries.into_iter().map(|entry| entry.reason).collect();
        assert_eq!(reasons, vec!["its signature: first.csv: it gives values that are not finite"; 2]);
    }

    #[test]
    fn steps_side_by_side_are_in_one_order_whichever_came_first() {
        let entries = |order: [f64; 2]| {
            let journal = Journal::default();
            journal.note(&drag(9.0), Outcome::Added, -20.0, "");
            journal.side_by_side(|| order.map(|value| journal.note(&drag(value), Outcome::Refused, value, "")));
            journal.written().entries
        };
        assert_eq!(entries([1.0, 2.0]), entries([2.0, 1.0]));
        assert_eq!(entries([1.0, 2.0])[0].effect, Some(drag(9.0)));
    }

    #[test]
    fn the_steps_of_a_search_come_behind_those_of_the_one_that_ended_where_it_began() {
        let (before, journal) = (Journal::default(), Journal::default());
        before.note(&drag(1.0), Outcome::Added, -20.0, "");
        let mut steps = before.entries();
        steps.push(Entry::restarted("with a slow clock of the time stamps undone"));
        journal.note(&drag(2.0), Outcome::Refused, 3.0, "");
        journal.begins_with(steps);
        let entries = journal.written().entries;
        let outcomes: Vec<&str> = entries.iter().map(|entry| entry.outcome.name()).collect();
        assert_eq!(outcomes, ["added", "restarted", "refused"]);
        assert_eq!((entries[1].about(), entries[2].about()), ("search", "instruments"));
    }

    #[test]
    fn only_what_came_in_since_is_refused_after_all() {
        let journal = Journal::default();
        journal.note(&drag(1.0), Outcome::Added, -20.0, "");
        let from = journal.len();
        journal.note(&drag(2.0), Outcome::Added, -20.0, "");
        journal.note(&drag(2.5), Outcome::Extended, -20.0, "");
        journal.note(&drag(3.0), Outcome::Removed, 3.0, "");
        journal.refuse_since(from, "too little");
        let outcomes: Vec<Outcome> = journal.written().entries.iter().map(|entry| entry.outcome).collect();
        assert_eq!(outcomes, [Outcome::Added, Outcome::Refused, Outcome::Refused, Outcome::Removed]);
    }
}
