//! Kalman filter and smoother on the linearised model.

use crate::model::LATENTS;
use crate::path::LinearTrial;
use crate::vector::{BLOCK, add, add_each, block, dot, vectorised};

/// Smallest latent force considered (N): below it a trial is as good as undisturbed.
pub(crate) const SMALLEST_LATENT: f64 = 0.03;

/// Sizes of what is random: latent disturbances (Ornstein-Uhlenbeck) and measurement noise.
#[derive(Clone, Debug)]
pub(crate) struct Randomness {
    /// Standard deviation of the latent force on the platform (N); the torque's is `arm` times as large.
    pub(crate) force: f64,
    /// Standard deviation of the latent force at each winch (N).
    pub(crate) winch: f64,
    /// Lever between force and torque (m).
    pub(crate) arm: f64,
    /// Correlation time (s).
    pub(crate) time: f64,
    /// Noise of each channel.
    pub(crate) noise: Vec<f64>,
}

impl Randomness {
    /// Whether the latent disturbances are of the same size.
    pub(crate) fn same_latents(&self, other: &Self) -> bool {
        (self.force, self.winch) == (other.force, other.winch)
    }

    /// Whether latent disturbances have anything to do.
    pub(crate) fn has_latents(&self) -> bool {
        self.force.max(self.winch) > SMALLEST_LATENT
    }

    pub(crate) fn latent_deviation(&self, latent: usize) -> f64 {
        match latent {
            0 | 1 => self.force,
            2 => self.force * self.arm,
            _ => self.winch,
        }
    }
}

/// Innovations, gains and what else later passes need; what was not to be kept is empty.
#[derive(Clone, Debug)]
pub(crate) struct Filtered {
    /// `Σ log S + ν²/S` over all measurements.
    pub(crate) minus_two_log_likelihood: f64,
    /// Innovation over its standard deviation, a number a measurement; `NAN` in gaps.
    pub(crate) whitened: Vec<f64>,
    /// Standard deviation of each innovation.
    pub(crate) deviation: Vec<f64>,
    /// Numbers of a row of what follows: states, latents, and zeros up to this.
    stride: usize,
    /// Gain of each measurement.
    gain: Vec<f64>,
    /// Predicted deviation before each sample's measurements.
    predicted: Vec<f64>,
    /// Deviation after each sample's measurements.
    updated: Vec<f64>,
    /// Its covariance before the measurements, a row a state or latent.
    covariance: Vec<f64>,
    /// `Σ e ν` and count by channel: its ratio estimates the noise variance.
    pub(crate) noise_moment: Vec<(f64, usize)>,
}

impl Filtered {
    /// Gain of a measurement, by its place among all: states, latents, zeros.
    pub(crate) fn gain(&self, at: usize) -> &[f64] {
        &self.gain[at * self.stride..(at + 1) * self.stride]
    }

    /// Row `r` of the covariance before the measurements of sample `k`; only where it was kept.
    pub(crate) fn covariance_row(&self, linear: &LinearTrial, k: usize, r: usize) -> &[f64] {
        let at = (k * linear.width() + r) * self.stride;
        &self.covariance[at..at + self.stride]
    }

    /// Deviation after the measurements of sample `k`: states, latents, zeros.
    pub(crate) fn updated(&self, k: usize) -> &[f64] {
        &self.updated[k * self.stride..(k + 1) * self.stride]
    }
}

/// Standard deviation of the rounding and discretisation error that a step may hide (m, rad, m/s, ...).
const STEP_ERROR: f64 = 1e-9;

/// What later passes need of a filter's run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Keep {
    /// The likelihood alone.
    Likelihood,
    /// Innovations, gains and states as well.
    Innovations,
    /// And the covariance of the states.
    Covariance,
}

/// Calls `$work::<N, W, FUSED>` with rows of fixed widths, which the compiler puts into the widest registers that the
/// processor has: `N` the states with zeros up to a full register, as in [`LinearTrial`], and `W` with the latents.
macro_rules! by_width {
    ($linear:expr, $work:ident, $($argument:expr),*) => {
        match $linear.padded {
            8 => vectorised!(FUSED => $work::<8, 16, FUSED>($($argument),*)),
            16 => vectorised!(FUSED => $work::<16, 24, FUSED>($($argument),*)),
            24 => vectorised!(FUSED => $work::<24, 32, FUSED>($($argument),*)),
            32 => vectorised!(FUSED => $work::<32, 40, FUSED>($($argument),*)),
            width => {
                assert!(width <= 64, "the largest model has fewer states than this");
                vectorised!(FUSED => $work::<64, 72, FUSED>($($argument),*))
            }
        }
    };
}

