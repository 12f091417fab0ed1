//! The winch commands of the recent past, for winches with a dead time.

use std::collections::VecDeque;

use crate::dynamics::Inputs;
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

/// How much two instants that are meant to be the same may differ (s): what thousands of sums leave, but no more than a
/// thousandth of the dead time, which at the times of Unix stamps would else be lost in it, and no less than a sum leaves.
fn rounding(time: f64, delay: f64) -> f64 {
    let size = time.abs().max(1e-3);
    (1e-12 * size).min(1e-3 * delay).max(4.0 * f64::EPSILON * size)
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

    /// Whether a command comes late somewhere.
    pub(super) fn delayed(&self) -> bool {
        self.longest > 0.0
    }

    /// Inputs from `time` on, and their slopes.
    #[inline]
    pub(super) fn push(&mut self, time: f64, inputs: &Inputs, slopes: &Inputs) {
        if self.delayed() {
            self.note(Stretch { start: time, value: inputs.winch_force, slope: slopes.winch_force });
        }
    }

    fn note(&mut self, stretch: Stretch) {
        let time = stretch.start;
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
        if !self.delayed() {
            return None;
        }
        let mut next: Option<f64> = None;
        for delay in self.delay.iter().filter(|d| **d > 0.0) {
            // A change counts as past within rounding, so that no stretch of no length is taken.
            let late = time + rounding(time, *delay);
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
        if !self.delayed() {
            return;
        }
        for i in (0..value.len()).filter(|i| self.delay[*i] > 0.0) {
            let then = time - self.delay[i];
            let late = then + rounding(time, self.delay[i]);
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A command that rises from 1 to 2 N at `begin`, seen through a dead time.
    fn history(begin: f64, delay: f64) -> CommandHistory {
        let of_all = |value: f64| PerCable::from_fn(4, |_| value);
        let stretch = |start: f64, value: f64| Stretch { start, value: of_all(value), slope: of_all(0.0) };
        let stretches = VecDeque::from([stretch(begin - 1.0, 1.0), stretch(begin, 2.0)]);
        CommandHistory { delay: of_all(delay), longest: delay, stretches }
    }

    #[test]
    fn short_dead_times_are_kept_at_unix_time_stamps() {
        for (begin, delay) in [(0.5, 1e-3), (1.7e9, 1e-3), (1.7e9, 0.05)] {
            let history = history(begin, delay);
            let seen = |time: f64| {
                let (mut value, mut slope) = (PerCable::from_fn(4, |_| 0.0), PerCable::from_fn(4, |_| 0.0));
                history.delay(time, &mut value, &mut slope);
                value[0]
            };
            assert_eq!(history.next_change(begin), Some(begin + delay), "{begin} {delay}");
            assert_eq!(seen(begin + 0.9 * delay), 1.0, "{begin} {delay}");
            // The change itself is past, rounding or not.
            assert_eq!(seen(begin + delay), 2.0, "{begin} {delay}");
            assert_eq!(history.next_change(begin + delay), None, "{begin} {delay}");
        }
    }
}
