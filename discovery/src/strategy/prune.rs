//! Effects without which the model is as good are taken out, the least certain first.

use std::sync::Arc;

use cdpr::effect::EffectSpec;

use crate::filter::error::FitError;
use crate::hypothesis::extension::is_one_law;
use crate::journal::Outcome;
use crate::strategy::context::Context;
use crate::strategy::entrance::{is_certain, why_unseen};
use crate::strategy::standing::Standing;
use crate::weigh::criterion::EVIDENCE;

/// What stands without the effects without which it is as good.
pub(crate) fn prune(context: &Context<'_>, mut standing: Standing) -> Result<Standing, FitError> {
    let (journal, policy) = (&context.journal, context.policy);
    let mut judged: Vec<EffectSpec> = Vec::new();
    while standing.accepted.len() > 1 {
        let found = standing.found(context);
        let certainties = context.certainty(&standing.fit).wald;
        let certainty = |k: usize| certainties[context.at(k)];
        let left = (0..found.len()).filter(|k| !judged.iter().any(|judged| is_one_law(judged, &found[*k])));
        let Some(k) = left.min_by(|a, b| certainty(*a).total_cmp(&certainty(*b))) else { break };
        let certainty = certainty(k);
        let (model, effect) = standing.without(context, k);
        // Nearly nothing is left out with an uncertain one; a very certain one leaves a gap whatever the others do.
        let without = if certainty < policy.uncertain {
            context.fit(&model, &standing.fit)
        } else if certainty >= policy.certain {
            context.fit_without(&model, &standing.fit, 1)
        } else {
            context.fit_without(&model, &standing.fit, policy.rounds)
        };
        match without {
            Ok(without) if without.score < standing.fit.score + EVIDENCE || !context.needs(&without, &standing.fit) => {
                let change = standing.fit.score - without.score;
                journal.note(&effect, Outcome::Removed, change, "the model is as good without it");
                standing.step_back(k, effect);
                standing = standing.changed(without);
                // The others were judged beside it.
                judged.clear();
            }
            Ok(without) => {
                let accepted = &mut standing.accepted[k];
                accepted.delta_bic = standing.fit.score - without.score;
                accepted.without = Some(Arc::new(without));
                judged.push(effect);
            }
            Err(error) => {
                journal.failed(&effect, "the model without it", &error);
                judged.push(effect);
            }
        }
    }
    if let [only] = &mut standing.accepted[..] {
        only.delta_bic = standing.fit.score - standing.base.score;
    }
    Ok(or_nothing(context, without_unseen(context, standing)?))
}

/// What stands without effects that came in seen and are so no longer, now that others and the instruments have their part.
fn without_unseen(context: &Context<'_>, mut standing: Standing) -> Result<Standing, FitError> {
    let mut kept = 0;
    while kept < standing.accepted.len() {
        let explained = -standing.accepted[kept].delta_bic;
        let (fit, certainty) = (&standing.fit.train, context.certainty(&standing.fit));
        if is_certain(context, &certainty, context.at(kept), explained) {
            kept += 1;
            continue;
        }
        let (model, effect) = standing.without(context, kept);
        let without = match &standing.accepted[kept].without {
            _ if standing.accepted.len() == 1 => Some(Arc::clone(&standing.base)),
            Some(without) => Some(Arc::clone(without)),
            None => {
                let without = context.fit_without(&model, &standing.fit, context.policy.rounds);
                context.journal.tried(&effect, "the model without it", without).map(Arc::new)
            }
        };
        // What nothing can be fitted without is seen.
        let Some(without) = without.filter(|without| !context.free_runs_show(without, &standing.fit)) else {
            kept += 1;
            continue;
        };
        context.journal.note(&effect, Outcome::Removed, -explained, why_unseen(fit));
        if standing.accepted.len() == 1 {
            return Ok(standing.anew());
        }
        standing.step_back(kept, effect);
        standing = standing.changed((*without).clone());
        // Those kept before had its part beside them.
        kept = 0;
    }
    Ok(standing)
}

/// What stands, or the model as given where the only effect does not predict the held-out data better.
fn or_nothing(context: &Context<'_>, standing: Standing) -> Standing {
    if standing.accepted.len() != 1 {
        return standing;
    }
    if context.needs(&standing.base, &standing.fit) {
        return standing;
    }
    let (effect, change) = (&standing.found(context)[0], standing.fit.score - standing.base.score);
    context.journal.note(effect, Outcome::Removed, change, "it does not predict the held-out data better");
    standing.anew()
}

#[cfg(test)]
mod tests {
    use cdpr::model_file::Model;

    use super::*;
    use crate::strategy::fitted::Trained;
    use crate::strategy::fixture::{begun, effect, evidence, names, with};
    use crate::strategy::standing::Accepted;

    #[test]
    fn what_explains_nothing_is_taken_out_and_what_does_stays() {
        let drag = effect("platform_linear_drag", None, &[60.0]);
        let evidence = evidence(std::slice::from_ref(&drag), 71);
        let (context, standing) = begun(&evidence, &Model::default());
        let idle = effect("winch_viscous_friction", Some(2), &[1.0]);
        let standing = with(&context, standing, vec![(idle, Vec::new()), (drag, Vec::new())]);
        let pruned = prune(&context, standing).expect("a fit");
        assert_eq!(names(&context, &pruned), [("platform_linear_drag".to_owned(), None)]);
        assert_eq!(pruned.accepted.len(), 1);
        assert!(pruned.accepted[0].delta_bic < -EVIDENCE);
        let outcomes: Vec<Outcome> = context.journal.written().entries.iter().map(|entry| entry.outcome).collect();
        assert_eq!(outcomes, [Outcome::Removed]);
    }

    #[test]
    fn the_only_effect_goes_where_the_model_as_given_predicts_as_well() {
        let evidence = evidence(&[], 73);
        let (context, standing) = begun(&evidence, &Model::default());
        let base = &standing.base;
        // So small that it does nothing.
        let model = Model { effects: vec![effect("winch_force_bias", Some(2), &[1e-9])], ..Model::default() };
        let idle = context.started(&model, &base.train, &evidence.train).expect("a fit");
        let score = context.score(&idle, &evidence.train);
        let fit = context.verified(Trained { fit: idle, score }, base).expect("a fit");
        let accepted = vec![Accepted::new(Vec::new(), -20.0, None)];
        let pruned = prune(&context, Standing { fit, accepted, ..standing }).expect("a fit");
        assert!(pruned.accepted.is_empty() && pruned.effects().is_empty() && pruned.fit.score == pruned.base.score);
    }
}
