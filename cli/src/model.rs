//! `cdpr model`: the default model as a file, the check of one; and the model that any command works on.

use std::f64::consts::TAU;
use std::fs::{self, File};
use std::io::{ErrorKind, Read as _, Write as _};
use std::path::{Path, PathBuf};

use cdpr::model_file::Model;
use cdpr::parameters::{CableParameters, Parameters};
use cdpr::per_cable::MAX_CABLES;
use cdpr::simulation::Start;

use crate::failure::BadInput;
use crate::{simulate, terminal};

/// A model file of more bytes than this is taken for something else.
const LARGEST: u64 = 1 << 24;

/// Print the whole default model with units and comments, or check a model file.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  \
    cdpr model > model.toml\n  \
    cdpr model --cables 6 > model.toml\n  \
    cdpr model --check model.toml\n\n\
    Every key may be left out and then has the value printed here; unknown keys are errors. A robot of one's own has a \
    [[cable]] table for each cable, as --cables prints them. Effects follow as \
    [[effect]] tables; cdpr effects lists them. A check reads the file, builds the plant and finds its start.")]
pub(crate) struct Arguments {
    /// Check this model file instead
    #[arg(long, value_name = "FILE.toml")]
    check: Option<PathBuf>,
    /// Print the default platform on so many cables instead, each a table to write a robot of one's own into
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(3..=MAX_CABLES as i64),
        conflicts_with = "check")]
    cables: Option<u8>,
}

/// The default robot on `cables` cables by coordinates, to the millimetre: anchors all around, and neighbours' attachments
/// exchanged two by two, as in Table I, so that cables turn the platform either way.
fn around(cables: usize) -> Model {
    let default = Parameters::default();
    let point = |radius: f64, i: usize| {
        let angle = TAU * ((i as f64 + 0.5) / cables as f64 - 0.5);
        [radius * angle.cos(), radius * angle.sin()].map(|v| (1e3 * v).round() / 1e3)
    };
    let partner = |i: usize| if (i ^ 1) < cables { i ^ 1 } else { i };
    let cable =
        |i| CableParameters::between(point(default.anchor_radius, i), point(default.attachment_radius, partner(i)));
    let cable = (0..cables).map(cable).collect();
    Model { parameters: Parameters { cable, ..default }, start: Start::pulling(cables), ..Model::default() }
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let mut out = terminal::out();
    let Some(path) = &arguments.check else {
        let model = arguments.cables.map_or_else(Model::default, |cables| around(cables.into()));
        write!(out, "{}", model.to_toml())?;
        writeln!(out, "\n# Effects, each as a table; cdpr effects lists them with their parameters:")?;
        writeln!(out, "# [[effect]]\n# id = \"winch_coulomb_friction\"\n# cable = 3\n# force = 250.0")?;
        return Ok(out.flush()?);
    };
    let (_, model) = read(Some(path))?;
    let simulation = simulate::begin_simulation(&model)?;
    let (cables, effects) = (simulation.slack().len(), model.effects.len());
    let plural = if effects == 1 { "" } else { "s" };
    writeln!(
        out,
        "{}: a model with {cables} cables and {effects} effect{plural}; nothing is wrong with it",
        path.display()
    )?;
    Ok(out.flush()?)
}

/// The model file's text and model; of the default model without a file.
pub(crate) fn read(path: Option<&Path>) -> anyhow::Result<(String, Model)> {
    let Some(path) = path else {
        let model = Model::default();
        return Ok((model.to_toml(), model));
    };
    let mut text = String::new();
    let read = File::open(path).and_then(|file| file.take(LARGEST).read_to_string(&mut text));
    let size = read.map_err(|error| match error.kind() {
        ErrorKind::InvalidData => BadInput::in_file(path, "not a text, expected a model file in UTF-8"),
        _ => BadInput::in_file(path, error),
    })?;
    // A device may have no end.
    if size as u64 >= LARGEST {
        return Err(BadInput::in_file(path, format!("more than {LARGEST} bytes, expected a model file")).into());
    }
    let model = Model::from_toml(&text).map_err(|error| BadInput::in_file(path, error))?;
    Ok((text, model))
}

/// Makes sure that a folder is there.
pub(crate) fn folder(path: &Path) -> Result<(), BadInput> {
    fs::create_dir_all(path).map_err(|error| BadInput::in_file(path, format!("the folder cannot be made: {error}")))
}
