//! Tables being read: a header, then rows of numbers, one at a time; errors by line and column.

use std::io::Read;
use std::path::{Path, PathBuf};

use cdpr_discovery::data::Lines;
use csv::{ByteRecord, Reader, ReaderBuilder, StringRecord, Terminator};

use crate::failure::BadInput;

/// How much of a cell, and of a header, an error shows (characters).
const SHOWN: usize = 40;
const SHOWN_OF_HEADER: usize = 200;

/// A table of which one row is read at a time, however long it is.
pub(crate) struct Table {
    path: PathBuf,
    reader: Reader<Box<dyn Read>>,
    /// Names of the columns.
    names: Vec<String>,
    bytes: ByteRecord,
    row: StringRecord,
    /// The line that the row begins in, from 1.
    line: usize,
}

impl Table {
    /// Opens a table and reads its header.
    pub(crate) fn open(path: &Path) -> Result<Self, BadInput> {
        let lines = Lines::open(path).map_err(|error| BadInput::in_file(path, error))?;
        // With a line's end after the last line too, every row ends in one, and lines can be counted by them.
        let text: Box<dyn Read> = Box::new(lines.chain(&b"\n"[..]));
        let reader =
            ReaderBuilder::new().has_headers(false).flexible(true).terminator(Terminator::Any(b'\n')).from_reader(text);
        let mut table = Self {
            path: path.to_owned(),
            reader,
            names: Vec::new(),
            bytes: ByteRecord::new(),
            row: StringRecord::new(),
            line: 1,
        };
        if table.read()? {
            // Spreadsheets put a byte order mark before the first name.
            table.names = table.row.iter().map(|name| name.trim_start_matches('\u{feff}').trim().to_owned()).collect();
        }
        if table.names.iter().any(|name| name.contains('\r')) {
            return Err(table.bad("line 1: lines end in carriage returns alone, expected line feeds"));
        }
        Ok(table)
    }

    /// Bad input in this file.
    pub(crate) fn bad(&self, message: impl std::fmt::Display) -> BadInput {
        BadInput::in_file(&self.path, message)
    }

    /// Bad input in the present row.
    pub(crate) fn bad_row(&self, message: impl std::fmt::Display) -> BadInput {
        self.bad(format!("line {}: {message}", self.line))
    }

    /// The line that the present row begins in, from 1.
    pub(crate) fn line(&self) -> usize {
        self.line
    }

    /// Names of the columns.
    pub(crate) fn names(&self) -> &[String] {
        &self.names
    }

    /// Where a column stands, if there is one of that name.
    pub(crate) fn find(&self, name: &str) -> Result<Option<usize>, BadInput> {
        let mut places = self.names.iter().enumerate().filter(|(_, n)| *n == name).map(|(k, _)| k);
        match (places.next(), places.next()) {
            (Some(_), Some(_)) => Err(self.bad(format!("line 1: column `{name}` is there twice, expected once"))),
            (found, _) => Ok(found),
        }
    }

    /// Where a column stands that must be there.
    pub(crate) fn need(&self, name: &str) -> Result<usize, BadInput> {
        self.find(name)?.ok_or_else(|| self.bad(self.no_column(name)))
    }

    fn no_column(&self, name: &str) -> String {
        let text = self.names.join(", ");
        if text.is_empty() {
            return format!("line 1: found nothing, expected a header with a column `{name}`");
        }
        // Spreadsheets of countries with a decimal comma separate cells by semicolons.
        let separator = match self.names.as_slice() {
            [only] if only.contains(';') => {
                "; the cells are separated by semicolons, expected commas and decimal points"
            }
            [only] if only.contains('\t') => "; the cells are separated by tabs, expected commas",
            _ => "",
        };
        format!("line 1: no column `{name}`; found {}{separator}", shown(&text, SHOWN_OF_HEADER))
    }

    /// Goes on to the next row; false after the last.
    pub(crate) fn next_row(&mut self) -> Result<bool, BadInput> {
        if !self.read()? {
            return Ok(false);
        }
        let (found, expected) = (self.row.len(), self.names.len());
        if found != expected {
            return Err(self.bad_row(format!("{found} cells, expected {expected} as in the header")));
        }
        Ok(true)
    }

