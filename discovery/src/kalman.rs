//! Kalman filter and smoother on the linearised model, and the whitening of anything else by the same filter.

use crate::model::LATENTS;
use crate::path::LinearTrial;
use crate::vector::{add, vectorised};

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
    /// Gain of each measurement, `width` numbers.
    pub(crate) gain: Vec<f64>,
    /// Predicted deviation before each sample's measurements, `width` a sample.
    pub(crate) predicted: Vec<f64>,
    /// Deviation after each sample's measurements.
    pub(crate) updated: Vec<f64>,
    /// Its covariance before the measurements, `width²` a sample.
    pub(crate) covariance: Vec<f64>,
    /// `Σ e ν` and count by channel: its ratio estimates the noise variance.
    pub(crate) noise_moment: Vec<(f64, usize)>,
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

/// Runs the filter over one trial.
pub(crate) fn filter(linear: &LinearTrial, randomness: &Randomness, keep: Keep) -> Filtered {
    // Rows of a fixed width, and the widest registers that the processor has: three times as fast.
    match linear.width() {
        ..=16 => dispatch::<16>(linear, randomness, keep),
        17..=24 => dispatch::<24>(linear, randomness, keep),
        25..=32 => dispatch::<32>(linear, randomness, keep),
        _ => dispatch::<64>(linear, randomness, keep),
    }
}

fn dispatch<const W: usize>(linear: &LinearTrial, randomness: &Randomness, keep: Keep) -> Filtered {
    assert!(linear.width() <= W, "the largest model has fewer states and latents than this");
    vectorised!(FUSED => run::<W, FUSED>(linear, randomness, keep))
}

#[inline(always)]
fn run<const W: usize, const FUSED: bool>(linear: &LinearTrial, randomness: &Randomness, keep: Keep) -> Filtered {
    let (n, w, m, len) = (linear.states, linear.width(), linear.channels, linear.len);
    let rows = |from: Keep| if keep >= from { len } else { 0 };
    let innovations = rows(Keep::Innovations);
    let mut out = Filtered {
        minus_two_log_likelihood: 0.0,
        whitened: vec![f64::NAN; innovations * m],
        deviation: vec![f64::NAN; innovations * m],
        gain: vec![0.0; innovations * m * w],
        predicted: vec![0.0; innovations * w],
        updated: vec![0.0; innovations * w],
        covariance: vec![0.0; rows(Keep::Covariance) * w * w],
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
            out.predicted[k * w..(k + 1) * w].copy_from_slice(&x[..w]);
        }
        if keep >= Keep::Covariance {
            for (to, from) in out.covariance[k * w * w..(k + 1) * w * w].chunks_exact_mut(w).zip(&p) {
                to.copy_from_slice(&from[..w]);
            }
        }
        // One measurement after the other, and the covariance once for all of them.
        let mut used = 0;
        for j in 0..m {
            let at = k * m + j;
            let z = linear.residual[at];
            if !z.is_finite() {
                continue;
            }
            // A sensor shows few states.
            let mut shown = [(0, 0.0); W];
            let mut count = 0;
            for (c, &hc) in linear.sensor[at * n..(at + 1) * n].iter().enumerate() {
                shown[count] = (c, hc);
                count += usize::from(hc != 0.0);
            }
            let shown = &shown[..count];
            let of = |vector: &[f64; W]| shown.iter().map(|(c, hc)| hc * vector[*c]).sum::<f64>();
            let mut ph = [0.0; W];
            shown.iter().for_each(|(c, hc)| add::<FUSED>(&mut ph, *hc, &p[*c]));
            for (before, gain) in &updates[..used] {
                add::<FUSED>(&mut ph, -of(gain), before);
            }
            let innovation = z - of(&x);
            let r = randomness.noise[j] * randomness.noise[j];
            let s = r + of(&ph);
            let gain = ph.map(|v| v / s);
            add::<FUSED>(&mut x, innovation, &gain);
            updates[used] = (ph, gain);
            used += 1;
            if keep >= Keep::Innovations {
                out.gain[at * w..(at + 1) * w].copy_from_slice(&gain[..w]);
                out.whitened[at] = innovation / s.sqrt();
                out.deviation[at] = s.sqrt();
            }
            out.minus_two_log_likelihood += s.ln() + innovation * innovation / s;
            out.noise_moment[j].0 += innovation * innovation * r / s;
            out.noise_moment[j].1 += 1;
        }
        for (r, row) in p.iter_mut().enumerate() {
            let mut updated = *row;
            for (ph, gain) in &updates[..used] {
                add::<FUSED>(&mut updated, -gain[r], ph);
            }
            *row = updated;
        }
        if keep >= Keep::Innovations {
            out.updated[k * w..(k + 1) * w].copy_from_slice(&x[..w]);
        }
        if k + 1 < len {
            predict::<W, FUSED>(linear, randomness, k, &mut x, &mut p);
        }
    }
    out
}

