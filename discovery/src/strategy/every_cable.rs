//! One law on every cable in the place of the same law on one or several, each with its own parameters.
//!
//! The winches and cables of one machine are built alike. Where one effect comes in after the other, a law of all of them is
//! found cable by cable, as far as the recordings show each: one that others reach for moments only, as limits of a force, may be
//! refused for want of evidence on each of them.

use cdpr::effect::EffectSpec;
use cdpr::model_file::Model;

use crate::filter::error::FitError;
use crate::hypothesis::candidates::is_there;
use crate::hypothesis::extension::same_law;
use crate::journal::Outcome;
use crate::strategy::context::Context;
use crate::strategy::fitted::Fitted;
use crate::strategy::standing::Standing;
use crate::weigh::criterion::EVIDENCE;

/// What stands with one law on every cable wherever one stands on one or several, if the training data are no less likely by it than
/// its fewer parameters allow, and the held-out data no less likely. Of a law on a single cable this is asked where the training data are
/// likelier with the same numbers on all.
pub(crate) fn on_every_cable(context: &Context<'_>, mut standing: Standing) -> Standing {
    let mut tried: Vec<EffectSpec> = Vec::new();
    loop {
        let untried = |effect: &&EffectSpec| !tried.iter().any(|other| same_law(other, effect));
        let several = standing.found(context).iter().filter(untried).find(|effect| {
            let of_id = standing.effects().iter().filter(|other| is_there(other, &effect.id, None));
            of_id.into_iter().all(|other| other.cable.is_some() && same_law(other, effect))
        });
        let Some(law) = several.cloned() else { return standing };
        standing = one_for_all(context, standing, &law);
        tried.push(law);
    }
}

/// What stands with one law in the place of all that are the same as `law`, if that is as good.
fn one_for_all(context: &Context<'_>, standing: Standing, law: &EffectSpec) -> Standing {
    let found = standing.found(context);
    let places: Vec<usize> = (0..found.len()).filter(|k| same_law(&found[*k], law)).collect();
    let strength = |k: &&usize| standing.accepted[**k].delta_bic;
    let strongest = places.iter().min_by(|a, b| strength(a).total_cmp(&strength(b))).copied();
    let Some(strongest) = strongest else { return standing };
    let all = EffectSpec { cable: None, ..found[strongest].clone() };
    let what = format!("on every cable in the place of {}", places.len());
    let stays = |k: usize| k == strongest || !places.contains(&k);
    let model = in_place_of(context, &standing, strongest, &all, &stays);
    let next = if places.len() > 1 { Ok(true) } else { is_likelier(context, &model, &standing.fit) };
    let next = next.and_then(|asked| if asked { as_good(context, &model, &standing.fit) } else { Ok(None) });
    let Some(next) = context.journal.tried(&all, &what, next).flatten() else { return standing };
    let change = next.score - standing.fit.score;
    let mut standing = standing.changed(next);
    let explained = places.iter().map(|k| standing.accepted[*k].delta_bic).sum();
    let one = &mut standing.accepted[strongest];
    one.delta_bic = explained;
    one.alternatives.clear();
    one.divided = false;
    one.rivals.retain(|rival| rival.id != all.id);
    one.rivals.iter_mut().for_each(|rival| rival.cable = None);
    let mut number = 0..;
    standing.accepted.retain(|_| number.next().is_some_and(stays));
    let k = (0..strongest).filter(|k| stays(*k)).count();
    context.journal.note(&standing.found(context)[k], Outcome::Replaced, change, &what);
    standing
}

/// The model with the law on `all` cables in the place of the strongest, without the others that do not stay.
fn in_place_of(
    context: &Context<'_>,
    standing: &Standing,
    strongest: usize,
    all: &EffectSpec,
    stays: &dyn Fn(usize) -> bool,
) -> Model {
    let mut model = standing.fit.train.model.clone();
    let found = model.effects.split_off(context.given);
    let kept = found.into_iter().enumerate().filter(|(k, _)| stays(*k));
    model.effects.extend(kept.map(|(k, effect)| if k == strongest { all.clone() } else { effect }));
    model
}

