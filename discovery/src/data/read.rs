//! Reading of recordings.

use std::path::Path;

use cdpr::dynamics::Inputs;
use cdpr::per_cable::MAX_CABLES;
use csv::StringRecord;

use super::map::{Source, known_columns};
use super::{Channel, ColumnMap, DataError, FEWEST, Lines, Trial, clock};

/// What is wrong, and in which line.
type Wrong = (Option<u64>, String);

/// Reads one recording of a robot with so many cables.
///
/// # Errors
/// Missing columns, one twice, or of a cable that the robot does not have; cells that are no numbers, time that does not increase, gaps in the inputs: with the line.
pub fn read_trial(path: &Path, map: &ColumnMap, cables: usize) -> Result<Trial, DataError> {
    read(path, map, cables, Forces::Needed).map_err(|wrong| bad_data(path, wrong))
}

/// Reads one recording of which the kinematics are wanted alone: winch forces (N) that were not recorded are `NAN`.
///
/// # Errors
/// As [`read_trial`], but for winch forces of which there is no column.
pub fn read_kinematics(path: &Path, map: &ColumnMap, cables: usize) -> Result<Trial, DataError> {
    read(path, map, cables, Forces::MayLack).map_err(|wrong| bad_data(path, wrong))
}

fn bad_data(path: &Path, (line, message): Wrong) -> DataError {
    DataError { path: path.to_owned(), line, message }
}

/// Whether winch forces must be in a recording.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Forces {
    Needed,
    MayLack,
}

fn read(path: &Path, map: &ColumnMap, cables: usize, forces: Forces) -> Result<Trial, Wrong> {
    let whole = |message: String| (None, message);
    let file = Lines::open(path).map_err(|e| whole(e.to_string()))?;
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).from_reader(file);
    let header = reader.headers().map_err(|e| ((!e.is_io_error()).then_some(1), e.to_string()))?.clone();
    let columns = Columns::find(&header, map, cables, forces).map_err(|message| (Some(1), message))?;
    let mut trial = Trial {
        name: path.display().to_string(),
        time: Vec::new(),
        inputs: Vec::new(),
        channels: columns.channels.iter().map(|(c, _)| *c).collect(),
        measured: Vec::new(),
        taken_off: Vec::new(),
        undone: Vec::new(),
    };
    let mut record = StringRecord::new();
    loop {
        match reader.read_record(&mut record) {
            Ok(false) => break,
            Ok(true) => {}
            Err(e) => {
                let line = e.position().map(csv::Position::line);
                return Err((line, format!("not readable as CSV: {e}")));
            }
        }
        let line = record.position().map(csv::Position::line);
        columns.row(&record, &mut trial).map_err(|message| (line, message))?;
    }
    if trial.len() < FEWEST {
        return Err(whole(format!("{} samples, expected {FEWEST} or more", trial.len())));
    }
    trial.drop_empty_channels();
    check_observable(&trial).map_err(whole)?;
    Ok(trial)
}

/// A column of the file that is one of ours.
struct Column {
    at: usize,
    source: Source,
}

impl Column {
    /// Our column `name` in a file, if it is there.
    fn find(header: &StringRecord, map: &ColumnMap, name: &str) -> Result<Option<Self>, String> {
        let source = map.source(name);
        let mut places = (0..header.len()).filter(|at| header[*at].trim_matches('"') == source.column);
        match (places.next(), places.next()) {
            (Some(_), Some(_)) => Err(format!("column `{}` is there twice, expected once", source.column)),
            (at, _) => Ok(at.map(|at| Self { at, source })),
        }
    }

    fn needed(header: &StringRecord, map: &ColumnMap, name: &str, unit: &str) -> Result<Self, String> {
        // Spreadsheets of countries with a decimal comma separate cells by semicolons.
        let hint = match header.get(0) {
            Some(only) if header.len() == 1 && only.contains(';') => {
                "; the cells are separated by semicolons, expected commas and decimal points"
            }
            Some(only) if header.len() == 1 && only.contains('\t') => {
                "; the cells are separated by tabs, expected commas"
            }
            _ => "",
        };
        Self::find(header, map, name)?.ok_or_else(|| {
            let of = if map.source(name).column == name { String::new() } else { format!("`{name}`, ") };
            let found = header.iter().collect::<Vec<_>>().join(", ");
            format!("no column `{}` ({of}{unit}); found {found}{hint}", map.source(name).column)
        })
    }

