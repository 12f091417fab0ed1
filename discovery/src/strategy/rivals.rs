//! Rivals of an effect: other explanations in its place, fitted for a comparison.
//!
//! Most are seen on the beginnings of the trials to be far off, where a law is also found sooner when it is far from a start.

use cdpr::effect::EffectSpec;
use cdpr::model_file::Model;
use rayon::prelude::*;

use crate::data::Trial;
use crate::filter::error::FitError;
use crate::filter::estimate::Fit;
use crate::hypothesis::candidates::is_there;
use crate::hypothesis::containing::{contained, containing};
use crate::hypothesis::extension::{count_in_use, extended_like, is_one_law, same_law};
use crate::hypothesis::stood_for::stood_for;
use crate::strategy::context::Context;
use crate::strategy::fitted::{Fitted, Trained};
use crate::strategy::form::Forms;
use crate::strategy::standing::Standing;
use crate::weigh::criterion::{EVIDENCE, told_apart_from};
use crate::weigh::likelihood_ratio::overdispersion;

/// Another explanation in the place of an effect.
pub(crate) struct Rival {
    pub(crate) effect: EffectSpec,
    /// Criterion with it minus that of the model that stands: of all training data, or of their beginnings alone.
    pub(crate) delta_bic: f64,
    /// The part of that which is the price of the parameters that it has more.
    pub(crate) price: f64,
    /// How many times that scatters more than it would if what is left were white.
    pub(crate) overdispersion: f64,
    /// Its fit to all training data; none of one that needs no more than the beginnings to be told apart.
    pub(crate) whole: Option<Trained>,
}

impl Rival {
    /// Whether it is a law so near one that explains `explained` that the data do not tell the two apart. Data tell laws apart
    /// by how well they fit, and not by how many parameters they have: the price of those says which one to believe first. What
    /// explains nothing is no law that may be missing.
    pub(crate) fn as_likely(&self, explained: f64) -> bool {
        let fit = (self.delta_bic - self.price.max(0.0)) / self.overdispersion;
        self.whole.is_some() && fit < told_apart_from(explained) && self.delta_bic < -explained
    }
}

/// The rivals of every effect in its place, the best first.
pub(crate) fn all_rivals(context: &Context<'_>, standing: &Standing) -> Vec<Vec<Rival>> {
    context.journal.side_by_side(|| {
        (0..standing.accepted.len()).into_par_iter().map(|k| rivals_of(context, standing, k)).collect()
    })
}

fn rivals_of(context: &Context<'_>, standing: &Standing, k: usize) -> Vec<Rival> {
    // What stands beside it already cannot stand in its place as well.
    let (beside, effect) = standing.without(context, k);
    let can_stand = |rival: &&EffectSpec| !beside.effects.iter().any(|effect| is_there(effect, &rival.id, rival.cable));
    // Laws that one found near by stands for differ from it where something is left only.
    let left = standing.fit.gap[0] > context.policy.nothing_left;
    let behind = if left { stood_for(&effect, &standing.fit.train.model) } else { Vec::new() };
    // Also where the wider law explained so much more at first sight that the one within it was no rival.
    let weighed = &standing.accepted[k].rivals;
    let within = contained(&effect).filter(|law| !weighed.iter().any(|rival| is_one_law(rival, law)));
    let kin = kin(&effect, &beside.effects, beside.parameters.cables());
    let what = format!("in place of {}", effect.id);
    let tried = |rival: &EffectSpec| context.journal.tried(rival, &what, in_its_place(context, standing, k, rival));
    let rivals = weighed.par_iter().chain(&behind).chain(within.par_iter()).chain(&kin).filter(can_stand);
    let mut out: Vec<Rival> = rivals.filter_map(tried).collect();
    out.sort_by(|a, b| a.delta_bic.total_cmp(&b.delta_bic));
    out
}

/// Laws that most cables have, on those that lack them: what stands `beside` may have come in for what one of them does there.
fn kin(effect: &EffectSpec, beside: &[EffectSpec], cables: usize) -> Vec<EffectSpec> {
    let mut out: Vec<EffectSpec> = Vec::new();
    for law in beside.iter().filter(|law| law.cable.is_some() && law.id != effect.id) {
        let alike = beside.iter().filter(|other| same_law(other, law));
        let has: Vec<usize> = alike.filter_map(|other| other.cable).collect();
        if 2 * has.len() > cables && !out.iter().any(|kin| kin.id == law.id) {
            let lacking = (1..=cables).filter(|cable| !has.contains(cable));
            out.extend(lacking.map(|cable| EffectSpec { cable: Some(cable), ..law.clone() }));
        }
    }
    out
}

