//! The search: one effect after the other, refined, compared with its rivals, checked on held-out data.

use std::sync::Arc;

use cdpr::effect::EffectSpec;
use cdpr::model_file::Model;
use rayon::prelude::*;

use crate::candidates::{Library, Situation, catalogue, dictionary};
use crate::data::{Channel, Trial};
use crate::estimate::{Fit, FitError, for_trial};
use crate::extension::{count_in_use, extended_like, is_friction};
use crate::gap::{gap, predict};
use crate::kalman::{Forcing, Keep, Randomness, filter, whiten};
use crate::null_test::{Weighing, of_time_alone};
use crate::outcome::{HORIZON, NullTest, SearchStep};
use crate::refine::{Estimate, refine};
use crate::regression::{Penalty, Scored, baseline, ladder, levels, rank};
use crate::signature;

/// Fall of the information criterion below which nothing is believed, beyond the penalty of the parameters.
pub(crate) const EVIDENCE: f64 = 10.0;
/// Share by which an effect must shrink the squared gap on held-out data.
const EARNED: f64 = 0.005;
/// Share of the best candidate's gain at which a simpler one is preferred.
const SIMPLER: f64 = 0.93;
/// Most candidates of one round that are fitted in full before the round is given up.
const MOST_REFUSALS: usize = 4;
/// Gap from which a missing law may be so strong that it hides itself.
const STRONG: f64 = 5.0;
/// Share of the gap that the first effects must leave for the search to look for such a law before it goes on.
const HIDDEN: f64 = 0.9;
/// Gap over the main horizon on held-out data up to which nothing is left to explain.
pub(crate) const NOTHING_LEFT: f64 = 1.1;
/// Most effects added.
const MOST_EFFECTS: usize = 5;
/// Most rivals of one effect that are fitted in full.
pub(crate) const MOST_RIVALS: usize = 3;
/// Most moves of the trajectory on held-out data.
const MOST_MOVES: usize = 30;
/// Length of the beginnings of trials (s).
const BEGINNING: f64 = 30.0;
/// Gauss-Newton rounds of a refinement.
pub(crate) const ROUNDS: usize = 10;

/// Progress: a message and the fraction done.
pub type Progress<'a> = &'a (dyn Fn(&str, f64) + Sync);

/// The data of a search and what is known of its noise.
pub(crate) struct Evidence {
    pub(crate) train: Vec<Trial>,
    pub(crate) holdout: Vec<Trial>,
    /// Noise by channel of [`Channel::all`].
    pub(crate) noise: Vec<f64>,
}

/// A model fitted to both sets.
#[derive(Clone)]
pub(crate) struct Fitted {
    pub(crate) train: Fit,
    pub(crate) holdout: Fit,
    pub(crate) estimate: Option<Estimate>,
    /// `-2 log L` on the training data plus the penalty of the parameters.
    pub(crate) score: f64,
    /// `-2 log L` on the held-out data.
    pub(crate) holdout_score: f64,
    /// Gap on held-out data over 5 s and 20 s.
    pub(crate) gap: [f64; 2],
}

impl Fitted {
    /// What is left of the gap over 5 s on held-out data, without the noise.
    pub(crate) fn left(&self) -> f64 {
        (self.gap[0].powi(2) - 1.0).max(0.0).sqrt()
    }

    /// Whether more than half of the gap of `base` is left, and enough to speak of.
    pub(crate) fn explains_little(&self, base: &Self) -> bool {
        self.left() > 0.5 * base.left() && self.gap[0] > 1.5
    }
}

/// A model fitted to training data.
pub(crate) struct Trained {
    pub(crate) fit: Fit,
    pub(crate) estimate: Option<Estimate>,
    /// `-2 log L` on these data plus the penalty of the parameters.
    pub(crate) score: f64,
}

/// What a look for hidden laws brought.
enum Look {
    /// A term that explains all.
    Explained(Fitted),
    /// A law that explains more than what was found before.
    Better(Fitted),
    Nothing,
}

/// An effect that was taken up, with the rivals it had then.
#[derive(Clone)]
pub(crate) struct Taken {
    pub(crate) rivals: Vec<EffectSpec>,
    pub(crate) delta_bic: f64,
    /// What chance did in the weighing that brought it up.
    pub(crate) null_test: Option<NullTest>,
    /// The model with all effects but this, where it was fitted since the last change of them.
    pub(crate) without: Option<Arc<Fitted>>,
}

