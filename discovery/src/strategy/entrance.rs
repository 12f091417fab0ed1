//! The entrance: what every effect must do before it stands in the model, whichever step of the search brings it.
//!
//! An effect enters only where chance explains as much in at most one of 99 control runs. What it explains is how far the
//! information criterion rises without it, the others that come with it kept: an effect that comes alone is weighed
//! against the model before it, one that comes with another against the model that has the other one only. What chance
//! explains is what the best candidate gains on the innovations that all of them leave, shifted (see
//! [`chance`](crate::weigh::chance)). Those innovations have the noise and whatever is still unexplained, but no longer the
//! effect itself, which a shift may leave in phase with a candidate (C. J. F. ter Braak, in Bootstrapping and Related
//! Techniques, Springer (1992), 79).
//!
//! And it must be seen in the innovations. Where sizes of noise are fitted as well, the square of a size over its standard
//! error is at least the likelihood ratio (E. R. Berndt and N. E. Savin, Econometrica 45 (1977), 1263). A law of which the
//! ratio is far larger makes the noise more likely, not the measurements: it damps, or lets be forgotten, what the
//! model takes to be random and is not quite so. So do strong laws, friction above all, whose linear model says little of
//! them; but these are seen where simulations run freely over held-out data, for there no noise acts.
//!
//! Where recorded forces have an error it must be seen beyond what they lose with it (see [`lost`](crate::weigh::lost)), of which that
//! says no more than about how much it is, and not be uncertain.

use std::sync::Arc;

use cdpr::effect::EffectSpec;

use crate::filter::error::FitError;
use crate::filter::estimate::Fit;
use crate::journal::Outcome;
use crate::outcome::NullTest;
use crate::strategy::candidates::signatures;
use crate::strategy::context::Context;
use crate::strategy::fitted::Fitted;
use crate::strategy::policy::Policy;
use crate::strategy::standing::{Accepted, Standing};
use crate::verdict::POLICY;
use crate::weigh::chance::Chance;
use crate::weigh::criterion::EVIDENCE;
use crate::weigh::proposal::Certainty;
use crate::weigh::signatures::{Signatures, Source};

/// What comes of effects at the entrance.
pub(crate) enum Entry {
    Entered(Box<Standing>),
    /// They act on the noise, which says nothing of others that explain less.
    OnNoise,
    /// Chance explains as much, and so more than others that explain less.
    Chance,
}

impl Entry {
    pub(crate) fn entered(self) -> Option<Standing> {
        match self {
            Self::Entered(standing) => Some(*standing),
            Self::OnNoise | Self::Chance => None,
        }
    }
}

/// `standing` with the last effects of `next`, those that it lacks, each with its rivals, if all of them are seen and explain
/// more than chance. `how` they were found is noted.
pub(crate) fn enter(
    context: &Context<'_>,
    standing: &Standing,
    next: Fitted,
    rivals: Vec<Vec<EffectSpec>>,
    source: Source,
    how: &str,
) -> Result<Entry, FitError> {
    let effects = next.train.model.effects[next.train.model.effects.len() - rivals.len()..].to_vec();
    let without = without_each(context, &standing.fit, &next, effects.len());
    let weights: Vec<f64> = without.iter().map(|without| without.score - next.score).collect();
    let certainty = context.certainty(&next);
    let first = next.train.model.effects.len() - effects.len();
    let unseen = |k: usize| {
        !is_certain(context, &certainty, first + k, weights[k]) && !context.free_runs_show(&without[k], &next)
    };
    if (0..effects.len()).any(unseen) {
        for (effect, weight) in effects.iter().zip(weights) {
            let why = why_unseen(&next.train);
            // A term may stand for any law that was refused, which says more.
            let is_law = source == Source::Catalogue && effects.len() == 1;
            if next.train.randomness.input > 0.0 && is_law {
                context.journal.doubt(effect, -weight, why);
            } else {
                context.journal.note(effect, Outcome::Refused, -weight, why);
            }
        }
        return Ok(Entry::OnNoise);
    }
    let signatures = signatures(context, standing, &next, source);
    let chance = chance(context, &next, &signatures);
    let tests: Vec<Option<NullTest>> =
        weights.iter().map(|weight| Some(chance.as_ref()?.against(*weight, EVIDENCE))).collect();
    if let Some(test) = tests.iter().flatten().find(|test| !beyond_chance(test)) {
        let reason = format!("chance explains as much in {} of {} control runs", test.as_strong, test.shifts);
        for (effect, weight) in effects.iter().zip(weights) {
            context.journal.note(effect, Outcome::Refused, -weight, &reason);
        }
        return Ok(Entry::Chance);
    }
    let mut accepted = standing.accepted.clone();
    let together = rivals.len() > 1;
    for ((effect, rivals), ((weight, test), without)) in
        effects.iter().zip(rivals).zip(weights.iter().zip(tests).zip(without))
    {
        context.journal.note(effect, Outcome::Added, -weight, how);
        accepted.push(Accepted { without: together.then_some(without), ..Accepted::new(rivals, -weight, test) });
    }
    let weighed = Some((source, next.score, signatures));
    Ok(Entry::Entered(Box::new(Standing { fit: next, accepted, weighed, ..standing.clone() })))
}

