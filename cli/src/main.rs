//! The `cdpr` command: one file for each subcommand, and what they share.

mod analyse;
mod calibrate;
mod csv_io;
mod demo;
mod discover;
mod effects;
mod experiment;
mod failure;
mod fmu;
mod interrupt;
mod inverse;
mod model;
mod number;
mod output;
mod paper;
mod plot;
mod progress;
mod redundancy;
mod simulate;
mod table;
mod terminal;
mod trajectory_csv;
mod whole;

use std::process::ExitCode;

use anyhow::Context;
use clap::{Parser, Subcommand};

/// Dynamics of a planar cable-driven parallel robot: simulation, FMU, and the search for missing effects.
#[derive(Parser)]
#[command(
    name = "cdpr",
    version,
    arg_required_else_help = true,
    after_help = "Examples:\n  \
        cdpr demo                                  the whole story in one go\n  \
        cdpr fmu -o CablePlatform.fmu              an FMU of the default model\n  \
        cdpr model > model.toml                    the default model, to be changed\n  \
        cdpr simulate -o run.csv --plot run.svg    60 s of simulation, with a picture\n  \
        cdpr calibrate --data run.csv -o new.toml  the geometry that fits a recording\n  \
        cdpr discover --data run.csv --out found   the effect that the model is missing\n  \
        cdpr experiment --from found/discovery.json --limits limits.toml -o plan.csv\n  \
        \u{20}                                          the motion that tells apart what was ambiguous\n\n\
        Exit codes: 0 done, 1 the work failed, 2 wrong use or bad input."
)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Demo(demo::Arguments),
    Fmu(fmu::Arguments),
    Model(model::Arguments),
    Simulate(simulate::Arguments),
    Inverse(inverse::Arguments),
    #[command(visible_alias = "analyze")]
    Analyse(analyse::Arguments),
    Paper(paper::Arguments),
    Effects(effects::Arguments),
    Calibrate(calibrate::Arguments),
    Discover(discover::Arguments),
    Experiment(experiment::Arguments),
}

fn main() -> ExitCode {
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => return failure::usage(&error),
    };
    match run(arguments.command) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => failure::report(&error),
    }
}

fn run(command: Command) -> anyhow::Result<()> {
    interrupt::leave_nothing_behind().context("signals cannot be received")?;
    match command {
        Command::Demo(arguments) => demo::run(&arguments),
        Command::Fmu(arguments) => fmu::run(&arguments),
        Command::Model(arguments) => model::run(&arguments),
        Command::Simulate(arguments) => simulate::run(&arguments),
        Command::Inverse(arguments) => inverse::run(&arguments),
        Command::Analyse(arguments) => analyse::run(&arguments),
        Command::Paper(arguments) => paper::run(&arguments),
        Command::Effects(arguments) => effects::run(&arguments),
        Command::Calibrate(arguments) => calibrate::run(&arguments),
        Command::Discover(arguments) => discover::run(&arguments),
        Command::Experiment(arguments) => experiment::run(&arguments),
    }
}
