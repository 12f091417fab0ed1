//! Models fitted to the training data and, as they are, to held-out data.

use cdpr::effect::EffectSpec;
use cdpr::model_file::Model;

use crate::data::Trial;
use crate::filter::estimate::{Fit, FitError, first_randomness};
use crate::filter::kalman::Randomness;
use crate::hypothesis::extension::{count_in_use, count_times};
use crate::instruments::clock_offset::clock_offset;
use crate::instruments::expected::expected_forces;
use crate::instruments::{self, Sizing};
use crate::journal::Outcome;
use crate::model::examined::Examined;
use crate::outcome::BeforeAfter;
use crate::strategy::entrance::{Answer, Source};
use crate::strategy::search::{EVIDENCE, ROUNDS, Search, Taken};
use crate::verdict::gap::{GapSum, gap, predict};
use crate::verdict::{self, HorizonFacts, POLICY, Reach, Reaches, left, share_taken};
use crate::weigh::refine::{Estimate, refine};

/// Most moves of the trajectories of the model as given.
const FIRST_MOVES: usize = 10;
/// Most moves of the trajectory on held-out data.
const MOST_MOVES: usize = 30;

/// The data of a search and what is known of its noise.
#[derive(Clone)]
pub(crate) struct Evidence {
    pub(crate) train: Vec<Trial>,
    pub(crate) holdout: Vec<Trial>,
    /// Noise by channel of [`Channel::all`].
    pub(crate) noise: Vec<f64>,
    /// What an earlier search found of the instruments.
    pub(crate) instruments: Option<Randomness>,
}

impl Evidence {
    /// The same with the winch forces that are to be expected, given those recorded: what the `instruments` say of their error.
    pub(crate) fn with_expected_forces(self, instruments: Randomness) -> Self {
        let (sets, expected) = expected_forces([&self.train, &self.holdout], instruments.input);
        let [train, holdout] = sets;
        Self { train, holdout, instruments: Some(Randomness { expected: Some(expected), ..instruments }), ..self }
    }
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
    /// Gap on held-out data over the main horizon and the long one, in multiples of what a model without fault would leave.
    pub(crate) gap: [f64; 2],
    /// What they are made of.
    pub(crate) sums: [GapSum; 2],
}

impl Fitted {
    /// What is left of the gap over the main horizon on held-out data, without the noise.
    pub(crate) fn left(&self) -> f64 {
        left(self.gap[0])
    }

    /// Whether more than half of the gap of `base` is left, and enough to speak of.
    pub(crate) fn explains_little(&self, base: &Self) -> bool {
        self.left() > POLICY.explained * base.left() && self.gap[0] > POLICY.at_noise
    }

    /// Share of the squared gap of `without`, both without the noise, that is no longer there: over the main horizon or
    /// the long one, whichever is more.
    pub(crate) fn takes_away(&self, without: &Self) -> f64 {
        let [short, long] = [0, 1].map(|k| share_taken(without.gap[k], self.gap[k], &POLICY));
        short.max(long)
    }
}

/// A model fitted to training data.
#[derive(Clone)]
pub(crate) struct Trained {
    pub(crate) fit: Fit,
    pub(crate) estimate: Option<Estimate>,
    /// `-2 log L` on these data plus the penalty of the parameters.
    pub(crate) score: f64,
}

