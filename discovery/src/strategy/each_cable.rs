//! A law on each cable, with parameters of its own, in the place of one on every cable.
//!
//! Winches of one machine have the same kind of friction, and not as much of it. One law of all takes the mean, and what is left looks
//! like other laws of single winches, of which none is there. So where a law of all leaves something it is tried apart; winches that then
//! have next to nothing of it are left out.

use cdpr::effect::{EffectSpec, Scope};
use cdpr::model_file::Model;

use crate::filter::error::FitError;
use crate::hypothesis::extension::count_in_use;
use crate::hypothesis::parameter::free_parameters;
use crate::hypothesis::term;
use crate::journal::Outcome;
use crate::strategy::context::{self, Context};
use crate::strategy::fitted::Fitted;
use crate::strategy::form::form_if;
use crate::strategy::standing::{Accepted, Standing};
use crate::weigh::criterion::EVIDENCE;
use crate::weigh::proposal::promises;
use crate::weigh::regression::ladder;

/// What stands with a law on each cable in the place of every law that stands on all and leaves something, if that explains more, and more
/// than this share of the evidence that is left: what else is missing may look like other sizes.
pub(crate) fn on_each_cable(context: &Context<'_>, mut standing: Standing, share: f64) -> Standing {
    if standing.alike == Some((standing.fit.score, share)) {
        return standing;
    }
    let mut k = 0;
    while k < standing.accepted.len() && standing.fit.gap[0] > context.policy.nothing_left {
        let law = standing.found(context)[k].clone();
        let apart = if is_of_all(&law) { apart(context, &standing, k) } else { Ok(None) };
        match context.journal.tried(&law, "on each cable by itself", apart).flatten() {
            Some(next) => match in_their_form(context, &standing, k, next, share) {
                Some(divided) => standing = divided,
                None => k += 1,
            },
            None => k += 1,
        }
    }
    standing.alike = Some((standing.fit.score, share));
    standing
}

/// Whether it is a law that a cable has, on all of them.
pub(crate) fn is_of_all(law: &EffectSpec) -> bool {
    law.cable.is_none() && law.info().is_ok_and(|info| info.scope == Scope::EachCable)
}

/// What stands with `next` in the place of law `k`, if that explains more than a share of the evidence that is left; with the form that
/// friction then needs where sizes alone explain less, for neither shows as long as the other is not there.
fn in_their_form(context: &Context<'_>, standing: &Standing, k: usize, next: Fitted, share: f64) -> Option<Standing> {
    let begun = context.journal.len();
    let explained = |fit: &Fitted| context::share(standing.fit.score, &fit.train, fit.score, &context.evidence.train);
    let mut divided = split(context, standing.clone(), k, next);
    let by_sizes = explained(&divided.fit);
    if by_sizes < share {
        divided = form_if(context, divided, (share - by_sizes) / (1.0 - by_sizes));
    }
    if explained(&divided.fit) >= share {
        return Some(divided);
    }
    context.journal.refuse_since(begun, "so much else is left that it may only look like other sizes");
    None
}

/// What is fitted with law `k` on each cable that has it, if that explains more.
fn apart(context: &Context<'_>, standing: &Standing, k: usize) -> Result<Option<Fitted>, FitError> {
    let (policy, stands) = (context.policy, &standing.fit);
    let (mut model, law) = standing.without(context, k);
    let first = model.effects.len();
    let on = |cable: usize| EffectSpec { cable: Some(cable), ..law.clone() };
    model.effects.extend((1..=model.parameters.cables()).map(on));
    if !promises_more(context, stands, &model, first, count_in_use(&law))? {
        return Ok(None);
    }
    let mut next = context.fit(&model, stands)?;
    while next.train.model.effects.len() > first + 1 {
        let certain = context.certainty(&next).wald;
        let least = (first..certain.len()).min_by(|a, b| certain[*a].total_cmp(&certain[*b]));
        let Some(least) = least.filter(|at| certain[*at] < policy.uncertain) else { break };
        let mut model = next.train.model.clone();
        model.effects.remove(least);
        let without = context.fit(&model, &next)?;
        if without.score >= next.score + EVIDENCE {
            break;
        }
        next = without;
    }
    let better = next.score < stands.score - EVIDENCE && next.helps(stands, policy);
    Ok(better.then_some(next))
}

