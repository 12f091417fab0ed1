//! Kalman filter on the linearised model, forward over its samples.

use std::ops::Range;

use crate::filter::path::LinearTrial;
use crate::filter::vector::{BLOCK, add, add_each, block, plus, vectorised};
use crate::model::randomness::ROOM;
pub(crate) use crate::model::randomness::Randomness;

/// Samples that are filtered and whitened together: what is kept of them stays near.
pub(crate) const STRETCH: usize = 256;

/// Innovations, gains and what else later passes need of some samples; what was not to be kept is empty.
#[derive(Clone, Debug)]
pub(crate) struct Filtered {
    /// The first sample.
    first: usize,
    /// `Σ log S + ν²/S` over all measurements up to the last sample.
    pub(crate) minus_two_log_likelihood: f64,
    /// Innovation over its standard deviation, a number a measurement; `NAN` in gaps.
    pub(crate) whitened: Vec<f64>,
    /// Standard deviation of each innovation.
    pub(crate) deviation: Vec<f64>,
    /// Numbers of a row of what follows: states, latents, noise with memory, and zeros up to this.
    stride: usize,
    /// Gain of each measurement.
    gain: Vec<f64>,
    /// Deviation before each sample's measurements.
    predicted: Vec<f64>,
    /// Deviation after each sample's measurements.
    updated: Vec<f64>,
    /// Its covariance before the measurements, a row a state, latent or noise with memory.
    covariance: Vec<f64>,
    /// `Σ e ν` and count by channel up to the last sample: its ratio estimates the noise variance.
    pub(crate) noise_moment: Vec<(f64, usize)>,
}

impl Filtered {
    /// Gain of a measurement, by its place among those of the samples: states, latents, zeros.
    pub(crate) fn gain(&self, at: usize) -> &[f64] {
        &self.gain[at * self.stride..(at + 1) * self.stride]
    }

    /// Deviation before the measurements of sample `k`: states, latents and other processes, zeros.
    pub(crate) fn predicted(&self, k: usize) -> &[f64] {
        &self.predicted[k * self.stride..(k + 1) * self.stride]
    }

    /// Deviation after the measurements of sample `k`: states, latents, zeros.
    pub(crate) fn updated(&self, k: usize) -> &[f64] {
        &self.updated[k * self.stride..(k + 1) * self.stride]
    }
}

/// Products of the variances of a sample's measurements that stay far from the ends of the numbers: one logarithm does for all of them.
const LOGARITHM: Range<f64> = 1e-200..1e200;

/// What later passes need of a filter's run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Keep {
    /// The likelihood alone.
    Likelihood,
    /// Innovations and states as well.
    Innovations,
    /// And gains.
    Gains,
    /// And what the smoother needs.
    Covariance,
}

/// Calls `$work::<N, W, FUSED>` with rows of fixed widths, which the compiler puts into the widest registers that the
/// processor has: `N` the states with zeros up to one of [`STATES`](crate::filter::vector::STATES), as in [`LinearTrial`], and `W` with
/// the latents and the noise with memory, the narrowest that has room for them.
macro_rules! by_width {
    ($linear:expr, $randomness:expr, $work:ident, $($argument:expr),*) => {{
        let processes = $randomness.processes();
        assert!(processes <= ROOM, "no more noise with memory than there is room for");
        let width = $linear.states + processes;
        match $linear.padded {
            8 => by_room!(8, width, $work, ($($argument),*)),
            16 => by_room!(16, width, $work, ($($argument),*)),
            24 => by_room!(24, width, $work, ($($argument),*)),
            32 => by_room!(32, width, $work, ($($argument),*)),
            // Rare: one room for all.
            48 => vectorised!(FUSED => $work::<48, { 48 + ROOM }, FUSED>($($argument),*)),
            _ => vectorised!(FUSED => $work::<128, { 128 + ROOM }, FUSED>($($argument),*)),
        }
    }};
}

