//! Effects that the model as given has, with numbers that are not these recordings'.
//!
//! They are no candidates, for they are there; and as long as their numbers stand, others make up for what is off. So in each round it is
//! asked whether other numbers of one of them, on each of its cables if need be, promise to explain more than one more law does beside them,
//! or what the instruments ask for. Then the search begins again without that effect, and finds it anew, or what is there in its place. So it
//! does where friction was found at a winch that has a law of friction already.

use cdpr::effect::EffectSpec;
use cdpr::model_file::Model;

use crate::filter::error::FitError;
use crate::filter::estimate::Fit;
use crate::hypothesis::beside::set_found_beside;
use crate::hypothesis::candidates::catalogue;
use crate::hypothesis::parameter::free_parameters;
use crate::hypothesis::survey::{is_of_survey, set_beside};
use crate::strategy::candidates::situation;
use crate::strategy::context::Context;
use crate::strategy::each_cable::is_of_all;
use crate::strategy::instruments::better_instruments;
use crate::strategy::one_friction::at_one_winch;
use crate::strategy::round::best_gain;
use crate::strategy::standing::Standing;
use crate::weigh::criterion::EVIDENCE;
use crate::weigh::proposal::promises;
use crate::weigh::regression::ladder;
use crate::weigh::signatures::Signatures;

/// What stands; where other numbers of a given effect promise to explain more than one more law beside these, or the instruments, that is
/// marked.
pub(crate) fn given_before_more(
    context: &Context<'_>,
    standing: Standing,
    signatures: &Signatures,
) -> Result<Standing, FitError> {
    if standing.begins_anew() {
        return Ok(standing);
    }
    if let Some(at) = second_friction(context, &standing) {
        return Ok(Standing { given_is_off: Some(at), ..standing });
    }
    let asked = most_promising(context, &standing, signatures);
    let what = "Whether numbers of the effects that the model has are off could not be asked";
    let given_is_off = context.journal.or_remark(what, asked)?.flatten();
    Ok(Standing { given_is_off, ..standing })
}

/// A law of friction that the model as given has at a winch where another one was found: their sum may be right and neither be there.
fn second_friction(context: &Context<'_>, standing: &Standing) -> Option<usize> {
    let given = if context.given_may_be_off { &standing.effects()[..context.free_from] } else { &[] };
    let found = standing.found(context);
    given.iter().position(|given| found.iter().any(|found| at_one_winch(found, given)))
}

/// The given effect of which other numbers promise the most, if that is more than what else there is.
fn most_promising(
    context: &Context<'_>,
    standing: &Standing,
    signatures: &Signatures,
) -> Result<Option<usize>, FitError> {
    let given = 0..context.free_from;
    if !context.given_may_be_off || given.is_empty() {
        return Ok(None);
    }
    let mut most: Option<OtherNumbers> = None;
    // Numbers of a formula in the model are not found anew, and errors of the survey are a question of their own, with all others free.
    let asked = |at: &usize| standing.effects()[*at].expression.is_none() && !is_of_survey(&standing.effects()[*at]);
    for at in given.filter(asked) {
        let next = OtherNumbers::of(context, standing, at)?;
        if most.as_ref().is_none_or(|most| next.gain > most.gain) {
            most = Some(next);
        }
    }
    let Some(most) = most.filter(|most| most.gain > EVIDENCE) else { return Ok(None) };
    let best = best_gain(context, &standing.fit.train, signatures);
    // With both, no less is explained than by the law alone: beside these numbers it explains that less what they do.
    let first = most.gain > best || (2.0 * most.gain > best && most.gain > most.gain_beside(context));
    let first = first && better_instruments(context, &standing.fit, most.gain)?.is_none();
    Ok(first.then_some(most.at))
}

/// Other numbers of a given effect.
struct OtherNumbers {
    at: usize,
    /// The effects that have them: that one, or one on each of its cables.
    copies: usize,
    /// What stands with these.
    fit: Fit,
    /// What they promise to gain (fall of the criterion).
    gain: f64,
}

impl OtherNumbers {
    /// Of given effect `at`: the same on all its cables, or on each its own.
    fn of(context: &Context<'_>, standing: &Standing, at: usize) -> Result<Self, FitError> {
        let fit = &standing.fit.train;
        let same = Self::promised(context, standing, at, &fit.model, 1)?;
        if !is_of_all(&fit.model.effects[at]) {
            return Ok(same);
        }
        let cables = fit.model.parameters.cables();
        let on = |cable: usize| EffectSpec { cable: Some(cable), ..fit.model.effects[at].clone() };
        let mut divided = fit.model.clone();
        // In its place, so that states of effects stay in their order.
        divided.effects.splice(at..=at, (1..=cables).map(on));
        let apart = Self::promised(context, standing, at, &divided, cables)?;
        Ok(if apart.gain > same.gain { apart } else { same })
    }

    fn promised(
        context: &Context<'_>,
        standing: &Standing,
        at: usize,
        model: &Model,
        copies: usize,
    ) -> Result<Self, FitError> {
        let (trials, stands) = (&context.evidence.train, &standing.fit.train);
        let fit = context.started(model, stands, trials)?;
        let mut free = free_parameters(&fit.model, at);
        free.retain(|free| free.effect < at + copies || free.effect + 1 >= context.free_from + copies);
        let own = free.iter().filter(|free| free.effect < at + copies).count();
        let promised = promises(&fit, trials, &free, &ladder(&fit.randomness)).into_iter();
        let least = promised.map(|promise| promise.minus_two_log_likelihood).fold(f64::INFINITY, f64::min);
        let now = stands.minus_two_log_likelihood(trials, &stands.randomness);
        Ok(Self { at, copies, fit, gain: now - least - context.penalty.of(own) })
    }

