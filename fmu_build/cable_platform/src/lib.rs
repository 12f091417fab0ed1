//! The binary inside `CablePlatform.fmu`.
