//! Builds the FMU's binary, so that this library can hold it.
//!
//! Cargo has no stable way to say "this library needs that shared library's file", so this script calls it a
//! second time: same toolchain, lock file and flags, another profile and a target folder of its own (in the
//! outer one's, each would wait for the other's lock). The folder lies inside the outer one, so that debug and
//! release builds, clippy and rustdoc share what was compiled there.
//!
//! Where cargo-zigbuild and zig are there, a Linux binary is linked for glibc 2.17, so that it loads on every system of
//! the last decade. With the host's own linker it asks for the newest version that the host has of each function: from
//! glibc 2.36 that is `hypot` of 2.35, `pthread_key_create` of 2.34, `stat64` of 2.33, `exp`, `log` and `pow` of 2.29.
//! All of them are also there under older versions, but which one is taken is the linker's choice, for the standard
//! library's calls as well; zig brings the old lists of versions along.

use std::collections::BTreeMap;
use std::env;
use std::ffi::OsString;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use serde_json::Value;

#[path = "src/zig.rs"]
mod zig;

/// The glibc to link for: what the oldest Linux systems in use have (RHEL 7), and what Rust itself needs.
const OLDEST_GLIBC: &str = "2.17";
const PACKAGE: &str = "cable-platform-fmu";
/// `PACKAGE` as the crate's name.
const CRATE: &str = "cable_platform_fmu";

fn main() {
    let here = PathBuf::from(variable("CARGO_MANIFEST_DIR"));
    let root = here.parent().expect("fmu_build lies in the workspace");
    for input in [
        "Cargo.lock",
        "Cargo.toml",
        "fmi2/Cargo.toml",
        "fmi2/README.md",
        "fmi2/src",
        "fmu_build/build.rs",
        "fmu_build/cable_platform",
        "fmu_build/src/zig.rs",
        "src",
    ] {
        println!("cargo::rerun-if-changed={}", root.join(input).display());
    }
    let out = PathBuf::from(variable("OUT_DIR"));
    let target = variable("TARGET").into_string().expect("a triple is plain text");
    // OUT_DIR is <target folder>/<profile>/build/<package>/out.
    let shared = out.ancestors().nth(4).unwrap_or(&out).join("cable-platform");
    let artifacts = built(root, &shared, &target);

    let library = artifacts
        .iter()
        .filter(|artifact| artifact["target"]["name"] == CRATE)
        .flat_map(files)
        .find(|file| file.extension().is_some_and(|end| end == "so" || end == "dll" || end == "dylib"))
        .unwrap_or_else(|| panic!("the build of {PACKAGE} made no shared library"));
    copy(&library, &out.join("cable_platform.library"));
    write(&out.join("third-party.txt"), &third_party(&artifacts, &target));
}

/// What was compiled: for an old glibc where that is possible, else with the host's linker.
fn built(root: &Path, folder: &Path, target: &str) -> Vec<Value> {
    println!("cargo::rerun-if-env-changed=CARGO_ZIGBUILD_ZIG_PATH");
    // Tests want to know what the binary was linked for.
    let host = || {
        println!("cargo::rustc-env=CDPR_FMU_GLIBC=");
        build(root, folder, "build", target).unwrap_or_else(|| panic!("the build of {PACKAGE} failed; see above"))
    };
    if !target.ends_with("-linux-gnu") {
        return host();
    }
    if let Err(zig::Missing { what, found, remedy }) = zig::check() {
        // Shown by `cargo build -vv`.
        eprintln!("linked for this host's glibc, not for {OLDEST_GLIBC}: {what} is missing ({found}); {remedy}");
        return host();
    }
    // A folder of its own: what is linked otherwise is compiled otherwise.
    let full = format!("{target}.{OLDEST_GLIBC}");
    match build(root, &folder.join("zig"), "zigbuild", &full) {
        Some(artifacts) => {
            println!("cargo::rustc-env=CDPR_FMU_GLIBC={OLDEST_GLIBC}");
            artifacts
        }
        None => {
            println!(
                "cargo::warning=cargo-zigbuild could not link the FMU's binary for glibc {OLDEST_GLIBC}; with the host's \
                 linker it will need a newer one"
            );
            host()
        }
    }
}

/// Calls cargo; what it compiled, as its `compiler-artifact` messages. `None` where it failed.
fn build(root: &Path, folder: &Path, command: &str, target: &str) -> Option<Vec<Value>> {
    let mut cargo = Command::new(variable("CARGO"));
    cargo
        .args([command, "--locked", "--package", PACKAGE, "--profile", "fmu"])
        .args(["--message-format", "json-render-diagnostics", "--target", target])
        .arg("--target-dir")
        .arg(folder)
        .current_dir(root)
        .stderr(Stdio::inherit());
    // What cargo tells this script is not meant for the scripts of the nested build.
    for (name, _) in env::vars_os() {
        let own = ["CARGO_CFG_", "CARGO_FEATURE_", "CARGO_MANIFEST_", "CARGO_PKG_", "DEP_"];
        if name.to_str().is_some_and(|name| own.iter().any(|start| name.starts_with(start))) {
            cargo.env_remove(name);
        }
    }
    // Clippy checks through this wrapper; it would compile nothing.
    cargo.env_remove("RUSTC_WORKSPACE_WRAPPER");
    // An intermediate folder shared with the outer build would be the lock to wait for.
    cargo.env("CARGO_BUILD_BUILD_DIR", folder);
    cargo.env("CARGO_ENCODED_RUSTFLAGS", flags(root));
    let output = cargo.output().expect("cargo is there: it runs this script");
    output.status.success().then(|| {
        String::from_utf8(output.stdout)
            .expect("cargo's messages are UTF-8")
            .lines()
            .filter_map(|line| serde_json::from_str(line).ok())
            .filter(|message: &Value| message["reason"] == "compiler-artifact")
            .collect()
    })
}

