//! The plant beside other people's integrators (`benches/peers`, a workspace of its own), and what a search costs.

use std::path::PathBuf;
use std::process::Command;

use anyhow::{Context, Result};

use crate::importers::compiler_headers;
use crate::project::Project;
use crate::python::Environment;
use crate::runner::{Runner, run};
use crate::tasks::build_command;

/// Builds that workspace, with SUNDIALS where that can be built, and runs it.
pub(crate) fn bench(arguments: &[&str]) -> Result<()> {
    let project = Project::find()?;
    let mut runner = Runner::new();
    let environment = runner.step("Python environment", || Environment::prepare(&project))?;
    let target = project.target.join("peers");
    let build = |features: &[&str], search: Option<&PathBuf>| {
        let mut command = project.cargo();
        command
            .args(["build", "--release", "--locked", "--manifest-path", "benches/peers/Cargo.toml"])
            .args(features)
            .env("CARGO_TARGET_DIR", &target);
        if let Some(folder) = search {
            let found = std::env::var_os("PATH").unwrap_or_default();
            let path = std::env::join_paths([folder.clone()].into_iter().chain(std::env::split_paths(&found)))?;
            command.env("PATH", path);
        }
        if let (Ok(libclang), Ok(headers)) = (environment.libclang(), compiler_headers()) {
            command.env("LIBCLANG_PATH", libclang).env("BINDGEN_EXTRA_CLANG_ARGS", format!("-I{headers}"));
        }
        run(&mut command)
    };
    let with_sundials = runner.step("the bench with SUNDIALS", || {
        let folder = cmake(&project, &environment)?;
        build(&["--features", "sundials"], folder.as_ref())
    });
    if let Err(error) = with_sundials {
        eprintln!("SUNDIALS is left out: {error:#}");
        runner.step("the bench without SUNDIALS", || build(&[], None))?;
    }
    let program = target.join("release").join(format!("peers{}", std::env::consts::EXE_SUFFIX));
    run(Command::new(program)
        .args(arguments)
        .current_dir(&project.root)
        .env("CDPR_PYTHON", environment.interpreter())
        .env("PYTHONPATH", project.root.join("tests")))?;
    build_command(&mut runner, &project)?;
    runner.step("what a search costs", || {
        run(environment
            .python()
            .args(["-m", "discovery_suite", "cost", "--cdpr"])
            .arg(project.binary("cdpr"))
            .arg("--out")
            .arg(project.target.join("cost"))
            .current_dir(&project.root)
            .env("PYTHONPATH", project.root.join("tests")))
    })
}

/// The folder of cmake, where it is not on the path: it is installed into the environment.
fn cmake(project: &Project, environment: &Environment) -> Result<Option<PathBuf>> {
    if Command::new("cmake").arg("--version").output().is_ok_and(|output| output.status.success()) {
        return Ok(None);
    }
    let requirements = project.root.join("benches").join("peers").join("requirements.txt");
    run(environment.python().args(["-m", "pip", "install", "--quiet", "--requirement"]).arg(requirements))?;
    Ok(Some(environment.interpreter().parent().context("the interpreter has a folder")?.to_path_buf()))
}
