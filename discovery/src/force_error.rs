//! Whether what an effect explains is the error of the recorded forces.
//!
//! A model is moved by the forces as recorded, their error included; the machine is not. Laws that let forces do less, as more
//! mass and inertia do, explain some of that, and where nothing is missing they seem to be (errors in variables). What tells
//! is more error: added to the recorded forces it makes any true effect harder to see, but an explanation of the error
//! explains the more of it (after J. R. Cook and L. A. Stefanski, J. Am. Stat. Assoc. 89 (1994), 1314, simulation and
//! extrapolation).

use crate::data::Trial;
use crate::estimate::{Fit, FitError};
use crate::fitted::Fitted;
use crate::search::{ROUNDS, Search};
use crate::verdict::POLICY;

impl Search<'_> {
    /// Whether the effects that `next` has and `before` lacks explain the more the larger the error of the recorded forces is:
    /// the criterion is compared with the one on the same recordings with as large an error once more.
    pub(crate) fn explains_force_error(&self, before: &Fitted, next: &Fitted) -> Result<bool, FitError> {
        let error = next.train.randomness.input;
        if error == 0.0 {
            return Ok(false);
        }
        let mut random = fastrand::Rng::with_seed(1);
        let disturbed: Vec<Trial> =
            self.evidence.train.iter().map(|trial| disturbed(trial, error, &mut random)).collect();
        let again = |fitted: &Fitted| -> Result<f64, FitError> {
            let mut randomness = fitted.train.randomness.clone();
            randomness.input = error * std::f64::consts::SQRT_2;
            let mut fit = Fit::new(&fitted.train.model, &disturbed, &randomness, Some(&fitted.train))?;
            fit.smooth(&disturbed)?;
            Ok(self.train(&fit.model, &fit, &disturbed, ROUNDS, None)?.score)
        };
        let (without, with) = rayon::join(|| again(before), || again(next));
        Ok(grows(before.score - next.score, without? - with?))
    }
}

/// Whether what an effect explains is larger beyond chance where the error is.
///
/// Twice the logarithm of a likelihood ratio that is `x` on average has a variance of about `4 x`.
fn grows(explained: f64, with_more_error: f64) -> bool {
    with_more_error - explained > POLICY.force_error * 2.0 * explained.max(0.0).sqrt()
}

/// A recording with another white error of its winch forces (N).
fn disturbed(trial: &Trial, error: f64, random: &mut fastrand::Rng) -> Trial {
    let mut disturbed = trial.clone();
    for force in disturbed.inputs.iter_mut().flat_map(|inputs| inputs.winch_force.iter_mut()) {
        *force += if random.bool() { error } else { -error };
    }
    disturbed
}

#[cfg(test)]
mod tests {
    use cdpr::effect::EffectSpec;
    use cdpr::model_file::Model;

    use super::*;
    use crate::data::recording::{noise, record};
    use crate::estimate::noise_of_data;
    use crate::fitted::Evidence;
    use crate::search::EVIDENCE;

    #[test]
    fn what_grows_beyond_its_scatter_grows() {
        assert!(grows(400.0, 800.0));
        assert!(!grows(400.0, 500.0));
        assert!(!grows(4000.0, 2000.0));
    }

    /// A recording with `hidden` effects whose recorded forces have an error of 100 N.
    fn recorded(hidden: &[EffectSpec], seed: u64) -> Trial {
        let mut trial = record(hidden, 60.0, seed);
        let mut errors = noise(4 * trial.len(), 90 + seed);
        for force in trial.inputs.iter_mut().flat_map(|inputs| inputs.winch_force.iter_mut()) {
            *force += 100.0 * errors.next().unwrap_or(0.0);
        }
        trial
    }

    /// How much `effect` explains where `hidden` acts, and whether that is the error of the forces.
    fn asked(hidden: &[EffectSpec], effect: &EffectSpec) -> (f64, bool) {
        let train: Vec<Trial> = [31, 32].map(|seed| recorded(hidden, seed)).into();
        let holdout = vec![recorded(hidden, 33)];
        let noise = noise_of_data(&[&train[..], &holdout[..]].concat());
        let evidence = Evidence { train, holdout, noise };
        let mut search = Search::new(&evidence, 0, &|_, _| {});
        let base = search.base(&Model::default()).expect("a fit");
        let mut train = base.train.clone();
        train.randomness.input = 100.0;
        train.smooth(&search.evidence.train).expect("a trajectory");
        train.fit_randomness(&search.evidence.train, &search.evidence.noise, false);
        let base = search.finish(train, base.holdout, None);
        let next =
            search.fit(&Model { effects: vec![effect.clone()], ..Model::default() }, &base, ROUNDS).expect("a fit");
        (base.score - next.score, search.explains_force_error(&base, &next).expect("an answer"))
    }

    #[test]
    fn an_inertia_that_stands_for_an_error_of_the_forces_is_told_from_drag() {
        let inertia = EffectSpec::new("winch_drum_inertia", None, &[50.0]).expect("an effect");
        let (explained, is_error) = asked(&[], &inertia);
        assert!(explained > EVIDENCE && is_error, "{explained} {is_error}");
        let drag = EffectSpec::new("platform_linear_drag", None, &[60.0]).expect("an effect");
        let (explained, is_error) = asked(std::slice::from_ref(&drag), &drag);
        assert!(explained > EVIDENCE && !is_error, "{explained} {is_error}");
    }
}