    /// The number in a column of the present row.
    pub(crate) fn number(&self, column: usize) -> Result<f64, BadInput> {
        let cell = self.row[column].trim();
        match cell.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            _ => {
                let what = if cell.starts_with('=') { "a formula; expected its value, " } else { "expected " };
                let (name, cell) = (&self.names[column], shown(cell, SHOWN));
                Err(self.bad_row(format!("`{name}` is {cell}, {what}a finite number")))
            }
        }
    }

    /// The number in a column of the present row, which must be more than that of the row before.
    pub(crate) fn more_than(&self, before: Option<f64>, column: usize) -> Result<f64, BadInput> {
        let now = self.number(column)?;
        match before {
            Some(before) if now <= before => {
                let name = &self.names[column];
                Err(self.bad_row(format!("`{name}` is {now}, expected more than {before} of the row before")))
            }
            _ => Ok(now),
        }
    }

    /// Reads the next record that is not empty.
    fn read(&mut self) -> Result<bool, BadInput> {
        loop {
            let found = self.reader.read_byte_record(&mut self.bytes);
            if !found.map_err(|error| self.unreadable(&error))? {
                return Ok(false);
            }
            let within: usize = self.bytes.iter().map(|cell| cell.iter().filter(|byte| **byte == b'\n').count()).sum();
            let after = usize::try_from(self.reader.position().line()).unwrap_or(usize::MAX);
            self.line = after.saturating_sub(1 + within).max(1);
            if self.bytes.iter().all(<[u8]>::is_empty)
                || (self.bytes.len() == 1 && self.bytes[0].trim_ascii().is_empty())
            {
                continue;
            }
            let bytes = std::mem::take(&mut self.bytes);
            match StringRecord::from_byte_record(bytes) {
                Ok(row) => {
                    // The storage of the row before serves for the next.
                    self.bytes = std::mem::replace(&mut self.row, row).into_byte_record();
                    return Ok(true);
                }
                Err(error) => {
                    let at = error.utf8_error().clone();
                    let found = error.into_byte_record()[at.field()][at.valid_up_to()];
                    return Err(self.bad_row(format!("found the byte {found:#04x}, expected text in UTF-8")));
                }
            }
        }
    }

    fn unreadable(&self, error: &csv::Error) -> BadInput {
        match error.kind() {
            csv::ErrorKind::Io(error) => self.bad(error),
            _ => self.bad(error),
        }
    }
}

/// Text in quotation marks, on one line, without control codes, its end cut off where it is long.
pub(crate) fn shown(text: &str, most: usize) -> String {
    match text.char_indices().nth(most) {
        Some((end, _)) => format!("{:?}...", &text[..end]),
        None => format!("{text:?}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn open(text: impl AsRef<[u8]>) -> (tempfile::TempDir, Result<Table, BadInput>) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("table.csv");
        std::fs::write(&path, text).unwrap();
        let table = Table::open(&path);
        (folder, table)
    }

    /// Line and number of column `a` of every row.
    fn column(text: impl AsRef<[u8]>) -> Result<Vec<(usize, f64)>, String> {
        let mut table = open(text).1.map_err(|e| e.to_string())?;
        let mut found = Vec::new();
        let mut read = || -> Result<(), BadInput> {
            let a = table.need("a")?;
            while table.next_row()? {
                found.push((table.line(), table.number(a)?));
            }
            Ok(())
        };
        read().map_err(|e| e.to_string())?;
        Ok(found)
    }

    #[test]
    fn lines_are_counted_through_empty_ones_and_quoted_ones() {
        let expected = vec![(3, 1.0), (4, 2.0), (7, 3.0)];
        let text = "a,note\n\n1,x\n2,\"two\nlines\"\n\n3,end";
        assert_eq!(column(text).unwrap(), expected);
        assert_eq!(column(format!("{text}\n\n")).unwrap(), expected);
        assert_eq!(column(format!("\u{feff}{}", text.replace('\n', "\r\n"))).unwrap(), expected);
        assert!(column("\n").unwrap_err().contains("found nothing"));
    }

    #[test]
    fn long_cells_are_cut_and_control_codes_are_spelt_out() {
        let error = column(format!("a\n{}\n", "9x".repeat(50_000))).unwrap_err();
        assert!(
            error.contains("line 2: `a` is \"9x9x") && error.contains("\"..., expected a finite number"),
            "{error}"
        );
        assert!(error.lines().count() == 1 && error.len() < 300, "{error}");
        let error = column("a\n\u{1b}[31mred\n").unwrap_err();
        assert!(error.contains("\"\\u{1b}[31mred\"") && !error.contains('\u{1b}'), "{error}");
        let names: Vec<String> = (0..1000).map(|k| format!("column_{k}")).collect();
        let error = column(names.join(",")).unwrap_err();
        assert!(error.contains("no column `a`; found \"column_0") && error.len() < 400, "{error}");
    }

    #[test]
    fn formulas_are_called_by_their_name() {
        let error = column("a\n=1+2\n").unwrap_err();
        assert!(error.contains("line 2: `a` is \"=1+2\", a formula; expected its value"), "{error}");
    }

    #[test]
    fn what_is_no_text_is_told_by_its_line() {
        for (text, part) in [
            (b"a\n1\n\xe9\n".as_slice(), "line 3: found the byte 0xe9, expected text in UTF-8"),
            (b"a\n1\n2\0\n", "line 3: found the byte 0x00"),
            (b"a\r1\r2\r", "carriage returns alone"),
        ] {
            let error = column(text).unwrap_err();
            assert!(error.contains(part), "{error}");
        }
        let error = column("1".repeat(2_000_000)).unwrap_err();
        assert!(error.contains("line 1 is longer than"), "{error}");
    }
}
