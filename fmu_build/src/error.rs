//! Why an FMU was not packed.

use std::path::PathBuf;

use fmi2_export::ModelError;
use fmi2_export::description::DescriptionError;

/// Why an FMU was not packed. Nothing is written where one of these is returned.
#[derive(Debug, thiserror::Error)]
pub enum PackError {
    /// The model could not be built from its resources.
    #[error("the model cannot be built: {0}")]
    Model(#[from] ModelError),
    /// The description breaks rules of the standard.
    #[error(transparent)]
    Description(#[from] DescriptionError),
    /// The XML text does not hold together.
    #[error("modelDescription.xml does not hold together:\n  - {}", .0.join("\n  - "))]
    Xml(Vec<String>),
    /// No binary was given.
    #[error("there is no binary to pack; at least one platform is needed")]
    NoBinary,
    /// Two binaries for one platform.
    #[error("there are two binaries for {0}; expected one for each platform")]
    TwoBinaries(&'static str),
    /// A binary is not a shared library, or one for another platform than it was given for.
    #[error("the binary for {platform} cannot be packed: {found}")]
    NotALibrary {
        /// The platform's folder name.
        platform: &'static str,
        /// What was found instead.
        found: String,
    },
    /// A binary lacks functions of FMI 2.0.
    #[error("the binary for {platform} does not export {}", .missing.join(", "))]
    MissingFunctions {
        /// The platform's folder name.
        platform: &'static str,
        /// The functions that were not found.
        missing: Vec<&'static str>,
    },
    /// A binary does not work with the rest of the FMU.
    #[error("the binary for {platform} does not work with this description and these resources: {found}")]
    DoesNotRun {
        /// The platform's folder name.
        platform: &'static str,
        /// What it answered.
        found: String,
    },
    /// A name inside the archive that leaves its folder or is taken.
    #[error("`{0}` cannot be a file of the FMU: expected a relative path with `/`, each path once")]
    Name(String),
    /// The documentation could not be written.
    #[error("the documentation cannot be written: {0}")]
    Documentation(#[from] minijinja::Error),
    /// The archive could not be written.
    #[error("the archive cannot be written: {0}")]
    Archive(#[from] zip::result::ZipError),
    /// A platform or target that is not known.
    #[error("unknown target `{found}`: expected {expected}")]
    UnknownTarget {
        /// What was asked for.
        found: String,
        /// What can be asked for.
        expected: String,
    },
    /// A tool that a cross build needs is not there.
    #[error("{what} is needed to build for {target}, and is not there ({found})\n  to get it: {remedy}")]
    MissingTool {
        /// The tool.
        what: String,
        /// The target.
        target: String,
        /// What was found instead.
        found: String,
        /// What would install it.
        remedy: String,
    },
    /// A cross build failed; its output went to stderr.
    #[error("`{command}` ended with {status}; its messages stand above")]
    BuildFailed {
        /// The command line.
        command: String,
        /// How it ended.
        status: std::process::ExitStatus,
    },
    /// The folder for temporary files, where binaries are tried, is not to be used.
    #[error("the temporary folder {}: {found}; the environment variable TMPDIR names another", .folder.display())]
    TemporaryFolder {
        /// The folder.
        folder: PathBuf,
        /// What is wrong with it.
        found: String,
    },
    /// A file could not be read or written.
    #[error("{}: {source}", .path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
}

impl PackError {
    pub(crate) fn file(path: impl Into<PathBuf>) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.into();
        move |source| Self::File { path, source }
    }
}
