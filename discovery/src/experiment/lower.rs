//! Detection limits along a motion: how small a law could be and still show.

use cdpr::model_file::Model;
use nalgebra::DMatrix;

use crate::filter::estimate::{for_trial, noise_of_data};
use crate::filter::whiten::whiten;
use crate::hypothesis::along::Along;
use crate::hypothesis::candidates::{Situation, catalogue};
use crate::hypothesis::extension::count_in_use;
use crate::hypothesis::parameter::free_parameters;
use crate::hypothesis::signature::{Varied, sensitivities};
use crate::hypothesis::stream::forcing;
use crate::outcome::DetectionLimit;
use crate::strategy::context::Context;
use crate::strategy::fitted::Evidence;
use crate::verdict::detection::{GUST, columns_of, detection_limits, readings_of};
use crate::weigh::criterion::EVIDENCE;
use crate::weigh::proposal::varied_models;

use super::Lowered;
use super::apart::{Bench, CERTAIN, left};
use super::drive::drive;
use super::motion::Motion;
use super::question::Known;

/// Seeds of the noise in the two recordings of which the limits are told.
const SEEDS: [u64; 2] = [1, 2];

/// A law of which smaller sizes are to show.
pub(super) struct Lower<'a> {
    pub(super) bench: &'a Bench<'a>,
    /// The model with what was found, and how many of its effects were given.
    pub(super) model: &'a Model,
    pub(super) given: usize,
    pub(super) id: &'a str,
    pub(super) cable: Option<usize>,
}

impl Lower<'_> {
    /// What a motion sampled at `interval` (s) is worth: by how many natural logarithms the limits are below one unit of
    /// their parameters, as a mean over them. By what training data ask for, which is most of a limit and quick to say.
    pub(super) fn merit(&self, motion: &Motion, interval: f64) -> Result<f64, String> {
        let driven = drive(self.model, motion, &self.bench.channels(), interval)?;
        self.bench.check_tensions(&driven)?;
        let (fit, trial) = self.bench.fit(self.model, driven, interval)?;
        let mut situation = Situation::of(std::slice::from_ref(&trial));
        situation.peaks.push(GUST);
        let library = catalogue(self.model, &situation);
        let entries = readings_of(&library, self.id, self.cable);
        let candidates: Vec<usize> = entries.iter().map(|(at, _)| *at).collect();
        let own = library.of_columns(&columns_of(&library, &candidates));
        let free = varied_models(self.model, &free_parameters(self.model, self.given));
        let free: Vec<Varied> = free.into_iter().flatten().collect();
        let linear = fit.linear(std::slice::from_ref(&trial));
        let along = Along::new(&fit, &linear, std::slice::from_ref(&trial), 0);
        let signatures = forcing(&along, (&own.variations, &own.columns));
        let all = signatures.beside(&sensitivities(&along, &free));
        let randomness = for_trial(&fit.randomness, &trial);
        let normal = whiten(along.linear, &randomness, &all);
        let nuisance: Vec<usize> = (own.columns.len()..all.columns).collect();
        let penalty = self.bench.penalty(&trial, interval);
        let mut first = 0;
        let logarithms = entries.iter().map(|(at, reading)| {
            let candidate = &library.candidates[*at];
            let of = |k: usize| (first + reading.columns[k], reading.scale[k]);
            let square = |sum: &[(usize, f64)]| left(&normal, sum, &nuisance);
            let gram = DMatrix::from_fn(reading.columns.len(), reading.columns.len(), |a, b| {
                if a == b {
                    square(&[of(a)])
                } else {
                    0.5 * (square(&[of(a), of(b)]) - square(&[of(a)]) - square(&[of(b)]))
                }
            });
            first += candidate.columns.len();
            let weakest = gram.symmetric_eigenvalues().min().max(f64::MIN_POSITIVE);
            let parameters =
                candidate.effect(&vec![1.0; candidate.columns.len()]).map_or(1, |e| count_in_use(&e).max(1));
            let asked = EVIDENCE + penalty.of(parameters.max(candidate.columns.len() + candidate.tried));
            let size = reading.size(candidate, (asked.sqrt() + CERTAIN) / weakest.sqrt());
            let logarithm = size.abs().clamp(SIZES.0, SIZES.1).ln();
            if reading.is_inverse(candidate) { logarithm } else { -logarithm }
        });
        let logarithms: Vec<f64> = logarithms.collect();
        Ok(logarithms.iter().sum::<f64>() / logarithms.len().max(1) as f64)
    }

    /// The limits as a discovery of two recordings of the motion would tell them, one held out, beside those that are `known`.
    pub(super) fn limits(&self, motion: &Motion, interval: f64, known: &[Known]) -> Result<Vec<Lowered>, String> {
        let cannot = |e: &dyn std::fmt::Display| format!("the model cannot be fitted to recordings of the motion: {e}");
        let driven = drive(self.model, motion, &self.bench.channels(), interval)?;
        let [train, holdout] = SEEDS.map(|seed| {
            let mut trial = driven.trial.clone();
            self.bench.add_noise(&mut trial, interval, seed);
            vec![trial]
        });
        let noise = noise_of_data(&[&train[..], &holdout[..]].concat());
        let evidence = Evidence::new(train, holdout, noise);
        let begun = Context::begin(&evidence, self.model, self.given..self.given, &|_, _| {});
        let (context, base) = begun.map_err(|e| cannot(&e))?;
        let found = detection_limits(&context, &base);
        let planned = |known: &Known| {
            let same = |limit: &&DetectionLimit| {
                limit.effect.id == self.id && limit.effect.cable == known.cable && limit.parameter == known.parameter
            };
            found.iter().find(same).and_then(|limit| limit.size)
        };
        let lowered = |known: &Known| Lowered {
            id: self.id.to_owned(),
            cable: known.cable,
            parameter: known.parameter.clone(),
            unit: known.unit.clone(),
            at_most: known.shows == "up_to",
            now: known.size,
            planned: planned(known),
        };
        Ok(known.iter().map(lowered).collect())
    }
}

/// Sizes beyond which a limit is none.
const SIZES: (f64, f64) = (1e-12, 1e15);
