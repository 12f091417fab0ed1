//! Tables of inputs and results.

use std::fs;
use std::io::Write;
use std::path::Path;

use cdpr::dynamics::Inputs;
use cdpr::per_cable::PerCable;
use cdpr::simulation::Outputs;
use csv::{ReaderBuilder, StringRecord, Trim};

use crate::failure::BadInput;

/// Names of the disturbance inputs, in the order of [`Inputs::disturbance`].
pub(crate) const DISTURBANCES: [&str; 3] = ["disturbance_force_x", "disturbance_force_y", "disturbance_torque"];

/// `name[i + 1]`.
pub(crate) fn indexed(name: &str, i: usize) -> String {
    format!("{name}[{}]", i + 1)
}

/// Reads a table of inputs: `time` (s), strictly increasing, the winch forces (N) of a robot with `cables` cables and any of the disturbances (N,
/// N m), which are zero where they are missing. Each row's inputs hold until the next. Other columns are left alone.
pub(crate) fn read_inputs(path: &Path, cables: usize) -> Result<Vec<(f64, Inputs)>, BadInput> {
    let bad = |message: String| BadInput::in_file(path, message);
    let bytes = read_text(path)?;
    let mut reader = ReaderBuilder::new().trim(Trim::All).flexible(true).from_reader(bytes.as_slice());
    let header = reader.headers().map_err(|error| bad(error.to_string()))?.clone();
    let columns = Columns::find(&header, cables).map_err(bad)?;
    let mut rows: Vec<(f64, Inputs)> = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|error| bad(error.to_string()))?;
        let line = record.position().map_or(0, |position| line_at(&bytes, position.byte()));
        let row = columns.row(&header, &record).map_err(|message| bad(format!("line {line}: {message}")))?;
        if let Some((before, _)) = rows.last()
            && row.0 <= *before
        {
            let message = format!("line {line}: `time` is {}, expected more than {before} of the row before", row.0);
            return Err(bad(message));
        }
        rows.push(row);
    }
    if rows.is_empty() {
        return Err(bad("no rows below the header, expected at least one".to_owned()));
    }
    Ok(rows)
}

/// The bytes of a table, which are text.
pub(crate) fn read_text(path: &Path) -> Result<Vec<u8>, BadInput> {
    let bytes = fs::read(path).map_err(|error| BadInput::in_file(path, error))?;
    match std::str::from_utf8(&bytes) {
        Ok(_) => Ok(bytes),
        Err(error) => {
            let line = bytes[..error.valid_up_to()].iter().filter(|b| **b == b'\n').count() + 1;
            let found = bytes[error.valid_up_to()];
            Err(BadInput::in_file(path, format!("line {line}: found the byte {found:#04x}, expected text in UTF-8")))
        }
    }
}

/// What to say of a header without this column.
pub(crate) fn no_column(name: &str, names: &[&str]) -> String {
    let text = names.join(", ");
    if text.is_empty() {
        return format!("line 1: found nothing, expected a header with a column `{name}`");
    }
    // Spreadsheets of countries with a decimal comma separate cells by semicolons.
    let separator = match names {
        [only] if only.contains(';') => "; the cells are separated by semicolons, expected commas and decimal points",
        [only] if only.contains('\t') => "; the cells are separated by tabs, expected commas",
        _ => "",
    };
    format!("line 1: no column `{name}`; found {text:?}{separator}")
}

/// The line, from 1, of a record that begins at this byte; the reader counts empty lines before it to the record.
pub(crate) fn line_at(bytes: &[u8], begin: u64) -> usize {
    let begin = usize::try_from(begin).unwrap_or(usize::MAX).min(bytes.len());
    let empty = bytes[begin..].iter().take_while(|b| b.is_ascii_whitespace()).count();
    bytes[..begin + empty].iter().filter(|b| **b == b'\n').count() + 1
}

/// Where the inputs stand in a row.
struct Columns {
    time: usize,
    winch_force: PerCable<usize>,
    disturbance: [Option<usize>; 3],
}

impl Columns {
    fn find(header: &StringRecord, cables: usize) -> Result<Self, String> {
        // Spreadsheets put a byte order mark before the first name.
        let names: Vec<&str> = header.iter().map(|name| name.trim_start_matches('\u{feff}').trim()).collect();
        let find = |name: &str| {
            let mut places = names.iter().enumerate().filter(|(_, n)| **n == name).map(|(k, _)| k);
            match (places.next(), places.next()) {
                (Some(_), Some(_)) => Err(format!("line 1: column `{name}` is there twice, expected once")),
                (found, _) => Ok(found),
            }
        };
        let need = |name: &str| find(name)?.ok_or_else(|| no_column(name, &names));
        let mut winch_force = PerCable::filled(cables, 0);
        let time = need("time")?;
        for (i, place) in winch_force.iter_mut().enumerate() {
            *place = need(&indexed("winch_force", i))?;
        }
        let mut disturbance = [None; 3];
        for (place, name) in disturbance.iter_mut().zip(DISTURBANCES) {
            *place = find(name)?;
        }
        Ok(Self { time, winch_force, disturbance })
    }

    fn row(&self, header: &StringRecord, record: &StringRecord) -> Result<(f64, Inputs), String> {
        if record.len() != header.len() {
            return Err(format!("{} cells, expected {} as in the header", record.len(), header.len()));
        }
        let number = |column: usize| {
            let (name, cell) = (header[column].trim_start_matches('\u{feff}'), &record[column]);
            match cell.parse::<f64>() {
                Ok(value) if value.is_finite() => Ok(value),
                _ => Err(format!("`{name}` is {cell:?}, expected a finite number")),
            }
        };
        let mut inputs = Inputs::none(self.winch_force.len());
        let time = number(self.time)?;
        for (value, column) in inputs.winch_force.iter_mut().zip(self.winch_force) {
            *value = number(column)?;
        }
        for (value, column) in inputs.disturbance.iter_mut().zip(self.disturbance) {
            if let Some(column) = column {
                *value = number(column)?;
            }
        }
        Ok((time, inputs))
    }
}

