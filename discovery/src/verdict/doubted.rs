//! A law that would make the data likelier and is not certain enough for a name: how far it moves what was found.
//!
//! A size that holds only if that law is not there is less certain than samples say. How far apart the two models have it belongs to its
//! error (S. T. Buckland, K. P. Burnham, N. H. Augustin, Model selection: an integral part of inference, Biometrics 53 (1997), 603).

use cdpr::effect::EffectSpec;
use cdpr::model_file::Model;

use crate::hypothesis::extension::is_one_law;
use crate::report::phrase;
use crate::strategy::context::Context;
use crate::strategy::fitted::Fitted;
use crate::weigh::criterion::EVIDENCE;
use crate::write::{in_numbers, label, place};

/// The likeliest of the laws that were refused so, fitted beside what was found.
pub(crate) struct Doubted {
    effect: EffectSpec,
    /// Criterion with it minus without it.
    change: f64,
    /// What was found, as it is beside it.
    beside: Model,
}

/// The law that was refused for what the recorded forces lose with their error, and makes the data likelier in the end as well.
pub(crate) fn doubted(context: &Context<'_>, fitted: &Fitted) -> Option<Doubted> {
    let fit = &fitted.train;
    let there = |effect: &EffectSpec| fit.model.effects.iter().any(|other| is_one_law(other, effect));
    let doubted = context.journal.doubted().into_iter().filter(|(effect, _)| !there(effect));
    let (effect, _) = doubted.min_by(|a, b| a.1.total_cmp(&b.1))?;
    let mut model = fit.model.clone();
    model.effects.push(effect.clone());
    let trained = context.train(&model, fit, &context.evidence.train, context.policy.rounds, None);
    let trained = context.journal.tried(&effect, "beside what was found", trained)?;
    let change = trained.score - fitted.score;
    let mut beside = trained.fit.model;
    let effect = beside.effects.pop()?;
    (change < -EVIDENCE).then_some(Doubted { effect, change, beside })
}

impl Doubted {
    /// Standard errors of an effect that was found, with how far it is moved; and what it then is, if that is farther than they said.
    pub(crate) fn widened(
        &self,
        found: &EffectSpec,
        errors: &[Option<f64>],
    ) -> Option<(Vec<Option<f64>>, Option<String>)> {
        let moved = self.beside.effects.iter().find(|effect| is_one_law(effect, found))?;
        let apart = || moved.values.iter().zip(&found.values).map(|(with, without)| with - without);
        let errors = || errors.iter().zip(apart());
        let beyond = errors().any(|(error, apart)| error.is_some_and(|error| apart.abs() > error));
        let words = || {
            let what = phrase(&label(found), &place(found)).replace('\u{a0}', " ");
            format!("the {what} would have {}", in_numbers(moved, &[]))
        };
        let widened = errors().map(|(error, apart)| error.map(|error| error.hypot(apart))).collect();
        Some((widened, beyond.then(words)))
    }

    /// What a reader should know of it, and of what is `moved` by it.
    pub(crate) fn remark(&self, moved: &[String]) -> String {
        let what = phrase(&label(&self.effect), &place(&self.effect)).replace('\u{a0}', " ");
        let numbers = in_numbers(&self.effect, &[]);
        let change = self.change.abs();
        let with_it = if moved.is_empty() { String::new() } else { format!(": with it {}", moved.join(", and ")) };
        format!(
            "The data would be likelier still, by {change:.0} in the criterion, with {what} ({numbers}), which is not certain enough for a \
             name: the recorded forces have an error, and what they lose with it may be what it explains. Standard errors allow for \
             it{with_it}."
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::strategy::fixture::{begun, effect, evidence, with};

    /// What is said of a mass that was found, where a gain of winch 2 was refused.
    fn mass_beside(hidden: &[EffectSpec]) -> (f64, Option<(f64, Option<String>)>) {
        let evidence = evidence(hidden, 97);
        let (context, standing) = begun(&evidence, &Model::default());
        let mass = effect("platform_mass", None, &[100.0]);
        let standing = with(&context, standing, vec![(mass, Vec::new())]);
        context.journal.doubt(&effect("winch_force_gain", Some(2), &[0.01]), -200.0, "not certain");
        let law = standing.found(&context)[0].clone();
        let doubted = doubted(&context, &standing.fit);
        let widened = doubted.map(|doubted| doubted.widened(&law, &[Some(1e-3)]).expect("the mass is there"));
        (law.values[0], widened.map(|(errors, words)| (errors[0].expect("an error"), words)))
    }

    /// On a bench a mass of 0.8 kg came out as 0.93 +- 0.025 kg, for a gain of 1.5 % beside it was refused.
    #[test]
    fn the_error_of_what_was_found_allows_for_a_law_that_was_refused() {
        let truth = 200.0;
        let gain = effect("winch_force_gain", Some(2), &[0.01]);
        let (found, widened) = mass_beside(&[effect("platform_mass", None, &[truth]), gain]);
        let (error, words) = widened.expect("the gain is there");
        assert!((found - truth).abs() < 2.0 * error, "{found} {error}");
        assert!(words.is_some_and(|words| words.contains("mass error") && words.contains("kg")));
    }

    #[test]
    fn a_law_that_is_not_there_says_nothing_of_what_was_found() {
        let (_, widened) = mass_beside(&[effect("platform_mass", None, &[200.0])]);
        assert!(widened.is_none());
    }
}
