//! The search: one effect after the other, refined, compared with its rivals, checked on held-out data.

use std::collections::HashSet;
use std::sync::Arc;

use cdpr::effect::EffectSpec;
use cdpr::model_file::Model;

use crate::data::{Channel, Trial};
use crate::filter::estimate::{Fit, FitError, for_trial};
use crate::filter::kalman::Randomness;
use crate::hypothesis::candidates::{catalogue, dictionary};
use crate::hypothesis::survey::set_beside;
use crate::journal::{Journal, Outcome};
use crate::outcome::{Alternative, NullTest};
use crate::strategy::entrance::{Answer, Source};
use crate::strategy::fitted::{Evidence, Fitted};
use crate::strategy::round::Signatures;
use crate::verdict::verify;
use crate::verdict::{POLICY, Reaches};
use crate::weigh::regression::Penalty;

/// Fall of the information criterion below which nothing is believed, beyond the penalty of the parameters.
pub(crate) const EVIDENCE: f64 = 10.0;
/// Most candidates of one round that are fitted in full before the round is given up.
const MOST_REFUSALS: usize = 4;
/// Gap from which a missing law may be so strong that it hides itself.
const STRONG: f64 = 5.0;
/// Share of the evidence that an effect must explain; below it such a law is looked for before the search goes on.
const HIDDEN: f64 = 0.05;
/// Share of the evidence from which an effect found first is most of what is missing, so that its form shows; and of what
/// is left then, that the form or the times between which it acts must explain.
const MOST: f64 = 0.5;
/// Gap over the main horizon on held-out data up to which nothing is left to explain.
pub(crate) const NOTHING_LEFT: f64 = POLICY.nothing_left;
/// Most effects added.
const MOST_EFFECTS: usize = 5;
/// Most terms outside the catalogue that are added one after the other.
const MOST_TERMS: usize = 3;
/// Length of the beginnings of trials (s).
pub(crate) const BEGINNING: f64 = 30.0;
/// How long before the last effect begins they start then (s).
const LEAD: f64 = 5.0;
/// What the criterion must rise on the beginnings for an explanation to be far off.
pub(crate) const FAR_OFF: f64 = 100.0;
/// Gauss-Newton rounds of a refinement.
pub(crate) const ROUNDS: usize = 10;

/// Progress: a message and the fraction done.
pub type Progress<'a> = &'a (dyn Fn(&str, f64) + Sync);

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
    /// Those of them that were fitted in its place last, the best first.
    pub(crate) alternatives: Vec<Alternative>,
    pub(crate) delta_bic: f64,
    /// What chance did beside it when it came in.
    pub(crate) null_test: Option<NullTest>,
    /// The model with all effects but this, where it was fitted since the last change of them.
    pub(crate) without: Option<Arc<Fitted>>,
    /// The number of effects among which its form was chosen last.
    pub(crate) formed_among: Option<usize>,
}

impl Taken {
    pub(crate) fn new(rivals: Vec<EffectSpec>, delta_bic: f64, null_test: Option<NullTest>) -> Self {
        Self { rivals, alternatives: Vec::new(), delta_bic, null_test, without: None, formed_among: None }
    }

    /// Forgets what is no longer so once another effect has changed.
    pub(crate) fn changed(&mut self) {
        (self.without, self.formed_among) = (None, None);
    }
}

