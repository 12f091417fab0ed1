//! `gap.csv`: the numbers behind the report's plots.

use std::fmt::Write as _;

use crate::outcome::Discovery;

/// The table's columns. `trial` is the trial's name and `time` in s; `measured`, `before` and `after` are in the
/// channel's unit. `restart` is 1 where the simulations restart from the state estimated by then, 0 elsewhere; the two
/// simulations then show that state. Empty cells: gaps in the measurements, no simulation before the first restart.
pub const COLUMNS: [&str; 7] = ["trial", "time", "channel", "restart", "measured", "before", "after"];

/// The text of `gap.csv`, every sample of every trial, channel by channel.
#[must_use]
pub fn gap_csv(discovery: &Discovery) -> String {
    let mut text = COLUMNS.join(",");
    text.push('\n');
    for compared in &discovery.trials {
        let trial = &compared.trial;
        let name = quoted(&trial.name);
        let mut restart = vec![0; trial.len()];
        compared.restarts.iter().for_each(|k| restart[*k] = 1);
        for (j, channel) in trial.channels.iter().enumerate() {
            let channel = channel.name();
            for k in 0..trial.len() {
                let _ = write!(text, "{name},{},{channel},{}", trial.time[k], restart[k]);
                for value in [trial.measured[k][j], compared.before[k][j], compared.after[k][j]] {
                    text.push(',');
                    if value.is_finite() {
                        let _ = write!(text, "{}", short(value));
                    }
                }
                text.push('\n');
            }
        }
    }
    text
}

/// To 10 significant digits: far below any noise, and half the length.
fn short(value: f64) -> f64 {
    format!("{value:.9e}").parse().unwrap_or(value)
}

fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}
