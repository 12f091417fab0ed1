//! `cdpr fmu`: pack an FMU of a model.

use std::io::Write;
use std::path::{Path, PathBuf};

use cdpr_fmu_build::{PackError, cable_platform, cross, whole_file};

use crate::{failure::BadInput, model, output, terminal, whole};

/// Pack a model as an FMI 2.0 co-simulation FMU.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  \
    cdpr fmu -o CablePlatform.fmu\n  \
    cdpr fmu --model model.toml --target linux64 --target win64 -o CablePlatform.fmu\n\n\
    A target is linux64 (runs on glibc 2.17 and newer), win64, darwin64 or a Rust target triple. It is built from \
    the source checkout with cargo-zigbuild; without --target the FMU holds the binary for this machine.")]
pub(crate) struct Arguments {
    /// The model file; the default model without it
    #[arg(long, value_name = "FILE.toml")]
    model: Option<PathBuf>,
    /// A platform to build the binary for; may be repeated
    #[arg(long, value_name = "TARGET")]
    target: Vec<String>,
    /// The FMU to write
    #[arg(short, long, value_name = "FILE.fmu", value_parser = output::fmu())]
    output: PathBuf,
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let targets: Result<Vec<_>, _> = arguments.target.iter().map(|text| cross::Target::parse(text)).collect();
    let targets = targets.map_err(|error| BadInput(error.to_string()))?;
    let (text, _) = model::read(arguments.model.as_deref())?;
    pack(&text, &targets, &arguments.output)?;
    // What went down a pipe is nowhere to be found, and nothing should follow it there.
    if !whole_file::is_stream(&arguments.output) {
        writeln!(terminal::out(), "{}", arguments.output.display())?;
    }
    Ok(())
}

/// Makes sure that an FMU can be checked here, before long work that ends in packing one.
pub(crate) fn try_temporary_folder() -> anyhow::Result<()> {
    cable_platform::try_temporary_folder().map_err(refused)
}

/// Packs the model as an FMU with binaries for `targets`, or for this machine where there are none.
pub(crate) fn pack(model_toml: &str, targets: &[cross::Target], path: &Path) -> anyhow::Result<()> {
    whole::write(path, packed(model_toml, targets).map_err(refused)?)
}

/// A folder for temporary files that the user can choose is wrong use; the rest is work that failed.
fn refused(error: PackError) -> anyhow::Error {
    match error {
        PackError::TemporaryFolder { .. } => BadInput(error.to_string()).into(),
        other => other.into(),
    }
}

fn packed(model_toml: &str, targets: &[cross::Target]) -> Result<Vec<u8>, PackError> {
    let mut fmu = cable_platform::fmu(model_toml)?;
    if targets.is_empty() {
        cable_platform::try_temporary_folder()?;
        fmu = fmu.binary(cable_platform::host_binary()?)?;
    }
    for target in targets {
        let source = cross::source_checkout().ok_or_else(|| PackError::MissingTool {
            what: "the source checkout that this program was built from".to_owned(),
            target: target.platform().folder().to_owned(),
            found: "it has been moved or removed".to_owned(),
            remedy: "build cdpr in a checkout, and call it from there".to_owned(),
        })?;
        fmu = fmu.binary(cross::build(&source, cable_platform::PACKAGE, target)?)?;
    }
    fmu.to_bytes()
}