pub(crate) struct Search<'a> {
    pub(crate) evidence: &'a Evidence,
    /// The beginnings of the training trials, by which laws are chosen for the whole.
    pub(crate) beginnings: Vec<Trial>,
    /// Effects of the model from here on are free: errors of the survey, where these are, and what is found.
    pub(crate) free_from: usize,
    /// Number of effects before those that are found.
    pub(crate) given: usize,
    pub(crate) taken: Vec<Taken>,
    pub(crate) journal: Journal,
    /// What a reader should know of the way that the search went, a sentence each.
    pub(crate) remarks: Vec<String>,
    /// The names of all candidates weighed so far.
    pub(crate) tried: HashSet<String>,
    /// What chance did in the last weighing of the catalogue.
    pub(crate) null_test: Option<NullTest>,
    /// The signatures along the fit that was let in last, known by its score.
    pub(crate) weighed: Option<(Source, f64, Signatures)>,
    /// Whether the second look was had.
    pub(crate) looked: bool,
    pub(crate) progress: Progress<'a>,
    /// Random parts with the model as given.
    pub(crate) base_randomness: Option<Randomness>,
    /// Horizons that the growth of errors allows, once the model as given has been fitted.
    pub(crate) reaches: Reaches,
    /// What is random with the instruments that were taken up last, the latent forces left out; none where none are.
    pub(crate) instruments: Option<Randomness>,
    /// The last fit that was looked at, with what its instruments ask for, where that explains more than any effect.
    pub(crate) better: Option<Fitted>,
    pub(crate) penalty: Penalty,
}

impl<'a> Search<'a> {
    pub(crate) fn new(evidence: &'a Evidence, given: usize, progress: Progress<'a>) -> Self {
        let count: usize =
            evidence.train.iter().map(|t| t.measured.iter().flatten().filter(|v| v.is_finite()).count()).sum();
        Self {
            evidence,
            beginnings: beginnings(&evidence.train, f64::NEG_INFINITY),
            free_from: given,
            given,
            taken: Vec::new(),
            journal: Journal::default(),
            remarks: Vec::new(),
            tried: HashSet::new(),
            null_test: None,
            weighed: None,
            looked: false,
            progress,
            base_randomness: None,
            reaches: Reaches::default(),
            instruments: evidence.instruments.clone(),
            better: None,
            penalty: Penalty::new(count),
        }
    }

    /// Has the beginnings of the trials start shortly before the last of the model's new effects begins: before that they
    /// show nothing of it.
    pub(crate) fn begin_in_force(&mut self, model: &Model) {
        let from =
            model.effects[self.given..].iter().filter_map(|effect| effect.from).fold(f64::NEG_INFINITY, f64::max);
        self.beginnings = beginnings(&self.evidence.train, from - LEAD);
    }

    /// A fit on the beginnings of its trials.
    pub(crate) fn begun(&self, fit: &Fit) -> Result<Fit, FitError> {
        fit.part(&self.evidence.train, &self.beginnings)
    }

    /// Adds effects of the catalogue as long as they earn their place.
    ///
    /// Where the instruments ask for more than white noise, `base` gets it too. `fitted` is `base` with what was taken up.
    pub(crate) fn catalogue_rounds(&mut self, base: &mut Fitted, mut fitted: Fitted) -> Result<Fitted, FitError> {
        if fitted.train.examined.plant.unstretched_index(0).is_none() {
            fitted = self.elasticity(fitted)?;
        }
        if self.taken.is_empty() {
            let mut signatures = self.signatures(&fitted, Source::Catalogue);
            let mut next = self.one_more(&fitted, &signatures)?;
            while let Some(better) = self.better.take() {
                (*base, fitted) = (better.clone(), better);
                if self.white_force_error() {
                    return Ok(fitted);
                }
                signatures = self.signatures(&fitted, Source::Catalogue);
                next = self.one_more(&fitted, &signatures)?;
            }
            fitted = self.onset(next.unwrap_or(fitted), MOST);
            if self.explained(base, &fitted) > MOST {
                fitted = self.form_if(fitted, MOST);
            }
            // Also where none was taken: alone, one of two may not predict the held-out data better.
            if fitted.gap[0] > NOTHING_LEFT {
                fitted = self.pair(base, &signatures, &fitted)?.unwrap_or(fitted);
            }
        }
        let hidden = self.may_hide(base);
        if !self.taken.is_empty() {
            if hidden && self.explained(base, &fitted) < HIDDEN {
                fitted = match self.look_again(base, &fitted)? {
                    Look::Explained(explained) => return Ok(explained),
                    Look::Better(better) => better,
                    Look::Nothing => fitted,
                };
            }
            fitted = self.rounds(base, fitted)?;
        }
        if self.white_force_error() {
            return Ok(fitted);
        }
        if !self.looked && hidden && (fitted.explains_little(base) || fitted.gap[0] > STRONG) {
            fitted = match self.look_again(base, &fitted)? {
                Look::Explained(explained) => return Ok(explained),
                Look::Better(better) => self.rounds(base, better)?,
                Look::Nothing => fitted,
            };
        }
        // Of what no law explains the instruments may have some.
        if fitted.gap[0] > STRONG
            && let Some(better) = self.better_instruments(&fitted, 0.0)?
        {
            fitted = self.beside_instruments(base, better)?;
            if self.white_force_error() {
                return Ok(fitted);
            }
            if self.taken.is_empty() {
                return self.catalogue_rounds(base, fitted);
            }
            fitted = self.rounds(base, fitted)?;
        }
        Ok(if self.taken.len() > 1 { self.settle_extensions(fitted) } else { fitted })
    }

