//! How a search stands: the model so far, fitted, and what is known of each effect that was accepted.

use std::sync::Arc;

use cdpr::effect::EffectSpec;
use cdpr::model_file::Model;

use crate::data::{Trial, Undone};
use crate::filter::error::FitError;
use crate::filter::estimate::Fit;
use crate::hypothesis::extension::{count_in_use, is_one_law, same_law};
use crate::journal::Outcome;
use crate::outcome::{Alternative, NullTest};
use crate::strategy::context::Context;
use crate::strategy::fitted::Fitted;
use crate::strategy::form::Chosen;
use crate::weigh::signatures::{Signatures, Source};

/// What is known of an effect that was accepted. Its law and its size are in the model that stands.
#[derive(Clone)]
pub(crate) struct Accepted {
    /// Other explanations for a full comparison.
    pub(crate) rivals: Vec<EffectSpec>,
    /// Those of them that were fitted in its place last, the best first.
    pub(crate) alternatives: Vec<Alternative>,
    /// Information criterion with it minus without it.
    pub(crate) delta_bic: f64,
    /// What chance did beside it when it came in.
    pub(crate) null_test: Option<NullTest>,
    /// The model with all effects but this, where it was fitted since the last change of them.
    pub(crate) without: Option<Arc<Fitted>>,
    /// The number of effects among which its form was chosen last.
    pub(crate) formed_among: Option<usize>,
    /// Whether it is on one cable of those among which a law of all was divided.
    pub(crate) divided: bool,
}

impl Accepted {
    pub(crate) fn new(rivals: Vec<EffectSpec>, delta_bic: f64, null_test: Option<NullTest>) -> Self {
        Self {
            rivals,
            alternatives: Vec::new(),
            delta_bic,
            null_test,
            without: None,
            formed_among: None,
            divided: false,
        }
    }
}

/// The state of a search. Steps take one and give one back.
#[derive(Clone)]
pub(crate) struct Standing {
    /// The model as given, beside the instruments by which gaps count.
    pub(crate) base: Arc<Fitted>,
    /// The model that stands.
    pub(crate) fit: Fitted,
    /// What is known of each effect that was accepted, in the order of the model's effects behind those given.
    pub(crate) accepted: Vec<Accepted>,
    /// The beginnings of the training trials, by which laws are chosen for the whole.
    pub(crate) beginnings: Arc<[Trial]>,
    /// What chance did in the last weighing of the catalogue.
    pub(crate) chance: Option<NullTest>,
    /// Whether laws that hide themselves were looked for.
    pub(crate) looked: bool,
    /// Candidates along the fit that was let in last, known by its score.
    pub(crate) weighed: Option<(Source, f64, Arc<Signatures>)>,
    /// The score of the last fit of which no effect was found to begin or end.
    pub(crate) timeless: Option<f64>,
    /// The score of the last fit of which no law on all cables was found to differ from one to the other by a share of what is left, and
    /// that share.
    pub(crate) alike: Option<(f64, f64)>,
    /// The forms of friction that were chosen last and not taken yet.
    pub(crate) chosen: Option<Chosen>,
    /// The laws beside which the instruments were taken up, where they had nothing but white noise before.
    pub(crate) taken_up_beside: Option<Vec<Law>>,
    /// Whether errors of the survey promise to explain what the laws so far leave.
    pub(crate) geometry_is_off: bool,
    /// The number of a given effect of which other numbers promise to explain more than what might be added.
    pub(crate) given_is_off: Option<usize>,
    /// What recording was found to do and has not been undone.
    pub(crate) to_undo: Option<Undone>,
    /// Whether beside the laws so far the data go as well with winch forces as they were recorded as with a recorder's lateness undone.
    pub(crate) undone_in_vain: bool,
}

/// An effect without its size: what it is, where, and how many numbers its form takes.
pub(crate) type Law = (String, Option<usize>, usize);

impl Standing {
    /// The model as given, with nothing accepted.
    pub(crate) fn new(context: &Context<'_>, base: Fitted) -> Self {
        Self {
            fit: base.clone(),
            base: Arc::new(base),
            accepted: Vec::new(),
            beginnings: beginnings(&context.evidence.train, f64::NEG_INFINITY, context.beginning).into(),
            chance: None,
            looked: false,
            weighed: None,
            timeless: None,
            alike: None,
            chosen: None,
            taken_up_beside: None,
            geometry_is_off: false,
            given_is_off: None,
            to_undo: None,
            undone_in_vain: false,
        }
    }

    /// The model as given with what its instruments ask for; nothing was accepted.
    pub(crate) fn with_base(self, base: Fitted) -> Self {
        Self { fit: base.clone(), base: Arc::new(base), ..self }
    }