/// The part of [`by_width!`] that looks for the room beside the states.
macro_rules! by_room {
    ($states:literal, $width:expr, $work:ident, $arguments:tt) => {
        if $width <= $states {
            vectorised!(FUSED => $work::<$states, $states, FUSED>$arguments)
        } else if $width <= $states + 8 {
            vectorised!(FUSED => $work::<$states, { $states + 8 }, FUSED>$arguments)
        } else if $width <= $states + 16 {
            vectorised!(FUSED => $work::<$states, { $states + 16 }, FUSED>$arguments)
        } else if $width <= $states + 24 {
            vectorised!(FUSED => $work::<$states, { $states + 24 }, FUSED>$arguments)
        } else {
            vectorised!(FUSED => $work::<$states, { $states + ROOM }, FUSED>$arguments)
        }
    };
}

mod predict;
mod smoother;

use predict::{Room, predict};
pub(crate) use smoother::{smooth, smoothed_memory};

/// Runs the filter over one trial.
pub(crate) fn filter(linear: &LinearTrial, randomness: &Randomness, keep: Keep) -> Filtered {
    Run::new(linear, randomness).advance(linear.len, keep)
}

/// Runs the filter over one trial from the trajectory's first states on, as if they were known.
pub(crate) fn filter_from_start(linear: &LinearTrial, randomness: &Randomness, keep: Keep) -> Filtered {
    let mut run = Run::new(linear, randomness);
    let (n, w) = (linear.states, linear.states + randomness.processes());
    run.standing.x[..n].fill(0.0);
    run.standing.p[..n * w].fill(0.0);
    run.advance(linear.len, keep)
}

/// The covariance before the measurements of some samples, in their order: rows of states and processes.
pub(crate) fn covariances(
    linear: &LinearTrial,
    randomness: &Randomness,
    samples: impl IntoIterator<Item = usize>,
) -> Vec<Vec<f64>> {
    let mut run = Run::new(linear, randomness);
    let at = |sample: usize| {
        run.advance(sample, Keep::Likelihood);
        run.standing.p.clone()
    };
    samples.into_iter().map(at).collect()
}

/// A run of the filter over one trial, that can be interrupted.
pub(crate) struct Run<'a> {
    linear: &'a LinearTrial,
    randomness: &'a Randomness,
    standing: Standing,
}

/// Where a run of the filter stands: before the measurements of a sample.
#[derive(Clone)]
struct Standing {
    next: usize,
    /// Deviation of states and processes from the trajectory.
    x: Vec<f64>,
    /// Its covariance, by rows.
    p: Vec<f64>,
    minus_two_log_likelihood: f64,
    noise_moment: Vec<(f64, usize)>,
}

impl Standing {
    fn new(linear: &LinearTrial, randomness: &Randomness) -> Self {
        let (n, w) = (linear.states, linear.states + randomness.processes());
        let mut x = vec![0.0; w];
        x[..n].copy_from_slice(&linear.prior.mean);
        for (slot, latent) in x[n..].iter_mut().zip(linear.latents(0)).take(randomness.estimated()) {
            *slot = -latent;
        }
        let mut p = vec![0.0; w * w];
        for (row, covariance) in p.chunks_exact_mut(w).zip(linear.prior.covariance.chunks_exact(n)) {
            row[..n].copy_from_slice(covariance);
        }
        for l in 0..randomness.processes() {
            p[(n + l) * w + n + l] = randomness.deviation(l).powi(2);
        }
        for (a, b) in randomness.correlated() {
            p[(n + a) * w + n + b] = randomness.force_error_covariance();
            p[(n + b) * w + n + a] = randomness.force_error_covariance();
        }
        // What is shown of no sample counts as if there were nothing but its noise.
        let outside = linear.outside.iter().zip(&randomness.noise).filter(|(count, _)| **count > 0);
        let minus_two_log_likelihood = outside.map(|(count, noise)| *count as f64 * (1.0 + 2.0 * noise.ln())).sum();
        Self { next: 0, x, p, minus_two_log_likelihood, noise_moment: vec![(0.0, 0); linear.channels] }
    }
}

impl<'a> Run<'a> {
    pub(crate) fn new(linear: &'a LinearTrial, randomness: &'a Randomness) -> Self {
        Self { linear, randomness, standing: Standing::new(linear, randomness) }
    }

    /// Runs on over the samples before `end`.
    #[inline(never)]
    pub(crate) fn advance(&mut self, end: usize, keep: Keep) -> Filtered {
        let Self { linear, randomness, standing } = self;
        by_width!(linear, randomness, run, linear, randomness, standing, end, keep)
    }
}