    /// Whether the recorded forces were found to have an error. The search then goes on with those to be expected.
    pub(crate) fn white_force_error(&self) -> bool {
        self.instruments.as_ref().is_some_and(|randomness| randomness.white_input() > 0.0)
    }

    /// Whether a law may be missing from a fit that is so strong that it hides itself, and was not looked for yet.
    pub(crate) fn may_hide(&self, fitted: &Fitted) -> bool {
        let something_left = || self.something_left(&fitted.train, &self.evidence.train);
        !self.looked && may_hide(fitted.gap[0], !self.taken.is_empty(), self.null_test, something_left)
    }

    /// Whether a fit to `trials` leaves innovations that are not white: more than a force at random explains.
    pub(crate) fn something_left(&self, fit: &Fit, trials: &[Trial]) -> bool {
        verify::whiteness(fit, trials, &fit.randomness.noise).iter().any(|w| w.statistic > w.limit)
    }

    /// The share of all evidence against `base` that `fitted` explains: one where nothing but the noise is left.
    fn explained(&self, base: &Fitted, fitted: &Fitted) -> f64 {
        self.share(base.score, fitted.score, &self.evidence.train)
    }

    /// The share of all evidence that a score of a model on `trials` leaves, by which another score is better.
    pub(crate) fn share(&self, from: f64, to: f64, trials: &[Trial]) -> f64 {
        let Some(randomness) = &self.base_randomness else { return 0.0 };
        let noise_alone: f64 = trials
            .iter()
            .map(|trial| {
                let noise = for_trial(randomness, trial).noise;
                let count = |j: usize| trial.measured.iter().filter(|row| row[j].is_finite()).count() as f64;
                noise.iter().enumerate().map(|(j, noise)| count(j) * (1.0 + 2.0 * noise.ln())).sum::<f64>()
            })
            .sum();
        (from - to) / (from - noise_alone)
    }

    /// Where what was found explains little: a term that explains it all, which says more than a law that might hide, or
    /// such a law.
    fn look_again(&mut self, base: &Fitted, fitted: &Fitted) -> Result<Look, FitError> {
        self.looked = true;
        if let Some(explained) = self.single_term(base)? {
            return Ok(Look::Explained(explained));
        }
        match self.second_look(base, fitted)? {
            Some(better) => Ok(Look::Better(self.form(better))),
            None => Ok(Look::Nothing),
        }
    }

