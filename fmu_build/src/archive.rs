//! Writes the zip archive: the same files give the same bytes.

use std::collections::BTreeMap;
use std::io::{Cursor, Write};
use std::path::Path;

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

use crate::PackError;

/// The files of an archive by their path in it.
pub(crate) type Files = BTreeMap<String, Vec<u8>>;

/// The archive's bytes: sorted by path, every file of the same age (1980-01-01, zip's oldest) and mode.
pub(crate) fn to_bytes(files: &Files) -> Result<Vec<u8>, PackError> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    for (path, bytes) in files {
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Deflated)
            .compression_level(Some(9))
            .last_modified_time(DateTime::default())
            .unix_permissions(if path.starts_with("binaries/") { 0o755 } else { 0o644 });
        zip.start_file(path.as_str(), options)?;
        zip.write_all(bytes).map_err(zip::result::ZipError::Io)?;
    }
    Ok(zip.finish()?.into_inner())
}

/// Is this a relative path with `/` that stays in the archive, on every system?
pub(crate) fn is_plain_path(path: &str) -> bool {
    path.split('/').all(|part| !part.is_empty() && part != "." && part != ".." && !part.contains(['\\', ':', '\0']))
}

/// Writes a file beside its place and moves it there, so that it appears whole or not at all.
pub(crate) fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), PackError> {
    let folder = match path.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    };
    let mut builder = tempfile::Builder::new();
    builder.prefix(".").suffix(".partial");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // As any new file: the user's mask decides who may read it.
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    let mut file = builder.tempfile_in(folder).map_err(PackError::file(path))?;
    file.write_all(bytes).map_err(PackError::file(path))?;
    file.persist(path).map_err(|error| PackError::file(path)(error.error))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_stay_inside() {
        for path in ["model.toml", "a/b.txt", "with space/ü.txt", ".hidden"] {
            assert!(is_plain_path(path), "{path}");
        }
        for path in ["", "/a", "a/", "a//b", "../a", "a/./b", "a\\b", "c:/a"] {
            assert!(!is_plain_path(path), "{path}");
        }
    }

    #[test]
    fn a_failed_write_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        // The place is taken by a folder, so the last move fails.
        let place = folder.path().join("taken.fmu");
        std::fs::create_dir_all(place.join("inside")).unwrap();
        let error = write_whole(&place, b"bytes").unwrap_err().to_string();
        assert!(error.contains("taken.fmu"), "{error}");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_file_replaces_the_older_one() {
        let folder = tempfile::tempdir().unwrap();
        let place = folder.path().join("a.fmu");
        write_whole(&place, b"first").unwrap();
        write_whole(&place, b"second").unwrap();
        assert_eq!(std::fs::read(&place).unwrap(), b"second");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