/// What one measurement shows: places among states and processes, with slopes. Loops over it stay in wide registers, which
/// those over a chain of iterators do not.
#[derive(Clone)]
struct Seen<const W: usize> {
    channel: usize,
    count: usize,
    at: [usize; W],
    slope: [f64; W],
}

impl<const W: usize> Seen<W> {
    #[inline(always)]
    fn nothing() -> Self {
        Self { channel: 0, count: 0, at: [0; W], slope: [0.0; W] }
    }

    /// Takes up channel `j` at sample `k`, with the processes that it shows beside the states.
    #[inline(always)]
    fn take(&mut self, linear: &LinearTrial, k: usize, j: usize, processes: &Range<usize>) {
        (self.channel, self.count) = (j, 0);
        for (c, slope) in linear.shown_by(k, j) {
            (self.at[self.count], self.slope[self.count]) = (c, slope);
            self.count += 1;
        }
        for l in processes.clone() {
            (self.at[self.count], self.slope[self.count]) = (linear.states + l, 1.0);
            self.count += 1;
        }
    }

    /// What is shown of a vector.
    #[inline(always)]
    fn of(&self, vector: &[f64; W]) -> f64 {
        let mut sum = 0.0;
        for i in 0..self.count.min(W) {
            sum += self.slope[i] * vector[self.at[i]];
        }
        sum
    }
}

#[inline(always)]
fn run<const N: usize, const W: usize, const FUSED: bool>(
    linear: &LinearTrial,
    randomness: &Randomness,
    standing: &mut Standing,
    end: usize,
    keep: Keep,
) -> Filtered {
    let (n, m, len) = (linear.states, linear.channels, linear.len);
    let w = n + randomness.processes();
    let remembered = randomness.shown_by_channel(m);
    let first = standing.next;
    let rows = |from: Keep| if keep >= from { end - first } else { 0 };
    let (innovations, gains) = (rows(Keep::Innovations), rows(Keep::Gains));
    let mut out = Filtered {
        first,
        minus_two_log_likelihood: standing.minus_two_log_likelihood,
        whitened: vec![f64::NAN; innovations * m],
        deviation: vec![f64::NAN; innovations * m],
        stride: W,
        gain: vec![0.0; gains * m * W],
        predicted: vec![0.0; innovations * W],
        updated: vec![0.0; innovations * W],
        covariance: vec![0.0; rows(Keep::Covariance) * w * W],
        noise_moment: standing.noise_moment.clone(),
    };
    let mut x = [0.0; W];
    x[..w].copy_from_slice(&standing.x);
    let mut p = [[0.0; W]; W];
    p.iter_mut().zip(standing.p.chunks_exact(w)).for_each(|(row, values)| row[..w].copy_from_slice(values));
    let mut updates = vec![([0.0; W], [0.0; W]); m];
    let (mut seen, mut innovations) = (vec![Seen::<W>::nothing(); m], vec![0.0; m]);
    let mut room = Room::<N, W>::new(linear);
    for k in first..end {
        let kept = k - first;
        if keep >= Keep::Innovations {
            out.predicted.as_chunks_mut().0[kept] = x;
        }
        if keep >= Keep::Covariance {
            out.covariance.as_chunks_mut().0[kept * w..(kept + 1) * w].copy_from_slice(&p[..w]);
        }
        // All measurements as if each were the only one; then each takes what it tells off those after it, which wait for nothing else.
        let mut used = 0;
        for j in 0..m {
            let z = linear.residual[k * m + j];
            if !z.is_finite() {
                continue;
            }
            let seen = &mut seen[used];
            seen.take(linear, k, j, &remembered[j]);
            let mut ph = [0.0; W];
            for i in 0..seen.count.min(W) {
                ph = plus::<W, FUSED>(ph, seen.slope[i], &p[seen.at[i]]);
            }
            updates[used].0 = ph;
            innovations[used] = z - seen.of(&x);
            used += 1;
        }
        let mut variances = 1.0;
        for a in 0..used {
            let (own, after) = updates[a..used].split_first_mut().expect("one at least");
            let (ph, minus_gain) = own;
            let (j, innovation) = (seen[a].channel, innovations[a]);
            let at = k * m + j;
            let r = randomness.noise[j].powi(2) + (randomness.jitter * linear.rate[at]).powi(2);
            let s = r + seen[a].of(ph);
            let inverse = 1.0 / s;
            *minus_gain = ph.map(|v| -v * inverse);
            add::<FUSED>(&mut x, -innovation, &*minus_gain);
            for ((other, _), b) in after.iter_mut().zip(a + 1..) {
                let by = seen[b].of(minus_gain);
                *other = plus::<W, FUSED>(*other, by, ph);
                innovations[b] += by * innovation;
            }
            if keep >= Keep::Gains {
                out.gain.as_chunks_mut().0[kept * m + j] = minus_gain.map(|g| -g);
            }
            if keep >= Keep::Innovations {
                let deviation = s.sqrt();
                out.deviation[kept * m + j] = deviation;
                out.whitened[kept * m + j] = innovation / deviation;
            }
            variances *= s;
            if !LOGARITHM.contains(&variances) {
                out.minus_two_log_likelihood += variances.ln();
                variances = 1.0;
            }
            out.minus_two_log_likelihood += innovation * innovation * inverse;
            out.noise_moment[j].0 += innovation * innovation * r * inverse;
            out.noise_moment[j].1 += 1;
        }
        out.minus_two_log_likelihood += variances.ln();
        for (at, rows) in p[..w.next_multiple_of(BLOCK)].as_chunks_mut::<BLOCK>().0.iter_mut().enumerate() {
            let mut updated = *rows;
            for (ph, minus_gain) in &updates[..used] {
                add_each::<W, FUSED>(&mut updated, block(minus_gain, at), ph);
            }
            *rows = updated;
        }
        if keep >= Keep::Innovations {
            out.updated.as_chunks_mut().0[kept] = x;
        }
        if k + 1 < len {
            predict::<N, W, FUSED>(linear, randomness, k, &mut x, &mut p, &mut room);
        }
    }
    standing.next = end;
    standing.x.copy_from_slice(&x[..w]);
    standing.p.chunks_exact_mut(w).zip(&p).for_each(|(values, row)| values.copy_from_slice(&row[..w]));
    standing.minus_two_log_likelihood = out.minus_two_log_likelihood;
    standing.noise_moment.clone_from(&out.noise_moment);
    out
}

