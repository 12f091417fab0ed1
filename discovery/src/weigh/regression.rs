//! Which candidate explains the innovations best: least squares on whitened signatures at several latent sizes.

use cdpr::effect::EffectSpec;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::filter::kalman::Randomness;
use crate::filter::whiten::Normal;
use crate::hypothesis::candidates::{Candidate, Known, Library};
use crate::weigh::criterion::Penalty;

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
        levels.push(plain.without_latents());
        levels.extend(plain.has_latents().then_some(plain));
    }
    levels
}

/// All pairs of columns that some candidate needs together.
pub(crate) fn all_pairs(library: &Library) -> Vec<(usize, usize)> {
    pairs(library, &(0..library.columns.len()).collect::<Vec<_>>())
}

/// Pairs of columns (by their place in `columns`) that some candidate needs together.
pub(crate) fn pairs(library: &Library, columns: &[usize]) -> Vec<(usize, usize)> {
    let place = |c: usize| columns.binary_search(&c).ok();
    let mut out = Vec::new();
    for candidate in &library.candidates {
        let places: Vec<usize> = candidate.columns.iter().filter_map(|c| place(*c)).collect();
        for (k, a) in places.iter().enumerate() {
            out.extend(places[..=k].iter().map(|b| (*a.max(b), *a.min(b))));
        }
    }
    for (beside, _) in library.beside.iter().filter_map(|(c, known)| Some((place(*c)?, known))) {
        out.extend((0..columns.len()).map(|other| (beside.max(other), beside.min(other))));
    }
    out.sort_unstable();
    out.dedup();
    out
}

/// Share of a column that must be left when what is free beside it has explained what it can: less is rounding and the
/// errors of quick signatures.
const APART: f64 = 1e-4;

/// Share of each that is added to what is free, so that two that are alike, or one that says nothing, are no reason to move none.
const ALIKE: f64 = 1e-9;

/// What is free beside every candidate, at one size of what is random: it moves along with each of them, and what it explains
/// of a candidate the candidate does not explain (A. E. Beaton's sweep; the efficient score of a test with nuisance parameters).
pub(crate) struct Beside<'a> {
    beside: &'a [(usize, Known)],
    /// How much each of them moves with a unit of each column.
    moves: DMatrix<f64>,
    /// Where they are by themselves, and what that explains.
    alone: DVector<f64>,
    drop: f64,
}

impl<'a> Beside<'a> {
    pub(crate) fn new(library: &'a Library, normal: &Normal) -> Self {
        let (beside, all) = (&library.beside[..], normal.columns);
        let at = |r: usize, c: usize| normal.gram[beside[r].0 * all + c];
        let k = beside.len();
        let gram = DMatrix::from_fn(k, k, |r, c| {
            let own =
                if r == c { beside[r].1.precision + (ALIKE * at(r, beside[r].0)).max(f64::MIN_POSITIVE) } else { 0.0 };
            at(r, beside[c].0) + own
        });
        let right = DVector::from_fn(k, |r, _| normal.right[beside[r].0] + beside[r].1.mean * beside[r].1.precision);
        let (mut moves, mut alone) = (DMatrix::from_fn(k, all, at), right.clone());
        // Where they are no numbers nothing moves.
        match gram.cholesky() {
            Some(cholesky) => {
                cholesky.solve_mut(&mut moves);
                cholesky.solve_mut(&mut alone);
            }
            None => {
                moves.fill(0.0);
                alone.fill(0.0);
            }
        }
        let drop = alone.dot(&right);
        Self { beside, moves, alone, drop }
    }

