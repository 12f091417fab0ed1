//! The entrance: what every effect must do before it stands in the model, whichever step of the search brings it.
//!
//! An effect enters only where chance explains as much in at most one of 99 control runs. What it explains is how far the
//! information criterion rises without it, the others that come with it kept: an effect that comes alone is weighed
//! against the model before it, one that comes with another against the model that has the other one only. What chance
//! explains is what the best candidate gains on the innovations that all of them leave, shifted (see
//! [`null_test`](crate::weigh::null_test)). Those innovations have the noise and whatever is still unexplained, but no longer the
//! effect itself, which a shift may leave in phase with a candidate (C. J. F. ter Braak, in Bootstrapping and Related
//! Techniques, Springer (1992), 79).

use std::sync::Arc;

use cdpr::effect::EffectSpec;

use crate::filter::estimate::FitError;
use crate::journal::Outcome;
use crate::outcome::NullTest;
use crate::strategy::fitted::Fitted;
use crate::strategy::round::Signatures;
use crate::strategy::search::{EVIDENCE, ROUNDS, Search, Taken};
use crate::verdict::POLICY;
use crate::weigh::null_test::Chance;

/// Which candidates a step chooses from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Source {
    Catalogue,
    Terms,
}

/// What the entrance says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Answer {
    Enters,
    /// Chance explains as much.
    Chance,
}

impl Search<'_> {
    /// Takes up the last effects of `next`, those that `before` lacks, each with its rivals, if all of them explain more than
    /// chance; whether they do. `how` they were found is noted.
    pub(crate) fn enter(
        &mut self,
        before: &Fitted,
        next: &Fitted,
        rivals: Vec<Vec<EffectSpec>>,
        source: Source,
        how: &str,
    ) -> Result<Answer, FitError> {
        let first = next.train.model.effects.len() - rivals.len();
        let without = self.without_each(before, next, first);
        let weights: Vec<f64> = without.iter().map(|without| without.score - next.score).collect();
        let signatures = self.signatures(next, source);
        let chance = self.chance(next, &signatures);
        let tests: Vec<Option<NullTest>> =
            weights.iter().map(|weight| Some(chance.as_ref()?.against(*weight, EVIDENCE))).collect();
        self.weighed = Some((source, next.score, signatures));
        let effects = &next.train.model.effects[first..];
        if let Some(test) = tests.iter().flatten().find(|test| !beyond_chance(test)) {
            let reason = format!("chance explains as much in {} of {} control runs", test.as_strong, test.shifts);
            for (effect, weight) in effects.iter().zip(weights) {
                self.journal.note(effect, Outcome::Refused, -weight, &reason);
            }
            return Ok(Answer::Chance);
        }
        let together = rivals.len() > 1;
        for (k, rivals) in rivals.into_iter().enumerate() {
            self.journal.note(&effects[k], Outcome::Added, -weights[k], how);
            let mut taken = Taken::new(rivals, -weights[k], tests[k]);
            taken.without = together.then(|| Arc::clone(&without[k]));
            self.taken.push(taken);
        }
        Ok(Answer::Enters)
    }

    /// For each effect of `next` from `first` on the best model known without it: `before`, or a fit with the others.
    fn without_each(&self, before: &Fitted, next: &Fitted, first: usize) -> Vec<Arc<Fitted>> {
        let effects = next.train.model.effects.len();
        let before = Arc::new(before.clone());
        let fitted = |at: usize| {
            let mut model = next.train.model.clone();
            model.effects.remove(at);
            let without = self.fit_without(&model, next, ROUNDS);
            let without = self.journal.tried(&next.train.model.effects[at], "the others without it", without);
            let better = without.filter(|without| without.score < before.score);
            better.map_or_else(|| Arc::clone(&before), Arc::new)
        };
        match effects - first {
            1 => vec![Arc::clone(&before)],
            _ => (first..effects).map(fitted).collect(),
        }
    }

    /// What chance explains along a fit; none where the recordings are too short to tell.
    fn chance(&self, fitted: &Fitted, signatures: &Signatures) -> Option<Chance> {
        let (fit, trials) = (&fitted.train, &self.evidence.train[..]);
        signatures.weighed(fit, trials, &fit.randomness).chance(&signatures.library, self.penalty)
    }
}