    /// The cell's value in our unit; `NAN` where it is empty.
    fn value(&self, record: &StringRecord) -> Result<f64, String> {
        let text = record.get(self.at).unwrap_or("");
        if text.is_empty() || text.eq_ignore_ascii_case("nan") {
            return Ok(f64::NAN);
        }
        let column = &self.source.column;
        let value: f64 = text.parse().map_err(|_| format!("column `{column}` is {text:?}, expected a number"))?;
        let ours = self.source.scale * value + self.source.offset;
        if !ours.is_finite() {
            return Err(format!("column `{column}` is {text}, expected a finite number"));
        }
        Ok(ours)
    }

    /// The cell's value where there must be one.
    fn full(&self, record: &StringRecord) -> Result<f64, String> {
        match self.value(record)? {
            value if value.is_nan() => Err(format!("column `{}` is empty, expected a number", self.source.column)),
            value => Ok(value),
        }
    }

    /// A time (s): a number, or a date and time of day, which counts from 1970.
    fn time(&self, record: &StringRecord) -> Result<f64, String> {
        let text = record.get(self.at).unwrap_or("");
        match clock::seconds_since_1970(text) {
            Some(_) if self.source.scale != 1.0 => Err(format!(
                "column `{}` is {text:?}, a date: expected no unit and no scale for it",
                self.source.column
            )),
            Some(seconds) => Ok(seconds + self.source.offset),
            None => self.full(record).map_err(|message| match text {
                "" => message,
                _ => format!("{message} of seconds, or a date and time as 2026-05-04T10:20:30.125Z"),
            }),
        }
    }
}

/// The columns of a file.
struct Columns {
    time: Column,
    forces: Vec<Option<Column>>,
    disturbances: Vec<Option<Column>>,
    channels: Vec<(Channel, Column)>,
}

impl Columns {
    fn find(header: &StringRecord, map: &ColumnMap, cables: usize, needed: Forces) -> Result<Self, String> {
        let time = Column::needed(header, map, "time", "time in s")?;
        let find = |name: &str| Column::find(header, map, name);
        let force = |i: usize| {
            let name = format!("winch_force[{i}]");
            match needed {
                Forces::Needed => Column::needed(header, map, &name, "N").map(Some),
                Forces::MayLack => find(&name),
            }
        };
        let forces = (1..=cables).map(force).collect::<Result<_, _>>()?;
        let disturbances = ["disturbance_force_x", "disturbance_force_y", "disturbance_torque"].map(find);
        let mut channels = Vec::new();
        for channel in Channel::all(cables) {
            if let Some(column) = find(&channel.name())? {
                channels.push((channel, column));
            }
        }
        let more = Channel::all(MAX_CABLES).into_iter().map(Channel::name);
        let more = more.chain((1..=MAX_CABLES).map(|i| format!("winch_force[{i}]")));
        let known = known_columns(cables);
        for name in more.filter(|name| !known.contains(name)) {
            if find(&name)?.is_some() {
                return Err(format!(
                    "column `{name}` is of a cable that the model does not have: it has {cables}; give the model of the \
                     recorded robot, or the column another name"
                ));
            }
        }
        for name in map.names() {
            if find(name)?.is_none() {
                return Err(format!("no column `{}`, which the map gives for `{name}`", map.source(name).column));
            }
        }
        let disturbances = disturbances.into_iter().collect::<Result<_, _>>()?;
        Ok(Self { time, forces, disturbances, channels })
    }

    /// Adds a row to a trial.
    fn row(&self, record: &StringRecord, trial: &mut Trial) -> Result<(), String> {
        let time = self.time.time(record)?;
        if let Some(last) = trial.time.last()
            && time <= *last
        {
            return Err(format!("time is {time}, expected more than {last} in the row before"));
        }
        let mut inputs = Inputs::none(self.forces.len());
        for (slot, column) in inputs.winch_force.iter_mut().zip(&self.forces) {
            *slot = column.as_ref().map_or(Ok(f64::NAN), |column| column.full(record))?;
        }
        for (slot, column) in inputs.disturbance.iter_mut().zip(&self.disturbances) {
            if let Some(column) = column {
                *slot = column.full(record)?;
            }
        }
        let row = self.channels.iter().map(|(_, column)| column.value(record)).collect::<Result<_, _>>()?;
        trial.time.push(time);
        trial.inputs.push(inputs);
        trial.measured.push(row);
        Ok(())
    }
}

