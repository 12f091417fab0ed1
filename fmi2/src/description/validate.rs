//! The rules of FMI 2.0.3 (section 2.2) that a description must keep.

use std::collections::{BTreeSet, HashMap, HashSet};
use std::fmt::Write as _;

use super::names::is_structured;
use super::{
    BaseType, Causality, Dependency, DependencyKind, Initial, Kind, LAYER_LOG_CATEGORIES, ModelDescription, RealKind,
    Variability, Variable,
};

/// A description that breaks rules of FMI 2.0; lists all of them.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}", one_per_line(.problems))]
pub struct DescriptionError {
    /// Each broken rule: which part, what was found, what was expected.
    pub problems: Vec<String>,
}

fn one_per_line(problems: &[String]) -> String {
    let mut text = String::from("the model description breaks rules of FMI 2.0:");
    for problem in problems {
        let _ = write!(text, "\n  - {problem}");
    }
    text
}

impl ModelDescription {
    /// Check the rules of FMI 2.0.3 that a description must keep.
    ///
    /// # Errors
    /// Every rule that is broken.
    pub fn validate(&self) -> Result<(), DescriptionError> {
        let mut check = Check { table: self, states: self.states().collect(), problems: Vec::new() };
        check.header();
        check.units();
        check.enumerations();
        check.log_categories();
        check.experiment();
        check.unique_variables();
        for (index, variable) in self.variables.iter().enumerate() {
            check.variable(index, variable);
        }
        if check.problems.is_empty() { Ok(()) } else { Err(DescriptionError { problems: check.problems }) }
    }
}

struct Check<'a> {
    table: &'a ModelDescription,
    states: HashSet<usize>,
    problems: Vec<String>,
}

impl<'a> Check<'a> {
    fn expect(&mut self, kept: bool, problem: impl FnOnce() -> String) {
        if !kept {
            self.problems.push(problem());
        }
    }

    fn header(&mut self) {
        let table = self.table;
        self.expect(!table.model_name.is_empty(), || "the model name is empty".into());
        self.expect(is_c_identifier(&table.model_identifier), || {
            format!("model identifier `{}`: expected a C identifier", table.model_identifier)
        });
        let texts = [
            ("model name", Some(&table.model_name)),
            ("description", table.description.as_ref()),
            ("author", table.author.as_ref()),
            ("version", table.version.as_ref()),
            ("copyright", table.copyright.as_ref()),
            ("license", table.license.as_ref()),
            ("generation tool", table.generation_tool.as_ref()),
        ];
        for (what, text) in texts {
            if let Some(text) = text {
                self.text(what, text);
            }
        }
        self.expect(!table.variables.is_empty(), || "there are no variables".into());
    }

    /// XML has no way to write most control characters.
    fn text(&mut self, what: &str, text: &str) {
        let bad = text.chars().find(|&c| (c < ' ' && !"\t\n\r".contains(c)) || c == '\u{fffe}' || c == '\u{ffff}');
        if let Some(bad) = bad {
            self.problems.push(format!("{what}: XML cannot hold the character {bad:?}"));
        }
    }

