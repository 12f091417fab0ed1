//! Packs FMUs: a model, its binaries, resources, documentation and licences become one checked `.fmu` file.
//!
//! [`Fmu`] is general: any [`fmi2_export::Model`] can be packed with it. [`cable_platform`] is the FMU of this project's
//! plant, whose binary for the host is inside this library, so that a program that links it can pack an FMU without a
//! compiler. [`cross`] builds that binary for other platforms from a source checkout.
//!
//! What does not hold together is refused: a binary that lacks a function of FMI 2.0 or does not accept the
//! description's GUID, a description that breaks the standard's rules, an XML text that does not say the same.
//! The same input gives the same bytes, whatever the machine and the hour.

mod archive;
mod binary;
pub mod cable_platform;
pub mod cross;
mod documentation;
mod error;
mod fmu;
mod platform;
mod probe;
pub mod temporary;
pub mod unfinished;
pub mod whole_file;
mod xml_check;
mod zig;

pub use binary::{Binary, FUNCTIONS};
pub use error::PackError;
pub use fmu::Fmu;
pub use platform::Platform;
