//! One recording.

use cdpr::dynamics::Inputs;

use super::{Channel, Undone};
use crate::outcome::HORIZON;

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
    /// What was taken off the winch forces since they were recorded, as their expected error (N): a series of samples a winch;
    /// empty where they are as recorded.
    pub taken_off: Vec<Vec<f64>>,
    /// What recording did and has been undone, one after the other.
    pub undone: Vec<Undone>,
}

impl Trial {
    /// Number of samples.
    pub fn len(&self) -> usize {
        self.time.len()
    }

    /// Number of the robot's cables, as many as there are winch forces.
    pub fn cables(&self) -> usize {
        self.inputs.first().map_or(0, |inputs| inputs.winch_force.len())
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
            measured: self.measured[range.clone()].to_vec(),
            taken_off: self.taken_off.iter().map(|series| series[range.clone()].to_vec()).collect(),
            undone: self.undone.clone(),
        }
    }

    /// Leaves out channels without a single number.
    pub(crate) fn drop_empty_channels(&mut self) {
        self.keep((0..self.channels.len()).filter(|j| self.measured.iter().any(|row| row[*j].is_finite())).collect());
    }

    /// Leaves out some channels.
    pub(crate) fn drop_channels(&mut self, out: impl Fn(Channel) -> bool) {
        self.keep((0..self.channels.len()).filter(|j| !out(self.channels[*j])).collect());
    }

    /// Leaves out all channels but these.
    fn keep(&mut self, used: Vec<usize>) {
        self.channels = used.iter().map(|j| self.channels[*j]).collect();
        for row in &mut self.measured {
            *row = used.iter().map(|j| row[*j]).collect();
        }
    }

    /// Rows from one number of channel `j` to its next: the median, 1 where there are no two.
    pub(crate) fn stride(&self, j: usize) -> usize {
        let rows: Vec<usize> = (0..self.len()).filter(|k| self.measured[*k][j].is_finite()).collect();
        let mut strides: Vec<usize> = rows.windows(2).map(|pair| pair[1] - pair[0]).collect();
        strides.sort_unstable();
        strides.get(strides.len() / 2).copied().unwrap_or(1)
    }

    /// Median sampling interval (s).
    pub fn interval(&self) -> f64 {
        let mut steps: Vec<f64> = self.time.windows(2).map(|w| w[1] - w[0]).collect();
        steps.sort_by(f64::total_cmp);
        steps.get(steps.len() / 2).copied().unwrap_or(0.0)
    }

    /// Samples at which a free run over `horizon` (s) begins anew: the first after one horizon, and after [`HORIZON`] where that is longer, so
    /// that the filter knows the state by then, but after a fifth of the trial at most. A second after its start it was off by ten times as
    /// much as it thought where friction turned its sign meanwhile.
    pub(crate) fn restarts(&self, horizon: f64) -> Vec<usize> {
        let start = self.time[0];
        let duration = self.time[self.len() - 1] - start;
        let mut next = start + horizon.max(HORIZON).min(0.2 * duration);
        let mut out = Vec::new();
        for (k, time) in self.time.iter().enumerate() {
            if *time >= next {
                out.push(k);
                while next <= *time {
                    next += horizon;
                }
            }
        }
        out
    }
}
