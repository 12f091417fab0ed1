//! One length by itself, with the geometry that suits it best.

use nalgebra::{DMatrix, DVector};

use super::super::solve::{HUBER, OUTLIER, ROUNDS, deviation};
use super::{Problem, Sample, Unknown};
use crate::data::Channel;

/// Samples that do for a length by itself.
const ENOUGH: usize = 500;
/// Share of what is left by which a step must lower it for another one.
const NO_BETTER: f64 = 1e-6;

impl Problem {
    /// The misfit of a length with the anchor, the attachment and the zero that suit it best by itself, root mean square, outliers
    /// clipped, in standard deviations of its noise and the pose's (Levenberg and Marquardt, with Huber's function).
    pub(in crate::calibrate) fn misfit_alone(&self, channel: Channel) -> f64 {
        let of_it = |unknown: &Unknown| match unknown {
            Unknown::Offset(other) => *other == channel,
            _ => {
                matches!(channel, Channel::CableLength(cable) | Channel::UnstretchedLength(cable) if unknown.cable() == cable)
            }
        };
        let own: Vec<usize> = (0..self.unknowns.len()).filter(|k| of_it(&self.unknowns[*k])).collect();
        let with_it: Vec<(&Sample, usize)> = self
            .samples
            .iter()
            .step_by(self.samples.len().div_ceil(ENOUGH))
            .filter_map(|sample| Some((sample, sample.lengths.iter().position(|length| length.channel == channel)?)))
            .collect();
        let look = |change: &DVector<f64>| -> Vec<(f64, DVector<f64>)> {
            let one = |(sample, row): &(&Sample, usize)| {
                let equations = self.equations_at(sample, &sample.pose, change);
                let deviation = equations.root.row(*row).norm();
                let slope = |k: &usize| equations.slopes[(*row, *k)] * self.plausible[*k] / deviation;
                (equations.residual[*row] / deviation, DVector::from_iterator(own.len(), own.iter().map(slope)))
            };
            with_it.iter().map(one).collect()
        };
        let scale_of = |rows: &[(f64, DVector<f64>)]| deviation(rows.iter().map(|(residual, _)| *residual)).max(1.0);
        let weight = |residual: f64, scale: f64| (HUBER * scale / residual.abs()).min(1.0);
        let cost = |rows: &[(f64, DVector<f64>)], scale: f64| -> f64 {
            let of = |residual: f64| weight(residual, scale) * (2.0 - weight(residual, scale)) * residual * residual;
            rows.iter().map(|(residual, _)| of(*residual)).sum()
        };
        let mut change = DVector::zeros(self.unknowns.len());
        let (mut now, mut damping) = (look(&change), 1.0);
        for _ in 0..ROUNDS {
            let scale = scale_of(&now);
            // A step of what is plausible costs as much as so many standard deviations of one number.
            let mut gram = DMatrix::identity(own.len(), own.len()) * damping;
            let mut right = DVector::zeros(own.len());
            for (residual, slopes) in &now {
                gram.ger(weight(*residual, scale), slopes, slopes, 1.0);
                right.axpy(weight(*residual, scale) * residual, slopes, 1.0);
            }
            let Some(solved) = gram.cholesky() else { break };
            let step = solved.solve(&right);
            let mut next = change.clone();
            own.iter().zip(step.iter()).for_each(|(k, step)| next[*k] += step * self.plausible[*k]);
            let then = look(&next);
            let [before, after] = [&now, &then].map(|rows| cost(rows, scale));
            if after < before {
                (change, now, damping) = (next, then, 0.1 * damping);
                if before - after < NO_BETTER * before {
                    break;
                }
            } else {
                damping *= 10.0;
            }
        }
        let now: Vec<f64> = now.into_iter().map(|(residual, _)| residual).collect();
        let scale = deviation(now.iter().copied());
        let clipped = now.iter().map(|residual| residual.clamp(-OUTLIER * scale, OUTLIER * scale).powi(2));
        (clipped.sum::<f64>() / now.len() as f64).sqrt()
    }
}
