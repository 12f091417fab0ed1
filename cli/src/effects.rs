//! `cdpr effects`: the catalogue.

use std::fmt::Write as _;
use std::io::Write;

use cdpr::effect::{CATALOGUE, EffectInfo, ParameterInfo, Scope, Site};
use serde_json::{Value, json};

use crate::terminal;

/// List the effects that a model can have: id, equation, parameters, where they show.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  \
    cdpr effects\n  \
    cdpr effects --json > effects.json\n\n\
    An effect is put into a model file as\n  \
    [[effect]]\n  \
    id = \"winch_coulomb_friction\"\n  \
    cable = 3\n  \
    force = 250.0\n  \
    from = 30.0\n\n\
    which begins after 30 s (without `from` and `until` it is always there), and a law that is not in the list as\n  \
    [[effect]]\n  \
    id = \"expression\"\n  \
    target = \"platform.force_x\"\n  \
    expression = \"-34.8*x*abs(y)\"")]
pub(crate) struct Arguments {
    /// Write JSON, with bounds, typical ranges, sources and look-alikes
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let mut out = terminal::out();
    if arguments.json {
        let catalogue: Vec<Value> = CATALOGUE.iter().map(as_json).collect();
        serde_json::to_writer_pretty(&mut out, &catalogue).map_err(std::io::Error::from)?;
        writeln!(out)?;
    } else {
        for info in CATALOGUE {
            writeln!(out, "{}", as_text(info))?;
        }
    }
    Ok(out.flush()?)
}

fn scope(scope: Scope) -> &'static str {
    match scope {
        Scope::EachCable => "one cable, or all without `cable`",
        Scope::Whole => "the whole",
    }
}

/// From when until when it may be there.
fn when(info: &EffectInfo) -> String {
    match info.nature().always {
        None => "always, or `from` and `until` a time in s".to_owned(),
        Some(reason) => format!("always: {reason}"),
    }
}

/// Which speed a law of the winch speed sees.
fn speed(info: &EffectInfo) -> Option<&'static str> {
    let at_winch = info.site == Site::Winch && info.equation.contains("l̇");
    at_winch.then_some(
        "l̇ is the speed at which cable is paid out; with cable_model = \"rigid\" or \"massless_spring\", whose paid-out end has \
         no inertia, L̇ stands in its place",
    )
}

fn as_text(info: &EffectInfo) -> String {
    let mut text = format!("{}: {}\n", info.id, info.title);
    let mut line = |key: &str, value: &str| {
        let _ = writeln!(text, "    {key:<9} {value}");
    };
    line("equation", info.equation);
    if let Some(speed) = speed(info) {
        line("where", speed);
    }
    line("on", scope(info.scope));
    line("when", &when(info));
    for (k, parameter) in info.parameters.iter().enumerate() {
        let default = parameter.default.map_or(String::new(), |value| format!(" (default {value})"));
        let value = format!("{} [{}] {}{default}", parameter.name, parameter.unit, parameter.description);
        line(if k == 0 { "with" } else { "" }, &value);
    }
    for (k, key) in info.texts.iter().enumerate() {
        let value = format!("{}: {}", key.name, key.description);
        line(if k == 0 && info.parameters.is_empty() { "with" } else { "" }, &value);
    }
    line("shows in", info.shows_in);
    for (k, other) in info.look_alikes.iter().enumerate() {
        let value = format!("{}; to tell them apart: {}", other.id, other.separate_by);
        line(if k == 0 { "like" } else { "" }, &value);
    }
    text
}

fn as_json(info: &EffectInfo) -> Value {
    json!({
        "id": info.id,
        "title": info.title,
        "speed": speed(info),
        "equation": info.equation,
        "may_switch": info.nature().always.is_none(),
        "scope": match info.scope { Scope::EachCable => "each_cable", Scope::Whole => "whole" },
        "parameters": info.parameters.iter().map(parameter).collect::<Vec<_>>(),
        "texts": info
            .texts
            .iter()
            .map(|key| json!({ "name": key.name, "description": key.description }))
            .collect::<Vec<_>>(),
        "shows_in": info.shows_in,
        "validity": info.validity,
        "source": info.source,
        "look_alikes": info
            .look_alikes
            .iter()
            .map(|other| json!({ "id": other.id, "separate_by": other.separate_by }))
            .collect::<Vec<_>>(),
    })
}

/// A bound that does not exist becomes `null`.
fn parameter(parameter: &ParameterInfo) -> Value {
    json!({
        "name": parameter.name,
        "unit": parameter.unit,
        "description": parameter.description,
        "default": parameter.default,
        "min": parameter.min,
        "max": parameter.max,
        "typical": parameter.typical,
    })
}
