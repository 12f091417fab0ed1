//! Rivals of an effect: other explanations in its place, fitted for a comparison.
//!
//! Most are seen on the beginnings of the trials to be far off, where a law is also found sooner when it is far from a start.

use cdpr::effect::EffectSpec;
use rayon::prelude::*;

use crate::data::Trial;
use crate::filter::estimate::FitError;
use crate::hypothesis::candidates::is_there;
use crate::hypothesis::extension::{containing, count_in_use, extended_like};
use crate::strategy::fitted::{Fitted, Trained};
use crate::strategy::search::{EVIDENCE, FAR_OFF, NOTHING_LEFT, ROUNDS, Search};
use crate::weigh::likelihood_ratio::overdispersion;

/// Rounds of a refinement that starts near its end.
const FEW_ROUNDS: usize = 4;
/// What the criterion must rise on the beginnings for no shape of a law to make up for it.
const HOPELESS: f64 = 10.0 * FAR_OFF;

/// Difference of the criterion up to which two explanations are not told apart.
const INDISTINGUISHABLE: f64 = 10.0;
/// The same as a share of what the effect explains: no law is known to be exact beyond this.
const INDISTINGUISHABLE_SHARE: f64 = 0.01;

/// Difference of the criterion up to which an effect that explains `delta_bic` and another one are not told apart.
pub(crate) fn told_apart_from(delta_bic: f64) -> f64 {
    INDISTINGUISHABLE.max(INDISTINGUISHABLE_SHARE * delta_bic.abs())
}

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
    /// by how well they fit, and not by how many parameters they have: the price of those says which one to believe first.
    pub(crate) fn as_likely(&self, explained: f64) -> bool {
        let fit = (self.delta_bic - self.price.max(0.0)) / self.overdispersion;
        self.whole.is_some() && fit < told_apart_from(explained)
    }
}

