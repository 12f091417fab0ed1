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
        let broken = |error: &std::io::Error| error.kind() == ErrorKind::BrokenPipe;
        match cause.downcast_ref::<csv::Error>().map(csv::Error::kind) {
            Some(csv::ErrorKind::Io(error)) => broken(error),
            _ => cause.downcast_ref().is_some_and(broken),
        }
    };
    if error.chain().any(pipe_closed) {
        return ExitCode::SUCCESS;
    }
    eprintln!("cdpr: {}", in_words(error));
    ExitCode::from(if error.downcast_ref::<BadInput>().is_some() { 2 } else { 1 })
}

/// The error and its causes, without those that it already tells of.
fn in_words(error: &anyhow::Error) -> String {
    let mut text = String::new();
    for cause in error.chain().map(ToString::to_string) {
        if text.is_empty() {
            text = cause;
        } else if !text.contains(&cause) {
            text = format!("{text}: {cause}");
        }
    }
    text
}
