//! Frequencies and lengths at which the latent forces repeat.

use std::f64::consts::TAU;

use nalgebra::{Matrix4, Vector4};
use rayon::prelude::*;

use crate::data::{Channel, Trial};
use crate::filter::estimate::Fit;
use crate::filter::path::Trajectory;
use crate::hypothesis::candidates::Wave;

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
        let (low, high) = range(&points);
        let power = |number: f64| {
            let (mut c, mut s) = (0.0, 0.0);
            for (position, force) in &points {
                let (sin, cos) = (number * (position - low)).sin_cos();
                c += force * cos;
                s += force * sin;
            }
            c * c + s * s
        };
        let number = strongest(spacing((low, high)), power)?;
        let middle = format!("{:.1}", 0.5 * (low + high)).parse().ok()?;
        Some(Wave { latent, coordinate, number, middle, half_range: 0.5 * (high - low) })
    };
    pairs.into_iter().filter_map(wave).collect()
}

/// The most prominent wave number (1/m) of each winch in what its measured length shows beside the fitted one, over the length
/// that is paid out; and that of all winches, had they the same.
pub(crate) fn drum_waves(fit: &Fit, trials: &[Trial]) -> (Vec<Option<f64>>, Option<f64>) {
    let plant = &fit.examined.plant;
    let deviations = |cable: usize| {
        let Some(at) = plant.unstretched_index(cable) else { return Vec::new() };
        let of_trial = |(trial, trajectory): (&Trial, &Trajectory)| -> Vec<(f64, f64)> {
            let channel = trial.channels.iter().position(|c| *c == Channel::UnstretchedLength(cable));
            let Some(j) = channel else { return Vec::new() };
            let both = (0..trial.len()).map(|k| (trial.measured[k][j], trajectory.states(k)[at]));
            both.filter(|(shown, _)| shown.is_finite()).map(|(shown, length)| (shown, shown - length)).collect()
        };
        trials.iter().zip(&fit.trajectories).flat_map(of_trial).collect()
    };
    let all: Vec<Vec<(f64, f64)>> = (0..plant.cables()).into_par_iter().map(deviations).collect();
    let each = all.par_iter().map(|points| drum_wave(points)).collect();
    let few: Vec<Vec<(f64, f64)>> = all.iter().map(|points| thinned(points)).collect();
    let spacing = spacing(range(&few.concat()));
    let power = |number: f64| few.iter().map(|points| Wavy::at(points, number).map_or(0.0, |w| w.explained)).sum();
    (each, strongest(spacing, power).map(|number| sharpened(number, spacing, power)))
}

/// The wave number of one winch. Where nothing is paid out the wave `e (cos(ν s + ψ) - cos ψ)` is zero, so its mean says the phase
/// there, but for the sign, and the number of turns since then is a whole one. Far out that is a comb of numbers, and a
/// refinement finds the one it starts at.
fn drum_wave(points: &[(f64, f64)]) -> Option<f64> {
    let spacing = spacing(range(points));
    let power = |points: &[(f64, f64)], number: f64| Wavy::at(points, number).map_or(0.0, |wavy| wavy.explained);
    let few = thinned(points);
    let about = strongest(spacing, |number| power(&few, number))?;
    let number = sharpened(about, spacing, |number| power(points, number));
    let Wavy { middle, mean, size, phase, .. } = Wavy::at(points, number)?;
    let first = (-mean / size).clamp(-1.0, 1.0).acos();
    let on_comb = [first, -first].map(|first| {
        let turns = ((number * middle - phase + first) / TAU).round();
        (phase - first + TAU * turns) / middle
    });
    let nearest = on_comb.into_iter().min_by(|a, b| (a - number).abs().total_cmp(&(b - number).abs()));
    nearest.filter(|near| (near - number).abs() < 0.5 * spacing).or(Some(number))
}

/// About a thousand of the points, of which a peak stands out as well.
fn thinned(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    points.iter().step_by((points.len() / 1000).max(1)).copied().collect()
}

/// A straight line and a wave of some number, nearest to values over a coordinate.
struct Wavy {
    /// Middle of the coordinate's range, and the line there.
    middle: f64,
    mean: f64,
    /// `size cos(number (x - middle) + phase)`.
    size: f64,
    phase: f64,
    /// Sum of squares that both take away.
    explained: f64,
}

