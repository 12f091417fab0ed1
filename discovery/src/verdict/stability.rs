//! Whether an effect has the same size throughout: its size estimated in each of several blocks of time.
//!
//! One Gauss-Newton step from the final fit, in which the size of one effect may differ from block to block while its shape
//! and everything else is common to all blocks. The step uses the whitened derivatives of the final fit, so the latent
//! disturbances are allowed for.

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::filter::estimate::Fit;
use crate::outcome::{Block, Stability};
use crate::verdict::by_block::{ByBlock, Column};

/// Standard error, in multiples of the size, from which a block says nothing.
const NOTHING: f64 = 3.0;
/// The stability of every effect from index `first` on; `None` where the data give fewer than two blocks for it.
pub(crate) fn stability(fit: &Fit, by_block: &ByBlock, first: usize) -> Vec<Option<Stability>> {
    (first..fit.model.effects.len()).map(|effect| of_effect(fit, effect, by_block)).collect()
}

/// The weight of each column in the relative size of `effect`, and the columns of what else may move.
fn directions(fit: &Fit, effect: usize, columns: &[Column], gram: &DMatrix<f64>) -> (DVector<f64>, Vec<usize>) {
    let value = |c: usize| match columns[c] {
        Column::Parameter(free) => fit.model.effects[effect].values[free.parameter],
        Column::Expression(_) | Column::Clock(_) => 1.0,
    };
    let shape = |c: usize| match columns[c] {
        Column::Parameter(free) => fit.model.effects[effect].info().is_ok_and(|i| i.parameters[free.parameter].shape),
        Column::Expression(_) | Column::Clock(_) => false,
    };
    // An expression has its size; its numbers are part of that.
    let is_number = |c: usize| match columns[c] {
        Column::Parameter(free) => fit.model.effects[free.effect].expression.is_some(),
        Column::Expression(_) | Column::Clock(_) => false,
    };
    let own: Vec<usize> =
        (0..columns.len()).filter(|c| columns[*c].effect() == Some(effect) && !is_number(*c)).collect();
    let weight = |c: &usize| value(*c).powi(2) * gram[(*c, *c)];
    let strongest = |list: &[usize]| list.iter().copied().max_by(|a, b| weight(a).total_cmp(&weight(b)));
    let mut sizes: Vec<usize> = own.iter().copied().filter(|c| !shape(*c)).collect();
    if sizes.is_empty() {
        // A law that is all shape is as large as the parameter that shows most.
        sizes.extend(strongest(&own));
    }
    let main = strongest(&sizes);
    let mut size = DVector::zeros(columns.len());
    for c in sizes {
        size[c] = value(c);
    }
    let others = (0..columns.len()).filter(|c| Some(*c) != main && !is_number(*c) && gram[(*c, *c)] > 1e-12).collect();
    (size, others)
}