#[inline(always)]
fn predict<const W: usize, const FUSED: bool>(
    linear: &LinearTrial,
    randomness: &Randomness,
    k: usize,
    x: &mut [f64; W],
    p: &mut [[f64; W]; W],
) {
    let (n, w) = (linear.states, linear.width());
    let f = &linear.transition[k * n * w..(k + 1) * n * w];
    let decay = (-linear.interval[k] / randomness.time).exp();
    // The transition of the states, transposed.
    let mut transposed = [[0.0; W]; W];
    for (r, row) in f.chunks_exact(w).enumerate() {
        for (c, value) in row.iter().enumerate() {
            transposed[c][r] = *value;
        }
    }
    let mut next = [0.0; W];
    next[..n].copy_from_slice(&linear.defect[k * n..(k + 1) * n]);
    for (value, column) in x.iter().zip(&transposed[..w]) {
        add::<FUSED>(&mut next, *value, column);
    }
    for l in 0..LATENTS {
        let (now, then) = (linear.latents[k * LATENTS + l], linear.latents[(k + 1) * LATENTS + l]);
        next[n + l] = decay * (x[n + l] + now) - then;
    }
    *x = next;
    // P = F P Fᵀ + Q: the lower triangle of the states, the states with the latents, the latents; the rest by symmetry.
    let mut product = [[0.0; W]; W];
    for (r, row) in f.chunks_exact(w).enumerate() {
        let mut half = [0.0; W];
        for (c, value) in row.iter().enumerate() {
            add::<FUSED>(&mut half, *value, &p[c]);
        }
        let target = &mut product[r];
        match r {
            ..8 => combine::<8, W, FUSED>(&half, &transposed[..w], target),
            8..16 => combine::<16, W, FUSED>(&half, &transposed[..w], target),
            _ => combine::<W, W, FUSED>(&half, &transposed[..w], target),
        }
        for l in n..w {
            product[r][l] = decay * half[l];
        }
    }
    for r in 0..w {
        for c in 0..r.min(n) {
            if r < n {
                product[c][r] = product[r][c];
            } else {
                product[r][c] = product[c][r];
            }
        }
    }
    for r in n..w {
        for c in n..w {
            product[r][c] = decay * decay * p[r][c];
        }
    }
    *p = product;
    for r in 0..n {
        p[r][r] += STEP_ERROR * STEP_ERROR;
    }
    for l in 0..LATENTS {
        p[n + l][n + l] += randomness.latent_deviation(l).powi(2) * (1.0 - decay * decay);
    }
}

/// The first `L` numbers of the sum of `rows` weighted by `weights`.
#[inline(always)]
fn combine<const L: usize, const W: usize, const FUSED: bool>(
    weights: &[f64; W],
    rows: &[[f64; W]],
    target: &mut [f64; W],
) {
    let mut sum = [0.0; L];
    for (weight, row) in weights.iter().zip(rows) {
        add::<FUSED>(&mut sum, *weight, &row[..L]);
    }
    target[..L].copy_from_slice(&sum);
}

/// Smoothed deviations and the standard deviations of the latents, by the modified Bryson-Frazier recursion.
///
/// G. J. Bierman, Fixed interval smoothing with discrete measurements, Int. J. Control 18 (1973). Needs the covariance.
pub(crate) struct Smoothed {
    /// Deviation from the trajectory, `width` a sample.
    pub(crate) deviation: Vec<f64>,
}

