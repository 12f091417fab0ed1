//! How a command ends when it does not succeed.

use std::io::ErrorKind;
use std::path::Path;
use std::process::ExitCode;

/// Wrong use or bad input, as against work that failed: exit code 2.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub(crate) struct BadInput(pub(crate) String);

impl BadInput {
    /// Bad input in a file.
    pub(crate) fn in_file(path: &Path, message: impl std::fmt::Display) -> Self {
        Self(format!("{}: {message}", path.display()))
    }
}

/// Tells the user and chooses the exit code: 2 for bad input, 1 for the rest, 0 where the reader of our output has
/// seen enough and closed the pipe.
pub(crate) fn report(error: &anyhow::Error) -> ExitCode {
    let pipe_closed = |cause: &(dyn std::error::Error + 'static)| {
        cause.downcast_ref::<std::io::Error>().is_some_and(|e| e.kind() == ErrorKind::BrokenPipe)
    };
    if error.chain().any(pipe_closed) {
        return ExitCode::SUCCESS;
    }
    eprintln!("cdpr: {error:#}");
    ExitCode::from(if error.downcast_ref::<BadInput>().is_some() { 2 } else { 1 })
}
