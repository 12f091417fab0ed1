//! A progress bar for whoever waits longer than two seconds at a terminal, and a line now and then for whoever reads a log.

use std::io::{IsTerminal, stderr};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

use crate::terminal::tell;

const PATIENCE: Duration = Duration::from_secs(2);
const PARTS: u64 = 1000;
/// Time from one line to the next where stderr is no terminal.
const A_LINE_EACH: Duration = Duration::from_secs(30);

/// Progress from 0 to 1, with the time so far: a search that turns back says nothing of the time to come. Nothing is drawn in
/// the first two seconds; where stderr is no terminal a line is written at the first step after each half a minute.
pub(crate) struct Progress {
    what: String,
    begun: Instant,
    bar: Option<ProgressBar>,
    lines: Option<Lines>,
}

/// What stands in a log.
#[derive(Default)]
struct Lines {
    /// When the last one was written, from the beginning on.
    last: Duration,
    /// The largest share of the work that was done.
    most: f64,
}

impl Lines {
    /// What is to be written, if anything, so long after the beginning.
    fn line(&mut self, what: &str, share: f64, elapsed: Duration) -> Option<String> {
        self.most = self.most.max(share);
        if elapsed < self.last + A_LINE_EACH {
            return None;
        }
        self.last = elapsed;
        Some(format!("{what}: {:.0} %, {} s so far", 100.0 * self.most, elapsed.as_secs()))
    }
}

impl Progress {
    /// Begins to wait for `what`.
    pub(crate) fn new(what: &str) -> Self {
        let lines = (!stderr().is_terminal()).then(Lines::default);
        Self { what: what.to_owned(), begun: Instant::now(), bar: None, lines }
    }

    /// This share of the work is done.
    pub(crate) fn update(&mut self, share: f64) {
        if let Some(lines) = &mut self.lines {
            if let Some(line) = lines.line(&self.what, share, self.begun.elapsed()) {
                tell(&line);
            }
            return;
        }
        if self.bar.is_none() && self.begun.elapsed() > PATIENCE {
            let style = ProgressStyle::with_template("{msg} [{bar:40}] {percent} %, {elapsed} so far");
            let bar = ProgressBar::new(PARTS).with_message(self.what.clone()).with_elapsed(self.begun.elapsed());
            self.bar = Some(match style {
                Ok(style) => bar.with_style(style.progress_chars("=> ")),
                Err(_) => bar,
            });
        }
        if let Some(bar) = &self.bar {
            // A search may turn back; what is done stays done.
            bar.set_position(bar.position().max((share * PARTS as f64) as u64));
        }
    }

    /// This share of the work is done, and what comes next is this.
    pub(crate) fn tell(&mut self, what: &str, share: f64) {
        if self.what != what {
            what.clone_into(&mut self.what);
            if let Some(bar) = &self.bar {
                bar.set_message(self.what.clone());
            }
        }
        self.update(share);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A search turns back; what is done stays done.
    #[test]
    fn a_log_has_a_line_each_half_a_minute() {
        let mut lines = Lines::default();
        let mut at = |seconds: u64, share: f64| lines.line("weighing", share, Duration::from_secs(seconds));
        assert_eq!([at(1, 0.1), at(29, 0.42)], [None, None]);
        assert_eq!(at(31, 0.2).as_deref(), Some("weighing: 42 %, 31 s so far"));
        assert_eq!(at(60, 0.5), None);
        assert_eq!(at(200, 0.5).as_deref(), Some("weighing: 50 %, 200 s so far"));
    }
}
