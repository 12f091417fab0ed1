//! Steps with a heading, a duration and a stop at the first failure.

use std::process::Command;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};

/// Runs steps one after the other and remembers how long each took.
pub(crate) struct Runner {
    begun: Instant,
    durations: Vec<(String, Duration)>,
}

impl Runner {
    pub(crate) fn new() -> Self {
        Self { begun: Instant::now(), durations: Vec::new() }
    }

    /// One step under its heading; an error names the step.
    pub(crate) fn step<T>(&mut self, title: &str, work: impl FnOnce() -> Result<T>) -> Result<T> {
        println!("\n=== {title}");
        let begun = Instant::now();
        let result = work().with_context(|| format!("the step `{title}` failed"));
        let took = begun.elapsed();
        if result.is_ok() {
            println!("--- {title}: ok, {:.1} s", took.as_secs_f64());
        } else {
            println!("--- {title}: FAILED, {:.1} s", took.as_secs_f64());
        }
        self.durations.push((title.to_owned(), took));
        result
    }

    /// The closing table.
    pub(crate) fn summary(&self, what: &str) {
        println!("\n=== {what}: every step passed");
        for (title, took) in &self.durations {
            println!("{:8.1} s  {title}", took.as_secs_f64());
        }
        println!("{:8.1} s  in all", self.begun.elapsed().as_secs_f64());
    }
}

/// Runs a command, output straight to the terminal; an error shows the command line.
pub(crate) fn run(command: &mut Command) -> Result<()> {
    let line = command_line(command);
    println!("$ {line}");
    let status = command.status().with_context(|| format!("cannot start `{line}`"))?;
    if !status.success() {
        bail!("`{line}` ended with {status}");
    }
    Ok(())
}

/// The command as a person would type it (environment left out).
pub(crate) fn command_line(command: &Command) -> String {
    std::iter::once(command.get_program())
        .chain(command.get_args())
        .map(|word| {
            let word = word.to_string_lossy();
            if word.contains(' ') { format!("'{word}'") } else { word.into_owned() }
        })
        .collect::<Vec<_>>()
        .join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failing_step_names_itself_and_its_command() {
        let mut runner = Runner::new();
        let error = runner.step("lints", || run(&mut Command::new("a-program-that-is-not"))).unwrap_err();
        let text = format!("{error:#}");
        assert!(text.contains("the step `lints` failed"), "{text}");
        assert!(text.contains("cannot start `a-program-that-is-not`"), "{text}");
    }

    #[test]
    fn a_word_with_a_space_is_quoted() {
        let mut command = Command::new("python");
        command.args(["-c", "import sys"]);
        assert_eq!(command_line(&command), "python -c 'import sys'");
    }
}
