//! Limits of a winch's force.
//!
//! A limit that no force reaches says nothing of itself, so refinement never moves it. Where one limit of a winch stands,
//! the other one is therefore put among the forces, where it acts.

use cdpr::effect::EffectSpec;

use crate::hypothesis::candidates::Situation;

pub(crate) const ID: &str = "winch_saturation";
/// Share of the forces beyond a limit from which it is refined where the other one stands, and where none does.
const BEYOND: f64 = 0.05;
const BEYOND_AT_FIRST: f64 = 0.1;

/// Limits at a typical size: some of the commands beyond either.
pub(crate) fn typical(cable: Option<usize>, situation: &Situation) -> Option<EffectSpec> {
    let at = |share| situation.quantile(cable, share);
    EffectSpec::new(ID, cable, &[at(BEYOND_AT_FIRST), at(1.0 - BEYOND_AT_FIRST)]).ok()
}

/// The name and the value of the limit that an effect lacks, where it is one limit of a winch's force and none of the forces in a
/// situation reaches the other one.
pub(crate) fn other_limit(effect: &EffectSpec, situation: impl FnOnce() -> Situation) -> Option<(&'static str, f64)> {
    if effect.id != ID {
        return None;
    }
    let situation = situation();
    let quantile = |share: f64| situation.quantile(effect.cable, share);
    match effect.values[..] {
        [lower, _] if lower < quantile(0.0) => Some(("lower", quantile(BEYOND))),
        [_, upper] if upper > quantile(1.0) => Some(("upper", quantile(1.0 - BEYOND))),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::recording::record;

    #[test]
    fn the_limit_that_no_command_reaches_is_the_other_one() {
        let situation = Situation::of(&[record(&[], 20.0, 5)]);
        let at = |share: f64| situation.quantile(Some(2), share);
        let other = |lower: f64, upper: f64| {
            other_limit(&EffectSpec::new(ID, Some(2), &[lower, upper]).expect("an effect"), || situation.clone())
        };
        assert_eq!(other(at(0.2), 2.0 * at(1.0)), Some(("upper", at(0.95))));
        assert_eq!(other(0.5 * at(0.0), at(0.8)), Some(("lower", at(0.05))));
        assert_eq!(other(at(0.2), at(0.8)), None);
    }
}
