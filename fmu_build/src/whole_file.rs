//! Files that appear whole or not at all.

use std::fs::{self, File, OpenOptions};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use crate::unfinished::Entry;

/// A file being written beside its place. [`WholeFile::finish`] moves it there; dropped before, or interrupted with
/// [`crate::unfinished::remove_all_and`], it leaves no trace.
///
/// A symbolic link stays: what it points to is replaced. What cannot be replaced, a pipe or a device, is written
/// straight into.
#[derive(Debug)]
pub struct WholeFile {
    place: Place,
}

#[derive(Debug)]
enum Place {
    Beside { file: NamedTempFile, place: PathBuf, unfinished: Entry },
    Straight(File),
}

impl WholeFile {
    /// Begins a file that is to be `path`.
    ///
    /// # Errors
    /// `path` is a folder or lies in none, or may not be written.
    pub fn create(path: &Path) -> io::Result<Self> {
        if let Some(file) = own_stream(path) {
            return Ok(Self { place: Place::Straight(file?) });
        }
        match fs::metadata(path) {
            Ok(found) if found.is_dir() => {
                Err(io::Error::new(ErrorKind::IsADirectory, "this is a folder, expected the name of a file"))
            }
            Ok(found) if found.is_file() => {
                // Whether the file may be written: moving another over it would not ask.
                drop(OpenOptions::new().write(true).open(path)?);
                let begun = Self::beside(fs::canonicalize(path)?)?;
                if let Place::Beside { file, .. } = &begun.place {
                    file.as_file().set_permissions(found.permissions())?;
                }
                Ok(begun)
            }
            Ok(_) => Ok(Self { place: Place::Straight(OpenOptions::new().write(true).open(path)?) }),
            Err(error) if error.kind() == ErrorKind::NotFound => Self::beside(end_of_links(path)),
            Err(error) => Err(error),
        }
    }

    fn beside(place: PathBuf) -> io::Result<Self> {
        if place.file_name().is_none() {
            return Err(io::Error::new(ErrorKind::InvalidInput, "expected the name of a file"));
        }
        let folder = match place.parent() {
            Some(folder) if folder != Path::new("") => folder,
            _ => Path::new("."),
        };
        if !folder.is_dir() {
            let message = format!("there is no folder {}", folder.display());
            return Err(io::Error::new(ErrorKind::NotFound, message));
        }
        let mut builder = tempfile::Builder::new();
        builder.prefix(".").suffix(".partial");
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            // As any new file: the user's mask decides who may read it.
            builder.permissions(fs::Permissions::from_mode(0o666));
        }
        // Without the name of the hidden file, which says nothing to the user.
        let made = Entry::of(|| builder.tempfile_in(folder), NamedTempFile::path);
        let (file, unfinished) = made.map_err(|error| {
            let message = format!("a file cannot be made in {}: {}", folder.display(), plain(&error));
            io::Error::new(error.kind(), message)
        })?;
        Ok(Self { place: Place::Beside { file, place, unfinished } })
    }

    /// Puts the file in its place, over an older one.
    ///
    /// # Errors
    /// It cannot be moved there; it is then removed, and the older file stays.
    pub fn finish(mut self) -> io::Result<()> {
        self.flush()?;
        match self.place {
            Place::Beside { file, place, unfinished } => {
                let moved = file.persist(place).map(drop).map_err(|error| error.error);
                drop(unfinished);
                moved
            }
            Place::Straight(_) => Ok(()),
        }
    }
}

impl Write for WholeFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match &mut self.place {
            Place::Beside { file, .. } => file.as_file_mut().write(bytes),
            Place::Straight(file) => file.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match &mut self.place {
            Place::Beside { file, .. } => file.as_file_mut().flush(),
            Place::Straight(file) => file.flush(),
        }
    }
}

/// Writes a whole file.
///
/// # Errors
/// As [`WholeFile::create`] and [`WholeFile::finish`], or the disk is full.
pub fn write(path: &Path, content: &[u8]) -> io::Result<()> {
    let mut file = WholeFile::create(path)?;
    file.write_all(content)?;
    file.finish()
}

/// Whether `path` is a pipe, a device or this process's own output: nothing that could be opened afterwards.
#[must_use]
pub fn is_stream(path: &Path) -> bool {
    own_stream(path).is_some() || fs::metadata(path).is_ok_and(|found| !found.is_file() && !found.is_dir())
}

/// Standard output or error under its name in the file system. Taken as it is, because opening it anew would begin at
/// the start of a file that it may have been redirected to.
#[cfg(unix)]
fn own_stream(path: &Path) -> Option<io::Result<File>> {
    use std::os::fd::AsFd;
    let stream = match path.to_str()? {
        "/dev/stdout" | "/dev/fd/1" | "/proc/self/fd/1" => io::stdout().as_fd().try_clone_to_owned(),
        "/dev/stderr" | "/dev/fd/2" | "/proc/self/fd/2" => io::stderr().as_fd().try_clone_to_owned(),
        _ => return None,
    };
    Some(stream.map(File::from))
}