fn in_its_place(context: &Context<'_>, standing: &Standing, k: usize, rival: &EffectSpec) -> Result<Rival, FitError> {
    let (trials, beginnings) = (&context.evidence.train, &standing.beginnings[..]);
    let (fitted, policy, at) = (&standing.fit, context.policy, context.at(k));
    let begun = standing.begun(context, &fitted.train)?;
    let limit = context.score(&begun, beginnings);
    let law = &fitted.train.model.effects[at];
    let mut model = fitted.train.model.clone();
    let price = |effect: &EffectSpec| context.penalty.of(count_in_use(effect).max(1));
    let wider = containing(&rival.id, law);
    let contains = wider.is_some();
    let (begun, far_off) = if let Some(wider) = wider {
        // It is at its best where it is the law that stands, or near, and must be better there.
        model.effects[at] = wider;
        (context.train(&model, &begun, beginnings, policy.rounds_near_the_end, None)?, 0.0)
    } else {
        model.effects[at] = extended_like(rival, law);
        let mut begun = trained_in_its_place(context, &model, at, &begun, beginnings)?;
        if begun.score < limit + policy.hopeless {
            begun = Forms { context, beginnings }.shaped(begun, at);
        }
        // What an effect explains of the whole it explains in proportion of a part.
        let samples = |trials: &[Trial]| trials.iter().map(Trial::len).sum::<usize>() as f64;
        let explained = standing.accepted[k].delta_bic * samples(beginnings) / samples(trials);
        (begun, policy.far_off.max(told_apart_from(explained)))
    };
    if begun.score > limit + far_off {
        let effect = begun.fit.model.effects[at].clone();
        let price = price(&effect) - price(law);
        return Ok(Rival { effect, delta_bic: begun.score - limit, price, overdispersion: 1.0, whole: None });
    }
    let whole = if contains {
        context.train(&begun.fit.model, &fitted.train, trials, policy.rounds, None)?
    } else {
        trained_in_its_place(context, &begun.fit.model, at, &fitted.train, trials)?
    };
    let effect = whole.fit.model.effects[at].clone();
    let price = price(&effect) - price(law);
    let overdispersion = overdispersion(&fitted.train, &whole.fit, trials);
    Ok(Rival { effect, delta_bic: whole.score - fitted.score, price, overdispersion, whole: Some(whole) })
}

/// A model with another law, of this number, fitted to `trials`: first with latent forces that carry what the law that stood did. Where
/// its trajectory has not settled as they became smaller its likelihood is none, and it is fitted from the trajectory that stands,
/// which a law much like the other follows at once.
fn trained_in_its_place(
    context: &Context<'_>,
    model: &Model,
    at: usize,
    stands: &Fit,
    trials: &[Trial],
) -> Result<Trained, FitError> {
    let aim = stands.minus_two_log_likelihood(trials, &stands.randomness);
    let train = |start: &Fit| context.train(model, start, trials, context.policy.rounds, Some(aim));
    let loosened = context.loosened(model, stands, trials).and_then(|start| train(&start));
    if loosened.as_ref().is_ok_and(|trained| trained.fit.has_settled()) {
        return loosened;
    }
    let law = &model.effects[at];
    let there = context.journal.tried(law, "from the trajectory that stands", train(stands));
    match there.filter(|there| there.fit.has_settled()) {
        Some(there) => {
            context.journal.tried(law, "with latent forces first", loosened);
            Ok(there)
        }
        None => loosened,
    }
}