    /// The model as given in the place of all that was accepted.
    pub(crate) fn anew(&self) -> Self {
        // What chance did was weighed beside what is no longer there.
        Self { fit: (*self.base).clone(), accepted: Vec::new(), chance: None, ..self.clone() }
    }

    /// The same effects by another fit, which is not quite the same model: fits without one of them are no longer of this one.
    pub(crate) fn changed(mut self, fit: Fitted) -> Self {
        self.fit = fit;
        for accepted in &mut self.accepted {
            (accepted.without, accepted.formed_among) = (None, None);
        }
        self
    }

    /// Takes out an effect that was accepted as number `k`. Those that came in after it do its work, and it may be what they stand
    /// for: it is a rival of each. What acts for a while only is a part of a law.
    pub(crate) fn step_back(&mut self, k: usize, effect: EffectSpec) {
        self.accepted.remove(k);
        if effect.from.is_some() || effect.until.is_some() {
            return;
        }
        for accepted in &mut self.accepted[k..] {
            if !accepted.rivals.iter().any(|rival| is_one_law(rival, &effect)) {
                accepted.rivals.push(effect.clone());
            }
        }
    }

    /// How many laws were accepted; one that was divided among cables counts once.
    pub(crate) fn count(&self) -> usize {
        let effects = self.effects();
        let found = &effects[effects.len() - self.accepted.len()..];
        let mut divided: Vec<&EffectSpec> = Vec::new();
        let mut others = 0;
        for (law, accepted) in found.iter().zip(&self.accepted) {
            if !accepted.divided {
                others += 1;
            } else if !divided.iter().any(|other| same_law(other, law)) {
                divided.push(law);
            }
        }
        others + divided.len()
    }

    /// The effects of the model that stands.
    pub(crate) fn effects(&self) -> &[EffectSpec] {
        &self.fit.train.model.effects
    }

    /// The laws of the model that stands.
    pub(crate) fn laws(&self) -> Vec<Law> {
        self.effects().iter().map(|effect| (effect.id.clone(), effect.cable, count_in_use(effect))).collect()
    }

    /// The effects that were accepted, in the order of what is known of them.
    pub(crate) fn found(&self, context: &Context<'_>) -> &[EffectSpec] {
        &self.effects()[context.given..]
    }

    /// Whether the recorded forces were found to have an error. The search then goes on with those to be expected.
    pub(crate) fn white_force_error(&self) -> bool {
        self.fit.instruments.as_ref().is_some_and(|randomness| randomness.white_input() > 0.0)
    }

    /// Whether the search ends here, to begin again on another ground: with what recording did undone, or no longer undone, or with the forces
    /// to be expected in the place of those recorded, or with errors of the survey free beside every law, or without an effect that the model
    /// as given has.
    pub(crate) fn begins_anew(&self) -> bool {
        self.given_is_off.is_some()
            || self.to_undo.is_some()
            || self.undone_in_vain
            || self.white_force_error()
            || self.geometry_is_off
    }

    /// What stands, with nothing by which the search would begin again.
    pub(crate) fn with_nothing_begun_anew(self) -> Self {
        Self { geometry_is_off: false, given_is_off: None, to_undo: None, undone_in_vain: false, ..self }
    }

    /// Has the beginnings of the trials start shortly before the last of the new effects begins: before that they show
    /// nothing of it.
    pub(crate) fn begin_in_force(&mut self, context: &Context<'_>) {
        let from = self.found(context).iter().filter_map(|effect| effect.from).fold(f64::NEG_INFINITY, f64::max);
        let (length, lead) = (context.beginning, context.policy.lead * context.beginning);
        self.beginnings = beginnings(&context.evidence.train, from - lead, length).into();
    }

    /// A fit on the beginnings of its trials.
    pub(crate) fn begun(&self, context: &Context<'_>, fit: &Fit) -> Result<Fit, FitError> {
        fit.part(&context.evidence.train, &self.beginnings)
    }

    /// Gives up everything that was accepted, for `fit`.
    pub(crate) fn give_up(mut self, context: &Context<'_>, reason: &str, fit: Fitted) -> Self {
        for (effect, accepted) in self.found(context).iter().zip(&self.accepted) {
            context.journal.note(effect, Outcome::Removed, accepted.delta_bic, reason);
        }
        self.accepted.clear();
        Self { fit, chance: None, ..self }
    }

    /// The model that stands without the effect that was accepted as number `k`, and that effect.
    pub(crate) fn without(&self, context: &Context<'_>, k: usize) -> (Model, EffectSpec) {
        let mut model = self.fit.train.model.clone();
        let effect = model.effects.remove(context.at(k));
        (model, effect)
    }
}

