//! How much is left, in units that a machine's owner knows.

use cdpr::kinematics::cables;

use crate::data::{Channel, Trial};
use crate::filter::estimate::Fit;
use crate::outcome::Remaining;
use crate::verdict::gap::{Prediction, predict};

/// What is left over `horizon` (s) on `trials`: by how much free runs miss, without the noise, and the mean force over so
/// long that the model needs beyond its own.
pub(crate) fn remaining(fit: &Fit, trials: &[Trial], noise: &[f64], horizon: f64) -> Remaining {
    let predictions = predict(fit, trials, horizon);
    let miss = |wanted: &dyn Fn(Channel) -> bool| missed(trials, &predictions, noise, wanted);
    let [force, torque] = mean_wrench(fit, trials, horizon);
    Remaining {
        horizon,
        position: miss(&|c| matches!(c, Channel::Pose(0 | 1))),
        rotation: miss(&|c| c == Channel::Pose(2)),
        length: miss(&|c| matches!(c, Channel::CableLength(_) | Channel::UnstretchedLength(_))),
        force,
        torque,
    }
}

/// Root mean square by which predictions of some channels miss, the noise taken off; `None` where none is measured.
fn missed(
    trials: &[Trial],
    predictions: &[Prediction],
    noise: &[f64],
    wanted: &dyn Fn(Channel) -> bool,
) -> Option<f64> {
    let all = Channel::all(trials.first().map_or(0, Trial::cables));
    let (mut sum, mut count) = (0.0, 0);
    for (trial, prediction) in trials.iter().zip(predictions) {
        for (j, channel) in trial.channels.iter().enumerate().filter(|(_, c)| wanted(**c)) {
            let variance = all.iter().position(|c| c == channel).map_or(0.0, |at| noise[at].powi(2));
            for k in (0..trial.len()).filter(|k| !prediction.is_restart(*k)) {
                let miss = prediction.shown[k][j] - trial.measured[k][j];
                if miss.is_finite() {
                    sum += miss * miss - variance;
                    count += 1;
                }
            }
        }
    }
    (count > 0).then(|| (sum / f64::from(count)).max(0.0).sqrt())
}

/// Root mean square of the latent wrench on the platform, that of the winches' latent pulls with it, as a mean over each
/// stretch of `horizon` (s): force (N) and torque (N m).
fn mean_wrench(fit: &Fit, trials: &[Trial], horizon: f64) -> [f64; 2] {
    let (mut squares, mut stretches) = ([0.0; 2], 0);
    for (trial, trajectory) in trials.iter().zip(&fit.trajectories) {
        let (mut sum, mut count, mut end) = ([0.0; 3], 0, trial.time[0] + horizon);
        for k in 0..trial.len() {
            if trial.time[k] >= end || k + 1 == trial.len() {
                let mean = sum.map(|s: f64| s / f64::from(count.max(1)));
                squares[0] += mean[0].powi(2) + mean[1].powi(2);
                squares[1] += mean[2].powi(2);
                stretches += 1;
                (sum, count) = ([0.0; 3], 0);
                while end <= trial.time[k] {
                    end += horizon;
                }
            }
            let (y, latents) = (trajectory.states(k), trajectory.latents(k));
            let (wrench, pulls) = latents.split_at(3);
            let at = cables(fit.examined.plant.geometry(), &[y[0], y[1], y[2]], &[y[3], y[4], y[5]]);
            for (axis, slot) in sum.iter_mut().enumerate() {
                // A pull shortens its cable.
                let pulled: f64 = at.iter().zip(pulls).map(|(cable, pull)| -pull * cable.jacobian_row()[axis]).sum();
                *slot += wrench[axis] + pulled;
            }
            count += 1;
        }
    }
    squares.map(|square| (square / f64::from(stretches.max(1))).sqrt())
}
