//! A shared library for one platform, and what it must export.

use std::path::Path;

use object::read::NameOrOrdinal;
use object::read::elf::{ElfFile, ElfFile32, ElfFile64, FileHeader};
use object::read::macho::{FatArch, MachOFatFile32};
use object::{Architecture, Endianness, FileKind, Object, ObjectKind};

use crate::{PackError, Platform};

/// The functions of FMI 2.0 for co-simulation; a binary must export every one (FMI 2.0.3, sections 2.1 and 4.2).
pub const FUNCTIONS: [&str; 34] = [
    "fmi2GetTypesPlatform",
    "fmi2GetVersion",
    "fmi2SetDebugLogging",
    "fmi2Instantiate",
    "fmi2FreeInstance",
    "fmi2SetupExperiment",
    "fmi2EnterInitializationMode",
    "fmi2ExitInitializationMode",
    "fmi2Terminate",
    "fmi2Reset",
    "fmi2GetReal",
    "fmi2GetInteger",
    "fmi2GetBoolean",
    "fmi2GetString",
    "fmi2SetReal",
    "fmi2SetInteger",
    "fmi2SetBoolean",
    "fmi2SetString",
    "fmi2GetFMUstate",
    "fmi2SetFMUstate",
    "fmi2FreeFMUstate",
    "fmi2SerializedFMUstateSize",
    "fmi2SerializeFMUstate",
    "fmi2DeSerializeFMUstate",
    "fmi2GetDirectionalDerivative",
    "fmi2SetRealInputDerivatives",
    "fmi2GetRealOutputDerivatives",
    "fmi2DoStep",
    "fmi2CancelStep",
    "fmi2GetStatus",
    "fmi2GetRealStatus",
    "fmi2GetIntegerStatus",
    "fmi2GetBooleanStatus",
    "fmi2GetStringStatus",
];

/// A shared library for one platform, known to export every function of FMI 2.0 for co-simulation.
#[derive(Clone)]
pub struct Binary {
    platform: Platform,
    /// More than one in the files that macOS calls universal.
    architectures: Vec<Architecture>,
    bytes: Vec<u8>,
}

impl Binary {
    /// Checks the library's format and exports.
    ///
    /// # Errors
    /// [`PackError::NotALibrary`] where `bytes` are no shared library for `platform`,
    /// [`PackError::MissingFunctions`] where functions are missing.
    pub fn new(platform: Platform, bytes: Vec<u8>) -> Result<Self, PackError> {
        let not_a_library = |found: String| PackError::NotALibrary { platform: platform.folder(), found };
        let mut architectures = Vec::new();
        for part in parts(platform, &bytes).map_err(not_a_library)? {
            let missing: Vec<_> =
                FUNCTIONS.into_iter().filter(|name| !part.exports.iter().any(|export| export == name)).collect();
            if !missing.is_empty() {
                return Err(PackError::MissingFunctions { platform: platform.folder(), missing });
            }
            architectures.push(part.architecture);
        }
        Ok(Self { platform, architectures, bytes })
    }

    /// Reads the library from a file.
    ///
    /// # Errors
    /// As [`Binary::new`]; [`PackError::File`] where the file cannot be read.
    pub fn read(platform: Platform, path: &Path) -> Result<Self, PackError> {
        let bytes = std::fs::read(path).map_err(PackError::file(path))?;
        Self::new(platform, bytes)
    }

    /// The platform it runs on.
    #[must_use]
    pub fn platform(&self) -> Platform {
        self.platform
    }

    /// The file's content.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// The platform, and the C library that it needs there.
    pub(crate) fn label(&self) -> String {
        let folder = self.platform.folder();
        match self.needed_glibc() {
            Some((major, minor)) => format!("{folder} (glibc {major}.{minor} or newer)"),
            None => folder.to_owned(),
        }
    }

    /// Can this program load it?
    pub(crate) fn runs_here(&self) -> bool {
        let here = match std::env::consts::ARCH {
            "x86_64" => Architecture::X86_64,
            "x86" => Architecture::I386,
            "aarch64" => Architecture::Aarch64,
            "arm" => Architecture::Arm,
            _ => Architecture::Unknown,
        };
        Platform::host() == Some(self.platform) && self.architectures.contains(&here)
    }

    /// The newest glibc version that the library asks for, such as `(2, 17)`: it loads on systems that have
    /// this one or a newer one. `None` where it asks for none, as on Windows and macOS.
    #[must_use]
    pub fn needed_glibc(&self) -> Option<(u32, u32)> {
        let bytes = self.bytes.as_slice();
        match FileKind::parse(bytes).ok()? {
            FileKind::Elf64 => newest_glibc(&ElfFile64::<Endianness>::parse(bytes).ok()?),
            FileKind::Elf32 => newest_glibc(&ElfFile32::<Endianness>::parse(bytes).ok()?),
            _ => None,
        }
    }
}

