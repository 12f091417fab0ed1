//! How a command ends when it does not succeed.

use std::io::{self, ErrorKind, Write as _};
use std::path::Path;
use std::process::ExitCode;

use crate::terminal;

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
    terminal::tell(&in_words(error));
    ExitCode::from(if error.downcast_ref::<BadInput>().is_some() { 2 } else { 1 })
}

/// Tells what clap has to say: help and version on standard output, wrong use on standard error.
pub(crate) fn usage(error: &clap::Error) -> ExitCode {
    // As clap prints it, in colour on a terminal, unless a name in it may bring codes of its own.
    let coded = std::env::args_os().any(|argument| argument.to_string_lossy().contains(char::is_control));
    let text = error.render().to_string();
    let told = match (coded, error.use_stderr()) {
        (false, _) => error.print(),
        (true, true) => io::stderr().write_all(terminal::plain(&text).as_bytes()),
        (true, false) => io::stdout().write_all(terminal::plain(&text).as_bytes()),
    };
    match told.and_then(|()| io::stdout().flush()) {
        // Where standard error cannot be written there is nowhere left to say so.
        Err(unwritten) if !error.use_stderr() => report(&terminal::named(&unwritten).into()),
        _ => ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(2)),
    }
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