/// The names of the outputs in a table of results, in the order of [`output_values`].
pub(crate) fn output_names(cables: usize) -> Vec<String> {
    let mut names: Vec<String> = ["x", "y", "phi", "vx", "vy", "omega"].map(String::from).into();
    for quantity in
        ["cable_length", "unstretched_length", "unstretched_length_rate", "tension", "strain", "cable_angle"]
    {
        names.extend((0..cables).map(|i| indexed(quantity, i)));
    }
    names
}

/// The outputs under the names of [`output_names`].
pub(crate) fn output_values(outputs: &Outputs) -> Vec<f64> {
    let mut values = [outputs.pose, outputs.twist].concat();
    for quantity in [
        outputs.cable_length,
        outputs.unstretched_length,
        outputs.unstretched_length_rate,
        outputs.tension,
        outputs.strain,
        outputs.cable_angle,
    ] {
        values.extend(quantity);
    }
    values
}

/// The names of the inputs, in the order of [`input_values`].
pub(crate) fn input_names(cables: usize) -> Vec<String> {
    let forces = (0..cables).map(|i| indexed("winch_force", i));
    forces.chain(DISTURBANCES.map(String::from)).collect()
}

/// The inputs under the names of [`input_names`].
pub(crate) fn input_values(inputs: &Inputs) -> Vec<f64> {
    inputs.winch_force.iter().chain(&inputs.disturbance).copied().collect()
}

/// A table of results being written: time, inputs, outputs.
pub(crate) struct ResultWriter<W: Write> {
    csv: csv::Writer<W>,
}

impl<W: Write> ResultWriter<W> {
    /// Writes the header for a robot with `cables` cables.
    pub(crate) fn new(out: W, cables: usize) -> csv::Result<Self> {
        let mut csv = csv::Writer::from_writer(out);
        csv.write_record(std::iter::once("time".to_owned()).chain(input_names(cables)).chain(output_names(cables)))?;
        Ok(Self { csv })
    }

    /// Writes a row. Numbers are written so that they read back exactly.
    pub(crate) fn row(&mut self, time: f64, inputs: &[f64], outputs: &[f64]) -> csv::Result<()> {
        let numbers = std::iter::once(&time).chain(inputs).chain(outputs);
        self.csv.write_record(numbers.map(|number| format!("{number:?}")))
    }

    /// The rest, and what it was written to.
    pub(crate) fn finish(self) -> std::io::Result<W> {
        self.csv.into_inner().map_err(csv::IntoInnerError::into_error)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: impl AsRef<[u8]>) -> Result<Vec<(f64, Inputs)>, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("table.csv");
        std::fs::write(&path, text).unwrap();
        read_inputs(&path, 4).map_err(|e| e.to_string())
    }

    const HEADER: &str = "time,winch_force[1],winch_force[2],winch_force[3],winch_force[4]";

    #[test]
    fn columns_are_found_by_name() {
        let text = "\u{feff}winch_force[4], note, winch_force[3],winch_force[2],winch_force[1],disturbance_torque,time\r\n\
                    4,hello,3,2,1,9.5,0\r\n\r\n8,,7,6,5,0,1\r\n";
        let rows = read(text).unwrap();
        assert_eq!(rows.len(), 2);
        assert_eq!(rows[0].1, Inputs { winch_force: [1.0, 2.0, 3.0, 4.0].into(), disturbance: [0.0, 0.0, 9.5] });
        assert_eq!(rows[1].0, 1.0);
    }

    #[test]
    fn errors_name_line_column_and_cell() {
        for (body, parts) in [
            ("0,1,1,1,1\n1,1,1,x,1\n", ["line 3", "winch_force[3]", "\"x\""]),
            ("0,1,1,1,1\n1,1,1,,1\n", ["line 3", "winch_force[3]", "\"\""]),
            ("0,1,1,1,1\n1,1,1,nan,1\n", ["line 3", "winch_force[3]", "nan"]),
            ("0,1,1,1,1\n0,1,1,1,1\n", ["line 3", "`time` is 0", "more than 0"]),
            ("0,1,1,1,1\r\n\r\n1,1,1\r\n", ["line 4", "3 cells", "expected 5"]),
        ] {
            let error = read(format!("{HEADER}\n{body}")).unwrap_err();
            for part in parts {
                assert!(error.contains(part), "{error}");
            }
        }
        assert!(read("time,winch_force[1]\n0,1\n").unwrap_err().contains("no column `winch_force[2]`"));
        assert!(read("").unwrap_err().contains("found nothing, expected a header with a column `time`"));
        assert!(read("time;winch_force[1]\n0;1,5\n").unwrap_err().contains("semicolons, expected commas"));
        assert!(read("time\tx\n0\t1\n").unwrap_err().contains("tabs, expected commas"));
        let latin = [HEADER.as_bytes(), b"\n0,1,1,1,1\n1,1,1,1,\xe9\n"].concat();
        assert!(read(latin).unwrap_err().contains("line 3: found the byte 0xe9, expected text in UTF-8"));
        assert!(read(HEADER).unwrap_err().contains("no rows"));
        assert!(read(format!("{HEADER},time\n")).unwrap_err().contains("twice"));
    }
}
