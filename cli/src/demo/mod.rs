//! `cdpr demo`: the whole story in one go, chapter by chapter.

mod control;
mod drive;
mod importer;
mod missing;
mod own;
mod record;
mod release;
mod replay;

use std::io::Write;
use std::path::PathBuf;

use crate::{model, terminal};

/// Show what this program does: build an FMU, drive it, find the effects that are missing from it; no input needed.
///
/// With a model of your own: pack it, drive its FMU from its start, and draw what it does.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  cdpr demo --out demo\n  cdpr demo --model my.toml --out mine")]
pub(crate) struct Arguments {
    /// Folder for everything that is made
    #[arg(long, value_name = "DIR", default_value = "cdpr-demo")]
    out: PathBuf,
    /// A model of 3 cables or more, in place of the paper's robot
    #[arg(long, value_name = "FILE.toml")]
    model: Option<PathBuf>,
}

/// A file that the demo made, and what it is.
struct Made {
    path: PathBuf,
    what: &'static str,
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let made = match &arguments.model {
        Some(path) => own::tell(path, &arguments.out)?,
        None => {
            model::folder(&arguments.out)?;
            let mut made = release::tell(&arguments.out)?;
            made.extend(missing::tell(&arguments.out)?);
            made
        }
    };
    let mut out = terminal::out();
    writeln!(out, "\nMade in {}:", arguments.out.display())?;
    let width = made.iter().map(|made| made.path.display().to_string().len()).max().unwrap_or_default();
    for Made { path, what } in made {
        writeln!(out, "  {:<width$}  {what}", path.display().to_string())?;
    }
    Ok(())
}
