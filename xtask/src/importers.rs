//! The FMU in importers written in Rust by others: `tests/importers`, a workspace of its own.

use std::process::Command;

use anyhow::{Context, Result, ensure};

use crate::project::Project;
use crate::python::Environment;
use crate::runner::{Runner, run};

/// Lints and runs that workspace with what the crate `fmi` needs to be built.
pub(crate) fn test(runner: &mut Runner, project: &Project, environment: &Environment) -> Result<()> {
    runner.step("a second importer: the crate fmi", || {
        let libclang =
            std::env::var_os("LIBCLANG_PATH").map_or_else(|| environment.libclang(), |path| Ok(path.into()))?;
        let headers = format!("-I{}", compiler_headers()?);
        let cargo = |words: &[&str]| {
            let mut command = project.cargo();
            command
                .arg(words[0])
                .args(["--manifest-path", "tests/importers/Cargo.toml"])
                .args(&words[1..])
                .env("CARGO_TARGET_DIR", project.target.join("importers"))
                .env("LIBCLANG_PATH", &libclang)
                .env("BINDGEN_EXTRA_CLANG_ARGS", &headers)
                .env("CDPR_BIN", project.binary("cdpr"));
            run(&mut command)
        };
        cargo(&["fmt", "--check"])?;
        cargo(&["test", "--locked"])?;
        cargo(&["clippy", "--locked", "--all-targets", "--", "-D", "warnings"])
    })
}

/// Where the C compiler has `stddef.h`: libclang comes without.
pub(crate) fn compiler_headers() -> Result<String> {
    let compiler = std::env::var("CC").unwrap_or_else(|_| "cc".into());
    let output = Command::new(&compiler)
        .arg("-print-file-name=include")
        .output()
        .with_context(|| format!("cannot start the C compiler `{compiler}`"))?;
    ensure!(output.status.success(), "`{compiler} -print-file-name=include` ended with {}", output.status);
    Ok(String::from_utf8_lossy(&output.stdout).trim().to_owned())
}