impl Taken {
    pub(crate) fn new(rivals: Vec<EffectSpec>, delta_bic: f64, null_test: Option<NullTest>) -> Self {
        Self { rivals, delta_bic, null_test, without: None }
    }
}

pub(crate) struct Search<'a> {
    pub(crate) evidence: &'a Evidence,
    /// The beginnings of the training trials, by which laws are chosen for the whole.
    pub(crate) beginnings: Vec<Trial>,
    /// Number of effects that the model as given has.
    pub(crate) given: usize,
    pub(crate) taken: Vec<Taken>,
    pub(crate) steps: Vec<SearchStep>,
    pub(crate) candidates: usize,
    /// What chance did in the last weighing of the catalogue.
    pub(crate) null_test: Option<NullTest>,
    pub(crate) progress: Progress<'a>,
    /// Random parts with the model as given.
    base_randomness: Option<Randomness>,
    pub(crate) penalty: Penalty,
}

impl<'a> Search<'a> {
    pub(crate) fn new(evidence: &'a Evidence, given: usize, progress: Progress<'a>) -> Self {
        let count: usize =
            evidence.train.iter().map(|t| t.measured.iter().flatten().filter(|v| v.is_finite()).count()).sum();
        Self {
            evidence,
            beginnings: evidence.train.iter().map(beginning).collect(),
            given,
            taken: Vec::new(),
            steps: Vec::new(),
            candidates: 0,
            null_test: None,
            progress,
            base_randomness: None,
            penalty: Penalty::new(count),
        }
    }

    /// Fits the model as given.
    pub(crate) fn base(&mut self, model: &Model) -> Result<Fitted, FitError> {
        let e = self.evidence;
        let randomness = crate::estimate::first_randomness(model, &e.noise);
        let mut train = Fit::new(model, &e.train, &randomness, None)?;
        train.smooth(&e.train)?;
        train.fit_randomness(&e.train, &e.noise, true);
        train.smooth(&e.train)?;
        self.base_randomness = Some(train.randomness.clone());
        let mut holdout = Fit::new(model, &e.holdout, &train.randomness, None)?;
        holdout.smooth(&e.holdout)?;
        Ok(self.finish(train, holdout, None))
    }

    /// `-2 log L` on training data plus the penalty of the parameters.
    pub(crate) fn score(&self, train: &Fit, trials: &[Trial]) -> f64 {
        let cost: f64 = train.model.effects[self.given..].iter().map(|s| self.penalty.of(count_in_use(s).max(1))).sum();
        train.minus_two_log_likelihood(trials, &train.randomness) + cost
    }

    fn finish(&self, train: Fit, holdout: Fit, estimate: Option<Estimate>) -> Fitted {
        let e = self.evidence;
        let score = self.score(&train, &e.train);
        let holdout_score = holdout.minus_two_log_likelihood(&e.holdout, &train.randomness);
        let gap_over = |horizon: f64| gap(&e.holdout, &predict(&holdout, &e.holdout, horizon), &e.noise).total();
        let gap = [gap_over(HORIZON), gap_over(20.0)];
        Fitted { train, holdout, estimate, score, holdout_score, gap }
    }

    /// Fits `model`, starting from another fit, with its own effects' parameters refined.
    pub(crate) fn fit(&self, model: &Model, from: &Fitted, rounds: usize) -> Result<Fitted, FitError> {
        let trained = self.train(model, &from.train, &self.evidence.train, rounds, None)?;
        self.verified(trained, from)
    }

    /// Fits `model` to `trials` alone, starting from another fit; given up where the `-2 log L` that is aimed at is out of
    /// reach.
    pub(crate) fn train(
        &self,
        model: &Model,
        from: &Fit,
        trials: &[Trial],
        rounds: usize,
        aim: Option<f64>,
    ) -> Result<Trained, FitError> {
        let noise = &self.evidence.noise;
        let mut fit = self.started(model, from, trials)?;
        let estimate = refine(&mut fit, trials, noise, self.given, rounds, aim)?;
        fit.fit_randomness(trials, noise, false);
        let score = self.score(&fit, trials);
        Ok(Trained { fit, estimate: Some(estimate), score })
    }

