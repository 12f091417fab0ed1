//! Laws with extensions: which of their parameters are in use.

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
pub(crate) fn at_work_like(law: EffectSpec, other: &EffectSpec) -> EffectSpec {
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

/// The place of the parameter `name`.
pub(crate) fn index_of(spec: &EffectSpec, name: &str) -> Option<usize> {
    spec.info().ok()?.parameters.iter().position(|parameter| parameter.name == name)
}

/// Whether two effects are one law on two cables, at work at the same times.
pub(crate) fn same_law(a: &EffectSpec, b: &EffectSpec) -> bool {
    let on_its_own = |effect: &EffectSpec| EffectSpec { cable: None, values: Vec::new(), ..effect.clone() };
    a.expression.is_none() && on_its_own(a) == on_its_own(b)
}

/// Whether two effects are one law at one place, whatever their sizes and times.
pub(crate) fn is_one_law(a: &EffectSpec, b: &EffectSpec) -> bool {
    (&a.id, a.cable, &a.expression) == (&b.id, b.cable, &b.expression)
}

/// The value of the parameter `name`.
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
    fn a_rival_gets_the_extensions_that_it_knows() {
        let standing = effect("winch_coulomb_friction", &[100.0, 0.01, 0.3, 0.0, 2e4, 500.0]);
        let stribeck = extended_like(&effect("winch_stribeck_friction", &[90.0, 150.0, 0.1, 5.0]), &standing);
        assert_eq!(stribeck.values, [90.0, 150.0, 0.1, 5.0, 0.0, 2e4, 500.0, 0.0, 0.0]);
        let capstan = effect("pulley_capstan_loss", &[0.01, 0.02]);
        assert_eq!(extended_like(&capstan, &standing), capstan);
    }
}