impl std::fmt::Debug for Binary {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Binary").field("platform", &self.platform).field("bytes", &self.bytes.len()).finish()
    }
}

/// A library for one architecture.
struct Part {
    architecture: Architecture,
    exports: Vec<String>,
}

/// The library, or each of those that a universal file holds.
fn parts(platform: Platform, bytes: &[u8]) -> Result<Vec<Part>, String> {
    let read = |error: object::Error| error.to_string();
    if FileKind::parse(bytes).map_err(read)? != FileKind::MachOFat32 {
        return Ok(vec![part(platform, bytes)?]);
    }
    let universal = MachOFatFile32::parse(bytes).map_err(read)?;
    universal.arches().iter().map(|entry| part(platform, entry.data(bytes).map_err(read)?)).collect()
}

fn part(platform: Platform, bytes: &[u8]) -> Result<Part, String> {
    let read = |error: object::Error| error.to_string();
    let file = object::File::parse(bytes).map_err(read)?;
    let (format, architecture) = (file.format(), file.architecture());
    if !platform.accepts(format, architecture) {
        return Err(format!("its format is {format:?} for {architecture:?}"));
    }
    if file.kind() != ObjectKind::Dynamic {
        return Err(format!("expected a shared library, it is of kind {:?}", file.kind()));
    }
    // Mach-O puts an underscore before every C name.
    let prefix = if platform == Platform::Darwin64 { "_" } else { "" };
    let mut exports = Vec::new();
    for export in file.exports().map_err(read)? {
        if let NameOrOrdinal::Name(name) = export.map_err(read)?.name()
            && let Ok(name) = std::str::from_utf8(name)
            && let Some(name) = name.strip_prefix(prefix)
        {
            exports.push(name.to_owned());
        }
    }
    Ok(Part { architecture, exports })
}

/// The newest `GLIBC_x.y` in the list of needed versions.
fn newest_glibc<Elf: FileHeader>(file: &ElfFile<'_, Elf>) -> Option<(u32, u32)> {
    let (endian, data) = (file.endian(), file.data());
    let sections = file.elf_section_table();
    let (mut libraries, link) = sections.gnu_verneed(endian, data).ok()??;
    let strings = sections.strings(endian, data, link).ok()?;
    let mut newest = None;
    while let Some((_, mut versions)) = libraries.next().ok()? {
        while let Some(version) = versions.next().ok()? {
            let name = version.name(endian, strings).ok()?;
            newest = newest.max(glibc_version(name));
        }
    }
    newest
}

/// `(2, 17)` out of `GLIBC_2.17`.
fn glibc_version(name: &[u8]) -> Option<(u32, u32)> {
    let numbers = std::str::from_utf8(name).ok()?.strip_prefix("GLIBC_")?;
    let mut numbers = numbers.split('.').map(str::parse);
    Some((numbers.next()?.ok()?, numbers.next()?.ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_file_is_no_library() {
        let error = Binary::new(Platform::Linux64, b"#!/bin/sh\n".to_vec()).unwrap_err();
        assert!(matches!(error, PackError::NotALibrary { .. }), "{error}");
    }

    /// This test's own program is a file of the host's format, but exports nothing of FMI.
    #[test]
    fn a_file_without_the_functions_or_for_another_platform_is_refused() {
        let Some(host) = Platform::host() else { return };
        let program = std::env::current_exe().unwrap();
        let error = Binary::read(host, &program).unwrap_err();
        let refused = matches!(error, PackError::MissingFunctions { .. } | PackError::NotALibrary { .. });
        assert!(refused, "{error}");
        let other = if host == Platform::Win64 { Platform::Linux64 } else { Platform::Win64 };
        let error = Binary::read(other, &program).unwrap_err().to_string();
        assert!(error.contains(other.folder()) && error.contains("its format is"), "{error}");
    }

    #[test]
    fn glibc_versions_are_compared_as_numbers() {
        assert_eq!(glibc_version(b"GLIBC_2.17"), Some((2, 17)));
        assert_eq!(glibc_version(b"GLIBC_2.2.5"), Some((2, 2)));
        assert!(glibc_version(b"GLIBC_2.9") < glibc_version(b"GLIBC_2.17"));
        assert_eq!(glibc_version(b"GCC_3.0"), None);
    }
}