/// Whether the training data are likelier by `model` than by one that is `fitted`, its parameters as they are.
fn is_likelier(context: &Context<'_>, model: &Model, fitted: &Fitted) -> Result<bool, FitError> {
    let trials = &context.evidence.train;
    let mut fit = context.started(model, &fitted.train, trials)?;
    fit.smooth(trials)?;
    Ok(context.score(&fit, trials) < fitted.score)
}

/// The `model` fitted, if it is as good as one that is `fitted`.
pub(crate) fn as_good(context: &Context<'_>, model: &Model, fitted: &Fitted) -> Result<Option<Fitted>, FitError> {
    let next = context.fit(model, fitted)?;
    let as_likely = next.holdout_score < fitted.holdout_score + context.policy.helps * EVIDENCE;
    let as_good = next.score <= fitted.score && as_likely;
    Ok(as_good.then_some(next))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::recording::record;
    use crate::filter::estimate::noise_of_data;
    use crate::strategy::fitted::Evidence;
    use crate::strategy::standing::Accepted;

    fn gain(cable: Option<usize>, value: f64) -> EffectSpec {
        EffectSpec::new("winch_force_gain", cable, &[value]).expect("an effect")
    }

    fn evidence(hidden: &[EffectSpec]) -> Evidence {
        let train = vec![record(hidden, 40.0, 11), record(hidden, 30.0, 12)];
        let holdout = vec![record(hidden, 30.0, 13)];
        let noise = noise_of_data(&train);
        Evidence::new(train, holdout, noise)
    }

    fn begun(evidence: &Evidence) -> (Context<'_>, Fitted) {
        Context::begin(evidence, &Model::default(), 0..0, &|_, _| {}).expect("a fit")
    }

    /// What stands after gains on cables 2 and 4 were found, where `hidden` acts.
    fn stands(hidden: &[EffectSpec]) -> (Vec<EffectSpec>, usize) {
        let evidence = evidence(hidden);
        let (context, base) = begun(&evidence);
        let drag = EffectSpec::new("platform_linear_drag", None, &[1.0]).expect("an effect");
        let found = vec![gain(Some(2), 0.01), drag, gain(Some(4), 0.02)];
        let fit = context.fit(&Model { effects: found, ..Model::default() }, &base).expect("a fit");
        let accepted = [-90.0, -20.0, -100.0].map(|weight| Accepted::new(Vec::new(), weight, None)).into();
        let standing = on_every_cable(&context, Standing { fit, accepted, ..Standing::new(&context, base) });
        (standing.effects().to_vec(), standing.accepted.len())
    }

    #[test]
    fn what_every_winch_has_is_one_law() {
        let (effects, taken) = stands(&[gain(None, 0.01)]);
        let ids: Vec<(&str, Option<usize>)> = effects.iter().map(|effect| (&effect.id[..], effect.cable)).collect();
        assert_eq!(ids, [("platform_linear_drag", None), ("winch_force_gain", None)]);
        assert_eq!(taken, 2);
        assert!((effects[1].values[0] / 0.01 - 1.0).abs() < 0.02, "{effects:?}");
    }

    #[test]
    fn what_one_winch_shows_is_asked_of_all() {
        let found = |hidden: &[EffectSpec]| {
            let evidence = evidence(hidden);
            let (context, base) = begun(&evidence);
            let model = Model { effects: vec![gain(Some(2), 0.01)], ..Model::default() };
            let fit = context.fit(&model, &base).expect("a fit");
            let accepted = vec![Accepted::new(Vec::new(), -90.0, None)];
            let standing = on_every_cable(&context, Standing { fit, accepted, ..Standing::new(&context, base) });
            standing.effects()[0].cable
        };
        assert_eq!(found(&[gain(None, 0.01)]), None);
        assert_eq!(found(&[gain(Some(2), 0.01)]), Some(2));
    }

    #[test]
    fn what_two_winches_have_stays_with_these() {
        let (effects, taken) = stands(&[gain(Some(2), 0.01), gain(Some(4), 0.02)]);
        assert_eq!((effects.len(), taken), (3, 3));
    }
}
