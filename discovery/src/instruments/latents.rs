//! Sizes of the latent forces and of the noise, by maximum likelihood.

use cdpr::model_file::Model;
use rayon::prelude::*;

use crate::data::clean::median;
use crate::data::counts::least_noise;
use crate::data::{Channel, Trial};
use crate::filter::estimate::{Fit, Look};
use crate::filter::kalman::Randomness;
use crate::instruments::sizing::resize;
use crate::model::examined::WRENCH;
use crate::model::sizes::{Sizes, usual_force};

/// Correlation time of the latent disturbances in periods of the platform's swing on cables of fixed length: longer than the
/// cables' own vibration, shorter than the motions that a platform is asked for.
const LATENT_SWINGS: f64 = 1.12;
/// Its bounds, in sampling intervals and as a share of the longest recording.
const LATENT_TIMES: (f64, f64) = (4.0, 0.1);

/// Sizes of latent forces between none and the first, as shares of the first.
const BETWEEN: [f64; 2] = [0.1, 0.01];
/// Fall of `-2 log L` for which another size of the latent forces is taken.
const WORTH: f64 = 0.5;
/// The most that white noise can be where nothing else is random in the instruments, in multiples of what differences see: they
/// never see too little.
const MOST_NOISE: f64 = 1.05;
/// Most looks at white noise, each half as far from where it is as the one before.
const NOISE_TRIES: usize = 3;

impl Fit {
    /// Sizes of latent forces (and noise) by maximum likelihood: none at all if that is better, else a coordinate search
    /// on a logarithmic grid.
    pub(crate) fn fit_randomness(&mut self, trials: &[Trial], noise: &[f64], coarse: bool) {
        let nothing = self.randomness.without_latents();
        let present = self.randomness.clone();
        let mut sizes = vec![present.clone()];
        sizes.extend((!present.same_latents(&nothing)).then(|| nothing.clone()));
        let without = sizes.len();
        sizes.extend(BETWEEN.map(|share| nothing.with_latents(share)));
        let mut looks: Vec<Look> = sizes.into_par_iter().map(|size| self.look(trials, size)).collect();
        let between = looks.split_off(without);
        let mut best = looks.remove(0);
        if let Some(at_nothing) = looks.pop().filter(|at_nothing| at_nothing.value < best.value) {
            best = at_nothing;
        }
        // From nothing no step leads to a size that is worth having, past all those that are not.
        for between in between {
            if between.value < best.value - WORTH {
                best = between;
            }
        }
        // From nothing, one step up on each axis tells whether there is anything.
        let factors: &[f64] = if coarse { &[10.0, 3.0] } else { &[3.0] };
        for &factor in factors {
            best = self.search_latents(trials, best, &[1.0 / factor, factor]);
            if best.randomness.same_latents(&nothing) {
                break;
            }
        }
        self.fit_noise(trials, best);
        if self.randomness.has_instrument_noise() {
            self.randomness = resize(self, trials, noise);
        }
    }

    /// Sizes of latent forces alone by maximum likelihood.
    pub(crate) fn fit_latents(&mut self, trials: &[Trial]) {
        let present = self.look(trials, self.randomness.clone());
        let coarse = self.search_latents(trials, present, &[0.1, 10.0]);
        self.randomness = self.search_latents(trials, coarse, &[1.0 / 3.0, 3.0]).randomness;
    }

    /// As [`Fit::fit_randomness`] where the latent forces have been chosen but for being too small, with a run at these.
    pub(crate) fn enlarge_randomness(&mut self, trials: &[Trial], run: Look) {
        let best = self.search_latents(trials, run, &[3.0]);
        self.fit_noise(trials, best);
    }

    /// The best sizes of latent forces that are reached from a run by steps of these factors.
    fn search_latents(&self, trials: &[Trial], mut best: Look, factors: &[f64]) -> Look {
        for axis in 0..2 {
            for factor in factors {
                loop {
                    let mut next = best.randomness.clone();
                    if axis == 0 {
                        next.force = next.force_scaled(*factor);
                    } else {
                        next.winch = next.winch_scaled(*factor);
                    }
                    if next.same_latents(&best.randomness) {
                        break;
                    }
                    let candidate = self.look(trials, next);
                    if candidate.value >= best.value - WORTH {
                        break;
                    }
                    best = candidate;
                }
            }
        }
        best
    }

    /// White noise by maximum likelihood, at the sizes of a run, within its bounds: where nothing else is random in the
    /// instruments, what goes beyond those is the model's. Where something else is, moments do not tell the two apart: the noise
    /// goes as far towards them as the likelihood rises.
    fn fit_noise(&mut self, trials: &[Trial], run: Look) {
        let beside_others = run.randomness.has_instrument_noise();
        let mut fitted = run.randomness.clone();
        for (at, channel) in Channel::all(self.examined.plant.cables()).iter().enumerate() {
            let (mut sum, mut count) = (0.0, 0);
            for (trial, f) in trials.iter().zip(&run.filtered) {
                if let Some(j) = trial.channels.iter().position(|c| c == channel) {
                    sum += f.noise_moment[j].0;
                    count += f.noise_moment[j].1;
                }
            }
            if count > 0 {
                let moment = (sum.max(0.0) / count as f64).sqrt();
                fitted.noise[at] = fitted.bounded_noise(at, moment);
            }
        }
        if !beside_others {
            self.randomness = fitted;
            return;
        }
        let halfway = |fitted: &Randomness| {
            let noise = run.randomness.noise.iter().zip(&fitted.noise).map(|(from, to)| (from * to).sqrt());
            Randomness { noise: noise.collect(), ..fitted.clone() }
        };
        self.randomness = run.randomness.clone();
        for _ in 0..NOISE_TRIES {
            if self.minus_two_log_likelihood(trials, &fitted) < run.value {
                self.randomness = fitted;
                return;
            }
            fitted = halfway(&fitted);
        }
    }
}

/// First guess of the random parts, before any fit.
pub(crate) fn first_randomness(model: &Model, trials: &[Trial], noise: &[f64]) -> Randomness {
    let (sizes, usual_force) = (Sizes::of(&model.parameters), usual_force(trials));
    let duration = |t: &Trial| t.time[t.len() - 1] - t.time[0];
    let longest = LATENT_TIMES.1 * trials.iter().map(duration).fold(0.0, f64::max);
    let shortest = LATENT_TIMES.0 * median(trials.iter().map(Trial::interval).collect());
    let channels = Channel::all(model.parameters.cables());
    let least = |(channel, noise): (&Channel, &f64)| least_noise(trials, *channel, *noise);
    Randomness {
        latents: WRENCH + model.parameters.cables(),
        force: Randomness::first_latent(usual_force),
        winch: Randomness::first_latent(usual_force),
        usual_force,
        arm: sizes.arm,
        time: (LATENT_SWINGS * sizes.swing).min(longest).max(shortest),
        noise: noise.to_vec(),
        least_noise: channels.iter().zip(noise).map(least).collect(),
        most_noise: noise.iter().map(|noise| MOST_NOISE * noise).collect(),
        memory: Vec::new(),
        input: 0.0,
        expected: None,
        jitter: 0.0,
        late: vec![0.0; noise.len()],
    }
}
