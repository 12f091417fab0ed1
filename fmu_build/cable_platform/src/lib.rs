//! The binary inside `CablePlatform.fmu`: the plant behind the C functions of FMI 2.0.

fmi2_export::export!(cdpr::fmi2::CablePlatform);
