//! One trial as the report plots it: thinned series, and residuals in blocks of time.

use crate::outcome::Compared;
use crate::report::{ResidualMap, ResidualRow, Series, Trial};

/// Most samples plotted of one trial.
const SAMPLES: usize = 1500;
/// Blocks of time in the residual picture, at most.
const BLOCKS: usize = 50;

/// The trial as plotted.
pub(super) fn trial(compared: &Compared) -> Trial {
    let trial = &compared.trial;
    let every = trial.len().div_ceil(SAMPLES).max(1);
    let picked: Vec<usize> = (0..trial.len()).step_by(every).collect();
    // Lines break at the first sample plotted from a restart on.
    let mut restarted = vec![false; picked.len()];
    for restart in &compared.restarts {
        if let Some(at) = picked.iter().position(|k| k >= restart) {
            restarted[at] = true;
        }
    }
    let predicted = |rows: &[Vec<f64>], j: usize| -> Vec<f64> {
        picked.iter().zip(&restarted).map(|(k, restart)| if *restart { f64::NAN } else { rows[*k][j] }).collect()
    };
    let series = trial
        .channels
        .iter()
        .enumerate()
        .map(|(j, channel)| Series {
            channel: channel.name(),
            measured: picked.iter().map(|k| trial.measured[*k][j]).collect(),
            before: predicted(&compared.before, j),
            after: predicted(&compared.after, j),
            expected: compared.expected[j],
        })
        .collect();
    Trial {
        name: trial.name.clone(),
        holdout: compared.holdout,
        time: picked.iter().map(|k| trial.time[*k]).collect(),
        series,
        residuals: residuals(compared),
    }
}

/// All samples count, not only those plotted.
fn residuals(compared: &Compared) -> ResidualMap {
    let trial = &compared.trial;
    let (start, end) = (trial.time[0], trial.time[trial.len() - 1]);
    // Ten samples a block where the trial is short.
    let blocks = BLOCKS.min(trial.len() / 10).max(1);
    let width = (end - start) / blocks as f64;
    let edges = (0..=blocks).map(|b| start + b as f64 * width).collect();
    let block_of = |time: f64| (((time - start) / width) as usize).min(blocks - 1);
    let mut fresh = vec![false; trial.len()];
    compared.restarts.iter().for_each(|k| fresh[*k] = true);
    let row_mean_square = |rows: &[Vec<f64>], j: usize| -> Vec<f64> {
        let mut sums = vec![(0.0, 0_usize); blocks];
        for k in (0..trial.len()).filter(|k| !fresh[*k]) {
            let e = (rows[k][j] - trial.measured[k][j]) / compared.expected[j];
            if e.is_finite() {
                let sum = &mut sums[block_of(trial.time[k])];
                *sum = (sum.0 + e * e, sum.1 + 1);
            }
        }
        sums.into_iter().map(|(sum, n)| if n > 0 { (sum / n as f64).sqrt() } else { f64::NAN }).collect()
    };
    let rows = trial
        .channels
        .iter()
        .enumerate()
        .map(|(j, channel)| ResidualRow {
            channel: channel.name(),
            before: row_mean_square(&compared.before, j),
            after: row_mean_square(&compared.after, j),
        })
        .collect();
    ResidualMap { edges, rows }
}
