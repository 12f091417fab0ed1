//! The smoother: back over what the filter has passed.

use std::ops::Range;

use super::{Filtered, Keep, Run, STRETCH};
use crate::filter::path::LinearTrial;
use crate::filter::vector::{add, dot, vectorised};
use crate::model::examined::WRENCH;
use crate::model::randomness::{ROOM, Randomness};

/// Smoothed deviations from the trajectory, `width` a sample, by the modified Bryson-Frazier recursion, and `-2 log L`.
///
/// G. J. Bierman, Fixed interval smoothing with discrete measurements, Int. J. Control 18 (1973). On the way there the filter
/// is only told where it stands now and then; what the smoother needs of the samples between it tells again on the way back.
pub(crate) fn smooth(linear: &LinearTrial, randomness: &Randomness) -> (Vec<f64>, f64) {
    let (n, estimated) = (linear.states, randomness.estimated());
    let (deviation, value) = smoothed(linear, randomness, 0..n + estimated);
    if estimated > 0 {
        return (deviation, value);
    }
    // The latents are none, whatever they were along the trajectory.
    let with_latents = |(k, row): (usize, &[f64])| -> Vec<f64> {
        row.iter().copied().chain(linear.latents(k).iter().map(|latent| -latent)).collect()
    };
    (deviation.chunks_exact(n).enumerate().flat_map(with_latents).collect(), value)
}

/// The smoothed noise with memory and other processes that move no state, all of them a sample.
pub(crate) fn smoothed_memory(linear: &LinearTrial, randomness: &Randomness) -> Vec<Vec<f64>> {
    let kept = linear.states + randomness.estimated()..linear.states + randomness.processes();
    if kept.is_empty() {
        return vec![Vec::new(); linear.len];
    }
    let (deviation, _) = smoothed(linear, randomness, kept.clone());
    deviation.chunks_exact(kept.len()).map(<[f64]>::to_vec).collect()
}

/// Some of the smoothed deviations of states and processes at each sample, and `-2 log L`.
fn smoothed(linear: &LinearTrial, randomness: &Randomness, kept: Range<usize>) -> (Vec<f64>, f64) {
    let mut run = Run::new(linear, randomness);
    let mut passed = Vec::new();
    while run.standing.next + STRETCH < linear.len {
        passed.push(run.standing.clone());
        run.advance(run.standing.next + STRETCH, Keep::Likelihood);
    }
    let mut deviation = vec![0.0; linear.len * kept.len()];
    let mut lambda = vec![0.0; linear.states + randomness.processes()];
    let mut back = |filtered: &Filtered| {
        let deviation = &mut deviation[filtered.first * kept.len()..];
        let lambda = &mut lambda;
        by_width!(linear, randomness, smooth_in, linear, randomness, filtered, lambda, deviation, &kept);
    };
    let last = run.advance(linear.len, Keep::Covariance);
    back(&last);
    for standing in passed.into_iter().rev() {
        let end = standing.next + STRETCH;
        back(&Run { linear, randomness, standing }.advance(end, Keep::Covariance));
    }
    (deviation, last.minus_two_log_likelihood)
}

/// Goes back over the samples of `filtered`, from what those after them say (`adjoint`) on.
#[inline(always)]
fn smooth_in<const N: usize, const W: usize, const FUSED: bool>(
    linear: &LinearTrial,
    randomness: &Randomness,
    filtered: &Filtered,
    adjoint: &mut [f64],
    deviation: &mut [f64],
    kept: &Range<usize>,
) {
    let (n, m) = (linear.states, linear.channels);
    let acting = n + randomness.estimated();
    let w = n + randomness.processes();
    let remembered = randomness.shown_by_channel(m);
    let (mut lambda, mut decay, mut columns) = ([0.0; W], [0.0; W], vec![[0.0; N]; linear.width()]);
    lambda[..w].copy_from_slice(adjoint);
    for sample in (0..filtered.whitened.len() / m).rev() {
        let k = filtered.first + sample;
        for j in (0..m).rev() {
            let at = sample * m + j;
            if !filtered.whitened[at].is_finite() {
                continue;
            }
            let factor = filtered.whitened[at] / filtered.deviation[at] + dot::<FUSED>(filtered.gain(at), &lambda);
            for (c, slope) in linear.shown_by(k, j) {
                lambda[c] -= slope * factor;
            }
            for l in remembered[j].clone() {
                lambda[n + l] -= factor;
            }
        }
        // The covariance is symmetric: its rows are its columns.
        let mut moved = filtered.predicted.as_chunks::<W>().0[sample];
        let covariance = &filtered.covariance.as_chunks::<W>().0[sample * w..(sample + 1) * w];
        for (row, value) in covariance.iter().zip(&lambda) {
            add::<FUSED>(&mut moved, -value, row);
        }
        deviation[sample * kept.len()..(sample + 1) * kept.len()].copy_from_slice(&moved[kept.clone()]);
        if k > 0 {
            linear.columns(k - 1, columns.as_flattened_mut());
            let mut back = [0.0; W];
            for (slot, column) in back.iter_mut().zip(&columns[..acting]) {
                *slot = dot::<FUSED>(column, &lambda[..N]);
            }
            let errors = w - randomness.force_errors()..w;
            (n + WRENCH..acting).cycle().zip(errors).for_each(|(winch, at)| back[at] = back[winch]);
            randomness.decays(linear.interval[k - 1], &mut decay[n..w]);
            for l in n..w {
                back[l] += decay[l] * lambda[l];
            }
            lambda = back;
        }
    }
    adjoint.copy_from_slice(&lambda[..w]);
}
