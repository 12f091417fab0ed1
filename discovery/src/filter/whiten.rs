//! Whitening: signatures sent through the Kalman filter, and the normal equations of innovations on them.

use std::ops::Range;

use crate::filter::kalman::{Keep, Randomness, Run, STRETCH};
use crate::filter::path::LinearTrial;
use crate::filter::vector::{BLOCK, add, block, plus, plus_each, vectorised};
use crate::model::examined::WRENCH;

/// What a set of signatures does to one trial, or to some samples of it: forcing of the states at each step, and of the sensors
/// at each sample.
#[derive(Clone, Debug)]
pub(crate) struct Forcing {
    /// The first sample.
    pub(crate) first: usize,
    /// Signatures.
    pub(crate) columns: usize,
    /// `step[((k - first) · states + r) · columns + c]`.
    pub(crate) step: Vec<f32>,
    /// `sensor[((k - first) · channels + j) · columns + c]`.
    pub(crate) sensor: Vec<f32>,
}

/// Signatures, sample by sample.
pub(crate) trait Acting: Sync {
    /// How many there are.
    fn columns(&self) -> usize;
    /// Writes what they do to the sensors at sample `k`, `columns` numbers a channel.
    fn at_sample(&self, k: usize, sensor: &mut [f32]);
    /// Writes what they do to the states over step `k`, `columns` numbers a state.
    fn over_step(&self, k: usize, step: &mut [f32]);
}

impl Acting for Forcing {
    fn columns(&self) -> usize {
        self.columns
    }

    fn at_sample(&self, k: usize, sensor: &mut [f32]) {
        let at = (k - self.first) * sensor.len();
        sensor.copy_from_slice(&self.sensor[at..at + sensor.len()]);
    }

    fn over_step(&self, k: usize, step: &mut [f32]) {
        let at = (k - self.first) * step.len();
        step.copy_from_slice(&self.step[at..at + step.len()]);
    }
}

impl Forcing {
    /// Of no signature.
    pub(crate) fn none() -> Self {
        Self { first: 0, columns: 0, step: Vec::new(), sensor: Vec::new() }
    }

    /// Some samples of it.
    pub(crate) fn part(&self, linear: &LinearTrial, samples: &Range<usize>) -> Self {
        let cut = |values: &[f32], of_sample: usize, end: usize| {
            values[(samples.start - self.first) * of_sample..(end - self.first) * of_sample].to_vec()
        };
        Self {
            first: samples.start,
            columns: self.columns,
            step: cut(&self.step, linear.states * self.columns, samples.end.min(linear.len - 1)),
            sensor: cut(&self.sensor, linear.channels * self.columns, samples.end),
        }
    }

    /// Its signatures, then those of another.
    pub(crate) fn beside(self, other: &Self) -> Self {
        if self.columns == 0 {
            return other.clone();
        }
        let rows = |own: &[f32], others: &[f32]| -> Vec<f32> {
            let others = others.chunks_exact(other.columns.max(1)).chain(std::iter::repeat(&[][..]));
            let both = own.chunks_exact(self.columns).zip(others);
            both.flat_map(|(own, others)| own.iter().chain(others).copied()).collect()
        };
        Self {
            first: self.first,
            columns: self.columns + other.columns,
            step: rows(&self.step, &other.step),
            sensor: rows(&self.sensor, &other.sensor),
        }
    }
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

    /// Those of some columns that follow one another.
    pub(crate) fn picked(&self, columns: std::ops::Range<usize>) -> Self {
        let row = |r: usize| &self.gram[r * self.columns + columns.start..r * self.columns + columns.end];
        Self {
            columns: columns.len(),
            gram: columns.clone().flat_map(row).copied().collect(),
            right: self.right[columns.clone()].to_vec(),
            ..*self
        }
    }

