//! What a search goes by and no step changes: the recordings, what counts as evidence, every threshold.

use std::ops::Range;

use cdpr::model_file::Model;

use crate::data::Trial;
use crate::data::turns::turning_time;
use crate::filter::error::FitError;
use crate::filter::estimate::Fit;
use crate::filter::kalman::Randomness;
use crate::journal::Journal;
use crate::strategy::asked::Asked;
use crate::strategy::begin::{begun_by_data, held_by_data};
use crate::strategy::fitted::{Evidence, Fitted};
use crate::strategy::policy::{POLICY, Policy};
use crate::strategy::time_limit::TimeLimit;
use crate::verdict::{self, Reaches, verify};
use crate::weigh::criterion::Penalty;
use crate::weigh::refine::refine;

/// Progress: a message and the fraction done.
pub type Progress<'a> = &'a (dyn Fn(&str, f64) + Sync);

/// What a search goes by. Only the journal, what instruments asked for and what stood last are written to, by every step.
pub(crate) struct Context<'a> {
    pub(crate) evidence: &'a Evidence,
    pub(crate) policy: &'static Policy,
    pub(crate) penalty: Penalty,
    /// Effects of the model from here on are free: errors of the survey, where these are, and what is found.
    pub(crate) free_from: usize,
    /// Number of effects before those that are found.
    pub(crate) given: usize,
    /// Whether errors of the survey may be added.
    pub(crate) geometry_may_be_off: bool,
    /// Whether effects of the model as given may have other numbers.
    pub(crate) given_may_be_off: bool,
    /// Random parts with the model as given.
    pub(crate) base_randomness: Randomness,
    /// Horizons that the growth of errors allows.
    pub(crate) reaches: Reaches,
    /// Length (s) of the beginnings of trials, by which laws are chosen for the whole.
    pub(crate) beginning: f64,
    pub(crate) journal: Journal,
    pub(crate) asked: Asked,
    pub(crate) time: TimeLimit,
    pub(crate) progress: Progress<'a>,
}

impl<'a> Context<'a> {
    /// Fits the model as given, whose effects of these numbers are errors of the `survey`: free, and not found. Effects behind
    /// them are found ones.
    pub(crate) fn begin(
        evidence: &'a Evidence,
        model: &Model,
        survey: Range<usize>,
        progress: Progress<'a>,
    ) -> Result<(Self, Fitted), FitError> {
        let (journal, policy) = (Journal::default(), &POLICY);
        let Evidence { train: trials, holdout: held, noise, instruments, .. } = evidence;
        let measurements: usize =
            trials.iter().map(|t| t.measured.iter().flatten().filter(|v| v.is_finite()).count()).sum();
        let mut train = begun_by_data(evidence, model, &journal)?;
        if !survey.is_empty() {
            let ended = refine(&mut train, trials, survey.start, policy.rounds, None)?;
            journal.stuck(&train.model.effects, ended);
            train.fit_randomness(trials, noise, true);
        }
        let holdout = held_by_data(evidence, &train, &journal)?;
        let context = Self {
            evidence,
            policy,
            penalty: Penalty::new(measurements),
            free_from: survey.start,
            given: survey.end,
            geometry_may_be_off: false,
            given_may_be_off: false,
            base_randomness: train.randomness.clone(),
            reaches: Reaches::of(&holdout, held, noise, &verdict::POLICY),
            beginning: (policy.turns * turning_time(trials, noise)).min(policy.longest_beginning),
            journal,
            asked: Asked::default(),
            time: TimeLimit::default(),
            progress,
        };
        let base = context.finish(train, holdout, instruments.clone());
        Ok((context, base))
    }

    /// The index in the model of the effect that was accepted as number `k`.
    pub(crate) fn at(&self, k: usize) -> usize {
        self.given + k
    }

    /// Whether a fit to `trials` leaves anything: for latent forces, or beside them.
    pub(crate) fn something_left(&self, fit: &Fit, trials: &[Trial]) -> bool {
        fit.randomness.has_latents() || self.more_than_latents(fit, trials)
    }

    /// Whether a fit to `trials` leaves innovations that are not white: more than a force at random explains.
    pub(crate) fn more_than_latents(&self, fit: &Fit, trials: &[Trial]) -> bool {
        verify::whiteness(fit, trials, &fit.randomness.noise).iter().any(|w| w.statistic > w.limit)
    }

    /// The share of all evidence against `base` that `fitted` explains: one where nothing but the noise is left.
    pub(crate) fn explained(&self, base: &Fitted, fitted: &Fitted) -> f64 {
        share(base.score, &fitted.train, fitted.score, &self.evidence.train)
    }
}

/// The share of what a score of a model on `trials` leaves that another, a fit with its `score`, explains: one where that leaves
/// nothing but white noise, none where it is no better.
pub(crate) fn share(from: f64, fit: &Fit, score: f64, trials: &[Trial]) -> f64 {
    let gained = from - score;
    if gained > 0.0 { gained / (gained + fit.beyond_noise(trials)) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use cdpr::effect::EffectSpec;

    use super::*;
    use crate::strategy::fixture::{begun, effect, evidence, with};

    #[test]
    fn the_share_of_what_leaves_nothing_but_noise_is_one() {
        let (drag, gain) =
            (effect("platform_linear_drag", None, &[60.0]), effect("winch_force_gain", Some(1), &[0.01]));
        let evidence = evidence(&[drag.clone(), gain.clone()], 65);
        let (context, standing) = begun(&evidence, &Model::default());
        let explained = |found: &[&EffectSpec]| {
            let found = found.iter().map(|effect| ((*effect).clone(), Vec::new())).collect();
            context.explained(&standing.base, &with(&context, standing.clone(), found).fit)
        };
        let [both, one] = [explained(&[&drag, &gain]), explained(&[&drag])];
        assert!(both > 0.97 && (0.0..0.9).contains(&one), "{both} {one}");
        let Fitted { train, score, .. } = &*standing.base;
        assert_eq!(share(*score, train, *score + 1.0, &evidence.train), 0.0);
    }
}
