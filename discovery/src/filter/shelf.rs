//! Linear models along the trajectories of fits: kept while there is room for them, and made again where they are asked for
//! later. Of the many fits that a search knows few are worked with at a time.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};

use crate::filter::path::LinearTrial;

/// Room for linear models (bytes), beside those that are being worked with: those of three fits to an hour at 100 Hz.
const ROOM: usize = 1_500_000_000;

/// The models of a fit, one a trial.
type Models = Arc<Vec<LinearTrial>>;

/// All that are kept in this process.
static SHELF: Mutex<Shelf> = Mutex::new(Shelf { room: ROOM, kept: Vec::new() });

/// The linear models of one fit, shared by its clones.
#[derive(Clone)]
pub(crate) enum Linear {
    /// Models that can be made again.
    Kept(Arc<Slot>),
    /// Models that cannot.
    Given(Models),
}

#[derive(Default)]
pub(crate) struct Slot(Mutex<Option<Models>>);

/// Models that are kept, with their bytes, the one used last at the end.
struct Shelf {
    room: usize,
    kept: Vec<(Weak<Slot>, usize)>,
}

impl Linear {
    /// Keeps models that can be made again.
    pub(crate) fn kept(models: Vec<LinearTrial>) -> Self {
        let (slot, models) = (Arc::new(Slot::default()), Arc::new(models));
        keep(&SHELF, &slot, &models);
        Self::Kept(slot)
    }

    /// The models, made `again` where they were not kept.
    pub(crate) fn models(&self, again: impl FnOnce() -> Vec<LinearTrial>) -> Models {
        match self {
            Self::Given(models) => Arc::clone(models),
            Self::Kept(slot) => taken(&SHELF, slot, again),
        }
    }
}

/// The models in a slot, made `again` where there are none. While they are made no lock is held: the thread may get other work
/// to do in between, which may ask for the same.
fn taken(shelf: &Mutex<Shelf>, slot: &Arc<Slot>, again: impl FnOnce() -> Vec<LinearTrial>) -> Models {
    let known = locked(&slot.0).clone();
    let models = known.unwrap_or_else(|| Arc::new(again()));
    keep(shelf, slot, &models);
    models
}

/// Puts models into their slot, as those used last; others go where there is no room for all.
fn keep(shelf: &Mutex<Shelf>, slot: &Arc<Slot>, models: &Models) {
    let mut shelf = locked(shelf);
    *locked(&slot.0) = Some(Arc::clone(models));
    shelf.kept.retain(|(kept, _)| kept.strong_count() > 0 && !std::ptr::eq(kept.as_ptr(), Arc::as_ptr(slot)));
    shelf.kept.push((Arc::downgrade(slot), models.iter().map(LinearTrial::bytes).sum()));
    let mut left = shelf.room;
    let fits = |(_, bytes): &&(Weak<Slot>, usize)| {
        left = left.saturating_sub(*bytes);
        left > 0
    };
    // The one used last stays whatever it takes.
    let staying = shelf.kept.iter().rev().take_while(fits).count().max(1);
    let leaving = shelf.kept.len() - staying;
    for (slot, _) in shelf.kept.drain(..leaving) {
        if let Some(slot) = slot.upgrade() {
            *locked(&slot.0) = None;
        }
    }
}

/// What a thread that panicked was holding is whole.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::recording::{fitted, record};

    #[test]
    fn what_was_not_used_for_long_leaves_and_is_made_again() {
        let trials = [record(&[], 5.0, 1)];
        let fit = fitted(&[], &trials);
        let made = || fit.linear(&trials).to_vec();
        let bytes: usize = made().iter().map(LinearTrial::bytes).sum();
        // There is room for two.
        let shelf = Mutex::new(Shelf { room: 5 * bytes / 2, kept: Vec::new() });
        let slots = [0, 1, 2].map(|_| Arc::new(Slot::default()));
        let ask = |at: usize| {
            let mut again = false;
            taken(&shelf, &slots[at], || {
                again = true;
                made()
            });
            again
        };
        assert_eq!([0, 1, 0, 1].map(ask), [true, true, false, false]);
        assert_eq!([2, 1, 0, 0, 2].map(ask), [true, false, true, false, true], "the one used least lately goes");
    }
}
