//! Temporary folders.

use std::path::Path;

use tempfile::{Builder, TempDir};

use crate::PackError;
use crate::unfinished::Entry;

/// A new folder in the system's folder for temporary files, for this user only. It goes when this is dropped, or when the
/// program is interrupted and calls [`crate::unfinished::remove_all_and`].
#[derive(Debug)]
pub struct TemporaryFolder {
    folder: TempDir,
    _entry: Entry,
}

impl TemporaryFolder {
    /// Makes the folder.
    ///
    /// # Errors
    /// [`PackError::TemporaryFolder`] where it cannot be made.
    pub fn new() -> Result<Self, PackError> {
        let mut builder = Builder::new();
        builder.prefix("cdpr-");
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            // A library is loaded from there: nobody else may change or read it.
            builder.permissions(std::fs::Permissions::from_mode(0o700));
        }
        let made = Entry::of(|| builder.tempdir(), TempDir::path);
        let (folder, entry) = made.map_err(|error| PackError::TemporaryFolder {
            folder: std::env::temp_dir(),
            found: crate::whole_file::plain(&error),
        })?;
        Ok(Self { folder, _entry: entry })
    }

    /// Its path.
    #[must_use]
    pub fn path(&self) -> &Path {
        self.folder.path()
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use std::os::unix::fs::PermissionsExt;

    #[test]
    fn a_temporary_folder_is_for_this_user_only_and_goes_in_the_end() {
        let folder = TemporaryFolder::new().unwrap();
        let path = folder.path().to_owned();
        assert_eq!(std::fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o700);
        drop(folder);
        assert!(!path.exists());
    }
}