    /// What was fitted to the training data, on held-out data.
    pub(crate) fn verified(&self, trained: Trained, from: &Fitted) -> Result<Fitted, FitError> {
        let (train, held) = (trained.fit, &self.evidence.holdout);
        let mut holdout = Fit::new(&train.model, held, &train.randomness, Some(&from.holdout))?;
        if holdout.settle(held, MOST_MOVES).is_err() || holdout.overshoots() {
            // With small latents nothing but the model holds a trajectory that is still far off.
            holdout = self.loosened(&train.model, &from.holdout, held)?;
            holdout.settle(held, MOST_MOVES)?;
            holdout.randomness = train.randomness.clone();
            holdout.settle(held, MOST_MOVES)?;
        }
        Ok(self.finish(train, holdout, trained.estimate))
    }

    /// A fit of `model` on training data, starting from another one, with its parameters as they are.
    pub(crate) fn started(&self, model: &Model, from: &Fit, trials: &[Trial]) -> Result<Fit, FitError> {
        let mut fit = Fit::new(model, trials, &from.randomness, Some(from))?;
        if fit.examined.states() != from.examined.states() {
            fit.smooth(trials)?;
            fit.fit_randomness(trials, &self.evidence.noise, true);
        }
        Ok(fit)
    }

    /// Fits a model without something that `from` has: what is left out is again for the latent forces to carry.
    ///
    /// The other effects' parameters adapt in `rounds` of refinement.
    pub(crate) fn fit_without(&self, model: &Model, from: &Fitted, rounds: usize) -> Result<Fitted, FitError> {
        let start = self.loosened(model, &from.train, &self.evidence.train)?;
        let trained = self.train(model, &start, &self.evidence.train, rounds, None)?;
        self.verified(trained, from)
    }

    /// A fit of `model` from which others can start: with latent forces as large as in the model as given.
    pub(crate) fn loosened(&self, model: &Model, from: &Fit, trials: &[Trial]) -> Result<Fit, FitError> {
        let noise = from.randomness.noise.clone();
        let randomness = self.base_randomness.as_ref().map_or_else(|| from.randomness.clone(), |base| base.clone());
        let mut start = Fit::new(model, trials, &Randomness { noise, ..randomness }, Some(from))?;
        start.smooth(trials)?;
        start.fit_randomness(trials, &self.evidence.noise, true);
        Ok(start)
    }

    pub(crate) fn note(&mut self, effect: &EffectSpec, outcome: &str, delta_bic: f64, reason: &str) {
        self.steps.push(SearchStep {
            effect: effect.clone(),
            outcome: outcome.to_owned(),
            delta_bic,
            reason: reason.to_owned(),
        });
    }

    /// Whether `next` predicts the held-out data better, sample by sample. Among several missing effects one alone may
    /// not shrink the gap of a free run, but it must do this.
    pub(crate) fn helps(before: &Fitted, next: &Fitted) -> bool {
        next.holdout_score < before.holdout_score - 0.5 * EVIDENCE
    }

    /// Whether `next` shrinks the gap on held-out data by what an effect must earn.
    fn earns(before: &Fitted, next: &Fitted) -> bool {
        let shrink = |k: usize| 1.0 - (next.gap[k] / before.gap[k]).powi(2);
        let (short, long) = (shrink(0), shrink(1));
        short.max(long) >= EARNED && short.min(long) > -2.0 * EARNED
    }

    /// Adds effects of the catalogue as long as they earn their place.
    pub(crate) fn catalogue_rounds(&mut self, base: &Fitted) -> Result<Fitted, FitError> {
        let mut fitted = base.clone();
        if fitted.train.examined.plant.unstretched_index(0).is_none() {
            fitted = self.elasticity(fitted)?;
        }
        if self.taken.is_empty() {
            let Some(first) = self.one_more(&fitted)? else { return Ok(fitted) };
            fitted = first;
            if fitted.gap[0] > NOTHING_LEFT {
                fitted = self.pair(base, &fitted)?.unwrap_or(fitted);
            }
            if base.gap[0] > STRONG && fitted.left() > HIDDEN * base.left() {
                fitted = match self.look_again(base, &fitted)? {
                    Look::Explained(explained) => return Ok(explained),
                    Look::Better(better) => better,
                    Look::Nothing => fitted,
                };
            }
            if self.taken.len() > 1 {
                fitted = self.settle_extensions(fitted)?;
            }
        }
        fitted = self.rounds(fitted)?;
        if (fitted.explains_little(base) || fitted.gap[0] > STRONG) && base.gap[0] > STRONG {
            fitted = match self.look_again(base, &fitted)? {
                Look::Explained(explained) => return Ok(explained),
                Look::Better(better) => self.rounds(better)?,
                Look::Nothing => fitted,
            };
        }
        if self.taken.len() > 1 { self.settle_extensions(fitted) } else { Ok(fitted) }
    }

