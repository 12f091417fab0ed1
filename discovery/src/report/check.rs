//! What must hold before a report can be drawn.

use std::cmp::Ordering;

use super::data::{Report, Trial, Verdict};

/// Why a report cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// A channel is named that [`Report::channels`] does not list.
    #[error("{place} names the channel `{channel}`, which is not among the report's channels")]
    UnknownChannel {
        /// Where it is named.
        place: String,
        /// The name.
        channel: String,
    },
    /// Two vectors that belong together have different lengths.
    #[error("{place}: found {found} values, expected {expected}")]
    Length {
        /// Which vector.
        place: String,
        /// Its length.
        found: usize,
        /// The length it should have.
        expected: usize,
    },
    /// Times that do not increase.
    #[error("{place}: time does not increase after {time} s")]
    Time {
        /// Which vector.
        place: String,
        /// Last time in order, s.
        time: f64,
    },
    /// The verdict and the findings contradict each other.
    #[error("the verdict is `{verdict}`, {contradiction}")]
    Verdict {
        /// The verdict as in `discovery.json`.
        verdict: &'static str,
        /// What does not fit.
        contradiction: &'static str,
    },
    /// A stretch of time points to a trial that does not exist.
    #[error("{place} points to trial {trial}, but there are only {trials}")]
    UnknownTrial {
        /// Where the index stands.
        place: String,
        /// The index.
        trial: usize,
        /// Number of trials.
        trials: usize,
    },
    /// The page could not be put together.
    #[error("the report's page could not be put together")]
    Page(#[from] minijinja::Error),
    /// The data of the plots could not be written.
    #[error("the data of the report's plots could not be written")]
    Json(#[from] serde_json::Error),
}

/// Checks lengths, names and the verdict.
///
/// # Errors
/// The first thing that is wrong, by name.
pub fn check(report: &Report) -> Result<(), ReportError> {
    verdict(report)?;
    for gap in &report.gap.channels {
        known(report, &gap.channel, || "the gap per channel".to_owned())?;
    }
    for located in &report.located {
        for span in &located.when {
            if span.trial >= report.trials.len() {
                return Err(ReportError::UnknownTrial {
                    place: format!("`when` of {}", located.place),
                    trial: span.trial,
                    trials: report.trials.len(),
                });
            }
        }
    }
    length(|| "the robot's attachments".to_owned(), report.robot.attachments.len(), report.robot.anchors.len())?;
    report.trials.iter().try_for_each(|t| trial(report, t))
}

fn verdict(report: &Report) -> Result<(), ReportError> {
    let found = !report.effects.is_empty();
    let terms = !report.terms.is_empty();
    let (verdict, contradiction) = match report.verdict {
        Verdict::NoMissingEffect if found || terms => ("no_missing_effect", "but effects or terms are listed as found"),
        Verdict::Named if !found => ("named", "but no effect is listed"),
        Verdict::Named if terms => ("named", "but terms outside the catalogue are listed"),
        Verdict::PartlyNamed if !found => ("partly_named", "but no effect is listed"),
        Verdict::Ambiguous if !found => ("ambiguous", "but no effect is listed"),
        _ => return Ok(()),
    };
    Err(ReportError::Verdict { verdict, contradiction })
}

fn trial(report: &Report, trial: &Trial) -> Result<(), ReportError> {
    let name = &trial.name;
    increasing(|| format!("time of trial `{name}`"), &trial.time)?;
    for series in &trial.series {
        let channel = &series.channel;
        known(report, channel, || format!("trial `{name}`"))?;
        for (what, values) in [("measured", &series.measured), ("before", &series.before), ("after", &series.after)] {
            length(|| format!("`{what}` of channel `{channel}` in trial `{name}`"), values.len(), trial.time.len())?;
        }
    }
    let map = &trial.residuals;
    increasing(|| format!("residual blocks of trial `{name}`"), &map.edges)?;
    let blocks = map.edges.len().saturating_sub(1);
    for row in &map.rows {
        known(report, &row.channel, || format!("the residuals of trial `{name}`"))?;
        for values in [&row.before, &row.after] {
            length(|| format!("residuals of channel `{}` in trial `{name}`", row.channel), values.len(), blocks)?;
        }
    }
    Ok(())
}

fn known(report: &Report, channel: &str, place: impl Fn() -> String) -> Result<(), ReportError> {
    if report.channels.iter().any(|c| c.name == channel) {
        return Ok(());
    }
    Err(ReportError::UnknownChannel { place: place(), channel: channel.to_owned() })
}

fn length(place: impl Fn() -> String, found: usize, expected: usize) -> Result<(), ReportError> {
    if found == expected {
        return Ok(());
    }
    Err(ReportError::Length { place: place(), found, expected })
}

fn increasing(place: impl Fn() -> String, values: &[f64]) -> Result<(), ReportError> {
    match values.windows(2).find(|pair| pair[1].partial_cmp(&pair[0]) != Some(Ordering::Greater)) {
        None => Ok(()),
        Some(pair) => Err(ReportError::Time { place: place(), time: pair[0] }),
    }
}
