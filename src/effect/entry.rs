//! What the catalogue says of an effect and of its parameters.

use super::{DependsOn, Site};

/// What an effect may act on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scope {
    /// One cable (`cable = 1..n`), or all of them when `cable` is absent.
    EachCable,
    /// The platform, or all cables at once; takes no `cable`.
    Whole,
}

/// One parameter of an effect.
#[derive(Clone, Copy, Debug)]
pub struct ParameterInfo {
    /// Key in `model.toml` and last part of the FMU variable's name.
    pub name: &'static str,
    /// SI unit as FMI writes it (`N.s/m`), `1` for a pure number.
    pub unit: &'static str,
    /// What it is.
    pub description: &'static str,
    /// Value when the key is absent; `None` means the key is required.
    pub default: Option<f64>,
    /// Smallest value allowed.
    pub min: f64,
    /// Largest value allowed.
    pub max: f64,
    /// Range met in practice.
    pub typical: (f64, f64),
    /// Whether it only gives the law its shape: the effect is absent where the other parameters are zero, whatever this
    /// one is.
    pub shape: bool,
    /// Whether it extends the law by something that is absent at its default.
    pub extension: bool,
    /// A parameter of the same effect beside which this one does nothing, where that one is not zero.
    pub idle_beside: Option<&'static str>,
    /// A parameter of the same effect without which this one does nothing: where that one is zero.
    pub idle_without: Option<&'static str>,
    /// A parameter of the same effect with which this one enters the law as a product alone: data show the product of the two.
    pub in_product_with: Option<&'static str>,
}

/// A parameter of an effect that is a text.
#[derive(Clone, Copy, Debug)]
pub struct TextInfo {
    /// Key in `model.toml`.
    pub name: &'static str,
    /// What may stand there, and what it is when the key is absent, if it may be.
    pub description: &'static str,
}

/// Another effect that ordinary data can hardly tell from this one.
#[derive(Clone, Copy, Debug)]
pub struct LookAlike {
    /// The other effect's id.
    pub id: &'static str,
    /// The experiment that separates the two.
    pub separate_by: &'static str,
}

/// An effect's entry in the catalogue.
#[derive(Clone, Copy, Debug)]
pub struct EffectInfo {
    /// The id in `model.toml`.
    pub id: &'static str,
    /// A short name for people.
    pub title: &'static str,
    /// The equation added to the plant.
    pub equation: &'static str,
    /// The same with numbers in place of the parameters, without what they leave out.
    pub law: Law,
    /// One cable or the whole.
    pub scope: Scope,
    /// Where it acts; see [`EffectSpec::places`](crate::effect::EffectSpec::places).
    pub site: Site,
    /// What it depends on; see [`EffectSpec::depends_on`](crate::effect::EffectSpec::depends_on).
    pub depends_on: &'static [DependsOn],
    /// Its parameters, in order.
    pub parameters: &'static [ParameterInfo],
    /// Those that are texts.
    pub texts: &'static [TextInfo],
    /// Where in data it shows.
    pub shows_in: &'static str,
    /// The textbook source.
    pub source: &'static str,
    /// When the law holds.
    pub validity: &'static str,
    /// Effects it is easily mistaken for.
    pub look_alikes: &'static [LookAlike],
}

/// Writes a law with the values of its parameters, in SI units and the order of the catalogue entry; `number` writes a number.
pub type Law = fn(values: &[f64], number: &dyn Fn(f64) -> String) -> String;

/// A number with its sign before it, as what follows in a sum: `+ 0.05`, `- 0.05`.
pub(super) fn signed(value: f64, number: &dyn Fn(f64) -> String) -> String {
    format!("{} {}", if value < 0.0 { '-' } else { '+' }, number(value.abs()))
}

/// A parameter's catalogue entry without a default, unbounded.
pub(super) const fn parameter(
    name: &'static str,
    unit: &'static str,
    description: &'static str,
    typical: (f64, f64),
) -> ParameterInfo {
    ParameterInfo {
        name,
        unit,
        description,
        default: None,
        min: f64::NEG_INFINITY,
        max: f64::INFINITY,
        typical,
        shape: false,
        extension: false,
        idle_beside: None,
        idle_without: None,
        in_product_with: None,
    }
}

impl ParameterInfo {
    /// With a smallest value.
    pub(super) const fn at_least(mut self, min: f64) -> Self {
        self.min = min;
        self
    }

    /// With a largest value.
    pub(super) const fn at_most(mut self, max: f64) -> Self {
        self.max = max;
        self
    }

    /// With a value for an absent key.
    pub(super) const fn or(mut self, default: f64) -> Self {
        self.default = Some(default);
        self
    }

    /// A parameter that only gives the law its shape.
    pub(super) const fn shape(mut self) -> Self {
        self.shape = true;
        self
    }

    /// A parameter that extends the law by something that is absent at its default.
    pub(super) const fn extension(mut self) -> Self {
        self.extension = true;
        self
    }

    /// A parameter that does nothing where `other` is not zero.
    pub(super) const fn idle_beside(mut self, other: &'static str) -> Self {
        self.idle_beside = Some(other);
        self
    }

    /// A parameter that does nothing where `other` is zero.
    pub(super) const fn idle_without(mut self, other: &'static str) -> Self {
        self.idle_without = Some(other);
        self
    }

    /// A parameter that only enters as a product with `other`.
    pub(super) const fn in_product_with(mut self, other: &'static str) -> Self {
        self.in_product_with = Some(other);
        self
    }

    /// Whether `value` leaves out the extension of the law that this parameter stands for.
    pub fn leaves_out(&self, value: f64) -> bool {
        self.extension && self.default == Some(value)
    }
}