    /// Where what was found explains little: a term that explains it all, which says more than a law that might hide, or
    /// such a law.
    fn look_again(&mut self, base: &Fitted, fitted: &Fitted) -> Result<Look, FitError> {
        if let Some(explained) = self.single_term(base)? {
            return Ok(Look::Explained(explained));
        }
        match self.second_look(base, fitted)? {
            Some(better) => Ok(Look::Better(self.extend(better, self.given)?)),
            None => Ok(Look::Nothing),
        }
    }

    /// Effects of the catalogue, one after the other, as long as they earn their place.
    fn rounds(&mut self, mut fitted: Fitted) -> Result<Fitted, FitError> {
        while self.taken.len() < MOST_EFFECTS {
            fitted = self.reshape(fitted)?;
            let Some(next) = self.one_more(&fitted)? else { break };
            fitted = next;
        }
        Ok(fitted)
    }

    /// `fitted` with one more effect of the catalogue, if one earns its place.
    fn one_more(&mut self, fitted: &Fitted) -> Result<Option<Fitted>, FitError> {
        (self.progress)("weighing the catalogue", 0.1 + 0.12 * self.taken.len() as f64);
        let situation = self.situation(&fitted.train);
        let library = catalogue(&fitted.train.model, &situation);
        let Some((next, taken)) = self.round(fitted, &library, true, MOST_REFUSALS)? else { return Ok(None) };
        self.taken.push(taken);
        self.extend(next, self.given + self.taken.len() - 1).map(Some)
    }

    /// What the candidates need to know of the data, with the spectral peaks of the latent forces.
    pub(crate) fn situation(&self, fit: &Fit) -> Situation {
        let mut situation = Situation::of(&self.evidence.train);
        situation.peaks = crate::spectrum::peaks(fit, &self.evidence.train);
        situation.waves = crate::spectrum::waves(fit, &self.evidence.train);
        situation
    }