    /// The same where some columns say nothing.
    pub(crate) fn silence(&mut self, columns: &[usize]) {
        for &c in columns {
            self.right[c] = 0.0;
            for other in 0..self.columns {
                self.gram[c * self.columns + other] = 0.0;
                self.gram[other * self.columns + c] = 0.0;
            }
        }
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

    #[inline(always)]
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
pub(crate) fn whiten(linear: &LinearTrial, randomness: &Randomness, forcing: &dyn Acting) -> Normal {
    let mut whitening = Whitening::new(linear, randomness, forcing.columns());
    let mut products = Products::new(forcing.columns(), None);
    whitening.advance(forcing, linear.len, |_, innovation, e| products.push(e, innovation));
    products.normal(whitening.minus_two_log_likelihood())
}

/// Normal equations as they grow with the measurements: of all entries of the Gram matrix, or of some entries `(a, b)`,
/// `b <= a`, alone; the others stay zero.
pub(crate) struct Products<'a> {
    normal: Normal,
    /// The entries that are formed, where these are not all.
    pairs: Option<&'a [(usize, usize)]>,
    runs: Vec<Entries>,
    /// These entries side by side, for the matrix is large.
    products: Vec<f64>,
}

impl<'a> Products<'a> {
    pub(crate) fn new(columns: usize, pairs: Option<&'a [(usize, usize)]>) -> Self {
        Self {
            normal: Normal::empty(columns),
            pairs,
            runs: entries(pairs.unwrap_or_default()),
            products: vec![0.0; pairs.map_or(0, <[_]>::len)],
        }
    }

    /// Takes up a measurement: whitened signatures and innovation.
    pub(crate) fn push(&mut self, e: &[f64], innovation: f64) {
        if self.pairs.is_none() {
            return self.normal.push(e, innovation);
        }
        self.normal.push_right(e, innovation);
        let mut rest = &mut self.products[..];
        for Entries { row, columns } in &self.runs {
            let (own, others) = rest.split_at_mut(columns.len());
            rest = others;
            let factor = e[*row];
            // Often nothing: what acts in another stretch of time.
            if factor != 0.0 {
                own.iter_mut().zip(&e[columns.clone()]).for_each(|(slot, value)| *slot += factor * value);
            }
        }
    }

    /// The normal equations of all measurements so far.
    pub(crate) fn normal(self, minus_two_log_likelihood: f64) -> Normal {
        let mut normal = Normal { minus_two_log_likelihood, ..self.normal };
        for (product, (a, b)) in self.products.iter().zip(self.pairs.into_iter().flatten()) {
            normal.gram[a * normal.columns + b] = *product;
        }
        normal.mirror();
        normal
    }
}

/// Neighbouring entries of one row of a matrix.
struct Entries {
    row: usize,
    columns: Range<usize>,
}

/// Entries of a matrix as runs of neighbours, in their order.
fn entries(pairs: &[(usize, usize)]) -> Vec<Entries> {
    let mut runs: Vec<Entries> = Vec::new();
    for &(row, column) in pairs {
        match runs.last_mut() {
            Some(run) if run.row == row && run.columns.end == column => run.columns.end += 1,
            _ => runs.push(Entries { row, columns: column..column + 1 }),
        }
    }
    runs
}

/// Passes signatures through the filter: calls `visit` for every measurement in turn with its place among them (sample ·
/// channels + channel), its innovation and the signatures there, both whitened.
pub(crate) fn whitened_rows(
    linear: &LinearTrial,
    randomness: &Randomness,
    forcing: &dyn Acting,
    visit: impl FnMut(usize, f64, &[f64]),
) {
    Whitening::new(linear, randomness, forcing.columns()).advance(forcing, linear.len, visit);
}

/// Signatures that are done at a time: a full register.
const PANEL: usize = 8;
type Panel = [f64; PANEL];

/// Signatures on their way through the filter, stretch by stretch of time.
pub(crate) struct Whitening<'a> {
    linear: &'a LinearTrial,
    randomness: &'a Randomness,
    run: Run<'a>,
    next: usize,
    minus_two_log_likelihood: f64,
    columns: usize,
    /// Numbers of a panel below: states and processes, and zeros up to a full block.
    height: usize,
    /// Sensitivities of the predicted deviation: panel by panel, a row a state, latent or noise with memory.
    sensitivities: Vec<Panel>,
    /// What only acts later on has done nothing yet.
    begun: Vec<bool>,
}

