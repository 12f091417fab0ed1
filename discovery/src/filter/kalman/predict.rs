//! The prediction from one sample to the next: mean and covariance of states, latents and noise with memory.

use cdpr::per_cable::MAX_CABLES;

use crate::filter::path::LinearTrial;
use crate::filter::vector::{BLOCK, FULL, add, add_each, block, plus_each};
use crate::model::examined::WRENCH;
use crate::model::randomness::Randomness;

/// Standard deviation of the rounding and discretisation error that a step may hide (m, rad, m/s, ...).
pub(super) const STEP_ERROR: f64 = 1e-9;

/// What a prediction works with, so that it is not cleared for each. What is wide is not on the stack: there the code for every
/// width would take its own part of it.
pub(super) struct Room<const N: usize, const W: usize> {
    /// What each state or latent does to the states.
    columns: Vec<[f64; N]>,
    /// The covariance of the states after a step with all before it.
    half: Vec<[f64; W]>,
    /// The rows of the latent forces at winches without the errors of forces.
    alone: [[f64; W]; MAX_CABLES],
    /// What is left of each process after an interval of this length (s), zero for states, and the power of latents that are not estimated.
    over: f32,
    decay: [f64; W],
    power: f64,
}

impl<const N: usize, const W: usize> Room<N, W> {
    #[inline(always)]
    pub(super) fn new(linear: &LinearTrial) -> Self {
        Self {
            columns: vec![[0.0; N]; linear.width()],
            half: vec![[0.0; W]; N],
            alone: [[0.0; W]; MAX_CABLES],
            over: f32::NAN,
            decay: [0.0; W],
            power: 0.0,
        }
    }
}

#[inline(always)]
pub(super) fn predict<const N: usize, const W: usize, const FUSED: bool>(
    linear: &LinearTrial,
    randomness: &Randomness,
    k: usize,
    x: &mut [f64; W],
    p: &mut [[f64; W]; W],
    Room { columns, half, alone, over, decay, power }: &mut Room<N, W>,
) {
    let (n, estimated) = (linear.states, randomness.estimated());
    let (acting, w) = (n + estimated, n + randomness.processes());
    linear.columns(k, columns.as_flattened_mut());
    let (columns, others) = columns[..linear.width()].split_at(acting);
    if linear.interval[k] as f32 != *over {
        *over = linear.interval[k] as f32;
        randomness.decays(linear.interval[k], &mut decay[n..w]);
        *power = randomness.power(linear.interval[k]);
    }
    // Errors of forces move the states as the latent forces at their winches do.
    let winches = if randomness.force_errors() > 0 { n + WRENCH..acting } else { acting..acting };
    let errors = || winches.clone().cycle().zip(w - randomness.force_errors()..w);
    let mut acts = *x;
    errors().for_each(|(winch, at)| acts[winch] += x[at]);
    alone[..winches.len()].copy_from_slice(&p[winches.clone()]);
    for (winch, at) in errors() {
        let error = p[at];
        add::<FUSED>(&mut p[winch], 1.0, &error);
    }
    let mut next = [0.0; N];
    next[..n].copy_from_slice(&linear.defect[k * n..(k + 1) * n]);
    for (value, column) in acts.iter().zip(columns) {
        add::<FUSED>(&mut next, *value, column);
    }
    let (now, then) = (linear.latents(k), linear.latents(k + 1));
    // What is not estimated is none, whatever it was along the trajectory.
    for (latent, column) in now.iter().zip(others) {
        add::<FUSED>(&mut next, -latent, column);
    }
    x[..n].copy_from_slice(&next[..n]);
    for (l, (now, then)) in (n..acting).zip(now.iter().zip(then)) {
        x[l] = decay[l] * (x[l] + now) - then;
    }
    for l in acting..w {
        x[l] *= decay[l];
    }
    // P = F P Fᵀ + Q: the lower triangle of the states, the states with the rest, the rest; what is left by symmetry.
    for (at, half) in half.as_chunks_mut::<BLOCK>().0[..n.div_ceil(BLOCK)].iter_mut().enumerate() {
        let mut sum = [[0.0; W]; BLOCK];
        for (column, row) in columns.iter().zip(&*p) {
            add_each::<W, FUSED>(&mut sum, block(column, at), row);
        }
        *half = sum;
    }
    p[winches.clone()].copy_from_slice(&alone[..winches.len()]);
    for (row, half) in p[..n].iter_mut().zip(&*half) {
        *row = std::array::from_fn(|i| decay[i] * half[i]);
    }
    for (at, half) in half.as_chunks::<BLOCK>().0[..n.div_ceil(BLOCK)].iter().enumerate() {
        let first = at * BLOCK;
        let mut acting = *half;
        for row in &mut acting {
            errors().for_each(|(winch, at)| row[winch] += row[at]);
        }
        for chunk in 0..=first / FULL {
            let mut sum = [[0.0; FULL]; BLOCK];
            for c in 0..columns.len().min(W) {
                let column = &columns[c].as_chunks::<FULL>().0[chunk];
                let weights = acting.each_ref().map(|row| row[c]);
                plus_each::<FUSED>(&mut sum, &weights, column);
            }
            for (row, sum) in p[first..n.min(first + BLOCK)].iter_mut().zip(&sum) {
                let row = &mut row.as_chunks_mut::<FULL>().0[chunk];
                *row = std::array::from_fn(|i| row[i] + sum[i]);
            }
        }
    }
    // White noise for what is not estimated: of each state by itself, for it only has to keep the filter awake.
    let mut unestimated = [STEP_ERROR * STEP_ERROR; N];
    for (l, column) in others.iter().enumerate() {
        let variance = *power * randomness.latent_deviation(l).powi(2);
        unestimated.iter_mut().zip(column).for_each(|(slot, by)| *slot += variance * by * by);
    }
    let input = randomness.white_input();
    if input > 0.0 {
        // A force that is not quite the one recorded, held over the interval.
        for column in columns[n..].iter().chain(others).skip(WRENCH) {
            for (row, by) in p[..n].iter_mut().zip(column) {
                add::<FUSED>(&mut row[..n], input * input * by, column);
            }
        }
    }
    for (row, by) in p[n..w].iter_mut().zip(&decay[n..w]) {
        *row = std::array::from_fn(|i| by * decay[i] * row[i]);
    }
    for r in 0..n {
        for c in 0..r {
            p[c][r] = p[r][c];
        }
        for l in n..w {
            p[l][r] = p[r][l];
        }
        p[r][r] += unestimated[r];
    }
    for l in n..w {
        p[l][l] += randomness.deviation(l - n).powi(2) * (1.0 - decay[l] * decay[l]);
    }
    let together = randomness.force_error_covariance();
    for (a, b) in randomness.correlated().map(|(a, b)| (n + a, n + b)) {
        let forgotten = together * (1.0 - decay[a] * decay[b]);
        p[a][b] += forgotten;
        p[b][a] += forgotten;
    }
}
