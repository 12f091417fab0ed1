//! Trajectories, sizes of the random parts, and parameters of a model, estimated from trials.

use cdpr::integrator::RadauError;
use cdpr::model_file::Model;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::clean::{median, noise_by_differences};
use crate::data::{Channel, Trial};
use crate::kalman::{Filtered, Normal, Randomness, filter, smooth, whiten};
use crate::model::{Examined, LATENTS};
use crate::path::{LinearTrial, Trajectory, linearise};
use crate::signature;

/// Correlation time of the latent disturbances (s): longer than the cables' vibration, shorter than the platform's motion.
const LATENT_TIME: f64 = 2.0;

/// Smallest latent force considered (N): below it a trial is as good as undisturbed.
pub(crate) const SMALLEST_LATENT: f64 = 0.03;

/// A model with everything that the data say of it.
#[derive(Clone)]
pub(crate) struct Fit {
    pub(crate) model: Model,
    pub(crate) examined: Examined,
    pub(crate) first: Vec<Vec<f64>>,
    pub(crate) trajectories: Vec<Trajectory>,
    pub(crate) linear: Vec<LinearTrial>,
    pub(crate) randomness: Randomness,
}

/// Noise of each channel of [`Channel::all`], pooled over trials, from the data alone; `NAN` where it is not measured.
pub(crate) fn noise_of_data(trials: &[Trial]) -> Vec<f64> {
    Channel::all()
        .iter()
        .map(|channel| {
            let of_trial = |t: &Trial| t.channels.iter().position(|c| c == channel).map(|j| noise_by_differences(t, j));
            let noise = median(trials.iter().filter_map(of_trial).collect());
            if noise.is_nan() { noise } else { noise.max(channel.noise_floor()) }
        })
        .collect()
}

/// `randomness` with its noise in the order of this trial's channels.
pub(crate) fn for_trial(randomness: &Randomness, trial: &Trial) -> Randomness {
    let all = Channel::all();
    let noise = trial
        .channels
        .iter()
        .map(|c| all.iter().position(|a| a == c).map_or(f64::NAN, |at| randomness.noise[at]))
        .collect();
    Randomness { noise, ..randomness.clone() }
}

/// A first trajectory from measurements alone: pose by a local straight line, cables at rest under their commands.
fn first_trajectory(model: &Examined, trial: &Trial, first: &[f64]) -> Trajectory {
    let n = model.states();
    let width = n + LATENTS;
    let len = trial.len();
    let half = ((0.25 / trial.interval()).round() as usize).max(2);
    let column = |wanted: Channel| trial.channels.iter().position(|c| *c == wanted);
    let mut values = vec![0.0; len * width];
    // Value and slope of a straight line through the samples around k; the last known value where there are too few.
    let line = |j: usize, k: usize| -> Option<(f64, f64)> {
        let (mut s, mut st, mut stt, mut sv, mut stv) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for i in k.saturating_sub(half)..(k + half + 1).min(len) {
            let v = trial.measured[i][j];
            if v.is_finite() {
                let t = trial.time[i] - trial.time[k];
                s += 1.0;
                st += t;
                stt += t * t;
                sv += v;
                stv += t * v;
            }
        }
        let determinant = s * stt - st * st;
        (s >= 3.0 && determinant > 0.0)
            .then(|| ((stt * sv - st * stv) / determinant, (s * stv - st * sv) / determinant))
    };
    let pose_measured = (0..3).all(|k| column(Channel::Pose(k)).is_some());
    let mut last = first.to_vec();
    for k in 0..len {
        let row = &mut values[k * width..(k + 1) * width];
        row[..n].copy_from_slice(&last);
        if pose_measured {
            for axis in 0..3 {
                if let Some((value, slope)) = column(Channel::Pose(axis)).and_then(|j| line(j, k)) {
                    row[axis] = value;
                    row[3 + axis] = slope;
                }
            }
        } else {
            let window = trial.part(k.saturating_sub(half)..(k + half + 1).min(len), String::new());
            let start = model.first_states(&window);
            row[..3].copy_from_slice(&start[..3]);
        }
        let pose = [row[0], row[1], row[2]];
        let twist = [row[3], row[4], row[5]];
        let cables = cdpr::kinematics::cables(model.plant.geometry(), &pose, &twist);
        for i in 0..4 {
            let Some(at) = model.plant.unstretched_index(i) else { continue };
            let tension = trial.inputs[k].winch_force[i].max(0.0);
            let range = model.plant.effect_states(i);
            let mut states = [0.0; cdpr::dynamics::MAX_EFFECT_STATES];
            states[..range.len()].copy_from_slice(&row[range]);
            row[at] = model.plant.unstretched_length_for(i, trial.time[k], cables[i].length, tension, &states);
            if let Some(rate) = model.plant.rate_index(i) {
                row[rate] = cables[i].speed;
            }
        }
        last.copy_from_slice(&row[..n]);
    }
    Trajectory { values, width }
}

