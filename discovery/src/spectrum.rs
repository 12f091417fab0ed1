//! Frequencies and lengths at which the latent forces repeat.

use std::f64::consts::TAU;

use crate::data::Trial;
use crate::estimate::Fit;

/// Angle (rad) that an oscillation may turn in the latents' correlation time for them to follow it.
const FOLLOWED: f64 = 24.0;
/// Share of that time from one sample that is looked at to the next.
const OFTEN: f64 = 0.05;
/// Most frequencies that are looked at.
const MOST_FREQUENCIES: usize = 6000;
/// Peaks offered as candidates.
const PEAKS: usize = 3;

/// Frequencies (rad/s) of the highest peaks of the latent force and torque, from their periodograms over all trials.
pub(crate) fn peaks(fit: &Fit, trials: &[Trial]) -> Vec<f64> {
    let longest = trials.iter().map(|t| t.time[t.len() - 1] - t.time[0]).fold(0.0, f64::max);
    let interval = trials.iter().map(Trial::interval).fold(f64::INFINITY, f64::min);
    if longest <= 0.0 {
        return Vec::new();
    }
    // A third of the width of a spectral line, up to where the correlation time of the latents still lets them follow.
    let (time, arm) = (fit.randomness.time, fit.randomness.arm);
    let spacing = TAU / longest / 3.0;
    let highest = (TAU / (4.0 * interval)).min(FOLLOWED / time);
    let count = ((highest / spacing) as usize).min(MOST_FREQUENCIES);
    let stride = ((OFTEN * time / interval) as usize).max(1);
    let power: Vec<f64> = (3..count)
        .map(|f| {
            let omega = f as f64 * spacing;
            let mut sum = 0.0;
            for (trial, trajectory) in trials.iter().zip(&fit.trajectories) {
                for (axis, weight) in [(0, 1.0), (1, 1.0), (2, 1.0 / arm)] {
                    let (mut c, mut s) = (0.0, 0.0);
                    for k in (0..trial.len()).step_by(stride) {
                        let (sin, cos) = (omega * trial.time[k]).sin_cos();
                        let force = weight * trajectory.latents(k)[axis];
                        c += force * cos;
                        s += force * sin;
                    }
                    sum += c * c + s * s;
                }
            }
            // Latents are a red process; a peak stands out against that.
            sum * (1.0 + (omega * time).powi(2))
        })
        .collect();
    let mut local: Vec<(f64, f64)> = (1..power.len().saturating_sub(1))
        .filter(|k| power[*k] > power[k - 1] && power[*k] >= power[k + 1])
        .map(|k| ((k + 3) as f64 * spacing, power[k]))
        .collect();
    local.sort_by(|a, b| b.1.total_cmp(&a.1));
    let mut out: Vec<f64> = Vec::new();
    for (omega, _) in local {
        if out.iter().all(|o| (o - omega).abs() > 4.0 * spacing) {
            out.push(omega);
        }
        if out.len() == PEAKS {
            break;
        }
    }
    out
}

/// A length (or time) at which a latent force repeats, as the coordinate it depends on moves.
#[derive(Clone, Debug)]
pub(crate) struct Wave {
    /// The latent: axis of the platform, or 3 and the cable's index.
    pub(crate) latent: usize,
    /// Name of the coordinate in an expression.
    pub(crate) coordinate: String,
    /// Wave number (rad per unit of the coordinate).
    pub(crate) number: f64,
    /// Middle of the coordinate's range, from which the phase counts, and half of the range.
    pub(crate) middle: f64,
    pub(crate) half_range: f64,
}

/// The most prominent wave of each latent force over each coordinate that it may depend on: platform forces over the
/// platform's position, a winch's force over what the winch has paid out.
pub(crate) fn waves(fit: &Fit, trials: &[Trial]) -> Vec<Wave> {
    let plant = &fit.examined.plant;
    let mut pairs: Vec<(usize, usize, String)> = Vec::new();
    for latent in 0..3 {
        pairs.push((latent, 0, "x".to_owned()));
        pairs.push((latent, 1, "y".to_owned()));
    }
    for cable in 0..plant.cables() {
        if let Some(at) = plant.unstretched_index(cable) {
            pairs.push((3 + cable, at, format!("unstretched_length[{}]", cable + 1)));
        }
    }
    let interval = trials.iter().map(Trial::interval).fold(f64::INFINITY, f64::min);
    let stride = ((OFTEN * fit.randomness.time / interval) as usize).max(1);
    let wave = |(latent, at, coordinate): (usize, usize, String)| {
        // Position and force as often as they change, over all trials.
        let points: Vec<(f64, f64)> = trials
            .iter()
            .zip(&fit.trajectories)
            .flat_map(|(trial, trajectory)| {
                (0..trial.len()).step_by(stride).map(move |k| (trajectory.states(k)[at], trajectory.latents(k)[latent]))
            })
            .collect();
        let (low, high) = points.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), p| (a.min(p.0), b.max(p.0)));
        let spacing = TAU / (high - low) / 3.0;
        if !spacing.is_finite() {
            return None;
        }
        let power = |number: f64| {
            let (mut c, mut s) = (0.0, 0.0);
            for (position, force) in &points {
                let (sin, cos) = (number * (position - low)).sin_cos();
                c += force * cos;
                s += force * sin;
            }
            c * c + s * s
        };
        // From waves that pass once over the range to forty.
        let powers: Vec<f64> = (3..120).map(|k| power(k as f64 * spacing)).collect();
        let k = (1..powers.len() - 1)
            .filter(|k| powers[*k] > powers[k - 1] && powers[*k] >= powers[k + 1])
            .max_by(|a, b| powers[*a].total_cmp(&powers[*b]))?;
        // The vertex of the parabola through the peak and its neighbours.
        let (before, peak, after) = (powers[k - 1], powers[k], powers[k + 1]);
        let shift = 0.5 * (before - after) / (before - 2.0 * peak + after);
        let number = ((k + 3) as f64 + shift) * spacing;
        let middle = format!("{:.1}", 0.5 * (low + high)).parse().ok()?;
        Some(Wave { latent, coordinate, number, middle, half_range: 0.5 * (high - low) })
    };
    pairs.into_iter().filter_map(wave).collect()
}
