//! What a step costs, beside other people's integrators. Run with `cargo xtask bench`.
//!
//! Every method integrates the same equations ([`cdpr::plant::Plant::rates`]) over the same communication steps, at which inputs may
//! change and from which it starts anew, as a co-simulation asks of it. Methods take turns in rounds, what counts is the processor
//! time of the thread, and medians with quartiles are told. Errors are against motions by another program (`make_references.py`), each
//! with its own error; ten effects, which that has not got, against our own method at 1e-13.

mod case;
// Shared with the crate's own bench and tests, which use more of them.
#[allow(dead_code)]
#[path = "../../step/circle.rs"]
mod circle;
mod explicit;
mod fmu;
mod growth;
mod ours;
mod plot;
mod race;
mod rates;
mod reference;
#[allow(dead_code)]
#[path = "../../../tests/integrator/scenarios.rs"]
mod scenarios;
mod scipy;
#[cfg(feature = "sundials")]
mod sundials;
mod table;

use std::path::PathBuf;
use std::{env, fs, process};

use case::Case;
use race::{Entrant, Race};

const USAGE: &str = "\
Usage: peers [--rounds N] [--out DIR] [CASE ...]

Times every case, or those named (S1-1, S1-10, S1-100, S3, S4, S5-10, S5-100, S6, S7, ten, fmu, growth). Tables go to the terminal; with
--out also into DIR/bench.md, and a work-precision plot into DIR/work-precision.svg.";

/// What was asked for.
struct Asked {
    rounds: usize,
    out: Option<PathBuf>,
    cases: Vec<String>,
}

fn asked() -> Result<Asked, String> {
    let mut asked = Asked { rounds: 15, out: None, cases: Vec::new() };
    let mut words = env::args().skip(1);
    while let Some(word) = words.next() {
        let mut value = || words.next().ok_or(format!("`{word}` without a value\n\n{USAGE}"));
        match word.as_str() {
            "--rounds" => {
                let text = value()?;
                let rounds = text.parse().ok().filter(|rounds| *rounds > 0);
                asked.rounds = rounds.ok_or(format!("--rounds {text}: expected a number from 1 on"))?;
            }
            "--out" => asked.out = Some(value()?.into()),
            option if option.starts_with('-') => return Err(format!("no option `{option}`\n\n{USAGE}")),
            case => asked.cases.push(case.to_owned()),
        }
    }
    Ok(asked)
}

/// All that take part in `case`.
fn entrants(case: &Case) -> Vec<Entrant<'_>> {
    let mut entrants = ours::entrants(case);
    #[cfg(feature = "sundials")]
    entrants.extend(sundials::entrants(case));
    entrants.extend(explicit::entrants(case));
    entrants
}

fn main() {
    let Asked { rounds, out, cases } = asked().unwrap_or_else(|error| {
        eprintln!("{error}");
        process::exit(2);
    });
    let wanted = |key: &str| cases.is_empty() || cases.iter().any(|case| case == key);
    let mut text = String::new();
    if cfg!(not(feature = "sundials")) {
        text += "SUNDIALS is left out: it was not built (`cargo xtask bench` says why).\n\n";
    }
    let mut results = Vec::new();
    for case in case::all().into_iter().filter(|case| wanted(case.key)) {
        eprintln!("{}", case.title);
        let result = Race::new(&case, entrants(&case)).run(rounds);
        text += &table::of(&result);
        if case.key == "S3" {
            text += &scipy::report(&case);
        }
        results.push(result);
    }
    if !results.is_empty() {
        let beside: String = ["cdpr radau", "cdpr auto"].iter().map(|ours| table::beside(ours, &results)).collect();
        text = beside + &text;
    }
    if wanted("fmu") {
        text += &fmu::report(rounds);
    }
    if wanted("growth") {
        text += &growth::report(rounds);
    }
    println!("{text}");
    if let Some(folder) = out {
        let write = || -> Result<(), String> {
            fs::create_dir_all(&folder).map_err(|error| error.to_string())?;
            fs::write(folder.join("bench.md"), &text).map_err(|error| error.to_string())?;
            plot::work_precision(&results, &folder.join("work-precision.svg"))
        };
        if let Err(error) = write() {
            eprintln!("{}: {error}", folder.display());
            process::exit(1);
        }
    }
}