    /// Takes from normal equations what is explained by what is free beside the candidates.
    pub(crate) fn take_from(&self, normal: &mut Normal) {
        if self.beside.is_empty() {
            return;
        }
        let all = normal.columns;
        let crossing: Vec<Vec<f64>> =
            self.beside.iter().map(|(c, _)| normal.gram[c * all..(c + 1) * all].to_vec()).collect();
        let whole: Vec<f64> = (0..all).map(|c| normal.gram[c * all + c]).collect();
        for (k, crossing) in crossing.iter().enumerate() {
            for (c, by) in crossing.iter().enumerate().filter(|(_, by)| **by != 0.0) {
                let row = &mut normal.gram[c * all..(c + 1) * all];
                row.iter_mut().zip(self.moves.row(k).iter()).for_each(|(slot, moves)| *slot -= by * moves);
                normal.right[c] -= by * self.alone[k];
            }
        }
        normal.minus_two_log_likelihood -= self.drop;
        let hidden = |c: &usize| normal.gram[c * all + c] <= APART * whole[*c];
        let mut silent: Vec<usize> = (0..all).filter(hidden).collect();
        silent.extend(self.beside.iter().map(|(c, _)| *c));
        normal.silence(&silent);
    }

    /// The same from a right side for which nothing is known beforehand.
    pub(crate) fn take_from_right(&self, right: &mut [f64]) {
        let own: Vec<f64> = self.beside.iter().map(|(c, _)| right[*c]).collect();
        for (c, slot) in right.iter_mut().enumerate() {
            *slot -= own.iter().enumerate().map(|(k, own)| own * self.moves[(k, c)]).sum::<f64>();
        }
    }
}

/// The normal equations of some columns among all; the others say nothing.
pub(crate) fn spread(small: &Normal, columns: &[usize], all: usize) -> Normal {
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

/// Length of a whitened column, in standard deviations of one measurement, at which it says nothing.
const NOTHING: f64 = 1e-6;

/// A solved subset of columns.
pub(crate) struct Subset {
    /// Amplitudes in the order of the columns.
    pub(crate) amplitudes: Vec<f64>,
    /// Fall of `-2 log L` by them.
    pub(crate) drop: f64,
}

/// Least squares on `columns` of `normal`; `None` where they are nearly dependent, or all say nothing. One that says nothing, as of the
/// torque of a wind where nothing shows the rotation, has no amplitude.
pub(crate) fn subset(normal: &Normal, columns: &[usize]) -> Option<Subset> {
    let n = normal.columns;
    let scale: Vec<f64> = columns.iter().map(|c| normal.gram[c * n + c].sqrt()).collect();
    let told: Vec<usize> = (0..columns.len()).filter(|at| scale[*at] > NOTHING).collect();
    if told.is_empty() || scale.iter().any(|scale| scale.is_nan()) {
        return None;
    }
    let own = |at: usize| columns[told[at]];
    let g = DMatrix::from_fn(told.len(), told.len(), |r, c| {
        normal.gram[own(r) * n + own(c)] / (scale[told[r]] * scale[told[c]]) + if r == c { 1e-9 } else { 0.0 }
    });
    let b = DVector::from_fn(told.len(), |r, _| normal.right[own(r)] / scale[told[r]]);
    let cholesky = g.cholesky()?;
    let x = cholesky.solve(&b);
    let drop = x.dot(&b);
    let mut amplitudes = vec![0.0; columns.len()];
    told.iter().zip(x.iter()).for_each(|(at, x)| amplitudes[*at] = x / scale[*at]);
    Some(Subset { amplitudes, drop })
}

/// Share of what a signature explains that it may miss, for it is taken along the trajectory without the law: signatures are exact
/// to 5 %. Where latent forces are so small that the data leave them no room, it is more than what laws differ by.
const INEXACT: f64 = 0.05 * 0.05;

/// A candidate as the regression sees it.
#[derive(Clone, Debug)]
pub(crate) struct Scored {
    pub(crate) candidate: usize,
    /// `-2 log L` with it, plus the penalty of its parameters.
    pub(crate) score: f64,
    /// The same by a fit that explains also what its signature may miss, at the level that is best then.
    pub(crate) promise: f64,
    /// Amplitudes of its columns.
    pub(crate) amplitudes: Vec<f64>,
    /// Level at which it does best.
    pub(crate) level: usize,
}

impl Scored {
    /// The candidate of a library with these amplitudes.
    pub(crate) fn effect(&self, library: &Library) -> Option<EffectSpec> {
        library.candidates[self.candidate].effect(&self.amplitudes)
    }
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
        let price = penalty.of(own + candidate.tried);
        let score = level.normal.minus_two_log_likelihood - solved.drop + price;
        let left = level.normal.total - solved.drop;
        let promise = score - left + promised(left, solved.drop, levels[0].normal.total);
        if let Some(best) = &mut best {
            best.promise = best.promise.min(promise);
        }
        if best.as_ref().is_none_or(|b| score < b.score) && candidate.effect(&solved.amplitudes[..own]).is_some() {
            let amplitudes = solved.amplitudes[..own].to_vec();
            let promise = best.map_or(promise, |best| best.promise.min(promise));
            best = Some(Scored { candidate: at, score, promise, amplitudes, level: at_level });
        }
    }
    best
}