    /// One round over a library: the best candidate, refined, if it earns its place.
    fn round(
        &mut self,
        fitted: &Fitted,
        library: &Library,
        parsimony: bool,
        most_refusals: usize,
    ) -> Result<Option<(Fitted, Taken)>, FitError> {
        let e = self.evidence;
        let fit = &fitted.train;
        self.candidates = self.candidates.max(library.candidates.len());
        let forcing = library_forcing(fit, &e.train, library);
        let sizes = ladder(&fit.randomness);
        let levels = levels(fit, &e.train, &forcing, library, &sizes);
        let weighing = Weighing {
            fit,
            trials: &e.train,
            forcing: &forcing,
            library,
            level: &levels[0],
            randomness: &sizes[0],
            penalty: self.penalty,
        };
        let base = baseline(&levels);
        let ranked = rank(library, &levels, self.penalty);
        let mut refused: Vec<(&'static str, Option<usize>)> = Vec::new();
        while refused.len() < most_refusals {
            let left: Vec<Scored> = ranked
                .iter()
                .filter(|s| {
                    let c = &library.candidates[s.candidate];
                    c.id == "expression" || !refused.contains(&(c.id, c.cable))
                })
                .skip(if library.candidates.first().is_some_and(|c| c.id == "expression") { refused.len() } else { 0 })
                .cloned()
                .collect();
            let Some(best) = left.first() else { break };
            if base - best.score < EVIDENCE {
                break;
            }
            // The simpler of two good explanations first; once one is refused, the better one.
            let chosen = if parsimony && refused.is_empty() { simplest(library, &left, base) } else { best };
            let candidate = &library.candidates[chosen.candidate];
            refused.push((candidate.id, candidate.cable));
            let Some(effect) = effect_of(library, chosen) else { continue };
            if is_a_force(candidate.id) && self.foreseen(fitted, library, chosen, &sizes) > fitted.holdout_score {
                self.note(&effect, "refused", chosen.score - base, "it would not predict the held-out data better");
                continue;
            }
            let mut model = fit.model.clone();
            model.effects.push(effect.clone());
            let trained = match self.train(&model, &fitted.train, &e.train, ROUNDS, None) {
                Ok(trained) if trained.score < fitted.score - EVIDENCE => trained,
                Ok(trained) => {
                    let change = trained.score - fitted.score;
                    self.note(&effect, "refused", change, "too little evidence after refinement");
                    continue;
                }
                Err(_) => {
                    self.note(&effect, "refused", f64::NAN, "it cannot be simulated");
                    continue;
                }
            };
            match self.verified(trained, fitted) {
                Ok(next) if Self::helps(fitted, &next) => {
                    let delta_bic = next.score - fitted.score;
                    let refined = next.train.model.effects.last().cloned().unwrap_or(effect);
                    self.note(&refined, "added", delta_bic, "");
                    let rivals = rivals(library, &ranked, chosen, base);
                    let tested = !of_time_alone(library, chosen.candidate);
                    let null_test = tested.then(|| weighing.null_test(EVIDENCE)).flatten();
                    return Ok(Some((next, Taken::new(rivals, delta_bic, null_test))));
                }
                Ok(next) => {
                    let change = next.score - fitted.score;
                    self.note(&effect, "refused", change, "it does not predict the held-out data better");
                }
                Err(_) => self.note(&effect, "refused", f64::NAN, "it cannot be simulated on the held-out data"),
            }
        }
        if parsimony {
            self.null_test = weighing.null_test(EVIDENCE);
        }
        Ok(None)
    }

    /// `-2 log L` of the held-out data with a candidate of these amplitudes, foreseen by its signature.
    fn foreseen(&self, fitted: &Fitted, library: &Library, scored: &Scored, sizes: &[Randomness]) -> f64 {
        let (fit, trials) = (&fitted.holdout, &self.evidence.holdout);
        let forcing = library_forcing(fit, trials, &library.only(scored.candidate));
        let parts = forcing.iter().enumerate().map(|(t, forcing)| {
            let randomness = for_trial(&sizes[scored.level], &trials[t]);
            let filtered = filter(&fit.linear[t], &randomness, Keep::Innovations);
            let normal = whiten(&fit.linear[t], &randomness, &filtered, forcing, None);
            normal.minus_two_log_likelihood - normal.drop(&scored.amplitudes)
        });
        parts.sum()
    }

    /// Whether a single term outside the catalogue explains the data from `base` on; in place of all found.
    fn single_term(&mut self, base: &Fitted) -> Result<Option<Fitted>, FitError> {
        (self.progress)("looking for a term that explains it all", 0.45);
        let found = std::mem::take(&mut self.taken);
        let library = dictionary(&self.situation(&base.train));
        if let Some((next, mut term)) = self.round(base, &library, false, 1)? {
            if next.gap[0] <= NOTHING_LEFT {
                term.rivals.clear();
                self.taken.push(term);
                return Ok(Some(next));
            }
            if let Some(step) = self.steps.last_mut() {
                step.outcome = "refused".to_owned();
                step.reason = "it does not explain all".to_owned();
            }
        }
        self.taken = found;
        Ok(None)
    }

    /// The paper's own story: a rigid model of elastic cables.
    fn elasticity(&mut self, fitted: Fitted) -> Result<Fitted, FitError> {
        (self.progress)("trying elastic cables", 0.08);
        let parameters = &fitted.train.model.parameters;
        let guess = self.stiffness_guess(&fitted).unwrap_or(parameters.axial_stiffness());
        let Ok(effect) = EffectSpec::new("cable_elasticity", None, &[guess, parameters.cable_damping]) else {
            return Ok(fitted);
        };
        let mut model = fitted.train.model.clone();
        model.effects.push(effect.clone());
        let next = self.fit(&model, &fitted, ROUNDS)?;
        if next.score < fitted.score - EVIDENCE && Self::helps(&fitted, &next) {
            let delta_bic = next.score - fitted.score;
            let refined = next.train.model.effects.last().cloned().unwrap_or(effect);
            self.note(&refined, "added", delta_bic, "");
            self.taken.push(Taken::new(Vec::new(), delta_bic, None));
            return Ok(next);
        }
        self.note(&effect, "refused", next.score - fitted.score, "rigid cables explain the data as well");
        Ok(fitted)
    }

    /// Axial stiffness (N) from the mean stretch under the mean winch force.
    fn stiffness_guess(&self, fitted: &Fitted) -> Option<f64> {
        let mut ratios = Vec::new();
        for (t, trial) in self.evidence.train.iter().enumerate() {
            for i in 0..4 {
                let Some(j) = trial.channels.iter().position(|c| *c == Channel::UnstretchedLength(i)) else { continue };
                for k in (0..trial.len()).step_by(20) {
                    let y = fitted.train.trajectories[t].states(k);
                    let geometry = fitted.train.examined.plant.geometry();
                    let length = cdpr::kinematics::cable_lengths(geometry, &[y[0], y[1], y[2]])[i];
                    let l = trial.measured[k][j];
                    let ratio = trial.inputs[k].winch_force[i] * l / (length - l);
                    if ratio.is_finite() && ratio > 0.0 {
                        ratios.push(ratio);
                    }
                }
            }
        }
        let guess = crate::clean::median(ratios);
        (guess.is_finite() && guess > 1e4 && guess < 1e10).then_some(guess)
    }

    /// Terms outside the catalogue; kept only when together they at least halve what is left of the gap.
    pub(crate) fn dictionary_rounds(&mut self, fitted: &Fitted) -> Result<Option<Fitted>, FitError> {
        let (steps, taken) = (self.steps.len(), self.taken.len());
        let mut current = fitted.clone();
        for round in 0..3 {
            (self.progress)("looking for terms outside the catalogue", 0.7 + 0.05 * round as f64);
            let library = dictionary(&self.situation(&current.train));
            let Some((next, mut term)) = self.round(&current, &library, false, MOST_REFUSALS)? else { break };
            term.rivals.clear();
            self.taken.push(term);
            current = next;
            if current.gap[0] < 1.05 {
                break;
            }
        }
        if self.taken.len() > taken && current.left() <= 0.5 * fitted.left() {
            return Ok(Some(current));
        }
        self.taken.truncate(taken);
        for step in &mut self.steps[steps..] {
            if step.outcome == "added" {
                step.outcome = "refused".to_owned();
                step.reason = "the terms found do not halve what is left of the gap".to_owned();
            }
        }
        Ok(None)
    }

    /// Takes out effects without which the model is as good, the least certain first.
    pub(crate) fn prune(&mut self, base: &Fitted, mut fitted: Fitted) -> Result<Fitted, FitError> {
        let mut judged: Vec<EffectSpec> = Vec::new();
        while fitted.train.model.effects.len() > self.given + 1 {
            let certainty = |at: usize| fitted.estimate.as_ref().map_or(f64::NAN, |e| e.wald[at]);
            let same =
                |a: &EffectSpec, b: &EffectSpec| (&a.id, a.cable, &a.expression) == (&b.id, b.cable, &b.expression);
            let left = (self.given..fitted.train.model.effects.len())
                .filter(|at| !judged.iter().any(|j| same(j, &fitted.train.model.effects[*at])));
            let Some(at) = left.min_by(|a, b| certainty(*a).total_cmp(&certainty(*b))) else { break };
            let mut model = fitted.train.model.clone();
            let effect = model.effects.remove(at);
            // Nearly nothing is left out with an uncertain one; a very certain one leaves a gap whatever the others do.
            let without = match certainty(at) {
                ..100.0 => self.fit(&model, &fitted, ROUNDS),
                400.0.. => self.fit_without(&model, &fitted, 1),
                _ => self.fit_without(&model, &fitted, ROUNDS),
            };
            match without {
                Ok(without) if without.score < fitted.score + EVIDENCE || !Self::earns(&without, &fitted) => {
                    self.note(&effect, "removed", fitted.score - without.score, "the model is as good without it");
                    self.taken.remove(at - self.given);
                    self.taken.iter_mut().for_each(|taken| taken.without = None);
                    fitted = without;
                }
                Ok(without) => {
                    let taken = &mut self.taken[at - self.given];
                    taken.delta_bic = fitted.score - without.score;
                    taken.without = Some(Arc::new(without));
                    judged.push(effect);
                }
                Err(_) => judged.push(effect),
            }
        }
        if let [only] = &mut self.taken[..] {
            only.delta_bic = fitted.score - base.score;
            if !Self::earns(base, &fitted) {
                let effect = fitted.train.model.effects[self.given].clone();
                self.note(&effect, "removed", fitted.score - base.score, "it does not shrink the gap on held-out data");
                self.taken.clear();
                return Ok(base.clone());
            }
        }
        Ok(fitted)
    }

    /// Fits the rivals of effect `at` in its place to the training data; the best first.
    pub(crate) fn rivals_of(&self, fitted: &Fitted, at: usize) -> Vec<(EffectSpec, Trained)> {
        let aim = fitted.train.minus_two_log_likelihood(&self.evidence.train, &fitted.train.randomness);
        let in_its_place = |rival: &EffectSpec| {
            let mut model = fitted.train.model.clone();
            model.effects[at] = extended_like(rival, &model.effects[at]);
            model.check().ok()?;
            if is_friction(rival) {
                // Far from a start, friction is found sooner on a part of the data.
                let begun =
                    self.loosened(&model, &fitted.train.begun(&self.beginnings).ok()?, &self.beginnings).ok()?;
                model = self.train(&model, &begun, &self.beginnings, ROUNDS, None).ok()?.fit.model;
            }
            let start = self.loosened(&model, &fitted.train, &self.evidence.train).ok()?;
            let other = self.train(&model, &start, &self.evidence.train, ROUNDS, Some(aim)).ok()?;
            Some((other.fit.model.effects[at].clone(), other))
        };
        let mut out: Vec<_> = self.taken[at - self.given].rivals.par_iter().filter_map(in_its_place).collect();
        out.sort_by(|a, b| a.1.score.total_cmp(&b.1.score));
        out
    }
}

/// The first part of a trial.
fn beginning(trial: &Trial) -> Trial {
    let end = trial.time.iter().take_while(|t| **t - trial.time[0] <= BEGINNING).count();
    trial.part(0..end, trial.name.clone())
}

/// Whether a candidate is a force that enters the model as it is, so that its signature says all of it.
fn is_a_force(id: &str) -> bool {
    matches!(id, "expression" | "periodic_gust" | "steady_wind")
}

pub(crate) fn effect_of(library: &Library, scored: &Scored) -> Option<EffectSpec> {
    library.candidates[scored.candidate].effect(&scored.amplitudes)
}

/// The candidate with the fewest columns among those nearly as good as the best.
fn simplest<'a>(library: &Library, ranked: &'a [Scored], base: f64) -> &'a Scored {
    let enough = SIMPLER * (base - ranked[0].score);
    let size = |s: &Scored| library.candidates[s.candidate].columns.len();
    ranked
        .iter()
        .filter(|s| base - s.score >= enough)
        .min_by(|a, b| size(a).cmp(&size(b)).then(a.score.total_cmp(&b.score)))
        .unwrap_or(&ranked[0])
}