/// For each of the last so many effects of `next` the best model known without it: `before`, or a fit with the others.
fn without_each(context: &Context<'_>, before: &Fitted, next: &Fitted, last: usize) -> Vec<Arc<Fitted>> {
    let effects = next.train.model.effects.len();
    let before = Arc::new(before.clone());
    let fitted = |at: usize| {
        let mut model = next.train.model.clone();
        let effect = model.effects.remove(at);
        let without = context.fit_without(&model, next, context.policy.rounds);
        let without = context.journal.tried(&effect, "the others without it", without);
        let better = without.filter(|without| without.score < before.score);
        better.map_or_else(|| Arc::clone(&before), Arc::new)
    };
    match last {
        1 => vec![Arc::clone(&before)],
        _ => (effects - last..effects).map(fitted).collect(),
    }
}

/// Why effects that are not seen do not stand, nor what came with them.
pub(crate) fn why_unseen(fit: &Fit) -> &'static str {
    if fit.randomness.input > 0.0 {
        "its size, or that of one beside it, is less certain than what it explains, or what the recorded forces lose with their error may \
         move it as far, and free runs show nothing of it"
    } else {
        "its size, or that of one beside it, is far less certain than what it explains, and free runs show nothing of it: it acts on \
         the noise"
    }
}

/// Whether the size of an effect is as certain as it must be where the effect explains so much (fall of the criterion), in
/// the same noise, or very certain: the fall says too much where the noise without the effect is not yet the likeliest. And it
/// must be more than what recorded forces may lose, and not uncertain beside these. Of what has no size but only shapes nothing is known of it.
pub(crate) fn is_certain(context: &Context<'_>, certainty: &Certainty, effect: usize, explained: f64) -> bool {
    let (policy, Certainty { spread, wald, lost }) = (context.policy, certainty);
    let least = (policy.seen * explained / spread).min(policy.certain);
    wald[effect].is_nan() || wald[effect] >= least.max(beyond_lost(lost[effect], policy))
}

/// Wald statistic from which a size is not what recorded forces lose with their error, which moves it by so much, as far as that is
/// known: beyond that as far as chance goes, and not uncertain.
fn beyond_lost(moves: f64, policy: &Policy) -> f64 {
    if moves == 0.0 {
        return 0.0;
    }
    (policy.lost_within * moves.sqrt() + EVIDENCE.sqrt()).powi(2).max(policy.uncertain)
}

