//! The project's own tasks, run as `cargo xtask <task>`.
//!
//! `cargo xtask test` is the one check: what passes here passes in CI, which calls nothing else.

mod bench;
mod importers;
mod licences;
mod project;
mod python;
mod runner;
mod tasks;

use std::process::ExitCode;

const USAGE: &str = "\
The project's own tasks.

Usage: cargo xtask <task>

  test [--fast]   everything: formatting, lints, documentation, licences, Rust tests, the FMUs,
                  the tests seen from outside (Python), a second FMI importer.
                  --fast leaves out the documentation and the second importer
  lint            formatting, lints, documentation and licences only
  score [ARGS]    the whole discovery suite; ARGS go to `python -m discovery_suite score`
  bench [ARGS]    what a step costs beside SUNDIALS, diffsol and scipy, which are built for it; ARGS go to that bench
                  (--rounds N, --out DIR, names of cases). Then what a search costs. Not part of `test`
  venv            make the Python environment of the tests and print its interpreter

Needed: Rust (the pinned toolchain comes by itself), a C linker and Python 3.11 or newer with venv.
Python packages go to target/venv, never anywhere else. PYTHON names another interpreter.

Example: cargo xtask test";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let done = match words.as_slice() {
        ["test"] => tasks::test(tasks::Extent::Whole),
        ["test", "--fast"] => tasks::test(tasks::Extent::Fast),
        ["lint"] => tasks::lint(),
        ["score", rest @ ..] => tasks::score(rest),
        ["bench", rest @ ..] => bench::bench(rest),
        ["venv"] => tasks::venv(),
        ["--help" | "-h" | "help"] => {
            println!("{USAGE}");
            return ExitCode::SUCCESS;
        }
        [] => {
            eprintln!("{USAGE}");
            return ExitCode::from(2);
        }
        other => {
            eprintln!("no task `{}`\n\n{USAGE}", other.join(" "));
            return ExitCode::from(2);
        }
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("\ncargo xtask {}: {error:#}", words.join(" "));
            ExitCode::FAILURE
        }
    }
}