impl Search<'_> {
    /// Fits the model as given.
    pub(crate) fn base(&mut self, model: &Model) -> Result<Fitted, FitError> {
        let e = self.evidence;
        let mut train = self.begun_by_data(model)?;
        if self.free_from < self.given {
            refine(&mut train, &e.train, &e.noise, self.free_from, ROUNDS, None)?;
            train.fit_randomness(&e.train, &e.noise, true);
        }
        self.base_randomness = Some(train.randomness.clone());
        let holdout = self.held_by_data(&train)?;
        self.reaches = Reaches::of(&holdout, &e.holdout, &e.noise, &POLICY);
        Ok(self.finish(train, holdout, None))
    }

    /// Trajectories of `model` on the training data, from these alone, and the sizes of what is random along them.
    fn begun_by_data(&mut self, model: &Model) -> Result<Fit, FitError> {
        let e = self.evidence;
        let first = first_randomness(model, &e.train, &e.noise);
        let randomness = match &e.instruments {
            Some(known) => Randomness { force: first.force, winch: first.winch, ..known.clone() },
            None => {
                let examined = Examined::new(model).map_err(|e| FitError::Model(e.to_string()))?;
                Randomness { late: instruments::late_lengths(&examined, &e.train), ..first }
            }
        };
        let mut train = Fit::new(model, &e.train, &randomness, None)?;
        self.go_as_far(&mut train, &e.train, 1)?;
        train.fit_randomness(&e.train, &e.noise, true);
        // A model that has friction already is far from its trajectory at first.
        self.go_as_far(&mut train, &e.train, FIRST_MOVES)?;
        Ok(train)
    }

    /// Trajectories of a model on the held-out data, from these alone.
    fn held_by_data(&mut self, train: &Fit) -> Result<Fit, FitError> {
        let held = &self.evidence.holdout;
        let mut holdout = Fit::new(&train.model, held, &train.randomness, None)?;
        self.go_as_far(&mut holdout, held, FIRST_MOVES)?;
        Ok(holdout)
    }

    /// Settles trajectories that nothing else is known of, as far as they go: what is far from all that the model can do is
    /// there to be explained.
    fn go_as_far(&mut self, fit: &mut Fit, trials: &[Trial], most: usize) -> Result<(), FitError> {
        let settled = fit.settle(trials, most);
        self.or_remark("As it is, the model has no trajectory near the data", settled).map(|_| ())
    }

    /// `base` with the delay of the pose, where kinematics alone show that. No trajectory that is known is near its own.
    pub(crate) fn with_evident_delay(&mut self, base: &Fitted) -> Result<Option<Fitted>, FitError> {
        let (e, model) = (self.evidence, &base.train.model);
        let offset = clock_offset(&base.train.examined, &e.train);
        let Some(late) = offset.filter(|late| *late > 0.0) else { return Ok(None) };
        let effect = EffectSpec::new("pose_sensor_delay", None, &[late]);
        let effect = effect.map_err(|error| FitError::Model(error.to_string()))?;
        let mut delayed = model.clone();
        delayed.effects.push(effect.clone());
        let fitted = self.refined_by_data(&delayed);
        let fitted = self.journal.tried(&effect, "by kinematics, it cannot be fitted", fitted);
        let Some(next) = fitted else { return Ok(None) };
        if !Self::helps(base, &next) {
            let reason = "kinematics show it, but it does not predict the held-out data better";
            self.journal.note(&effect, Outcome::Refused, next.score - base.score, reason);
            return Ok(None);
        }
        let enters = self.enter(base, &next, vec![Vec::new()], Source::Catalogue, "kinematics alone show it")?;
        Ok((enters == Answer::Enters).then_some(next))
    }

    /// A model fitted to both sets from the data alone.
    fn refined_by_data(&mut self, model: &Model) -> Result<Fitted, FitError> {
        let e = self.evidence;
        let mut train = self.begun_by_data(model)?;
        let estimate = refine(&mut train, &e.train, &e.noise, self.free_from, ROUNDS, None)?;
        train.fit_randomness(&e.train, &e.noise, false);
        let holdout = self.held_by_data(&train)?;
        Ok(self.finish(train, holdout, Some(estimate)))
    }

    /// `-2 log L` on training data plus the penalty of the parameters.
    pub(crate) fn score(&self, train: &Fit, trials: &[Trial]) -> f64 {
        let effects = &train.model.effects[self.given..];
        let cost: f64 = effects.iter().map(|s| self.penalty.of(count_in_use(s).max(1))).sum();
        let times = self.penalty.of_times(count_times(effects));
        let instruments = self.penalty.of_parameters(instruments::parameters(&train.randomness));
        train.minus_two_log_likelihood(trials, &train.randomness) + cost + times + instruments
    }

    /// `fitted` with what its instruments ask for, where something is left for them and no explanation gains far more.
    pub(crate) fn with_instruments(&mut self, fitted: &Fitted, gain: f64) -> Result<Option<Fitted>, FitError> {
        let Evidence { train, noise, .. } = self.evidence;
        self.with_those(fitted, gain, &Sizing::new(train, noise, self.penalty))
    }

    /// The same where instruments forget within the time of the latent forces.
    pub(crate) fn with_forgetful_instruments(&mut self, fitted: &Fitted) -> Result<Option<Fitted>, FitError> {
        let Evidence { train, noise, .. } = self.evidence;
        let sizing = Sizing::new(train, noise, self.penalty).remembering_at_most(fitted.train.randomness.time);
        self.with_those(fitted, 0.0, &sizing)
    }

    fn with_those(&mut self, fitted: &Fitted, gain: f64, sizing: &Sizing<'_>) -> Result<Option<Fitted>, FitError> {
        let e = self.evidence;
        if !fitted.train.randomness.has_latents() && !self.something_left(&fitted.train, &e.train) {
            return Ok(None);
        }
        let taken = sizing.take_up(&fitted.train, gain, self.free_from);
        let Some(Some(fit)) = self.or_remark("What the instruments seem to add does not go with the data", taken)?
        else {
            return Ok(None);
        };
        let score = self.score(&fit, &e.train);
        let better = self.verified(Trained { fit, estimate: fitted.estimate.clone(), score }, fitted);
        // Without what the instruments took over nothing holds the held-out trajectory: they are no better.
        self.or_remark("What the instruments seem to add does not go with the held-out data", better)
    }

    /// What came of a step that may fail because the model has no trajectory near the data; that is remarked.
    pub(crate) fn or_remark<T>(&mut self, what: &str, result: Result<T, FitError>) -> Result<Option<T>, FitError> {
        match result {
            Ok(done) => Ok(Some(done)),
            Err(error @ (FitError::Diverged { .. } | FitError::Simulation(_))) => {
                let remark = format!("{what}: {error}.");
                if !self.remarks.contains(&remark) {
                    self.remarks.push(remark);
                }
                Ok(None)
            }
            Err(error) => Err(error),
        }
    }

    /// `fitted` with the instruments that are found now that its effects have names, where that is likelier than what was found
    /// before: then what a law does was theirs as well, and took the place of what they do.
    pub(crate) fn instruments_anew(&mut self, fitted: Fitted) -> Result<Fitted, FitError> {
        if self.taken.is_empty() || instruments::parameters(&fitted.train.randomness) == 0 {
            return Ok(fitted);
        }
        let Some(anew) = self.with_instruments_anew(&fitted)? else { return Ok(fitted) };
        self.taken.iter_mut().for_each(Taken::changed);
        Ok(self.counted(anew))
    }

    /// The model of `fitted` with the instruments that are found from plain ones on, if that is likelier.
    pub(crate) fn with_instruments_anew(&mut self, fitted: &Fitted) -> Result<Option<Fitted>, FitError> {
        let Some(plain) = self.with_plain_instruments(fitted)? else { return Ok(None) };
        let anew = self.with_instruments(&plain, 0.0)?.unwrap_or(plain);
        Ok((anew.score < fitted.score).then_some(anew))
    }

    /// The model of `fitted` with instruments that have white noise alone; latent forces carry what else they did.
    pub(crate) fn with_plain_instruments(&mut self, fitted: &Fitted) -> Result<Option<Fitted>, FitError> {
        let (model, trials) = (&fitted.train.model, &self.evidence.train);
        let mut start = fitted.train.clone();
        start.randomness = start.randomness.with_white_noise();
        let start = self.loosened(model, &start, trials);
        let trained = start.and_then(|start| self.train(model, &start, trials, ROUNDS, None));
        let plain = trained.and_then(|trained| self.verified(trained, fitted));
        self.or_remark("With plain instruments the model does not go with the data", plain)
    }

    /// `fitted` without what its instruments were given before its effects were known, where it is as good without: a drift
    /// may have stood for a law that has a name now, and a delay for what another clock or a drift does. The effects' parameters
    /// adapt.
    pub(crate) fn without_idle_instruments(&mut self, mut fitted: Fitted) -> Fitted {
        let mut kept = 0;
        while let Some(randomness) = instruments::less_by_one(&fitted.train, &self.evidence.train).into_iter().nth(kept)
        {
            let mut start = fitted.train.clone();
            start.randomness = randomness;
            let trained = self.train(&start.model, &start, &self.evidence.train, ROUNDS, None);
            let held_against = self.instruments.clone();
            let without = trained.and_then(|trained| {
                self.count_gaps_by(&trained.fit);
                self.verified(trained, &fitted)
            });
            match without {
                Ok(without) if without.score <= fitted.score => {
                    fitted = without;
                    // What was fitted beside it knew it still.
                    self.taken.iter_mut().for_each(Taken::changed);
                }
                without => {
                    // What cannot be fitted without it has it.
                    if let Err(error) = without {
                        self.journal.instruments_failed("without one of their parts", &error);
                    }
                    self.instruments = held_against;
                    kept += 1;
                }
            }
        }
        fitted
    }

    /// Has gaps count by the instruments of a fit from here on.
    pub(crate) fn count_gaps_by(&mut self, fit: &Fit) {
        let instruments = fit.randomness.without_latents();
        self.instruments = (instruments::parameters(&instruments) > 0).then_some(instruments);
    }

    /// `fitted`, whose gaps count by its own instruments; so do all from here on.
    pub(crate) fn counted(&mut self, fitted: Fitted) -> Fitted {
        self.count_gaps_by(&fitted.train);
        self.finish(fitted.train, fitted.holdout, fitted.estimate)
    }

    /// The model of `base` beside the instruments of `fitted`: what these leave of it. Latent forces carry what they can.
    pub(crate) fn beside_those_of(&self, fitted: &Fitted, base: &Fitted) -> Result<Fitted, FitError> {
        let randomness = fitted.train.randomness.with_latents(1.0);
        let settled = |from: &Fit, trials: &[Trial]| {
            let mut fit = Fit::new(&base.train.model, trials, &randomness, Some(from))?;
            fit.settle(trials, FIRST_MOVES)?;
            Ok::<_, FitError>(fit)
        };
        let mut train = settled(&base.train, &self.evidence.train)?;
        train.fit_latents(&self.evidence.train);
        train.settle(&self.evidence.train, FIRST_MOVES)?;
        let mut holdout = settled(&base.holdout, &self.evidence.holdout)?;
        holdout.randomness = train.randomness.clone();
        holdout.settle(&self.evidence.holdout, FIRST_MOVES)?;
        Ok(self.finish(train, holdout, None))
    }

    pub(crate) fn finish(&self, train: Fit, holdout: Fit, estimate: Option<Estimate>) -> Fitted {
        let e = self.evidence;
        let score = self.score(&train, &e.train);
        let holdout_score = holdout.minus_two_log_likelihood(&e.holdout, &train.randomness);
        let gap_over = |reach: &Reach| {
            let gap_by = |noise: &[f64]| gap(&e.holdout, &predict(&holdout, &e.holdout, reach.horizon), noise);
            match &self.instruments {
                Some(randomness) => (gap_by(&holdout.spread(&e.holdout, randomness, reach.horizon)), 1.0),
                None => (gap_by(&e.noise), reach.attainable),
            }
        };
        let Reaches { main, long } = &self.reaches;
        let ((short, of_short), (long, of_long)) = rayon::join(|| gap_over(main), || gap_over(long));
        let gap = [short.total() / of_short, long.total() / of_long];
        Fitted { train, holdout, estimate, score, holdout_score, gap, sums: [short, long] }
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
        let estimate = refine(&mut fit, trials, noise, self.free_from, rounds, aim)?;
        fit.fit_randomness(trials, noise, false);
        let score = self.score(&fit, trials);
        Ok(Trained { fit, estimate: Some(estimate), score })
    }

    /// What was fitted to the training data, on held-out data.
    pub(crate) fn verified(&self, trained: Trained, from: &Fitted) -> Result<Fitted, FitError> {
        let (train, held) = (trained.fit, &self.evidence.holdout);
        let mut holdout = Fit::new(&train.model, held, &train.randomness, Some(&from.holdout))?;
        let stays = holdout.settle(held, MOST_MOVES).ok().filter(|_| holdout.has_settled());
        if stays != Some(true) {
            // With small latents nothing but the model holds a trajectory that is still far off.
            let value = |fit: &Fit| fit.minus_two_log_likelihood(held, &train.randomness);
            match self.settled_from_afar(&train, from) {
                Ok(other) if stays.is_none() || value(&other) < value(&holdout) => holdout = other,
                Err(error) if stays.is_none() => return Err(error),
                _ => {}
            }
        }
        Ok(self.finish(train, holdout, trained.estimate))
    }

    /// The held-out trajectories of a model, first with large latent forces, then with its own.
    fn settled_from_afar(&self, train: &Fit, from: &Fitted) -> Result<Fit, FitError> {
        let held = &self.evidence.holdout;
        let mut holdout = self.loosened(&train.model, &from.holdout, held)?;
        holdout.settle(held, MOST_MOVES)?;
        holdout.randomness = train.randomness.clone();
        holdout.settle(held, MOST_MOVES)?;
        Ok(holdout)
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
        let latents = self.base_randomness.as_ref().unwrap_or(&from.randomness);
        let randomness = Randomness { force: latents.force, winch: latents.winch, ..from.randomness.clone() };
        let mut start = Fit::new(model, trials, &randomness, Some(from))?;
        start.smooth(trials)?;
        start.fit_randomness(trials, &self.evidence.noise, true);
        Ok(start)
    }

    /// Whether `next` predicts the held-out data better, sample by sample. Among several missing effects one alone may
    /// not shrink the gap of a free run, but it must do this.
    pub(crate) fn helps(before: &Fitted, next: &Fitted) -> bool {
        next.holdout_score < before.holdout_score - 0.5 * EVIDENCE
    }

    /// Whether what `with` has more than `without` is needed on held-out data.
    pub(crate) fn needs(&self, without: &Fitted, with: &Fitted) -> bool {
        let Reaches { main, long } = &self.reaches;
        let facts = [main, long].into_iter().enumerate().map(|(k, reach)| HorizonFacts {
            reach: Reach { attainable: 1.0, ..*reach },
            holdout: BeforeAfter { before: without.gap[k], after: with.gap[k] },
            scatter: with.sums[k].scatter(&without.sums[k]),
        });
        verdict::beats(&facts.collect::<Vec<_>>(), self.likelier(without, with), &POLICY)
    }

    /// Whether what `with` has more than `without` makes the held-out data as much likelier, sample by sample, as it does the
    /// training data. Free runs do not show a slow law, nor a clock that is late by less than the noise; this does.
    pub(crate) fn likelier(&self, without: &Fitted, with: &Fitted) -> bool {
        let measurements = |trials: &[Trial]| {
            trials.iter().flat_map(|trial| trial.measured.iter().flatten()).filter(|value| value.is_finite()).count()
        };
        let held = measurements(&self.evidence.holdout) as f64 / measurements(&self.evidence.train) as f64;
        let expected = held * (without.score - with.score);
        expected > 0.0 && without.holdout_score - with.holdout_score > POLICY.holds * expected
    }
}

