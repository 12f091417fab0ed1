//! Handles of live instances.
//!
//! A host holds a handle, not a pointer: a number that was never used before and is looked up at each
//! call. So a freed, foreign or made-up `fmi2Component` is found out instead of being followed.

use std::any::Any;
use std::collections::HashMap;
use std::ffi::c_void;
use std::hash::{BuildHasherDefault, Hasher};
use std::ptr;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, LazyLock, Mutex, MutexGuard, PoisonError, RwLock};

use super::Component;
use super::host::Host;
use crate::instance::Instance;
use crate::model::Model;

/// An instance with its way back to the host.
pub(super) struct Slot<M> {
    pub(super) host: Host,
    instance: Mutex<Instance<M>>,
}

impl<M: Model> Slot<M> {
    pub(super) fn new(host: Host, instance: Instance<M>) -> Self {
        Self { host, instance: Mutex::new(instance) }
    }

    /// The instance, for this thread alone. Panics of the model are caught while the lock is held, so
    /// a poisoned lock says nothing about the instance.
    pub(super) fn lock(&self) -> MutexGuard<'_, Instance<M>> {
        self.instance.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

type Slots = HashMap<usize, Arc<dyn Any + Send + Sync>, BuildHasherDefault<ByNumber>>;

/// Handles are numbers of our own making, 16 apart: spread over all bits by one multiplication they need no better hash.
#[derive(Default)]
struct ByNumber(u64);

impl Hasher for ByNumber {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|byte| self.write_usize(usize::from(*byte)));
    }

    fn write_usize(&mut self, number: usize) {
        // 2^64 over the golden ratio (D. E. Knuth).
        self.0 = (self.0 ^ number as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(32);
    }
}

static LIVE: LazyLock<RwLock<Slots>> = LazyLock::new(RwLock::default);
static USED: AtomicUsize = AtomicUsize::new(0);

/// A number that was not handed out before: steps of 16 from the address of something in this binary,
/// so that it looks like a pointer and two FMUs in one process do not count alike.
pub(super) fn new_handle() -> usize {
    let base = ptr::from_ref(&USED).addr();
    base.wrapping_add(USED.fetch_add(1, Ordering::Relaxed).wrapping_mul(16))
}

pub(super) fn as_pointer(handle: usize) -> *mut c_void {
    ptr::without_provenance_mut(handle)
}

pub(super) fn insert<M: Model>(slot: Slot<M>) -> Component {
    let handle = new_handle();
    let mut live = LIVE.write().unwrap_or_else(PoisonError::into_inner);
    live.insert(handle, Arc::new(slot));
    as_pointer(handle)
}

/// The live instance behind a handle. The caller shares it, so that it outlives its own release by
/// another thread.
pub(super) fn find<M: Model>(component: Component) -> Option<Arc<Slot<M>>> {
    let live = LIVE.read().unwrap_or_else(PoisonError::into_inner);
    let slot = Arc::clone(live.get(&component.addr())?);
    drop(live);
    slot.downcast().ok()
}

/// Take the instance out; its handle is void from here on.
pub(super) fn remove<M: Model>(component: Component) -> Option<Arc<Slot<M>>> {
    let slot = find(component)?;
    let mut live = LIVE.write().unwrap_or_else(PoisonError::into_inner);
    live.remove(&component.addr())?;
    Some(slot)
}
