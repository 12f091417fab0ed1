//! How models are fitted: to the training data, with all that is free refined, and as they are to held-out data.

use cdpr::model_file::Model;

use crate::data::Trial;
use crate::filter::error::FitError;
use crate::filter::estimate::Fit;
use crate::filter::kalman::Randomness;
use crate::hypothesis::extension::{count_in_use, count_times};
use crate::instruments;
use crate::outcome::BeforeAfter;
use crate::strategy::begin::{begun_by_data, held_by_data};
use crate::strategy::context::Context;
use crate::strategy::fitted::{Fitted, Trained, instruments_of};
use crate::verdict::gap::{GapSum, gap, predict};
use crate::verdict::{self, HorizonFacts, POLICY, Reach, Reaches};
use crate::weigh::proposal::{Certainty, certainty};
use crate::weigh::refine::refine;

impl Context<'_> {
    /// A model fitted to both sets from the data alone; gaps count as those of `from`.
    pub(crate) fn refined_by_data(&self, model: &Model, from: &Fitted) -> Result<Fitted, FitError> {
        self.time.check()?;
        let e = self.evidence;
        let mut train = begun_by_data(e, model, &self.journal)?;
        let ended = refine(&mut train, &e.train, self.free_from, self.policy.rounds, None)?;
        self.journal.stuck(&train.model.effects, ended);
        train.fit_randomness(&e.train, &e.noise, false);
        let holdout = held_by_data(e, &train, &self.journal)?;
        Ok(self.finish(train, holdout, from.instruments.clone()))
    }

    /// `-2 log L` on training data plus the penalty of the parameters.
    pub(crate) fn score(&self, train: &Fit, trials: &[Trial]) -> f64 {
        let effects = &train.model.effects[self.given..];
        let cost: f64 = effects.iter().map(|s| self.penalty.of(count_in_use(s).max(1))).sum();
        let times = self.penalty.of_times(count_times(effects));
        let instruments = self.penalty.of_parameters(instruments::parameters(&train.randomness));
        train.minus_two_log_likelihood(trials, &train.randomness) + cost + times + instruments
    }

    /// `fitted`, whose gaps count by its own instruments.
    pub(crate) fn counted(&self, fitted: Fitted) -> Fitted {
        let instruments = instruments_of(&fitted.train);
        self.finish(fitted.train, fitted.holdout, instruments)
    }

    /// `fitted`, whose gaps count by the instruments by which those of another fit do.
    pub(crate) fn counted_as(&self, fitted: &Fitted, other: &Fitted) -> Fitted {
        self.finish(fitted.train.clone(), fitted.holdout.clone(), other.instruments.clone())
    }

    /// Two fits made one, with its score and its gaps by these `instruments`.
    pub(crate) fn finish(&self, train: Fit, holdout: Fit, instruments: Option<Randomness>) -> Fitted {
        let e = self.evidence;
        let score = self.score(&train, &e.train);
        let holdout_score = holdout.minus_two_log_likelihood(&e.holdout, &train.randomness);
        let (gap, sums) = self.gaps(&holdout, &e.holdout, instruments.as_ref());
        Fitted { train, holdout, score, holdout_score, gap, sums, instruments }
    }

    /// The gap of a fit over the main horizon and the long one on held-out trials, in multiples of what a model without fault would leave beside
    /// these instruments, and what they are made of.
    pub(crate) fn gaps(
        &self,
        holdout: &Fit,
        trials: &[Trial],
        instruments: Option<&Randomness>,
    ) -> ([f64; 2], [GapSum; 2]) {
        let gap_over = |reach: &Reach| {
            let gap_by = |noise: &[f64]| gap(trials, &predict(holdout, trials, reach.horizon), noise);
            match instruments {
                Some(randomness) => (gap_by(&holdout.spread(trials, randomness, reach.horizon)), 1.0),
                None => (gap_by(&self.evidence.noise), reach.attainable),
            }
        };
        let Reaches { main, long } = &self.reaches;
        let ((short, of_short), (long, of_long)) = rayon::join(|| gap_over(main), || gap_over(long));
        ([short.total() / of_short, long.total() / of_long], [short, long])
    }

    /// Fits `model`, starting from another fit, with its own effects' parameters refined.
    pub(crate) fn fit(&self, model: &Model, from: &Fitted) -> Result<Fitted, FitError> {
        let trained = self.train(model, &from.train, &self.evidence.train, self.policy.rounds, None)?;
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
        self.time.check()?;
        let noise = &self.evidence.noise;
        let mut fit = self.started(model, from, trials)?;
        let ended = refine(&mut fit, trials, self.free_from, rounds, aim)?;
        self.journal.stuck(&fit.model.effects, ended);
        fit.fit_randomness(trials, noise, false);
        let score = self.score(&fit, trials);
        Ok(Trained { fit, score })
    }

    /// What was fitted to the training data, on held-out data.
    pub(crate) fn verified(&self, trained: Trained, from: &Fitted) -> Result<Fitted, FitError> {
        self.verified_by(trained, from, from.instruments.clone())
    }

    /// The same, with gaps by these `instruments`.
    pub(crate) fn verified_by(
        &self,
        trained: Trained,
        from: &Fitted,
        instruments: Option<Randomness>,
    ) -> Result<Fitted, FitError> {
        let (train, held) = (trained.fit, &self.evidence.holdout);
        let settled =
            |mut fit: Fit| fit.settle(held, self.policy.held_out_moves).map(|stays| (stays && fit.has_settled(), fit));
        let carried = Fit::new(&train.model, held, &train.randomness, Some(&from.holdout)).and_then(settled);
        let anew = || Fit::new(&train.model, held, &train.randomness, None).and_then(settled);
        let holdout = match carried {
            Ok((true, holdout)) => holdout,
            // What has not settled leaves a gap, which tells more than why it cannot be made better.
            Ok((false, holdout)) => match anew() {
                Ok((_, anew)) if anew.stands_before(&holdout, held) => anew,
                _ => holdout,
            },
            // A start of which nothing comes is one of two, and no answer: where the other fails as well, its error is told.
            Err(_) => anew()?.1,
        };
        Ok(self.finish(train, holdout, instruments))
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
        self.time.check()?;
        let latents = &self.base_randomness;
        let randomness = Randomness { force: latents.force, winch: latents.winch, ..from.randomness.clone() };
        let mut start = Fit::new(model, trials, &randomness, Some(from))?;
        start.smooth(trials)?;
        start.fit_randomness(trials, &self.evidence.noise, true);
        Ok(start)
    }

    /// How certain the sizes of a fit's effects are.
    pub(crate) fn certainty(&self, fitted: &Fitted) -> Certainty {
        certainty(&fitted.train, &self.evidence.train, self.free_from)
    }

    /// Whether what `with` has more than `without` is needed on held-out data.
    pub(crate) fn needs(&self, without: &Fitted, with: &Fitted) -> bool {
        verdict::beats(&self.horizons(without, with), self.likelier(without, with), &POLICY)
    }

    /// Whether free runs over training data leave more than noise.
    pub(crate) fn misses_while_training(&self, fitted: &Fitted) -> bool {
        let (gap, _) = self.gaps(&fitted.train, &self.evidence.train, fitted.instruments.as_ref());
        gap.iter().any(|gap| *gap > POLICY.at_noise)
    }

    /// Whether free runs over held-out data show what `with` has more than `without`.
    pub(crate) fn free_runs_show(&self, without: &Fitted, with: &Fitted) -> bool {
        verdict::shows(&self.horizons(without, with), &POLICY)
    }

    /// The gaps of two fits over the main horizon and the long one.
    fn horizons(&self, without: &Fitted, with: &Fitted) -> Vec<HorizonFacts> {
        let Reaches { main, long } = &self.reaches;
        let facts = [main, long].into_iter().enumerate().map(|(k, reach)| HorizonFacts {
            reach: Reach { attainable: 1.0, ..*reach },
            holdout: BeforeAfter { before: without.gap[k], after: with.gap[k] },
            scatter: with.sums[k].scatter(&without.sums[k]),
        });
        facts.collect()
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
    use crate::data::recording::{Bench, record, record_on};
    use crate::filter::estimate::noise_of_data;
    use crate::strategy::fitted::Evidence;

    /// The right law was refused where another model's trajectory, from which the held-out one began, had run away.
    #[test]
    fn held_out_trajectories_begin_with_the_data_where_those_of_another_model_have_run_away() {
        let bench = Bench::ringing();
        let lag = EffectSpec::new("winch_lag", None, &[0.01, 0.0]).expect("an effect");
        let recorded = |seed: u64| record_on(&bench, std::slice::from_ref(&lag), 8.0, seed);
        let (train, holdout) = (vec![recorded(51)], vec![recorded(52)]);
        let noise = noise_of_data(&train);
        let evidence = Evidence::new(train, holdout, noise);
        let model = Model { parameters: bench.parameters.clone(), ..Model::default() };
        let (context, mut base) = Context::begin(&evidence, &model, 0..0, &|_, _| {}).expect("a fit");
        let plant = &base.holdout.examined.plant;
        let (length, rate) = (plant.unstretched_index(0).expect("a length"), plant.rate_index(0).expect("a rate"));
        let trajectory = &mut base.holdout.trajectories[0];
        for row in trajectory.values.chunks_exact_mut(trajectory.width) {
            (row[length], row[rate]) = (0.1 * row[length], 40.0);
        }
        let next = context.fit(&Model { effects: vec![lag], ..model }, &base).expect("a fit");
        assert!(next.holdout.has_settled() && (0.6..1.6).contains(&next.gap[0]), "{:?}", next.gap);
    }

    /// A pose late by a millisecond and a half, of which free runs under a noise of 2 mm show nothing, was pruned.
    #[test]
    fn what_free_runs_do_not_show_is_needed_where_the_likelihood_does() {
        let delay = |value: f64| EffectSpec::new("pose_sensor_delay", None, &[value]).expect("an effect");
        for (hidden, needed) in [(vec![delay(1.5e-3)], true), (Vec::new(), false)] {
            let recorded = |seed: u64| record(&hidden, 40.0, seed);
            let (train, holdout) = (vec![recorded(44), recorded(45)], vec![recorded(46)]);
            let noise = noise_of_data(&train);
            let evidence = Evidence::new(train, holdout, noise);
            let begun = Context::begin(&evidence, &Model::default(), 0..0, &|_, _| {});
            let (context, base) = begun.expect("a fit");
            let late = Model { effects: vec![delay(1e-3)], ..Model::default() };
            let next = context.fit(&late, &base).expect("a fit");
            assert_eq!(
                context.needs(&base, &next),
                needed,
                "{:?} {:?} {}",
                base.gap,
                next.gap,
                base.score - next.score
            );
        }
    }
}
