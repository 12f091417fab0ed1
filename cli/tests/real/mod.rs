//! The real binary, run in a folder.
#![allow(dead_code, unreachable_pub, reason = "each test file uses some of it")]

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use tempfile::TempDir;

pub const HEADER: &str = "time,winch_force[1],winch_force[2],winch_force[3],winch_force[4]";

pub fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_cdpr"));
    command.args(arguments).current_dir(folder);
    command
}

pub fn cdpr(folder: &Path, arguments: &[&str]) -> Output {
    command(folder, arguments).output().unwrap()
}

/// What it says on standard output where it succeeds.
pub fn done(folder: &Path, arguments: &[&str]) -> String {
    let output = cdpr(folder, arguments);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

pub fn folder(files: &[(&str, &str)]) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files {
        fs::write(folder.path().join(name), text).unwrap();
    }
    folder
}

/// The command fails with this code, says all of `words`, and leaves nothing behind. What it said.
pub fn fails(files: &[(&str, &str)], arguments: &[&str], code: i32, words: &[&str]) -> String {
    let folder = folder(files);
    let output = cdpr(folder.path(), arguments);
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {said}");
    for word in words {
        assert!(said.contains(word), "{arguments:?}: {word:?} is not in {said:?}");
    }
    assert!(output.stdout.is_empty());
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), files.len(), "{arguments:?} left something behind");
    said
}
