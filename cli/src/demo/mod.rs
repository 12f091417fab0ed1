//! `cdpr demo`: the whole story in one go, chapter by chapter.

mod control;
mod importer;
mod missing;
mod record;
mod release;
mod replay;

use std::io::Write;
use std::path::PathBuf;

use crate::{model, terminal};

/// Show what this program does: build an FMU, drive it, find the effects that are missing from it; no input needed.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  cdpr demo --out demo")]
pub(crate) struct Arguments {
    /// Folder for everything that is made
    #[arg(long, value_name = "DIR", default_value = "cdpr-demo")]
    out: PathBuf,
}

/// A file that the demo made, and what it is.
struct Made {
    path: PathBuf,
    what: &'static str,
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    model::folder(&arguments.out)?;
    let mut made = release::tell(&arguments.out)?;
    made.extend(missing::tell(&arguments.out)?);
    let mut out = terminal::out();
    writeln!(out, "\nMade in {}:", arguments.out.display())?;
    let width = made.iter().map(|made| made.path.display().to_string().len()).max().unwrap_or_default();
    for Made { path, what } in made {
        writeln!(out, "  {:<width$}  {what}", path.display().to_string())?;
    }
    Ok(())
}