/// The outer build's flags, and no folder of this machine in the binary's messages.
fn flags(root: &Path) -> OsString {
    let mut flags = env::var_os("CARGO_ENCODED_RUSTFLAGS").unwrap_or_default();
    let home = env::var_os("CARGO_HOME").map(PathBuf::from).or_else(|| {
        let user = env::var_os("HOME").or_else(|| env::var_os("USERPROFILE"))?;
        Some(PathBuf::from(user).join(".cargo"))
    });
    for (folder, name) in [(Some(root), "cdpr"), (home.as_deref(), "cargo")] {
        let Some(folder) = folder else { continue };
        if !flags.is_empty() {
            flags.push("\x1f");
        }
        flags.push("--remap-path-prefix=");
        flags.push(folder);
        flags.push(format!("={name}"));
    }
    flags
}

/// The licence texts of all crates in the binary, each text once.
fn third_party(artifacts: &[Value], target: &str) -> String {
    let mut crates = BTreeMap::new();
    for artifact in artifacts {
        // What is compiled for the build only (macros, their helpers) lies outside the target's folder.
        let linked = files(artifact).any(|file| file.iter().any(|part| part == target));
        let manifest = artifact["manifest_path"].as_str().map(PathBuf::from);
        if let (true, Some(manifest)) = (linked, manifest)
            && let Some(registered) = Crate::read(&manifest)
        {
            crates.insert(registered.title.clone(), registered);
        }
    }
    let mut texts = BTreeMap::<String, Vec<&str>>::new();
    for one in crates.values() {
        for text in &one.texts {
            texts.entry(text.clone()).or_default().push(&one.title);
        }
    }
    let mut page = String::from(
        "The binary in this FMU contains the Rust standard library (MIT OR Apache-2.0, the Rust project's\n\
         contributors) and the following libraries.\n\n",
    );
    for one in crates.values() {
        let _ = writeln!(page, "{}: {}, {}", one.title, one.licence, one.repository);
    }
    for (text, users) in texts {
        let _ = write!(page, "\n{:=<100}\n{}\n\n{}\n", "", users.join(", "), text.trim_end());
    }
    page
}

/// A library from a registry.
struct Crate {
    title: String,
    licence: String,
    repository: String,
    texts: Vec<String>,
}

impl Crate {
    /// `None` for this project's own crates: their licence goes into the FMU by itself.
    fn read(manifest: &Path) -> Option<Self> {
        let folder = manifest.parent()?;
        let registered = folder.components().any(|part| part.as_os_str() == "registry");
        if !registered && !folder.join(".cargo-checksum.json").exists() {
            return None;
        }
        let manifest: toml::Table = fs::read_to_string(manifest).ok()?.parse().ok()?;
        let field = |name: &str| manifest["package"].get(name)?.as_str().map(str::to_owned);
        let mut files: Vec<PathBuf> = fs::read_dir(folder)
            .ok()?
            .filter_map(|entry| Some(entry.ok()?.path()))
            .filter(|path| is_licence(path))
            .collect();
        files.sort();
        Some(Self {
            title: format!("{} {}", field("name")?, field("version")?),
            licence: field("license").unwrap_or_else(|| "see its licence file".into()),
            repository: field("repository").unwrap_or_default(),
            texts: files.iter().filter_map(|file| fs::read_to_string(file).ok()).collect(),
        })
    }
}

fn is_licence(path: &Path) -> bool {
    let name = path.file_name().map(|name| name.to_string_lossy().to_uppercase());
    path.is_file()
        && name.is_some_and(|name| {
            ["LICENSE", "LICENCE", "COPYING", "COPYRIGHT", "NOTICE", "UNLICENSE"]
                .iter()
                .any(|start| name.starts_with(start))
        })
}

fn files(artifact: &Value) -> impl Iterator<Item = PathBuf> {
    artifact["filenames"].as_array().into_iter().flatten().filter_map(|name| name.as_str().map(PathBuf::from))
}

fn variable(name: &str) -> OsString {
    env::var_os(name).unwrap_or_else(|| panic!("cargo sets {name} for build scripts"))
}

fn copy(from: &Path, to: &Path) {
    fs::copy(from, to).unwrap_or_else(|error| panic!("{} to {}: {error}", from.display(), to.display()));
}

fn write(path: &Path, text: &str) {
    fs::write(path, text).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
}
