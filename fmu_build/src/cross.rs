//! Builds the binary for other platforms than the host, from a source checkout, with cargo-zigbuild.
//!
//! Zig brings linkers and C libraries for all platforms in one download, old versions of glibc included. What
//! is needed besides Rust: `pip install cargo-zigbuild`, which brings zig along, and `rustup target add TARGET`.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::{Binary, PackError, Platform, zig};

/// What to build for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Target {
    /// Rust's name of it; `universal2-apple-darwin` stands for both architectures of macOS.
    triple: String,
    /// The oldest glibc to run on, such as `2.17`.
    glibc: Option<String>,
    platform: Platform,
}

/// The names that FMI 2.0 has for platforms, and what is built for them.
const SHORT: [(&str, &str); 3] = [
    ("linux64", "x86_64-unknown-linux-gnu.2.17"),
    ("win64", "x86_64-pc-windows-gnu"),
    ("darwin64", "universal2-apple-darwin"),
];

impl Target {
    /// Reads `linux64` (for glibc 2.17, of 2012), `win64`, `darwin64`, or a Rust target triple, which for Linux
    /// may end with the oldest glibc to run on: `x86_64-unknown-linux-gnu.2.28`.
    ///
    /// # Errors
    /// [`PackError::UnknownTarget`].
    pub fn parse(text: &str) -> Result<Self, PackError> {
        let unknown = || PackError::UnknownTarget {
            found: text.into(),
            expected: "linux64, win64, darwin64, or a Rust target triple, on Linux perhaps with \
                       the oldest glibc to run on, such as x86_64-unknown-linux-gnu.2.17"
                .into(),
        };
        let long = SHORT.iter().find(|(short, _)| *short == text).map_or(text, |(_, long)| long);
        let (triple, glibc) = match long.split_once('.') {
            None => (long, None),
            Some((triple, version)) => (triple, Some(version)),
        };
        if let Some(version) = glibc {
            let numbers = version.split_once('.');
            let both =
                numbers.is_some_and(|(major, minor)| major.parse::<u32>().is_ok() && minor.parse::<u32>().is_ok());
            if !both || !triple.contains("-linux-gnu") {
                return Err(unknown());
            }
        }
        Ok(Self {
            platform: Platform::of_triple(triple).ok_or_else(unknown)?,
            triple: triple.into(),
            glibc: glibc.map(str::to_owned),
        })
    }

    /// The platform that the binary will be packed for.
    #[must_use]
    pub fn platform(&self) -> Platform {
        self.platform
    }

    /// The triple with its suffix, as cargo-zigbuild takes it.
    fn full(&self) -> String {
        match &self.glibc {
            Some(version) => format!("{}.{version}", self.triple),
            None => self.triple.clone(),
        }
    }

    /// The targets that Rust's standard library is needed for.
    fn rust_targets(&self) -> Vec<&str> {
        match self.triple.as_str() {
            "universal2-apple-darwin" => vec!["x86_64-apple-darwin", "aarch64-apple-darwin"],
            triple => vec![triple],
        }
    }

    /// A shared library's file name there.
    fn file_name(&self, name: &str) -> String {
        let prefix = match self.platform {
            Platform::Win32 | Platform::Win64 => "",
            _ => "lib",
        };
        format!("{prefix}{name}.{}", self.platform.extension())
    }
}

/// The checkout that this program was built from, if it is still there.
#[must_use]
pub fn source_checkout() -> Option<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent()?;
    root.join("Cargo.toml").exists().then(|| root.to_path_buf())
}