/// Smooths one trial.
pub(crate) fn smooth(linear: &LinearTrial, randomness: &Randomness, filtered: &Filtered) -> Smoothed {
    let (n, w, m, len) = (linear.states, linear.width(), linear.channels, linear.len);
    let mut lambda = vec![0.0; w];
    let mut deviation = vec![0.0; len * w];
    let mut back = vec![0.0; w];
    for k in (0..len).rev() {
        for j in (0..m).rev() {
            let at = k * m + j;
            if !filtered.whitened[at].is_finite() {
                continue;
            }
            let h = &linear.sensor[at * n..(at + 1) * n];
            let gain = &filtered.gain[at * w..(at + 1) * w];
            let factor = filtered.whitened[at] / filtered.deviation[at]
                + gain.iter().zip(&lambda).map(|(a, b)| a * b).sum::<f64>();
            for c in 0..n {
                lambda[c] -= h[c] * factor;
            }
        }
        let p = &filtered.covariance[k * w * w..(k + 1) * w * w];
        for r in 0..w {
            deviation[k * w + r] = filtered.predicted[k * w + r]
                - p[r * w..(r + 1) * w].iter().zip(&lambda).map(|(a, b)| a * b).sum::<f64>();
        }
        if k > 0 {
            let f = &linear.transition[(k - 1) * n * w..k * n * w];
            let decay = (-linear.interval[k - 1] / randomness.time).exp();
            back.fill(0.0);
            for r in 0..n {
                for (slot, value) in back.iter_mut().zip(&f[r * w..(r + 1) * w]) {
                    *slot += value * lambda[r];
                }
            }
            for l in 0..LATENTS {
                back[n + l] += decay * lambda[n + l];
            }
            lambda.copy_from_slice(&back);
        }
    }
    Smoothed { deviation }
}

/// What a set of signatures does to one trial: forcing of the states at each step, and of the sensors at each sample.
#[derive(Clone, Debug)]
pub(crate) struct Forcing {
    /// Signatures.
    pub(crate) columns: usize,
    /// `step[(k · states + r) · columns + c]`.
    pub(crate) step: Vec<f32>,
    /// `sensor[(k · channels + j) · columns + c]`.
    pub(crate) sensor: Vec<f32>,
}

/// Normal equations of innovations on whitened signatures.
#[derive(Clone, Debug)]
pub(crate) struct Normal {
    /// Columns.
    pub(crate) columns: usize,
    /// `EᵀE`, full.
    pub(crate) gram: Vec<f64>,
    /// `Eᵀν`.
    pub(crate) right: Vec<f64>,
    /// `νᵀν`.
    pub(crate) total: f64,
    /// Measurements.
    pub(crate) count: usize,
    /// `Σ log S + ν²/S`.
    pub(crate) minus_two_log_likelihood: f64,
}

impl Normal {
    pub(crate) fn empty(columns: usize) -> Self {
        Self {
            columns,
            gram: vec![0.0; columns * columns],
            right: vec![0.0; columns],
            total: 0.0,
            count: 0,
            minus_two_log_likelihood: 0.0,
        }
    }

    pub(crate) fn add(&mut self, other: &Self) {
        for (a, b) in self.gram.iter_mut().zip(&other.gram) {
            *a += b;
        }
        for (a, b) in self.right.iter_mut().zip(&other.right) {
            *a += b;
        }
        self.total += other.total;
        self.count += other.count;
        self.minus_two_log_likelihood += other.minus_two_log_likelihood;
    }

    /// Fall of `-2 log L` by signatures of these amplitudes.
    pub(crate) fn drop(&self, amplitudes: &[f64]) -> f64 {
        let rows = self.gram.chunks_exact(self.columns.max(1)).zip(&self.right).zip(amplitudes);
        rows.map(|((row, right), a)| {
            let explained: f64 = row.iter().zip(amplitudes).map(|(g, b)| g * b).sum();
            a * (2.0 * right - explained)
        })
        .sum()
    }

    /// Takes up a measurement: whitened signatures and innovation. Of the Gram matrix only the lower half is formed.
    pub(crate) fn push(&mut self, e: &[f64], innovation: f64) {
        self.push_right(e, innovation);
        for (a, ea) in e.iter().enumerate() {
            for (slot, eb) in self.gram[a * e.len()..a * e.len() + a + 1].iter_mut().zip(e) {
                *slot += ea * eb;
            }
        }
    }