/// A new model on trajectories of an old one: states of the same name are taken over, new ones start at rest.
pub(crate) fn carry_over(old: &Examined, new: &Examined, trial: &Trial, trajectory: &Trajectory) -> Trajectory {
    if old.states() == new.states() {
        return trajectory.clone();
    }
    let n = new.states();
    let width = n + LATENTS;
    let first = new.first_states(trial);
    let mut values = vec![0.0; trial.len() * width];
    let fresh = first_trajectory(new, trial, &first);
    for k in 0..trial.len() {
        let row = &mut values[k * width..(k + 1) * width];
        row.copy_from_slice(fresh.row(k));
        let from = trajectory.states(k);
        row[..6].copy_from_slice(&from[..6]);
        for i in 0..4 {
            if let (Some(a), Some(b)) = (old.plant.unstretched_index(i), new.plant.unstretched_index(i)) {
                row[b] = from[a];
            }
            if let (Some(a), Some(b)) = (old.plant.rate_index(i), new.plant.rate_index(i)) {
                row[b] = from[a];
            }
        }
        row[n..].copy_from_slice(trajectory.latents(k));
    }
    Trajectory { values, width }
}

impl Fit {
    /// Fits trajectories of `model` to `trials`, beginning with `before` (another model's) or from measurements alone.
    pub(crate) fn new(
        model: &Model,
        trials: &[Trial],
        randomness: &Randomness,
        before: Option<&Fit>,
    ) -> Result<Self, FitError> {
        let examined = Examined::new(model).map_err(|e| FitError::Model(e.to_string()))?;
        let first: Vec<Vec<f64>> = trials.iter().map(|t| examined.first_states(t)).collect();
        let trajectories = trials
            .iter()
            .enumerate()
            .map(|(t, trial)| match before {
                Some(fit) => carry_over(&fit.examined, &examined, trial, &fit.trajectories[t]),
                None => first_trajectory(&examined, trial, &first[t]),
            })
            .collect();
        let mut fit = Self {
            model: model.clone(),
            examined,
            first,
            trajectories,
            linear: Vec::new(),
            randomness: randomness.clone(),
        };
        fit.linearise(trials)?;
        Ok(fit)
    }

    /// Linearises anew along the present trajectories.
    pub(crate) fn linearise(&mut self, trials: &[Trial]) -> Result<(), FitError> {
        self.linear = trials
            .par_iter()
            .enumerate()
            .map(|(t, trial)| linearise(&self.examined, trial, &self.trajectories[t], &self.first[t]))
            .collect::<Result<_, _>>()
            .map_err(FitError::Simulation)?;
        Ok(())
    }

    /// Moves the trajectories to the smoothed states and linearises there.
    pub(crate) fn smooth(&mut self, trials: &[Trial]) -> Result<(), FitError> {
        let moves: Vec<Vec<f64>> = (0..trials.len())
            .into_par_iter()
            .map(|t| {
                let randomness = for_trial(&self.randomness, &trials[t]);
                let filtered = filter(&self.linear[t], &randomness, true);
                smooth(&self.linear[t], &randomness, &filtered).deviation
            })
            .collect();
        for (trajectory, deviation) in self.trajectories.iter_mut().zip(&moves) {
            for (value, move_) in trajectory.values.iter_mut().zip(deviation) {
                *value += move_;
            }
        }
        self.linearise(trials)
    }

    pub(crate) fn filter(&self, trials: &[Trial], randomness: &Randomness) -> Vec<Filtered> {
        (0..trials.len())
            .into_par_iter()
            .map(|t| filter(&self.linear[t], &for_trial(randomness, &trials[t]), false))
            .collect()
    }