/// A part of each trial of this length (s), from some time (s) before its last part on.
fn beginnings(trials: &[Trial], from: f64, length: f64) -> Vec<Trial> {
    let beginning = |trial: &Trial| {
        let latest = trial.time[trial.len() - 1] - length;
        let from = from.min(latest).max(trial.time[0]);
        let start = trial.time.partition_point(|t| *t < from);
        let end = trial.time.partition_point(|t| *t - trial.time[start] <= length);
        trial.part(start..end, trial.name.clone())
    };
    trials.iter().map(beginning).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::recording::record;
    use crate::strategy::fixture::{begun, effect, evidence, with};

    #[test]
    fn beginnings_are_where_the_last_effect_has_begun() {
        let trials = [record(&[], 50.0, 1)];
        let from_to = |from: f64| {
            let part = &beginnings(&trials, from, 30.0)[0];
            [part.time[0], part.time[part.len() - 1]].map(f64::round)
        };
        assert_eq!(from_to(f64::NEG_INFINITY), [0.0, 30.0]);
        assert_eq!(from_to(12.0), [12.0, 42.0]);
        // As long as ever where it begins late.
        assert_eq!(from_to(45.0), [20.0, 50.0]);
    }

    #[test]
    fn what_steps_back_is_a_rival_of_what_came_after_it() {
        let evidence = evidence(&[], 91);
        let (context, standing) = begun(&evidence, &Model::default());
        let idle = |cable: usize| effect("winch_viscous_friction", Some(cable), &[1.0]);
        let found =
            vec![(idle(1), Vec::new()), (idle(2), Vec::new()), (idle(3), vec![idle(4)]), (idle(4), vec![idle(2)])];
        let mut standing = with(&context, standing, found);
        standing.step_back(1, idle(2));
        let rivals = |accepted: &Accepted| accepted.rivals.iter().map(|rival| rival.cable).collect::<Vec<_>>();
        let rivals: Vec<_> = standing.accepted.iter().map(rivals).collect();
        assert_eq!(rivals, [vec![], vec![Some(4), Some(2)], vec![Some(2)]]);
        // A part of a law is nobody's rival.
        standing.step_back(0, EffectSpec { from: Some(10.0), ..idle(1) });
        assert_eq!(standing.accepted.iter().map(|accepted| accepted.rivals.len()).collect::<Vec<_>>(), [2, 1]);
    }

    #[test]
    fn a_law_that_was_divided_counts_once_and_two_count_twice() {
        let evidence = evidence(&[], 91);
        let (context, standing) = begun(&evidence, &Model::default());
        let laws = ["winch_viscous_friction", "winch_force_gain"];
        let of_two = |cable| laws.map(|id| (effect(id, Some(cable), &[1e-3]), Vec::new()));
        let found = (1..=4).flat_map(of_two).collect();
        let mut standing = with(&context, standing, found);
        assert_eq!(standing.count(), 8);
        standing.accepted.iter_mut().for_each(|accepted| accepted.divided = true);
        assert_eq!(standing.count(), 2);
        standing.accepted[0].divided = false;
        assert_eq!(standing.count(), 3);
    }

    #[test]
    fn what_is_given_up_is_noted_and_a_change_forgets_fits_without() {
        let evidence = evidence(&[], 91);
        let (context, standing) = begun(&evidence, &Model::default());
        let idle = effect("winch_viscous_friction", Some(2), &[1.0]);
        let mut standing = with(&context, standing, vec![(idle, Vec::new())]);
        standing.accepted[0].without = Some(Arc::clone(&standing.base));
        standing.accepted[0].formed_among = Some(1);
        let fit = standing.fit.clone();
        let changed = standing.clone().changed(fit);
        assert!(changed.accepted[0].without.is_none() && changed.accepted[0].formed_among.is_none());
        let (model, effect) = changed.without(&context, 0);
        assert_eq!((model.effects.len(), effect.cable), (0, Some(2)));
        let weighed = Standing {
            chance: Some(NullTest { shifts: 99, found: 20.0, as_strong: 0, over_threshold: 0, largest: 9.0 }),
            ..changed.clone()
        };
        let anew = weighed.anew();
        assert!(anew.accepted.is_empty() && anew.effects().is_empty() && anew.chance.is_none());
        let base = (*changed.base).clone();
        let given_up = changed.give_up(&context, "something else explains more", base);
        assert!(given_up.accepted.is_empty() && given_up.effects().is_empty());
        let entries = context.journal.written().entries;
        assert_eq!(entries.iter().map(|entry| entry.outcome).collect::<Vec<_>>(), [Outcome::Removed]);
    }
}
