//! Models fitted to the training data and, as they are, to held-out data.

use cdpr::effect::EffectSpec;
use cdpr::model_file::Model;

use crate::data::{Trial, Undone};
use crate::filter::estimate::Fit;
use crate::filter::kalman::Randomness;
use crate::hypothesis::extension::is_one_law;
use crate::instruments;
use crate::instruments::expected::expected_forces;
use crate::strategy::policy::Policy;
use crate::verdict::gap::GapSum;
use crate::verdict::{POLICY, left, share_taken};
use crate::weigh::criterion::EVIDENCE;

/// The data of a search and what is known of its noise.
#[derive(Clone)]
pub(crate) struct Evidence {
    pub(crate) train: Vec<Trial>,
    pub(crate) holdout: Vec<Trial>,
    /// Noise by channel of [`Channel::all`].
    pub(crate) noise: Vec<f64>,
    /// What an earlier search found of the instruments.
    pub(crate) instruments: Option<Randomness>,
    /// The same with winch forces as they were recorded, where a recorder's lateness was undone.
    pub(crate) as_recorded: Option<Box<Evidence>>,
    /// Whether it is known that no recorder made the winch forces late.
    pub(crate) forces_in_time: bool,
}

impl Evidence {
    pub(crate) fn new(train: Vec<Trial>, holdout: Vec<Trial>, noise: Vec<f64>) -> Self {
        Self { train, holdout, noise, instruments: None, as_recorded: None, forces_in_time: false }
    }

    /// The same with the winch forces that are to be expected, given those recorded: what the `instruments` say of their error.
    pub(crate) fn with_expected_forces(self, instruments: Randomness) -> Self {
        let (sets, expected) = expected_forces([&self.train, &self.holdout], instruments.input);
        let [train, holdout] = sets;
        let instruments = Some(Randomness { expected: Some(expected), ..instruments });
        // What these are is known by the lateness that was undone, which is taken back no more.
        Self { train, holdout, instruments, as_recorded: None, ..self }
    }

    /// Whether a law of a model, at other times with other numbers, acts at a time that was held out. What does not is shown by the data
    /// alone by which it was found.
    pub(crate) fn holds_out(&self, model: &Model, law: &EffectSpec) -> bool {
        let acts = |effect: &EffectSpec, trial: &Trial| {
            let (first, last) = (trial.time[0], trial.time[trial.len() - 1]);
            effect.from.is_none_or(|from| from < last) && effect.until.is_none_or(|until| until > first)
        };
        let mut all = model.effects.iter().filter(|effect| is_one_law(effect, law));
        all.any(|effect| self.holdout.iter().any(|trial| acts(effect, trial)))
    }

    /// The same as it was before recording did so.
    pub(crate) fn before(self, undone: Undone) -> Self {
        let before = |trials: &[Trial]| trials.iter().map(|trial| trial.before(undone)).collect();
        let (train, holdout) = (before(&self.train), before(&self.holdout));
        let as_recorded = match undone {
            Undone::Forces(_) if Undone::recorder(&self.train).is_in_time() => Some(Box::new(self.clone())),
            Undone::Forces(_) => self.as_recorded,
            Undone::Clock(_) => self.as_recorded.map(|recorded| Box::new(recorded.before(undone))),
        };
        Self { train, holdout, as_recorded, ..self }
    }
}

/// A model fitted to both sets.
#[derive(Clone)]
pub(crate) struct Fitted {
    pub(crate) train: Fit,
    pub(crate) holdout: Fit,
    /// `-2 log L` on the training data plus the penalty of the parameters.
    pub(crate) score: f64,
    /// `-2 log L` on the held-out data.
    pub(crate) holdout_score: f64,
    /// Gap on held-out data over the main horizon and the long one, in multiples of what a model without fault would leave.
    pub(crate) gap: [f64; 2],
    /// What they are made of.
    pub(crate) sums: [GapSum; 2],
    /// What is random with the instruments by which they count, the latent forces left out; none where instruments have white
    /// noise alone.
    pub(crate) instruments: Option<Randomness>,
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

    /// Whether it predicts the held-out data better than `before`, sample by sample. Among several missing effects one alone
    /// may not shrink the gap of a free run, but it must do this.
    pub(crate) fn helps(&self, before: &Self, policy: &Policy) -> bool {
        self.holdout_score < before.holdout_score - policy.helps * EVIDENCE
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
    /// `-2 log L` on these data plus the penalty of the parameters.
    pub(crate) score: f64,
}

/// What is random with the instruments of a fit, the latent forces left out; none where they have white noise alone.
pub(crate) fn instruments_of(fit: &Fit) -> Option<Randomness> {
    let instruments = fit.randomness.without_latents();
    (instruments::parameters(&instruments) > 0).then_some(instruments)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::Recorder;
    use crate::data::recording::record;

    #[test]
    fn a_law_is_held_out_where_it_acts_at_some_time_there() {
        let mut trial = record(&[], 20.0, 3);
        trial.time.iter_mut().for_each(|time| *time += 42.0);
        let evidence = Evidence::new(Vec::new(), vec![trial], Vec::new());
        let during = |from: Option<f64>, until: Option<f64>| {
            let gain = EffectSpec::new("winch_force_gain", Some(2), &[0.01]).expect("an effect");
            gain.during(from, until).expect("an effect that can begin and end")
        };
        let held_out = |effects: &[EffectSpec]| {
            let model = Model { effects: effects.to_vec(), ..Model::default() };
            evidence.holds_out(&model, &effects[0])
        };
        assert!(held_out(&[during(None, None)]) && held_out(&[during(Some(50.0), Some(51.0))]));
        assert!(!held_out(&[during(None, Some(40.0))]) && !held_out(&[during(Some(63.0), None)]));
        // With another size it goes on.
        assert!(held_out(&[during(None, Some(40.0)), during(Some(40.0), None)]));
    }

    /// With the clock as it was found to be, and once only.
    #[test]
    fn what_was_recorded_is_kept_beside_what_is_undone() {
        let trial = record(&[], 10.0, 3);
        let evidence = Evidence::new(vec![trial.clone()], vec![trial.clone()], Vec::new());
        let late = Undone::Forces(Recorder { delay: 0.01, variance: 0.0 });
        assert!(evidence.clone().before(Undone::Clock(0.01)).as_recorded.is_none());
        let undone = [late, Undone::Clock(0.01), late].into_iter().fold(evidence, Evidence::before);
        let recorded = undone.as_recorded.expect("forces as recorded");
        assert!(recorded.as_recorded.is_none() && Undone::recorder(&recorded.holdout).is_in_time());
        assert_eq!(recorded.train[0].inputs, trial.inputs);
        assert!((recorded.train[0].time[100] / trial.time[100] - 1.01).abs() < 1e-12);
    }
}
