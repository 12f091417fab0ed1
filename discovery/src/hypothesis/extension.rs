//! Laws with extensions: which of their parameters are in use, and what laws of friction have in common.

use std::f64::consts::FRAC_PI_2;

use cdpr::effect::EffectSpec;
use cdpr::model_file::Model;

/// Whether a parameter is in use: not one of an extension that is left out, not idle beside another, and not one that data show
/// only in its product with another, which is in use then.
pub(crate) fn in_use(spec: &EffectSpec, parameter: usize) -> bool {
    let in_product =
        spec.info().is_ok_and(|info| info.parameters.get(parameter).is_some_and(|p| p.in_product_with.is_some()));
    spec.takes_part(parameter) && !in_product
}

/// The number of parameters in use.
pub(crate) fn count_in_use(spec: &EffectSpec) -> usize {
    (0..spec.values.len()).filter(|parameter| in_use(spec, *parameter)).count()
}

/// The number of times at which effects begin or end; where one ends as another of its kind begins is one time.
pub(crate) fn count_times(effects: &[EffectSpec]) -> usize {
    let goes_on = |effect: &EffectSpec| {
        let same = |other: &&EffectSpec| (&other.id, other.cable) == (&effect.id, effect.cable);
        effect.from.is_some() && effects.iter().filter(same).any(|other| other.until == effect.from)
    };
    let times = |effect: &EffectSpec| {
        usize::from(effect.from.is_some() && !goes_on(effect)) + usize::from(effect.until.is_some())
    };
    effects.iter().map(times).sum()
}

/// `law` at work when `other` is; as it is where it cannot begin or end.
fn at_work_like(law: EffectSpec, other: &EffectSpec) -> EffectSpec {
    law.clone().during(other.from, other.until).unwrap_or(law)
}

/// `law` with the extensions that `other` has in use, where it knows them, and at work when `other` is.
pub(crate) fn extended_like(law: &EffectSpec, other: &EffectSpec) -> EffectSpec {
    let mut extended = at_work_like(law.clone(), other);
    let Ok(info) = other.info() else { return extended };
    for (k, parameter) in info.parameters.iter().enumerate() {
        if parameter.extension
            && in_use(other, k)
            && let Some(at) = index_of(&extended, parameter.name)
        {
            extended.values[at] = other.values[k];
        }
    }
    extended
}

/// The law `id` where it contains the law `standing`, from where it can show that it is more: Stribeck friction contains
/// Coulomb friction with the same turn, an umbilical linear drag.
pub(crate) fn containing(id: &str, standing: &EffectSpec) -> Option<EffectSpec> {
    if id == "umbilical" && standing.id == "platform_linear_drag" {
        let wider = EffectSpec::new(id, None, &[1.0, value_of(standing, "coefficient")?]).ok()?;
        return Some(at_work_like(wider, standing));
    }
    let plain = ["tail", "algebraic"].iter().all(|shape| value_of(standing, shape) == Some(0.0));
    if id != "winch_stribeck_friction" || standing.id != "winch_coulomb_friction" || !plain {
        return None;
    }
    let (force, transition) = (value_of(standing, "force")?, value_of(standing, "transition_speed")?);
    let law = EffectSpec::new(id, standing.cable, &[force, 1.05 * force, 0.1, 0.0, transition]).ok()?;
    Some(extended_like(&law, standing))
}

pub(crate) fn index_of(spec: &EffectSpec, name: &str) -> Option<usize> {
    spec.info().ok()?.parameters.iter().position(|parameter| parameter.name == name)
}

pub(crate) fn value_of(spec: &EffectSpec, name: &str) -> Option<f64> {
    index_of(spec, name).map(|at| spec.values[at])
}

/// `model` with parameters of effect `at` set, those that the effect has.
pub(crate) fn with(model: &Model, at: usize, values: &[(&str, f64)]) -> Model {
    let mut model = model.clone();
    for (name, value) in values {
        if let Some(parameter) = index_of(&model.effects[at], name) {
            model.effects[at].values[parameter] = *value;
        }
    }
    model
}

/// Laws of friction in a winch and its pulley that differ at first sight.
const FRICTION: [&str; 3] = ["winch_coulomb_friction", "winch_stribeck_friction", "pulley_capstan_loss"];
/// Friction round a pulley, of which the capstan loss is the first order.
const WRAP: &str = "pulley_wrap_friction";
/// The angle (rad) over which a cable is taken to lie on its pulleys, a quarter turn: data show its product with the friction.
const WRAP_ANGLE: f64 = FRAC_PI_2;

pub(crate) fn is_friction(effect: &EffectSpec) -> bool {
    is_friction_law(&effect.id)
}

pub(crate) fn is_friction_law(id: &str) -> bool {
    FRICTION.contains(&id) || id == WRAP
}

/// The law of which `law` is the first order, with the values at which the two are the same to that order. It is not looked for
/// by itself, for at first sight they are one, but tried as the form of the simpler one.
pub(crate) fn beyond_first_order(law: &EffectSpec) -> Option<EffectSpec> {
    if law.id != "pulley_capstan_loss" {
        return None;
    }
    let values = [value_of(law, "loss")? / WRAP_ANGLE, WRAP_ANGLE, value_of(law, "transition_speed")?];
    Some(at_work_like(EffectSpec::new(WRAP, law.cable, &values).ok()?, law))
}

/// Share of the winch force that a law of friction takes.
fn loss_of(effect: &EffectSpec) -> Option<f64> {
    let wrapped = || Some(value_of(effect, "friction")? * value_of(effect, "wrap_angle")?);
    value_of(effect, "loss").or_else(wrapped)
}

/// Force (N) of a law of friction that does not depend on the tension.
pub(crate) fn force_of(effect: &EffectSpec) -> Option<f64> {
    value_of(effect, "force").or(value_of(effect, "coulomb"))
}

