//! What is estimated of a model: the parameters that are free, and the steps by which they are varied.

use cdpr::effect::ParameterInfo;
use cdpr::model_file::Model;

use crate::hypothesis::extension::{in_use, index_of, value_of};
use crate::hypothesis::term;
use crate::model::sizes::Sizes;

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
    // A drum has turned by the angle l/r, of which a small part must not be a turn.
    match value_of(spec, "drum_radius") {
        Some(radius) if index_of(spec, "drum_radius") == Some(free.parameter) => {
            step.min(1e-2 * radius * radius / Sizes::of(&model.parameters).reach)
        }
        _ => step,
    }
}

#[cfg(test)]
mod tests {
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
}
