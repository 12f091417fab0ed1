//! What was found, settled: pruned, and every effect compared with its rivals.

use cdpr::effect::EffectSpec;
use cdpr::model_file::Model;

use crate::filter::error::FitError;
use crate::hypothesis::containing::containing;
use crate::hypothesis::extension::count_in_use;
use crate::journal::Outcome;
use crate::outcome::Alternative;
use crate::strategy::context::Context;
use crate::strategy::every_cable::on_every_cable;
use crate::strategy::fitted::Trained;
use crate::strategy::form::settle_extensions;
use crate::strategy::one_friction::one_friction;
use crate::strategy::onset::settle_times;
use crate::strategy::prune::prune;
use crate::strategy::rivals::{Rival, all_rivals};
use crate::strategy::standing::Standing;
use crate::verdict::{POLICY, out_of_range};
use crate::weigh::criterion::told_apart_from;

/// Prunes, compares every effect with its rivals, and takes up a rival that is clearly better; then again, because what
/// stood beside the wrong one may have made up for it only.
pub(crate) fn settle(context: &Context<'_>, mut standing: Standing) -> Result<Standing, FitError> {
    (context.progress)("comparing explanations", 0.75);
    let most = context.policy.most_replacements;
    standing = one_friction(context, standing);
    // What was replaced last is compared as well.
    for round in 0..=most {
        standing = prune(context, standing)?;
        let (next, replaced) = compare(context, standing, round < most);
        let score = next.fit.score;
        standing = if replaced { settle_extensions(context, next) } else { next };
        if !replaced || (standing.accepted.len() == 1 && standing.fit.score == score) {
            break;
        }
    }
    let standing = settle_times(context, standing);
    let each = standing.laws();
    let standing = on_every_cable(context, standing);
    Ok(if standing.laws() == each { standing } else { compare(context, standing, false).0 })
}

/// Compares every effect with its rivals, of which a better one may replace it; stops where that happened and several stand.
fn compare(context: &Context<'_>, mut standing: Standing, may_replace: bool) -> (Standing, bool) {
    let mut any = false;
    for (k, mut rivals) in all_rivals(context, &standing).into_iter().enumerate() {
        let mut replaced = false;
        // What does not go with the held-out data leaves its place to the next.
        while may_replace && !replaced && rivals.first().is_some_and(|rival| is_better(context, &standing, k, rival)) {
            (standing, replaced) = take_up(context, standing, k, &mut rivals);
        }
        let standing_law = &standing.found(context)[k];
        let explained = standing.accepted[k].delta_bic;
        let model = &standing.fit.train.model;
        let mut alternatives: Vec<Alternative> =
            rivals.into_iter().map(|rival| alternative(rival, standing_law, explained, model)).collect();
        alternatives.sort_by(|a, b| a.delta_bic.total_cmp(&b.delta_bic));
        standing.accepted[k].alternatives = alternatives;
        if replaced && standing.accepted.len() > 1 {
            return (standing, true);
        }
        any |= replaced;
    }
    (standing, any)
}

/// Whether a rival of effect `k` is better. A richer law must be better by what counts; one as simple, at all.
fn is_better(context: &Context<'_>, standing: &Standing, k: usize, rival: &Rival) -> bool {
    let richer = count_in_use(&rival.effect) > count_in_use(&standing.found(context)[k]);
    let limit = if richer { 2.0 * told_apart_from(standing.accepted[k].delta_bic) } else { 0.0 };
    rival.delta_bic < -limit && !out_of_range(&rival.effect, &[], &standing.fit.train.model, &POLICY)
}

/// What is reported of a rival in the place of a law of a model that explains so much.
fn alternative(rival: Rival, standing: &EffectSpec, explained: f64, model: &Model) -> Alternative {
    // What contains the law that stands and is no better with what it has more, is that law.
    let needless = || {
        let containing = containing(&rival.effect.id, standing).is_some();
        rival.delta_bic > 0.0 && rival.effect.cable == standing.cable && containing
    };
    Alternative {
        separate_by: separate_by(standing, &rival.effect),
        indistinguishable: rival.as_likely(explained)
            && !out_of_range(&rival.effect, &[], model, &POLICY)
            && !needless(),
        delta_bic: rival.delta_bic,
        correlation: None,
        effect: rival.effect,
    }
}