    /// Effects of the catalogue, one after the other, as long as they earn their place, and after each the form of friction.
    ///
    /// What the instruments have beside white noise is taken up where it explains more than the next effect.
    pub(crate) fn rounds(&mut self, base: &mut Fitted, mut fitted: Fitted) -> Result<Fitted, FitError> {
        while self.taken.len() < MOST_EFFECTS {
            let signatures = self.signatures(&fitted, Source::Catalogue);
            let next = self.one_more(&fitted, &signatures)?;
            if let Some(better) = self.better.take() {
                fitted = self.beside_instruments(base, better)?;
                if self.white_force_error() {
                    break;
                }
                continue;
            }
            let found = next.is_some();
            let score = fitted.score;
            // As long as more is found, times at which an effect acts may only stand for what is not found yet.
            fitted = next.map_or(fitted, |next| self.on_every_cable(next));
            if found {
                fitted = self.onset(fitted, MOST);
            }
            fitted = self.form(fitted);
            if !found && fitted.score == score {
                break;
            }
        }
        Ok(fitted)
    }

    /// What was found, where its instruments are `better` known; `base` has them as well. What was found may only have stood
    /// for what they do.
    fn beside_instruments(&mut self, base: &mut Fitted, better: Fitted) -> Result<Fitted, FitError> {
        *base = match self.with_instruments(base, 0.0)? {
            Some(base) => base,
            None => self.finish(base.train.clone(), base.holdout.clone(), None),
        };
        if base.score <= better.score {
            self.give_up(&better, "what the instruments add explains more");
            // Its instruments are other ones than those beside the effects, and gaps count by them from here on.
            *base = self.counted(base.clone());
            return Ok(base.clone());
        }
        Ok(better)
    }

    /// `fitted` with what its instruments ask for, where that explains more than the `gain` of the best effect.
    pub(crate) fn better_instruments(&mut self, fitted: &Fitted, gain: f64) -> Result<Option<Fitted>, FitError> {
        let better = self.with_instruments(fitted, gain)?;
        let Some(better) = better.filter(|better| fitted.score - better.score > gain) else { return Ok(None) };
        Ok(Some(self.counted(better)))
    }

    /// The signatures of the catalogue, or of terms outside it, along a fit.
    pub(crate) fn signatures(&mut self, fitted: &Fitted, source: Source) -> Signatures {
        if let Some((known, score, signatures)) = self.weighed.take()
            && known == source
            && score == fitted.score
        {
            return signatures;
        }
        let fit = &fitted.train;
        let mut library = match source {
            Source::Catalogue => {
                (self.progress)("weighing the catalogue", 0.1 + 0.12 * self.taken.len() as f64);
                catalogue(&fit.model, &self.situation(fit))
            }
            Source::Terms => dictionary(&self.situation(fit)),
        };
        set_beside(&mut library, &fit.model, self.free_from..self.given);
        Signatures::new(library)
    }

    /// `fitted` with one more effect of the catalogue, if one earns its place.
    fn one_more(&mut self, fitted: &Fitted, signatures: &Signatures) -> Result<Option<Fitted>, FitError> {
        self.round(fitted, signatures, Source::Catalogue, MOST_REFUSALS)
    }

    /// Whether a single term outside the catalogue explains the data from `base` on; in place of all found.
    pub(crate) fn single_term(&mut self, base: &Fitted) -> Result<Option<Fitted>, FitError> {
        (self.progress)("looking for a term that explains it all", 0.45);
        let found = std::mem::take(&mut self.taken);
        let signatures = self.signatures(base, Source::Terms);
        let entries = self.journal.len();
        if let Some(next) = self.round(base, &signatures, Source::Terms, 1)? {
            if next.gap[0] <= NOTHING_LEFT {
                return Ok(Some(next));
            }
            self.journal.refuse_since(entries, "it does not explain all");
        }
        self.taken = found;
        Ok(None)
    }

