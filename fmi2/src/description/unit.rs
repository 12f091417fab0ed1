//! Units, their dimensions and the units they may be displayed in.

/// A unit that variables are expressed in.
#[derive(Debug, Clone, PartialEq)]
pub struct Unit {
    /// The name that [`Variable::unit`](super::Variable::unit) refers to, such as `N.m`.
    pub name: String,
    /// Its dimension, where it has one.
    pub base: Option<BaseUnit>,
    /// Units that a tool may display values in.
    pub display_units: Vec<DisplayUnit>,
}

/// A dimension: SI exponents and the conversion `value_in_base = factor * value + offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BaseUnit {
    /// Exponent of the kilogram.
    pub kg: i32,
    /// Exponent of the metre.
    pub m: i32,
    /// Exponent of the second.
    pub s: i32,
    /// Exponent of the ampere.
    pub ampere: i32,
    /// Exponent of the kelvin.
    pub kelvin: i32,
    /// Exponent of the mole.
    pub mol: i32,
    /// Exponent of the candela.
    pub cd: i32,
    /// Exponent of the radian.
    pub rad: i32,
    /// Factor to the SI unit.
    pub factor: f64,
    /// Offset to the SI unit.
    pub offset: f64,
}

impl Default for BaseUnit {
    /// Dimensionless.
    fn default() -> Self {
        Self { kg: 0, m: 0, s: 0, ampere: 0, kelvin: 0, mol: 0, cd: 0, rad: 0, factor: 1.0, offset: 0.0 }
    }
}

/// A unit for display: `value_in_display_unit = factor * value + offset`.
#[derive(Debug, Clone, PartialEq)]
pub struct DisplayUnit {
    /// The name that [`Variable::display_unit`](super::Variable::display_unit) refers to.
    pub name: String,
    /// Factor from the unit.
    pub factor: f64,
    /// Offset from the unit.
    pub offset: f64,
}

impl Unit {
    /// A unit of mechanics: exponents of kilogram, metre, second and radian.
    pub fn mechanical(name: impl Into<String>, kg: i32, m: i32, s: i32, rad: i32) -> Self {
        Self {
            name: name.into(),
            base: Some(BaseUnit { kg, m, s, rad, ..BaseUnit::default() }),
            display_units: Vec::new(),
        }
    }

    /// Add a unit for display, `value_in_display_unit = factor * value`.
    #[must_use]
    pub fn display(mut self, name: impl Into<String>, factor: f64) -> Self {
        self.display_units.push(DisplayUnit { name: name.into(), factor, offset: 0.0 });
        self
    }
}
