//! One law of friction at a winch in the place of two.
//!
//! Friction that turns its sign in another way than the plain law leaves something, which another law of friction at the same winch
//! explains in part; their sum is right and neither is there. What stands alone gets the form that it needs, as any friction.

use cdpr::effect::EffectSpec;
use rayon::prelude::*;

use crate::filter::error::FitError;
use crate::hypothesis::extension::is_one_law;
use crate::hypothesis::friction::is_friction;
use crate::journal::Outcome;
use crate::strategy::context::Context;
use crate::strategy::every_cable::as_good;
use crate::strategy::fitted::Fitted;
use crate::strategy::form::Forms;
use crate::strategy::standing::Standing;

/// What stands with one law of friction wherever two act at the same winch and one, in the form that it then needs, is as good.
pub(crate) fn one_friction(context: &Context<'_>, mut standing: Standing) -> Standing {
    let mut tried: Vec<[EffectSpec; 2]> = Vec::new();
    loop {
        let found = standing.found(context);
        let pairs = (0..found.len()).flat_map(|a| (0..a).map(move |b| [a, b]));
        let untried = pairs.filter(|[a, b]| at_one_winch(&found[*a], &found[*b])).find(|pair| {
            let laws = pair.map(|k| &found[k]);
            !tried.iter().any(|other| {
                other.iter().zip(laws).all(|(other, law)| is_one_law(other, law) && other.from == law.from)
            })
        });
        let Some(pair) = untried else { return standing };
        tried.push(pair.map(|k| found[k].clone()));
        standing = one_of(context, standing, pair);
    }
}

/// What stands with the better one of two laws in the place of both, if that is as good.
fn one_of(context: &Context<'_>, standing: Standing, [a, b]: [usize; 2]) -> Standing {
    (context.progress)("asking one law of friction to do what two do", 0.2);
    let found = standing.found(context);
    let can_stand = |(kept, out): &(usize, usize)| acts_wherever(&found[*kept], &found[*out]);
    let tried = [(a, b), (b, a)].into_par_iter().filter(can_stand).filter_map(|(kept, out)| {
        let one = context.journal.tried(&found[kept], "alone at its winch", alone(context, &standing, kept, out));
        one.flatten().map(|fit| (kept, out, fit))
    });
    let best = context.journal.side_by_side(|| tried.min_by(|a, b| a.2.score.total_cmp(&b.2.score)));
    let Some((kept, out, next)) = best else { return standing };
    let (old, taken_out) = (standing.found(context)[kept].clone(), standing.found(context)[out].clone());
    let change = next.score - standing.fit.score;
    let explained = standing.accepted[kept].delta_bic + standing.accepted[out].delta_bic;
    let mut standing = standing.changed(next);
    let one = &mut standing.accepted[kept];
    one.delta_bic = explained;
    one.alternatives.clear();
    one.rivals.extend([old, taken_out.clone()]);
    standing.accepted.remove(out);
    let kept = kept - usize::from(out < kept);
    let law = standing.found(context)[kept].clone();
    let among = standing.effects().len();
    let one = &mut standing.accepted[kept];
    one.rivals.retain(|rival| rival.id != law.id);
    one.formed_among = Some(among);
    context.journal.note(
        &law,
        Outcome::Replaced,
        change,
        &format!("alone in the place of two, {} the other", taken_out.id),
    );
    standing
}

/// What stands without the law `out` and with the one that is `kept` in the form that it then needs, if that is as good.
fn alone(context: &Context<'_>, standing: &Standing, kept: usize, out: usize) -> Result<Option<Fitted>, FitError> {
    let (model, _) = standing.without(context, out);
    let at = context.at(kept) - usize::from(out < kept);
    let forms = Forms { context, beginnings: &standing.beginnings };
    let formed = forms.anew(&model, &standing.begun(context, &standing.fit.train)?, at)?;
    as_good(context, &formed.fit.model, &standing.fit)
}

/// Whether one law acts at every winch where another does: friction of one winch stands in the place of none that all have.
fn acts_wherever(law: &EffectSpec, other: &EffectSpec) -> bool {
    law.cable.is_none() || law.cable == other.cable
}

/// Whether two effects are laws of friction at one winch, at work at the same times.
pub(crate) fn at_one_winch(a: &EffectSpec, b: &EffectSpec) -> bool {
    let one_place = a.cable == b.cable || a.cable.is_none() || b.cable.is_none();
    is_friction(a) && is_friction(b) && one_place && (a.from, a.until) == (b.from, b.until)
}

#[cfg(test)]
mod tests {
    use cdpr::model_file::Model;

    use super::*;
    use crate::strategy::fixture::{begun, effect, evidence, names, with};

    /// What stands after Coulomb friction and a capstan loss of winch 2 were found, where `hidden` acts.
    fn stands(hidden: &[EffectSpec]) -> (Vec<(String, Option<usize>)>, usize) {
        let evidence = evidence(hidden, 95);
        let (context, standing) = begun(&evidence, &Model::default());
        let coulomb = effect("winch_coulomb_friction", Some(2), &[200.0, 0.02]);
        let loss = effect("pulley_capstan_loss", Some(2), &[0.005, 0.02]);
        let standing = with(&context, standing, vec![(coulomb, Vec::new()), (loss, Vec::new())]);
        let one = one_friction(&context, standing);
        (names(&context, &one), one.accepted.len())
    }

    /// Of 220 N on all winches of the telescope, so smoothed, Coulomb friction of 60 N and Stribeck friction of 159 N were named.
    #[test]
    fn friction_of_another_form_is_one_law() {
        let algebraic = effect("winch_coulomb_friction", Some(2), &[400.0, 0.1, 0.0, 1.0]);
        assert_eq!(stands(&[algebraic]), (vec![("winch_coulomb_friction".to_owned(), Some(2))], 1));
    }

    /// On a log of a real robot friction of winch 1 stood in the place of that of all winches beside a loss of winch 1; the others had
    /// none then, and what they had was read as an umbilical.
    #[test]
    fn friction_of_one_winch_stands_in_the_place_of_none_that_all_have() {
        let coulomb = |cable| effect("winch_coulomb_friction", cable, &[200.0, 0.02]);
        let (all, one, other) = (coulomb(None), coulomb(Some(1)), coulomb(Some(2)));
        assert!(acts_wherever(&all, &one) && acts_wherever(&one, &one) && acts_wherever(&all, &all));
        assert!(!acts_wherever(&one, &all) && !acts_wherever(&one, &other));
    }

    #[test]
    fn two_laws_that_are_there_stay() {
        let coulomb = effect("winch_coulomb_friction", Some(2), &[200.0, 0.02]);
        let loss = effect("pulley_capstan_loss", Some(2), &[0.01, 0.02]);
        assert_eq!(stands(&[coulomb, loss]).1, 2);
    }
}
