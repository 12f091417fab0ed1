//! Text files, told from what is none.

use std::fs::File;
use std::io::{self, ErrorKind, Read};
use std::path::Path;

/// Longest line that is taken for one of a table (bytes): some ten thousand columns.
const LONGEST_LINE: usize = 1 << 20;

/// The bytes of a file as long as they can be those of a table: devices and binary files have no end, or none of their
/// lines has.
#[derive(Debug)]
pub struct Lines<R> {
    from: R,
    /// The line that is being read, from 1.
    line: usize,
    /// Its bytes so far.
    length: usize,
}

impl Lines<File> {
    /// Opens a file.
    ///
    /// # Errors
    /// As [`File::open`].
    pub fn open(path: &Path) -> io::Result<Self> {
        Ok(Self { from: File::open(path)?, line: 1, length: 0 })
    }
}

impl<R: Read> Read for Lines<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.from.read(buffer)?;
        let bad = |message: String| Err(io::Error::new(ErrorKind::InvalidData, message));
        for byte in &buffer[..count] {
            match byte {
                b'\n' => (self.line, self.length) = (self.line + 1, 0),
                0 => return bad(format!("line {}: found the byte 0x00, expected text in UTF-8", self.line)),
                _ => self.length += 1,
            }
            if self.length > LONGEST_LINE {
                return bad(format!("line {} is longer than {LONGEST_LINE} bytes, expected a table's row", self.line));
            }
        }
        Ok(count)
    }
}