/// Runs the filter over one trial.
pub(crate) fn filter(linear: &LinearTrial, randomness: &Randomness, keep: Keep) -> Filtered {
    by_width!(linear, run, linear, randomness, keep)
}

#[inline(always)]
fn run<const N: usize, const W: usize, const FUSED: bool>(
    linear: &LinearTrial,
    randomness: &Randomness,
    keep: Keep,
) -> Filtered {
    let (n, w, m, len) = (linear.states, linear.width(), linear.channels, linear.len);
    let rows = |from: Keep| if keep >= from { len } else { 0 };
    let innovations = rows(Keep::Innovations);
    let mut out = Filtered {
        minus_two_log_likelihood: 0.0,
        whitened: vec![f64::NAN; innovations * m],
        deviation: vec![f64::NAN; innovations * m],
        stride: W,
        gain: vec![0.0; innovations * m * W],
        predicted: vec![0.0; innovations * W],
        updated: vec![0.0; innovations * W],
        covariance: vec![0.0; rows(Keep::Covariance) * w * W],
        noise_moment: vec![(0.0, 0); m],
    };
    let mut x = [0.0; W];
    x[..n].copy_from_slice(&linear.prior);
    let mut p = [[0.0; W]; W];
    for c in 0..n {
        p[c][c] = linear.prior_deviation[c].powi(2);
    }
    for l in 0..LATENTS {
        x[n + l] = -linear.latents[l];
        p[n + l][n + l] = randomness.latent_deviation(l).powi(2);
    }
    let mut updates = vec![([0.0; W], [0.0; W]); m];
    for k in 0..len {
        if keep >= Keep::Innovations {
            out.predicted.as_chunks_mut().0[k] = x;
        }
        if keep >= Keep::Covariance {
            out.covariance.as_chunks_mut().0[k * w..(k + 1) * w].copy_from_slice(&p[..w]);
        }
        // One measurement after the other, and the covariance once for all of them.
        let mut used = 0;
        for j in 0..m {
            let at = k * m + j;
            let z = linear.residual[at];
            if !z.is_finite() {
                continue;
            }
            let shown = linear.shown_by(k, j);
            let of = |vector: &[f64; W]| shown.clone().map(|(c, hc)| hc * vector[c]).sum::<f64>();
            let mut ph = [0.0; W];
            shown.clone().for_each(|(c, hc)| add::<FUSED>(&mut ph, hc, &p[c]));
            for (before, minus_gain) in &updates[..used] {
                add::<FUSED>(&mut ph, of(minus_gain), before);
            }
            let innovation = z - of(&x);
            let r = randomness.noise[j] * randomness.noise[j];
            let s = r + of(&ph);
            let inverse = 1.0 / s;
            let gain = ph.map(|v| v * inverse);
            add::<FUSED>(&mut x, innovation, &gain);
            updates[used] = (ph, gain.map(|g| -g));
            used += 1;
            if keep >= Keep::Innovations {
                out.gain.as_chunks_mut().0[at] = gain;
                out.deviation[at] = s.sqrt();
                out.whitened[at] = innovation / out.deviation[at];
            }
            out.minus_two_log_likelihood += s.ln() + innovation * innovation * inverse;
            out.noise_moment[j].0 += innovation * innovation * r * inverse;
            out.noise_moment[j].1 += 1;
        }
        for (at, rows) in p[..w.next_multiple_of(BLOCK)].as_chunks_mut::<BLOCK>().0.iter_mut().enumerate() {
            let mut updated = *rows;
            for (ph, minus_gain) in &updates[..used] {
                add_each::<W, FUSED>(&mut updated, block(minus_gain, at), ph);
            }
            *rows = updated;
        }
        if keep >= Keep::Innovations {
            out.updated.as_chunks_mut().0[k] = x;
        }
        if k + 1 < len {
            predict::<N, W, FUSED>(linear, randomness, k, &mut x, &mut p);
        }
    }
    out
}

