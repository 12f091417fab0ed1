//! Measured data: CSV files with inputs and any of the measured channels.

pub(crate) mod bursts;
mod channel;
pub(crate) mod clean;
pub(crate) mod clock;
pub(crate) mod counts;
pub(crate) mod device;
pub(crate) mod filtered;
pub(crate) mod held;
pub(crate) mod holes;
pub(crate) mod line;
pub(crate) mod lost_forces;
mod map;
mod read;
mod ready;
mod recorder;
#[cfg(test)]
pub(crate) mod recording;
mod text;
mod trial;
pub(crate) mod turns;
mod undone;
mod units;
pub(crate) mod wraps;

use std::path::PathBuf;

pub use channel::Channel;
pub use map::ColumnMap;
pub use read::{read_kinematics, read_trial};
pub(crate) use ready::make_ready;
pub use recorder::Recorder;
pub use text::Lines;
pub use trial::Trial;
pub use undone::Undone;

/// Least samples of a recording.
const FEWEST: usize = 50;

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
