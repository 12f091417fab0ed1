//! The parts of a cable's elastic law.

/// A part of a cable's elastic law, each with a hook of [`Effect`](super::Effect) of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LawPart {
    /// [`super::Effect::length_factor`].
    Length,
    /// [`super::Effect::inelastic_strain`].
    Inelastic,
    /// [`super::Effect::bowed_length`].
    Bow,
    /// [`super::Effect::tension_factor`].
    Factor,
    /// [`super::Effect::chord_strain`].
    Shape,
    /// [`super::Effect::held_tension`].
    Held,
    /// [`super::Effect::strain_rates`].
    Rates,
}

impl LawPart {
    /// How many there are.
    pub(crate) const COUNT: usize = Self::Rates as usize + 1;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effect::{CATALOGUE, EffectKind, EffectSpec, StrainContext};

    /// Hooks of other parts are never asked: had they an effect, it would be lost.
    #[test]
    fn an_effect_changes_the_parts_that_it_names_and_no_others() {
        let mut named = 0;
        for info in CATALOGUE.iter().filter(|info| info.id != "expression") {
            let values: Vec<f64> = info.parameters.iter().map(|p| p.typical.1).collect();
            let kind = EffectKind::new(&EffectSpec::new(info.id, None, &values).unwrap()).unwrap();
            let (tension, chord, free) = (8e3, 900.0, 898.0);
            let states = [0.3, -0.2, 0.1, 0.4, 0.3, -0.2, 0.1, 0.4];
            let mut rates = [f64::NAN; 8];
            kind.strain_rates(&StrainContext { tension, strain_rate: 1e-3 }, &states, &mut rates);
            let shape = kind.chord_strain(tension, chord, free);
            assert!((kind.chord_strain_and_slope(tension, chord, free)[0] - shape).abs() <= 1e-12 * shape.abs());
            let changed = [
                (LawPart::Length, kind.length_factor(40.0) != 1.0),
                (LawPart::Inelastic, kind.inelastic_strain(&states) != 0.0),
                (LawPart::Bow, kind.bowed_length(chord, &states) != 0.0),
                (LawPart::Factor, kind.tension_factor(2e-3, chord, 1.5e7) != 1.0),
                (LawPart::Shape, shape != 0.0),
                (LawPart::Held, kind.held_tension(&states) != 0.0),
                (LawPart::Rates, rates.iter().any(|rate| !rate.is_nan())),
            ];
            assert_eq!(changed.len(), LawPart::COUNT);
            for (part, is_changed) in changed {
                assert_eq!(kind.law_parts().contains(&part), is_changed, "{}: {part:?}", info.id);
                named += usize::from(is_changed);
            }
        }
        assert!(named >= LawPart::COUNT, "some effect changes each part");
    }
}
