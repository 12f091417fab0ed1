//! Limits of a winch's force of which only one has shown so far.
//!
//! A limit that no command reaches says nothing of itself, so refinement never moves it. Where one limit of a winch stands,
//! the other one is therefore put among the commands, where it acts, and refined from there.

use crate::candidates::Situation;
use crate::estimate::FitError;
use crate::extension::with;
use crate::fitted::Fitted;
use crate::journal::Outcome;
use crate::search::{EVIDENCE, ROUNDS, Search};

const ID: &str = "winch_saturation";
/// Share of the commands beyond a limit from which it is refined.
const BEYOND: f64 = 0.05;

impl Search<'_> {
    /// `fitted` with both limits where its last effect is one limit of a winch's force, if the second earns its place.
    pub(crate) fn both_limits(&mut self, fitted: Fitted) -> Fitted {
        let Some(one) = fitted.train.model.effects.last() else { return fitted };
        let both = self.journal.tried(one, "with its other limit", self.other_limit(&fitted));
        let Some(next) = both.flatten() else { return fitted };
        let delta_bic = next.score - fitted.score;
        let (Some(effect), Some(taken)) = (next.train.model.effects.last(), self.taken.last_mut()) else {
            return fitted;
        };
        taken.delta_bic += delta_bic;
        self.journal.note(&effect.clone(), Outcome::Extended, delta_bic, "");
        next
    }

    fn other_limit(&self, fitted: &Fitted) -> Result<Option<Fitted>, FitError> {
        let Some(effect) = fitted.train.model.effects.last().filter(|effect| effect.id == ID) else { return Ok(None) };
        let situation = Situation::of(&self.evidence.train);
        let quantile = |share: f64| situation.quantile(effect.cable, share);
        let limit = match effect.values[..] {
            [lower, _] if lower < quantile(0.0) => ("lower", quantile(BEYOND)),
            [_, upper] if upper > quantile(1.0) => ("upper", quantile(1.0 - BEYOND)),
            _ => return Ok(None),
        };
        let model = with(&fitted.train.model, fitted.train.model.effects.len() - 1, &[limit]);
        if model.check().is_err() {
            return Ok(None);
        }
        let next = self.fit_without(&model, fitted, ROUNDS)?;
        Ok((next.score < fitted.score - EVIDENCE && Self::helps(fitted, &next)).then_some(next))
    }
}
