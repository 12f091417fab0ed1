//! What is estimated of a model: the parameters that are free, and the steps by which they are varied.

use std::f64::consts::TAU;
use std::ops::RangeInclusive;

use cdpr::effect::ParameterInfo;
use cdpr::model_file::Model;

use crate::hypothesis::correction::smallest;
use crate::hypothesis::extension::{in_use, index_of};
use crate::hypothesis::term;
use crate::model::sizes::Sizes;

/// Factor beyond what is met in practice by which shapes are searched for.
const FROM_TYPICAL: f64 = 10.0;

/// A parameter of the model that is estimated: effect index and parameter index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Free {
    pub(crate) effect: usize,
    pub(crate) parameter: usize,
}

/// Parameters of the model's effects from index `first` on, without extensions of a law that are left out.
pub(crate) fn free_parameters(model: &Model, first: usize) -> Vec<Free> {
    let mut free = Vec::new();
    for (effect, spec) in model.effects.iter().enumerate().skip(first) {
        let used = (0..spec.values.len()).filter(|parameter| in_use(spec, *parameter));
        free.extend(used.map(|parameter| Free { effect, parameter }));
    }
    free
}

/// Everything that can be estimated of the effects from `first` on, the numbers of terms among it.
pub(crate) fn free_values(model: &Model, first: usize) -> Vec<Free> {
    let mut free = free_parameters(model, first);
    for (effect, spec) in model.effects.iter().enumerate().skip(first).filter(|(_, spec)| spec.expression.is_some()) {
        free.extend((0..term::values(spec).len()).map(|parameter| Free { effect, parameter }));
    }
    free
}

/// The range of a shape that is a factor beyond what is met in practice, on a robot of these sizes. What is met says nothing of
/// a robot of another size where a shape has its force in it; a point is within reach.
pub(crate) fn range_of_shape(parameter: &ParameterInfo, sizes: &Sizes, factor: f64) -> (f64, f64) {
    let (low, high) = parameter.typical;
    match parameter.unit {
        "1" | "s" | "rad" | "rad/s" | "m/s" if low > 0.0 => (low / factor, factor * high),
        "1" | "s" | "rad" | "rad/s" | "m/s" => (factor * low, factor * high),
        "m" => (parameter.min.max(-sizes.reach), sizes.reach),
        _ => (parameter.min, parameter.max),
    }
}

/// Step for differences in a parameter.
pub(crate) fn parameter_step(model: &Model, free: Free) -> f64 {
    let spec = &model.effects[free.effect];
    if spec.expression.is_some() {
        return term::step(spec, free.parameter);
    }
    let (typical, unit) = spec
        .info()
        .map_or(((0.0, 1.0), ""), |i| (i.parameters[free.parameter].typical, i.parameters[free.parameter].unit));
    let scale = typical.0.abs().max(typical.1.abs());
    let scale = if scale > 0.0 { scale } else { 1.0 };
    // What is typical of a large robot is far too much for a small one.
    let scale = Sizes::of(&model.parameters).of_unit(unit).map_or(scale, |size| scale.min(size));
    let step = 1e-3 * spec.values[free.parameter].abs().max(1e-2 * scale);
    // Along a cable a wave has turned by the angle l/λ, which must not change by a turn.
    let is_wave = |(name, _): &&(&str, f64)| unit == "m" && index_of(spec, name) == Some(free.parameter);
    WAVES.iter().find(is_wave).map_or(step, |(_, turn)| {
        let radian = spec.values[free.parameter] / turn;
        step.min(1e-2 * turn * radian * radian / Sizes::of(&model.parameters).reach)
    })
}

/// Parameters that are the length of a wave along what a winch has paid out, and how many radians of the wave one such length is.
const WAVES: [(&str, f64); 2] = [("drum_radius", 1.0), ("period", TAU)];

/// Moves one parameter within its bounds.
pub(crate) fn move_parameter(model: &mut Model, free: Free, change: f64) {
    let range = range_of_move(model, free);
    let spec = &mut model.effects[free.effect];
    let moved = between(term::values(spec)[free.parameter] + change, *range.start(), *range.end());
    *spec = term::with_value(spec, free.parameter, moved);
}

/// The changes of a parameter that a move may make, nothing among them.
pub(crate) fn range_of_change(model: &Model, free: Free) -> RangeInclusive<f64> {
    let (range, before) = (range_of_move(model, free), term::values(&model.effects[free.effect])[free.parameter]);
    (range.start() - before).min(0.0)..=(range.end() - before).max(0.0)
}

