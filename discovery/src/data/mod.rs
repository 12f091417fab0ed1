//! Measured data: CSV files with inputs and any of the measured channels.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use cdpr::dynamics::Inputs;
use serde::Deserialize;

pub(crate) mod clean;
#[cfg(test)]
pub(crate) mod recording;

/// A measured quantity. Cables count from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Channel {
    /// `x`, `y` (m), `phi` (rad): 0, 1, 2.
    Pose(usize),
    /// `cable_length[i]` (m).
    CableLength(usize),
    /// `unstretched_length[i]` (m).
    UnstretchedLength(usize),
    /// `tension[i]` (N).
    Tension(usize),
}

impl Channel {
    /// Every channel that can be measured.
    pub fn all() -> Vec<Self> {
        let mut all: Vec<Self> = (0..3).map(Self::Pose).collect();
        all.extend((0..4).map(Self::CableLength));
        all.extend((0..4).map(Self::UnstretchedLength));
        all.extend((0..4).map(Self::Tension));
        all
    }

    /// The FMU's name of it.
    pub fn name(self) -> String {
        match self {
            Self::Pose(k) => ["x", "y", "phi"][k].to_owned(),
            Self::CableLength(i) => format!("cable_length[{}]", i + 1),
            Self::UnstretchedLength(i) => format!("unstretched_length[{}]", i + 1),
            Self::Tension(i) => format!("tension[{}]", i + 1),
        }
    }

    /// Its SI unit.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Pose(2) => "rad",
            Self::Tension(_) => "N",
            _ => "m",
        }
    }

    /// Smallest noise assumed (in its unit), so that data without noise do not make the filter singular.
    pub(crate) fn noise_floor(self) -> f64 {
        match self {
            Self::Pose(2) => 1e-8,
            Self::Tension(_) => 1e-2,
            _ => 1e-6,
        }
    }
}

/// One recording: samples at strictly increasing times, inputs held between samples.
#[derive(Clone, Debug)]
pub struct Trial {
    /// Where it was read from.
    pub name: String,
    /// Times (s).
    pub time: Vec<f64>,
    /// Inputs from each sample to the next.
    pub inputs: Vec<Inputs>,
    /// The channels that are present.
    pub channels: Vec<Channel>,
    /// Measurements, a row a sample in the order of `channels`; `NAN` is a gap.
    pub measured: Vec<Vec<f64>>,
}

impl Trial {
    /// Number of samples.
    pub fn len(&self) -> usize {
        self.time.len()
    }

    /// Whether there is no sample.
    pub fn is_empty(&self) -> bool {
        self.time.is_empty()
    }

    /// The samples `range` as a trial of their own.
    pub fn part(&self, range: std::ops::Range<usize>, name: String) -> Self {
        Self {
            name,
            time: self.time[range.clone()].to_vec(),
            inputs: self.inputs[range.clone()].to_vec(),
            channels: self.channels.clone(),
            measured: self.measured[range].to_vec(),
        }
    }

    /// Median sampling interval (s).
    pub fn interval(&self) -> f64 {
        let mut steps: Vec<f64> = self.time.windows(2).map(|w| w[1] - w[0]).collect();
        steps.sort_by(f64::total_cmp);
        steps.get(steps.len() / 2).copied().unwrap_or(0.0)
    }
}

/// A file that cannot be used as measured data.
#[derive(Debug, thiserror::Error)]
#[error("{}{}: {message}", path.display(), line.map_or(String::new(), |l| format!(", line {l}")))]
pub struct DataError {
    /// The file.
    pub path: PathBuf,
    /// Line, from 1, where it is known.
    pub line: Option<u64>,
    /// What was found and what was expected.
    pub message: String,
}

