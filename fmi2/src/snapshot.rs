//! A saved FMU state, and the bytes it is serialised to.

use crate::model::{Experiment, Status};
use crate::state::State;

/// Everything that `fmi2SetFMUstate` brings back.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Snapshot {
    pub(crate) progress: Progress,
    /// What [`Model::save`](crate::Model::save) wrote.
    pub(crate) model: Vec<u8>,
}

/// How far an instance has come, as the layer sees it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Progress {
    pub(crate) state: State,
    /// The time reached, s.
    pub(crate) time: f64,
    pub(crate) experiment: Option<Experiment>,
    pub(crate) last_step: LastStep,
}

/// How the last step ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct LastStep {
    pub(crate) status: Status,
    /// The model asked for the end of the simulation.
    pub(crate) terminated: bool,
    pub(crate) message: String,
}

impl Default for Progress {
    fn default() -> Self {
        Self { state: State::Instantiated, time: 0.0, experiment: None, last_step: LastStep::default() }
    }
}

impl Default for LastStep {
    fn default() -> Self {
        Self { status: Status::Ok, terminated: false, message: String::new() }
    }
}

/// Why bytes are not a saved state of this FMU.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(crate) enum SnapshotError {
    #[error("not a saved FMU state: it does not begin with the marker of one")]
    Marker,
    #[error("saved FMU state of format {found}, expected format {FORMAT}")]
    Format { found: u32 },
    #[error("saved FMU state of {found} bytes, expected {expected}")]
    Length { found: usize, expected: usize },
    #[error("saved FMU state is corrupted: checksum {found:016x}, expected {expected:016x}")]
    Checksum { found: u64, expected: u64 },
    #[error("saved FMU state belongs to GUID {found}, this FMU has {expected}")]
    Guid { found: String, expected: String },
    #[error("saved FMU state is corrupted: {0} is not valid")]
    Field(&'static str),
}

const MARKER: [u8; 8] = *b"FMI2SAVE";
const FORMAT: u32 = 1;
/// Marker, format, whole length, checksum.
const HEADER: usize = 8 + 4 + 8 + 8;

// Layout, little endian: marker, format (u32), whole length (u64), checksum of all that follows (u64);
// then GUID, state, time, experiment, last step, model bytes, each text or list after its length (u64).

impl Snapshot {
    /// Length of [`Snapshot::to_bytes`].
    pub(crate) fn byte_len(&self, guid: &str) -> usize {
        // Every option is a flag and a number; every list has a length before it.
        let experiment = 1 + 8 + 9 + 9;
        let last_step = 1 + 1 + 8 + self.progress.last_step.message.len();
        HEADER + (8 + guid.len()) + 1 + 8 + experiment + last_step + 8 + self.model.len()
    }

    pub(crate) fn to_bytes(&self, guid: &str) -> Vec<u8> {
        let progress = &self.progress;
        let mut out = Vec::with_capacity(self.byte_len(guid));
        out.extend(MARKER);
        out.extend(FORMAT.to_le_bytes());
        out.extend((self.byte_len(guid) as u64).to_le_bytes());
        out.extend([0; 8]);
        put_bytes(&mut out, guid.as_bytes());
        out.push(progress.state as u8);
        out.extend(progress.time.to_le_bytes());
        out.push(u8::from(progress.experiment.is_some()));
        let start = progress.experiment.map_or(0.0, |e| e.start_time);
        out.extend(start.to_le_bytes());
        put_option(&mut out, progress.experiment.and_then(|e| e.stop_time));
        put_option(&mut out, progress.experiment.and_then(|e| e.tolerance));
        out.push(progress.last_step.status as u8);
        out.push(u8::from(progress.last_step.terminated));
        put_bytes(&mut out, progress.last_step.message.as_bytes());
        put_bytes(&mut out, &self.model);
        let checksum = fnv1a_64(&out[HEADER..]);
        out[HEADER - 8..HEADER].copy_from_slice(&checksum.to_le_bytes());
        out
    }

    /// Read what [`Snapshot::to_bytes`] wrote, checking all of it.
    pub(crate) fn from_bytes(bytes: &[u8], guid: &str) -> Result<Self, SnapshotError> {
        let mut read = Reader(bytes);
        if read.array() != Some(MARKER) {
            return Err(SnapshotError::Marker);
        }
        let header = |value: Option<u64>| value.ok_or(SnapshotError::Length { found: bytes.len(), expected: HEADER });
        let format = header(read.array().map(|b| u64::from(u32::from_le_bytes(b))))? as u32;
        if format != FORMAT {
            return Err(SnapshotError::Format { found: format });
        }
        let length = header(read.u64())?;
        let expected = header(read.u64())?;
        if length != bytes.len() as u64 {
            return Err(SnapshotError::Length {
                found: bytes.len(),
                expected: usize::try_from(length).unwrap_or(usize::MAX),
            });
        }
        let found = fnv1a_64(read.0);
        if found != expected {
            return Err(SnapshotError::Checksum { found, expected });
        }
        let its_guid = read.text().ok_or(SnapshotError::Field("the GUID"))?;
        if its_guid != guid {
            return Err(SnapshotError::Guid { found: its_guid, expected: guid.to_owned() });
        }
        let progress = read.progress()?;
        let model = read.bytes().ok_or(SnapshotError::Field("the model's part"))?;
        if !read.0.is_empty() {
            return Err(SnapshotError::Field("the end"));
        }
        Ok(Self { progress, model: model.to_vec() })
    }
}

fn put_bytes(out: &mut Vec<u8>, bytes: &[u8]) {
    out.extend((bytes.len() as u64).to_le_bytes());
    out.extend(bytes);
}

fn put_option(out: &mut Vec<u8>, value: Option<f64>) {
    out.push(u8::from(value.is_some()));
    out.extend(value.unwrap_or(0.0).to_le_bytes());
}

