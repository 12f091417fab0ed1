//! Which candidate explains the innovations best: least squares on whitened signatures at several latent sizes.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::candidates::{Candidate, Library};
use crate::data::Trial;
use crate::estimate::Fit;
use crate::kalman::Randomness;
use crate::round::Signatures;
use crate::stream::normals;
use crate::whiten::Normal;

/// The normal equations of all columns at one size of the latent disturbances.
#[derive(Clone)]
pub(crate) struct Level {
    pub(crate) normal: Normal,
}

/// Sizes of latent disturbances at which candidates are weighed: a candidate that explains all makes them superfluous,
/// and shows its strength only where they are small.
pub(crate) fn ladder(randomness: &Randomness) -> Vec<Randomness> {
    let mut levels: Vec<Randomness> = Vec::new();
    for factor in [1.0, 0.2, 0.03, 0.0] {
        let scaled = |v: f64| (v * factor).max(randomness.smallest_latent());
        let level =
            Randomness { force: scaled(randomness.force), winch: scaled(randomness.winch), ..randomness.clone() };
        if !levels.iter().any(|l| l.same_latents(&level)) {
            levels.push(level);
        }
    }
    // What explains everything makes what the instruments seem to do superfluous as well.
    if randomness.has_instrument_noise() {
        let plain = randomness.with_white_noise();
        levels.extend([plain.without_latents(), plain]);
    }
    levels
}

/// Columns kept for the smaller levels: those of the candidates that do best at the largest.
const KEPT: usize = 40;

/// Forms the normal equations at every size: all columns at the first, the best candidates' columns at the others.
pub(crate) fn levels(fit: &Fit, trials: &[Trial], signatures: &Signatures, sizes: &[Randomness]) -> Vec<Level> {
    let library = &signatures.library;
    let mut out = vec![signatures.weighed(fit, trials, &sizes[0]).level];
    if sizes.len() > 1 {
        let best = rank(library, &out, Penalty::NONE);
        let mut columns: Vec<usize> =
            best.iter().take(KEPT).flat_map(|s| library.candidates[s.candidate].columns.clone()).collect();
        columns.sort_unstable();
        columns.dedup();
        let kept = library.of_columns(&columns);
        let pairs = pairs(library, &columns);
        let smaller = normals(fit, trials, (&kept.variations, &kept.columns), &sizes[1..], Some(&pairs));
        out.extend(smaller.iter().map(|small| Level { normal: spread(small, &columns, library.columns.len()) }));
    }
    out
}

/// All pairs of columns that some candidate needs together.
pub(crate) fn all_pairs(library: &Library) -> Vec<(usize, usize)> {
    pairs(library, &(0..library.columns.len()).collect::<Vec<_>>())
}

/// Pairs of columns (by their place in `columns`) that some candidate needs together.
fn pairs(library: &Library, columns: &[usize]) -> Vec<(usize, usize)> {
    let place = |c: usize| columns.binary_search(&c).ok();
    let mut out = Vec::new();
    for candidate in &library.candidates {
        let places: Vec<usize> = candidate.columns.iter().filter_map(|c| place(*c)).collect();
        for (k, a) in places.iter().enumerate() {
            out.extend(places[..=k].iter().map(|b| (*a.max(b), *a.min(b))));
        }
    }
    out.sort_unstable();
    out.dedup();
    out
}

/// The normal equations of some columns among all; the others say nothing.
fn spread(small: &Normal, columns: &[usize], all: usize) -> Normal {
    let mut normal = Normal::empty(all);
    for (a, &ca) in columns.iter().enumerate() {
        normal.right[ca] = small.right[a];
        for (b, &cb) in columns.iter().enumerate() {
            normal.gram[ca * all + cb] = small.gram[a * small.columns + b];
        }
    }
    (normal.total, normal.count) = (small.total, small.count);
    normal.minus_two_log_likelihood = small.minus_two_log_likelihood;
    normal
}

/// A solved subset of columns.
pub(crate) struct Subset {
    /// Amplitudes in the order of the columns.
    pub(crate) amplitudes: Vec<f64>,
    /// Fall of `-2 log L` by them.
    pub(crate) drop: f64,
}

