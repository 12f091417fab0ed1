//! Laws of friction in a winch and its pulley: what they have in common, from where they are refined, which forms they have.

use std::f64::consts::FRAC_PI_2;

use cdpr::effect::EffectSpec;
use cdpr::model_file::Model;

use crate::hypothesis::candidates::is_there;
use crate::hypothesis::extension::{at_work_like, extended_like, value_of, with};

const VISCOUS: &str = "winch_viscous_friction";
const COULOMB: &str = "winch_coulomb_friction";
const STRIBECK: &str = "winch_stribeck_friction";
const CAPSTAN: &str = "pulley_capstan_loss";
/// Laws of friction in a winch and its pulley that differ at first sight.
const FRICTION: [&str; 3] = [COULOMB, STRIBECK, CAPSTAN];
/// Friction round a pulley, of which the capstan loss is the first order.
const WRAP: &str = "pulley_wrap_friction";
/// The angle (rad) over which a cable is taken to lie on its pulleys, a quarter turn: data show its product with the friction.
const WRAP_ANGLE: f64 = FRAC_PI_2;

/// Whether an effect is a law of friction in a winch or its pulley.
pub(crate) fn is_friction(effect: &EffectSpec) -> bool {
    is_friction_law(&effect.id)
}

/// Whether the law `id` is one of these.
pub(crate) fn is_friction_law(id: &str) -> bool {
    FRICTION.contains(&id) || id == WRAP
}

