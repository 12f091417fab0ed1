//! Laws of which a refinement finds one optimum of two.
//!
//! Where one limit of a winch's force has shown, the other one is put among the forces, where it acts; where a drum is off its
//! axis, its phase is mirrored. Both are refined from there, before held-out data judge: what is missing may reach these alone.

use cdpr::effect::EffectSpec;
use cdpr::model_file::Model;

use crate::data::Trial;
use crate::filter::error::FitError;
use crate::filter::estimate::Fit;
use crate::hypothesis::candidates::Situation;
use crate::hypothesis::drum::mirrored;
use crate::hypothesis::extension::with;
use crate::hypothesis::limits::other_limit;
use crate::hypothesis::stood_for::stood_for;
use crate::strategy::context::Context;
use crate::strategy::fitted::{Fitted, Trained};
use crate::weigh::criterion::EVIDENCE;

/// `trained`, or its last effect refined from where its other optimum may be, if that explains more.
pub(crate) fn better_optimum(context: &Context<'_>, trained: Trained) -> Trained {
    let Some(effect) = trained.fit.model.effects.last() else { return trained };
    let other = context.journal.tried(effect, "from its other optimum", from_the_other(context, &trained));
    other.flatten().unwrap_or(trained)
}

fn from_the_other(context: &Context<'_>, trained: &Trained) -> Result<Option<Trained>, FitError> {
    let (model, trials) = (&trained.fit.model, &context.evidence.train);
    let Some(start) = model.effects.last().and_then(|effect| Start::of(effect, &trained.fit, trials)) else {
        return Ok(None);
    };
    let other = with(model, model.effects.len() - 1, &start.values);
    if other.check().is_err() {
        return Ok(None);
    }
    let next = anew(context, &other, &trained.fit)?;
    Ok((next.score < trained.score - start.evidence).then_some(next))
}

/// A model refined beside loosened latent forces, from a fit of one that does nearly the same.
fn anew(context: &Context<'_>, model: &Model, from: &Fit) -> Result<Trained, FitError> {
    let trials = &context.evidence.train;
    let start = context.loosened(model, from, trials)?;
    context.train(model, &start, trials, context.policy.rounds, None)
}

/// What explains as much as an effect that stands.
#[derive(Debug)]
pub(crate) struct Other {
    /// Index of that effect.
    pub(crate) at: usize,
    pub(crate) effect: EffectSpec,
    /// Criterion with it minus that of what stands.
    pub(crate) behind: f64,
}

impl Other {
    /// How likely it is, where what stands is the only alternative: odds are exp(-behind/2) to 1.
    pub(crate) fn probability(&self) -> f64 {
        1.0 / (1.0 + (0.5 * self.behind).exp())
    }
}

/// What explains as much in the place of an effect that stands, but for less than what is believed, and was not compared with it: the
/// law at its other optimum, and laws of the catalogue that it may stand for.
pub(crate) fn hardly_told(context: &Context<'_>, fitted: &Fitted) -> Vec<Other> {
    let (fit, trials) = (&fitted.train, &context.evidence.train);
    let others = |at: usize| {
        let effect = &fit.model.effects[at];
        let likeness = mirrored(effect, trials).map(|values| with(&fit.model, at, &values).effects[at].clone());
        likeness.into_iter().chain(stood_for(effect, &fit.model)).map(move |other| (at, other))
    };
    let others: Vec<(usize, EffectSpec)> = (context.given..fit.model.effects.len()).flat_map(others).collect();
    let Some((first, _)) = others.first() else { return Vec::new() };
    // Two that are told by little must have come the same way.
    let same =
        context.journal.tried(&fit.model.effects[*first], "once more in the end", anew(context, &fit.model, fit));
    let score = same.map_or(fitted.score, |same| same.score);
    let refined = |(at, other): (usize, EffectSpec)| {
        let mut model = fit.model.clone();
        model.effects[at] = other;
        let what = format!("for {} in the end", fit.model.effects[at].id);
        let next = context.journal.tried(&model.effects[at], &what, anew(context, &model, fit))?;
        let behind = next.score - score;
        (behind < EVIDENCE).then(|| Other { at, effect: next.fit.model.effects[at].clone(), behind })
    };
    others.into_iter().filter_map(refined).collect()
}