/// Where one of our columns comes from in a file from elsewhere.
#[derive(Clone, Debug, Deserialize)]
#[serde(untagged)]
enum MapEntry {
    Name(String),
    Full(FullEntry),
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct FullEntry {
    column: String,
    unit: Option<String>,
    scale: Option<f64>,
    offset: Option<f64>,
}

/// Renames columns and converts units: our name to `(their column, scale, offset)`.
///
/// ```toml
/// time = { column = "t_ms", unit = "ms" }
/// x = { column = "pos_x", unit = "mm" }
/// "winch_force[1]" = { column = "F1", unit = "kN" }
/// "tension[1]" = { column = "LC1", scale = 9.80665, offset = -12.0 }
/// y = "pos_y"
/// ```
///
/// The value used is `scale · theirs + offset`; `unit` stands for the scale that makes it SI.
#[derive(Clone, Debug, Default)]
pub struct ColumnMap(BTreeMap<String, (String, f64, f64)>);

const UNITS: [(&str, f64); 16] = [
    ("m", 1.0),
    ("mm", 1e-3),
    ("cm", 1e-2),
    ("km", 1e3),
    ("ft", 0.3048),
    ("rad", 1.0),
    ("mrad", 1e-3),
    ("deg", std::f64::consts::PI / 180.0),
    ("N", 1.0),
    ("kN", 1e3),
    ("lbf", 4.448_221_615_260_5),
    ("N.m", 1.0),
    ("kN.m", 1e3),
    ("s", 1.0),
    ("ms", 1e-3),
    ("us", 1e-6),
];

fn known_columns() -> Vec<String> {
    let mut names = vec!["time".to_owned()];
    names.extend((1..=4).map(|i| format!("winch_force[{i}]")));
    names.extend(["disturbance_force_x", "disturbance_force_y", "disturbance_torque"].map(str::to_owned));
    names.extend(Channel::all().iter().map(|c| c.name()));
    names
}

impl ColumnMap {
    /// Reads a map file.
    ///
    /// # Errors
    /// Syntax, unknown names or units, with what was found and expected.
    pub fn read(path: &Path) -> Result<Self, DataError> {
        let error = |line, message| DataError { path: path.to_owned(), line, message };
        let text = std::fs::read_to_string(path).map_err(|e| error(None, e.to_string()))?;
        let entries: BTreeMap<String, MapEntry> = toml::from_str(&text).map_err(|e| {
            let line = e.span().map(|s| text.as_bytes()[..s.start].iter().filter(|b| **b == b'\n').count() as u64 + 1);
            error(line, e.message().to_owned())
        })?;
        let known = known_columns();
        let mut map = BTreeMap::new();
        for (name, entry) in entries {
            if !known.contains(&name) {
                return Err(error(
                    None,
                    format!("`{name}` is no column of ours, expected one of {}", known.join(", ")),
                ));
            }
            let (column, scale, offset) = match entry {
                MapEntry::Name(column) => (column, 1.0, 0.0),
                MapEntry::Full(full) => {
                    let unit = match &full.unit {
                        None => 1.0,
                        Some(unit) => {
                            UNITS.iter().find(|(known, _)| known == unit).map(|(_, scale)| *scale).ok_or_else(|| {
                                let names: Vec<&str> = UNITS.iter().map(|(n, _)| *n).collect();
                                error(
                                    None,
                                    format!("unit of `{name}` is {unit:?}, expected one of {}", names.join(", ")),
                                )
                            })?
                        }
                    };
                    (full.column, unit * full.scale.unwrap_or(1.0), full.offset.unwrap_or(0.0))
                }
            };
            map.insert(name, (column, scale, offset));
        }
        Ok(Self(map))
    }