/// How far simulations that run freely from what the filter knows are from the measurements where the model is right: sum
/// of squares and count by channel. They begin anew at each of the samples `restarts`. From what a recording counts is known, and how a drift
/// changes from there on.
pub(crate) fn spread(linear: &LinearTrial, randomness: &Randomness, restarts: &[usize]) -> Vec<(f64, usize)> {
    let randomness = randomness.with_origins_known();
    let known = covariances(linear, &randomness, restarts.iter().copied());
    let held = randomness.with_drifts_held();
    by_width!(linear, held, spread_in, linear, &held, &known, restarts)
}

#[inline(always)]
fn spread_in<const N: usize, const W: usize, const FUSED: bool>(
    linear: &LinearTrial,
    randomness: &Randomness,
    known: &[Vec<f64>],
    restarts: &[usize],
) -> Vec<(f64, usize)> {
    let (n, m) = (linear.states, linear.channels);
    let w = n + randomness.processes();
    let remembered = randomness.shown_by_channel(m);
    let mut sums = vec![(0.0, 0); m];
    let mut x = [0.0; W];
    let mut p = [[0.0; W]; W];
    let (mut seen, mut room) = (Seen::<W>::nothing(), Room::<N, W>::new(linear));
    let mut running = false;
    for k in 0..linear.len {
        if let Ok(at) = restarts.binary_search(&k) {
            p.iter_mut().zip(known[at].chunks_exact(w)).for_each(|(row, values)| row[..w].copy_from_slice(values));
            running = true;
        } else if running {
            for j in 0..m {
                seen.take(linear, k, j, &remembered[j]);
                let mut by_states = 0.0;
                for i in 0..seen.count.min(W) {
                    by_states += seen.slope[i] * seen.of(&p[seen.at[i]]);
                }
                let jitter = (randomness.jitter * linear.rate[k * m + j]).powi(2);
                sums[j].0 += by_states + randomness.noise[j].powi(2) + jitter;
                sums[j].1 += 1;
            }
        }
        if running && k + 1 < linear.len {
            predict::<N, W, FUSED>(linear, randomness, k, &mut x, &mut p, &mut room);
        }
    }
    sums
}

#[cfg(test)]
mod tests;