#[inline(always)]
fn predict<const N: usize, const W: usize, const FUSED: bool>(
    linear: &LinearTrial,
    randomness: &Randomness,
    k: usize,
    x: &mut [f64; W],
    p: &mut [[f64; W]; W],
) {
    let (n, w) = (linear.states, linear.width());
    // What each state or latent does to the states.
    let columns = &linear.transition.as_chunks::<N>().0[k * w..(k + 1) * w];
    let decay = (-linear.interval[k] / randomness.time).exp();
    let mut next = [0.0; N];
    next[..n].copy_from_slice(&linear.defect[k * n..(k + 1) * n]);
    for (value, column) in x.iter().zip(columns) {
        add::<FUSED>(&mut next, *value, column);
    }
    x[..n].copy_from_slice(&next[..n]);
    for l in 0..LATENTS {
        let (now, then) = (linear.latents[k * LATENTS + l], linear.latents[(k + 1) * LATENTS + l]);
        x[n + l] = decay * (x[n + l] + now) - then;
    }
    // P = F P Fᵀ + Q: the lower triangle of the states, the states with the latents, the latents; the rest by symmetry.
    let mut half = [[0.0; W]; N];
    for (at, half) in half.as_chunks_mut::<BLOCK>().0[..n.div_ceil(BLOCK)].iter_mut().enumerate() {
        let mut sum = [[0.0; W]; BLOCK];
        for (column, row) in columns.iter().zip(&*p) {
            add_each::<W, FUSED>(&mut sum, block(column, at), row);
        }
        *half = sum;
    }
    for (at, half) in half.as_chunks::<BLOCK>().0[..n.div_ceil(BLOCK)].iter().enumerate() {
        let first = at * BLOCK;
        let rows = &mut p[first..n.min(first + BLOCK)];
        match first {
            ..8 => lower::<8, N, W, FUSED>(columns, half, rows),
            8..16 => lower::<16, N, W, FUSED>(columns, half, rows),
            _ => lower::<N, N, W, FUSED>(columns, half, rows),
        }
    }
    for r in 0..n {
        for c in 0..r {
            p[c][r] = p[r][c];
        }
        for l in n..w {
            p[r][l] = decay * half[r][l];
            p[l][r] = p[r][l];
        }
        p[r][r] += STEP_ERROR * STEP_ERROR;
    }
    for row in &mut p[n..w] {
        row[n..w].iter_mut().for_each(|value| *value *= decay * decay);
    }
    for l in 0..LATENTS {
        p[n + l][n + l] += randomness.latent_deviation(l).powi(2) * (1.0 - decay * decay);
    }
}

/// The first `L` numbers of some rows of `P`: of `half` times the transposed transition.
#[inline(always)]
fn lower<const L: usize, const N: usize, const W: usize, const FUSED: bool>(
    columns: &[[f64; N]],
    half: &[[f64; W]; BLOCK],
    rows: &mut [[f64; W]],
) {
    let mut sum = [[0.0; L]; BLOCK];
    for (c, column) in columns[..columns.len().min(W)].iter().enumerate() {
        let weights = half.each_ref().map(|half| half[c]);
        let column: &[f64; L] = column.first_chunk().expect("a part of the lower triangle is no wider than all");
        add_each::<L, FUSED>(&mut sum, &weights, column);
    }
    for (row, sum) in rows.iter_mut().zip(&sum) {
        row[..L].copy_from_slice(sum);
    }
}

/// Smoothed deviations from the trajectory, `width` a sample, by the modified Bryson-Frazier recursion.
///
/// G. J. Bierman, Fixed interval smoothing with discrete measurements, Int. J. Control 18 (1973). Needs the covariance.
pub(crate) fn smooth(linear: &LinearTrial, randomness: &Randomness, filtered: &Filtered) -> Vec<f64> {
    by_width!(linear, smooth_in, linear, randomness, filtered)
}

#[inline(always)]
fn smooth_in<const N: usize, const W: usize, const FUSED: bool>(
    linear: &LinearTrial,
    randomness: &Randomness,
    filtered: &Filtered,
) -> Vec<f64> {
    let (n, w, m, len) = (linear.states, linear.width(), linear.channels, linear.len);
    let mut lambda = [0.0; W];
    let mut deviation = vec![0.0; len * w];
    for k in (0..len).rev() {
        for j in (0..m).rev() {
            let at = k * m + j;
            if !filtered.whitened[at].is_finite() {
                continue;
            }
            let factor = filtered.whitened[at] / filtered.deviation[at] + dot::<FUSED>(filtered.gain(at), &lambda);
            linear.shown_by(k, j).for_each(|(c, hc)| lambda[c] -= hc * factor);
        }
        // The covariance is symmetric: its rows are its columns.
        let mut moved = filtered.predicted.as_chunks::<W>().0[k];
        let covariance = &filtered.covariance.as_chunks::<W>().0[k * w..(k + 1) * w];
        for (row, value) in covariance.iter().zip(&lambda) {
            add::<FUSED>(&mut moved, -value, row);
        }
        deviation[k * w..(k + 1) * w].copy_from_slice(&moved[..w]);
        if k > 0 {
            let columns = &linear.transition.as_chunks::<N>().0[(k - 1) * w..k * w];
            let decay = (-linear.interval[k - 1] / randomness.time).exp();
            let mut back = [0.0; W];
            for (slot, column) in back.iter_mut().zip(columns) {
                *slot = dot::<FUSED>(column, &lambda[..N]);
            }
            for l in n..w {
                back[l] += decay * lambda[l];
            }
            lambda = back;
        }
    }
    deviation
}
