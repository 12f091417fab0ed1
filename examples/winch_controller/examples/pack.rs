//! Packs the controller as an FMU:
//!
//! ```text
//! cargo run --release -p winch-controller --example pack -- WinchController.fmu
//! ```

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use cdpr_fmu_build::cable_platform::THIRD_PARTY;
use cdpr_fmu_build::{Binary, Fmu, PackError, Platform};
use winch_controller::WinchController;

fn main() -> ExitCode {
    let mut arguments = std::env::args_os().skip(1);
    let (Some(path), None) = (arguments.next(), arguments.next()) else {
        eprintln!("expected one argument: the file to write, such as WinchController.fmu");
        return ExitCode::from(2);
    };
    match pack(Path::new(&path)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn pack(path: &Path) -> Result<(), PackError> {
    let platform = Platform::host().expect("FMI 2.0 has a folder for this machine");
    let no_resources: [(&str, &str); 0] = [];
    // The controller is built with some of the libraries of the plant, so the plant's notices cover it.
    Fmu::of::<WinchController>(no_resources)?
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
