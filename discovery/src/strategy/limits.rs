//! Limits of a winch's force of which only one has shown so far.
//!
//! A limit that no command reaches says nothing of itself, so refinement never moves it. Where one limit of a winch stands,
//! the other one is therefore put among the commands, where it acts, and refined from there: before held-out data judge, for
//! these may reach the other one alone.

use crate::filter::estimate::FitError;
use crate::hypothesis::candidates::Situation;
use crate::hypothesis::extension::with;
use crate::strategy::fitted::Trained;
use crate::strategy::search::{EVIDENCE, ROUNDS, Search};

const ID: &str = "winch_saturation";
/// Share of the commands beyond a limit from which it is refined.
const BEYOND: f64 = 0.05;

impl Search<'_> {
    /// `trained` with both limits where its last effect is one limit of a winch's force, if the second earns its place.
    pub(crate) fn both_limits(&self, trained: Trained) -> Trained {
        let Some(one) = trained.fit.model.effects.last() else { return trained };
        let both = self.journal.tried(one, "with its other limit", self.other_limit(&trained));
        both.flatten().unwrap_or(trained)
    }

    fn other_limit(&self, trained: &Trained) -> Result<Option<Trained>, FitError> {
        let model = &trained.fit.model;
        let Some(effect) = model.effects.last().filter(|effect| effect.id == ID) else { return Ok(None) };
        let trials = &self.evidence.train;
        let situation = Situation::of(trials);
        let quantile = |share: f64| situation.quantile(effect.cable, share);
        let limit = match effect.values[..] {
            [lower, _] if lower < quantile(0.0) => ("lower", quantile(BEYOND)),
            [_, upper] if upper > quantile(1.0) => ("upper", quantile(1.0 - BEYOND)),
            _ => return Ok(None),
        };
        let model = with(model, model.effects.len() - 1, &[limit]);
        if model.check().is_err() {
            return Ok(None);
        }
        let start = self.loosened(&model, &trained.fit, trials)?;
        let next = self.train(&model, &start, trials, ROUNDS, None)?;
        Ok((next.score < trained.score - EVIDENCE).then_some(next))
    }
}

#[cfg(test)]
mod tests {
    use cdpr::effect::EffectSpec;
    use cdpr::model_file::Model;

    use super::*;
    use crate::data::recording::record;
    use crate::filter::estimate::noise_of_data;
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
            let mut search = Search::new(&evidence, 0, &|_, _| {});
            let base = search.base(&Model::default()).expect("a fit");
            let one = Model { effects: vec![limits(reached(0.1), beyond)], ..Model::default() };
            let one = search.train(&one, &base.train, &evidence.train, ROUNDS, None).expect("a fit");
            let both = search.both_limits(one).fit.model.effects[0].values.clone();
            assert!((both[0] / reached(0.1) - 1.0).abs() < 4e-3, "{both:?}");
            assert_eq!(both[1] == beyond, !joins, "{both:?}");
            assert!((both[1] / upper - 1.0).abs() < 4e-3, "{both:?} {upper}");
        }
    }
}
