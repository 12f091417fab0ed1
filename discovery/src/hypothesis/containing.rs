//! Laws that contain others.

use cdpr::effect::EffectSpec;

use crate::hypothesis::extension::{at_work_like, value_of};
use crate::hypothesis::friction::{coulomb_contained, stribeck_containing};

/// The law `id` where it contains the law `standing`, from where it can show that it is more: Stribeck friction contains
/// Coulomb friction with the same turn and viscous friction, an umbilical linear drag.
pub(crate) fn containing(id: &str, standing: &EffectSpec) -> Option<EffectSpec> {
    umbilical_containing(id, standing).or_else(|| stribeck_containing(id, standing))
}

/// The law that `standing` contains, as it is in that: what has come in as the wider one may need no more. None where it contains
/// none, or turns within less than the catalogue lets that do.
pub(crate) fn contained(standing: &EffectSpec) -> Option<EffectSpec> {
    drag_contained(standing).or_else(|| coulomb_contained(standing))
}

/// The laws that `standing` is together where its numbers leave the range in which it is itself; none where it is no others. A spring to
/// a point that no cable reaches pulls with one force everywhere.
pub(crate) fn far_away(standing: &EffectSpec) -> Option<Vec<EffectSpec>> {
    if standing.id != "umbilical" {
        return None;
    }
    let of = |name: &str| value_of(standing, name);
    let stiffness = of("stiffness")?;
    let wind = EffectSpec::new("steady_wind", None, &[stiffness * of("x")?, stiffness * of("y")?, 0.0]).ok()?;
    Some([wind, drag_contained(standing)?].map(|law| at_work_like(law, standing)).to_vec())
}

fn drag_contained(standing: &EffectSpec) -> Option<EffectSpec> {
    if standing.id != "umbilical" {
        return None;
    }
    let drag = EffectSpec::new("platform_linear_drag", None, &[value_of(standing, "damping")?]).ok()?;
    Some(at_work_like(drag, standing))
}

fn umbilical_containing(id: &str, standing: &EffectSpec) -> Option<EffectSpec> {
    if id != "umbilical" || standing.id != "platform_linear_drag" {
        return None;
    }
    let wider = EffectSpec::new(id, None, &[1.0, value_of(standing, "coefficient")?]).ok()?;
    Some(at_work_like(wider, standing))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn effect(id: &str, values: &[f64]) -> EffectSpec {
        EffectSpec::new(id, Some(2), values).unwrap()
    }

    #[test]
    fn stribeck_friction_contains_coulomb_friction_with_the_same_turn() {
        let coulomb = effect("winch_coulomb_friction", &[100.0, 0.01, 0.0, 0.0, 2e4]);
        let wider = containing("winch_stribeck_friction", &coulomb).unwrap();
        assert_eq!(wider.values[..5], [100.0, 105.0, 0.1, 0.0, 0.01]);
        assert_eq!((value_of(&wider, "presliding_stiffness"), wider.cable), (Some(2e4), Some(2)));
        // It has no such turn.
        let algebraic = effect("winch_coulomb_friction", &[100.0, 0.01, 0.0, 0.3]);
        assert!(containing("winch_stribeck_friction", &algebraic).is_none());
        assert!(containing("pulley_capstan_loss", &coulomb).is_none());
        assert!(containing("winch_coulomb_friction", &wider).is_none());
    }

    /// Viscous friction of one winch of eight was "either viscous or Stribeck friction", of 0.02 N where it does not turn.
    #[test]
    fn stribeck_friction_contains_viscous_friction() {
        let viscous = effect("winch_viscous_friction", &[300.0]);
        let wider = containing("winch_stribeck_friction", &viscous).unwrap();
        assert_eq!((wider.values[3], wider.cable), (300.0, Some(2)));
        assert!(wider.values[0] > 0.0 && wider.values[1] > wider.values[0] && wider.values[1] < 10.0);
    }

    #[test]
    fn an_umbilical_contains_linear_drag() {
        let drag = EffectSpec::new("platform_linear_drag", None, &[50.0]).unwrap();
        let wider = containing("umbilical", &drag).unwrap();
        assert_eq!((value_of(&wider, "damping"), value_of(&wider, "stiffness")), (Some(50.0), Some(1.0)));
        assert!(containing("platform_linear_drag", &wider).is_none());
    }

    #[test]
    fn an_umbilical_that_is_far_away_is_a_wind_and_linear_drag() {
        let umbilical = EffectSpec::new("umbilical", None, &[0.01, 3.0, 100.0, -200.0]).unwrap();
        let parts = far_away(&umbilical).unwrap();
        assert_eq!(parts[0], EffectSpec::new("steady_wind", None, &[1.0, -2.0, 0.0]).unwrap());
        assert_eq!(parts[1], EffectSpec::new("platform_linear_drag", None, &[3.0]).unwrap());
        assert_eq!(far_away(&parts[1]), None);
    }

    #[test]
    fn a_law_is_contained_in_the_one_that_contains_it() {
        let coulomb = effect("winch_coulomb_friction", &[100.0, 0.01, 0.0, 0.0, 2e4]);
        let drag = EffectSpec::new("platform_linear_drag", None, &[50.0]).unwrap();
        for (law, wider) in [(coulomb, "winch_stribeck_friction"), (drag, "umbilical")] {
            let wider = containing(wider, &law).unwrap();
            assert_eq!(contained(&wider), Some(law.clone()));
            assert_eq!(contained(&law), None);
        }
    }
}
