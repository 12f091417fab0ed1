#![doc = include_str!("../README.md")]

pub mod control;
mod model;
pub mod reference;
mod settings;
mod table;

pub use model::WinchController;
pub use settings::{Bounds, Settings};

fmi2_export::export!(WinchController);
