//! How the form of friction is found: its law, how its force turns its sign, and presliding.
//!
//! A law is looked for in its plain form. Where it stands, each shape that the catalogue has for it is added and kept if the
//! information criterion falls: first unlike forces in the two directions, unless a force bias beside equal ones explains more
//! (they differ where the winch hardly moves), then the turn; where something is left, the other laws of friction and presliding are tried, which makes
//! the friction force a state of its own. All this on the beginnings of the trials, where it costs little; the form chosen
//! is then fitted to the whole, and kept if the criterion falls by what counts. Presliding is tried on all friction at once:
//! one machine has one kind of it, and as long as one winch lacks it, it does not show on another.

use std::sync::Arc;

use cdpr::effect::EffectSpec;
use cdpr::model_file::Model;
use rayon::prelude::*;

use crate::data::Trial;
use crate::filter::error::FitError;
use crate::filter::estimate::Fit;
use crate::hypothesis::candidates::{Situation, is_there};
use crate::hypothesis::extension::{count_in_use, in_use, index_of, value_of, with};
use crate::hypothesis::friction::{
    ASYMMETRY, STATIC, Stage, TURN, beyond_first_order, bias_of, damped_starts, is_friction, kin_of, presliding_starts,
    stage,
};
use crate::journal::Outcome;
use crate::strategy::context::{self, Context};
use crate::strategy::fitted::{Fitted, Trained};
use crate::strategy::standing::Standing;
use crate::weigh::criterion::EVIDENCE;

/// What stands with all friction in the form that it needs beside the effects that stand.
pub(crate) fn form(context: &Context<'_>, standing: Standing) -> Standing {
    form_if(context, standing, f64::NEG_INFINITY)
}

/// As [`form`], but its shapes only if these explain more than this share of the evidence that is left, and so law and presliding:
/// what else is missing may take part of a shape that explains less.
pub(crate) fn form_if(context: &Context<'_>, mut standing: Standing, share: f64) -> Standing {
    let among = standing.effects().len();
    let wanting: Vec<usize> = (0..standing.accepted.len())
        .filter(|k| {
            let effect = &standing.found(context)[*k];
            let formed = standing.accepted[*k].formed_among == Some(among);
            is_friction(effect) && stage(effect) != Stage::Complete && !formed
        })
        .collect();
    let Some(first) = wanting.first().map(|k| standing.found(context)[*k].clone()) else { return standing };
    let places: Vec<usize> = wanting.iter().map(|k| context.at(*k)).collect();
    let known = standing.chosen.take().filter(|known| known.is_of(&standing, &places));
    let Some(chosen) = known.or_else(|| choose(context, &standing, &first, places)) else { return standing };
    let Chosen { begun, shaped, formed, .. } = &chosen;
    let explained = |from: f64, to: &Trained| context::share(from, &to.fit, to.score, &standing.beginnings);
    if explained(*begun, shaped).max(explained(*begun, formed)) < share {
        return Standing { chosen: Some(chosen), ..standing };
    }
    if explained(shaped.score, formed) < share {
        let next = as_begun(context, standing, shaped);
        return Standing { chosen: Some(chosen), ..next };
    }
    for k in wanting {
        standing.accepted[k].formed_among = Some(among);
    }
    as_begun(context, standing, formed)
}

/// The forms of friction that the beginnings of the trials ask for.
#[derive(Clone)]
pub(crate) struct Chosen {
    /// The criterion of the fit that they were chosen beside, the beginnings, and the places of the friction in the model.
    of: (f64, Arc<[Trial]>, Vec<usize>),
    /// The criterion with the forms that stand.
    begun: f64,
    /// With each law's own shapes.
    shaped: Arc<Trained>,
    /// In the place of other laws as well, and with presliding.
    formed: Arc<Trained>,
}

impl Chosen {
    /// Whether the same would be chosen again.
    fn is_of(&self, standing: &Standing, places: &[usize]) -> bool {
        let (score, beginnings, chosen) = &self.of;
        *score == standing.fit.score && Arc::ptr_eq(beginnings, &standing.beginnings) && chosen == places
    }
}

/// The forms that the beginnings of the trials ask for of friction at some `places` of the model, `first` among them. What cannot
/// be fitted is noted.
fn choose(context: &Context<'_>, standing: &Standing, first: &EffectSpec, places: Vec<usize>) -> Option<Chosen> {
    (context.progress)("fitting the shape of friction", 0.2);
    let forms = Forms { context, beginnings: &standing.beginnings };
    let begun = context.journal.tried(first, "its form, on the beginnings of the trials", forms.begun(standing))?;
    let score = begun.score;
    let shaped = places.iter().fold(begun, |begun, at| forms.in_full(begun, *at));
    let formed = context.journal.tried(first, "in another form", forms.formed(&shaped, &places))?;
    let of = (standing.fit.score, Arc::clone(&standing.beginnings), places);
    Some(Chosen { of, begun: score, shaped: Arc::new(shaped), formed: Arc::new(formed) })
}

