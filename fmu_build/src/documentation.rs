//! Writes `documentation/index.html` out of the description and the model's own pages.

use fmi2_export::Value;
use fmi2_export::description::{Causality, Initial, Kind, ModelDescription, Variable};
use minijinja::{AutoEscape, Environment, context};
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

/// The whole page. `licences` are names of files in the folder `licenses` beside it.
pub(crate) fn index(
    description: &ModelDescription,
    sections: &[Section],
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
        licences,
    };
    render(include_str!("documentation.html.jinja"), values)
}

/// A template with its values; text is escaped for HTML.
pub(crate) fn render(template: &str, values: minijinja::Value) -> Result<String, PackError> {
    let mut environment = Environment::new();
    environment.set_auto_escape_callback(|_| AutoEscape::Html);
    environment.set_trim_blocks(true);
    environment.set_lstrip_blocks(true);
    Ok(environment.render_str(template, values)?)
}

fn row(variable: &Variable, description: &ModelDescription) -> Row {
    Row {
        name: variable.name.clone(),
        unit: unit(variable),
        start: start(variable, description),
        description: variable.description.clone().unwrap_or_default(),
    }
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
        (Kind::Enumeration { type_name, .. }, Some(Value::Integer(value))) => description
            .enumerations
            .iter()
            .find(|enumeration| enumeration.name == *type_name)
            .and_then(|enumeration| enumeration.items.iter().find(|item| item.value == value))
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
        let page = index(&table, &sections, &["LICENSE-MIT.txt"]).unwrap();
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
}