/// What stands with one of the rivals of the last effect of `next` in its place, if that is better: where a gap is left, what
/// still misses can make a look-alike weigh more. Rivals are tried on the beginnings of the trials first.
pub(crate) fn or_rival(
    context: &Context<'_>,
    standing: &Standing,
    next: &Fitted,
    rivals: &mut [EffectSpec],
) -> Result<Option<Fitted>, FitError> {
    let (fitted, policy) = (&standing.fit, context.policy);
    if next.gap[0] <= policy.nothing_left || rivals.is_empty() {
        return Ok(None);
    }
    let begun = standing.begun(context, &fitted.train)?;
    let with_next = standing.begun(context, &next.train)?;
    let limit = context.score(&with_next, &standing.beginnings) - EVIDENCE;
    let aim = with_next.minus_two_log_likelihood(&standing.beginnings, &with_next.randomness);
    let tried = rivals.par_iter().enumerate().filter_map(|(number, rival)| {
        let mut model = fitted.train.model.clone();
        model.effects.push(rival.clone());
        let tried = context.train(&model, &begun, &standing.beginnings, policy.rounds, Some(aim));
        let tried = context.journal.tried(rival, "as a rival", tried)?;
        (tried.score < limit).then_some((number, tried))
    });
    let mut better: Vec<(usize, Trained)> = context.journal.side_by_side(|| tried.collect());
    better.sort_by(|a, b| a.1.score.total_cmp(&b.1.score));
    // What is better on the beginnings may not be on the whole, and leaves its place to the next.
    for (number, begun) in better {
        let whole = context.train(&begun.fit.model, &fitted.train, &context.evidence.train, policy.rounds, None);
        let whole = context.journal.tried(&rivals[number], "as a rival on the whole", whole);
        let Some(whole) = whole.filter(|whole| whole.score < next.score) else { continue };
        let other = context.verified(whole, fitted);
        let other = context.journal.tried(&rivals[number], "as a rival on held-out data", other);
        if let Some(other) = other.filter(|other| other.helps(next, policy)) {
            rivals[number].clone_from(&next.train.model.effects[fitted.train.model.effects.len()]);
            return Ok(Some(other));
        }
    }
    Ok(None)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::recording::{Bench, record_on};
    use crate::filter::estimate::noise_of_data;
    use crate::strategy::fitted::Evidence;
    use crate::strategy::fixture::{begun, effect, evidence, with};

    /// Four load cells off by some tenths of a per cent each came out as the gains of three, and a lighter platform.
    #[test]
    fn the_law_that_most_cables_have_is_the_rival_of_what_stands_beside_on_those_that_lack_it() {
        let gain = |cable: usize| effect("winch_force_gain", Some(cable), &[0.004]);
        let mass = effect("platform_mass", None, &[-5.0]);
        assert_eq!(kin(&mass, &[gain(1), gain(3), gain(4)], 4), [gain(2)]);
        // Of these each may be by itself, and no law is its own rival.
        assert_eq!(kin(&mass, &[gain(1), gain(3)], 4), []);
        assert_eq!(kin(&gain(1), &[gain(2), gain(3), gain(4), mass.clone()], 5), []);
        assert_eq!(kin(&mass, &[gain(1), gain(2), gain(3), gain(4)], 4), []);
    }

    /// Where winches ring between samples, a dead time of all of them gives its place to the lag that is there.
    #[test]
    fn a_lag_is_better_than_the_dead_time_that_stands_for_it() {
        let bench = Bench::ringing();
        let lag = effect("winch_lag", None, &[0.01, 0.0]);
        let recorded = |seed: u64| record_on(&bench, std::slice::from_ref(&lag), 10.0, seed);
        let (train, holdout) = (vec![recorded(61)], vec![recorded(62)]);
        let noise = noise_of_data(&train);
        let evidence = Evidence::new(train, holdout, noise);
        let model = Model { parameters: bench.parameters.clone(), ..Model::default() };
        let (context, standing) = begun(&evidence, &model);
        let dead_time = effect("winch_delay", None, &[0.01]);
        let standing = with(&context, standing, vec![(dead_time, vec![lag])]);
        let rivals = rivals_of(&context, &standing, 0);
        assert!(rivals[0].whole.as_ref().is_some_and(|whole| whole.fit.has_settled()));
        assert!(rivals[0].effect.id == "winch_lag" && rivals[0].delta_bic < -10.0, "{}", rivals[0].delta_bic);
    }

    /// Friction that turns over 0.02 m/s came in as Stribeck's, whose static force was then that of sliding, and stayed that.
    #[test]
    fn the_law_within_a_wider_one_is_a_rival_of_it() {
        let evidence = evidence(&[effect("winch_coulomb_friction", Some(2), &[180.0, 0.02])], 63);
        let (context, standing) = begun(&evidence, &Model::default());
        let wider = effect("winch_stribeck_friction", Some(2), &[180.0, 190.0, 0.05, 0.0, 0.02]);
        let standing = with(&context, standing, vec![(wider, Vec::new())]);
        let rivals = rivals_of(&context, &standing, 0);
        let laws: Vec<&str> = rivals.iter().map(|rival| rival.effect.id.as_str()).collect();
        assert!(laws == ["winch_coulomb_friction"] && rivals[0].delta_bic < 0.0, "{laws:?} {}", rivals[0].delta_bic);
    }

    #[test]
    fn the_price_of_a_parameter_tells_no_laws_apart() {
        let effect = EffectSpec::new("pose_sensor_bias", None, &[0.1, 0.1, 0.0]).expect("an effect");
        let trials = [crate::data::recording::record(&[], 20.0, 1)];
        let fit = crate::data::recording::fitted(&[], &trials);
        let whole = || Some(Trained { fit: fit.clone(), score: 0.0 });
        let rival =
            |delta_bic, price| Rival { effect: effect.clone(), delta_bic, price, overdispersion: 1.0, whole: whole() };
        // As good a fit with a parameter more, or with one less.
        assert!(rival(10.42, 10.46).as_likely(-900.0));
        assert!(rival(-10.5, -10.46).as_likely(-900.0));
        // A fit that is worse by more than the evidence asked for.
        assert!(!rival(21.0, 10.46).as_likely(-900.0));
        assert!(!rival(12.0, 0.0).as_likely(-900.0));
        // A poorer fit that has fewer parameters: the criterion does not tell the two apart.
        assert!(rival(2.0, -10.46).as_likely(-900.0));
        // No law is known to be exact: 1 % of what the effect explains.
        assert!(rival(80.0, 0.0).as_likely(-9000.0));
        // Worse than no law at all: friction of 0.6 N beside damping that explained 25.
        assert!(!rival(26.0, 20.9).as_likely(-25.0) && rival(20.0, 20.9).as_likely(-25.0));
        let begun = Rival { whole: None, ..rival(0.0, 0.0) };
        assert!(!begun.as_likely(-900.0));
    }
}
