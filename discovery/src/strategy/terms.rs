//! Terms outside the catalogue: on top of what was found, or instead of it, whichever explains more; and their numbers,
//! refined.

use cdpr::effect::EffectSpec;
use cdpr::model_file::Model;

use crate::filter::error::FitError;
use crate::hypothesis::parameter::free_values;
use crate::hypothesis::stood_for::law_of_term;
use crate::hypothesis::term::without_phase;
use crate::journal::Outcome;
use crate::outcome::Stability;
use crate::strategy::candidates::signatures;
use crate::strategy::context::Context;
use crate::strategy::fitted::{Fitted, Trained};
use crate::strategy::prune::prune;
use crate::strategy::round::{Round, round};
use crate::strategy::standing::Standing;
use crate::verdict::POLICY as VERDICT;
use crate::verdict::by_block::ByBlock;
use crate::verdict::stability::stability;
use crate::weigh::criterion::EVIDENCE;
use crate::weigh::refine::refine_free;
use crate::weigh::signatures::Source;

/// Terms where something is left, or where several effects leave something to latent forces.
pub(crate) fn terms(context: &Context<'_>, standing: Standing) -> Result<Standing, FitError> {
    if standing.fit.gap[0] > context.policy.nothing_left {
        beyond_catalogue(context, standing)
    } else if standing.accepted.len() > 1 && standing.fit.train.randomness.has_latents() {
        or_single_term(context, standing)
    } else {
        Ok(standing)
    }
}

/// Terms outside the catalogue: on top of what was found, or instead of it, whichever explains more.
fn beyond_catalogue(context: &Context<'_>, standing: Standing) -> Result<Standing, FitError> {
    let nothing_found = standing.accepted.is_empty();
    let best = match dictionary_rounds(context, &standing, None)? {
        Some(with_terms) => prune(context, with_terms)?,
        None => standing,
    };
    if nothing_found {
        return Ok(best);
    }
    // Perhaps what was found only stood for what is outside the catalogue.
    if let Some(instead) = dictionary_rounds(context, &best.anew(), Some(best.fit.score))? {
        let instead = prune(context, instead)?;
        let leaves = context.policy.terms_instead * best.fit.left();
        if instead.fit.score < best.fit.score && instead.fit.left() < leaves {
            return Ok(instead);
        }
    }
    Ok(best)
}

/// Several effects that leave something to latent forces, or a single term outside the catalogue that explains more: they
/// may only have made it up between them.
fn or_single_term(context: &Context<'_>, standing: Standing) -> Result<Standing, FitError> {
    let term = single_term(context, &standing)?;
    Ok(term.filter(|term| term.fit.score < standing.fit.score).unwrap_or(standing))
}

/// A single term outside the catalogue that explains the data from the model as given on, in place of all found.
pub(crate) fn single_term(context: &Context<'_>, standing: &Standing) -> Result<Option<Standing>, FitError> {
    (context.progress)("looking for a term that explains it all", 0.45);
    let anew = standing.anew();
    let signatures = signatures(context, &anew, &anew.fit, Source::Terms);
    let entries = context.journal.len();
    if let Round::Found(next) = round(context, anew, &signatures, Source::Terms, 1)? {
        if next.fit.gap[0] <= context.policy.nothing_left {
            return Ok(Some(next));
        }
        context.journal.refuse_since(entries, "it does not explain all");
    }
    Ok(None)
}

