//! The layer as a host sees it: every call goes through the exported C functions.

// A host calls C, and calling C is unsafe; the harness keeps it in one place.
#![allow(unsafe_code)]

mod harness;
mod lifecycle;
mod locations;
mod logging;
mod misuse;
mod saving;
mod states;
mod stepping;
mod threads;
mod values;
mod xml;

// In its own crate the example's items are public, and some of them are for its readers only.
#[allow(unreachable_pub, dead_code)]
#[path = "../../examples/oscillator.rs"]
mod oscillator;
