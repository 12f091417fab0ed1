//! Is cargo-zigbuild there, with zig? The build script asks as well, and includes this file.

use std::ffi::OsStr;
use std::process::Command;

/// A program that is not there, and how to get it.
pub(crate) struct Missing {
    pub(crate) what: &'static str,
    /// What was tried, and what came of it.
    pub(crate) found: String,
    pub(crate) remedy: &'static str,
}

/// Looks for cargo-zigbuild, and for zig in the places where that looks.
pub(crate) fn check() -> Result<(), Missing> {
    answer("cargo-zigbuild", ["--version"]).map_err(|found| Missing {
        what: "cargo-zigbuild",
        found,
        remedy: "pip install cargo-zigbuild (or cargo install --locked cargo-zigbuild)",
    })?;
    let zig = std::env::var_os("CARGO_ZIGBUILD_ZIG_PATH").unwrap_or_else(|| "zig".into());
    answer(&zig, ["version"])
        .or_else(|_| answer("python3", ["-m", "ziglang", "version"]))
        .or_else(|_| answer("python", ["-m", "ziglang", "version"]))
        .map_err(|found| Missing { what: "zig", found, remedy: "pip install ziglang" })?;
    Ok(())
}

/// What a program prints, or why it does not.
pub(crate) fn answer<const N: usize>(program: impl AsRef<OsStr>, words: [&str; N]) -> Result<String, String> {
    let program = program.as_ref();
    let output =
        Command::new(program).args(words).output().map_err(|error| format!("{}: {error}", program.display()))?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr);
        let last = said.lines().last().unwrap_or_default();
        return Err(format!("{}: {} {last}", program.display(), output.status));
    }
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}
