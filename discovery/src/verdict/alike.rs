//! How alike two effects are in the data at hand: the correlation of their whitened signatures.

use cdpr::effect::EffectSpec;

use crate::data::Trial;
use crate::filter::estimate::Fit;
use crate::filter::kalman::Randomness;
use crate::hypothesis::candidates::Combination;
use crate::hypothesis::stream::normals;

/// Correlation of what `effect` and each of `others` would add to the measurements of `trials`, in units of what is random
/// there; `fit` is of the model without them. The mean is not taken off: a constant is a signature too. `None` where one
/// of the two adds nothing or cannot be simulated.
pub(crate) fn likeness(
    fit: &Fit,
    randomness: &Randomness,
    trials: &[Trial],
    effect: &EffectSpec,
    others: &[EffectSpec],
) -> Vec<Option<f64>> {
    if others.is_empty() {
        return Vec::new();
    }
    let variations: Vec<EffectSpec> = [effect].into_iter().chain(others).cloned().collect();
    let columns: Vec<Combination> = (0..variations.len()).map(|at| vec![(at, 1.0)]).collect();
    let normal = &normals(fit, trials, (&variations, &columns), std::slice::from_ref(randomness), None)[0];
    let product = |a: usize, b: usize| normal.gram[a * normal.columns + b];
    (1..normal.columns)
        .map(|other| {
            let correlation = product(0, other) / (product(0, 0) * product(other, other)).sqrt();
            correlation.is_finite().then_some(correlation)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::recording::{fitted, record};

    #[test]
    fn twins_are_alike_and_strangers_are_not() {
        let trials = [record(&[], 30.0, 1)];
        let fit = fitted(&[], &trials);
        let spec = |id: &str, cable, values: &[f64]| EffectSpec::new(id, cable, values).expect("an effect");
        let alike = |a: &EffectSpec, others: &[EffectSpec]| -> Vec<f64> {
            let all = likeness(&fit, &fit.randomness, &trials, a, others);
            all.into_iter().map(|c| c.expect("a correlation")).collect()
        };
        let coulomb = spec("winch_coulomb_friction", Some(3), &[50.0, 0.02]);
        let capstan = spec("pulley_capstan_loss", Some(3), &[0.003, 0.02]);
        let elsewhere = spec("winch_coulomb_friction", Some(1), &[50.0, 0.02]);
        let found = alike(&coulomb, &[capstan, elsewhere]);
        assert!(found[0] > 0.99, "{found:?}");
        assert!(found[1].abs() < 0.9, "{found:?}");
        let drag = spec("platform_linear_drag", None, &[20.0]);
        let gain = |factor| spec("winch_force_gain", Some(2), &[factor]);
        let found = alike(&drag, &[gain(0.01), gain(-0.01), drag.clone()]);
        assert!(found[0].abs() < 0.3, "{found:?}");
        assert!((found[0] + found[1]).abs() < 0.01, "the opposite of it is as unlike: {found:?}");
        assert!((found[2] - 1.0).abs() < 1e-9, "{found:?}");
    }
}
