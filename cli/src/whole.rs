//! Files that appear whole or not at all.

use std::fs::{self, File, OpenOptions};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use anyhow::Context;

/// A file being written beside its place. [`WholeFile::finish`] moves it there; dropped before, it leaves no trace.
pub(crate) struct WholeFile {
    path: PathBuf,
    beside: PathBuf,
    writer: Option<BufWriter<File>>,
}

impl WholeFile {
    /// Begins a file that is to be `path`.
    pub(crate) fn create(path: &Path) -> anyhow::Result<Self> {
        let name = path.file_name().with_context(|| format!("{}: expected the name of a file", path.display()))?;
        anyhow::ensure!(!path.is_dir(), "{}: there is a folder of that name", path.display());
        let mut hidden = std::ffi::OsString::from(".");
        hidden.push(name);
        hidden.push(format!(".{}.part", std::process::id()));
        let beside = path.with_file_name(hidden);
        let file = OpenOptions::new().write(true).create_new(true).open(&beside);
        let file = file.with_context(|| format!("{}: cannot be written", path.display()))?;
        Ok(Self { path: path.to_owned(), beside, writer: Some(BufWriter::new(file)) })
    }

    /// Puts the file in its place, over an older one.
    pub(crate) fn finish(mut self) -> anyhow::Result<()> {
        let path = self.path.clone();
        let cannot = || format!("{}: cannot be written", path.display());
        self.flush().with_context(cannot)?;
        // Windows cannot move an open file.
        drop(self.writer.take());
        let moved = fs::rename(&self.beside, &path).with_context(cannot);
        if moved.is_err() {
            let _ = fs::remove_file(&self.beside);
        }
        moved
    }
}

impl Write for WholeFile {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.writer.as_mut().map_or(Ok(0), |writer| writer.write(bytes))
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.writer.as_mut().map_or(Ok(()), BufWriter::flush)
    }
}

impl Drop for WholeFile {
    fn drop(&mut self) {
        if self.writer.take().is_some() {
            let _ = fs::remove_file(&self.beside);
        }
    }
}

/// Writes a whole file.
pub(crate) fn write(path: &Path, content: impl AsRef<[u8]>) -> anyhow::Result<()> {
    let mut file = WholeFile::create(path)?;
    file.write_all(content.as_ref()).with_context(|| format!("{}: cannot be written", path.display()))?;
    file.finish()
}
