//! How far apart laws are expected to be on a recording of a motion.
//!
//! With the whitened signatures `s` of two laws, each at the size it was found with, the criterion of the one fitted in the
//! place of the other is expected to differ by the square of `s - s'` clear of everything that is free in the fit: the other
//! law's parameters, those of other effects found, and the latent forces, whose size is chosen with them.

use cdpr::effect::EffectSpec;
use cdpr::model_file::Model;
use nalgebra::{DMatrix, DVector};

use crate::data::{Channel, Trial};
use crate::filter::estimate::{Fit, for_trial};
use crate::filter::kalman::Randomness;
use crate::filter::whiten::{Normal, whiten};
use crate::hypothesis::along::Along;
use crate::hypothesis::candidates::Combination;
use crate::hypothesis::extension::count_in_use;
use crate::hypothesis::facts::{Told, facts};
use crate::hypothesis::parameter::{Free, free_parameters, parameter_step};
use crate::hypothesis::signature::{Varied, sensitivities};
use crate::hypothesis::stream::forcing;
use crate::hypothesis::term;
use crate::instruments::latents::first_randomness;
use crate::model::examined::Examined;
use crate::model::randomness::Memory;
use crate::weigh::criterion::{EVIDENCE, Penalty, told_apart_from};
use crate::weigh::proposal::varied_models;

use super::drive::{Driven, drive};
use super::limits::Limits;
use super::motion::Motion;
use super::question::{Open, Question};

/// Standard normal deviate that is exceeded once in a hundred times: what is planned is to happen with 99 %.
pub(super) const CERTAIN: f64 = 2.326;
/// Sizes of latent forces that a fit may choose beside none, as shares of the size from which they are searched for.
const LATENTS: [f64; 4] = [0.01, 0.1, 1.0, 10.0];
/// Seed of the noise in which sizes of latent forces are weighed.
const SEED: u64 = 1;

/// What motions are judged by.
pub(super) struct Bench<'a> {
    question: &'a Question,
    tension: [f64; 2],
    /// Sampling interval of the recordings to come (s).
    interval: f64,
}

/// Two laws along a motion, of which the first is true.
#[derive(Clone, Debug)]
pub(super) struct Pair {
    /// The question, and the places of the laws in it.
    pub(super) open: usize,
    pub(super) truth: usize,
    pub(super) rival: usize,
    /// What the criterion is expected to differ by.
    pub(super) difference: f64,
    /// From which difference the verdict tells them apart.
    pub(super) asked: f64,
    /// The least difference that is expected where it does in 99 of 100 recordings, and finds the law at all.
    pub(super) needed: f64,
}

impl Pair {
    /// How far apart the laws are, in multiples of what is needed, as a distance.
    pub(super) fn reach(&self) -> f64 {
        (self.difference.max(0.0) / self.needed).sqrt()
    }
}

/// What is varied in the model to see each law: the law at its size, and with each of its parameters moved.
struct Columns {
    variations: Vec<EffectSpec>,
    /// Sums of variations.
    combinations: Vec<Combination>,
    /// For each law the sum that is the law itself, and those that are its parameters.
    laws: Vec<(usize, Vec<usize>)>,
}

impl Columns {
    fn of(open: &Open) -> Self {
        let mut columns = Self { variations: Vec::new(), combinations: Vec::new(), laws: Vec::new() };
        for law in &open.laws {
            let own = columns.variations.len();
            columns.variations.push(law.clone());
            let mut alone = open.base.clone();
            alone.effects = vec![law.clone()];
            let place = columns.combinations.len();
            columns.combinations.push(vec![(own, 1.0)]);
            let mut parameters = Vec::new();
            for free in free_parameters(&alone, 0) {
                let Free { parameter, .. } = free;
                let step = parameter_step(&alone, free);
                let moved = [step, -step].into_iter().find_map(|step| {
                    let moved = term::with_value(law, parameter, term::values(law)[parameter] + step);
                    moved.check().is_ok().then_some((moved, step))
                });
                let Some((moved, step)) = moved else { continue };
                columns.variations.push(moved);
                parameters.push(columns.combinations.len());
                // In units of what makes the law twice as large, or of the step.
                let unit = term::values(law)[parameter].abs().max(step.abs()) / step;
                columns.combinations.push(vec![(columns.variations.len() - 1, unit), (own, -unit)]);
            }
            columns.laws.push((place, parameters));
        }
        columns
    }
}

