#![doc = include_str!("../README.md")]

pub mod control;
mod model;
pub mod reference;
mod settings;
mod table;
pub mod tension;

pub use model::WinchController;
pub use settings::Settings;

fmi2_export::export!(WinchController);