/// Least squares on `columns` of `normal`; `None` where they are nearly dependent or say nothing.
pub(crate) fn subset(normal: &Normal, columns: &[usize]) -> Option<Subset> {
    let n = normal.columns;
    let scale: Vec<f64> = columns.iter().map(|c| normal.gram[c * n + c].sqrt()).collect();
    if scale.iter().any(|s| s.is_nan() || *s <= 1e-6) {
        return None;
    }
    let k = columns.len();
    let g = DMatrix::from_fn(k, k, |r, c| {
        normal.gram[columns[r] * n + columns[c]] / (scale[r] * scale[c]) + if r == c { 1e-9 } else { 0.0 }
    });
    let b = DVector::from_fn(k, |r, _| normal.right[columns[r]] / scale[r]);
    let cholesky = g.cholesky()?;
    let x = cholesky.solve(&b);
    let drop = x.dot(&b);
    Some(Subset { amplitudes: x.iter().zip(&scale).map(|(x, s)| x / s).collect(), drop })
}

/// What parameters cost: the extended BIC (J. Chen and Z. Chen, Biometrika 95 (2008)), `ln n` for each parameter and
/// `2 ln p` for each choice among `p` candidates.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Penalty {
    parameter: f64,
    choice: f64,
}

impl Penalty {
    /// No cost.
    pub(crate) const NONE: Self = Self { parameter: 0.0, choice: 0.0 };

    /// For `count` measurements and a catalogue of some 200 candidates.
    pub(crate) fn new(count: usize) -> Self {
        Self { parameter: (count.max(2) as f64).ln(), choice: 2.0 * 200.0_f64.ln() }
    }

    /// Of so many parameters of something that is not chosen among many.
    pub(crate) fn of_parameters(self, parameters: usize) -> f64 {
        self.parameter * parameters as f64
    }

    /// Of so many times at which effects begin or end: each is a parameter, and a choice among many.
    pub(crate) fn of_times(self, times: usize) -> f64 {
        self.of(1) * times as f64
    }

    /// Of one effect with so many parameters.
    pub(crate) fn of(self, parameters: usize) -> f64 {
        self.choice + self.parameter * parameters as f64
    }
}

/// A candidate as the regression sees it.
#[derive(Clone, Debug)]
pub(crate) struct Scored {
    pub(crate) candidate: usize,
    /// `-2 log L` with it, plus the penalty of its parameters.
    pub(crate) score: f64,
    /// Amplitudes of its columns.
    pub(crate) amplitudes: Vec<f64>,
    /// Level at which it does best.
    pub(crate) level: usize,
}

/// Weighs every candidate, the best first. Amplitudes that no parameter values have are not considered.
pub(crate) fn rank(library: &Library, levels: &[Level], penalty: Penalty) -> Vec<Scored> {
    let mut all: Vec<Scored> = library
        .candidates
        .par_iter()
        .enumerate()
        .filter_map(|(at, candidate)| best_level(candidate, at, levels, penalty))
        .collect();
    all.sort_by(|a, b| a.score.total_cmp(&b.score));
    all
}

fn best_level(candidate: &Candidate, at: usize, levels: &[Level], penalty: Penalty) -> Option<Scored> {
    let own = candidate.columns.len();
    let mut best: Option<Scored> = None;
    for (at_level, level) in levels.iter().enumerate() {
        let Some(solved) = subset(&level.normal, &candidate.columns) else { continue };
        let score = level.normal.minus_two_log_likelihood - solved.drop + penalty.of(own + candidate.tried);
        if best.as_ref().is_none_or(|b| score < b.score) && candidate.effect(&solved.amplitudes[..own]).is_some() {
            let amplitudes = solved.amplitudes[..own].to_vec();
            best = Some(Scored { candidate: at, score, amplitudes, level: at_level });
        }
    }
    best
}

/// `-2 log L` without any candidate, at the best level.
pub(crate) fn baseline(levels: &[Level]) -> f64 {
    levels.iter().map(|level| level.normal.minus_two_log_likelihood).fold(f64::INFINITY, f64::min)
}