/// Terms outside the catalogue; kept only when together they at least halve what is left of the gap. Given a score to be
/// `aimed` at, they are given up where the first is too small a part of it.
fn dictionary_rounds(
    context: &Context<'_>,
    standing: &Standing,
    aim: Option<f64>,
) -> Result<Option<Standing>, FitError> {
    let (entries, policy) = (context.journal.len(), context.policy);
    let mut current = standing.clone();
    for number in 0..policy.most_terms {
        (context.progress)("looking for terms outside the catalogue", 0.7 + 0.05 * number as f64);
        let signatures = signatures(context, &current, &current.fit, Source::Terms);
        match round(context, current, &signatures, Source::Terms, policy.most_refusals)? {
            Round::Found(next) => current = next,
            Round::Nothing(same) | Round::Instruments(same, _) => {
                current = same;
                break;
            }
        }
        let gained = standing.fit.score - current.fit.score;
        let too_little = |aim: f64| gained * (policy.most_terms as f64) < standing.fit.score - aim;
        if current.fit.gap[0] < policy.terms_explain_all || number == 0 && aim.is_some_and(too_little) {
            break;
        }
    }
    if current.accepted.len() == standing.accepted.len() {
        return Ok(None);
    }
    let reason = match () {
        () if current.fit.left() > policy.terms_leave * standing.fit.left() => {
            "the terms found do not halve what is left of the gap"
        }
        () if any_term_varies(context, &current) => {
            "its size, or that of a term beside it, differs throughout: it is no law"
        }
        () => return Ok(Some(current)),
    };
    context.journal.refuse_since(entries, reason);
    Ok(None)
}

/// Whether the size of a term differs from block to block of time: a law is the same throughout.
fn any_term_varies(context: &Context<'_>, standing: &Standing) -> bool {
    let (fit, trials) = (&standing.fit.train, &context.evidence.train);
    let sizes = stability(fit, &ByBlock::new(fit, trials, context.free_from), context.given);
    let varies = |size: &Stability| size.varies() && size.spread > VERDICT.unsteady;
    standing
        .found(context)
        .iter()
        .zip(&sizes)
        .any(|(effect, size)| is_term(effect) && size.as_ref().is_some_and(varies))
}

/// The numbers of the terms found, refined in the full model together with all else, with their errors; a phase that
/// explains less than a parameter costs is left out, and a term that is a law of the catalogue by its form gets its name. What the
/// held-out data speak against stays as it was.
pub(crate) fn refine_terms(context: &Context<'_>, mut standing: Standing) -> Result<Standing, FitError> {
    if !standing.found(context).iter().any(is_term) {
        return Ok(standing);
    }
    (context.progress)("refining the terms", 0.9);
    let mut best = standing.fit;
    let model = best.train.model.clone();
    if let Some(next) = with_terms_refined(context, &model, &best)
        && next.score <= best.score
        && next.holdout_score <= best.holdout_score
    {
        best = next;
    }
    for at in context.given..best.train.model.effects.len() {
        let Some(plain) = without_phase(&best.train.model.effects[at]) else { continue };
        let mut model = best.train.model.clone();
        model.effects[at] = plain;
        if let Some(next) = with_terms_refined(context, &model, &best)
            && next.score <= best.score + context.penalty.of_parameters(1)
        {
            best = next;
        }
    }
    for at in context.given..best.train.model.effects.len() {
        best = by_name(context, at, best);
    }
    standing.fit = best;
    Ok(standing)
}

/// `fitted` with a term as the law of the catalogue that it is by its form, where it is as good.
fn by_name(context: &Context<'_>, at: usize, fitted: Fitted) -> Fitted {
    let Some(law) = law_of_term(&fitted.train.model.effects[at]) else { return fitted };
    let mut model = fitted.train.model.clone();
    model.effects[at] = law.clone();
    let refined = || {
        let start = context.started(&model, &fitted.train, &context.evidence.train)?;
        let trained = context.train(&model, &start, &context.evidence.train, context.policy.rounds, None)?;
        context.verified(trained, &fitted)
    };
    let named = context.journal.tried(&law, "for a term of its form", refined());
    // Numbers of a law cost more than those of a term, which are the same.
    let explains = |fitted: &Fitted| {
        let (fit, trials) = (&fitted.train, &context.evidence.train);
        fit.minus_two_log_likelihood(trials, &fit.randomness)
    };
    let Some(named) = named.filter(|named| explains(named) < explains(&fitted) + EVIDENCE) else { return fitted };
    context.journal.note(&law, Outcome::Replaced, named.score - fitted.score, "for a term of its form");
    named
}

fn is_term(effect: &EffectSpec) -> bool {
    effect.expression.is_some()
}

