//! What is removed when the program is interrupted: files being written, temporary folders.

use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

static PATHS: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

fn paths() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    // The set is whole whatever another thread has panicked at.
    PATHS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A path that is unfinished as long as this lives.
#[derive(Debug)]
pub(crate) struct Entry(PathBuf);

impl Entry {
    /// Makes something unfinished. An interruption comes before it is made or after its path is noted.
    pub(crate) fn of<T>(make: impl FnOnce() -> io::Result<T>, path: impl FnOnce(&T) -> &Path) -> io::Result<(T, Self)> {
        let mut paths = paths();
        let made = make()?;
        let path = path(&made).to_owned();
        paths.insert(path.clone());
        Ok((made, Self(path)))
    }
}

impl Drop for Entry {
    fn drop(&mut self) {
        paths().remove(&self.0);
    }
}

/// Removes every unfinished file and folder and goes on to `end`, which is to end the program: nothing unfinished can be
/// made meanwhile.
pub fn remove_all_and<R>(end: impl FnOnce() -> R) -> R {
    let paths = paths();
    for path in paths.iter() {
        // What another thread has just moved into its place is not there any more, and need not be.
        let _ = if path.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) };
    }
    end()
}