/// The law of which `law` is the first order, with the values at which the two are the same to that order. It is not looked for
/// by itself, for at first sight they are one, but tried as the form of the simpler one.
pub(crate) fn beyond_first_order(law: &EffectSpec) -> Option<EffectSpec> {
    if law.id != CAPSTAN {
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

/// Speed (m/s) over which a law of friction turns its sign.
pub(crate) fn turning_speed(effect: &EffectSpec) -> Option<f64> {
    let speed = is_friction(effect).then(|| value_of(effect, "transition_speed"))??;
    if speed > 0.0 { Some(speed) } else { value_of(effect, "stribeck_speed").map(|speed| 0.1 * speed) }
}

/// Force (N) of a law of friction that does not depend on the tension.
fn force_of(effect: &EffectSpec) -> Option<f64> {
    value_of(effect, "force").or(value_of(effect, "coulomb"))
}

/// The other laws of friction at the place of effect `at`, of its size, at a mean tension (N), that can stand beside the others: none
/// acts twice on one cable at one time.
pub(crate) fn kin_of(effects: &[EffectSpec], at: usize, tension: f64) -> Vec<EffectSpec> {
    let effect = &effects[at];
    let Some(force) = force_of(effect).or(loss_of(effect).map(|loss| loss * tension)) else {
        return Vec::new();
    };
    let values: [&[f64]; 3] = [&[force, 0.02], &[force, 1.3 * force, 0.1, 10.0], &[force / tension, 0.02]];
    let others = FRICTION.into_iter().zip(values).filter(|(id, _)| *id != effect.id);
    let law =
        |(id, values): (&str, &[f64])| Some(at_work_like(EffectSpec::new(id, effect.cable, values).ok()?, effect));
    let beside = || effects.iter().enumerate().filter(|(k, _)| *k != at).map(|(_, beside)| beside);
    others.filter_map(law).filter(|law| !beside().any(|beside| acts_where(beside, law))).collect()
}

/// Whether two effects are the same law, on one cable at least and for some time at once.
fn acts_where(effect: &EffectSpec, other: &EffectSpec) -> bool {
    let begins_before_end =
        |a: &EffectSpec, b: &EffectSpec| a.from.unwrap_or(f64::NEG_INFINITY) < b.until.unwrap_or(f64::INFINITY);
    is_there(effect, &other.id, other.cable) && begins_before_end(effect, other) && begins_before_end(other, effect)
}

/// How far a law's presliding has got.
pub(crate) fn stage(effect: &EffectSpec) -> Stage {
    match (value_of(effect, "presliding_stiffness"), value_of(effect, "presliding_damping")) {
        (Some(stiffness), Some(damping)) if stiffness > 0.0 && damping > 0.0 => Stage::Complete,
        (Some(stiffness), _) if stiffness > 0.0 => Stage::Undamped,
        _ => Stage::Static,
    }
}

/// Stages of a law with presliding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stage {
    /// No presliding.
    Static,
    /// Presliding without damping.
    Undamped,
    /// Presliding with all that belongs to it.
    Complete,
}

/// A law without presliding, from where it is refined.
pub(crate) const STATIC: [(&str, f64); 4] =
    [("presliding_stiffness", 0.0), ("presliding_damping", 0.0), ("damping_speed", 0.0), ("transition_speed", 0.01)];
/// Difference between the two directions, with the value from which it is refined.
pub(crate) const ASYMMETRY: (&str, f64) = ("asymmetry", 0.1);
/// Parameters that shape how friction turns its sign, each tried where the one before it helped.
pub(crate) const TURN: [(&str, f64); 3] = [("transition_speed", 0.01), ("tail", 0.2), ("algebraic", 0.2)];

/// Deflections (m) at which friction may begin to slide.
const DEFLECTIONS: [f64; 2] = [1e-3, 2e-2];
/// Ratio of damping and stiffness (s) before sliding from which the search starts.
const DAMPING_TIME: f64 = 0.03;
/// Speeds (m/s) at which that damping may fade.
const DAMPING_SPEEDS: [f64; 2] = [0.02, 0.1];

/// Models with presliding of the `able` laws, at their places in `model`, without damping, in place of the shapes of static ones.
pub(crate) fn presliding_starts(model: &Model, able: &[(usize, EffectSpec)]) -> [Model; 2] {
    DEFLECTIONS.map(|deflection| {
        let mut model = model.clone();
        for (at, law) in able {
            model.effects[*at] = law.clone();
            let stiffness = force_of(law).unwrap_or_default() / deflection;
            let values = [("tail", 0.0), ("algebraic", 0.0), ("presliding_stiffness", stiffness)];
            model = with(&model, *at, &values);
        }
        model
    })
}

/// Models with damping wherever the presliding of an effect from `first` on has none.
pub(crate) fn damped_starts(model: &Model, first: usize) -> [Model; 2] {
    DAMPING_SPEEDS.map(|speed| {
        let mut model = model.clone();
        for at in first..model.effects.len() {
            let effect = &model.effects[at];
            if is_friction(effect) && stage(effect) == Stage::Undamped {
                let damping = DAMPING_TIME * value_of(effect, "presliding_stiffness").unwrap_or_default();
                let values = [("presliding_damping", damping), ("damping_speed", speed)];
                model = with(&model, at, &values);
            }
        }
        model
    })
}

/// The force bias that a law, unlike in its two directions, is while its winch moves.
pub(crate) fn bias_of(law: &EffectSpec) -> Option<EffectSpec> {
    let bias = force_of(law)? * value_of(law, ASYMMETRY.0)?;
    EffectSpec::new("winch_force_bias", law.cable, &[bias]).ok()
}

/// Friction at a typical size, as a share of the mean tension.
const TYPICAL: f64 = 0.0075;

/// Friction of a typical size, at a mean tension (N), with the rivals that it would have.
pub(crate) fn typical(cable: Option<usize>, tension: f64) -> Option<(EffectSpec, Vec<EffectSpec>)> {
    let force = TYPICAL * tension;
    let effect = |id: &str, values: &[f64]| EffectSpec::new(id, cable, values).ok();
    let rivals = [effect(STRIBECK, &[force, 1.3 * force, 0.1, 0.07 * force]), effect(CAPSTAN, &[TYPICAL, 0.02])];
    Some((effect(COULOMB, &[force, 0.02])?, rivals.into_iter().flatten().collect()))
}

/// Friction of a typical size on all winches, at a mean tension (N): of its own level, and in proportion to the force.
pub(crate) fn on_all_winches(tension: f64) -> impl Iterator<Item = EffectSpec> {
    let (own_level, rivals) = typical(None, tension).unzip();
    own_level.into_iter().chain(rivals.into_iter().flatten().filter(|law| law.id == CAPSTAN))
}

/// Stribeck friction from where it can show that it is more than the law that stands: Coulomb friction with the same turn, or viscous
/// friction.
pub(crate) fn stribeck_containing(id: &str, standing: &EffectSpec) -> Option<EffectSpec> {
    if id != STRIBECK {
        return None;
    }
    let speed = 0.1;
    let [force, viscous, transition] = match standing.id.as_str() {
        COULOMB if ["tail", "algebraic"].iter().all(|shape| value_of(standing, shape) == Some(0.0)) => {
            [value_of(standing, "force")?, 0.0, value_of(standing, "transition_speed")?]
        }
        // Dry friction of a twentieth of what damping is at that speed.
        VISCOUS => {
            let coefficient = value_of(standing, "coefficient")?;
            [0.05 * speed * coefficient, coefficient, 0.0]
        }
        _ => return None,
    };
    // Of numbers that no such law can have there is none.
    let law = EffectSpec::new(id, standing.cable, &[force, 1.05 * force, speed, viscous, transition]).ok()?;
    Some(extended_like(&law, standing))
}

/// The Coulomb friction that Stribeck friction contains, with the same turn.
pub(crate) fn coulomb_contained(law: &EffectSpec) -> Option<EffectSpec> {
    if law.id != STRIBECK {
        return None;
    }
    let simpler = EffectSpec::new(COULOMB, law.cable, &[value_of(law, "coulomb")?, turning_speed(law)?]).ok()?;
    Some(extended_like(&simpler, law))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hypothesis::extension::count_in_use;

    fn effect(id: &str, values: &[f64]) -> EffectSpec {
        EffectSpec::new(id, Some(2), values).unwrap()
    }

    #[test]
    fn kin_have_the_same_force_at_the_same_place() {
        let capstan = effect("pulley_capstan_loss", &[0.01, 0.02]);
        let alone = |law: &EffectSpec| kin_of(std::slice::from_ref(law), 0, 15e3);
        let kin = alone(&capstan);
        let ids: Vec<&str> = kin.iter().map(|law| law.id.as_str()).collect();
        assert_eq!(ids, ["winch_coulomb_friction", "winch_stribeck_friction"]);
        assert!(kin.iter().all(|law| law.values[0] == 150.0 && law.cable == Some(2)), "{kin:?}");
        assert_eq!(alone(&kin[0])[1].values, capstan.values);
        assert!(alone(&effect("winch_force_gain", &[0.01])).is_empty());
    }

    /// On a real robot the capstan loss of all winches was to be friction, which winch 2 had, and no model could be built.
    #[test]
    fn kin_do_not_act_twice_on_one_cable_at_one_time() {
        let all = EffectSpec { cable: None, ..effect("pulley_capstan_loss", &[0.01, 0.02]) };
        let of_one = effect("winch_coulomb_friction", &[150.0, 0.02]);
        let kin = |effects: &[EffectSpec], at: usize| -> Vec<String> {
            kin_of(effects, at, 15e3).into_iter().map(|law| law.id).collect()
        };
        let beside = [all.clone(), of_one.clone()];
        assert_eq!([kin(&beside, 0), kin(&beside, 1)].concat(), ["winch_stribeck_friction"; 2]);
        let ended = [EffectSpec { from: Some(30.0), ..all }, EffectSpec { until: Some(30.0), ..of_one }];
        assert_eq!(kin(&ended, 0), ["winch_coulomb_friction", "winch_stribeck_friction"]);
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
        assert_eq!(kin_of(std::slice::from_ref(&wrap), 0, 15e3)[2], effect("pulley_capstan_loss", &[0.015, 0.02]));
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

    /// Presliding begins at a deflection, and gets damping where it has none.
    #[test]
    fn presliding_starts_from_two_deflections_and_two_speeds() {
        let id = "winch_coulomb_friction";
        let plain = Model { effects: vec![effect(id, &[100.0, 0.01, 0.2, 0.1])], ..Model::default() };
        let starts = presliding_starts(&plain, &[(0, plain.effects[0].clone())]);
        let stiffness = |model: &Model| value_of(&model.effects[0], "presliding_stiffness");
        assert_eq!(starts.each_ref().map(stiffness), [Some(1e5), Some(5e3)]);
        assert!(starts.iter().all(|model| value_of(&model.effects[0], "tail") == Some(0.0)));
        let damped = damped_starts(&starts[1], 0);
        let speed = |model: &Model| value_of(&model.effects[0], "damping_speed");
        assert_eq!(damped.each_ref().map(speed), [Some(0.02), Some(0.1)]);
        assert_eq!(value_of(&damped[0].effects[0], "presliding_damping"), Some(150.0));
        assert!(damped_starts(&starts[1], 1).iter().all(|model| stage(&model.effects[0]) == Stage::Undamped));
    }
}
