//! One law on every cable in the place of the same law on several, each with its own parameters.
//!
//! The winches and cables of one machine are built alike. Where one effect comes in after the other, a law of all of them is
//! found cable by cable, as far as the recordings show each.

use cdpr::effect::EffectSpec;

use crate::filter::estimate::FitError;
use crate::hypothesis::candidates::is_there;
use crate::journal::Outcome;
use crate::strategy::fitted::Fitted;
use crate::strategy::search::{EVIDENCE, ROUNDS, Search, Taken};

impl Search<'_> {
    /// `fitted` with one law on every cable wherever one stands on several, if the training data are no less likely by it than
    /// its fewer parameters allow, and the held-out data no less likely.
    pub(crate) fn on_every_cable(&mut self, mut fitted: Fitted) -> Fitted {
        let mut tried: Vec<EffectSpec> = Vec::new();
        loop {
            let effects = &fitted.train.model.effects;
            let untried = |effect: &&EffectSpec| !tried.iter().any(|other| same_law(other, effect));
            let several = effects[self.given..].iter().filter(untried).find(|effect| {
                let of_id = effects.iter().filter(|other| is_there(other, &effect.id, None));
                of_id.clone().count() > 1
                    && of_id.into_iter().all(|other| other.cable.is_some() && same_law(other, effect))
            });
            let Some(law) = several.cloned() else { return fitted };
            fitted = self.one_for_all(fitted, &law);
            tried.push(law);
        }
    }

    /// `fitted` with one law in the place of all that are the same as `law`, if that is as good.
    fn one_for_all(&mut self, fitted: Fitted, law: &EffectSpec) -> Fitted {
        let effects = &fitted.train.model.effects;
        let places: Vec<usize> = (self.given..effects.len()).filter(|at| same_law(&effects[*at], law)).collect();
        let strength = |at: &&usize| self.taken[**at - self.given].delta_bic;
        let strongest = places.iter().min_by(|a, b| strength(a).total_cmp(&strength(b))).copied();
        let Some(strongest) = strongest else { return fitted };
        let all = EffectSpec { cable: None, ..effects[strongest].clone() };
        let what = format!("on every cable in the place of {}", places.len());
        let next = self.journal.tried(&all, &what, self.in_place_of(&fitted, &places, strongest, &all));
        let Some(next) = next.flatten() else { return fitted };
        let stays = |place: usize| place == strongest || !places.contains(&place);
        let at = (0..strongest).filter(|place| stays(*place)).count();
        self.journal.note(&next.train.model.effects[at], Outcome::Replaced, next.score - fitted.score, &what);
        let explained = places.iter().map(|place| self.taken[place - self.given].delta_bic).sum();
        let one = &mut self.taken[strongest - self.given];
        one.delta_bic = explained;
        one.alternatives.clear();
        one.rivals.retain(|rival| rival.id != all.id);
        one.rivals.iter_mut().for_each(|rival| rival.cable = None);
        let mut number = self.given..;
        self.taken.retain(|_| number.next().is_some_and(stays));
        self.taken.iter_mut().for_each(Taken::changed);
        next
    }

    fn in_place_of(
        &self,
        fitted: &Fitted,
        places: &[usize],
        strongest: usize,
        all: &EffectSpec,
    ) -> Result<Option<Fitted>, FitError> {
        let mut model = fitted.train.model.clone();
        model.effects[strongest] = all.clone();
        let mut number = 0..;
        model.effects.retain(|_| number.next().is_some_and(|at| at == strongest || !places.contains(&at)));
        let next = self.fit(&model, fitted, ROUNDS)?;
        let as_good = next.score <= fitted.score && next.holdout_score < fitted.holdout_score + 0.5 * EVIDENCE;
        Ok(as_good.then_some(next))
    }
}

/// Whether two effects are one law on two cables, at work at the same times.
fn same_law(a: &EffectSpec, b: &EffectSpec) -> bool {
    let on_its_own = |effect: &EffectSpec| EffectSpec { cable: None, values: Vec::new(), ..effect.clone() };
    a.expression.is_none() && on_its_own(a) == on_its_own(b)
}

#[cfg(test)]
mod tests {
    use cdpr::model_file::Model;

    use super::*;
    use crate::data::recording::record;
    use crate::filter::estimate::noise_of_data;
    use crate::strategy::fitted::Evidence;

    fn gain(cable: Option<usize>, value: f64) -> EffectSpec {
        EffectSpec::new("winch_force_gain", cable, &[value]).expect("an effect")
    }

    /// What stands after gains on cables 2 and 4 were found, where `hidden` acts.
    fn stands(hidden: &[EffectSpec]) -> (Vec<EffectSpec>, usize) {
        let train = vec![record(hidden, 40.0, 11), record(hidden, 30.0, 12)];
        let holdout = vec![record(hidden, 30.0, 13)];
        let noise = noise_of_data(&train);
        let evidence = Evidence { train, holdout, noise, instruments: None };
        let mut search = Search::new(&evidence, 0, &|_, _| {});
        let base = search.base(&Model::default()).expect("a fit");
        let drag = EffectSpec::new("platform_linear_drag", None, &[1.0]).expect("an effect");
        let found = vec![gain(Some(2), 0.01), drag, gain(Some(4), 0.02)];
        let fitted = search.fit(&Model { effects: found, ..Model::default() }, &base, ROUNDS).expect("a fit");
        search.taken = [-90.0, -20.0, -100.0].map(|weight| Taken::new(Vec::new(), weight, None)).into();
        let fitted = search.on_every_cable(fitted);
        (fitted.train.model.effects, search.taken.len())
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
    fn what_two_winches_have_stays_with_these() {
        let (effects, taken) = stands(&[gain(Some(2), 0.01), gain(Some(4), 0.02)]);
        assert_eq!((effects.len(), taken), (3, 3));
    }
}