impl<'a> Whitening<'a> {
    pub(crate) fn new(linear: &'a LinearTrial, randomness: &'a Randomness, columns: usize) -> Self {
        let height = (linear.states + randomness.processes()).next_multiple_of(BLOCK);
        let panels = columns.div_ceil(PANEL);
        Self {
            linear,
            randomness,
            run: Run::new(linear, randomness),
            next: 0,
            minus_two_log_likelihood: 0.0,
            columns,
            height,
            sensitivities: vec![[0.0; PANEL]; panels * height],
            begun: vec![false; panels],
        }
    }

    /// `-2 log L` of all measurements so far.
    pub(crate) fn minus_two_log_likelihood(&self) -> f64 {
        self.minus_two_log_likelihood
    }

    /// Goes on over the samples before `end`; `visit` as in [`whitened_rows`].
    pub(crate) fn advance(&mut self, forcing: &dyn Acting, end: usize, mut visit: impl FnMut(usize, f64, &[f64])) {
        while self.next < end {
            let to = end.min(self.next + STRETCH);
            vectorised!(FUSED => self.rows::<FUSED>(forcing, to, &mut visit));
        }
    }

    #[inline(always)]
    fn rows<const FUSED: bool>(
        &mut self,
        forcing: &dyn Acting,
        end: usize,
        visit: &mut impl FnMut(usize, f64, &[f64]),
    ) {
        let Self { linear, randomness, run, next: first, columns, height, sensitivities, begun, .. } = self;
        let (first, columns, height) = (std::mem::replace(first, end), *columns, *height);
        let filtered = run.advance(end, Keep::Gains);
        self.minus_two_log_likelihood = filtered.minus_two_log_likelihood;
        let (n, m, len) = (linear.states, linear.channels, linear.len);
        let (acting, w) = (n + randomness.estimated(), n + randomness.processes());
        let remembered = randomness.shown_by_channel(m);
        // Errors of forces move the states as the latent forces at their winches do.
        let errors = w - randomness.force_errors()..w;
        let winches = if errors.is_empty() { acting..acting } else { n + WRENCH..acting };
        let mut alone = vec![[0.0; PANEL]; winches.len()];
        let mut decay = vec![0.0; w - n];
        let panels = begun.len();
        let mut next = vec![[0.0; PANEL]; linear.padded];
        let mut transition = vec![0.0; linear.width() * linear.padded];
        // A sample's measurements, what each of their gains does to the ones after it, and their signatures, whitened.
        let mut used = Vec::with_capacity(m);
        let mut carried = vec![0.0; m * m];
        let mut whitened = vec![[0.0; PANEL]; m * panels];
        let mut minus_e = vec![[0.0; PANEL]; m];
        let (mut sensor, mut step) = (vec![0.0; m * columns], vec![0.0; n * columns]);
        for k in first..end {
            let kept = (k - first) * m;
            used.clear();
            used.extend((0..m).filter(|j| filtered.whitened[kept + j].is_finite()));
            for (a, &j) in used.iter().enumerate() {
                for (b, &before) in used[..a].iter().enumerate() {
                    let gain = filtered.gain(kept + before);
                    let by_states: f64 = linear.shown_by(k, j).map(|(c, hc)| hc * gain[c]).sum();
                    carried[a * m + b] = by_states + remembered[j].clone().map(|l| gain[n + l]).sum::<f64>();
                }
            }
            if k + 1 < len {
                randomness.decays(linear.interval[k], &mut decay);
                linear.columns(k, &mut transition);
            }
            // In one go: row by row and panel by panel each line would be waited for.
            forcing.at_sample(k, &mut sensor);
            if k + 1 < len {
                forcing.over_step(k, &mut step);
            }
            for (panel, (s, begun)) in sensitivities.chunks_exact_mut(height).zip(begun.iter_mut()).enumerate() {
                *begun = *begun || acts(&sensor, columns, panel) || acts(&step, columns, panel);
                if !*begun {
                    whitened.iter_mut().skip(panel).step_by(panels).for_each(|e| *e = [0.0; PANEL]);
                    continue;
                }
                for (a, &j) in used.iter().enumerate() {
                    let mut e = taken(&sensor[j * columns..(j + 1) * columns], panel);
                    for (c, slope) in linear.shown_by(k, j) {
                        e = plus::<PANEL, FUSED>(e, slope, &s[c]);
                    }
                    for l in remembered[j].clone() {
                        e = plus::<PANEL, FUSED>(e, 1.0, &s[n + l]);
                    }
                    for (carried, before) in carried[a * m..].iter().zip(&minus_e[..a]) {
                        e = plus::<PANEL, FUSED>(e, *carried, before);
                    }
                    let inverse = 1.0 / filtered.deviation[kept + j];
                    whitened[a * panels + panel] = e.map(|value| value * inverse);
                    minus_e[a] = e.map(|value| -value);
                }
                for (at, rows) in s.as_chunks_mut().0.iter_mut().enumerate() {
                    let mut sum = *rows;
                    for (j, minus_e) in used.iter().zip(&minus_e) {
                        plus_each::<FUSED>(&mut sum, block(filtered.gain(kept + j), at), minus_e);
                    }
                    *rows = sum;
                }
                if k + 1 == len {
                    continue;
                }
                alone.copy_from_slice(&s[winches.clone()]);
                for (winch, at) in winches.clone().cycle().zip(errors.clone()) {
                    let error = s[at];
                    add::<FUSED>(&mut s[winch], 1.0, &error);
                }
                for first in (0..n).step_by(BLOCK) {
                    let mut sum = [[0.0; PANEL]; BLOCK];
                    for (r, sum) in (first..n).zip(&mut sum) {
                        *sum = taken(&step[r * columns..(r + 1) * columns], panel);
                    }
                    for (column, row) in transition.chunks_exact(linear.padded).zip(&s[..acting]) {
                        plus_each::<FUSED>(&mut sum, block(column, first / BLOCK), row);
                    }
                    next[first..first + BLOCK].copy_from_slice(&sum);
                }
                s[winches.clone()].copy_from_slice(&alone);
                let (states, processes) = s.split_at_mut(n);
                states.copy_from_slice(&next[..n]);
                for (row, decay) in processes.iter_mut().zip(&decay) {
                    row.iter_mut().for_each(|value| *value *= decay);
                }
            }
            for (j, e) in used.iter().zip(whitened.chunks_exact(panels.max(1))) {
                visit(k * m + j, filtered.whitened[kept + j], &e.as_flattened()[..columns]);
            }
        }
    }
}

/// Whether any row has anything in a panel.
fn acts(rows: &[f32], columns: usize, panel: usize) -> bool {
    let range = panel * PANEL..columns.min((panel + 1) * PANEL);
    rows.chunks_exact(columns).any(|row| row[range.clone()].iter().any(|value| *value != 0.0))
}

/// The numbers of a panel; zeros where there are no more.
#[inline(always)]
fn taken(row: &[f32], panel: usize) -> Panel {
    let rest = &row[panel * PANEL..];
    match rest.first_chunk::<PANEL>() {
        Some(values) => std::array::from_fn(|i| f64::from(values[i])),
        None => std::array::from_fn(|i| rest.get(i).map_or(0.0, |value| f64::from(*value))),
    }
}
