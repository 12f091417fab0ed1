//! Handles of live instances.
//!
//! A host holds a handle, not a pointer: a number that was never used before, in which stands where to look.
//! So a freed, foreign or made-up `fmi2Component` is found out instead of being followed.

use std::ffi::c_void;
use std::ptr;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::Component;
use super::host::Host;
use crate::instance::Instance;
use crate::model::Model;

/// An instance with its way back to the host.
pub(super) struct Held<M> {
    pub(super) host: Arc<Host>,
    pub(super) instance: Instance<M>,
}

/// Where an instance lives, and after it others: a place is never given back, so that looking one up needs no lock
/// or count that instances share.
struct Place<M> {
    /// How many instances have lived here, with the present one.
    uses: usize,
    held: Option<Box<Held<M>>>,
}

/// On a cache line of its own (two, as processors fetch them), for hosts that step instances in parallel.
#[repr(align(128))]
struct Locked<M>(Mutex<Place<M>>);

impl<M> Locked<M> {
    /// For this thread alone. Panics of the model are caught while the lock is held, so a poisoned lock says nothing
    /// about the instance.
    fn lock(&self) -> MutexGuard<'_, Place<M>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The live instances of a binary, which [`export!`](crate::export) keeps.
pub struct Live<M> {
    places: boxcar::Vec<Locked<M>>,
    /// Places whose instance is gone.
    free: Mutex<Vec<usize>>,
}

/// Numbers of places in a handle; above them stands which use of the place it is.
const PLACES: usize = 1 << 20;
/// In place of a place: the handle is one of a saved state.
const STATE: usize = PLACES - 1;
/// Between handles, so that they look like pointers to something.
const APART: usize = 16;
/// Of one place, until its handles would begin anew.
const MOST_USES: usize = usize::MAX / (PLACES * APART);

static STATES: AtomicUsize = AtomicUsize::new(0);

/// The `uses`-th handle of a place: from the address of something in this binary, so that two FMUs in one process do
/// not count alike.
fn handle(place: usize, uses: usize) -> usize {
    let number = uses.wrapping_mul(PLACES).wrapping_add(place);
    ptr::from_ref(&STATES).addr().wrapping_add(number.wrapping_mul(APART))
}

/// The place and which use of it a handle means, or what would have been its handle's.
fn parts(handle: usize) -> Option<(usize, usize)> {
    let offset = handle.wrapping_sub(ptr::from_ref(&STATES).addr());
    let number = offset / APART;
    offset.is_multiple_of(APART).then_some((number % PLACES, number / PLACES))
}

/// A handle for a saved state: no instance's, and not handed out before.
pub(super) fn new_state() -> usize {
    handle(STATE, STATES.fetch_add(1, Ordering::Relaxed))
}

pub(super) fn as_pointer(handle: usize) -> *mut c_void {
    ptr::without_provenance_mut(handle)
}

impl<M: Model> Live<M> {
    /// None yet.
    #[must_use]
    pub const fn new() -> Self {
        Self { places: boxcar::Vec::new(), free: Mutex::new(Vec::new()) }
    }

    fn free(&self) -> MutexGuard<'_, Vec<usize>> {
        self.free.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Null where there is no place left.
    pub(super) fn insert(&self, held: Held<M>) -> Component {
        let kept = self.free().pop();
        let place = kept.unwrap_or_else(|| self.places.push(Locked(Mutex::new(Place { uses: 0, held: None }))));
        if place >= STATE {
            return ptr::null_mut();
        }
        let mut here = self.places[place].lock();
        here.uses += 1;
        here.held = Some(Box::new(held));
        as_pointer(handle(place, here.uses))
    }

    /// Work on the live instance behind a handle, for this thread alone.
    pub(super) fn with<T>(&self, component: Component, work: impl FnOnce(&mut Held<M>) -> T) -> Option<T> {
        let (place, uses) = parts(component.addr())?;
        let mut here = self.places.get(place)?.lock();
        if here.uses != uses {
            return None;
        }
        here.held.as_deref_mut().map(work)
    }

    /// Take the instance out, once no other thread works on it; its handle is void from here on.
    pub(super) fn remove(&self, component: Component) -> Option<Box<Held<M>>> {
        let (place, uses) = parts(component.addr())?;
        let mut here = self.places.get(place)?.lock();
        if here.uses != uses {
            return None;
        }
        let held = here.held.take()?;
        if here.uses < MOST_USES {
            self.free().push(place);
        }
        Some(held)
    }
}

impl<M: Model> Default for Live<M> {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_handle_tells_its_place_and_which_use_of_it() {
        for place in [0, 1, 31, STATE - 1, STATE] {
            for uses in [1, 2, 1000, MOST_USES - 1] {
                assert_eq!(parts(handle(place, uses)), Some((place, uses)));
                for off in 1..APART {
                    assert_eq!(parts(handle(place, uses) + off), None);
                }
            }
        }
    }
}
