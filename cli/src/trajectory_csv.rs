//! Tables of a prescribed motion.

use std::path::Path;

use cdpr::inverse::Samples;
use csv::{ReaderBuilder, Trim};

use crate::csv_io::{DISTURBANCES, line_at, no_column, read_text};
use crate::failure::BadInput;

const POSE: [&str; 3] = ["x", "y", "phi"];
const TWIST: [&str; 3] = ["vx", "vy", "omega"];
const ACCELERATION: [&str; 3] = ["ax", "ay", "alpha"];

/// A prescribed motion as read.
#[derive(Debug)]
pub(crate) struct Table {
    pub(crate) samples: Samples,
    /// The line of each sample in the file, from 1.
    pub(crate) lines: Vec<usize>,
}

/// Reads `time, x, y, phi`, and where there: `vx, vy, omega`, then `ax, ay, alpha`, and any of the disturbances.
pub(crate) fn read(path: &Path) -> Result<Table, BadInput> {
    let bad = |message: String| BadInput::in_file(path, message);
    let bytes = read_text(path)?;
    let mut reader = ReaderBuilder::new().trim(Trim::All).flexible(true).from_reader(bytes.as_slice());
    let header = reader.headers().map_err(|error| bad(error.to_string()))?.clone();
    let names: Vec<&str> = header.iter().map(|name| name.trim_start_matches('\u{feff}').trim()).collect();
    let find = |name: &str| -> Result<Option<usize>, BadInput> {
        let mut places = names.iter().enumerate().filter(|(_, n)| **n == name).map(|(k, _)| k);
        match (places.next(), places.next()) {
            (Some(_), Some(_)) => Err(bad(format!("line 1: column `{name}` is there twice, expected once"))),
            (found, _) => Ok(found),
        }
    };
    let need = |name: &str| find(name)?.ok_or_else(|| bad(no_column(name, &names)));
    // Rates count as a group: all three, or none.
    let group = |columns: [&str; 3]| -> Result<Option<[usize; 3]>, BadInput> {
        let mut found = [None; 3];
        for (place, name) in found.iter_mut().zip(columns) {
            *place = find(name)?;
        }
        match found {
            [None, None, None] => Ok(None),
            [Some(a), Some(b), Some(c)] => Ok(Some([a, b, c])),
            _ => Err(bad(format!(
                "line 1: expected all or none of the columns {}",
                columns.map(|n| format!("`{n}`")).join(", ")
            ))),
        }
    };
    let time = need("time")?;
    let mut pose = [0; 3];
    for (place, name) in pose.iter_mut().zip(POSE) {
        *place = need(name)?;
    }
    let (twist, acceleration) = (group(TWIST)?, group(ACCELERATION)?);
    if acceleration.is_some() && twist.is_none() {
        return Err(bad("line 1: accelerations are given without the columns `vx`, `vy`, `omega`".to_owned()));
    }
    let mut disturbance = [None; 3];
    for (place, name) in disturbance.iter_mut().zip(DISTURBANCES) {
        *place = find(name)?;
    }
    let mut samples = Samples::default();
    let mut lines = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|error| bad(error.to_string()))?;
        let line = record.position().map_or(0, |position| line_at(&bytes, position.byte()));
        if record.len() != header.len() {
            return Err(bad(format!(
                "line {line}: {} cells, expected {} as in the header",
                record.len(),
                header.len()
            )));
        }
        let number = |column: usize| match record[column].parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            _ => {
                let (name, cell) = (names[column], &record[column]);
                Err(bad(format!("line {line}: `{name}` is {cell:?}, expected a finite number")))
            }
        };
        let three = |columns: [usize; 3]| Ok([number(columns[0])?, number(columns[1])?, number(columns[2])?]);
        let now = number(time)?;
        if let Some(before) = samples.time.last()
            && now <= *before
        {
            return Err(bad(format!("line {line}: `time` is {now}, expected more than {before} of the row before")));
        }
        samples.time.push(now);
        lines.push(line);
        samples.pose.push(three(pose)?);
        if let Some(columns) = twist {
            samples.twist.push(three(columns)?);
        }
        if let Some(columns) = acceleration {
            samples.acceleration.push(three(columns)?);
        }
        if disturbance.iter().any(Option::is_some) {
            let mut row = [0.0; 3];
            for (value, column) in row.iter_mut().zip(disturbance) {
                if let Some(column) = column {
                    *value = number(column)?;
                }
            }
            samples.disturbance.push(row);
        }
    }
    if samples.time.len() < 2 {
        return Err(bad(format!("{} rows below the header, expected two or more", samples.time.len())));
    }
    Ok(Table { samples, lines })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_text(text: &str) -> Result<Table, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("motion.csv");
        std::fs::write(&path, text).unwrap();
        read(&path).map_err(|error| error.to_string())
    }

    #[test]
    fn columns_are_found_by_name() {
        let text = "phi,time,y,x,disturbance_torque,note\n0.1,0,2,1,9,a\n\n0.2,1,3,2,8,b\n";
        let Table { samples, lines } = read_text(text).unwrap();
        assert_eq!(lines, [2, 4]);
        assert_eq!(samples.pose, [[1.0, 2.0, 0.1], [2.0, 3.0, 0.2]]);
        assert_eq!(samples.disturbance, [[0.0, 0.0, 9.0], [0.0, 0.0, 8.0]]);
        assert!(samples.twist.is_empty());
    }

    #[test]
    fn errors_name_line_and_column() {
        for (text, part) in [
            ("time,x,y\n0,1,2\n", "no column `phi`"),
            ("time,x,y,phi,vx\n0,1,2,0,1\n", "`vx`, `vy`, `omega`"),
            ("time,x,y,phi,ax,ay,alpha\n0,1,2,0,1,1,1\n", "without the columns `vx`"),
            ("time,x,y,phi\n0,1,2,0\n0,1,2,0\n", "line 3: `time` is 0"),
            ("time,x,y,phi\n0,1,2,0\n1,1,,0\n", "line 3: `y` is \"\""),
            ("time,x,y,phi\n0,1,2,0\n1,1,0\n", "line 3: 3 cells"),
            ("time,x,y,phi\n0,1,2,0\n", "1 rows"),
            ("time,x,y,phi,x\n", "twice"),
        ] {
            let error = read_text(text).unwrap_err();
            assert!(error.contains(part), "{text:?}: {error}");
        }
    }
}
