//! The winch commands of the recent past, for winches with a dead time.

use std::collections::VecDeque;

use crate::per_cable::PerCable;
use crate::plant::Plant;

/// A stretch of commands, linear in time from `start` on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stretch {
    pub(super) start: f64,
    pub(super) value: PerCable<f64>,
    pub(super) slope: PerCable<f64>,
}

/// Commands back to the longest dead time. Before the first stretch the command is its start value.
#[derive(Clone, Debug)]
pub(super) struct CommandHistory {
    delay: PerCable<f64>,
    longest: f64,
    pub(super) stretches: VecDeque<Stretch>,
}

/// Room for commands at 1 ms over 1 s of dead time before the queue grows.
const CAPACITY: usize = 1024;

impl CommandHistory {
    pub(super) fn new(plant: &Plant, time: f64, value: PerCable<f64>) -> Self {
        let delay = PerCable::from_fn(plant.cables(), |i| plant.cable[i].delay);
        let longest = delay.iter().copied().fold(0.0, f64::max);
        let mut stretches = VecDeque::with_capacity(if longest > 0.0 { CAPACITY } else { 1 });
        stretches.push_back(Stretch { start: time, value, slope: value.map(|_| 0.0) });
        Self { delay, longest, stretches }
    }

    /// Commands from `time` on.
    pub(super) fn push(&mut self, time: f64, value: PerCable<f64>, slope: PerCable<f64>) {
        if self.longest == 0.0 {
            return;
        }
        let stretch = Stretch { start: time, value, slope };
        // The very first stretch also stands for the time before it, so it is never replaced.
        if self.stretches.len() > 1 && self.stretches.back().is_some_and(|last| last.start == time) {
            self.stretches.pop_back();
        }
        self.stretches.push_back(stretch);
        while self.stretches.len() > 1 && self.stretches[1].start <= time - self.longest {
            self.stretches.pop_front();
        }
    }

    /// The next time after `time` at which a delayed command changes.
    pub(super) fn next_change(&self, time: f64) -> Option<f64> {
        if self.longest == 0.0 {
            return None;
        }
        let mut next: Option<f64> = None;
        for delay in self.delay.iter().filter(|d| **d > 0.0) {
            // A change counts as past within rounding, so that no stretch of no length is taken.
            let late = time + 1e-12 * time.abs().max(1e-3);
            let change = self.stretches.iter().map(|s| s.start + delay).find(|t| *t > late);
            next = match (next, change) {
                (Some(a), Some(b)) => Some(a.min(b)),
                (a, b) => a.or(b),
            };
        }
        next
    }

    /// Replaces the commands of winches with a dead time by what they were that long ago.
    pub(super) fn delay(&self, time: f64, value: &mut PerCable<f64>, slope: &mut PerCable<f64>) {
        if self.longest == 0.0 {
            return;
        }
        for i in (0..value.len()).filter(|i| self.delay[*i] > 0.0) {
            let then = time - self.delay[i];
            let late = then + 1e-12 * time.abs().max(1e-3);
            match self.stretches.iter().rev().find(|s| s.start <= late) {
                Some(s) => {
                    value[i] = s.value[i] + s.slope[i] * (then - s.start);
                    slope[i] = s.slope[i];
                }
                None => {
                    value[i] = self.stretches[0].value[i];
                    slope[i] = 0.0;
                }
            }
        }
    }
}
