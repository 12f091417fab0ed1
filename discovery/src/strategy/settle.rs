//! What was found, settled: pruned, compared with its rivals, and with terms outside the catalogue on top or in its place.

use cdpr::effect::EffectSpec;

use crate::filter::estimate::FitError;
use crate::hypothesis::extension::{containing, count_in_use};
use crate::journal::Outcome;
use crate::outcome::Alternative;
use crate::strategy::fitted::{Fitted, Trained};
use crate::strategy::rivals::{Rival, told_apart_from};
use crate::strategy::search::{Search, Taken};
use crate::verdict::{POLICY, out_of_range};

/// Share of the gap of what was named that terms in its place may leave.
const CLEARLY: f64 = 0.8;
/// Most replacements of one effect by another.
const MOST_REPLACEMENTS: usize = 4;

/// Prunes, compares every effect with its rivals, and takes up a rival that is clearly better; then again, because what
/// stood beside the wrong one may have made up for it only.
pub(crate) fn settle(search: &mut Search<'_>, base: &Fitted, mut fitted: Fitted) -> Result<Fitted, FitError> {
    (search.progress)("comparing explanations", 0.75);
    // What was replaced last is compared as well.
    for round in 0..=MOST_REPLACEMENTS {
        fitted = search.prune(base, fitted)?;
        let (next, replaced) = compare(search, fitted, round < MOST_REPLACEMENTS);
        let score = next.score;
        fitted = if replaced { search.settle_extensions(next) } else { next };
        if !replaced || (search.taken.len() == 1 && fitted.score == score) {
            break;
        }
    }
    let fitted = search.settle_times(fitted);
    let several = search.taken.len();
    let fitted = search.on_every_cable(fitted);
    Ok(if search.taken.len() < several { compare(search, fitted, false).0 } else { fitted })
}

/// Compares every effect with its rivals, of which a better one may replace it; stops where that happened and several stand.
fn compare(search: &mut Search<'_>, mut fitted: Fitted, may_replace: bool) -> (Fitted, bool) {
    let mut any = false;
    for (k, mut rivals) in search.all_rivals(&fitted).into_iter().enumerate() {
        let at = search.given + k;
        let better = |search: &Search<'_>, fitted: &Fitted, rival: &Rival| {
            // A richer law must be better by what counts; one as simple, at all.
            let richer = count_in_use(&rival.effect) > count_in_use(&fitted.train.model.effects[at]);
            let limit = if richer { 2.0 * told_apart_from(search.taken[k].delta_bic) } else { 0.0 };
            rival.delta_bic < -limit && !out_of_range(&rival.effect, &POLICY)
        };
        let mut replaced = false;
        // What does not go with the held-out data leaves its place to the next.
        while may_replace && !replaced && rivals.first().is_some_and(|rival| better(search, &fitted, rival)) {
            replaced = take_up(search, &mut fitted, at, &mut rivals);
        }
        let explained = search.taken[k].delta_bic;
        // What contains the law that stands and is no better with what it has more, is that law.
        let standing = &fitted.train.model.effects[at];
        let needless = |rival: &Rival| {
            let containing = containing(&rival.effect.id, standing).is_some();
            rival.delta_bic > 0.0 && rival.effect.cable == standing.cable && containing
        };
        let to_alternative = |rival: Rival| Alternative {
            separate_by: separate_by(standing, &rival.effect),
            indistinguishable: rival.as_likely(explained) && !out_of_range(&rival.effect, &POLICY) && !needless(&rival),
            effect: rival.effect,
            delta_bic: rival.delta_bic,
            correlation: None,
        };
        let mut list: Vec<Alternative> = rivals.into_iter().map(to_alternative).collect();
        list.sort_by(|a, b| a.delta_bic.total_cmp(&b.delta_bic));
        search.taken[k].alternatives = list;
        if replaced && search.taken.len() > 1 {
            return (fitted, true);
        }
        any |= replaced;
    }
    (fitted, any)
}

/// Puts the best of the `rivals` of effect `at` in its place, and the effect among the rivals; whether that could be done.
fn take_up(search: &mut Search<'_>, fitted: &mut Fitted, at: usize, rivals: &mut Vec<Rival>) -> bool {
    let Rival { effect, delta_bic, price, overdispersion, whole: Some(whole) } = rivals.remove(0) else { return false };
    let better = search.verified(whole, fitted);
    let what = format!("in place of {} on held-out data", fitted.train.model.effects[at].id);
    let Some(better) = search.journal.tried(&effect, &what, better) else { return false };
    let before = std::mem::replace(fitted, better);
    let old = before.train.model.effects[at].clone();
    let reason = format!("in place of {}", old.id);
    search.journal.note(&effect, Outcome::Replaced, delta_bic, &reason);
    let taken = &mut search.taken[at - search.given];
    taken.delta_bic += delta_bic;
    taken.rivals.retain(|rival| rival.id != effect.id);
    taken.rivals.push(old.clone());
    search.taken.iter_mut().for_each(Taken::changed);
    rivals
        .iter_mut()
        .for_each(|rival| (rival.delta_bic, rival.price) = (rival.delta_bic - delta_bic, rival.price - price));
    let whole = Trained { fit: before.train, estimate: before.estimate, score: before.score };
    rivals.push(Rival { effect: old, delta_bic: -delta_bic, price: -price, overdispersion, whole: Some(whole) });
    true
}

/// Terms outside the catalogue: on top of what was found, or instead of it, whichever explains more.
pub(crate) fn beyond_catalogue(search: &mut Search<'_>, base: &Fitted, fitted: Fitted) -> Result<Fitted, FitError> {
    let nothing_found = search.taken.is_empty();
    let mut best = fitted;
    if let Some(with_terms) = search.dictionary_rounds(&best, None)? {
        best = search.prune(base, with_terms)?;
    }
    if nothing_found {
        return Ok(best);
    }
    // Perhaps what was found only stood for what is outside the catalogue.
    let kept = std::mem::take(&mut search.taken);
    if let Some(instead) = search.dictionary_rounds(base, Some(best.score))? {
        let instead = search.prune(base, instead)?;
        if instead.score < best.score && instead.left() < CLEARLY * best.left() {
            return Ok(instead);
        }
    }
    search.taken = kept;
    Ok(best)
}

/// Several effects that leave something to latent forces, or a single term outside the catalogue that explains more: they
/// may only have made it up between them.
pub(crate) fn or_single_term(search: &mut Search<'_>, base: &Fitted, fitted: Fitted) -> Result<Fitted, FitError> {
    let found = search.taken.clone();
    match search.single_term(base)? {
        Some(term) if term.score < fitted.score => Ok(term),
        _ => {
            search.taken = found;
            Ok(fitted)
        }
    }
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