/// Whether chance explains as much in few enough control runs.
fn beyond_chance(test: &NullTest) -> bool {
    test.as_strong <= POLICY.by_chance
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::recording::record;
    use crate::filter::estimate::noise_of_data;
    use crate::strategy::fitted::Evidence;
    use cdpr::model_file::Model;

    #[test]
    fn chance_may_do_as_well_once_in_99() {
        let chance = Chance { gains: (1..=99).map(f64::from).collect() };
        let [first, second, third] = [99.5, 99.0, 98.0].map(|found| chance.against(found, 90.0));
        assert_eq!([first.as_strong, second.as_strong, third.as_strong], [0, 1, 2]);
        assert_eq!((third.shifts, third.over_threshold, third.largest), (99, 10, 99.0));
        assert_eq!([first, second, third].map(|test| beyond_chance(&test)), [true, true, false]);
    }

    fn effect(id: &str, cable: Option<usize>, values: &[f64]) -> EffectSpec {
        EffectSpec::new(id, cable, values).expect("an effect")
    }

    /// Whether `proposed` effects, refined, enter together where `hidden` ones act, and what the search has then: how often
    /// chance did as well as each, and the outcomes noted.
    fn entering(hidden: &[EffectSpec], proposed: &[EffectSpec]) -> (bool, Vec<usize>, Vec<Outcome>) {
        let train = vec![record(hidden, 40.0, 21), record(hidden, 30.0, 22)];
        let holdout = vec![record(hidden, 30.0, 23)];
        let noise = noise_of_data(&[&train[..], &holdout[..]].concat());
        let evidence = Evidence { train, holdout, noise, instruments: None };
        let mut search = Search::new(&evidence, 0, &|_, _| {});
        let base = search.base(&Model::default()).expect("a fit");
        let next = search.fit(&Model { effects: proposed.to_vec(), ..Model::default() }, &base, ROUNDS).expect("a fit");
        let rivals = vec![Vec::new(); proposed.len()];
        let enters = search.enter(&base, &next, rivals, Source::Catalogue, "").expect("an answer");
        let as_strong = search.taken.iter().map(|taken| taken.null_test.expect("room for shifts").as_strong);
        (
            enters == Answer::Enters,
            as_strong.collect(),
            search.journal.into_entries().iter().map(|entry| entry.outcome).collect(),
        )
    }

    #[test]
    fn both_of_a_pair_enter_where_both_are_missing() {
        let both = [effect("winch_force_gain", Some(1), &[0.01]), effect("platform_linear_drag", None, &[60.0])];
        assert_eq!(entering(&both, &both), (true, vec![0, 0], vec![Outcome::Added; 2]));
    }

    #[test]
    fn a_pair_does_not_enter_on_the_strength_of_one() {
        let drag = effect("platform_linear_drag", None, &[60.0]);
        let both = [effect("winch_viscous_friction", Some(2), &[5.0]), drag.clone()];
        assert_eq!(entering(&[drag], &both), (false, Vec::new(), vec![Outcome::Refused; 2]));
    }

    #[test]
    fn a_law_of_time_alone_enters_only_where_it_is_missing() {
        let gust = effect("periodic_gust", None, &[30.0, 0.5, 0.9, 0.3]);
        assert_eq!(
            entering(std::slice::from_ref(&gust), std::slice::from_ref(&gust)),
            (true, vec![0], vec![Outcome::Added])
        );
        assert_eq!(entering(&[], &[gust]), (false, Vec::new(), vec![Outcome::Refused]));
    }
}
