//! Writes `documentation/index.html` out of the description and the model's own pages.

use fmi2_export::Value;
use fmi2_export::description::{Causality, EnumerationItem, Initial, Kind, ModelDescription, Variable};
use minijinja::{AutoEscape, Environment, HtmlEscape, context};
use serde::Serialize;

use crate::PackError;

/// A part of the documentation that the model's author wrote.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Section {
    /// The heading, plain text.
    pub(crate) title: String,
    /// The text below it: HTML, well-formed, headings from `<h3>` down.
    pub(crate) html: String,
}

/// One row of a table of variables.
#[derive(Serialize)]
struct Row {
    name: String,
    unit: String,
    start: String,
    description: String,
    choices: Vec<Choice>,
}

/// A value of an enumeration.
#[derive(Serialize)]
struct Choice {
    name: String,
    value: i32,
    description: Option<String>,
}

/// The variables of one causality.
#[derive(Serialize)]
struct Group {
    title: &'static str,
    note: &'static str,
    rows: Vec<Row>,
}

const GROUPS: [(Causality, &str, &str); 6] = [
    (Causality::Input, "Inputs", "Set them at communication points."),
    (Causality::Output, "Outputs", ""),
    (Causality::Parameter, "Parameters", "Set them before initialisation ends; the start value holds otherwise."),
    (Causality::CalculatedParameter, "Calculated parameters", ""),
    (Causality::Local, "Local variables", "To look at, not to connect."),
    (Causality::Independent, "Independent variable", ""),
];

/// The whole page. `binaries` are the platforms with what each needs, `licences` are names of files in the folder `licenses` beside it.
pub(crate) fn index(
    description: &ModelDescription,
    sections: &[Section],
    binaries: &[String],
    licences: &[&str],
) -> Result<String, PackError> {
    let groups: Vec<Group> = GROUPS
        .into_iter()
        .map(|(causality, title, note)| Group {
            title,
            note,
            rows: description
                .variables
                .iter()
                .filter(|variable| variable.causality == causality)
                .map(|variable| row(variable, description))
                .collect(),
        })
        .filter(|group| !group.rows.is_empty())
        .collect();
    let experiment = description.default_experiment.unwrap_or_default();
    let values = context! {
        name => description.model_name,
        identifier => description.model_identifier,
        description => description.description,
        author => description.author,
        version => description.version,
        copyright => description.copyright,
        license => description.license,
        stop_time => experiment.stop_time,
        step_size => experiment.step_size,
        output_order => description.capabilities.max_output_derivative_order,
        interpolates => description.capabilities.can_interpolate_inputs,
        directional => description.capabilities.provides_directional_derivative,
        sections,
        groups,
        binaries,
        licences,
    };
    render(include_str!("documentation.html.jinja"), values)
}

/// A template with its values; text is escaped for HTML. The filter `code` sets what stands between backticks as code.
pub(crate) fn render(template: &str, values: minijinja::Value) -> Result<String, PackError> {
    let mut environment = Environment::new();
    environment.add_filter("code", |text: String| minijinja::Value::from_safe_string(with_code(&text)));
    environment.set_auto_escape_callback(|_| AutoEscape::Html);
    environment.set_trim_blocks(true);
    environment.set_lstrip_blocks(true);
    Ok(environment.render_str(template, values)?)
}

/// Escaped for HTML, with `<code>` for what stands between two backticks.
fn with_code(text: &str) -> String {
    let mut parts: Vec<String> = text.split('`').map(|part| HtmlEscape(part).to_string()).collect();
    // With an odd number of backticks the last one opens nothing.
    if parts.len().is_multiple_of(2) {
        let rest = parts.pop().unwrap_or_default();
        if let Some(last) = parts.last_mut() {
            *last += &format!("`{rest}");
        }
    }
    let part = |(k, part)| if k % 2 == 1 { format!("<code>{part}</code>") } else { part };
    parts.into_iter().enumerate().map(part).collect()
}

fn row(variable: &Variable, description: &ModelDescription) -> Row {
    Row {
        name: variable.name.clone(),
        unit: unit(variable),
        start: start(variable, description),
        description: variable.description.clone().unwrap_or_default(),
        choices: items(variable, description).iter().map(choice).collect(),
    }
}

