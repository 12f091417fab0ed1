//! Limits of a winch's force of which only one has shown so far.
//!
//! The other one is put among the commands, where it acts, and refined from there: before held-out data judge, for these may
//! reach the other one alone.

use crate::filter::error::FitError;
use crate::hypothesis::candidates::Situation;
use crate::hypothesis::extension::with;
use crate::hypothesis::limits::other_limit;
use crate::strategy::context::Context;
use crate::strategy::fitted::Trained;
use crate::weigh::criterion::EVIDENCE;

/// `trained` with both limits where its last effect is one limit of a winch's force, if the second earns its place.
pub(crate) fn both_limits(context: &Context<'_>, trained: Trained) -> Trained {
    let Some(one) = trained.fit.model.effects.last() else { return trained };
    let both = context.journal.tried(one, "with its other limit", with_other_limit(context, &trained));
    both.flatten().unwrap_or(trained)
}

fn with_other_limit(context: &Context<'_>, trained: &Trained) -> Result<Option<Trained>, FitError> {
    let (model, trials) = (&trained.fit.model, &context.evidence.train);
    let limit = model.effects.last().and_then(|effect| other_limit(effect, &Situation::of(trials)));
    let Some(limit) = limit else { return Ok(None) };
    let model = with(model, model.effects.len() - 1, &[limit]);
    if model.check().is_err() {
        return Ok(None);
    }
    let start = context.loosened(&model, &trained.fit, trials)?;
    let next = context.train(&model, &start, trials, context.policy.rounds, None)?;
    Ok((next.score < trained.score - EVIDENCE).then_some(next))
}

#[cfg(test)]
mod tests {
    use cdpr::effect::EffectSpec;
    use cdpr::model_file::Model;

    use super::*;
    use crate::data::recording::record;
    use crate::filter::estimate::noise_of_data;
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
            let evidence = Evidence { train, holdout, noise, instruments: None };
            let begun = Context::begin(&evidence, &Model::default(), 0..0, &|_, _| {});
            let (context, base) = begun.expect("a fit");
            let one = Model { effects: vec![limits(reached(0.1), beyond)], ..Model::default() };
            let one = context.train(&one, &base.train, &evidence.train, context.policy.rounds, None).expect("a fit");
            let both = both_limits(&context, one).fit.model.effects[0].values.clone();
            assert!((both[0] / reached(0.1) - 1.0).abs() < 4e-3, "{both:?}");
            assert_eq!(both[1] == beyond, !joins, "{both:?}");
            assert!((both[1] / upper - 1.0).abs() < 4e-3, "{both:?} {upper}");
        }
    }
}
