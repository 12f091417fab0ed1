//! The time that a search has, and what it has found when that is over.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use crate::filter::error::FitError;
use crate::strategy::standing::Standing;

/// When a search began and when it is to end.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hours {
    pub(crate) begun: Instant,
    /// None where it may take as long as it takes.
    pub(crate) ends: Option<Instant>,
}

impl Hours {
    /// From now on, for so long; without an end where there is none, or none that a clock shows.
    pub(crate) fn from_now(limit: Option<Duration>) -> Self {
        let begun = Instant::now();
        Self { begun, ends: limit.and_then(|limit| begun.checked_add(limit)) }
    }
}

/// The limit of a search's time. Once it is over no model is fitted any more: steps that wanted to end with an error, and what
/// stood last is what was found.
#[derive(Default)]
pub(crate) struct TimeLimit {
    ends: Option<Instant>,
    /// Whether something was left undone because of it.
    cut: AtomicBool,
    stood: Mutex<Option<Standing>>,
}

impl TimeLimit {
    pub(crate) fn new(hours: Hours) -> Self {
        Self { ends: hours.ends, ..Self::default() }
    }

    pub(crate) fn is_over(&self) -> bool {
        self.ends.is_some_and(|ends| Instant::now() >= ends)
    }

    /// An error once the time is over. To be asked before what takes long.
    pub(crate) fn check(&self) -> Result<(), FitError> {
        if self.is_over() {
            self.leave_undone();
            return Err(FitError::OutOfTime);
        }
        Ok(())
    }

    /// That something is left undone because the time is over.
    pub(crate) fn leave_undone(&self) {
        self.cut.store(true, Ordering::Relaxed);
    }

    /// Whether something was left undone because the time was over.
    pub(crate) fn has_cut(&self) -> bool {
        self.cut.load(Ordering::Relaxed)
    }

    /// Keeps what stands, in case the time ends within a step. Of a search that has no end nothing is kept.
    pub(crate) fn keep(&self, standing: &Standing) {
        if self.ends.is_some() {
            *self.stood.lock().unwrap_or_else(PoisonError::into_inner) = Some(standing.clone());
        }
    }

    /// What came of a search, or what stood last where its time was over.
    pub(crate) fn or_what_stood(&self, search: Result<Standing, FitError>) -> Result<Standing, FitError> {
        let stood = self.stood.lock().unwrap_or_else(PoisonError::into_inner).take();
        match (search, stood) {
            (Err(FitError::OutOfTime), Some(stood)) => Ok(stood),
            (search, _) => search,
        }
    }

    /// Has no end any more: what a search found is concluded in full.
    pub(crate) fn lift(&mut self) {
        self.ends = None;
    }
}

#[cfg(test)]
mod tests {
    use cdpr::model_file::Model;

    use super::*;
    use crate::strategy::fixture::{begun, effect, evidence, names, with};
    use crate::strategy::search::search;

    #[test]
    fn there_is_no_end_without_a_limit_and_with_one_that_no_clock_shows() {
        for limit in [None, Some(Duration::MAX)] {
            let limit = TimeLimit::new(Hours::from_now(limit));
            assert!(limit.check().is_ok() && !limit.is_over() && !limit.has_cut());
        }
    }

    #[test]
    fn once_the_time_is_over_nothing_is_fitted_until_it_is_lifted() {
        let evidence = evidence(&[], 61);
        let (mut context, standing) = begun(&evidence, &Model::default());
        context.time = TimeLimit::new(Hours::from_now(Some(Duration::ZERO)));
        let model = &standing.fit.train.model;
        assert!(matches!(context.fit(model, &standing.fit), Err(FitError::OutOfTime)));
        assert!(context.time.has_cut());
        context.time.lift();
        assert!(context.fit(model, &standing.fit).is_ok());
    }

    /// A search whose time is over at once gives what it began with, laws among it, and neither an error nor more.
    #[test]
    fn what_stood_last_is_what_was_found() {
        let drag = effect("platform_linear_drag", None, &[60.0]);
        let evidence = evidence(&[drag.clone(), effect("winch_force_gain", Some(1), &[0.02])], 62);
        let (mut context, standing) = begun(&evidence, &Model::default());
        let standing = with(&context, standing, vec![(drag, Vec::new())]);
        context.time = TimeLimit::new(Hours::from_now(Some(Duration::ZERO)));
        let (found, score) = (names(&context, &standing), standing.fit.score);
        let ended = search(&context, standing).expect("what stood");
        assert_eq!((names(&context, &ended), ended.fit.score), (found, score));
        assert!(context.time.has_cut());
    }
}
