//! One variable of the table: its type, its role, and when it may be set.

use crate::model::Value;

/// One scalar variable.
///
/// Made by [`Variable::real`], [`Variable::integer`], [`Variable::boolean`], [`Variable::string`] or
/// [`Variable::enumeration`], refined by the methods below, and checked as a whole by
/// [`ModelDescription::validate`](super::ModelDescription::validate):
///
/// ```
/// use fmi2_export::description::Variable;
/// let force = Variable::real("winch_force[1]", 0)
///     .input()
///     .unit("N")
///     .nominal(1e3)
///     .start(1e3)
///     .described("Pull of winch 1");
/// assert!(force.settable_before_initialisation());
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Variable {
    /// Name, unique, in the structured convention (`a.b[1]`, `der(x)`).
    pub name: String,
    /// Value reference, unique among the variables of the same [`BaseType`].
    pub value_reference: u32,
    /// What the variable is.
    pub description: Option<String>,
    /// Its role.
    pub causality: Causality,
    /// When it changes.
    pub variability: Variability,
    /// How its start value is meant; `None`: the standard's default for causality and variability.
    pub initial: Option<Initial>,
    /// Its type, with unit, bounds and start.
    pub kind: Kind,
    /// For an output or a state derivative: the inputs and states (and time) that it depends on at
    /// communication points. `None`: perhaps all of them.
    pub dependencies: Option<Vec<Dependency>>,
    /// For an unknown of initialisation mode: the inputs and exact starts that it depends on there.
    /// `None`: perhaps all of them.
    pub initial_dependencies: Option<Vec<Dependency>>,
}

/// The type of a variable, with what belongs to that type.
#[derive(Debug, Clone, PartialEq)]
pub enum Kind {
    /// `fmi2Real`.
    Real(RealKind),
    /// `fmi2Integer`.
    Integer(IntegerKind),
    /// `fmi2Boolean`.
    Boolean {
        /// Start value.
        start: Option<bool>,
    },
    /// `fmi2String`.
    String {
        /// Start value.
        start: Option<String>,
    },
    /// An enumeration, accessed as `fmi2Integer`.
    Enumeration {
        /// Name of the [`Enumeration`](super::Enumeration).
        type_name: String,
        /// Start value: the value of an item.
        start: Option<i32>,
    },
}

/// What belongs to a real variable.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RealKind {
    /// Physical quantity, such as `Force`.
    pub quantity: Option<String>,
    /// Name of a [`Unit`](super::Unit).
    pub unit: Option<String>,
    /// Name of one of that unit's display units.
    pub display_unit: Option<String>,
    /// Typical magnitude, in the unit.
    pub nominal: Option<f64>,
    /// Smallest value, in the unit.
    pub min: Option<f64>,
    /// Largest value, in the unit.
    pub max: Option<f64>,
    /// Start value, in the unit.
    pub start: Option<f64>,
    /// Index of the state whose time derivative this variable is.
    pub derivative_of: Option<usize>,
}

/// What belongs to an integer variable.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct IntegerKind {
    /// Quantity.
    pub quantity: Option<String>,
    /// Smallest value.
    pub min: Option<i32>,
    /// Largest value.
    pub max: Option<i32>,
    /// Start value.
    pub start: Option<i32>,
}

/// The four types that the C functions know; each has its own value references.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum BaseType {
    /// `fmi2Real`.
    Real,
    /// `fmi2Integer`, also for enumerations.
    Integer,
    /// `fmi2Boolean`.
    Boolean,
    /// `fmi2String`.
    String,
}

impl BaseType {
    pub(crate) const ALL: [Self; 4] = [Self::Real, Self::Integer, Self::Boolean, Self::String];
}

/// The role of a variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Causality {
    /// Set by the host before the simulation, or while it runs if tunable.
    Parameter,
    /// Computed from parameters.
    CalculatedParameter,
    /// Set by the host at communication points.
    Input,
    /// Read by the host.
    Output,
    /// Seen from outside, but not to be connected.
    Local,
    /// Time.
    Independent,
}

impl Causality {
    /// What the standard calls it.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Parameter => "parameter",
            Self::CalculatedParameter => "calculatedParameter",
            Self::Input => "input",
            Self::Output => "output",
            Self::Local => "local",
            Self::Independent => "independent",
        }
    }
}

/// When a variable changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Variability {
    /// Never.
    Constant,
    /// Not after initialisation.
    Fixed,
    /// By the host at communication points.
    Tunable,
    /// At events.
    Discrete,
    /// At any time; reals only.
    Continuous,
}

impl Variability {
    /// What the standard calls it.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Constant => "constant",
            Self::Fixed => "fixed",
            Self::Tunable => "tunable",
            Self::Discrete => "discrete",
            Self::Continuous => "continuous",
        }
    }
}

/// How a start value is meant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Initial {
    /// The variable starts there.
    Exact,
    /// An iteration starts there.
    Approx,
    /// None: the value is computed.
    Calculated,
}

impl Initial {
    /// What the standard calls it.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Exact => "exact",
            Self::Approx => "approx",
            Self::Calculated => "calculated",
        }
    }
}