#[cfg(not(unix))]
fn own_stream(_: &Path) -> Option<io::Result<File>> {
    None
}

/// The file that writing to `path` would make or replace, links followed, as far as it can be told.
#[must_use]
pub fn destination(path: &Path) -> PathBuf {
    if let Ok(found) = fs::canonicalize(path) {
        return found;
    }
    let place = end_of_links(path);
    let folder = place.parent().filter(|folder| *folder != Path::new("")).unwrap_or(Path::new("."));
    match (fs::canonicalize(folder), place.file_name()) {
        (Ok(folder), Some(name)) => folder.join(name),
        _ => place,
    }
}

/// Where a chain of links to a file that is not there yet ends.
fn end_of_links(path: &Path) -> PathBuf {
    let mut place = path.to_owned();
    while let Ok(next) = fs::read_link(&place) {
        place = place.parent().unwrap_or(Path::new("")).join(next);
    }
    place
}

/// What the system said, without the path that `tempfile` adds.
pub(crate) fn plain(error: &io::Error) -> String {
    let text = error.to_string();
    text.split_once(" at path ").map_or(text.as_str(), |(said, _)| said).to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entries(folder: &Path) -> usize {
        fs::read_dir(folder).unwrap().count()
    }

    #[test]
    fn a_file_replaces_the_older_one() {
        let folder = tempfile::tempdir().unwrap();
        let place = folder.path().join("a.fmu");
        write(&place, b"first").unwrap();
        write(&place, b"second").unwrap();
        assert_eq!(fs::read(&place).unwrap(), b"second");
        assert_eq!(entries(folder.path()), 1);
    }

    #[test]
    fn a_file_that_is_not_finished_leaves_the_older_one() {
        let folder = tempfile::tempdir().unwrap();
        let place = folder.path().join("a.csv");
        write(&place, b"first").unwrap();
        let mut file = WholeFile::create(&place).unwrap();
        file.write_all(b"second").unwrap();
        drop(file);
        assert_eq!(fs::read(&place).unwrap(), b"first");
        assert_eq!(entries(folder.path()), 1);
    }

    #[test]
    fn places_that_cannot_be_written_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let error = WholeFile::create(folder.path()).unwrap_err().to_string();
        assert_eq!(error, "this is a folder, expected the name of a file");
        let error = WholeFile::create(&folder.path().join("no/a.csv")).unwrap_err().to_string();
        assert!(error.starts_with("there is no folder") && error.ends_with("no"), "{error}");
        assert!(WholeFile::create(Path::new("")).unwrap_err().to_string().contains("the name of a file"));
        assert_eq!(entries(folder.path()), 0);
    }

    #[cfg(unix)]
    mod unix {
        use std::os::unix::fs::{PermissionsExt, symlink};

        use super::*;

        #[test]
        fn a_link_stays_and_its_target_is_replaced() {
            let folder = tempfile::tempdir().unwrap();
            let at = |name: &str| folder.path().join(name);
            fs::create_dir(at("results")).unwrap();
            fs::write(at("results/real.csv"), "older").unwrap();
            symlink("results/real.csv", at("link.csv")).unwrap();
            symlink("results/new.csv", at("dangling.csv")).unwrap();
            symlink(at("dangling.csv"), at("chain.csv")).unwrap();
            for (link, target) in [("link.csv", "results/real.csv"), ("chain.csv", "results/new.csv")] {
                write(&at(link), link.as_bytes()).unwrap();
                assert!(fs::symlink_metadata(at(link)).unwrap().is_symlink(), "{link}");
                assert_eq!(fs::read_to_string(at(target)).unwrap(), link);
            }
            assert!(at("dangling.csv").is_symlink());
            assert_eq!((entries(folder.path()), entries(&at("results"))), (4, 2));
        }

        #[test]
        fn links_in_a_circle_are_an_error() {
            let folder = tempfile::tempdir().unwrap();
            let at = |name: &str| folder.path().join(name);
            symlink("b", at("a")).unwrap();
            symlink("a", at("b")).unwrap();
            assert!(WholeFile::create(&at("a")).is_err());
        }

        #[test]
        fn the_older_files_mode_is_kept() {
            let folder = tempfile::tempdir().unwrap();
            let place = folder.path().join("private.csv");
            write(&place, b"first").unwrap();
            fs::set_permissions(&place, fs::Permissions::from_mode(0o600)).unwrap();
            write(&place, b"second").unwrap();
            assert_eq!(fs::metadata(&place).unwrap().permissions().mode() & 0o777, 0o600);
        }

        #[test]
        fn devices_are_written_into() {
            assert!(is_stream(Path::new("/dev/null")) && is_stream(Path::new("/dev/stdout")));
            assert!(!is_stream(Path::new("/")) && !is_stream(Path::new("/no/such/place")));
            let link = fs::symlink_metadata("/dev/null").unwrap();
            write(Path::new("/dev/null"), b"gone").unwrap();
            assert_eq!(fs::symlink_metadata("/dev/null").unwrap().file_type(), link.file_type());
        }
    }
}