/// Where a move may lead a parameter. Sizes enter the model nearly linearly and move as far as they like; a shape changes at most
/// fourfold, and an angle by half a radian.
fn range_of_move(model: &Model, free: Free) -> RangeInclusive<f64> {
    let sizes = Sizes::of(&model.parameters);
    let spec = &model.effects[free.effect];
    let all = f64::NEG_INFINITY..=f64::INFINITY;
    if spec.expression.is_some() {
        return all;
    }
    let Ok(info) = spec.info() else { return all };
    let parameter = &info.parameters[free.parameter];
    let (typical, before) = (parameter.typical, spec.values[free.parameter]);
    let (mut low, mut high) = (smallest(parameter, &sizes), parameter.max);
    let mut within = |one: f64, other: f64| {
        (low, high) = (between(one.min(other), low, high), between(one.max(other), low, high));
    };
    if parameter.unit == "rad" {
        within(before - 0.5, before + 0.5);
    }
    if parameter.shape {
        if typical.0 > 0.0 {
            within(0.25 * before, 4.0 * before);
        }
        // Shapes stay where the law is itself.
        let (least, most) = range_of_shape(parameter, &sizes, FROM_TYPICAL);
        within(least, most);
    } else if parameter.min == 0.0 {
        within(1e-6 * before.max(0.05 * typical.1), f64::INFINITY);
    }
    low..=high
}

/// The value nearest to `value` between two bounds in any order: those of a parameter below zero come the other way round.
fn between(value: f64, one: f64, other: f64) -> f64 {
    if value.is_nan() { value } else { value.max(one.min(other)).min(one.max(other)) }
}

#[cfg(test)]
mod tests {
    use cdpr::effect::EffectSpec;
    use cdpr::parameters::Parameters;

    use super::*;

    /// Upper limits of a force were held at 100 N at least on robots of any size: on large ones they are 1 to 100 kN.
    #[test]
    fn what_is_met_on_large_robots_says_nothing_of_forces_on_others() {
        let sizes = Sizes::of(&Parameters::default());
        let range = |id: &str, name: &str| {
            let info = cdpr::effect::find(id).expect("an effect");
            let parameter = info.parameters.iter().find(|parameter| parameter.name == name).expect("a parameter");
            range_of_shape(parameter, &sizes, 10.0)
        };
        assert_eq!(range("winch_saturation", "upper"), (f64::NEG_INFINITY, f64::INFINITY));
        assert_eq!(range("cable_creep", "axial_stiffness"), (1.0, f64::INFINITY));
        assert_eq!(range("cable_creep", "time_constant"), (0.1, 1e5));
        assert_eq!(range("periodic_gust", "phase"), (-32.0, 32.0));
        assert_eq!(range("umbilical", "x"), (-sizes.reach, sizes.reach));
    }

    /// The angle by which a drum of 0.3 m turns over 900 m changes by 3 rad where the radius does by a thousandth.
    #[test]
    fn waves_along_a_cable_are_not_varied_by_a_turn() {
        let drum = EffectSpec::new("winch_drum_eccentricity", Some(1), &[0.01, 0.3, 0.4]).unwrap();
        let model = Model { effects: vec![drum], ..Model::default() };
        let step = parameter_step(&model, Free { effect: 0, parameter: 1 });
        assert!(step > 0.0 && step * 900.0 / (0.3 * 0.3) < 0.1, "{step}");
        let ripple = EffectSpec::new("winch_torque_ripple", Some(1), &[60.0, 1.3, 0.5]).unwrap();
        let model = Model { effects: vec![ripple], ..Model::default() };
        let step = parameter_step(&model, Free { effect: 0, parameter: 1 });
        assert!(step > 0.0 && TAU * step * 900.0 / (1.3 * 1.3) < 0.1, "{step}");
    }

    /// Where all forces push, so do the limits of a winch's force, and four times such a limit lies below a quarter of it.
    #[test]
    fn a_shape_below_zero_moves_within_its_bounds() {
        let limits = EffectSpec::new("winch_saturation", None, &[-25e3, -15e3]).unwrap();
        let mut model = Model { effects: vec![limits], ..Model::default() };
        move_parameter(&mut model, Free { effect: 0, parameter: 1 }, -100.0);
        let moved = model.effects[0].values[1];
        assert!(moved.is_finite(), "{moved}");
        assert_eq!(between(5.0, 2.0, -1.0), 2.0);
        assert_eq!(between(-5.0, 2.0, -1.0), -1.0);
    }
}