    fn push_right(&mut self, e: &[f64], innovation: f64) {
        self.total += innovation * innovation;
        self.count += 1;
        for (slot, value) in self.right.iter_mut().zip(e) {
            *slot += value * innovation;
        }
    }

    /// Fills the upper half of the Gram matrix.
    pub(crate) fn mirror(&mut self) {
        for a in 0..self.columns {
            for b in 0..a {
                self.gram[b * self.columns + a] = self.gram[a * self.columns + b];
            }
        }
    }
}

/// Passes signatures through the filter and forms the normal equations (Willsky and Jones, generalised least squares).
///
/// With `pairs` only those entries `(a, b)`, `b <= a`, of the Gram matrix are formed; the others stay zero.
pub(crate) fn whiten(
    linear: &LinearTrial,
    randomness: &Randomness,
    filtered: &Filtered,
    forcing: &Forcing,
    pairs: Option<&[(usize, usize)]>,
) -> Normal {
    let mut normal = Normal::empty(forcing.columns);
    normal.minus_two_log_likelihood = filtered.minus_two_log_likelihood;
    whitened_rows(linear, randomness, filtered, forcing, |at, e| match pairs {
        Some(pairs) => {
            normal.push_right(e, filtered.whitened[at]);
            for &(a, b) in pairs {
                normal.gram[a * e.len() + b] += e[a] * e[b];
            }
        }
        None => normal.push(e, filtered.whitened[at]),
    });
    normal.mirror();
    normal
}

/// Passes signatures through the filter: calls `visit` for every measurement in turn with its place among them (sample ·
/// channels + channel) and the whitened signatures there.
pub(crate) fn whitened_rows(
    linear: &LinearTrial,
    randomness: &Randomness,
    filtered: &Filtered,
    forcing: &Forcing,
    visit: impl FnMut(usize, &[f64]),
) {
    vectorised!(FUSED => rows::<FUSED>(linear, randomness, filtered, forcing, visit));
}

#[inline(always)]
fn rows<const FUSED: bool>(
    linear: &LinearTrial,
    randomness: &Randomness,
    filtered: &Filtered,
    forcing: &Forcing,
    mut visit: impl FnMut(usize, &[f64]),
) {
    let (n, w, m, len) = (linear.states, linear.width(), linear.channels, linear.len);
    let columns = forcing.columns;
    // Sensitivities of the predicted deviation, a row a state, a column a signature.
    let mut s = vec![0.0; w * columns];
    let mut next = vec![0.0; n * columns];
    let mut e = vec![0.0; columns];
    for k in 0..len {
        for j in 0..m {
            let at = k * m + j;
            if !filtered.whitened[at].is_finite() {
                continue;
            }
            e.fill(0.0);
            for (c, &hc) in linear.sensor[at * n..(at + 1) * n].iter().enumerate() {
                if hc != 0.0 {
                    add::<FUSED>(&mut e, hc, &s[c * columns..(c + 1) * columns]);
                }
            }
            for (slot, value) in e.iter_mut().zip(&forcing.sensor[at * columns..(at + 1) * columns]) {
                *slot += f64::from(*value);
            }
            for (r, &g) in filtered.gain[at * w..(at + 1) * w].iter().enumerate() {
                if g != 0.0 {
                    add::<FUSED>(&mut s[r * columns..(r + 1) * columns], -g, &e);
                }
            }
            let inverse = 1.0 / filtered.deviation[at];
            for value in &mut e {
                *value *= inverse;
            }
            visit(at, &e);
        }
        if k + 1 < len {
            let f = &linear.transition[k * n * w..(k + 1) * n * w];
            for r in 0..n {
                let row = &mut next[r * columns..(r + 1) * columns];
                let at = (k * n + r) * columns;
                for (slot, value) in row.iter_mut().zip(&forcing.step[at..at + columns]) {
                    *slot = f64::from(*value);
                }
                for c in 0..w {
                    let frc = f[r * w + c];
                    if frc != 0.0 {
                        add::<FUSED>(row, frc, &s[c * columns..(c + 1) * columns]);
                    }
                }
            }
            s[..n * columns].copy_from_slice(&next);
            let decay = (-linear.interval[k] / randomness.time).exp();
            for value in &mut s[n * columns..] {
                *value *= decay;
            }
        }
    }
}