    pub(crate) fn minus_two_log_likelihood(&self, trials: &[Trial], randomness: &Randomness) -> f64 {
        self.filter(trials, randomness).iter().map(|f| f.minus_two_log_likelihood).sum()
    }

    /// Sizes of latent forces (and noise) by maximum likelihood: none at all if that is better, else a coordinate search
    /// on a logarithmic grid.
    pub(crate) fn fit_randomness(&mut self, trials: &[Trial], noise: &[f64], coarse: bool) {
        let mut best = self.randomness.clone();
        let mut value = self.minus_two_log_likelihood(trials, &best);
        let nothing = Randomness { force: SMALLEST_LATENT, winch: SMALLEST_LATENT, ..best.clone() };
        if best != nothing {
            let at_nothing = self.minus_two_log_likelihood(trials, &nothing);
            if at_nothing < value {
                (best, value) = (nothing.clone(), at_nothing);
            }
        }
        // From nothing, one step up on each axis tells whether there is anything.
        let factors: &[f64] = if coarse { &[10.0, 3.0] } else { &[3.0] };
        for &factor in factors {
            for axis in 0..2 {
                for direction in [1.0 / factor, factor] {
                    loop {
                        let mut trial = best.clone();
                        let slot = if axis == 0 { &mut trial.force } else { &mut trial.winch };
                        let next = (*slot * direction).clamp(SMALLEST_LATENT, 1e5);
                        if next == *slot {
                            break;
                        }
                        *slot = next;
                        let candidate = self.minus_two_log_likelihood(trials, &trial);
                        if candidate >= value - 0.5 {
                            break;
                        }
                        (best, value) = (trial, candidate);
                    }
                }
            }
            if best == nothing {
                break;
            }
        }
        self.randomness = best;
        self.fit_noise(trials, noise);
    }

    /// Noise by maximum likelihood, held near what the data alone say: differences see too much where the signal itself
    /// is rough, and never too little.
    fn fit_noise(&mut self, trials: &[Trial], noise: &[f64]) {
        let filtered = self.filter(trials, &self.randomness);
        for (at, channel) in Channel::all().iter().enumerate() {
            let (mut sum, mut count) = (0.0, 0);
            for (trial, f) in trials.iter().zip(&filtered) {
                if let Some(j) = trial.channels.iter().position(|c| c == channel) {
                    sum += f.noise_moment[j].0;
                    count += f.noise_moment[j].1;
                }
            }
            if count > 0 {
                let fitted = (sum / count as f64).sqrt();
                self.randomness.noise[at] = fitted.clamp(0.3 * noise[at], 1.05 * noise[at]).max(channel.noise_floor());
            }
        }
    }
}

/// Why a model cannot be fitted.
#[derive(Debug, thiserror::Error)]
pub enum FitError {
    /// The model cannot be built.
    #[error("the model cannot be built: {0}")]
    Model(String),
    /// The model cannot be simulated along the data.
    #[error("the model cannot be simulated along the data: {0}")]
    Simulation(RadauError),
}

/// First guess of the random parts, before any fit.
pub(crate) fn first_randomness(model: &Model, noise: &[f64]) -> Randomness {
    Randomness {
        force: 30.0,
        winch: 30.0,
        arm: model.parameters.attachment_radius.max(1.0),
        time: LATENT_TIME,
        noise: noise.to_vec(),
    }
}

/// A parameter of the model that is estimated: effect index and parameter index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Free {
    pub(crate) effect: usize,
    pub(crate) parameter: usize,
}

/// Estimates with their covariance.
#[derive(Clone, Debug)]
pub(crate) struct Estimate {
    pub(crate) free: Vec<Free>,
    /// Standard errors, in the order of `free`; infinite where the data say nothing.
    pub(crate) standard_error: Vec<f64>,
    /// Wald statistic of each effect: how far its size is from zero, as a chi-square.
    pub(crate) wald: Vec<f64>,
}

/// Parameters of the model's effects from index `first` on.
pub(crate) fn free_parameters(model: &Model, first: usize) -> Vec<Free> {
    let mut free = Vec::new();
    for (effect, spec) in model.effects.iter().enumerate().skip(first) {
        free.extend((0..spec.values.len()).map(|parameter| Free { effect, parameter }));
    }
    free
}