/// Builds the shared library of `package` in the workspace at `source`, with the profile `fmu`.
///
/// Cargo's messages go to stderr. Compiled files go to `target/cross` in the workspace.
///
/// # Errors
/// [`PackError::MissingTool`] with what would install it, [`PackError::BuildFailed`], and those of
/// [`Binary::new`]; [`PackError::NotALibrary`] too where the library asks for a newer glibc than the target
/// names.
pub fn build(source: &Path, package: &str, target: &Target) -> Result<Binary, PackError> {
    check_tools(target)?;
    let folder = source.join("target").join("cross");
    let mut command = Command::new("cargo");
    command
        .args(["zigbuild", "--locked", "--profile", "fmu", "--package", package])
        .args(["--target", &target.full()])
        .arg("--target-dir")
        .arg(&folder)
        .current_dir(source)
        .stdout(Stdio::null());
    let status = command.status().map_err(PackError::file("cargo"))?;
    if !status.success() {
        return Err(PackError::BuildFailed {
            command: format!("cargo zigbuild --package {package} --target {}", target.full()),
            status,
        });
    }
    let file = target.file_name(&package.replace('-', "_"));
    let binary = Binary::read(target.platform, &folder.join(&target.triple).join("fmu").join(file))?;
    check_glibc(&binary, target)?;
    Ok(binary)
}

fn check_glibc(binary: &Binary, target: &Target) -> Result<(), PackError> {
    let asked = target.glibc.as_deref().and_then(|text| text.split_once('.'));
    let asked = asked.and_then(|(major, minor)| Some((major.parse().ok()?, minor.parse().ok()?)));
    match (binary.needed_glibc(), asked) {
        (Some(needed), Some(asked)) if needed > asked => Err(PackError::NotALibrary {
            platform: target.platform.folder(),
            found: format!(
                "it needs glibc {}.{}, expected no newer one than {}.{}",
                needed.0, needed.1, asked.0, asked.1
            ),
        }),
        _ => Ok(()),
    }
}

fn check_tools(target: &Target) -> Result<(), PackError> {
    let missing = |what: &str, found: String, remedy: &str| PackError::MissingTool {
        what: what.into(),
        target: target.full(),
        found,
        remedy: remedy.into(),
    };
    zig::check().map_err(|it| missing(it.what, it.found, it.remedy))?;
    for triple in target.rust_targets() {
        let remedy = format!("rustup target add {triple}");
        let standard_library = || missing("Rust's standard library", triple.into(), &remedy);
        let folder = zig::answer("rustc", ["--print", "target-libdir", "--target", triple])
            .map_err(|found| missing("Rust's standard library", found, &remedy))?;
        if !Path::new(folder.trim()).is_dir() {
            return Err(standard_library());
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_and_long_names_are_read() {
        let target = Target::parse("linux64").unwrap();
        assert_eq!(target, Target::parse("x86_64-unknown-linux-gnu.2.17").unwrap());
        assert_eq!(target.full(), "x86_64-unknown-linux-gnu.2.17");
        assert_eq!(target.file_name("a"), "liba.so");
        let target = Target::parse("win64").unwrap();
        assert_eq!((target.platform(), target.file_name("a").as_str()), (Platform::Win64, "a.dll"));
        let target = Target::parse("darwin64").unwrap();
        assert_eq!(target.rust_targets().len(), 2);
        assert_eq!(target.file_name("a"), "liba.dylib");
    }

    #[test]
    fn unknown_targets_are_refused_with_what_is_known() {
        for text in [
            "",
            "linux",
            "wasm32-unknown-unknown",
            "x86_64-unknown-linux-gnu.",
            "x86_64-unknown-linux-gnu.new",
            "x86_64-pc-windows-gnu.2.17",
        ] {
            let error = Target::parse(text).unwrap_err().to_string();
            assert!(error.contains("darwin64"), "{text}: {error}");
        }
    }

    #[test]
    fn a_missing_target_names_the_remedy() {
        let target = Target::parse("riscv64gc-unknown-linux-gnu").unwrap();
        let Err(PackError::MissingTool { remedy, .. }) = check_tools(&target) else {
            return; // everything for that target is installed here
        };
        let remedies = ["cargo install", "pip install", "rustup target add"];
        assert!(remedies.iter().any(|start| remedy.starts_with(start)), "{remedy}");
    }
}