/// One known that an unknown depends on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Dependency {
    /// Index of the known.
    pub index: usize,
    /// How the unknown depends on it.
    pub kind: DependencyKind,
}

/// How an unknown depends on a known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DependencyKind {
    /// In any way.
    Dependent,
    /// Linear with a factor that never changes.
    Constant,
    /// Linear with a factor that depends on fixed parameters.
    Fixed,
    /// Linear with a factor that depends on tunable parameters.
    Tunable,
    /// Linear with a factor that changes at events only.
    Discrete,
}

impl Dependency {
    /// Dependent in any way.
    #[must_use]
    pub fn on(index: usize) -> Self {
        Self::of_kind(index, DependencyKind::Dependent)
    }

    /// Dependent in this way.
    #[must_use]
    pub fn of_kind(index: usize, kind: DependencyKind) -> Self {
        Self { index, kind }
    }
}

impl Variable {
    fn new(name: String, value_reference: u32, variability: Variability, kind: Kind) -> Self {
        Self {
            name,
            value_reference,
            description: None,
            causality: Causality::Local,
            variability,
            initial: None,
            kind,
            dependencies: None,
            initial_dependencies: None,
        }
    }

    /// A real variable: local and continuous until said otherwise.
    pub fn real(name: impl Into<String>, value_reference: u32) -> Self {
        Self::new(name.into(), value_reference, Variability::Continuous, Kind::Real(RealKind::default()))
    }

    /// An integer variable: local and discrete until said otherwise.
    pub fn integer(name: impl Into<String>, value_reference: u32) -> Self {
        Self::new(name.into(), value_reference, Variability::Discrete, Kind::Integer(IntegerKind::default()))
    }

    /// A Boolean variable: local and discrete until said otherwise.
    pub fn boolean(name: impl Into<String>, value_reference: u32) -> Self {
        Self::new(name.into(), value_reference, Variability::Discrete, Kind::Boolean { start: None })
    }

    /// A string variable: local and discrete until said otherwise.
    pub fn string(name: impl Into<String>, value_reference: u32) -> Self {
        Self::new(name.into(), value_reference, Variability::Discrete, Kind::String { start: None })
    }

    /// A variable of the enumeration `type_name`: local and discrete until said otherwise. Its value
    /// reference is one of the integers'.
    pub fn enumeration(name: impl Into<String>, value_reference: u32, type_name: impl Into<String>) -> Self {
        Self::new(
            name.into(),
            value_reference,
            Variability::Discrete,
            Kind::Enumeration { type_name: type_name.into(), start: None },
        )
    }

    /// An input.
    #[must_use]
    pub fn input(mut self) -> Self {
        self.causality = Causality::Input;
        self
    }

    /// An output.
    #[must_use]
    pub fn output(mut self) -> Self {
        self.causality = Causality::Output;
        self
    }

    /// A parameter that is fixed after initialisation.
    #[must_use]
    pub fn parameter(mut self) -> Self {
        self.causality = Causality::Parameter;
        self.variability = Variability::Fixed;
        self
    }

    /// A parameter that may change at communication points.
    #[must_use]
    pub fn tunable_parameter(mut self) -> Self {
        self.causality = Causality::Parameter;
        self.variability = Variability::Tunable;
        self
    }

    /// Time, as a variable.
    #[must_use]
    pub fn independent(mut self) -> Self {
        self.causality = Causality::Independent;
        self.variability = Variability::Continuous;
        self
    }

    /// Its variability.
    #[must_use]
    pub fn variability(mut self, variability: Variability) -> Self {
        self.variability = variability;
        self
    }

    /// How its start value is meant.
    #[must_use]
    pub fn initial(mut self, initial: Initial) -> Self {
        self.initial = Some(initial);
        self
    }

    /// What the variable is.
    #[must_use]
    pub fn described(mut self, description: impl Into<String>) -> Self {
        self.description = Some(description.into());
        self
    }

    /// The unit of a real variable.
    #[must_use]
    pub fn unit(self, unit: impl Into<String>) -> Self {
        self.real_kind(|real| real.unit = Some(unit.into()))
    }

    /// The unit that a real variable is displayed in.
    #[must_use]
    pub fn display_unit(self, unit: impl Into<String>) -> Self {
        self.real_kind(|real| real.display_unit = Some(unit.into()))
    }

    /// The physical quantity of a real variable.
    #[must_use]
    pub fn quantity(self, quantity: impl Into<String>) -> Self {
        self.real_kind(|real| real.quantity = Some(quantity.into()))
    }

    /// Typical magnitude of a real variable.
    #[must_use]
    pub fn nominal(self, nominal: f64) -> Self {
        self.real_kind(|real| real.nominal = Some(nominal))
    }

    /// Smallest value of a real variable.
    #[must_use]
    pub fn min(self, min: f64) -> Self {
        self.real_kind(|real| real.min = Some(min))
    }

    /// Largest value of a real variable.
    #[must_use]
    pub fn max(self, max: f64) -> Self {
        self.real_kind(|real| real.max = Some(max))
    }