/// `model` with the numbers of its terms refined, from another fit; nothing, and a note of it, where that fails.
fn with_terms_refined(context: &Context<'_>, model: &Model, from: &Fitted) -> Option<Fitted> {
    match terms_refined(context, model, from) {
        Ok(fitted) => Some(fitted),
        Err(error) => {
            for term in model.effects[context.given..].iter().filter(|effect| is_term(effect)) {
                context.journal.failed(term, "with refined numbers", &error);
            }
            None
        }
    }
}

fn terms_refined(context: &Context<'_>, model: &Model, from: &Fitted) -> Result<Fitted, FitError> {
    let (trials, noise) = (&context.evidence.train, &context.evidence.noise);
    let mut fit = context.started(model, &from.train, trials)?;
    let free = free_values(model, context.free_from);
    let ended = refine_free(&mut fit, trials, &free, context.policy.rounds, None)?;
    context.journal.stuck(&fit.model.effects, ended);
    fit.fit_randomness(trials, noise, false);
    let score = context.score(&fit, trials);
    context.verified(Trained { fit, score }, from)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::strategy::fixture::{begun, evidence, with};

    #[test]
    fn a_force_outside_the_catalogue_is_found_as_a_term_with_its_numbers() {
        let hidden = EffectSpec::expression("platform.force_y", "40*x").expect("a term");
        let recorded = evidence(std::slice::from_ref(&hidden), 85);
        let (context, standing) = begun(&recorded, &Model::default());
        let term = single_term(&context, &standing).expect("a fit").expect("a term");
        let refined = refine_terms(&context, term).expect("a fit");
        let [found] = refined.found(&context) else { panic!("{:?}", refined.found(&context)) };
        assert_eq!(found.target.as_deref(), Some("platform.force_y"));
        let text = found.expression.as_deref().expect("an expression");
        let number: f64 = text.trim_end_matches("*x").parse().unwrap_or_else(|_| panic!("{text}"));
        assert!((number - 40.0).abs() < 1.0, "{text}");
        // Nothing is made up where nothing is missing.
        let nothing = evidence(&[], 87);
        let (context, standing) = begun(&nothing, &Model::default());
        assert!(single_term(&context, &standing).expect("a fit").is_none());
    }

    /// On a real robot squares of two winches' forces stood beside friction, 41 and 80 % larger or smaller from block to block.
    #[test]
    fn a_term_that_grows_is_no_law() {
        let term = EffectSpec::expression("platform.force_x", "40").expect("a term");
        for (hidden, expected) in [("40", false), ("2*time", true)] {
            let hidden = EffectSpec::expression("platform.force_x", hidden).expect("a term");
            let recorded = evidence(std::slice::from_ref(&hidden), 86);
            let (context, standing) = begun(&recorded, &Model::default());
            let standing = with(&context, standing, vec![(term.clone(), Vec::new())]);
            assert_eq!(any_term_varies(&context, &standing), expected);
        }
    }

    /// Torque ripple came out as a term outside the catalogue, which has it.
    #[test]
    fn a_term_that_is_a_law_by_its_form_gets_its_name() {
        let hidden = EffectSpec::new("winch_torque_ripple", Some(2), &[60.0, 1.3, 0.5]).expect("an effect");
        let recorded = evidence(std::slice::from_ref(&hidden), 91);
        let (context, standing) = begun(&recorded, &Model::default());
        let term =
            EffectSpec::expression("winch[2]", "59.9*sin(4.8332*unstretched_length[2] + 0.517)").expect("a term");
        let standing = with(&context, standing, vec![(term, Vec::new())]);
        let named = refine_terms(&context, standing).expect("a fit");
        let [found] = named.found(&context) else { panic!("{:?}", named.found(&context)) };
        assert_eq!((found.id.as_str(), found.cable), ("winch_torque_ripple", Some(2)));
        assert!((found.values[0] - 60.0).abs() < 1.0 && (found.values[1] - 1.3).abs() < 1e-3, "{found:?}");
    }
}