/// The bytes not yet read; each method takes one item off the front, or nothing if it is not there.
struct Reader<'a>(&'a [u8]);

impl<'a> Reader<'a> {
    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let (front, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(front)
    }

    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        self.take(N)?.try_into().ok()
    }

    fn u64(&mut self) -> Option<u64> {
        self.array().map(u64::from_le_bytes)
    }

    fn bytes(&mut self) -> Option<&'a [u8]> {
        let length = usize::try_from(self.u64()?).ok()?;
        self.take(length)
    }

    fn text(&mut self) -> Option<String> {
        String::from_utf8(self.bytes()?.to_vec()).ok()
    }

    fn flag(&mut self) -> Option<bool> {
        match self.array()? {
            [0] => Some(false),
            [1] => Some(true),
            _ => None,
        }
    }

    fn finite(&mut self) -> Option<f64> {
        let value = f64::from_le_bytes(self.array()?);
        value.is_finite().then_some(value)
    }

    fn option(&mut self) -> Option<Option<f64>> {
        let there = self.flag()?;
        let value = self.finite()?;
        Some(there.then_some(value))
    }

    fn progress(&mut self) -> Result<Progress, SnapshotError> {
        let state = self.array().and_then(|[number]| State::from_number(number));
        let state = state.ok_or(SnapshotError::Field("the state"))?;
        let time = self.finite().ok_or(SnapshotError::Field("the time"))?;
        let experiment = self.experiment().ok_or(SnapshotError::Field("the experiment"))?;
        let last_step = self.last_step().ok_or(SnapshotError::Field("the last step"))?;
        Ok(Progress { state, time, experiment, last_step })
    }

    fn experiment(&mut self) -> Option<Option<Experiment>> {
        let there = self.flag()?;
        let experiment =
            Experiment { start_time: self.finite()?, stop_time: self.option()?, tolerance: self.option()? };
        let possible = !there || experiment.check().is_ok();
        possible.then(|| there.then_some(experiment))
    }

    fn last_step(&mut self) -> Option<LastStep> {
        let status = match self.array()? {
            [0] => Status::Ok,
            [1] => Status::Warning,
            [2] => Status::Discard,
            _ => return None,
        };
        Some(LastStep { status, terminated: self.flag()?, message: self.text()? })
    }
}

/// 64-bit FNV-1a: finds damage, keeps nobody out.
fn fnv1a_64(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, &byte| (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3))
}

#[cfg(test)]
mod tests {
    use super::*;

    const GUID: &str = "{guid}";

    fn snapshot() -> Snapshot {
        Snapshot {
            progress: Progress {
                state: State::StepFailed,
                time: 0.1 + 0.2,
                experiment: Some(Experiment { start_time: -1.0, stop_time: Some(10.0), tolerance: None }),
                last_step: LastStep {
                    status: Status::Discard,
                    terminated: true,
                    message: "stopped at the wall".into(),
                },
            },
            model: vec![0, 1, 2, 255],
        }
    }

    #[test]
    fn reads_back_bit_for_bit() {
        let bytes = snapshot().to_bytes(GUID);
        assert_eq!(bytes.len(), snapshot().byte_len(GUID));
        assert_eq!(Snapshot::from_bytes(&bytes, GUID), Ok(snapshot()));
        let fresh = Snapshot { progress: Progress::default(), model: Vec::new() };
        let bytes = fresh.to_bytes(GUID);
        assert_eq!(Snapshot::from_bytes(&bytes, GUID), Ok(fresh));
    }

    #[test]
    fn every_damaged_byte_and_every_cut_is_found() {
        let bytes = snapshot().to_bytes(GUID);
        for at in 0..bytes.len() {
            let mut damaged = bytes.clone();
            damaged[at] ^= 0x10;
            assert!(Snapshot::from_bytes(&damaged, GUID).is_err(), "byte {at}");
            assert!(Snapshot::from_bytes(&bytes[..at], GUID).is_err(), "cut {at}");
        }
        let mut longer = bytes.clone();
        longer.push(0);
        let length = Snapshot::from_bytes(&longer, GUID).unwrap_err();
        assert!(matches!(length, SnapshotError::Length { .. }), "{length}");
    }

    #[test]
    fn other_formats_and_other_fmus_are_named() {
        let mut bytes = snapshot().to_bytes(GUID);
        let other = Snapshot::from_bytes(&bytes, "{other}").unwrap_err();
        assert!(matches!(other, SnapshotError::Guid { .. }), "{other}");
        bytes[8] = 2;
        assert_eq!(Snapshot::from_bytes(&bytes, GUID), Err(SnapshotError::Format { found: 2 }));
    }

    #[test]
    fn an_experiment_that_could_not_be_set_up_is_refused() {
        for (stop_time, tolerance) in [(Some(-2.0), None), (None, Some(0.0)), (None, Some(-1e-6))] {
            let mut saved = snapshot();
            saved.progress.experiment = Some(Experiment { start_time: -1.0, stop_time, tolerance });
            let found = Snapshot::from_bytes(&saved.to_bytes(GUID), GUID);
            assert_eq!(found, Err(SnapshotError::Field("the experiment")));
        }
    }

    #[test]
    fn a_right_checksum_over_wrong_fields_does_not_help() {
        let mut bytes = snapshot().to_bytes(GUID);
        let state_at = HEADER + 8 + GUID.len();
        bytes[state_at] = 3;
        let checksum = fnv1a_64(&bytes[HEADER..]);
        bytes[HEADER - 8..HEADER].copy_from_slice(&checksum.to_le_bytes());
        assert_eq!(Snapshot::from_bytes(&bytes, GUID), Err(SnapshotError::Field("the state")));
    }
}
