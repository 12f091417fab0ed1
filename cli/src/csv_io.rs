//! Tables of inputs and results.

use std::io::Write;
use std::path::Path;

use cdpr::dynamics::Inputs;
use cdpr::per_cable::PerCable;
use cdpr::signal::{DISTURBANCES, indexed, input_names, output_names};
use cdpr::winch::WinchCommand;

use crate::failure::BadInput;
use crate::table::Table;

/// Reads a table of inputs: `time` (s), strictly increasing, the commands of the winches, as many as `steady` has, and any of the
/// disturbances (N, N m); those that are missing stay as `steady` has them. Each row's inputs hold until the next. Other columns are left alone.
pub(crate) fn read_inputs(path: &Path, steady: &Inputs, command: WinchCommand) -> Result<Vec<(f64, Inputs)>, BadInput> {
    let mut table = Table::open(path)?;
    let time = table.need("time")?;
    let mut winch_force = PerCable::filled(steady.winch_force.len(), 0);
    for (i, place) in winch_force.iter_mut().enumerate() {
        *place = table.need(&indexed(command.input(), i))?;
    }
    let cables = winch_force.len();
    let beyond = |name: &&String| {
        let index = name.strip_prefix(command.input())?.strip_prefix('[')?.strip_suffix(']')?;
        index.parse().ok().filter(|i: &usize| !(1..=cables).contains(i))
    };
    if let Some(name) = table.names().iter().find(|name| beyond(name).is_some()) {
        return Err(table.bad(format!("line 1: column `{name}`, but the robot has {cables} cables")));
    }
    let disturbance = Disturbances::find(&table, steady.disturbance)?;
    let mut rows: Vec<(f64, Inputs)> = Vec::new();
    while table.next_row()? {
        let now = table.more_than(rows.last().map(|row| row.0), time)?;
        let mut inputs = Inputs { disturbance: disturbance.read(&table)?, ..*steady };
        for (value, column) in inputs.winch_force.iter_mut().zip(winch_force) {
            *value = table.number(column)?;
        }
        rows.push((now, inputs));
    }
    if rows.is_empty() {
        return Err(table.bad("no rows below the header, expected at least one"));
    }
    Ok(rows)
}

/// The disturbances of a table: a column each, or what acts all the time.
pub(crate) struct Disturbances {
    columns: [Option<usize>; 3],
    steady: [f64; 3],
}

impl Disturbances {
    /// Looks for their columns.
    pub(crate) fn find(table: &Table, steady: [f64; 3]) -> Result<Self, BadInput> {
        let mut columns = [None; 3];
        for (place, name) in columns.iter_mut().zip(&DISTURBANCES) {
            *place = table.find(name.name)?;
        }
        Ok(Self { columns, steady })
    }

    /// Whether there are none at all.
    pub(crate) fn are_none(&self) -> bool {
        self.steady == [0.0; 3] && self.columns.iter().all(Option::is_none)
    }

    /// Those of the present row (N, N m).
    pub(crate) fn read(&self, table: &Table) -> Result<[f64; 3], BadInput> {
        let mut values = self.steady;
        for (value, column) in values.iter_mut().zip(self.columns) {
            if let Some(column) = column {
                *value = table.number(column)?;
            }
        }
        Ok(values)
    }
}

/// The inputs, in the order of [`input_names`].
pub(crate) fn input_values(inputs: &Inputs) -> Vec<f64> {
    inputs.winch_force.iter().chain(&inputs.disturbance).copied().collect()
}

/// A table of results being written: time, inputs, outputs.
pub(crate) struct ResultWriter<W: Write> {
    csv: csv::Writer<W>,
}

impl<W: Write> ResultWriter<W> {
    /// Writes the header for a robot with `cables` cables whose winches are told `command`.
    pub(crate) fn new(out: W, cables: usize, command: WinchCommand) -> csv::Result<Self> {
        let mut csv = csv::Writer::from_writer(out);
        let inputs = input_names(cables, command);
        csv.write_record(std::iter::once("time".to_owned()).chain(inputs).chain(output_names(cables)))?;
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
        read_inputs(&path, &Inputs::none(4), WinchCommand::Force).map_err(|e| e.to_string())
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
    fn disturbances_without_a_column_stay_as_they_are() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("table.csv");
        std::fs::write(&path, format!("{HEADER},disturbance_force_y\n0,1,1,1,1,5\n1,1,1,1,1,6\n")).unwrap();
        let steady = Inputs { disturbance: [7.0, 8.0, 9.0], ..Inputs::none(4) };
        let rows = read_inputs(&path, &steady, WinchCommand::Force).unwrap();
        assert_eq!([rows[0].1.disturbance, rows[1].1.disturbance], [[7.0, 5.0, 9.0], [7.0, 6.0, 9.0]]);
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