/// The other laws of friction at the place of `effect`, of its size, at a mean tension (N).
pub(crate) fn kin_of(effect: &EffectSpec, tension: f64) -> Vec<EffectSpec> {
    let Some(force) = force_of(effect).or(loss_of(effect).map(|loss| loss * tension)) else {
        return Vec::new();
    };
    let values: [&[f64]; 3] = [&[force, 0.02], &[force, 1.3 * force, 0.1, 10.0], &[force / tension, 0.02]];
    let others = FRICTION.into_iter().zip(values).filter(|(id, _)| *id != effect.id);
    let law =
        |(id, values): (&str, &[f64])| Some(at_work_like(EffectSpec::new(id, effect.cable, values).ok()?, effect));
    others.filter_map(law).collect()
}

/// How far a law's presliding has got.
pub(crate) fn stage(effect: &EffectSpec) -> Stage {
    match (value_of(effect, "presliding_stiffness"), value_of(effect, "presliding_damping")) {
        (Some(stiffness), Some(damping)) if stiffness > 0.0 && damping > 0.0 => Stage::Complete,
        (Some(stiffness), _) if stiffness > 0.0 => Stage::Undamped,
        _ => Stage::Static,
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stage {
    /// No presliding.
    Static,
    /// Presliding without damping.
    Undamped,
    /// Presliding with all that belongs to it.
    Complete,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn effect(id: &str, values: &[f64]) -> EffectSpec {
        EffectSpec::new(id, Some(2), values).unwrap()
    }

    #[test]
    fn what_is_left_out_does_not_count() {
        let id = "winch_coulomb_friction";
        assert_eq!(count_in_use(&effect(id, &[100.0, 0.01])), 2);
        assert_eq!(count_in_use(&effect(id, &[100.0, 0.01, -0.1])), 3);
        // The bristle makes the turn, and the transition speed does nothing.
        assert_eq!(count_in_use(&effect(id, &[100.0, 0.01, 0.0, 0.0, 2e4])), 2);
        // A size of zero is a value, not an extension left out.
        assert_eq!(count_in_use(&effect("winch_stribeck_friction", &[100.0, 150.0, 0.1, 0.0])), 4);
    }

    #[test]
    fn kin_have_the_same_force_at_the_same_place() {
        let capstan = effect("pulley_capstan_loss", &[0.01, 0.02]);
        let kin = kin_of(&capstan, 15e3);
        let ids: Vec<&str> = kin.iter().map(|law| law.id.as_str()).collect();
        assert_eq!(ids, ["winch_coulomb_friction", "winch_stribeck_friction"]);
        assert!(kin.iter().all(|law| law.values[0] == 150.0 && law.cable == Some(2)), "{kin:?}");
        assert_eq!(kin_of(&kin[0], 15e3)[1].values, capstan.values);
        assert!(kin_of(&effect("winch_force_gain", &[0.01]), 15e3).is_empty());
    }

    /// Capstan loss stood for friction round a pulley, and a force gain of 0.01 % beside it for what was left of the exponential.
    #[test]
    fn friction_round_a_pulley_is_tried_in_place_of_the_capstan_loss() {
        let capstan = effect("pulley_capstan_loss", &[0.015, 0.012]);
        let wrap = beyond_first_order(&capstan).unwrap();
        assert_eq!((wrap.id.as_str(), wrap.cable), ("pulley_wrap_friction", Some(2)));
        let product = value_of(&wrap, "friction").unwrap() * value_of(&wrap, "wrap_angle").unwrap();
        assert!((product - 0.015).abs() < 1e-15 && value_of(&wrap, "transition_speed") == Some(0.012), "{wrap:?}");
        // Data show the product alone, so it is as simple a law.
        assert_eq!(count_in_use(&wrap), count_in_use(&capstan));
        assert!(is_friction(&wrap) && beyond_first_order(&wrap).is_none());
        assert_eq!(kin_of(&wrap, 15e3)[2], effect("pulley_capstan_loss", &[0.015, 0.02]));
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

    #[test]
    fn an_umbilical_contains_linear_drag() {
        let drag = EffectSpec::new("platform_linear_drag", None, &[50.0]).unwrap();
        let wider = containing("umbilical", &drag).unwrap();
        assert_eq!((value_of(&wider, "damping"), value_of(&wider, "stiffness")), (Some(50.0), Some(1.0)));
        assert!(containing("platform_linear_drag", &wider).is_none());
    }

    #[test]
    fn presliding_has_three_stages() {
        let law =
            |stiffness, damping| effect("winch_coulomb_friction", &[100.0, 0.01, 0.0, 0.0, stiffness, damping, 0.05]);
        assert_eq!(stage(&law(0.0, 0.0)), Stage::Static);
        assert_eq!(stage(&law(2e4, 0.0)), Stage::Undamped);
        assert_eq!(stage(&law(2e4, 500.0)), Stage::Complete);
        assert_eq!(stage(&effect("pulley_capstan_loss", &[0.01, 0.02])), Stage::Static);
    }

    #[test]
    fn a_rival_gets_the_extensions_that_it_knows() {
        let standing = effect("winch_coulomb_friction", &[100.0, 0.01, 0.3, 0.0, 2e4, 500.0]);
        let stribeck = extended_like(&effect("winch_stribeck_friction", &[90.0, 150.0, 0.1, 5.0]), &standing);
        assert_eq!(stribeck.values, [90.0, 150.0, 0.1, 5.0, 0.0, 2e4, 500.0, 0.0, 0.0]);
        let capstan = effect("pulley_capstan_loss", &[0.01, 0.02]);
        assert_eq!(extended_like(&capstan, &standing), capstan);
    }
}