#[cfg(test)]
mod tests {
    use cdpr::effect::EffectSpec;

    use super::*;
    use crate::data::recording::record;
    use crate::filter::estimate::noise_of_data;
    use crate::model::randomness::Memory;

    /// Noises with memory that are left of those that the instruments were given, where the pose wanders by so much (m): what
    /// the wander asks for, or else a drift of x that nothing asks for.
    fn released(wander: f64) -> (usize, usize) {
        let hidden = EffectSpec::new("winch_force_gain", Some(1), &[0.01]).expect("an effect");
        let recorded = |seed: u64| {
            let mut trial = record(std::slice::from_ref(&hidden), 40.0, seed);
            let last = trial.time[trial.len() - 1];
            for (row, time) in trial.measured.iter_mut().zip(&trial.time) {
                row[0] += wander * (std::f64::consts::PI * time / last).sin();
            }
            trial
        };
        let (train, holdout) = (vec![recorded(41), recorded(42)], vec![recorded(43)]);
        let noise = noise_of_data(&[&train[..], &holdout[..]].concat());
        let evidence = Evidence { train, holdout, noise, instruments: None };
        let mut search = Search::new(&evidence, 0, &|_, _| {});
        let base = search.base(&Model::default()).expect("a fit");
        let mut fitted =
            search.fit(&Model { effects: vec![hidden], ..Model::default() }, &base, ROUNDS).expect("a fit");
        if let Some(asked_for) = search.with_instruments(&fitted, 0.0).expect("a fit") {
            fitted = asked_for;
        } else {
            let drift = Memory { channel: 0, deviation: 2e-3, time: 40.0, drift: true };
            fitted.train.randomness = fitted.train.randomness.clone().with_memory(drift);
            fitted.train.smooth(&search.evidence.train).expect("a trajectory");
        }
        search.instruments = Some(fitted.train.randomness.without_latents());
        let fitted = search.finish(fitted.train, fitted.holdout, fitted.estimate);
        assert!(!fitted.train.randomness.memory.is_empty());
        search.taken.push(Taken::new(Vec::new(), -1.0, None));
        let fitted = search.without_idle_instruments(fitted);
        let standing = fitted.train.randomness.memory.len();
        (standing, search.instruments.map_or(0, |randomness| randomness.memory.len()))
    }

