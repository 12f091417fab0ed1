//! What each task runs.

use anyhow::Result;

use crate::importers;
use crate::licences;
use crate::project::Project;
use crate::python::Environment;
use crate::runner::{Runner, run};

/// How much of the tests to run.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Extent {
    /// Everything.
    Whole,
    /// What a change needs while one works on it.
    Fast,
}

/// `cargo xtask test`
pub(crate) fn test(extent: Extent) -> Result<()> {
    let project = Project::find()?;
    let mut runner = Runner::new();
    let environment = runner.step("Python environment", || Environment::prepare(&project))?;
    lints(&mut runner, &project, &environment, extent)?;
    // One profile for lints, documentation, tests and the command: dependencies compile once.
    runner.step("Rust tests", || run(project.cargo().args(["test", "--release", "--locked", "--workspace"])))?;
    build_command(&mut runner, &project)?;
    // The Rust tests built the examples as well. `cargo run --package` chooses other features of what packages share, and
    // would compile the plant and the search once more.
    let examples = project.target.join("release").join("examples");
    runner.step("tests seen from outside", || {
        let mut pytest = environment.python();
        // Files side by side: most tests keep one processor busy, and what a file's tests share is made once. In their own order:
        // by the number of their tests those with the searches, few and long, would come last, one processor waiting.
        pytest
            .args(["-m", "pytest", "-n", "auto", "--dist", "loadfile", "--no-loadscope-reorder"])
            .current_dir(&project.root)
            .env("CDPR_BIN", project.binary("cdpr"))
            .env("CDPR_EXAMPLES", &examples);
        if extent == Extent::Fast {
            pytest.args(["-m", "not slow"]);
        }
        run(&mut pytest)
    })?;
    if extent == Extent::Whole {
        importers::test(&mut runner, &project, &environment)?;
    }
    runner.summary("cargo xtask test");
    Ok(())
}

/// `cargo xtask lint`
pub(crate) fn lint() -> Result<()> {
    let project = Project::find()?;
    let mut runner = Runner::new();
    let environment = runner.step("Python environment", || Environment::prepare(&project))?;
    lints(&mut runner, &project, &environment, Extent::Whole)?;
    runner.summary("cargo xtask lint");
    Ok(())
}

/// `cargo xtask score`: the whole discovery suite, minutes to hours.
pub(crate) fn score(arguments: &[&str]) -> Result<()> {
    let project = Project::find()?;
    let mut runner = Runner::new();
    let environment = runner.step("Python environment", || Environment::prepare(&project))?;
    build_command(&mut runner, &project)?;
    runner.step("discovery suite", || {
        run(environment
            .python()
            .args(["-m", "discovery_suite", "score"])
            .args(arguments)
            .current_dir(&project.root)
            .env("PYTHONPATH", project.root.join("tests"))
            .env("CDPR_BIN", project.binary("cdpr")))
    })
}

pub(crate) fn build_command(runner: &mut Runner, project: &Project) -> Result<()> {
    runner.step("the cdpr command", || run(project.cargo().args(["build", "--release", "--locked"])))
}

/// `cargo xtask venv`
pub(crate) fn venv() -> Result<()> {
    let project = Project::find()?;
    let environment = Environment::prepare(&project)?;
    println!("{}", environment.interpreter().display());
    Ok(())
}

/// Everything that reads the sources without running them, quickest first.
fn lints(runner: &mut Runner, project: &Project, environment: &Environment, extent: Extent) -> Result<()> {
    runner.step("Rust formatting", || run(project.cargo().args(["fmt", "--all", "--check"])))?;
    runner.step("Python lints and formatting", || {
        let ruff = |words: &[&str]| {
            let mut command = environment.python();
            command.args(["-m", "ruff"]).args(words);
            command.current_dir(&project.root);
            run(&mut command)
        };
        ruff(&["check", "."])?;
        ruff(&["format", "--check", "."])
    })?;
    runner.step("licences and sources of dependencies", || licences::check(project))?;
    runner.step("Rust lints", || {
        run(project
            .cargo()
            .args(["clippy", "--release", "--locked", "--workspace", "--all-targets"])
            .args(["--", "-D", "warnings"]))
    })?;
    if extent == Extent::Whole {
        runner.step("Rust documentation", || {
            run(project
                .cargo()
                .args(["doc", "--release", "--locked", "--workspace", "--no-deps"])
                .env("RUSTDOCFLAGS", "-D warnings"))
        })?;
    }
    Ok(())
}
