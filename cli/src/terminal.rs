//! What is written for people to read: standard output and error, free of control codes that came in with a name.

use std::borrow::Cow;
use std::io::{self, StdoutLock, Write};

/// The text with control codes spelt out, but for line ends and tabs: a file's name may hold any.
pub(crate) fn plain(text: &str) -> Cow<'_, str> {
    let code = |c: char| c.is_control() && c != '\n' && c != '\t';
    if !text.contains(code) {
        return Cow::Borrowed(text);
    }
    let spelt = |c: char| if code(c) { c.escape_default().to_string() } else { c.to_string() };
    Cow::Owned(text.chars().map(spelt).collect())
}

/// Tells something on standard error. Where that cannot be written there is nowhere left to say so.
pub(crate) fn tell(message: &str) {
    let _ = writeln!(io::stderr(), "cdpr: {}", plain(message));
}

/// Standard output, for text.
pub(crate) fn out() -> Out {
    Out(io::stdout().lock())
}

/// Standard output; see [`out`].
pub(crate) struct Out(StdoutLock<'static>);

impl Write for Out {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        // Texts come in whole pieces; what is none is passed on as it is.
        let written = match std::str::from_utf8(bytes) {
            Ok(text) => self.0.write_all(plain(text).as_bytes()),
            Err(_) => self.0.write_all(bytes),
        };
        written.map(|()| bytes.len()).map_err(|error| named(&error))
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.flush().map_err(|error| named(&error))
    }
}

/// The same error, of the same kind, with what could not be written.
pub(crate) fn named(error: &io::Error) -> io::Error {
    io::Error::new(error.kind(), format!("standard output: cannot be written: {error}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_codes_are_spelt_out_and_the_rest_stays() {
        assert_eq!(plain("a\u{1b}[31mb\u{9b}c\r\u{7f}"), "a\\u{1b}[31mb\\u{9b}c\\r\\u{7f}");
        assert!(matches!(plain("two\nlines\t\u{3c6} \"'"), Cow::Borrowed(_)));
    }
}