/// What stands with the best of the `rivals` of effect `k` in its place, and the effect among the rivals; whether that could be
/// done.
fn take_up(context: &Context<'_>, standing: Standing, k: usize, rivals: &mut Vec<Rival>) -> (Standing, bool) {
    let Rival { effect, delta_bic, price, overdispersion, whole: Some(whole) } = rivals.remove(0) else {
        return (standing, false);
    };
    let old = standing.found(context)[k].clone();
    let better = context.verified(whole, &standing.fit);
    let what = format!("in place of {} on held-out data", old.id);
    let Some(better) = context.journal.tried(&effect, &what, better) else { return (standing, false) };
    let reason = format!("in place of {}", old.id);
    context.journal.note(&effect, Outcome::Replaced, delta_bic, &reason);
    let before = standing.fit.clone();
    let mut standing = standing.changed(better);
    let accepted = &mut standing.accepted[k];
    accepted.delta_bic += delta_bic;
    accepted.rivals.retain(|rival| rival.id != effect.id);
    accepted.rivals.push(old.clone());
    // What is known on the beginnings alone was compared with the law that stood there.
    rivals.retain(|rival| rival.whole.is_some());
    rivals
        .iter_mut()
        .for_each(|rival| (rival.delta_bic, rival.price) = (rival.delta_bic - delta_bic, rival.price - price));
    let whole = Trained { fit: before.train, score: before.score };
    rivals.push(Rival { effect: old, delta_bic: -delta_bic, price: -price, overdispersion, whole: Some(whole) });
    (standing, true)
}

/// The experiment that tells two effects apart, from the catalogue.
fn separate_by(a: &EffectSpec, b: &EffectSpec) -> String {
    let look = |from: &EffectSpec, to: &EffectSpec| {
        cdpr::effect::find(&from.id)
            .and_then(|info| info.look_alikes.iter().find(|l| l.id == to.id))
            .map(|l| l.separate_by.to_owned())
    };
    if a.id == b.id {
        return "move one winch at a time".to_owned();
    }
    look(a, b).or_else(|| look(b, a)).unwrap_or_else(|| {
        "repeat with larger and faster motion at two pretensions, one winch excited at a time".to_owned()
    })
}

#[cfg(test)]
mod tests {
    use cdpr::model_file::Model;

    use super::*;
    use crate::strategy::fixture::{begun, effect, evidence, names, with};

    #[test]
    fn a_rival_that_is_clearly_better_takes_the_place_and_the_effect_is_its_rival() {
        let linear = effect("platform_linear_drag", None, &[60.0]);
        let evidence = evidence(std::slice::from_ref(&linear), 75);
        let (context, standing) = begun(&evidence, &Model::default());
        let quadratic = effect("platform_quadratic_drag", None, &[60.0, 0.0, 0.0]);
        let standing = with(&context, standing, vec![(quadratic, vec![linear])]);
        let settled = settle(&context, standing).expect("a fit");
        assert_eq!(names(&context, &settled), [("platform_linear_drag".to_owned(), None)]);
        let mut alternatives = settled.accepted[0].alternatives.iter();
        let alternative = alternatives.find(|other| other.effect.id == "platform_quadratic_drag").expect("a rival");
        assert!(alternative.delta_bic > 0.0 && !alternative.indistinguishable, "{alternative:?}");
        let entries = context.journal.written().entries;
        assert!(entries.iter().any(|entry| entry.outcome == Outcome::Replaced), "{entries:?}");
    }

    /// Friction on a real robot gave way to an umbilical that came in after it, of which nobody said that it may be the friction.
    #[test]
    fn a_law_whose_work_another_does_is_compared_with_it() {
        let quadratic = effect("platform_quadratic_drag", None, &[60.0, 0.0, 0.0]);
        let evidence = evidence(std::slice::from_ref(&quadratic), 75);
        let (context, standing) = begun(&evidence, &Model::default());
        let linear = effect("platform_linear_drag", None, &[60.0]);
        let standing = with(&context, standing, vec![(linear, Vec::new()), (quadratic, Vec::new())]);
        let settled = settle(&context, standing).expect("a fit");
        assert_eq!(names(&context, &settled), [("platform_quadratic_drag".to_owned(), None)]);
        let mut alternatives = settled.accepted[0].alternatives.iter();
        assert!(alternatives.any(|other| other.effect.id == "platform_linear_drag"));
    }

    /// Wind on the cables came out as drag of the platform in wind, with a gap of 4.8 left.
    #[test]
    fn a_law_that_another_stood_for_takes_its_place_where_something_is_left() {
        let hidden = effect("cable_wind", None, &[6.0, -3.0, 0.015, 0.0, 0.0, 10.0]);
        let evidence = evidence(std::slice::from_ref(&hidden), 95);
        let (context, standing) = begun(&evidence, &Model::default());
        let drag = effect("platform_quadratic_drag", None, &[3.5, 7.5, -6.2]);
        let standing = with(&context, standing, vec![(drag, Vec::new())]);
        assert!(standing.fit.gap[0] > context.policy.nothing_left, "{:?}", standing.fit.gap);
        let settled = settle(&context, standing).expect("a fit");
        assert_eq!(names(&context, &settled), [("cable_wind".to_owned(), None)]);
        let found = &settled.found(&context)[0].values;
        assert!(
            found.iter().zip(&hidden.values).all(|(found, hidden)| (found - hidden).abs() <= 0.05 * hidden.abs()),
            "{found:?}"
        );
    }
}
