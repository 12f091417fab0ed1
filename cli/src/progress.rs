//! A progress bar for whoever waits longer than two seconds at a terminal.

use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

const PATIENCE: Duration = Duration::from_secs(2);
const PARTS: u64 = 1000;

/// Progress from 0 to 1, with the time so far: a search that turns back says nothing of the time to come. Nothing is drawn in
/// the first two seconds, nor where stderr is no terminal.
pub(crate) struct Progress {
    what: String,
    begun: Instant,
    bar: Option<ProgressBar>,
}

impl Progress {
    /// Begins to wait for `what`.
    pub(crate) fn new(what: &str) -> Self {
        Self { what: what.to_owned(), begun: Instant::now(), bar: None }
    }

    /// This share of the work is done.
    pub(crate) fn update(&mut self, share: f64) {
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