/// What chance explains along a fit; none where the recordings are too short to tell.
fn chance(context: &Context<'_>, fitted: &Fitted, signatures: &Signatures) -> Option<Chance> {
    let (fit, trials) = (&fitted.train, &context.evidence.train[..]);
    signatures.weighed(fit, trials, &fit.randomness).chance(&signatures.library, context.penalty)
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
    use crate::strategy::fixture::{begun, evidence};
    use crate::strategy::policy::POLICY as SEARCH;
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
        let evidence = Evidence::new(train, holdout, noise);
        let begun = Context::begin(&evidence, &Model::default(), 0..0, &|_, _| {});
        let (context, base) = begun.expect("a fit");
        let next = context.fit(&Model { effects: proposed.to_vec(), ..Model::default() }, &base).expect("a fit");
        let rivals = vec![Vec::new(); proposed.len()];
        let standing = Standing::new(&context, base);
        let entered = enter(&context, &standing, next, rivals, Source::Catalogue, "").expect("an answer").entered();
        let enters = entered.is_some();
        let accepted = entered.map_or_else(Vec::new, |entered| entered.accepted);
        let as_strong = accepted.iter().map(|accepted| accepted.null_test.expect("room for shifts").as_strong);
        (enters, as_strong.collect(), context.journal.written().entries.iter().map(|entry| entry.outcome).collect())
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

    /// Damping of all cables, 41 +- 5 times as large, was named where recorded forces had an error: it explained 1080.
    #[test]
    fn what_explains_far_more_than_its_size_is_certain_of_enters_where_free_runs_show_it() {
        let drag = effect("platform_linear_drag", None, &[400.0]);
        let evidence = evidence(std::slice::from_ref(&drag), 75);
        let (mut context, standing) = begun(&evidence, &Model::default());
        let model = Model { effects: vec![drag], ..Model::default() };
        let next = context.fit(&model, &standing.fit).expect("a fit");
        let weight = standing.base.score - next.score;
        let fit = &next.train;
        assert!(is_certain(&context, &context.certainty(&next), 0, weight));
        let unsure = |spread: f64| Certainty { spread, wald: vec![59.0], lost: vec![0.0] };
        let certain = |certainty: &Certainty, weight: f64| is_certain(&context, certainty, 0, weight);
        assert!(!certain(&unsure(1.0), 1080.0) && certain(&unsure(1.0), 100.0) && certain(&unsure(20.0), 1080.0));
        assert!(certain(&Certainty { wald: vec![450.0], ..unsure(1.0) }, 1080.0));
        // Damping of all cables, 7.3 +- 1.1 % larger, was named beside friction where a controller's forces had an error of 18 N: what
        // they lose moves it by as much. In another recording, with 8 % found and eleven standard errors, by two of these.
        let beside_an_error = |wald: f64, lost: f64| Certainty { spread: 1.0, wald: vec![wald], lost: vec![lost] };
        assert!(!certain(&beside_an_error(42.4, 44.9), 20.8) && !certain(&beside_an_error(119.6, 4.0), 98.6));
        assert!(!certain(&beside_an_error(386.7, 300.0), 202.0));
        // These were there, and refused: drag of cables; drag of the platform and the gain of a winch, which they move by one standard
        // error and half of one.
        let there = [(386.7, 1e-3, 202.0), (330.6, 0.78, 243.3), (205.5, 0.29, 242.8)];
        assert!(there.into_iter().all(|(wald, lost, weight)| certain(&beside_an_error(wald, lost), weight)));
        // Less than ten standard errors.
        assert!(!certain(&beside_an_error(90.0, 1e-3), 90.0));
        let mut with_error = fit.clone();
        with_error.randomness.input = 18.0;
        assert_ne!(why_unseen(fit), why_unseen(&with_error));
        static DEMANDING: Policy = Policy { seen: f64::INFINITY, certain: f64::INFINITY, ..SEARCH };
        context.policy = &DEMANDING;
        // Free runs show it.
        let entered = enter(&context, &standing, next, vec![Vec::new()], Source::Catalogue, "").expect("an answer");
        let entered = entered.entered();
        assert!(weight > 200.0 && entered.is_some(), "{weight} {:?}", standing.base.gap);
    }

    /// Friction on a real robot explained 1640 and halved the gap, but the size of such a law is uncertain by its linear model.
    #[test]
    fn what_is_uncertain_and_not_shown_by_free_runs_does_not_enter() {
        let late = effect("pose_sensor_delay", None, &[1.5e-3]);
        let evidence = evidence(std::slice::from_ref(&late), 76);
        let (mut context, standing) = begun(&evidence, &Model::default());
        static DEMANDING: Policy = Policy { seen: f64::INFINITY, certain: f64::INFINITY, ..SEARCH };
        let model = Model { effects: vec![late], ..Model::default() };
        let next = context.fit(&model, &standing.fit).expect("a fit");
        let mut entered = |policy: &'static Policy| {
            context.policy = policy;
            let rivals = vec![Vec::new()];
            enter(&context, &standing, next.clone(), rivals, Source::Catalogue, "").expect("an answer")
        };
        assert!(matches!(entered(&SEARCH), Entry::Entered(_)));
        assert!(matches!(entered(&DEMANDING), Entry::OnNoise), "{:?}", standing.base.gap);
        // Where the forces have an error the law is doubted.
        let mut beside_an_error = next;
        beside_an_error.train.randomness.input = 18.0;
        for (source, doubted) in [(Source::Terms, 0), (Source::Catalogue, 1)] {
            let entry = enter(&context, &standing, beside_an_error.clone(), vec![Vec::new()], source, "");
            assert!(matches!(entry, Ok(Entry::OnNoise)) && context.journal.doubted().len() == doubted);
        }
        let entries = context.journal.written().entries;
        let on_noise =
            |entry: &&crate::journal::Entry| entry.outcome == Outcome::Refused && entry.reason.contains("noise");
        assert_eq!(entries.iter().filter(on_noise).count(), 1, "{entries:?}");
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