    /// Make a real variable the time derivative of the state at `state`.
    #[must_use]
    pub fn derivative_of_state(self, state: usize) -> Self {
        self.real_kind(|real| real.derivative_of = Some(state))
    }

    /// Start value of a real variable.
    #[must_use]
    pub fn start(self, start: f64) -> Self {
        self.real_kind(|real| real.start = Some(start))
    }

    /// Start value, of the variable's own type.
    ///
    /// # Panics
    /// If the type differs.
    #[must_use]
    pub fn start_value(mut self, value: Value) -> Self {
        match (&mut self.kind, value) {
            (Kind::Real(real), Value::Real(v)) => real.start = Some(v),
            (Kind::Integer(integer), Value::Integer(v)) => integer.start = Some(v),
            (Kind::Enumeration { start, .. }, Value::Integer(v)) => *start = Some(v),
            (Kind::Boolean { start }, Value::Boolean(v)) => *start = Some(v),
            (Kind::String { start }, Value::String(v)) => *start = Some(v),
            (_, value) => panic!("{value:?} cannot be the start of `{}`", self.name),
        }
        self
    }

    /// Smallest and largest value of an integer variable.
    ///
    /// # Panics
    /// If the variable is not an integer.
    #[must_use]
    pub fn integer_range(mut self, min: i32, max: i32) -> Self {
        let Kind::Integer(integer) = &mut self.kind else {
            panic!("`{}` is not an integer variable", self.name);
        };
        (integer.min, integer.max) = (Some(min), Some(max));
        self
    }

    /// The knowns at communication points; see [`Variable::dependencies`].
    #[must_use]
    pub fn depends_on(mut self, knowns: impl IntoIterator<Item = Dependency>) -> Self {
        self.dependencies = Some(knowns.into_iter().collect());
        self
    }

    /// The knowns in initialisation mode; see [`Variable::initial_dependencies`].
    #[must_use]
    pub fn initially_depends_on(mut self, knowns: impl IntoIterator<Item = Dependency>) -> Self {
        self.initial_dependencies = Some(knowns.into_iter().collect());
        self
    }

    /// Change what belongs to a real variable.
    ///
    /// A table is written by a programmer, so asking a Boolean for its unit is a mistake in the program.
    fn real_kind(mut self, change: impl FnOnce(&mut RealKind)) -> Self {
        let Kind::Real(real) = &mut self.kind else {
            panic!("`{}` is not a real variable", self.name);
        };
        change(real);
        self
    }

    /// The C functions' type.
    #[must_use]
    pub fn base_type(&self) -> BaseType {
        match self.kind {
            Kind::Real(_) => BaseType::Real,
            Kind::Integer(_) | Kind::Enumeration { .. } => BaseType::Integer,
            Kind::Boolean { .. } => BaseType::Boolean,
            Kind::String { .. } => BaseType::String,
        }
    }

    /// The state whose derivative this variable is.
    #[must_use]
    pub fn derivative_of(&self) -> Option<usize> {
        match &self.kind {
            Kind::Real(real) => real.derivative_of,
            _ => None,
        }
    }

    /// The start value, where there is one.
    #[must_use]
    pub fn start_of(&self) -> Option<Value> {
        match &self.kind {
            Kind::Real(real) => real.start.map(Value::Real),
            Kind::Integer(integer) => integer.start.map(Value::Integer),
            Kind::Enumeration { start, .. } => start.map(Value::Integer),
            Kind::Boolean { start } => start.map(Value::Boolean),
            Kind::String { start } => start.clone().map(Value::String),
        }
    }

    /// `initial`, or the standard's default for this causality and variability; `None` for inputs and
    /// the independent variable, which have none.
    #[must_use]
    pub fn effective_initial(&self) -> Option<Initial> {
        match (self.causality, self.variability) {
            (Causality::Input | Causality::Independent, _) => None,
            _ if self.initial.is_some() => self.initial,
            (Causality::Parameter, _) | (_, Variability::Constant) => Some(Initial::Exact),
            _ => Some(Initial::Calculated),
        }
    }

    /// May the host set it between `fmi2Instantiate` and `fmi2EnterInitializationMode`?
    ///
    /// Everything with a start that is not constant, and inputs.
    #[must_use]
    pub fn settable_before_initialisation(&self) -> bool {
        self.variability != Variability::Constant
            && (self.causality == Causality::Input
                || matches!(self.effective_initial(), Some(Initial::Exact | Initial::Approx)))
    }

    /// May the host set it in initialisation mode? Exact starts that are not constant, and inputs.
    #[must_use]
    pub fn settable_in_initialisation(&self) -> bool {
        self.variability != Variability::Constant
            && (self.causality == Causality::Input || self.effective_initial() == Some(Initial::Exact))
    }

    /// May the host set it at communication points? Inputs and tunable parameters.
    #[must_use]
    pub fn settable_while_stepping(&self) -> bool {
        self.causality == Causality::Input
            || (self.causality == Causality::Parameter && self.variability == Variability::Tunable)
    }
}