impl Wavy {
    fn at(points: &[(f64, f64)], number: f64) -> Option<Self> {
        let (low, high) = range(points);
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        let (mut gram, mut right) = (Matrix4::zeros(), Vector4::zeros());
        for (position, value) in points {
            let (sin, cos) = (number * (position - middle)).sin_cos();
            let row = Vector4::new(1.0, (position - middle) / half, cos, sin);
            gram += row * row.transpose();
            right += row * *value;
        }
        let found = gram.cholesky()?.solve(&right);
        let (size, phase) = (found[2].hypot(found[3]), (-found[3]).atan2(found[2]));
        Some(Self { middle, mean: found[0], size, phase, explained: found.dot(&right) })
    }
}

/// Smallest and largest coordinate.
fn range(points: &[(f64, f64)]) -> (f64, f64) {
    points.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), p| (a.min(p.0), b.max(p.0)))
}

/// A third of the width of a spectral line over a range.
fn spacing((low, high): (f64, f64)) -> f64 {
    TAU / (high - low) / 3.0
}

/// The wave number of the highest peak, from waves that pass once over the range to forty.
fn strongest(spacing: f64, power: impl Fn(f64) -> f64) -> Option<f64> {
    if !(spacing.is_finite() && spacing > 0.0) {
        return None;
    }
    let powers: Vec<f64> = (3..120).map(|k| power(f64::from(k) * spacing)).collect();
    let k = (1..powers.len() - 1)
        .filter(|k| powers[*k] > powers[k - 1] && powers[*k] >= powers[k + 1])
        .max_by(|a, b| powers[*a].total_cmp(&powers[*b]))?;
    Some(((k + 3) as f64 + vertex([powers[k - 1], powers[k], powers[k + 1]])) * spacing)
}

/// The top of the peak near `number`, to a hundredth of `spacing`.
fn sharpened(mut number: f64, spacing: f64, power: impl Fn(f64) -> f64) -> f64 {
    let mut step = 0.3 * spacing;
    for _ in 0..4 {
        number += step * vertex([-1.0, 0.0, 1.0].map(|at| power(number + at * step))).clamp(-1.0, 1.0);
        step *= 0.4;
    }
    number
}

/// The vertex of the parabola through a peak and its neighbours, in steps from the peak; none where the three lie on a line.
fn vertex([before, peak, after]: [f64; 3]) -> f64 {
    let shift = 0.5 * (before - after) / (before - 2.0 * peak + after);
    if shift.is_finite() { shift } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use cdpr::effect::EffectSpec;

    use super::*;
    use crate::data::recording::{fitted, noise, record};

    /// A drum of 0.3 m was looked for at the radius of the model alone, 0.5 m, and found there.
    #[test]
    fn the_wave_of_a_drum_shows_its_radius_in_the_measured_length() {
        let hidden = [EffectSpec::new("winch_drum_eccentricity", Some(2), &[0.01, 0.1, 0.4]).unwrap()];
        let trials = [record(&hidden, 60.0, 31)];
        let (each, _) = drum_waves(&fitted(&[], &trials), &trials);
        let radius = 1.0 / each[1].expect("a wave");
        assert!((radius - 0.1).abs() < 2e-3, "{radius}");
    }

    /// A drum of 0.3 m came out as one of 0.296 m, six turns more since nothing was paid out.
    #[test]
    fn far_out_a_wave_number_is_one_of_a_comb() {
        let lengths = (0..3000).map(|k| 895.0 + 3e-3 * f64::from(k));
        let wave = |s: f64| 0.01 * ((s / 0.3 + 0.4).cos() - 0.4_f64.cos());
        let points: Vec<(f64, f64)> =
            lengths.zip(noise(3000, 5)).map(|(s, noise)| (s, wave(s) + 1e-3 * noise)).collect();
        let number = drum_wave(&points).expect("a wave");
        // The two signs of the phase lie 0.8 rad apart; the next tooth a turn.
        assert!((number - 1.0 / 0.3).abs() < 1.0 / 900.0, "{}", 1.0 / number);
        assert!(drum_wave(&points[..1]).is_none(), "one point has no wave");
    }
}