    /// The paper's own story: a rigid model of elastic cables.
    fn elasticity(&mut self, fitted: Fitted) -> Result<Fitted, FitError> {
        (self.progress)("trying elastic cables", 0.08);
        let parameters = &fitted.train.model.parameters;
        let guess = self.stiffness_guess(&fitted).unwrap_or(parameters.axial_stiffness());
        let effect = EffectSpec::new("cable_elasticity", None, &[guess, parameters.cable_damping]);
        let effect = effect.map_err(|error| FitError::Model(error.to_string()))?;
        let mut model = fitted.train.model.clone();
        model.effects.push(effect.clone());
        let next = self.journal.tried(&effect, "it cannot be fitted", self.fit(&model, &fitted, ROUNDS));
        let Some(next) = next else { return Ok(fitted) };
        if next.score < fitted.score - EVIDENCE && Self::helps(&fitted, &next) {
            let enters = self.enter(&fitted, &next, vec![Vec::new()], Source::Catalogue, "")?;
            return Ok(if enters == Answer::Enters { next } else { fitted });
        }
        self.journal.note(
            &effect,
            Outcome::Refused,
            next.score - fitted.score,
            "rigid cables explain the data as well",
        );
        Ok(fitted)
    }

    /// Axial stiffness (N) from the mean stretch under the mean winch force.
    fn stiffness_guess(&self, fitted: &Fitted) -> Option<f64> {
        let mut ratios = Vec::new();
        for (t, trial) in self.evidence.train.iter().enumerate() {
            for i in 0..trial.cables() {
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
        let guess = crate::data::clean::median(ratios);
        (guess.is_finite() && guess > 1e4 && guess < 1e10).then_some(guess)
    }

    /// Terms outside the catalogue; kept only when together they at least halve what is left of the gap. Given a score to be
    /// `aimed` at, they are given up where the first is too small a part of it.
    pub(crate) fn dictionary_rounds(&mut self, fitted: &Fitted, aim: Option<f64>) -> Result<Option<Fitted>, FitError> {
        let (entries, taken) = (self.journal.len(), self.taken.len());
        let mut current = fitted.clone();
        for round in 0..MOST_TERMS {
            (self.progress)("looking for terms outside the catalogue", 0.7 + 0.05 * round as f64);
            let signatures = self.signatures(&current, Source::Terms);
            let Some(next) = self.round(&current, &signatures, Source::Terms, MOST_REFUSALS)? else { break };
            current = next;
            let too_little = |aim: f64| (fitted.score - current.score) * (MOST_TERMS as f64) < fitted.score - aim;
            if current.gap[0] < 1.05 || round == 0 && aim.is_some_and(too_little) {
                break;
            }
        }
        if self.taken.len() > taken && current.left() <= 0.5 * fitted.left() {
            return Ok(Some(current));
        }
        self.taken.truncate(taken);
        self.journal.refuse_since(entries, "the terms found do not halve what is left of the gap");
        Ok(None)
    }

    /// Gives up everything that was taken up and stands in `fitted`.
    pub(crate) fn give_up(&mut self, fitted: &Fitted, reason: &str) {
        for (effect, taken) in fitted.train.model.effects[self.given..].iter().zip(std::mem::take(&mut self.taken)) {
            self.journal.note(effect, Outcome::Removed, taken.delta_bic, reason);
        }
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
                Ok(without) if without.score < fitted.score + EVIDENCE || !self.needs(&without, &fitted) => {
                    self.journal.note(
                        &effect,
                        Outcome::Removed,
                        fitted.score - without.score,
                        "the model is as good without it",
                    );
                    self.taken.remove(at - self.given);
                    self.taken.iter_mut().for_each(Taken::changed);
                    fitted = without;
                }
                Ok(without) => {
                    let taken = &mut self.taken[at - self.given];
                    taken.delta_bic = fitted.score - without.score;
                    taken.without = Some(Arc::new(without));
                    judged.push(effect);
                }
                Err(error) => {
                    self.journal.failed(&effect, "the model without it", &error);
                    judged.push(effect);
                }
            }
        }
        if let [only] = &mut self.taken[..] {
            only.delta_bic = fitted.score - base.score;
            if !self.needs(base, &fitted) {
                let effect = fitted.train.model.effects[self.given].clone();
                self.journal.note(
                    &effect,
                    Outcome::Removed,
                    fitted.score - base.score,
                    "it does not predict the held-out data better",
                );
                self.taken.clear();
                return Ok(base.clone());
            }
        }
        Ok(fitted)
    }
}

