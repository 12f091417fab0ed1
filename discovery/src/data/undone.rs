//! What recording did and has been undone.

use super::{Recorder, Trial};

/// Something that recording does, to all recordings alike.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Undone {
    /// It makes the winch forces late and smooth.
    Forces(Recorder),
    /// Its clock is slow: more time passes than the stamps say, by this share of it.
    Clock(f64),
}

impl Undone {
    /// The recorder of the winch forces, of all that has been undone in recordings.
    pub(crate) fn recorder(trials: &[Trial]) -> Recorder {
        let of = |recorder: Recorder, undone: &Self| match undone {
            Self::Forces(behind) => recorder.behind(*behind),
            Self::Clock(_) => recorder,
        };
        Self::of(trials).iter().fold(Recorder::default(), of)
    }

    /// By which share the clock of recordings was slow, of all that has been undone in them.
    pub(crate) fn slow_clock(trials: &[Trial]) -> f64 {
        let of = |pace: f64, undone: &Self| match undone {
            Self::Forces(_) => pace,
            Self::Clock(slow) => pace * (1.0 + slow),
        };
        Self::of(trials).iter().fold(1.0, of) - 1.0
    }

    /// One after the other, of the same kind.
    pub(crate) fn and(self, other: Self) -> Self {
        match (self, other) {
            (Self::Forces(recorder), Self::Forces(behind)) => Self::Forces(recorder.behind(behind)),
            (Self::Clock(slow), Self::Clock(more)) => Self::Clock((1.0 + slow) * (1.0 + more) - 1.0),
            (_, other) => other,
        }
    }

    fn of(trials: &[Trial]) -> &[Self] {
        trials.first().map_or(&[], |trial| &trial.undone)
    }
}

impl Trial {
    /// The same as it was before recording did so.
    pub(crate) fn before(&self, undone: Undone) -> Self {
        let mut before = match undone {
            Undone::Forces(recorder) => self.with_forces_before(recorder),
            Undone::Clock(slow) => {
                let mut trial = self.clone();
                trial.time.iter_mut().for_each(|time| *time *= 1.0 + slow);
                trial
            }
        };
        before.undone.push(undone);
        before
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::recording::record;

    /// Delays and variances add up, and what passes for each second of the stamps multiplies.
    #[test]
    fn what_has_been_undone_adds_up() {
        let trial = record(&[], 10.0, 5);
        let recorder = Recorder { delay: 0.01, variance: 1e-4 };
        let all = [Undone::Clock(0.01), Undone::Forces(recorder), Undone::Clock(0.02), Undone::Forces(recorder)];
        let before = [all.into_iter().fold(trial.clone(), |trial, undone| trial.before(undone))];
        assert_eq!(Undone::recorder(&before), Recorder { delay: 0.02, variance: 2e-4 });
        assert!((Undone::slow_clock(&before) - 0.0302).abs() < 1e-12);
        assert!((before[0].time[100] / trial.time[100] - 1.0302).abs() < 1e-12);
        assert_eq!(Undone::slow_clock(&[trial]), 0.0);
    }
}