/// Three independent measurements of the platform are needed; what the cables do follows from the inputs.
pub(super) fn check_observable(trial: &Trial) -> Result<(), String> {
    let has = |wanted: fn(&Channel) -> bool| trial.channels.iter().filter(|c| wanted(c)).count();
    let pose = has(|c| matches!(c, Channel::Pose(_)));
    let lengths = has(|c| matches!(c, Channel::CableLength(_)));
    let unstretched = has(|c| matches!(c, Channel::UnstretchedLength(_)));
    if pose + lengths >= 3 || pose + unstretched >= 3 {
        return Ok(());
    }
    Err(format!(
        "the pose cannot be estimated: found {pose} of x, y, phi, {lengths} cable_length and {unstretched} \
         unstretched_length columns; expected x, y and phi, or three columns of these together"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "time,winch_force[1],winch_force[2],winch_force[3],winch_force[4],x,y,phi";

    /// A recording of 60 rows, each made from its number.
    fn table(header: &str, row: impl Fn(usize) -> String) -> Result<Trial, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.csv");
        let rows: String = (0..60).map(|k| row(k) + "\n").collect();
        std::fs::write(&path, format!("{header}\n{rows}")).unwrap();
        read_trial(&path, &ColumnMap::default(), 4).map_err(|e| e.to_string())
    }

    #[test]
    fn a_column_that_is_there_twice_is_refused() {
        let error = table(&format!("{HEADER},phi"), |k| format!("{k},1,1,1,1,0,0,0,1")).unwrap_err();
        assert!(error.ends_with("run.csv, line 1: column `phi` is there twice, expected once"), "{error}");
        // One that is not ours may be there as often as it likes.
        assert!(table(&format!("{HEADER},note,note"), |k| format!("{k},1,1,1,1,0,0,0,a,b")).is_ok());
    }

    #[test]
    fn a_column_of_a_cable_that_the_model_does_not_have_is_refused() {
        let error = table(&format!("{HEADER},winch_force[5]"), |k| format!("{k},1,1,1,1,0,0,0,1")).unwrap_err();
        assert!(error.contains("line 1: column `winch_force[5]` is of a cable that the model does not have: it has 4"));
    }

    #[test]
    fn times_may_be_dates() {
        let row = |k: usize| format!("2026-05-04T10:59:{:02}.250Z,1,1,1,1,0,0,0", k);
        let trial = table(HEADER, row).unwrap();
        assert_eq!(trial.time[59] - trial.time[0], 59.0);
        let error = table(HEADER, |k| format!("4.5.2026 10:20:{k:02},1,1,1,1,0,0,0")).unwrap_err();
        assert!(
            error.contains("line 2: column `time` is \"4.5.2026 10:20:00\", expected a number of seconds, or a date")
        );
    }

    /// A take of motion capture has no forces.
    #[test]
    fn kinematics_need_no_forces() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("take.csv");
        let rows: String = (0..60).map(|k| format!("{k},0,0,0,7\n")).collect();
        std::fs::write(&path, format!("time,x,y,phi,winch_force[2]\n{rows}")).unwrap();
        let trial = read_kinematics(&path, &ColumnMap::default(), 4).unwrap();
        let forces = &trial.inputs[9].winch_force;
        assert!(forces[1] == 7.0 && [0, 2, 3].iter().all(|i| forces[*i].is_nan()), "{forces:?}");
        let error = read_trial(&path, &ColumnMap::default(), 4).unwrap_err().to_string();
        assert!(error.contains("no column `winch_force[1]` (N)"), "{error}");
    }

    #[test]
    fn a_channel_without_a_number_is_not_there() {
        let trial = table(&format!("{HEADER},tension[1]"), |k| format!("{k},1,1,1,1,0,0,0,")).unwrap();
        assert_eq!(trial.channels.len(), 3);
        let error = table(HEADER, |k| format!("{k},1,1,1,1,0,0,nan")).unwrap_err();
        assert!(error.contains("the pose cannot be estimated: found 2 of x, y, phi"), "{error}");
    }
}