    /// A pose late by a millisecond and a half, of which free runs under a noise of 2 mm show nothing, was pruned.
    #[test]
    fn what_free_runs_do_not_show_is_needed_where_the_likelihood_does() {
        let delay = |value: f64| EffectSpec::new("pose_sensor_delay", None, &[value]).expect("an effect");
        for (hidden, needed) in [(vec![delay(1.5e-3)], true), (Vec::new(), false)] {
            let recorded = |seed: u64| record(&hidden, 40.0, seed);
            let (train, holdout) = (vec![recorded(44), recorded(45)], vec![recorded(46)]);
            let noise = noise_of_data(&train);
            let evidence = Evidence { train, holdout, noise, instruments: None };
            let mut search = Search::new(&evidence, 0, &|_, _| {});
            let base = search.base(&Model::default()).expect("a fit");
            let late = Model { effects: vec![delay(1e-3)], ..Model::default() };
            let next = search.fit(&late, &base, ROUNDS).expect("a fit");
            assert_eq!(search.needs(&base, &next), needed, "{:?} {:?} {}", base.gap, next.gap, base.score - next.score);
        }
    }

    #[test]
    fn a_drift_that_explains_nothing_any_more_is_given_back() {
        assert_eq!(released(0.0), (0, 0));
        let (standing, held_against) = released(0.05);
        assert!(standing > 0 && standing == held_against, "{standing} {held_against}");
    }
}