/// Whether to first order a `model`, which has one law of so many parameters on each cable behind its `first` effects in the place of one on
/// all, explains more than what stands by more than one law more costs, where these differ in size alone: unlike shapes of one size are a
/// form that is not the law's.
fn promises_more(
    context: &Context<'_>,
    stands: &Fitted,
    model: &Model,
    first: usize,
    parameters: usize,
) -> Result<bool, FitError> {
    let trials = &context.evidence.train;
    let fit = context.started(model, &stands.train, trials)?;
    let mut free = free_parameters(&fit.model, context.free_from);
    free.retain(|free| free.effect < first || !term::is_shape(&fit.model.effects[free.effect], free.parameter));
    let promised = promises(&fit, trials, &free, &ladder(&fit.randomness)).into_iter();
    let least = promised.map(|promise| promise.minus_two_log_likelihood).fold(f64::INFINITY, f64::min);
    let now = stands.train.minus_two_log_likelihood(trials, &stands.train.randomness);
    Ok(now - least > context.penalty.of(parameters) + EVIDENCE)
}

/// What stands with `next`, whose last laws are on single cables in the place of law `k`.
fn split(context: &Context<'_>, mut standing: Standing, k: usize, next: Fitted) -> Standing {
    let old = standing.accepted.remove(k);
    let change = next.score - standing.fit.score;
    let mut standing = standing.changed(next);
    let laws = standing.found(context)[standing.accepted.len()..].to_vec();
    let share = (old.delta_bic + change) / laws.len() as f64;
    for law in laws {
        context.journal.note(
            &law,
            Outcome::Replaced,
            change,
            "on each cable that has it in the place of one law on all",
        );
        let here = |rival: &EffectSpec| EffectSpec {
            cable: if is_of_all(rival) { law.cable } else { rival.cable },
            ..rival.clone()
        };
        let accepted = Accepted::new(old.rivals.iter().map(here).collect(), share, old.null_test);
        standing.accepted.push(Accepted { divided: true, ..accepted });
    }
    standing
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::strategy::fixture::{begun, effect, evidence, names, with};
    use crate::strategy::policy::POLICY;

    /// What stands where plain friction of all winches was found, with its forces, and so much of it is on each winch, with presliding of
    /// so much for each newton.
    fn stands(forces: [f64; 4], presliding: &[f64]) -> (Vec<(String, Option<usize>)>, Vec<f64>) {
        let friction = |cable, force: f64, presliding: &[f64]| {
            let form = presliding.iter().map(|share| share * force);
            let values: Vec<f64> = [force, 0.02, 0.0, 0.0].into_iter().chain(form).collect();
            effect("winch_coulomb_friction", cable, &values)
        };
        let hidden: Vec<EffectSpec> = (1..=4)
            .zip(forces)
            .filter(|(_, force)| *force > 0.0)
            .map(|(cable, force)| friction(Some(cable), force, presliding))
            .collect();
        let evidence = evidence(&hidden, 96);
        let (context, standing) = begun(&evidence, &Model::default());
        let standing = with(&context, standing, vec![(friction(None, 120.0, &[]), Vec::new())]);
        let apart = on_each_cable(&context, standing, POLICY.most);
        assert_eq!(apart.accepted.len(), apart.found(&context).len());
        assert_eq!(apart.count(), 1);
        (names(&context, &apart), apart.found(&context).iter().map(|law| law.values[0]).collect())
    }

    fn friction_of(cables: &[Option<usize>]) -> Vec<(String, Option<usize>)> {
        cables.iter().map(|cable| ("winch_coulomb_friction".to_owned(), *cable)).collect()
    }

    /// The first came out as Coulomb friction of all winches and Stribeck friction of three.
    #[test]
    fn friction_of_another_size_on_each_winch_is_found_on_each() {
        for forces in [[80.0, 140.0, 110.0, 190.0], [0.0, 110.0, 0.0, 160.0]] {
            let (names, found) = stands(forces, &[]);
            let there: Vec<(usize, f64)> = (1..=4).zip(forces).filter(|(_, force)| *force > 0.0).collect();
            assert_eq!(names, friction_of(&there.iter().map(|(cable, _)| Some(*cable)).collect::<Vec<_>>()));
            for ((_, force), found) in there.iter().zip(found) {
                assert!((found / force - 1.0).abs() < 0.05, "{found} {force}");
            }
        }
    }

    /// Presliding on two of four: the sizes explain less than half without the form, and the form less than half without the sizes.
    #[test]
    fn sizes_and_the_form_that_friction_has_beside_them_are_asked_together() {
        let (names, found) = stands([0.0, 110.0, 0.0, 160.0], &[200.0, 8.0]);
        assert_eq!(names, friction_of(&[Some(2), Some(4)]));
        assert!((found[0] / 110.0 - 1.0).abs() < 0.1 && (found[1] / 160.0 - 1.0).abs() < 0.1, "{found:?}");
    }

    #[test]
    fn friction_of_one_size_stays_one_law() {
        assert_eq!(stands([120.0; 4], &[]).0, friction_of(&[None]));
    }
}