/// Least squares with one size of `effect` for each block.
fn of_effect(fit: &Fit, effect: usize, by_block: &ByBlock) -> Option<Stability> {
    let ByBlock { columns, blocks, normals: parts, .. } = by_block;
    let n = columns.len();
    let grams: Vec<DMatrix<f64>> = parts.iter().map(|p| DMatrix::from_row_slice(n, n, &p.gram)).collect();
    let rights: Vec<DVector<f64>> = parts.iter().map(|p| DVector::from_column_slice(&p.right)).collect();
    let gram: DMatrix<f64> = grams.iter().sum();
    let right: DVector<f64> = rights.iter().sum();
    let (size, others) = directions(fit, effect, columns, &gram);
    let told = |b: &usize| size.dot(&(&grams[*b] * &size)).sqrt() > 1.0 / NOTHING;
    let told: Vec<usize> = (0..blocks.len()).filter(told).collect();
    if told.len() < 2 {
        return None;
    }
    // Unknowns: the change of size in each block, then the common changes of everything else.
    let (k, q) = (told.len(), others.len());
    let mut matrix = DMatrix::zeros(k + q, k + q);
    let mut vector = DVector::zeros(k + q);
    for (slot, b) in told.iter().enumerate() {
        let column = &grams[*b] * &size;
        matrix[(slot, slot)] = size.dot(&column);
        vector[slot] = size.dot(&rights[*b]);
        for (at, other) in others.iter().enumerate() {
            matrix[(slot, k + at)] = column[*other];
            matrix[(k + at, slot)] = column[*other];
        }
    }
    for (a, row) in others.iter().enumerate() {
        vector[k + a] = right[*row];
        for (b, column) in others.iter().enumerate() {
            matrix[(k + a, k + b)] = gram[(*row, *column)];
        }
    }
    let scale = matrix.diagonal().map(|d| 1.0 / d.sqrt());
    let scaled =
        DMatrix::from_fn(k + q, k + q, |r, c| matrix[(r, c)] * scale[r] * scale[c] + if r == c { 1e-9 } else { 0.0 });
    let cholesky = scaled.cholesky()?;
    let change = cholesky.solve(&vector.component_mul(&scale)).component_mul(&scale);
    let (total, count) = parts.iter().fold((0.0, 0), |(t, c), p| (t + p.total, c + p.count));
    // Widened where the innovations are larger than the model says.
    let spread = (total / count.max(1) as f64).max(1.0);
    let inverse = cholesky.inverse();
    let covariance = DMatrix::from_fn(k, k, |r, c| spread * inverse[(r, c)] * scale[r] * scale[c]);
    let weights = covariance.clone().cholesky()?.inverse();
    let change = change.rows(0, k);
    let mean = (&weights * change).sum() / weights.sum();
    let off = change.map(|v| v - mean);
    let chi_square = off.dot(&(&weights * &off));
    let degrees = k - 1;
    // The variance between blocks by moments (R. DerSimonian and N. Laird, Meta-analysis in clinical trials, 1986).
    let (sum, squares) = (weights.diagonal().sum(), weights.diagonal().norm_squared());
    let spread = ((chi_square - degrees as f64).max(0.0) / (sum - squares / sum)).sqrt();
    let p_value = 1.0 - ChiSquared::new(degrees as f64).ok()?.cdf(chi_square);
    let blocks = told.iter().enumerate().map(|(slot, b)| Block {
        size: 1.0 + change[slot],
        standard_error: covariance[(slot, slot)].sqrt(),
        ..blocks[*b]
    });
    Some(Stability { blocks: blocks.collect(), chi_square, degrees, p_value, spread })
}

#[cfg(test)]
mod tests {
    use cdpr::effect::EffectSpec;

    use super::*;
    use crate::data::Trial;
    use crate::data::recording::{fitted, record};

    fn stability(fit: &Fit, trials: &[Trial], first: usize) -> Vec<Option<Stability>> {
        super::stability(fit, &ByBlock::new(fit, trials, first), first)
    }

    fn wind(force: f64) -> EffectSpec {
        EffectSpec::new("steady_wind", None, &[force, 0.0, 0.0]).expect("an effect")
    }

    #[test]
    fn a_constant_force_is_constant_in_every_block() {
        let trials = [record(&[wind(40.0)], 40.0, 2), record(&[wind(40.0)], 24.0, 3)];
        let [Some(stability)] = &stability(&fitted(&[wind(40.0)], &trials), &trials, 0)[..] else { panic!("one") };
        assert_eq!(stability.blocks.iter().map(|b| b.trial).collect::<Vec<_>>(), [0, 0, 0, 0, 0, 1, 1, 1]);
        assert_eq!(stability.degrees, 7);
        assert!(!stability.varies() && stability.chi_square < 20.0, "{stability:?}");
        for block in &stability.blocks {
            assert!((block.size - 1.0).abs() < 4.0 * block.standard_error, "{stability:?}");
            assert!(block.standard_error < 0.1, "{stability:?}");
        }
    }

    #[test]
    fn a_force_that_grows_is_found_growing() {
        let growing = EffectSpec::expression("platform.force_x", "time").expect("an effect");
        let trials = [record(&[growing], 80.0, 4)];
        let [Some(stability)] = &stability(&fitted(&[wind(40.0)], &trials), &trials, 0)[..] else { panic!("one") };
        assert!(stability.varies(), "{stability:?}");
        for block in &stability.blocks {
            let mean = 0.5 * (block.start + block.end) / 40.0;
            assert!((block.size - mean).abs() < 4.0 * block.standard_error, "{stability:?}");
        }
    }

    #[test]
    fn terms_have_a_size_too() {
        let term = EffectSpec::expression("platform.force_y", "30*x").expect("an effect");
        let trials = [record(std::slice::from_ref(&term), 40.0, 5)];
        let [Some(stability)] = &stability(&fitted(&[term], &trials), &trials, 0)[..] else { panic!("one") };
        assert!(stability.blocks.len() >= 3 && !stability.varies(), "{stability:?}");
    }
}