/// A sum of squares with what a signature that explains `drop` may miss, down to what is noise.
fn promised(left: f64, drop: f64, noise: f64) -> f64 {
    (left - INEXACT * drop).max(noise).min(left)
}

/// `-2 log L` without any candidate, at the best level.
pub(crate) fn baseline(levels: &[Level]) -> f64 {
    levels.iter().map(|level| level.normal.minus_two_log_likelihood).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::recording::noise;

    /// Two columns that are candidates and two that are free beside them, of which nothing is known beforehand.
    #[test]
    fn a_column_beside_what_is_free_explains_what_both_do_and_the_free_alone_do_not() {
        let rows: Vec<[f64; 5]> = {
            let mut values = noise(5 * 400, 7);
            (0..400).map(|_| std::array::from_fn(|_| values.next().expect("noise"))).collect()
        };
        let mut normal = Normal::empty(4);
        for [a, b, c, d, e] in rows {
            // The first candidate is much like the free columns, and the innovations are made of all.
            let columns = [0.9 * c - 0.4 * d + 0.1 * a, b, c, d];
            normal.push(&columns, 0.3 * columns[0] + 0.5 * c + e);
        }
        normal.mirror();
        let mut library = Library::default();
        let free = Known { mean: 0.0, precision: 0.0 };
        library.beside = vec![(2, free), (3, free)];
        let whole = normal.clone();
        let beside = Beside::new(&library, &normal);
        beside.take_from(&mut normal);
        let drop = |columns: &[usize]| subset(&whole, columns).expect("independent columns").drop;
        for candidate in [0, 1] {
            let alone = subset(&normal, &[candidate]).expect("something is left of it").drop;
            let expected = drop(&[candidate, 2, 3]) - drop(&[2, 3]);
            assert!((alone - expected).abs() < 1e-6 * expected.max(1.0), "{candidate}: {alone} {expected}");
        }
        let fall = whole.minus_two_log_likelihood - normal.minus_two_log_likelihood;
        assert!((fall - drop(&[2, 3])).abs() < 1e-6 * fall, "{fall}");
        // Shifted innovations lose the same.
        let mut right = whole.right.clone();
        beside.take_from_right(&mut right);
        assert!((right[0] - normal.right[0]).abs() < 1e-9 * whole.right[0].abs(), "{right:?}");
        // A column that the free ones make up says nothing.
        let mut copy = whole.clone();
        for k in 0..4 {
            copy.gram[k] = whole.gram[8 + k];
        }
        (0..4).for_each(|k| copy.gram[4 * k] = copy.gram[k]);
        (copy.gram[0], copy.right[0]) = (whole.gram[10], whole.right[2]);
        Beside::new(&library, &copy).take_from(&mut copy);
        assert!(subset(&copy, &[0]).is_none());
    }

    /// What is known beforehand counts as a measurement: an amplitude known to be at its mean does not move.
    #[test]
    fn what_is_known_beforehand_holds_what_is_free() {
        let mut normal = Normal::empty(2);
        let values: Vec<f64> = noise(600, 8).collect();
        for row in values.as_chunks::<3>().0 {
            normal.push(&[row[0] + row[1], row[1]], row[0] + row[2]);
        }
        normal.mirror();
        let left = |precision: f64| {
            let mut library = Library::default();
            library.beside = vec![(1, Known { mean: 0.0, precision })];
            let mut normal = normal.clone();
            Beside::new(&library, &normal).take_from(&mut normal);
            normal.gram[0] / 200.0
        };
        // The variance of what the two have in common is half of the first.
        assert!((left(0.0) - 1.0).abs() < 0.2 && (left(1e9) - 2.0).abs() < 0.3, "{} {}", left(0.0), left(1e9));
    }

    /// Least squares of two columns against the solution by hand, `(XᵀX)⁻¹ Xᵀy`, and the fall of the sum of squares by it.
    #[test]
    fn a_subset_is_solved_as_in_the_textbook() {
        let rows: Vec<[f64; 3]> = noise(900, 9).collect::<Vec<_>>().as_chunks::<3>().0.to_vec();
        let mut normal = Normal::empty(3);
        for [a, b, e] in &rows {
            normal.push(&[*a, 0.7 * a + b, 1e3 * b], 2.0 * a - b + e);
        }
        normal.mirror();
        let sum = |f: &dyn Fn(&[f64; 3]) -> f64| rows.iter().map(f).sum::<f64>();
        let value = |[a, b, e]: &[f64; 3]| 2.0 * a - b + e;
        let (aa, ac, cc) =
            (sum(&|r| r[0] * r[0]), sum(&|r| r[0] * (0.7 * r[0] + r[1])), sum(&|r| (0.7 * r[0] + r[1]).powi(2)));
        let (ay, cy) = (sum(&|r| r[0] * value(r)), sum(&|r| (0.7 * r[0] + r[1]) * value(r)));
        let determinant = aa * cc - ac * ac;
        let wanted = [(cc * ay - ac * cy) / determinant, (aa * cy - ac * ay) / determinant];
        let solved = subset(&normal, &[0, 1]).expect("independent columns");
        let drop = wanted[0] * ay + wanted[1] * cy;
        assert!((solved.drop - drop).abs() < 1e-5 * drop, "{} {drop}", solved.drop);
        for (found, wanted) in solved.amplitudes.iter().zip(wanted) {
            assert!((found - wanted).abs() < 1e-5 * wanted.abs(), "{:?} {wanted}", solved.amplitudes);
        }
        // One that says nothing beside them.
        let mut beside = Normal::empty(3);
        rows.iter().for_each(|[a, b, e]| beside.push(&[*a, 0.0, 0.7 * a + b], 2.0 * a - b + e));
        beside.mirror();
        let told = subset(&beside, &[0, 1, 2]).expect("two columns that say something");
        assert!((told.drop - drop).abs() < 1e-5 * drop && told.amplitudes[1] == 0.0, "{:?}", told.amplitudes);
        assert!(subset(&beside, &[1]).is_none());
        // Three columns of two independent ones.
        assert!(subset(&normal, &[0, 1, 2]).is_none_or(|all| (all.drop - drop).abs() < 1e-3 * drop));
    }

    /// A gain of a winch left 35 358 of 987 285 at small latent forces, and 30 703 are noise: 2 380 may be what its signature misses.
    #[test]
    fn a_signature_may_miss_a_share_of_what_it_explains_and_no_noise() {
        assert!((promised(35_358.0, 951_927.0, 30_703.0) - 32_978.2).abs() < 0.1);
        assert_eq!(promised(31_000.0, 951_927.0, 30_703.0), 30_703.0);
        // What explains little misses little; where no more than noise is left, nothing is missed.
        assert!(promised(30_803.0, 100.0, 30_703.0) > 30_802.0);
        assert_eq!(promised(30_000.0, 951_927.0, 30_703.0), 30_000.0);
    }
}
