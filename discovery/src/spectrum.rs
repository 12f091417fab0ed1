//! Frequencies at which the latent forces on the platform have peaks.

use std::f64::consts::TAU;

use crate::data::Trial;
use crate::estimate::Fit;

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
    let spacing = TAU / longest / 3.0;
    let highest = (TAU / (4.0 * interval)).min(12.0);
    let count = (highest / spacing) as usize;
    let stride = ((0.1 / interval) as usize).max(1);
    let power: Vec<f64> = (3..count)
        .map(|f| {
            let omega = f as f64 * spacing;
            let mut sum = 0.0;
            for (trial, trajectory) in trials.iter().zip(&fit.trajectories) {
                for (axis, weight) in [(0, 1.0), (1, 1.0), (2, 0.1)] {
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
            sum * (1.0 + (omega * 2.0).powi(2))
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
