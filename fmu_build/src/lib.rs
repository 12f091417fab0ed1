//! Packs and checks FMUs.