impl<'a> Bench<'a> {
    pub(super) fn new(question: &'a Question, limits: &Limits) -> Self {
        Self { question, tension: limits.tension, interval: limits.interval }
    }

    /// The channels that are measured.
    pub(super) fn channels(&self) -> Vec<Channel> {
        self.question.instruments.iter().map(|i| i.channel).collect()
    }

    /// Every two laws of each question along a motion sampled at `interval` (s), each way round.
    ///
    /// # Errors
    /// The model cannot be driven, or not within the limits of tension.
    pub(super) fn pairs(&self, motion: &Motion, interval: f64) -> Result<Vec<Pair>, String> {
        let mut out = Vec::new();
        for (at, open) in self.question.open.iter().enumerate() {
            let driven = drive(&open.base, motion, &self.channels(), interval)?;
            self.check_tensions(&driven)?;
            out.extend(self.of_open(at, open, driven, interval)?);
        }
        Ok(out)
    }

    /// That a driven motion keeps to the limits of tension.
    pub(super) fn check_tensions(&self, driven: &Driven) -> Result<(), String> {
        let [low, high] = self.tension;
        let off = driven.tension.iter().flatten().find(|t| !(low..=high).contains(t));
        match off {
            Some(tension) => Err(format!("a tension comes to {tension:.0} N, beyond the limits {low} to {high} N")),
            None => Ok(()),
        }
    }

    fn of_open(&self, at: usize, open: &Open, driven: Driven, interval: f64) -> Result<Vec<Pair>, String> {
        let (fit, trial) = self.fit(&open.base, driven, interval)?;
        let columns = Columns::of(open);
        let normals = normals(&fit, open, &columns, &trial)?;
        let total = normals.first().map_or(0, |(_, normal)| normal.columns);
        let nuisance: Vec<usize> = (columns.combinations.len()..total).collect();
        let silent = |law: usize| normals[0].1.gram[columns.laws[law].0 * (total + 1)] <= 0.0;
        if let Some(law) = (0..open.laws.len()).find(|law| silent(*law)) {
            return Err(format!("`{}` adds nothing along the motion", open.laws[law].id));
        }
        let least = normals.iter().map(|(value, _)| *value).fold(f64::INFINITY, f64::min);
        let expected = |difference: &[(usize, f64)], free: &[usize]| {
            let at_level = |(value, normal): &(f64, Normal)| value - least + left(normal, difference, free);
            normals.iter().map(at_level).fold(f64::INFINITY, f64::min).max(0.0)
        };
        let penalty = self.penalty(&trial, interval);
        let mut out = Vec::new();
        for truth in 0..open.laws.len() {
            let (own, _) = columns.laws[truth];
            let explains = expected(&[(own, 1.0)], &nuisance);
            let to_be_found = EVIDENCE + penalty.of(count_in_use(&open.laws[truth]).max(1));
            let found = ((to_be_found.sqrt() + CERTAIN).powi(2) / explains.max(f64::MIN_POSITIVE)).max(1.0);
            for rival in (0..open.laws.len()).filter(|rival| *rival != truth) {
                let (other, parameters) = &columns.laws[rival];
                let free = [&parameters[..], &nuisance].concat();
                let asked = told_apart_from(explains);
                let needed = (CERTAIN + (CERTAIN * CERTAIN + asked).sqrt()).powi(2);
                let difference = expected(&[(own, 1.0), (*other, -1.0)], &free);
                out.push(Pair { open: at, truth, rival, difference, asked, needed: needed * found });
            }
        }
        Ok(out)
    }

    /// A driven motion as a recording with noise, and the model linearised along it.
    pub(super) fn fit(&self, model: &Model, driven: Driven, interval: f64) -> Result<(Fit, Trial), String> {
        let cannot = |e: &dyn std::fmt::Display| format!("the model cannot be linearised along the motion: {e}");
        let Driven { mut trial, trajectory, .. } = driven;
        let examined = Examined::new(model).map_err(|e| cannot(&e))?;
        let randomness = self.randomness(model, &trial, interval);
        self.add_noise(&mut trial, interval, SEED);
        let trials = [trial];
        let begun = vec![(trajectory.states(0).to_vec(), trajectory)];
        let fit = Fit::along_trajectories(model, examined, &trials, begun, randomness);
        let fit = fit.map_err(|e| cannot(&e))?;
        let [trial] = trials;
        Ok((fit, trial))
    }

