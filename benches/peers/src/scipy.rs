//! scipy on the tests' plant in Python, in a process of its own.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::Write as _;
use std::process::{Command, Stdio};

use cdpr::integrator::Solver;

use crate::case::Case;
use crate::race::quartiles;

/// Steps that it takes: it is slow.
const STEPS: usize = 50;

/// A table of the closed loop's first steps, or why there is none. `python` has scipy, and the folder of tests on its path.
pub(crate) fn report(case: &Case) -> String {
    let Some(python) = std::env::var_os("CDPR_PYTHON") else {
        return "scipy is left out: CDPR_PYTHON names no Python that has it.\n\n".to_owned();
    };
    match table(case, &mut Command::new(python)) {
        Ok(text) => text,
        Err(error) => format!("scipy is left out: {error}.\n\n"),
    }
}

fn table(case: &Case, python: &mut Command) -> Result<String, String> {
    let mut simulation = case.simulation(Solver::Radau, 1e-13);
    let mut inputting = case.inputting();
    let words = |values: &[f64]| values.iter().map(|value| format!("{value:e}")).collect::<Vec<_>>().join(" ") + "\n";
    let mut input = words(&simulation.states()[..3]);
    for k in 0..STEPS {
        let inputs = inputting.at(k, simulation.states());
        input += &words(&inputs.winch_force);
        simulation.set_inputs(inputs);
        simulation.advance(case.step).map_err(|error| error.to_string())?;
    }
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/scipy_peer.py");
    let said = |error: std::io::Error| error.to_string();
    let mut child = python.arg(script).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().map_err(said)?;
    child.stdin.take().expect("piped").write_all(input.as_bytes()).map_err(said)?;
    let output = child.wait_with_output().map_err(said)?;
    if !output.status.success() {
        return Err(format!("{script} ended with {}", output.status));
    }
    let mut times = BTreeMap::<String, (Vec<f64>, f64)>::new();
    for line in String::from_utf8_lossy(&output.stdout).lines() {
        let mut words = line.split_whitespace();
        let name = words.by_ref().take(2).collect::<Vec<_>>().join(" | ");
        let numbers: Vec<f64> = words.filter_map(|word| word.parse().ok()).collect();
        let [took, x, y, phi] = numbers[..] else { return Err(format!("it wrote `{line}`")) };
        let arm = case.plant().parameters().attachment_radius;
        let exact = simulation.states();
        let error = (x - exact[0]).abs().max((y - exact[1]).abs()).max(arm * (phi - exact[2]).abs());
        let entry = times.entry(name).or_default();
        entry.0.push(took);
        entry.1 = error;
    }
    let mut text = format!(
        "### scipy, the equations in Python: the first {STEPS} steps of S3\n\n| method | tolerance | error of the end pose (m) | µs a step |\n| --- | --- | --- | --- |\n"
    );
    for (name, (times, error)) in times {
        let _ = writeln!(text, "| {name} | {error:.1e} | {:.0} |", 1e6 * quartiles(times)[1]);
    }
    text.push('\n');
    Ok(text)
}
