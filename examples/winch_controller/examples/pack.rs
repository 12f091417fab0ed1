//! Packs the controller as an FMU:
//!
//! ```text
//! cargo run --release -p winch-controller --example pack -- WinchController.fmu
//! cargo run --release -p winch-controller --example pack -- --model model.toml WinchController.fmu
//! ```
//!
//! The second is for the robot of that model file, the one that the plant's FMU was packed with.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use cdpr_fmu_build::cable_platform::THIRD_PARTY;
use cdpr_fmu_build::{Binary, Fmu, PackError, Platform};
use winch_controller::WinchController;

fn main() -> ExitCode {
    let arguments: Vec<OsString> = std::env::args_os().skip(1).collect();
    let (model, path) = match &arguments[..] {
        [path] => (None, path),
        [flag, model, path] if flag == "--model" => (Some(model), path),
        _ => {
            eprintln!("expected `[--model MODEL.toml] FILE.fmu`: the file to write, such as WinchController.fmu");
            return ExitCode::from(2);
        }
    };
    let resources = match model.map(|model| std::fs::read(model).map_err(|error| (model, error))).transpose() {
        Ok(text) => text.map(|text| ("model.toml", text)),
        Err((model, error)) => {
            eprintln!("{}: {error}", model.display());
            return ExitCode::from(2);
        }
    };
    match pack(resources, Path::new(path)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn pack(resources: Option<(&str, Vec<u8>)>, path: &Path) -> Result<(), PackError> {
    let platform = Platform::host().expect("FMI 2.0 has a folder for this machine");
    // The controller is built with some of the libraries of the plant, so the plant's notices cover it.
    Fmu::of::<WinchController>(resources)?
        .section("What it is", include_str!("pack.html"))
        .licence("LICENSE-APACHE.txt", include_str!("../../../LICENSE-APACHE"))?
        .licence("LICENSE-MIT.txt", include_str!("../../../LICENSE-MIT"))?
        .licence("third-party.txt", THIRD_PARTY)?
        .binary(Binary::read(platform, &library(platform))?)?
        .write(path)
}

/// The shared library: cargo builds it beside this program, which links the same crate.
fn library(platform: Platform) -> PathBuf {
    let program = std::env::current_exe().expect("the system knows where this program is");
    let profile = program.ancestors().nth(2).expect("it is in target/PROFILE/examples");
    let prefix = if platform.extension() == "dll" { "" } else { "lib" };
    profile.join("deps").join(format!("{prefix}winch_controller.{}", platform.extension()))
}
