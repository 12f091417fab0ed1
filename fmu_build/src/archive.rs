//! Writes the zip archive: the same files give the same bytes.

use std::collections::BTreeMap;
use std::io::{Cursor, Write};

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
}