/// Where the other optimum of a law may be.
struct Start {
    values: Vec<(&'static str, f64)>,
    /// What it must explain more (fall of the criterion): a number that comes to bear must earn its place.
    evidence: f64,
}

impl Start {
    fn of(effect: &EffectSpec, fit: &Fit, trials: &[Trial]) -> Option<Self> {
        let limit = || {
            let limit = other_limit(effect, || Situation::of(&felt(fit, trials)))?;
            Some(Self { values: vec![limit], evidence: EVIDENCE })
        };
        let drum = || mirrored(effect, trials).map(|values| Self { values: values.to_vec(), evidence: 0.0 });
        limit().or_else(drum)
    }
}

/// Trials with the forces that winches have along a fit in the place of those commanded: where a limit is missing, latent forces take from
/// commands what it cuts off, and among these it would cut nothing.
fn felt(fit: &Fit, trials: &[Trial]) -> Vec<Trial> {
    let linear = fit.linear(trials);
    trials.iter().zip(&*linear).map(|(trial, linear)| Trial { inputs: linear.felt.clone(), ..trial.clone() }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::recording::record;
    use crate::filter::estimate::noise_of_data;
    use crate::hypothesis::drum;
    use crate::hypothesis::extension::value_of;
    use crate::hypothesis::limits::ID;
    use crate::strategy::fitted::Evidence;

    /// A lower limit that stands, where the upper one is missing as well, is joined by it; alone it stays alone.
    #[test]
    fn the_other_limit_comes_in_where_commands_reach_it() {
        let limits = |lower, upper| EffectSpec::new(ID, Some(2), &[lower, upper]).expect("an effect");
        let commands = Situation::of(&[record(&[], 40.0, 5)]);
        let reached = |share: f64| commands.quantile(Some(2), share);
        let beyond = 2.0 * reached(1.0);
        for (upper, joins) in [(reached(0.9), true), (beyond, false)] {
            let hidden = [limits(reached(0.1), upper)];
            let train = vec![record(&hidden, 40.0, 5)];
            let holdout = vec![record(&hidden, 40.0, 6)];
            let noise = noise_of_data(&train);
            let evidence = Evidence::new(train, holdout, noise);
            let begun = Context::begin(&evidence, &Model::default(), 0..0, &|_, _| {});
            let (context, base) = begun.expect("a fit");
            let one = Model { effects: vec![limits(reached(0.1), beyond)], ..Model::default() };
            let one = context.train(&one, &base.train, &evidence.train, context.policy.rounds, None).expect("a fit");
            let both = better_optimum(&context, one).fit.model.effects[0].values.clone();
            assert!((both[0] / reached(0.1) - 1.0).abs() < 4e-3, "{both:?}");
            assert_eq!(both[1] == beyond, !joins, "{both:?}");
            assert!((both[1] / upper - 1.0).abs() < 4e-3, "{both:?} {upper}");
        }
    }

    /// A drum that was fitted at its likeness, with its phase mirrored, came out so, and its radius by 76 of its errors off.
    #[test]
    fn a_drum_comes_out_as_it_is_and_its_likeness_is_said() {
        let hidden = EffectSpec::new(drum::ID, Some(2), &[0.01, 0.3, 0.4]).expect("an effect");
        let recorded = |seed| record(std::slice::from_ref(&hidden), 60.0, seed);
        let (train, holdout) = (vec![recorded(5)], vec![recorded(6)]);
        let noise = noise_of_data(&train);
        let evidence = Evidence::new(train, holdout, noise);
        let begun = Context::begin(&evidence, &Model::default(), 0..0, &|_, _| {});
        let (context, base) = begun.expect("a fit");
        let likeness = mirrored(&hidden, &evidence.train).expect("a likeness");
        let model = with(&Model { effects: vec![hidden.clone()], ..Model::default() }, 0, &likeness);
        let trained = context.train(&model, &base.train, &evidence.train, context.policy.rounds, None).expect("a fit");
        assert!((value_of(&trained.fit.model.effects[0], "phase").expect("a phase") + 0.4).abs() < 0.1);
        let better = better_optimum(&context, trained);
        let found = better.fit.model.effects[0].clone();
        assert!((value_of(&found, "phase").expect("a phase") - 0.4).abs() < 0.1, "{found:?}");
        assert!((value_of(&found, "drum_radius").expect("a radius") - 0.3).abs() < 1e-5, "{found:?}");
        let fitted = context.verified(better, &base).expect("a fit");
        let told = hardly_told(&context, &fitted);
        let mirrored = |other: &Other| value_of(&other.effect, "phase").is_some_and(|phase| phase < 0.0);
        assert!(told.len() == 1 && told.iter().all(|other| mirrored(other) && other.probability() > 0.1), "{told:?}");
    }
}
