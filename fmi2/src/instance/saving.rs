//! Saved states: kept in the instance under handles, and as bytes.

use super::Instance;
use crate::failure::{Failure, Outcome};
use crate::model::Model;
use crate::snapshot::Snapshot;

impl<M: Model> Instance<M> {
    /// Save the present state: over the one behind `reuse`, or under a new handle.
    pub(crate) fn save_state(&mut self, reuse: Option<usize>, new_handle: impl FnOnce() -> usize) -> Outcome<usize> {
        let mut model = match reuse {
            // The memory of the old state serves again.
            Some(handle) => std::mem::take(&mut self.known_mut(handle)?.model),
            None => Vec::new(),
        };
        model.clear();
        self.model.save(&mut model);
        let snapshot = Snapshot { progress: self.progress.clone(), model };
        Ok(self.keep(snapshot, reuse, new_handle))
    }

    pub(crate) fn restore_state(&mut self, handle: usize) -> Outcome {
        let snapshot = self.saved.get(&handle).ok_or_else(unknown)?;
        self.model.restore(&snapshot.model)?;
        self.progress.clone_from(&snapshot.progress);
        Ok(())
    }

    pub(crate) fn free_state(&mut self, handle: usize) -> Outcome {
        self.saved.remove(&handle).map(|_| ()).ok_or_else(unknown)
    }

    pub(crate) fn serialised_size(&self, handle: usize) -> Outcome<usize> {
        Ok(self.known(handle)?.byte_len(&self.declared.guid))
    }

    pub(crate) fn serialise(&self, handle: usize) -> Outcome<Vec<u8>> {
        Ok(self.known(handle)?.to_bytes(&self.declared.guid))
    }

    /// Keep the state that the bytes hold: over the one behind `reuse`, or under a new handle.
    pub(crate) fn deserialise(
        &mut self,
        bytes: &[u8],
        reuse: Option<usize>,
        new_handle: impl FnOnce() -> usize,
    ) -> Outcome<usize> {
        if let Some(handle) = reuse {
            self.known(handle)?;
        }
        let snapshot =
            Snapshot::from_bytes(bytes, &self.declared.guid).map_err(|error| Failure::refused(error.to_string()))?;
        Ok(self.keep(snapshot, reuse, new_handle))
    }

    fn keep(&mut self, snapshot: Snapshot, reuse: Option<usize>, new_handle: impl FnOnce() -> usize) -> usize {
        let handle = reuse.unwrap_or_else(new_handle);
        self.saved.insert(handle, snapshot);
        handle
    }

    fn known(&self, handle: usize) -> Outcome<&Snapshot> {
        self.saved.get(&handle).ok_or_else(unknown)
    }

    fn known_mut(&mut self, handle: usize) -> Outcome<&mut Snapshot> {
        self.saved.get_mut(&handle).ok_or_else(unknown)
    }
}

fn unknown() -> Failure {
    Failure::refused("the FMU state is not one that this instance saved and still has")
}