/// The values of an enumeration; none of any other type.
fn items<'a>(variable: &Variable, description: &'a ModelDescription) -> &'a [EnumerationItem] {
    let Kind::Enumeration { type_name, .. } = &variable.kind else { return &[] };
    let found = description.enumerations.iter().find(|enumeration| enumeration.name == *type_name);
    found.map_or(&[], |enumeration| &enumeration.items)
}

fn choice(item: &EnumerationItem) -> Choice {
    Choice { name: item.name.clone(), value: item.value, description: item.description.clone() }
}

fn unit(variable: &Variable) -> String {
    match &variable.kind {
        Kind::Real(real) => real.unit.clone().unwrap_or_else(|| "1".into()),
        Kind::Integer(_) => "integer".into(),
        Kind::Boolean { .. } => "Boolean".into(),
        Kind::String { .. } => "text".into(),
        Kind::Enumeration { .. } => "choice".into(),
    }
}

/// The start value as a reader would write it; a guess is marked as one.
fn start(variable: &Variable, description: &ModelDescription) -> String {
    let text = match (&variable.kind, variable.start_of()) {
        (_, None) => return String::new(),
        (Kind::Enumeration { .. }, Some(Value::Integer(value))) => items(variable, description)
            .iter()
            .find(|item| item.value == value)
            .map_or_else(|| value.to_string(), |item| format!("{} ({value})", item.name)),
        (_, Some(Value::Real(value))) => format!("{value:?}"),
        (_, Some(Value::Integer(value))) => value.to_string(),
        (_, Some(Value::Boolean(value))) => value.to_string(),
        (_, Some(Value::String(value))) => value,
    };
    if variable.effective_initial() == Some(Initial::Approx) { format!("{text} (guess)") } else { text }
}

#[cfg(test)]
mod tests {
    use fmi2_export::description::Enumeration;

    use super::*;

    #[test]
    fn the_page_names_every_variable_and_escapes_text() {
        let mut table = ModelDescription::new("A < B", "A");
        table.enumerations = vec![Enumeration::new("Choice", [("one", ""), ("two", "")])];
        table.add(Variable::real("u", 0).input().start(0.25).described("push & pull"));
        table.add(Variable::real("x", 1).output());
        table.add(Variable::enumeration("mode", 0, "Choice").parameter().start_value(Value::Integer(2)));
        let sections = [Section { title: "What it models".into(), html: "<p>A <em>mass</em>.</p>".into() }];
        let page = index(&table, &sections, &["linux64 (glibc 2.17)".into()], &["LICENSE-MIT.txt"]).unwrap();
        for part in [
            "<h1>A &lt; B</h1>",
            "push &amp; pull",
            "<p>A <em>mass</em>.</p>",
            "two (2)",
            "0.25",
            "href=\"licenses/LICENSE-MIT.txt\"",
            "Inputs",
            "Outputs",
            "Parameters",
        ] {
            assert!(page.contains(part), "{part} is missing in\n{page}");
        }
        assert!(!page.contains("Local variables"));
    }

    #[test]
    fn every_value_of_an_enumeration_is_listed_not_only_the_start() {
        let mut table = ModelDescription::new("A", "A");
        table.enumerations = vec![Enumeration::new("Choice", [("one", "The first"), ("two", "The `second`")])];
        table.add(Variable::enumeration("mode", 0, "Choice").parameter().start_value(Value::Integer(2)));
        let page = index(&table, &[], &[], &[]).unwrap();
        for part in ["<code>one</code> (1): The first", "<code>two</code> (2): The <code>second</code>"] {
            assert!(page.contains(part), "{part} is missing in\n{page}");
        }
    }

    #[test]
    fn backticks_become_code_and_text_stays_escaped() {
        assert_eq!(with_code("`a < b` and `c`"), "<code>a &lt; b</code> and <code>c</code>");
        assert_eq!(with_code("no code & none"), "no code &amp; none");
        assert_eq!(with_code("`open"), "`open");
        assert_eq!(with_code("`a` and `open"), "<code>a</code> and `open");
    }
}
