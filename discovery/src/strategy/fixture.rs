//! Searches in a known state, for tests of single steps.

use std::sync::Arc;

use cdpr::effect::EffectSpec;
use cdpr::model_file::Model;

use crate::data::recording::record;
use crate::filter::estimate::noise_of_data;
use crate::strategy::context::Context;
use crate::strategy::fitted::Evidence;
use crate::strategy::standing::{Accepted, Standing};

/// An effect that is known to be one.
pub(crate) fn effect(id: &str, cable: Option<usize>, values: &[f64]) -> EffectSpec {
    EffectSpec::new(id, cable, values).expect("an effect")
}

/// Recordings in which `hidden` effects act: one to train on, one held out.
pub(crate) fn evidence(hidden: &[EffectSpec], seed: u64) -> Evidence {
    let (train, holdout) = (vec![record(hidden, 40.0, seed)], vec![record(hidden, 30.0, seed + 1)]);
    let noise = noise_of_data(&[&train[..], &holdout[..]].concat());
    Evidence::new(train, holdout, noise)
}

/// A search of `model` that has not begun.
pub(crate) fn begun<'a>(evidence: &'a Evidence, model: &Model) -> (Context<'a>, Standing) {
    let given = model.effects.len();
    let (context, base) = Context::begin(evidence, model, given..given, &|_, _| {}).expect("a fit");
    let standing = Standing::new(&context, base);
    (context, standing)
}

/// A standing in which these effects were accepted, each with its rivals and what it explains of all.
pub(crate) fn with(context: &Context<'_>, standing: Standing, found: Vec<(EffectSpec, Vec<EffectSpec>)>) -> Standing {
    let mut model = standing.fit.train.model.clone();
    model.effects.extend(found.iter().map(|(effect, _)| effect.clone()));
    let fit = context.fit(&model, &standing.fit).expect("a fit");
    let explained = fit.score - standing.fit.score;
    let accepted = found.into_iter().map(|(_, rivals)| Accepted::new(rivals, explained, None)).collect();
    Standing { base: Arc::clone(&standing.base), fit, accepted, ..standing }
}

/// Id and cable of each effect that was accepted.
pub(crate) fn names(context: &Context<'_>, standing: &Standing) -> Vec<(String, Option<usize>)> {
    standing.found(context).iter().map(|effect| (effect.id.clone(), effect.cable)).collect()
}