    fn source(&self, name: &str) -> (String, f64, f64) {
        self.0.get(name).cloned().unwrap_or_else(|| (name.to_owned(), 1.0, 0.0))
    }
}

/// Reads one recording.
///
/// # Errors
/// Missing columns, cells that are no numbers, time that does not increase, gaps in the inputs: with the line.
pub fn read_trial(path: &Path, map: &ColumnMap) -> Result<Trial, DataError> {
    let error = |line: Option<u64>, message: String| DataError { path: path.to_owned(), line, message };
    let file = std::fs::File::open(path).map_err(|e| error(None, e.to_string()))?;
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).from_reader(file);
    let header = reader.headers().map_err(|e| error(Some(1), e.to_string()))?.clone();
    let find = |name: &str| {
        let (column, scale, offset) = map.source(name);
        let at = header.iter().position(|h| h.trim_matches('"') == column);
        at.map(|at| (at, scale, offset)).ok_or(column)
    };
    let time_at = find("time").map_err(|c| {
        // Spreadsheets of countries with a decimal comma separate cells by semicolons.
        let hint = if header.len() == 1 && header[0].contains(';') {
            "; the cells are separated by semicolons, expected commas and decimal points"
        } else {
            ""
        };
        error(Some(1), format!("no column `{c}` (time in s); found {}{hint}", list(&header)))
    })?;
    let mut forces = Vec::new();
    for i in 1..=4 {
        let name = format!("winch_force[{i}]");
        forces.push(find(&name).map_err(|c| error(Some(1), format!("no column `{c}` (N); found {}", list(&header))))?);
    }
    let disturbances = ["disturbance_force_x", "disturbance_force_y", "disturbance_torque"].map(|name| find(name).ok());
    let present: Vec<(Channel, (usize, f64, f64))> =
        Channel::all().into_iter().filter_map(|c| find(&c.name()).ok().map(|at| (c, at))).collect();
    for name in map.0.keys() {
        if let Err(column) = find(name) {
            return Err(error(Some(1), format!("no column `{column}`, which the map gives for `{name}`")));
        }
    }
    let mut trial = Trial {
        name: path.display().to_string(),
        time: Vec::new(),
        inputs: Vec::new(),
        channels: present.iter().map(|(c, _)| *c).collect(),
        measured: Vec::new(),
    };
    let mut record = csv::StringRecord::new();
    loop {
        match reader.read_record(&mut record) {
            Ok(false) => break,
            Ok(true) => {}
            Err(e) => {
                let line = e.position().map(csv::Position::line);
                return Err(error(line, format!("not readable as CSV: {e}")));
            }
        }
        let line = record.position().map(csv::Position::line);
        let cell = |(at, scale, offset): (usize, f64, f64)| -> Result<f64, DataError> {
            let text = record.get(at).unwrap_or("");
            if text.is_empty() || text.eq_ignore_ascii_case("nan") {
                return Ok(f64::NAN);
            }
            let value: f64 = text.parse().map_err(|_| {
                error(line, format!("column `{}` is {text:?}, expected a number", header.get(at).unwrap_or("")))
            })?;
            if value.is_infinite() {
                return Err(error(line, format!("column `{}` is {text}, expected a finite number", &header[at])));
            }
            Ok(scale * value + offset)
        };
        let time = cell(time_at)?;
        if let Some(last) = trial.time.last()
            && time <= *last
        {
            return Err(error(line, format!("time is {time}, expected more than {last} in the row before")));
        }
        let needed = |at: (usize, f64, f64)| {
            let value = cell(at)?;
            if value.is_nan() {
                return Err(error(line, format!("column `{}` is empty, expected a number", &header[at.0])));
            }
            Ok(value)
        };
        needed(time_at)?;
        let mut inputs = Inputs::none(forces.len());
        for (slot, at) in inputs.winch_force.iter_mut().zip(&forces) {
            *slot = needed(*at)?;
        }
        for (slot, at) in inputs.disturbance.iter_mut().zip(&disturbances) {
            if let Some(at) = at {
                *slot = needed(*at)?;
            }
        }
        let row = present.iter().map(|(_, at)| cell(*at)).collect::<Result<Vec<f64>, _>>()?;
        trial.time.push(time);
        trial.inputs.push(inputs);
        trial.measured.push(row);
    }
    if trial.len() < 50 {
        return Err(error(None, format!("{} samples, expected 50 or more", trial.len())));
    }
    // A channel without a single number is not there.
    let used: Vec<usize> =
        (0..trial.channels.len()).filter(|j| trial.measured.iter().any(|row| row[*j].is_finite())).collect();
    trial.channels = used.iter().map(|j| trial.channels[*j]).collect();
    for row in &mut trial.measured {
        *row = used.iter().map(|j| row[*j]).collect();
    }
    check_observable(&trial).map_err(|message| error(None, message))?;
    Ok(trial)
}

fn list(header: &csv::StringRecord) -> String {
    header.iter().collect::<Vec<_>>().join(", ")
}

/// Three independent measurements of the platform are needed; what the cables do follows from the inputs.
fn check_observable(trial: &Trial) -> Result<(), String> {
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
