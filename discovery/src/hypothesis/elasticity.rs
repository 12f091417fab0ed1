//! Elastic cables in the place of rigid ones.

use cdpr::effect::{EffectSpec, SpecError};

/// Axial stiffness (N) that a cable may have, softer than any rope and stiffer than any rod.
const PLAUSIBLE: [f64; 2] = [1e4, 1e10];

const ID: &str = "cable_elasticity";

/// Whether an effect makes rigid cables elastic.
pub(crate) fn is_elasticity(effect: &EffectSpec) -> bool {
    effect.id == ID
}

/// Cables of this axial stiffness (N) and damping (N.s).
pub(crate) fn elastic_cables(stiffness: f64, damping: f64) -> Result<EffectSpec, SpecError> {
    EffectSpec::new(ID, None, &[stiffness, damping])
}

/// Whether a cable may have this axial stiffness (N).
pub(crate) fn plausible(stiffness: f64) -> bool {
    stiffness.is_finite() && stiffness > PLAUSIBLE[0] && stiffness < PLAUSIBLE[1]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_cable_is_as_soft_as_wool_or_as_stiff_as_a_bridge() {
        let plausible: Vec<bool> = [f64::NAN, 1e3, 5e6, 1e11].map(plausible).into();
        assert_eq!(plausible, [false, false, true, false]);
    }
}
