//! What an FMU says of itself: the one table behind the XML, the checks of get and set, and the rules
//! of causality.

mod names;
mod unit;
mod validate;
mod variable;
mod xml;

pub use unit::{BaseUnit, DisplayUnit, Unit};
pub use validate::DescriptionError;
pub use variable::{
    BaseType, Causality, Dependency, DependencyKind, Initial, IntegerKind, Kind, RealKind, Variability, Variable,
};

/// The description of a model: everything that `modelDescription.xml` holds.
///
/// Make one with [`ModelDescription::new`], fill in the public fields, and add variables with
/// [`ModelDescription::add`]. The lists of outputs, derivatives and initial unknowns follow from the
/// variables; only their dependencies are stated, on the variables.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelDescription {
    /// The model's name, as a reader sees it.
    pub model_name: String,
    /// Names the binary; a C identifier.
    pub model_identifier: String,
    /// One sentence on the model.
    pub description: Option<String>,
    /// Who wrote the model.
    pub author: Option<String>,
    /// The model's version.
    pub version: Option<String>,
    /// The copyright line.
    pub copyright: Option<String>,
    /// The licence.
    pub license: Option<String>,
    /// The tool that wrote the FMU.
    pub generation_tool: Option<String>,
    /// What the FMU can do beyond the minimum.
    pub capabilities: Capabilities,
    /// Every unit that a variable names.
    pub units: Vec<Unit>,
    /// Every enumeration that a variable names.
    pub enumerations: Vec<Enumeration>,
    /// The model's own log categories, besides [`LAYER_LOG_CATEGORIES`].
    pub log_categories: Vec<LogCategory>,
    /// Suggested start and stop time, tolerance and step.
    pub default_experiment: Option<DefaultExperiment>,
    /// The variables; a variable's index in this list names it everywhere in Rust (the XML counts from 1).
    pub variables: Vec<Variable>,
}

impl ModelDescription {
    /// A description without variables, with all capabilities.
    pub fn new(model_name: impl Into<String>, model_identifier: impl Into<String>) -> Self {
        Self {
            model_name: model_name.into(),
            model_identifier: model_identifier.into(),
            description: None,
            author: None,
            version: None,
            copyright: None,
            license: None,
            generation_tool: None,
            capabilities: Capabilities::default(),
            units: Vec::new(),
            enumerations: Vec::new(),
            log_categories: Vec::new(),
            default_experiment: None,
            variables: Vec::new(),
        }
    }

    /// Append a variable; returns its index.
    pub fn add(&mut self, variable: Variable) -> usize {
        self.variables.push(variable);
        self.variables.len() - 1
    }

    /// Index of the variable with this name.
    #[must_use]
    pub fn find(&self, name: &str) -> Option<usize> {
        self.variables.iter().position(|v| v.name == name)
    }

    /// Indices of all outputs, in the table's order (`ModelStructure/Outputs`).
    pub fn outputs(&self) -> impl Iterator<Item = usize> + '_ {
        self.indices(|_, v| v.causality == Causality::Output)
    }

    /// Indices of all state derivatives, in the table's order (`ModelStructure/Derivatives`).
    pub fn derivatives(&self) -> impl Iterator<Item = usize> + '_ {
        self.indices(|_, v| v.derivative_of().is_some())
    }

    /// Indices of all continuous states, in the order of their derivatives.
    pub fn states(&self) -> impl Iterator<Item = usize> + '_ {
        self.variables.iter().filter_map(Variable::derivative_of)
    }

    /// Indices of the unknowns of initialisation mode, in the table's order
    /// (`ModelStructure/InitialUnknowns`): outputs, states and state derivatives whose start is not
    /// exact, and calculated parameters.
    pub fn initial_unknowns(&self) -> impl Iterator<Item = usize> + '_ {
        let mut exposed = vec![false; self.variables.len()];
        for (index, variable) in self.variables.iter().enumerate() {
            if let Some(state) = variable.derivative_of() {
                exposed[index] = true;
                if let Some(flag) = exposed.get_mut(state) {
                    *flag = true;
                }
            }
        }
        self.indices(move |index, v| {
            let inexact = matches!(v.effective_initial(), Some(Initial::Approx | Initial::Calculated));
            v.causality == Causality::CalculatedParameter
                || (inexact && (v.causality == Causality::Output || exposed[index]))
        })
    }

    fn indices<'a>(&'a self, mut keep: impl FnMut(usize, &Variable) -> bool + 'a) -> impl Iterator<Item = usize> + 'a {
        self.variables.iter().enumerate().filter_map(move |(index, v)| keep(index, v).then_some(index))
    }
}

/// Optional features, declared in the XML. All are on by default; switch off what the model lacks.
///
/// Always declared: variable step size, get, set and serialise FMU state, own memory, many instances
/// in one process. Never: asynchronous steps, an execution tool.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Capabilities {
    /// `fmi2SetRealInputDerivatives` has an effect.
    pub can_interpolate_inputs: bool,
    /// Highest order that `fmi2GetRealOutputDerivatives` knows.
    pub max_output_derivative_order: u32,
    /// `fmi2GetDirectionalDerivative` is available.
    pub provides_directional_derivative: bool,
}

impl Default for Capabilities {
    fn default() -> Self {
        Self { can_interpolate_inputs: true, max_output_derivative_order: 1, provides_directional_derivative: true }
    }
}

/// An enumeration type.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Enumeration {
    /// The type's name; differs from every variable's name.
    pub name: String,
    /// What the enumeration chooses.
    pub description: Option<String>,
    /// Its items, with different names and values.
    pub items: Vec<EnumerationItem>,
}

/// One item of an [`Enumeration`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EnumerationItem {
    /// The item's name.
    pub name: String,
    /// The value that get and set use.
    pub value: i32,
    /// What the item means.
    pub description: Option<String>,
}

impl Enumeration {
    /// An enumeration whose items are numbered from 1.
    pub fn new<'a>(name: impl Into<String>, items: impl IntoIterator<Item = (&'a str, &'a str)>) -> Self {
        let items = (1..)
            .zip(items)
            .map(|(value, (name, description))| EnumerationItem {
                name: name.into(),
                value,
                description: Some(description.into()),
            })
            .collect();
        Self { name: name.into(), description: None, items }
    }
}

/// A category of log messages that the host can switch.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LogCategory {
    /// The name that `fmi2SetDebugLogging` takes.
    pub name: String,
    /// What is logged there.
    pub description: String,
}

/// The categories that the layer itself uses and always declares: name and description.
pub const LAYER_LOG_CATEGORIES: [(&str, &str); 4] = [
    ("logStatusWarning", "What a host should know although its call went well"),
    ("logStatusDiscard", "Steps that were not taken in full"),
    ("logStatusError", "Calls that returned fmi2Error"),
    ("logAll", "Every message"),
];

/// `DefaultExperiment`: what a host should use where its user says nothing.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DefaultExperiment {
    /// Start time, s.
    pub start_time: Option<f64>,
    /// Stop time, s.
    pub stop_time: Option<f64>,
    /// Relative tolerance.
    pub tolerance: Option<f64>,
    /// Communication step, s.
    pub step_size: Option<f64>,
}