    /// What the best candidate promises to gain where these numbers move along with it.
    fn gain_beside(&self, context: &Context<'_>) -> f64 {
        let (model, more) = (&self.fit.model, self.copies - 1);
        let mut library = catalogue(model, &situation(context, &self.fit));
        set_beside(&mut library, model, context.free_from + more..context.given + more);
        set_found_beside(&mut library, model, context.given + more..model.effects.len());
        set_found_beside(&mut library, model, self.at..self.at + self.copies);
        best_gain(context, &self.fit, &Signatures::new(library))
    }
}

/// What is said of each effect that was `taken_out` of the model as given because its numbers are off; `found` are those that stand now.
pub(crate) fn not_found_again<'a>(taken_out: &'a [EffectSpec], found: &[EffectSpec]) -> Vec<&'a EffectSpec> {
    let again = |given: &&EffectSpec| !found.iter().any(|found| stands_for(found, given));
    taken_out.iter().filter(again).collect()
}

/// Whether an effect that was found is a given one with other numbers, on all its cables or some.
pub(crate) fn stands_for(found: &EffectSpec, given: &EffectSpec) -> bool {
    let same_place = given.cable.is_none() || found.cable.is_none() || given.cable == found.cable;
    found.id == given.id && found.channel == given.channel && same_place
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::strategy::candidates::signatures;
    use crate::strategy::fixture::{begun, effect, evidence, with};
    use crate::weigh::signatures::Source;

    /// Viscous friction that is a third larger than the model has it, on all winches or on one of them; none; and drag that is missing beside
    /// a friction as it is.
    #[test]
    fn numbers_that_are_off_are_marked_before_a_law_that_makes_up_for_them() {
        let viscous = |cable, size: f64| effect("winch_viscous_friction", cable, &[size]);
        let drag = effect("platform_linear_drag", None, &[60.0]);
        let given = [effect("winch_force_gain", Some(3), &[0.01]), viscous(None, 300.0)];
        let gain = given[0].clone();
        let each = |second: f64| {
            [300.0, second, 300.0, 300.0].into_iter().zip(1..).map(|(size, cable)| viscous(Some(cable), size))
        };
        let cases = [
            (vec![gain.clone(), viscous(None, 400.0)], Some(1)),
            ([gain.clone()].into_iter().chain(each(600.0)).collect(), Some(1)),
            (vec![effect("winch_force_gain", Some(3), &[0.02]), viscous(None, 300.0)], Some(0)),
            (given.to_vec(), None),
            (vec![gain, viscous(None, 300.0), drag], None),
        ];
        for (hidden, off) in cases {
            let evidence = evidence(&hidden, 87);
            let model = Model { effects: given.to_vec(), ..Model::default() };
            let (mut context, standing) = begun(&evidence, &model);
            let signatures = signatures(&context, &standing, &standing.fit, Source::Catalogue);
            let asked = given_before_more(&context, standing.clone(), &signatures).expect("an answer");
            assert_eq!((asked.given_is_off, asked.begins_anew()), (None, false));
            context.given_may_be_off = true;
            let asked = given_before_more(&context, standing, &signatures).expect("an answer");
            assert_eq!((asked.given_is_off, asked.begins_anew()), (off, off.is_some()), "{hidden:?}");
        }
    }

    /// A length of a real log that counted from another zero than the model says was taken out, for errors of the survey took its place.
    #[test]
    fn errors_of_the_survey_are_not_asked_for_other_numbers() {
        let zero = |size: f64| effect("length_sensor_bias", Some(2), &[size]);
        let evidence = evidence(&[zero(0.05)], 87);
        let (mut context, standing) = begun(&evidence, &Model { effects: vec![zero(0.02)], ..Model::default() });
        context.given_may_be_off = true;
        let signatures = signatures(&context, &standing, &standing.fit, Source::Catalogue);
        assert_eq!(most_promising(&context, &standing, &signatures).expect("an answer"), None);
    }

    /// Coulomb friction that turns its sign in another way than the model has it was left to Stribeck friction beside it.
    #[test]
    fn a_second_law_of_friction_at_a_winch_puts_the_first_in_question() {
        let evidence = evidence(&[], 87);
        let coulomb = |cable| effect("winch_coulomb_friction", cable, &[120.0, 0.01]);
        let model =
            Model { effects: vec![effect("winch_force_gain", None, &[0.01]), coulomb(Some(2))], ..Model::default() };
        let (mut context, standing) = begun(&evidence, &model);
        context.given_may_be_off = true;
        let capstan = effect("pulley_capstan_loss", Some(2), &[1e-3, 0.01]);
        let viscous = effect("winch_viscous_friction", Some(2), &[1.0]);
        for (law, second) in [(capstan, Some(1)), (viscous, None)] {
            let found = vec![(law, Vec::new())];
            assert_eq!(second_friction(&context, &with(&context, standing.clone(), found)), second);
        }
        let other = vec![(coulomb(Some(1)), Vec::new())];
        assert_eq!(second_friction(&context, &with(&context, standing, other)), None);
    }

    #[test]
    fn a_given_effect_is_found_again_on_all_its_cables_or_one() {
        let friction = |cable| effect("winch_viscous_friction", cable, &[300.0]);
        let given = [friction(None), effect("winch_force_gain", Some(3), &[0.01])];
        assert_eq!(not_found_again(&given, &[friction(Some(2))]), [&given[1]]);
        assert_eq!(not_found_again(&given, &[effect("winch_force_gain", Some(2), &[0.01])]).len(), 2);
        assert_eq!(not_found_again(&given, &given), Vec::<&EffectSpec>::new());
    }
}
