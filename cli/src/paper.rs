//! `cdpr paper`: the paper's simulations, figures and claims.

use std::io::Write as _;
use std::path::PathBuf;

use cdpr_paper::PaperError;

use crate::failure::BadInput;
use crate::progress::Progress;
use crate::terminal;

/// Stages that the programme tells of.
const STAGES: f64 = 5.0;

/// The paper's simulations, figures and claims, each beside what the equations give.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  \
    cdpr paper --out paper\n\n\
    Writes the figures (SVG and PNG), the data (CSV) and claims.md: each statement of the paper beside what the equations \
    give, with the number and the verdict.")]
pub(crate) struct Arguments {
    /// Folder to write into
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    if arguments.out.exists() && !arguments.out.is_dir() {
        return Err(BadInput(format!(
            "--out is {}, expected a folder; there is a file of that name",
            arguments.out.display()
        ))
        .into());
    }
    let mut progress = Progress::new("the paper's simulations");
    let mut stages = 0.0;
    let claims = cdpr_paper::write(&arguments.out, |_| {
        progress.update(stages / STAGES);
        stages += 1.0;
    })
    .map_err(|error| match error {
        PaperError::Write { .. } => anyhow::Error::from(BadInput(error.to_string())),
        other => other.into(),
    })?;
    drop(progress);
    let mut out = terminal::out();
    for claim in &claims {
        writeln!(out, "{}: {}", claim.place, claim.statement)?;
        writeln!(out, "    {}", claim.verdict)?;
    }
    writeln!(out, "\nfigures, data and claims.md are in {}", arguments.out.display())?;
    Ok(out.flush()?)
}