/// The best candidates that are another explanation than the one chosen, for a full comparison.
fn rivals(library: &Library, ranked: &[Scored], chosen: &Scored, base: f64) -> Vec<EffectSpec> {
    let own = &library.candidates[chosen.candidate];
    let gain = base - chosen.score;
    let look_alikes: Vec<&str> =
        cdpr::effect::find(own.id).map_or(Vec::new(), |i| i.look_alikes.iter().map(|l| l.id).collect());
    let mut out: Vec<EffectSpec> = Vec::new();
    for scored in ranked {
        let c = &library.candidates[scored.candidate];
        if (c.id == own.id && c.cable == own.cable) || out.iter().any(|e| e.id == c.id && e.cable == c.cable) {
            continue;
        }
        let share = (base - scored.score) / gain;
        let wanted = share > 0.8 || (look_alikes.contains(&c.id) && c.cable == own.cable && share > 0.5);
        if wanted && let Some(effect) = effect_of(library, scored) {
            out.push(effect);
            if out.len() == MOST_RIVALS {
                break;
            }
        }
    }
    out
}

/// Signatures of a library along the fit's trajectories.
pub(crate) fn library_forcing(fit: &Fit, trials: &[Trial], library: &Library) -> Vec<Forcing> {
    trials
        .iter()
        .enumerate()
        .map(|(t, trial)| {
            let raw = signature::forcing(
                &fit.model,
                &fit.examined,
                &library.variations,
                &fit.linear[t],
                trial,
                &fit.trajectories[t],
            );
            signature::combine(&raw, &library.columns)
        })
        .collect()
}
