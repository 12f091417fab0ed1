//! Tables of a prescribed motion.

use std::path::Path;

use cdpr::inverse::Samples;

use crate::csv_io::Disturbances;
use crate::failure::BadInput;
use crate::table::Table;

const POSE: [&str; 3] = ["x", "y", "phi"];
const TWIST: [&str; 3] = ["vx", "vy", "omega"];
const ACCELERATION: [&str; 3] = ["ax", "ay", "alpha"];

/// A prescribed motion as read.
#[derive(Debug)]
pub(crate) struct Motion {
    pub(crate) samples: Samples,
    /// The line of each sample in the file, from 1.
    pub(crate) lines: Vec<usize>,
}

/// Reads `time, x, y, phi`, and where there: `vx, vy, omega`, then `ax, ay, alpha`, and any of the disturbances; those that
/// are missing stay at `steady` (N, N m).
pub(crate) fn read(path: &Path, steady: [f64; 3]) -> Result<Motion, BadInput> {
    let mut table = Table::open(path)?;
    // Rates count as a group: all three, or none.
    let group = |columns: [&str; 3]| -> Result<Option<[usize; 3]>, BadInput> {
        let mut found = [None; 3];
        for (place, name) in found.iter_mut().zip(columns) {
            *place = table.find(name)?;
        }
        match found {
            [None, None, None] => Ok(None),
            [Some(a), Some(b), Some(c)] => Ok(Some([a, b, c])),
            _ => {
                let names = columns.map(|n| format!("`{n}`")).join(", ");
                Err(table.bad(format!("line 1: expected all or none of the columns {names}")))
            }
        }
    };
    let time = table.need("time")?;
    let mut pose = [0; 3];
    for (place, name) in pose.iter_mut().zip(POSE) {
        *place = table.need(name)?;
    }
    let (twist, acceleration) = (group(TWIST)?, group(ACCELERATION)?);
    if acceleration.is_some() && twist.is_none() {
        return Err(table.bad("line 1: accelerations are given without the columns `vx`, `vy`, `omega`"));
    }
    let disturbance = Disturbances::find(&table, steady)?;
    let mut samples = Samples::default();
    let mut lines = Vec::new();
    while table.next_row()? {
        let three = |columns: [usize; 3]| -> Result<[f64; 3], BadInput> {
            Ok([table.number(columns[0])?, table.number(columns[1])?, table.number(columns[2])?])
        };
        samples.time.push(table.more_than(samples.time.last().copied(), time)?);
        lines.push(table.line());
        samples.pose.push(three(pose)?);
        if let Some(columns) = twist {
            samples.twist.push(three(columns)?);
        }
        if let Some(columns) = acceleration {
            samples.acceleration.push(three(columns)?);
        }
        if !disturbance.are_none() {
            samples.disturbance.push(disturbance.read(&table)?);
        }
    }
    if samples.time.len() < 2 {
        return Err(table.bad(format!("{} rows below the header, expected two or more", samples.time.len())));
    }
    Ok(Motion { samples, lines })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_text(text: &str) -> Result<Motion, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("motion.csv");
        std::fs::write(&path, text).unwrap();
        read(&path, [0.0; 3]).map_err(|error| error.to_string())
    }

    #[test]
    fn columns_are_found_by_name() {
        let text = "phi,time,y,x,disturbance_torque,note\n0.1,0,2,1,9,a\n\n0.2,1,3,2,8,b\n";
        let Motion { samples, lines } = read_text(text).unwrap();
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
