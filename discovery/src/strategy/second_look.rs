//! A second look at laws that a wrong trajectory hides.
//!
//! Candidates are weighed by their signatures along the trajectory that the model without them gives. Where the missing
//! law is strong and not smooth (friction that holds a winch, a force at its limit, a sagging cable) or has a motion of its
//! own (a vibrating cable), that trajectory is so wrong that the signature misleads. So where the search explains little,
//! such laws are put into the model at a typical size and refined from there, one after the other.

use std::sync::atomic::{AtomicUsize, Ordering};

use cdpr::model_file::Model;
use rayon::prelude::*;

use crate::data::Trial;
use crate::filter::error::FitError;
use crate::filter::estimate::Fit;
use crate::hypothesis::candidates::Situation;
use crate::hypothesis::friction::is_friction;
use crate::hypothesis::typical::{Law, laws};
use crate::outcome::NullTest;
use crate::strategy::context::Context;
use crate::strategy::entrance::enter;
use crate::strategy::fitted::{Fitted, Trained};
use crate::strategy::form::Forms;
use crate::strategy::policy::Policy;
use crate::strategy::standing::Standing;
use crate::weigh::criterion::EVIDENCE;
use crate::weigh::refine::refine;
use crate::weigh::signatures::Source;

/// Whether a law may be missing from a fit that is so strong that it hides itself, and was not looked for yet.
pub(crate) fn may_hide(context: &Context<'_>, standing: &Standing, fitted: &Fitted) -> bool {
    let more_than_latents = || context.more_than_latents(&fitted.train, &context.evidence.train);
    let taken = !standing.accepted.is_empty();
    !standing.looked && hides(fitted.gap[0], taken, standing.chance, context.policy, more_than_latents)
}

/// The same by the gap of the model as given, whether anything was accepted, what chance did where nothing was, and whether
/// the innovations are not white.
///
/// Where nothing was accepted and they are white, a force at random may be all there is, unless chance comes nowhere near
/// the best candidate: then something is there, which one round could not make out.
fn hides(
    gap: f64,
    accepted: bool,
    chance: Option<NullTest>,
    policy: &Policy,
    more_than_latents: impl FnOnce() -> bool,
) -> bool {
    gap > policy.strong && (accepted || chance.is_some_and(|test| test.as_strong == 0) || more_than_latents())
}

/// What stands with the law that explains most from a typical start in the place of all that was found, if that leaves less
/// than half of the gap and is better.
pub(crate) fn second_look(context: &Context<'_>, standing: &Standing) -> Result<Option<Standing>, FitError> {
    let (base, found, policy) = (&*standing.base, &standing.fit, context.policy);
    let trials = &context.evidence.train;
    let mut tried: Vec<Try> = laws(&Situation::of(trials), base.train.model.parameters.cable_density)
        .into_iter()
        .map(|law| {
            let mut model = base.train.model.clone();
            model.effects.extend(law.iter().map(|(effect, _)| effect.clone()));
            Try { model, law, reached: None }
        })
        .collect();
    // All laws on the beginnings of the trials, the best of them on the whole; anew, for what is best for a beginning may
    // be a dead end.
    let begun = standing.begun(context, &base.train)?;
    refine_all(context, &mut tried, &standing.beginnings, &begun, policy.rounds_from_typical, 0.5);
    let nothing = context.score(&begun, &standing.beginnings);
    tried.retain(|law| law.score() < nothing - EVIDENCE);
    let clear = tried.get(1).is_none_or(|second| tried[0].score() < second.score() - policy.far_off);
    tried.truncate(if clear { 1 } else { policy.finalists });
    if clear {
        let forms = Forms { context, beginnings: &standing.beginnings };
        tried.iter_mut().for_each(|law| in_form(&forms, law));
    }
    refine_all(context, &mut tried, trials, &base.train, policy.rounds_of_finalists, 0.6);
    let Some(best) = tried.into_iter().next() else { return Ok(None) };
    let Some((fit, _)) = best.reached else { return Ok(None) };
    let model = fit.model.clone();
    let start = Fitted { train: fit, ..base.clone() };
    let next = context.journal.tried(&best.law[0].0, "from a typical size", context.fit(&model, &start));
    let Some(next) = next else { return Ok(None) };
    let better = next.left() < found.left() && next.score < found.score;
    if next.left() > policy.look_leaves * base.left() || !better || !next.helps(base, policy) {
        return Ok(None);
    }
    let rivals = best.law.into_iter().map(|(_, rivals)| rivals).collect();
    Ok(enter(context, &standing.anew(), next, rivals, Source::Catalogue, "refined from a typical size")?.entered())
}