/// Step for differences in a parameter.
fn parameter_step(model: &Model, free: Free) -> f64 {
    let spec = &model.effects[free.effect];
    let typical = spec.info().map_or((0.0, 1.0), |i| i.parameters[free.parameter].typical);
    let scale = typical.0.abs().max(typical.1.abs());
    let scale = if scale > 0.0 { scale } else { 1.0 };
    1e-3 * spec.values[free.parameter].abs().max(1e-2 * scale)
}

/// Models with each free parameter moved by its step, away from its bounds.
fn varied_models(model: &Model, free: &[Free]) -> Vec<Option<(Examined, f64)>> {
    free.iter()
        .map(|f| {
            let step = parameter_step(model, *f);
            [step, -step].into_iter().find_map(|step| {
                let mut varied = model.clone();
                varied.effects[f.effect].values[f.parameter] += step;
                varied.effects[f.effect].check().ok()?;
                Some((Examined::new(&varied).ok()?, step))
            })
        })
        .collect()
}

/// Normal equations of the free parameters.
pub(crate) fn parameter_normal(fit: &Fit, trials: &[Trial], free: &[Free]) -> (Normal, Vec<usize>) {
    let varied = varied_models(&fit.model, free);
    let usable: Vec<usize> = (0..free.len()).filter(|i| varied[*i].is_some()).collect();
    let varied: Vec<(Examined, f64)> = varied.into_iter().flatten().collect();
    let mut normal = Normal::empty(usable.len());
    let parts: Vec<Normal> = (0..trials.len())
        .into_par_iter()
        .map(|t| {
            let forcing = signature::difference(&fit.examined, &varied, &trials[t], &fit.trajectories[t]);
            let randomness = for_trial(&fit.randomness, &trials[t]);
            let filtered = filter(&fit.linear[t], &randomness, false);
            whiten(&fit.linear[t], &randomness, &filtered, &forcing, None)
        })
        .collect();
    parts.iter().for_each(|part| normal.add(part));
    (normal, usable)
}

/// Refines the parameters of the effects from `first` on by Gauss-Newton on the innovations.
pub(crate) fn refine(
    fit: &mut Fit,
    trials: &[Trial],
    noise: &[f64],
    first: usize,
    rounds: usize,
) -> Result<Estimate, FitError> {
    let free = free_parameters(&fit.model, first);
    let mut estimate = None;
    for round in 0..rounds {
        let (normal, usable) = parameter_normal(fit, trials, &free);
        let solved = solve(&normal);
        estimate = Some(to_estimate(&fit.model, &free, &usable, &normal, &solved));
        if round + 1 == rounds {
            break;
        }
        let start = fit.minus_two_log_likelihood(trials, &fit.randomness);
        let mut damping = 1.0;
        let mut moved = false;
        for _ in 0..5 {
            let mut model = fit.model.clone();
            for (slot, at) in usable.iter().enumerate() {
                move_parameter(&mut model, free[*at], damping * solved.0[slot]);
            }
            if model.effects.iter().all(|e| e.check().is_ok())
                && let Ok(next) = Fit::new(&model, trials, &fit.randomness, Some(fit))
                && next.minus_two_log_likelihood(trials, &next.randomness) < start + 0.1
            {
                *fit = next;
                moved = true;
                break;
            }
            damping *= 0.3;
        }
        if !moved {
            break;
        }
        // The signatures are taken along the trajectory, and that gets better with the parameters.
        fit.smooth(trials)?;
        fit.fit_randomness(trials, noise, round == 0);
        let step = usable.iter().enumerate().all(|(slot, at)| {
            let se = normal_error(&solved.1, slot);
            let _ = at;
            (solved.0[slot] / se).abs() < 0.05
        });
        if step {
            break;
        }
    }
    Ok(estimate.unwrap_or_else(|| Estimate { free, standard_error: Vec::new(), wald: Vec::new() }))
}

fn normal_error(covariance: &DMatrix<f64>, slot: usize) -> f64 {
    covariance[(slot, slot)].max(0.0).sqrt().max(1e-300)
}

