//! The platforms that FMI 2.0 has folders for.

use object::{Architecture, BinaryFormat};

/// A platform that a binary inside an FMU runs on, by FMI 2.0's names.
///
/// FMI 2.0 names folders by system and pointer size only. Importers look for 64-bit ARM binaries in the same
/// folders, so an FMU holds either of the two architectures for one system (macOS knows files with both).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Platform {
    /// macOS, `darwin64`.
    Darwin64,
    /// Linux with 32-bit pointers, `linux32`.
    Linux32,
    /// Linux with 64-bit pointers, `linux64`.
    Linux64,
    /// Windows with 32-bit pointers, `win32`.
    Win32,
    /// Windows with 64-bit pointers, `win64`.
    Win64,
}

impl Platform {
    /// Every platform.
    pub const ALL: [Self; 5] = [Self::Darwin64, Self::Linux32, Self::Linux64, Self::Win32, Self::Win64];

    /// The platform that this program runs on; `None` where FMI 2.0 has no name for it.
    #[must_use]
    pub fn host() -> Option<Self> {
        Self::of(std::env::consts::OS, usize::BITS)
    }

    /// The platform of a Rust target triple such as `x86_64-unknown-linux-gnu`.
    #[must_use]
    pub fn of_triple(triple: &str) -> Option<Self> {
        let mut parts = triple.split('-');
        let bits = match parts.next()? {
            "x86_64" | "aarch64" | "universal2" | "riscv64gc" => 64,
            "i586" | "i686" | "armv7" => 32,
            _ => return None,
        };
        let os = parts.find_map(|part| match part {
            "linux" => Some("linux"),
            "windows" => Some("windows"),
            "darwin" => Some("macos"),
            _ => None,
        })?;
        Self::of(os, bits)
    }

    fn of(os: &str, bits: u32) -> Option<Self> {
        match (os, bits) {
            ("linux", 32) => Some(Self::Linux32),
            ("linux", 64) => Some(Self::Linux64),
            ("windows", 32) => Some(Self::Win32),
            ("windows", 64) => Some(Self::Win64),
            ("macos", 64) => Some(Self::Darwin64),
            _ => None,
        }
    }

    /// The folder's name under `binaries/`.
    #[must_use]
    pub fn folder(self) -> &'static str {
        match self {
            Self::Darwin64 => "darwin64",
            Self::Linux32 => "linux32",
            Self::Linux64 => "linux64",
            Self::Win32 => "win32",
            Self::Win64 => "win64",
        }
    }

    /// How a shared library's name ends there.
    #[must_use]
    pub fn extension(self) -> &'static str {
        match self {
            Self::Darwin64 => "dylib",
            Self::Linux32 | Self::Linux64 => "so",
            Self::Win32 | Self::Win64 => "dll",
        }
    }

    /// Is this the format and size of the platform's libraries?
    pub(crate) fn accepts(self, format: BinaryFormat, architecture: Architecture) -> bool {
        let bits = architecture.address_size().map(|size| 8 * u32::from(size.bytes()));
        let os = match format {
            BinaryFormat::Elf => "linux",
            BinaryFormat::Pe => "windows",
            BinaryFormat::MachO => "macos",
            _ => return false,
        };
        bits.and_then(|bits| Self::of(os, bits)) == Some(self)
    }
}

#[cfg(test)]
mod tests {
    use super::Platform;

    #[test]
    fn triples_lead_to_folders() {
        for (triple, folder) in [
            ("x86_64-unknown-linux-gnu", Some("linux64")),
            ("aarch64-unknown-linux-musl", Some("linux64")),
            ("i686-unknown-linux-gnu", Some("linux32")),
            ("x86_64-pc-windows-gnu", Some("win64")),
            ("i686-pc-windows-msvc", Some("win32")),
            ("aarch64-apple-darwin", Some("darwin64")),
            ("universal2-apple-darwin", Some("darwin64")),
            ("wasm32-unknown-unknown", None),
            ("x86_64-unknown-freebsd", None),
            ("linux64", None),
        ] {
            assert_eq!(Platform::of_triple(triple).map(Platform::folder), folder, "{triple}");
        }
    }
}