/// What stands with the form of friction that was chosen by the beginnings of the trials, if it earns its place.
fn as_begun(context: &Context<'_>, standing: Standing, begun: &Trained) -> Standing {
    let old = standing.found(context).to_vec();
    let new = &begun.fit.model.effects[context.given..];
    let changed: Vec<usize> = (0..old.len())
        .filter(|k| old[*k].id != new[*k].id || count_in_use(&old[*k]) != count_in_use(&new[*k]))
        .collect();
    let Some(first) = changed.first() else { return standing };
    let whole =
        context.journal.tried(&new[*first], "in this form on the whole", on_whole(context, &standing.fit, begun));
    let Some(next) = whole.flatten() else { return standing };
    let change = next.score - standing.fit.score;
    let formed_among: Vec<Option<usize>> = standing.accepted.iter().map(|accepted| accepted.formed_among).collect();
    let mut standing = standing.changed(next);
    for k in changed {
        let (old, new) = (old[k].clone(), standing.found(context)[k].clone());
        let accepted = &mut standing.accepted[k];
        accepted.formed_among = formed_among[k];
        accepted.delta_bic += change;
        accepted.rivals.retain(|rival| rival.id != new.id);
        if old.id == new.id {
            context.journal.note(&new, Outcome::Extended, change, "");
        } else {
            let reason = format!("in place of {}", old.id);
            accepted.rivals.insert(0, old);
            context.journal.note(&new, Outcome::Replaced, change, &reason);
        }
    }
    standing
}

/// The model that was chosen by the beginnings of the trials on the whole, if it is better than `fitted` by what counts.
fn on_whole(context: &Context<'_>, fitted: &Fitted, begun: &Trained) -> Result<Option<Fitted>, FitError> {
    let (trials, policy) = (&context.evidence.train, context.policy);
    // Where friction becomes a state, the trajectory must settle before anything is refined.
    let mut start = context.started(&begun.fit.model, &fitted.train, trials)?;
    start.settle(trials, policy.settling_moves)?;
    let trained = context.train(&begun.fit.model, &start, trials, policy.rounds, None)?;
    if trained.score >= fitted.score - EVIDENCE {
        return Ok(None);
    }
    context.verified(trained, fitted).map(|next| next.helps(fitted, policy).then_some(next))
}

/// Once all effects stand: extensions that were too much as long as other effects were missing, and no presliding and no
/// asymmetry that stood for one of these.
pub(crate) fn settle_extensions(context: &Context<'_>, mut standing: Standing) -> Standing {
    let among = standing.effects().len();
    for k in 0..standing.accepted.len() {
        let formed = standing.accepted[k].formed_among == Some(among);
        if !formed && stage(&standing.found(context)[k]) != Stage::Static {
            standing = simplified(context, standing, k, &STATIC);
        }
        if value_of(&standing.found(context)[k], ASYMMETRY.0).is_some_and(|a| a != 0.0) {
            standing = simplified(context, standing, k, &[(ASYMMETRY.0, 0.0)]);
        }
    }
    form(context, standing)
}

/// What stands with parameters of effect `k` as in a simpler law, if that is as good.
fn simplified(context: &Context<'_>, standing: Standing, k: usize, law: &[(&str, f64)]) -> Standing {
    let simpler = simpler(context, &standing, context.at(k), law);
    let simpler = context.journal.tried(&standing.found(context)[k], "in a simpler form", simpler);
    let Some(next) = simpler.flatten() else { return standing };
    let change = next.score - standing.fit.score;
    context.journal.note(&next.train.model.effects[context.at(k)], Outcome::Simplified, change, "");
    Standing { fit: next, ..standing }
}

fn simpler(
    context: &Context<'_>,
    standing: &Standing,
    at: usize,
    law: &[(&str, f64)],
) -> Result<Option<Fitted>, FitError> {
    let forms = Forms { context, beginnings: &standing.beginnings };
    let begun = forms.begun(standing)?;
    let model = with(&begun.fit.model, at, law);
    let start = context.loosened(&model, &begun.fit, forms.beginnings)?;
    let fixed = forms.train(&model, &start)?;
    if fixed.score >= begun.score + EVIDENCE {
        return Ok(None);
    }
    let next = context.fit_without(&fixed.fit.model, &standing.fit, context.policy.rounds)?;
    Ok((next.score < standing.fit.score + EVIDENCE).then_some(next))
}