impl Search<'_> {
    /// The rivals of every effect in its place, the best first.
    pub(crate) fn all_rivals(&self, fitted: &Fitted) -> Vec<Vec<Rival>> {
        self.journal.side_by_side(|| {
            (0..self.taken.len()).into_par_iter().map(|k| self.rivals_of(fitted, self.given + k)).collect()
        })
    }

    fn rivals_of(&self, fitted: &Fitted, at: usize) -> Vec<Rival> {
        // What stands beside it already cannot stand in its place as well.
        let beside: Vec<&EffectSpec> =
            fitted.train.model.effects.iter().enumerate().filter(|(k, _)| *k != at).map(|(_, effect)| effect).collect();
        let can_stand = |rival: &&EffectSpec| !beside.iter().any(|effect| is_there(effect, &rival.id, rival.cable));
        let rivals = self.taken[at - self.given].rivals.par_iter().filter(can_stand);
        let what = format!("in place of {}", fitted.train.model.effects[at].id);
        let tried = |rival: &EffectSpec| self.journal.tried(rival, &what, self.in_its_place(fitted, at, rival));
        let mut out: Vec<Rival> = rivals.filter_map(tried).collect();
        out.sort_by(|a, b| a.delta_bic.total_cmp(&b.delta_bic));
        out
    }

    fn in_its_place(&self, fitted: &Fitted, at: usize, rival: &EffectSpec) -> Result<Rival, FitError> {
        let (trials, beginnings) = (&self.evidence.train, &self.beginnings);
        let standing = self.begun(&fitted.train)?;
        let limit = self.score(&standing, beginnings);
        let law = &fitted.train.model.effects[at];
        let mut model = fitted.train.model.clone();
        let price = |effect: &EffectSpec| self.penalty.of(count_in_use(effect).max(1));
        let wider = containing(&rival.id, law);
        let contains = wider.is_some();
        let (begun, far_off) = if let Some(wider) = wider {
            // It is at its best where it is the law that stands, or near, and must be better there.
            model.effects[at] = wider;
            (self.train(&model, &standing, beginnings, FEW_ROUNDS, None)?, 0.0)
        } else {
            model.effects[at] = extended_like(rival, law);
            let aim = standing.minus_two_log_likelihood(beginnings, &standing.randomness);
            let start = self.loosened(&model, &standing, beginnings)?;
            let mut begun = self.train(&model, &start, beginnings, ROUNDS, Some(aim))?;
            if begun.score < limit + HOPELESS {
                begun = self.shaped(begun, at);
            }
            // What an effect explains of the whole it explains in proportion of a part.
            let samples = |trials: &[Trial]| trials.iter().map(Trial::len).sum::<usize>() as f64;
            let explained = self.taken[at - self.given].delta_bic * samples(beginnings) / samples(trials);
            (begun, FAR_OFF.max(told_apart_from(explained)))
        };
        if begun.score > limit + far_off {
            let effect = begun.fit.model.effects[at].clone();
            let price = price(&effect) - price(law);
            return Ok(Rival { effect, delta_bic: begun.score - limit, price, overdispersion: 1.0, whole: None });
        }
        let whole = if contains {
            self.train(&begun.fit.model, &fitted.train, trials, ROUNDS, None)?
        } else {
            let start = self.loosened(&begun.fit.model, &fitted.train, trials)?;
            let aim = fitted.train.minus_two_log_likelihood(trials, &fitted.train.randomness);
            self.train(&begun.fit.model, &start, trials, ROUNDS, Some(aim))?
        };
        let effect = whole.fit.model.effects[at].clone();
        let price = price(&effect) - price(law);
        let overdispersion = overdispersion(&fitted.train, &whole.fit, trials);
        Ok(Rival { effect, delta_bic: whole.score - fitted.score, price, overdispersion, whole: Some(whole) })
    }

    /// The model with one of the rivals of the last effect of `next` in its place, if that is better: where a gap is left, what
    /// still misses can make a look-alike weigh more. Rivals are tried on the beginnings of the trials first.
    pub(crate) fn or_rival(
        &self,
        fitted: &Fitted,
        next: &Fitted,
        rivals: &mut [EffectSpec],
    ) -> Result<Option<Fitted>, FitError> {
        if next.gap[0] <= NOTHING_LEFT || rivals.is_empty() {
            return Ok(None);
        }
        let begun = self.begun(&fitted.train)?;
        let standing = self.begun(&next.train)?;
        let limit = self.score(&standing, &self.beginnings) - EVIDENCE;
        let aim = standing.minus_two_log_likelihood(&self.beginnings, &standing.randomness);
        let tried = rivals.par_iter().enumerate().filter_map(|(at, rival)| {
            let mut model = fitted.train.model.clone();
            model.effects.push(rival.clone());
            let tried = self.train(&model, &begun, &self.beginnings, ROUNDS, Some(aim));
            let tried = self.journal.tried(rival, "as a rival", tried)?;
            (tried.score < limit).then_some((at, tried))
        });
        let best = self.journal.side_by_side(|| tried.min_by(|a, b| a.1.score.total_cmp(&b.1.score)));
        let Some((at, better)) = best else { return Ok(None) };
        let other = self.train(&better.fit.model, &fitted.train, &self.evidence.train, ROUNDS, None)?;
        if other.score >= next.score {
            return Ok(None);
        }
        let other = self.verified(other, fitted)?;
        if !Self::helps(next, &other) {
            return Ok(None);
        }
        rivals[at].clone_from(&next.train.model.effects[fitted.train.model.effects.len()]);
        Ok(Some(other))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_price_of_a_parameter_tells_no_laws_apart() {
        let effect = EffectSpec::new("pose_sensor_bias", None, &[0.1, 0.1, 0.0]).expect("an effect");
        let trials = [crate::data::recording::record(&[], 20.0, 1)];
        let fit = crate::data::recording::fitted(&[], &trials);
        let whole = || Some(Trained { fit: fit.clone(), estimate: None, score: 0.0 });
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
        let begun = Rival { whole: None, ..rival(0.0, 0.0) };
        assert!(!begun.as_likely(-900.0));
    }
}