/// A law of friction in the form that the beginnings of the trials ask for.
fn in_form(forms: &Forms<'_>, law: &mut Try) {
    let Try { law: effects, reached: Some((fit, score)), .. } = law else { return };
    let [(plain, rivals)] = &mut effects[..] else { return };
    if !is_friction(plain) {
        return;
    }
    let at = forms.context.at(0);
    let begun = Trained { fit: fit.clone(), score: *score };
    let shaped = forms.shaped(begun, at);
    let formed = forms.context.journal.tried(plain, "in another form", forms.formed(&shaped, &[at]));
    let Some(formed) = formed else { return };
    law.model = formed.fit.model.clone();
    let effect = formed.fit.model.effects[at].clone();
    if effect.id != plain.id {
        rivals.retain(|rival| rival.id != effect.id);
        rivals.push(plain.clone());
    }
    *plain = effect;
}

/// Refines all laws on `trials`, from a fit of the model without them, and puts the best first. Progress goes from
/// `begun` on by a tenth.
fn refine_all(context: &Context<'_>, tried: &mut [Try], trials: &[Trial], base: &Fit, rounds: usize, begun: f64) {
    let (done, count) = (AtomicUsize::new(0), tried.len() as f64);
    let refined = |model: &Model| {
        let mut fit = context.started(model, base, trials)?;
        let ended = refine(&mut fit, trials, context.free_from, rounds, None)?;
        context.journal.stuck(&fit.model.effects, ended);
        let score = context.score(&fit, trials);
        Ok::<_, FitError>((fit, score))
    };
    let one = |law: &mut Try| {
        law.reached = context.journal.tried(&law.law[0].0, "from a typical size", refined(&law.model));
        let share = done.fetch_add(1, Ordering::Relaxed) as f64 / count;
        (context.progress)("a second look at friction, limits, sag and cable mass", begun + 0.1 * share);
    };
    context.journal.side_by_side(|| tried.par_iter_mut().for_each(one));
    tried.sort_by(|a, b| a.score().total_cmp(&b.score()));
}

/// A law under trial.
struct Try {
    model: Model,
    law: Law,
    /// The fit so far, with its score; none of a law that cannot be simulated.
    reached: Option<(Fit, f64)>,
}

impl Try {
    fn score(&self) -> f64 {
        self.reached.as_ref().map_or(f64::INFINITY, |r| r.1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::strategy::policy::POLICY;

    #[test]
    fn a_second_look_needs_a_gap_and_more_than_a_force_at_random() {
        let chance =
            |as_strong| Some(NullTest { shifts: 99, found: 300.0, as_strong, over_threshold: 9, largest: 200.0 });
        let hides = |gap, accepted, chance, left| hides(gap, accepted, chance, &POLICY, || left);
        assert!(!hides(POLICY.strong, true, chance(0), true), "a small gap hides nothing");
        assert!(hides(POLICY.strong + 0.1, true, chance(60), false), "what was found may only do some of it");
        assert!(!hides(400.0, false, chance(1), false), "white, and chance does as well: a force at random");
        assert!(!hides(400.0, false, None, false));
        assert!(hides(400.0, false, chance(0), false), "chance comes nowhere near");
        assert!(hides(400.0, false, chance(60), true), "a force at random leaves white innovations");
    }
}