/// The forms of friction that the beginnings of trials ask for. Effects are told by their index in the model.
pub(crate) struct Forms<'a> {
    pub(crate) context: &'a Context<'a>,
    pub(crate) beginnings: &'a [Trial],
}

impl Forms<'_> {
    /// What stands on the beginnings of the trials, with its parameters fitted to them.
    fn begun(&self, standing: &Standing) -> Result<Trained, FitError> {
        let begun = standing.begun(self.context, &standing.fit.train)?;
        self.train_few(&standing.fit.train.model, &begun)
    }

    /// `model`, which lacks something that `from` has, with the law at one place of it in the form that the beginnings then ask for.
    pub(crate) fn anew(&self, model: &Model, from: &Fit, at: usize) -> Result<Trained, FitError> {
        let start = self.context.loosened(model, from, self.beginnings)?;
        let shaped = self.in_full(self.train(model, &start)?, at);
        self.formed(&shaped, &[at])
    }

    /// The law and the presliding of friction at some places that the beginnings of the trials ask for.
    pub(crate) fn formed(&self, shaped: &Trained, places: &[usize]) -> Result<Trained, FitError> {
        let mut begun = shaped.clone();
        let mut able: Vec<(usize, EffectSpec)> = Vec::new();
        let mut undamped = false;
        for &at in places {
            if stage(&begun.fit.model.effects[at]) == Stage::Undamped {
                undamped = true;
            } else if self.context.something_left(&begun.fit, self.beginnings) {
                let mut laws = self.kin(begun, at);
                // The best law that knows presliding, even where another one is better as long as there is none.
                let mut effects = laws.iter().map(|law| &law.fit.model.effects[at]);
                let law = effects.find(|law| index_of(law, "presliding_stiffness").is_some());
                able.extend(law.map(|law| (at, law.clone())));
                begun = laws.swap_remove(0);
            }
        }
        let presliding = match (able.is_empty(), undamped) {
            (true, false) => return Ok(begun),
            (true, true) => return self.damped(begun),
            // Another law may have explained it all.
            (false, _) if !self.context.something_left(&begun.fit, self.beginnings) => return Ok(begun),
            (false, _) => self.presliding(&begun, &able)?,
        };
        Ok(presliding.filter(|next| next.score < begun.score).unwrap_or(begun))
    }

    /// The law of effect `at` with the shapes that it needs on the beginnings of the trials; as it is where it has presliding
    /// or is none of friction.
    pub(crate) fn shaped(&self, mut begun: Trained, at: usize) -> Trained {
        if stage(&begun.fit.model.effects[at]) != Stage::Static {
            return begun;
        }
        if let Some(unlike) = self.unlike_directions(&begun, at) {
            begun = unlike;
        }
        for shape in TURN {
            let effect = &begun.fit.model.effects[at];
            if index_of(effect, shape.0).is_none_or(|k| in_use(effect, k)) {
                continue;
            }
            let Some(next) = self.with_shape(&begun, at, shape) else { break };
            begun = next;
        }
        begun
    }

    /// `begun` with one more shape of effect `at`, if the criterion falls.
    fn with_shape(&self, begun: &Trained, at: usize, shape: (&str, f64)) -> Option<Trained> {
        let model = with(&begun.fit.model, at, &[shape]);
        let next = self.train(&model, &begun.fit);
        let next = self.context.journal.tried(&model.effects[at], &format!("with {}", shape.0), next);
        next.filter(|next| next.score < begun.score)
    }

    /// The law of effect `at` with the shapes that it needs, or the one of which it is the first order, which has as many
    /// parameters, if that is better by what counts.
    fn in_full(&self, begun: Trained, at: usize) -> Trained {
        let shaped = self.shaped(begun, at);
        let Some(law) = beyond_first_order(&shaped.fit.model.effects[at]) else { return shaped };
        let mut model = shaped.fit.model.clone();
        model.effects[at] = law;
        let whole = self.train(&model, &shaped.fit);
        let whole = self.context.journal.tried(&model.effects[at], "beyond its first order", whole);
        whole.filter(|whole| whole.score < shaped.score - EVIDENCE).unwrap_or(shaped)
    }

    /// `begun` with the law of effect `at` unlike in its two directions, if the criterion falls by more than with a force bias
    /// beside it: while the winch turns fast the two are the same force, at rest only the bias acts.
    fn unlike_directions(&self, begun: &Trained, at: usize) -> Option<Trained> {
        let effect = &begun.fit.model.effects[at];
        if in_use(effect, index_of(effect, ASYMMETRY.0)?) {
            return None;
        }
        let unlike = self.with_shape(begun, at, ASYMMETRY)?;
        let law = &unlike.fit.model.effects[at];
        let bias = bias_of(law)?;
        // A bias that stands has had its chance.
        if begun.fit.model.effects.iter().any(|effect| is_there(effect, &bias.id, bias.cable)) {
            return Some(unlike);
        }
        let mut biased = begun.fit.model.clone();
        biased.effects.push(bias);
        let with_bias = self.train(&biased, &begun.fit);
        let with_bias = self.context.journal.tried(law, "equal in both directions beside a bias", with_bias);
        with_bias.is_none_or(|biased| unlike.score <= biased.score).then_some(unlike)
    }

    /// The laws of friction, each in the shape it needs on the beginnings of the trials, in place of effect `at`; the best
    /// first. A richer law than that effect must be better by what counts.
    fn kin(&self, begun: Trained, at: usize) -> Vec<Trained> {
        let laws = kin_of(&begun.fit.model.effects, at, Situation::of(self.beginnings).mean_tension);
        let own = count_in_use(&begun.fit.model.effects[at]);
        let handicap = |law: &Trained| {
            let richer = count_in_use(&law.fit.model.effects[at]) > own;
            law.score + if richer { 2.0 * EVIDENCE } else { 0.0 }
        };
        let fitted = |law: &EffectSpec| {
            let mut model = begun.fit.model.clone();
            model.effects[at] = law.clone();
            let start = self.context.loosened(&model, &begun.fit, self.beginnings)?;
            self.train(&model, &start)
        };
        let tried = laws.par_iter().filter_map(|law| {
            let law = self.context.journal.tried(law, "as another law of friction", fitted(law))?;
            Some(self.in_full(law, at))
        });
        let mut all: Vec<Trained> = self.context.journal.side_by_side(|| tried.collect());
        all.push(begun);
        all.sort_by(|a, b| handicap(a).total_cmp(&handicap(b)));
        all
    }

    /// Presliding of the `able` laws, first without damping, in place of the shapes of static ones; on the beginnings of the
    /// trials, where it is better.
    fn presliding(&self, begun: &Trained, able: &[(usize, EffectSpec)]) -> Result<Option<Trained>, FitError> {
        let starts = presliding_starts(&begun.fit.model, able);
        let Some(dahl) = self.tried(&starts, begun, &able[0].1) else { return Ok(None) };
        self.damped(self.refined_once(&dahl)?).map(Some)
    }

    /// Presliding with the damping that it needs on the beginnings of the trials, wherever it has none.
    fn damped(&self, dahl: Trained) -> Result<Trained, FitError> {
        let found = self.context.given;
        let starts = damped_starts(&dahl.fit.model, found);
        let undamped = |effect: &&EffectSpec| is_friction(effect) && stage(effect) == Stage::Undamped;
        let damped = match dahl.fit.model.effects[found..].iter().find(undamped) {
            Some(law) => self.tried(&starts, &dahl, law),
            None => None,
        };
        self.refined(damped.unwrap_or(dahl))
    }

    /// The best of several starts of presliding of a `law`, as far as a few rounds bring them, if better than `from`.
    fn tried(&self, starts: &[Model], from: &Trained, law: &EffectSpec) -> Option<Trained> {
        let train = |start| self.train_few(start, &from.fit);
        let tried =
            starts.par_iter().filter_map(|start| self.context.journal.tried(law, "with presliding", train(start)));
        let best = self.context.journal.side_by_side(|| tried.min_by(|a, b| a.score.total_cmp(&b.score)))?;
        (best.score < from.score - EVIDENCE).then_some(best)
    }

    /// `begun` refined until nothing is gained.
    fn refined(&self, mut begun: Trained) -> Result<Trained, FitError> {
        for _ in 0..self.context.policy.most_refinements {
            let next = self.refined_once(&begun)?;
            let gained = begun.score - next.score;
            if gained > 0.0 {
                begun = next;
            }
            if gained < EVIDENCE {
                break;
            }
        }
        Ok(begun)
    }

    /// `begun` refined from a trajectory that has settled: where friction has just become a state, one round of smoothing
    /// is too little, and steps from there fail.
    fn refined_once(&self, begun: &Trained) -> Result<Trained, FitError> {
        let mut start = begun.fit.clone();
        start.settle(self.beginnings, self.context.policy.settling_moves)?;
        self.train(&begun.fit.model, &start)
    }

    /// A model fitted to the beginnings.
    fn train(&self, model: &Model, from: &Fit) -> Result<Trained, FitError> {
        self.context.train(model, from, self.beginnings, self.context.policy.rounds, None)
    }

    /// The same in a few rounds.
    fn train_few(&self, model: &Model, from: &Fit) -> Result<Trained, FitError> {
        self.context.train(model, from, self.beginnings, self.context.policy.rounds_of_a_start, None)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::recording::record;
    use crate::filter::estimate::noise_of_data;
    use crate::strategy::fitted::Evidence;
    use crate::strategy::fixture::{begun, evidence, with};

    /// The asymmetry that a plain law gets where `hidden` effects act.
    fn asymmetry(hidden: &[EffectSpec]) -> f64 {
        let (train, holdout) = (vec![record(hidden, 30.0, 41)], vec![record(hidden, 20.0, 42)]);
        let noise = noise_of_data(&[&train[..], &holdout[..]].concat());
        let evidence = Evidence::new(train, holdout, noise);
        let (context, base) = Context::begin(&evidence, &Model::default(), 0..0, &|_, _| {}).unwrap();
        let standing = Standing::new(&context, base);
        let forms = Forms { context: &context, beginnings: &standing.beginnings };
        let plain = EffectSpec::new("winch_coulomb_friction", Some(2), &[180.0, 0.02]).unwrap();
        let model = Model { effects: vec![plain], ..Model::default() };
        let from = crate::data::recording::fitted(&[], &evidence.train);
        let begun = forms.train(&model, &from).unwrap();
        value_of(&forms.shaped(begun, 0).fit.model.effects[0], "asymmetry").unwrap()
    }

    /// Friction with 30 % more when paying out was found as equal friction and a force bias, which it is but at low speeds.
    #[test]
    fn friction_unlike_in_its_directions_is_told_from_a_bias_beside_it() {
        let friction = |asymmetry: f64| {
            let values = [180.0, 0.02, 0.0, 0.0, 0.0, 0.0, 0.0, asymmetry];
            EffectSpec::new("winch_coulomb_friction", Some(2), &values).unwrap()
        };
        let found = asymmetry(&[friction(0.3)]);
        assert!((found - 0.3).abs() < 0.03, "{found}");
        let bias = EffectSpec::new("winch_force_bias", Some(2), &[54.0]).unwrap();
        assert_eq!(asymmetry(&[friction(0.0), bias]), 0.0);
    }

    /// Friction round a pulley was named as its first order beside a gain of a ten thousandth: of what the noise is by differences, which no
    /// model comes to, its own form explained a fifth, and so it waited for what explains more.
    #[test]
    fn a_shape_that_leaves_nothing_waits_for_nothing() {
        let wrapped = EffectSpec::new("pulley_wrap_friction", Some(2), &[0.01, 1.5, 0.01]).unwrap();
        let evidence = evidence(&[wrapped], 71);
        let (context, standing) = begun(&evidence, &Model::default());
        let first_order = EffectSpec::new("pulley_capstan_loss", Some(2), &[0.015, 0.01]).unwrap();
        let standing = with(&context, standing, vec![(first_order, Vec::new())]);
        let formed = form_if(&context, standing, context.policy.most);
        assert_eq!(formed.found(&context)[0].id, "pulley_wrap_friction");
    }

    /// Beside a missing drag the tail of an arctan took part of it, and the drag was left to the cables.
    #[test]
    fn a_shape_waits_for_what_explains_more() {
        let plain = EffectSpec::new("winch_coulomb_friction", Some(2), &[400.0, 0.1]).unwrap();
        let mut algebraic = plain.clone();
        algebraic.values[index_of(&plain, "algebraic").unwrap()] = 1.0;
        let shaped = |hidden: &[EffectSpec]| {
            let evidence = evidence(hidden, 91);
            let (context, standing) = begun(&evidence, &Model::default());
            let standing = with(&context, standing, vec![(plain.clone(), Vec::new())]);
            let standing = form_if(&context, standing, context.policy.most);
            let law = &standing.found(&context)[0];
            law.id != plain.id || count_in_use(law) > count_in_use(&plain)
        };
        let drag = EffectSpec::new("platform_linear_drag", None, &[200.0]).unwrap();
        assert!(shaped(std::slice::from_ref(&algebraic)) && !shaped(&[algebraic, drag]));
    }
}
