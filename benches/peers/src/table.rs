//! Results as tables of a page.

use std::fmt::Write as _;

use crate::race::{Outcome, Outcomes};

/// The table of a case. Ratios are to the first, the default of the product.
pub(crate) fn of(Outcomes { title, outcomes, reference }: &Outcomes) -> String {
    let mut text = format!(
        "### {title}\n\n| method | tolerance | error (m) | ns a step | quartiles | ratio |\n| --- | --- | --- | --- | --- | --- |\n"
    );
    let first = outcomes.first().map_or(f64::NAN, |outcome| outcome.time[1]);
    for Outcome { name, tolerance, error, time, rounds } in outcomes {
        let _ = match error {
            Ok(error) => {
                let [low, median, high] = time.map(|time| 1e9 * time);
                let few = if *rounds < 5 { format!(" ({rounds} rounds)") } else { String::new() };
                let ratio = time[1] / first;
                writeln!(
                    text,
                    "| {name} | {tolerance:.0e} | {error:.1e} | {median:.0} | {low:.0} to {high:.0}{few} | {ratio:.2} |"
                )
            }
            Err(reason) => writeln!(text, "| {name} | {tolerance:.0e} | {reason} | | | |"),
        };
    }
    let _ = writeln!(text, "\n{reference}\n");
    text
}

/// Errors below this (m) are rounding, in lengths of 900 m, and none is better than another.
const ROUNDING: f64 = 5e-11;

/// What peers take, over what ours takes, at no larger an error: a table of all cases for the solver called `ours` at its default
/// tolerance.
pub(crate) fn beside(ours: &str, cases: &[Outcomes]) -> String {
    let mut peers: Vec<&str> = Vec::new();
    for outcome in cases.iter().flat_map(|case| &case.outcomes) {
        if !outcome.name.starts_with("cdpr") && !peers.contains(&outcome.name.as_str()) {
            peers.push(&outcome.name);
        }
    }
    let mut text =
        format!("### Beside `{ours}` at 1e-8: times the cost, at its error or less\n\n| | error (m) | ns a step |");
    peers.iter().for_each(|peer| text += &format!(" {peer} |"));
    text += "\n| --- | --- | --- |";
    peers.iter().for_each(|_| text += " --- |");
    text.push('\n');
    for Outcomes { title, outcomes, .. } in cases {
        let Some(own) = outcomes.iter().find(|outcome| outcome.name == ours && outcome.tolerance == 1e-8) else {
            continue;
        };
        let Ok(error) = own.error else { continue };
        let _ = write!(text, "| {title} | {error:.1e} | {:.0} |", 1e9 * own.time[1]);
        for peer in &peers {
            let good = |outcome: &&Outcome| {
                outcome.name == *peer && outcome.error.as_ref().is_ok_and(|found| *found <= error.max(ROUNDING))
            };
            let cheapest = outcomes.iter().filter(good).map(|outcome| outcome.time[1]).min_by(f64::total_cmp);
            match cheapest {
                Some(time) => {
                    let _ = write!(text, " {:.2} |", time / own.time[1]);
                }
                None => text += " never as good |",
            }
        }
        text.push('\n');
    }
    text.push('\n');
    text
}
