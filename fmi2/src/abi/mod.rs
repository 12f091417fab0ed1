//! The C border: everything that [`export!`](crate::export) needs, and the only place with `unsafe`.
//!
//! The functions here are generic over the model and are not meant to be called from Rust; `export!`
//! gives each of them its C name in the crate that becomes the binary.

#![allow(unsafe_code)]

mod arguments;
mod functions;
mod handles;
mod host;
mod instantiate;
mod macros;

pub use functions::*;
pub use handles::Live;
pub use host::{CallbackFunctions, CallbackLogger};
pub use instantiate::{free_instance, instantiate};

use std::ffi::{c_char, c_int, c_uint, c_void};

/// `fmi2Component`: a handle, never dereferenced.
pub type Component = *mut c_void;
/// `fmi2ComponentEnvironment`.
pub type ComponentEnvironment = *mut c_void;
/// `fmi2FMUstate`: a handle, never dereferenced.
pub type FmuState = *mut c_void;
/// `fmi2ValueReference`.
pub type ValueReference = c_uint;
/// `fmi2Real`.
pub type Real = f64;
/// `fmi2Integer`.
pub type Integer = c_int;
/// `fmi2Boolean`: 0 or 1.
pub type Boolean = c_int;
/// `fmi2String`.
pub type String = *const c_char;
/// `fmi2Byte`.
pub type Byte = c_char;
/// The C enumerations (`fmi2Status`, `fmi2Type`, `fmi2StatusKind`) as what crosses the border, so that
/// a value that is none of theirs can be refused.
pub type Enumeration = c_int;