    /// What parameters cost in the recordings that stand behind a trial sampled at `interval` (s).
    pub(super) fn penalty(&self, trial: &Trial, interval: f64) -> Penalty {
        let count = trial.len() * trial.channels.len();
        Penalty::new((count as f64 * interval / self.interval) as usize)
    }

    /// What is random in a recording sampled at `interval` (s). Where that is longer than it will be, as many samples less
    /// stand for the same.
    fn randomness(&self, model: &Model, trial: &Trial, interval: f64) -> Randomness {
        let all = Channel::all(trial.cables());
        let fewer = (self.interval / interval).sqrt();
        let mut noise = vec![f64::NAN; all.len()];
        let duration = trial.time[trial.len() - 1];
        let mut memory = Vec::new();
        for instrument in &self.question.instruments {
            let Some(channel) = all.iter().position(|c| *c == instrument.channel) else { continue };
            noise[channel] = fewer * instrument.white.max(instrument.channel.noise_floor());
            memory.extend(instrument.memories.iter().map(|(deviation, time)| Memory {
                channel,
                deviation: *deviation,
                time: time.unwrap_or(duration),
                drift: time.is_none_or(f64::is_infinite),
            }));
        }
        let first = first_randomness(model, std::slice::from_ref(trial), &noise).without_latents();
        memory.sort_by_key(|m| m.channel);
        Randomness { memory, input: fewer * self.question.force_error, jitter: fewer * self.question.jitter, ..first }
    }

    /// Adds what the instruments do to a recording sampled at `interval` (s).
    pub(super) fn add_noise(&self, trial: &mut Trial, interval: f64, seed: u64) {
        let fewer = (self.interval / interval).sqrt();
        let mut random = fastrand::Rng::with_seed(seed);
        for (j, instrument) in self.question.instruments.iter().enumerate() {
            let mut memories: Vec<f64> =
                instrument.memories.iter().map(|(size, _)| size * normal(&mut random)).collect();
            for k in 0..trial.len() {
                for (state, (size, time)) in memories.iter_mut().zip(&instrument.memories) {
                    let decay = time.map_or(1.0, |time| (-interval / time).exp());
                    *state = decay * *state + (1.0 - decay * decay).sqrt() * size * normal(&mut random);
                }
                trial.measured[k][j] += fewer * instrument.white * normal(&mut random) + memories.iter().sum::<f64>();
            }
        }
    }
}

/// A normally distributed number, by the method of G. E. P. Box and M. E. Muller.
fn normal(random: &mut fastrand::Rng) -> f64 {
    (-2.0 * (1.0 - random.f64()).ln()).sqrt() * (std::f64::consts::TAU * random.f64()).cos()
}

/// At each size of the latent forces `-2 log L` of noise alone and the normal equations of all columns, none first.
fn normals(fit: &Fit, open: &Open, columns: &Columns, trial: &Trial) -> Result<Vec<(f64, Normal)>, String> {
    let linear = fit.linear(std::slice::from_ref(trial));
    let along = Along::new(fit, &linear, std::slice::from_ref(trial), 0);
    // A law without states of its own acts through the rates, and the variational equation is exact; for weighing by quadrature
    // two laws with forces that cancel on the whole would be too far apart.
    let (mut through_rates, mut others, mut places) = (Vec::new(), Vec::new(), Vec::new());
    for law in &columns.variations {
        let mut with = fit.model.clone();
        with.effects.push(law.clone());
        let examined = Examined::new(&with).map_err(|e| format!("`{}` cannot be added to the model: {e}", law.id))?;
        if examined.states() == fit.examined.states() && facts(&law.id).told != Told::LateForce {
            places.push((true, through_rates.len()));
            through_rates.push(Varied { examined, effect: law.id.clone(), size: 1.0 });
        } else {
            places.push((false, others.len()));
            others.push(law.clone());
        }
    }
    let alone: Vec<Combination> = (0..others.len()).map(|at| vec![(at, 1.0)]).collect();
    let place = |variation: usize| match places[variation] {
        (true, at) => alone.len() + at,
        (false, at) => at,
    };
    let free = varied_models(&fit.model, &free_parameters(&fit.model, open.given));
    through_rates.extend(free.into_iter().flatten());
    let others = forcing(&along, (&others, &alone));
    let all = others.beside(&sensitivities(&along, &through_rates));
    let of_laws = columns.combinations.iter().map(|sum| sum.iter().map(|(at, weight)| (place(*at), *weight)).collect());
    let sums: Vec<Combination> =
        of_laws.chain((columns.variations.len()..all.columns).map(|free| vec![(free, 1.0)])).collect();
    let nothing = fit.randomness.without_latents();
    let sizes = std::iter::once(nothing.clone()).chain(LATENTS.map(|share| nothing.with_latents(share)));
    let at_size = |size: Randomness| {
        let size = for_trial(&size, trial);
        let normal = whiten(along.linear, &size, &all);
        (normal.minus_two_log_likelihood, combined(&normal, &sums))
    };
    Ok(sizes.map(at_size).collect())
}

