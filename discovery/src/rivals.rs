//! Rivals of an effect: other explanations in its place, fitted for a comparison.
//!
//! Most are seen on the beginnings of the trials to be far off, where a law is also found sooner when it is far from a start.

use cdpr::effect::EffectSpec;
use rayon::prelude::*;

use crate::estimate::FitError;
use crate::extension::{containing, extended_like};
use crate::fitted::{Fitted, Trained};
use crate::search::{EVIDENCE, FAR_OFF, NOTHING_LEFT, ROUNDS, Search};

/// Rounds of a refinement that starts near its end.
const FEW_ROUNDS: usize = 4;
/// What the criterion must rise on the beginnings for no shape of a law to make up for it.
const HOPELESS: f64 = 10.0 * FAR_OFF;

impl Search<'_> {
    /// Fits the rivals of effect `at` in its place to the training data, those that are far off on its beginnings to these;
    /// the best first.
    pub(crate) fn rivals_of(&self, fitted: &Fitted, at: usize) -> Vec<(EffectSpec, Trained)> {
        let rivals = self.taken[at - self.given].rivals.par_iter();
        let mut out: Vec<_> = rivals.filter_map(|rival| self.in_its_place(fitted, at, rival).ok()).collect();
        out.sort_by(|a, b| a.1.score.total_cmp(&b.1.score));
        out
    }

    fn in_its_place(&self, fitted: &Fitted, at: usize, rival: &EffectSpec) -> Result<(EffectSpec, Trained), FitError> {
        let (trials, beginnings) = (&self.evidence.train, &self.beginnings);
        let standing = fitted.train.begun(beginnings)?;
        let limit = self.score(&standing, beginnings);
        let law = &fitted.train.model.effects[at];
        let mut model = fitted.train.model.clone();
        let other = if let Some(wider) = containing(&rival.id, law) {
            // It is at its best where it is the law that stands, or near.
            model.effects[at] = wider;
            let begun = self.train(&model, &standing, beginnings, FEW_ROUNDS, None)?;
            let rounds = if begun.score > limit { 1 } else { ROUNDS };
            self.train(&begun.fit.model, &fitted.train, trials, rounds, None)?
        } else {
            model.effects[at] = extended_like(rival, law);
            let aim = standing.minus_two_log_likelihood(beginnings, &standing.randomness);
            let start = self.loosened(&model, &standing, beginnings)?;
            let mut begun = self.train(&model, &start, beginnings, ROUNDS, Some(aim))?;
            if begun.score < limit + HOPELESS {
                begun = self.shaped(begun, at);
            }
            let start = self.loosened(&begun.fit.model, &fitted.train, trials)?;
            let rounds = if begun.score > limit + FAR_OFF { 1 } else { ROUNDS };
            let aim = fitted.train.minus_two_log_likelihood(trials, &fitted.train.randomness);
            self.train(&begun.fit.model, &start, trials, rounds, Some(aim))?
        };
        Ok((other.fit.model.effects[at].clone(), other))
    }

    /// `next`, or the model with one of its last effect's rivals in its place if that is better: where a gap is left, what
    /// still misses can make a look-alike weigh more. Rivals are tried on the beginnings of the trials first.
    pub(crate) fn or_rival(
        &self,
        fitted: &Fitted,
        next: Fitted,
        rivals: &mut [EffectSpec],
    ) -> Result<Fitted, FitError> {
        if next.gap[0] <= NOTHING_LEFT || rivals.is_empty() {
            return Ok(next);
        }
        let begun = fitted.train.begun(&self.beginnings)?;
        let standing = next.train.begun(&self.beginnings)?;
        let limit = self.score(&standing, &self.beginnings) - EVIDENCE;
        let aim = standing.minus_two_log_likelihood(&self.beginnings, &standing.randomness);
        let tried = rivals.par_iter().enumerate().filter_map(|(at, rival)| {
            let mut model = fitted.train.model.clone();
            model.effects.push(rival.clone());
            let tried = self.train(&model, &begun, &self.beginnings, ROUNDS, Some(aim)).ok()?;
            (tried.score < limit).then_some((at, tried))
        });
        let Some((at, better)) = tried.min_by(|a, b| a.1.score.total_cmp(&b.1.score)) else { return Ok(next) };
        let other = self.train(&better.fit.model, &fitted.train, &self.evidence.train, ROUNDS, None)?;
        if other.score >= next.score {
            return Ok(next);
        }
        let other = self.verified(other, fitted)?;
        if !Self::helps(&next, &other) {
            return Ok(next);
        }
        rivals[at].clone_from(&next.train.model.effects[fitted.train.model.effects.len()]);
        Ok(other)
    }
}