/// Moves one parameter, at most by its own size a step, within its bounds.
fn move_parameter(model: &mut Model, free: Free, change: f64) {
    let spec = &mut model.effects[free.effect];
    let Ok(info) = spec.info() else { return };
    let id = spec.id.clone();
    let parameter = &info.parameters[free.parameter];
    let value = &mut spec.values[free.parameter];
    let before = *value;
    let angle = parameter.unit == "rad";
    let size = value.abs().max(0.05 * parameter.typical.1.abs()).max(1e-12);
    let limit = if angle { 0.5 } else { size };
    *value = (*value + change.clamp(-limit, limit)).clamp(parameter.min, parameter.max);
    let (low, high) = parameter.typical;
    if !is_size(&id, free.parameter) && low > 0.0 {
        // Shapes stay where the law is itself, and change at most fourfold a step.
        *value = value.clamp(0.25 * before, 4.0 * before).clamp(0.1 * low, 10.0 * high);
    } else if parameter.min == 0.0 {
        *value = value.max(1e-6 * size);
    }
}

/// Least squares by scaled Cholesky; columns that say nothing get zero.
pub(crate) fn solve(normal: &Normal) -> (Vec<f64>, DMatrix<f64>) {
    let n = normal.columns;
    let scale: Vec<f64> = (0..n).map(|i| normal.gram[i * n + i].sqrt()).collect();
    let live: Vec<usize> = (0..n).filter(|i| scale[*i] > 1e-9).collect();
    let mut out = vec![0.0; n];
    let mut covariance = DMatrix::from_diagonal_element(n, n, f64::INFINITY);
    for i in 0..n {
        for j in 0..n {
            if i != j {
                covariance[(i, j)] = 0.0;
            }
        }
    }
    let k = live.len();
    if k == 0 {
        return (out, covariance);
    }
    let g = DMatrix::from_fn(k, k, |r, c| {
        normal.gram[live[r] * n + live[c]] / (scale[live[r]] * scale[live[c]]) + if r == c { 1e-10 } else { 0.0 }
    });
    let b = DVector::from_fn(k, |r, _| normal.right[live[r]] / scale[live[r]]);
    if let Some(cholesky) = g.cholesky() {
        let x = cholesky.solve(&b);
        let inverse = cholesky.inverse();
        for r in 0..k {
            out[live[r]] = x[r] / scale[live[r]];
            for c in 0..k {
                covariance[(live[r], live[c])] = inverse[(r, c)] / (scale[live[r]] * scale[live[c]]);
            }
        }
    }
    (out, covariance)
}

/// Standard errors, widened where the innovations are larger than the model says.
fn to_estimate(
    model: &Model,
    free: &[Free],
    usable: &[usize],
    normal: &Normal,
    solved: &(Vec<f64>, DMatrix<f64>),
) -> Estimate {
    let spread = (normal.total / normal.count.max(1) as f64).max(1.0).sqrt();
    let mut standard_error = vec![f64::INFINITY; free.len()];
    for (slot, at) in usable.iter().enumerate() {
        standard_error[*at] = spread * normal_error(&solved.1, slot);
    }
    let wald = (0..model.effects.len())
        .map(|effect| {
            // The parameters that are zero when the effect is absent carry its size; shapes do not.
            let slots: Vec<(usize, f64)> = usable
                .iter()
                .enumerate()
                .filter(|(_, at)| {
                    free[**at].effect == effect && is_size(&model.effects[effect].id, free[**at].parameter)
                })
                .map(|(slot, at)| (slot, model.effects[effect].values[free[*at].parameter]))
                .filter(|(slot, _)| solved.1[(*slot, *slot)].is_finite())
                .collect();
            if slots.is_empty() {
                return f64::NAN;
            }
            let v = DMatrix::from_fn(slots.len(), slots.len(), |r, c| solved.1[(slots[r].0, slots[c].0)]);
            let x = DVector::from_fn(slots.len(), |r, _| slots[r].1);
            v.clone().try_inverse().map_or(f64::NAN, |i| (x.transpose() * i * &x)[(0, 0)]) / (spread * spread)
        })
        .collect();
    Estimate { free: free.to_vec(), standard_error, wald }
}

/// Whether a parameter is zero when its effect is absent.
pub(crate) fn is_size(id: &str, parameter: usize) -> bool {
    match id {
        "winch_coulomb_friction"
        | "cable_thermal_expansion"
        | "periodic_gust"
        | "platform_quadratic_drag"
        | "cable_sag"
        | "umbilical" => parameter == 0,
        "winch_stribeck_friction" => parameter < 2,
        "cable_creep" | "winch_saturation" | "cable_elasticity" => false,
        _ => true,
    }
}