/// The products of sums of columns.
fn combined(normal: &Normal, sums: &[Combination]) -> Normal {
    let mut out = Normal::empty(sums.len());
    for (a, one) in sums.iter().enumerate() {
        for (b, other) in sums.iter().enumerate() {
            let products = one.iter().flat_map(|(i, v)| other.iter().map(move |(j, w)| (i, j, v * w)));
            out.gram[a * sums.len() + b] =
                products.map(|(i, j, weight)| weight * normal.gram[i * normal.columns + j]).sum();
        }
    }
    out
}

/// The square of a sum of columns clear of some others.
pub(super) fn left(normal: &Normal, sum: &[(usize, f64)], free: &[usize]) -> f64 {
    let product = |a: usize, b: usize| normal.gram[a * normal.columns + b];
    let with = |column: usize| sum.iter().map(|(at, weight)| weight * product(column, *at)).sum::<f64>();
    let square: f64 = sum.iter().map(|(at, weight)| weight * with(*at)).sum();
    let live: Vec<usize> = free.iter().copied().filter(|a| product(*a, *a) > 0.0).collect();
    if live.is_empty() {
        return square;
    }
    let size: Vec<f64> = live.iter().map(|a| product(*a, *a).sqrt()).collect();
    let gram = DMatrix::from_fn(live.len(), live.len(), |a, b| product(live[a], live[b]) / (size[a] * size[b]));
    let right = DVector::from_fn(live.len(), |a, _| with(live[a]) / size[a]);
    // Directions that the parameters share make up for nothing twice.
    let eigen = gram.symmetric_eigen();
    let told = eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()).filter(|(value, _)| **value > SHARED);
    let made_up: f64 = told.map(|(value, direction)| direction.dot(&right).powi(2) / value).sum();
    (square - made_up).max(0.0)
}

/// Share of the squares below which a direction of the parameters is none of its own.
const SHARED: f64 = 1e-9;

#[cfg(test)]
mod tests {
    use super::*;

    /// Regression by hand: three columns in four measurements.
    #[test]
    fn what_is_left_is_the_residual_of_least_squares() {
        let columns = [[1.0, 2.0, 0.0, -1.0], [1.0, 1.0, 1.0, 1.0], [0.0, 1.0, 0.0, 0.0]];
        let mut normal = Normal::empty(3);
        for (a, one) in columns.iter().enumerate() {
            for (b, other) in columns.iter().enumerate() {
                normal.gram[3 * a + b] = one.iter().zip(other).map(|(x, y)| x * y).sum();
            }
        }
        // The first clear of its mean 1/2.
        assert!((left(&normal, &[(0, 1.0)], &[1]) - (0.25 + 2.25 + 0.25 + 2.25)).abs() < 1e-12);
        // Clear of the third as well: (1, 0, -1) about its mean 0.
        assert!((left(&normal, &[(0, 1.0)], &[1, 2]) - 2.0).abs() < 1e-12);
        // A column given twice makes up for no more.
        assert!((left(&normal, &[(0, 1.0)], &[1, 2, 1]) - 2.0).abs() < 1e-12);
        assert!((left(&normal, &[(0, 1.0), (2, -2.0)], &[]) - 2.0).abs() < 1e-12);
    }
}