/// Whether a law may be missing that is so strong that it hides itself, by the gap of the model as given, whether anything
/// was taken up, what chance did where nothing was, and whether the innovations are not white.
///
/// Where nothing was taken up and they are white, a force at random may be all there is, unless chance comes nowhere near
/// the best candidate: then something is there, which one round could not make out.
fn may_hide(gap: f64, taken: bool, chance: Option<NullTest>, something_left: impl FnOnce() -> bool) -> bool {
    gap > STRONG && (taken || chance.is_some_and(|test| test.as_strong == 0) || something_left())
}

/// The first part of each trial from some time (s) before its last part on.
fn beginnings(trials: &[Trial], from: f64) -> Vec<Trial> {
    let beginning = |trial: &Trial| {
        let latest = trial.time[trial.len() - 1] - BEGINNING;
        let from = from.min(latest).max(trial.time[0]);
        let start = trial.time.partition_point(|t| *t < from);
        let end = trial.time.partition_point(|t| *t - trial.time[start] <= BEGINNING);
        trial.part(start..end, trial.name.clone())
    };
    trials.iter().map(beginning).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::recording::{noise, record};
    use crate::filter::estimate::noise_of_data;
    use crate::model::randomness::Memory;

    /// Gaps went on by the instruments beside effects that were given up: 11 in the place of 0.93.
    #[test]
    fn where_instruments_take_the_place_of_effects_they_are_those_of_the_model_as_given() {
        let recorded = |seed: u64| {
            let mut trial = record(&[], 40.0, seed);
            let mut errors = noise(4 * trial.len(), 90 + seed);
            let forces = trial.inputs.iter_mut().flat_map(|inputs| inputs.winch_force.iter_mut());
            forces.for_each(|force| *force += 100.0 * errors.next().unwrap_or(0.0));
            trial
        };
        let (train, holdout) = (vec![recorded(31), recorded(32)], vec![recorded(33)]);
        let noise = noise_of_data(&train);
        let evidence = Evidence { train, holdout, noise, instruments: None };
        let mut search = Search::new(&evidence, 0, &|_, _| {});
        let mut base = search.base(&Model::default()).expect("a fit");
        let inertia = EffectSpec::new("winch_drum_inertia", None, &[50.0]).expect("an effect");
        let better = Model { effects: vec![inertia], ..Model::default() };
        let mut better = search.fit(&better, &base, ROUNDS).expect("a fit");
        let other = Memory { channel: 0, deviation: 1e-4, time: 1.0, drift: false };
        better.train.randomness = better.train.randomness.with_memory(other);
        search.instruments = Some(better.train.randomness.without_latents());
        search.taken.push(Taken::new(Vec::new(), -100.0, None));
        let fitted = search.beside_instruments(&mut base, better).expect("a fit");
        assert!(fitted.train.model.effects.is_empty() && search.taken.is_empty());
        assert!(search.white_force_error());
        assert!(fitted.gap[0] < 1.3 && base.gap == fitted.gap, "{:?} {:?}", fitted.gap, base.gap);
    }

    #[test]
    fn a_second_look_needs_a_gap_and_more_than_a_force_at_random() {
        let chance =
            |as_strong| Some(NullTest { shifts: 99, found: 300.0, as_strong, over_threshold: 9, largest: 200.0 });
        let may_hide = |gap, taken, chance, left| may_hide(gap, taken, chance, || left);
        assert!(!may_hide(STRONG, true, chance(0), true), "a small gap hides nothing");
        assert!(may_hide(STRONG + 0.1, true, chance(60), false), "what was found may only do some of it");
        assert!(!may_hide(400.0, false, chance(1), false), "white, and chance does as well: a force at random");
        assert!(!may_hide(400.0, false, None, false));
        assert!(may_hide(400.0, false, chance(0), false), "chance comes nowhere near");
        assert!(may_hide(400.0, false, chance(60), true), "a force at random leaves white innovations");
    }
}