    fn unique<'n>(&mut self, what: &str, names: impl IntoIterator<Item = &'n str>) {
        let mut seen = HashSet::new();
        for name in names {
            self.expect(!name.is_empty(), || format!("a {what} has an empty name"));
            self.text(what, name);
            self.expect(seen.insert(name), || format!("{what} `{name}` is listed twice"));
        }
    }

    fn units(&mut self) {
        let table = self.table;
        self.unique("unit", table.units.iter().map(|u| u.name.as_str()));
        for unit in &table.units {
            self.unique("display unit", unit.display_units.iter().map(|d| d.name.as_str()));
            let conversions = unit
                .display_units
                .iter()
                .map(|d| (&d.name, d.factor, d.offset))
                .chain(unit.base.map(|b| (&unit.name, b.factor, b.offset)));
            for (name, factor, offset) in conversions {
                self.expect(factor.is_finite() && factor != 0.0 && offset.is_finite(), || {
                    format!("unit `{name}`: factor {factor} and offset {offset} convert nothing")
                });
            }
        }
    }

    fn enumerations(&mut self) {
        let table = self.table;
        self.unique("enumeration", table.enumerations.iter().map(|e| e.name.as_str()));
        for enumeration in &table.enumerations {
            let name = &enumeration.name;
            self.expect(table.find(name).is_none(), || format!("enumeration `{name}` has the name of a variable"));
            self.expect(!enumeration.items.is_empty(), || format!("enumeration `{name}` has no items"));
            self.unique(&format!("item of `{name}`"), enumeration.items.iter().map(|i| i.name.as_str()));
            let values: BTreeSet<i32> = enumeration.items.iter().map(|i| i.value).collect();
            self.expect(values.len() == enumeration.items.len(), || {
                format!("enumeration `{name}` gives two items the same value")
            });
        }
    }

    fn log_categories(&mut self) {
        let own = self.table.log_categories.iter().map(|c| c.name.as_str());
        let layer = LAYER_LOG_CATEGORIES.iter().map(|(name, _)| *name);
        self.unique("log category", layer.chain(own));
    }

    fn experiment(&mut self) {
        let Some(experiment) = self.table.default_experiment else {
            return;
        };
        let (start, stop) = (experiment.start_time, experiment.stop_time);
        let finite = [start, stop].iter().flatten().all(|t| t.is_finite());
        self.expect(finite, || "default experiment: times must be finite".into());
        if let (Some(start), Some(stop)) = (start, stop) {
            self.expect(start <= stop, || format!("default experiment: stop time {stop} before start time {start}"));
        }
        for (what, value) in [("tolerance", experiment.tolerance), ("step size", experiment.step_size)] {
            if let Some(value) = value {
                self.expect(value.is_finite() && value > 0.0, || {
                    format!("default experiment: {what} {value} is not positive")
                });
            }
        }
    }

    fn unique_variables(&mut self) {
        let variables = &self.table.variables;
        self.unique("variable", variables.iter().map(|v| v.name.as_str()));
        let mut references: HashMap<(BaseType, u32), &str> = HashMap::new();
        for variable in variables {
            let key = (variable.base_type(), variable.value_reference);
            if let Some(first) = references.insert(key, &variable.name) {
                self.problems.push(format!(
                    "`{first}` and `{}` share the value reference {} of type {:?}",
                    variable.name, key.1, key.0
                ));
            }
        }
        let independents = variables.iter().filter(|v| v.causality == Causality::Independent).count();
        self.expect(independents <= 1, || format!("{independents} independent variables, at most one is allowed"));
        let mut states = HashSet::new();
        for state in self.table.states() {
            self.expect(states.insert(state), || format!("the state with index {state} has two derivatives"));
        }
    }

    fn variable(&mut self, index: usize, variable: &Variable) {
        let name = &variable.name;
        self.expect(is_structured(name), || format!("`{name}` is not a structured variable name"));
        if let Some(text) = &variable.description {
            self.text(name, text);
        }
        self.role(variable);
        match &variable.kind {
            Kind::Real(real) => self.real(index, variable, real),
            Kind::Integer(integer) => {
                self.expect(in_order(&[integer.min, integer.start, integer.max]), || {
                    format!("`{name}`: expected min <= start <= max")
                });
            }
            Kind::Enumeration { type_name, start } => {
                self.enumerated(name, type_name, *start);
            }
            Kind::String { start: Some(start) } => self.text(name, start),
            Kind::Boolean { .. } | Kind::String { start: None } => {}
        }
        self.dependencies(index, variable);
    }

    /// Causality, variability, initial and start (tables of FMI 2.0.3, pages 48 to 51).
    fn role(&mut self, variable: &Variable) {
        use Causality as C;
        use Variability as V;
        let name = &variable.name;
        let (causality, variability) = (variable.causality, variable.variability);
        let legal_pair = matches!(
            (causality, variability),
            (C::Parameter | C::CalculatedParameter, V::Fixed | V::Tunable)
                | (C::Input, V::Discrete | V::Continuous)
                | (C::Output, V::Constant | V::Discrete | V::Continuous)
                | (C::Local, _)
                | (C::Independent, V::Continuous)
        );
        self.expect(legal_pair, || {
            format!("`{name}`: causality {causality:?} does not go with variability {variability:?}")
        });
        let continuous_real = variability != V::Continuous || variable.base_type() == BaseType::Real;
        self.expect(continuous_real, || format!("`{name}`: only a real variable can be continuous"));
        let legal_initial = match (causality, variability, variable.initial) {
            (_, _, None) => true,
            (C::Input | C::Independent, _, Some(_)) => false,
            (C::Parameter, _, Some(initial)) | (_, V::Constant, Some(initial)) => initial == Initial::Exact,
            (_, V::Fixed | V::Tunable, Some(initial)) => initial != Initial::Exact,
            (_, V::Discrete | V::Continuous, Some(_)) => true,
        };
        self.expect(legal_initial, || {
            format!(
                "`{name}`: initial {:?} does not go with causality {causality:?} and variability \
                 {variability:?}",
                variable.initial
            )
        });
        let needs_start =
            causality == C::Input || matches!(variable.effective_initial(), Some(Initial::Exact | Initial::Approx));
        let has_start = variable.start_of().is_some();
        self.expect(has_start || !needs_start, || format!("`{name}` needs a start value"));
        self.expect(!has_start || needs_start, || format!("`{name}` is calculated and must not have a start value"));
    }

    fn real(&mut self, index: usize, variable: &Variable, real: &RealKind) {
        let name = &variable.name;
        let numbers = [real.min, real.start, real.max];
        let finite = numbers.iter().chain([&real.nominal]).flatten().all(|v| v.is_finite());
        self.expect(finite, || format!("`{name}`: start, bounds and nominal must be finite"));
        self.expect(in_order(&numbers), || format!("`{name}`: expected min <= start <= max"));
        self.expect(real.nominal.is_none_or(|n| n > 0.0), || format!("`{name}`: nominal must be positive"));
        let unit = real.unit.as_ref().and_then(|unit| self.table.units.iter().find(|u| u.name == *unit));
        if let (Some(unit), None) = (&real.unit, unit) {
            self.problems.push(format!("`{name}`: unit `{unit}` is not defined"));
        }
        if let Some(display) = &real.display_unit {
            let known = unit.is_some_and(|unit| unit.display_units.iter().any(|d| d.name == *display));
            self.expect(known, || format!("`{name}`: display unit `{display}` is not defined for its unit"));
        }
        if let Some(state) = real.derivative_of {
            let continuous = |v: &Variable| {
                v.base_type() == BaseType::Real
                    && v.variability == Variability::Continuous
                    && matches!(v.causality, Causality::Local | Causality::Output)
            };
            let pair =
                state != index && continuous(variable) && self.table.variables.get(state).is_some_and(continuous);
            self.expect(pair, || {
                format!(
                    "`{name}` is declared the derivative of index {state}: expected two continuous \
                     reals that are local or output"
                )
            });
        }
    }

    fn enumerated(&mut self, name: &str, type_name: &str, start: Option<i32>) {
        let found = self.table.enumerations.iter().find(|e| e.name == type_name);
        let Some(enumeration) = found else {
            self.problems.push(format!("`{name}`: enumeration `{type_name}` is not defined"));
            return;
        };
        if let Some(start) = start {
            self.expect(enumeration.items.iter().any(|i| i.value == start), || {
                format!("`{name}`: no item of `{type_name}` has the value {start}")
            });
        }
    }

    fn dependencies(&mut self, index: usize, variable: &Variable) {
        let table = self.table;
        if let Some(list) = &variable.dependencies {
            let stepping = variable.causality == Causality::Output || variable.derivative_of().is_some();
            self.expect(stepping, || {
                format!("`{}` lists dependencies but is neither an output nor a state derivative", variable.name)
            });
            let states = self.states.clone();
            self.knowns(variable, list, "at communication points", |known, v| {
                matches!(v.causality, Causality::Input | Causality::Independent) || states.contains(&known)
            });
        }
        if let Some(list) = &variable.initial_dependencies {
            self.expect(table.initial_unknowns().any(|u| u == index), || {
                format!("`{}` lists initial dependencies but is not an unknown of initialisation mode", variable.name)
            });
            self.knowns(variable, list, "in initialisation mode", |_, v| {
                matches!(v.causality, Causality::Input | Causality::Independent)
                    || v.effective_initial() == Some(Initial::Exact)
            });
            let kinds = list.iter().all(|d| matches!(d.kind, DependencyKind::Dependent | DependencyKind::Constant));
            self.expect(kinds, || format!("`{}`: initial dependencies are dependent or constant", variable.name));
        }
    }

    fn knowns(
        &mut self,
        variable: &Variable,
        list: &[Dependency],
        when: &str,
        is_known: impl Fn(usize, &Variable) -> bool,
    ) {
        let name = &variable.name;
        let mut seen = HashSet::new();
        for dependency in list {
            let known = dependency.index;
            self.expect(seen.insert(known), || format!("`{name}` lists the dependency on index {known} twice"));
            match self.table.variables.get(known) {
                None => self.problems.push(format!("`{name}` depends on index {known}, which does not exist")),
                Some(other) => self.expect(is_known(known, other), || {
                    format!("`{name}` depends on `{}`, which is no known {when}", other.name)
                }),
            }
            // A linear factor has a meaning between reals only.
            let linear = dependency.kind != DependencyKind::Dependent;
            let real = variable.base_type() == BaseType::Real;
            self.expect(!linear || real, || {
                format!("`{name}` is not real and so cannot depend linearly on index {known}")
            });
        }
    }
}

fn is_c_identifier(name: &str) -> bool {
    let start = name.starts_with(|c: char| c == '_' || c.is_ascii_alphabetic());
    start && name.chars().all(|c| c == '_' || c.is_ascii_alphanumeric())
}

/// Are the numbers that are there in ascending order?
fn in_order<T: PartialOrd + Copy>(numbers: &[Option<T>]) -> bool {
    let there: Vec<T> = numbers.iter().flatten().copied().collect();
    there.windows(2).all(|pair| pair[0] <= pair[1])
}

#[cfg(test)]
mod tests;
