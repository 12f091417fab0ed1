//! Output files: whole or not at all, and named in errors.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use anyhow::Context;
use cdpr_fmu_build::whole_file;

use crate::failure::BadInput;

/// A [`whole_file::WholeFile`] that knows its path.
pub(crate) struct WholeFile {
    path: PathBuf,
    file: whole_file::WholeFile,
}

impl WholeFile {
    /// Begins a file that is to be `path`.
    pub(crate) fn create(path: &Path) -> Result<Self, BadInput> {
        let file = whole_file::WholeFile::create(path);
        let file = file.map_err(|error| BadInput::in_file(path, format!("cannot be written: {error}")))?;
        Ok(Self { path: path.to_owned(), file })
    }

    /// What it is to be.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Puts the file in its place, over an older one.
    pub(crate) fn finish(self) -> anyhow::Result<()> {
        self.file.finish().with_context(|| format!("{}: cannot be written", self.path.display()))
    }

    /// The same error, of the same kind, with the file's name.
    fn named(&self, error: &io::Error) -> io::Error {
        io::Error::new(error.kind(), format!("{}: cannot be written: {error}", self.path.display()))
    }
}

impl Write for WholeFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes).map_err(|error| self.named(&error))
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush().map_err(|error| self.named(&error))
    }
}

/// Writes a whole file.
pub(crate) fn write(path: &Path, content: impl AsRef<[u8]>) -> anyhow::Result<()> {
    let mut file = WholeFile::create(path)?;
    file.write_all(content.as_ref())?;
    file.finish()
}
