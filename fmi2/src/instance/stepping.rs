//! Steps, and how the last one ended.

use super::Instance;
use crate::failure::{Failure, Outcome};
use crate::model::{Model, Status, StepError};
use crate::snapshot::LastStep;
use crate::state::State;

/// A status that `fmi2GetXXXStatus` can ask for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum StatusKind {
    DoStep,
    Pending,
    LastSuccessfulTime,
    Terminated,
}

impl<M: Model> Instance<M> {
    pub(crate) fn do_step(&mut self, point: f64, step: f64) -> Outcome {
        if !(step.is_finite() && step > 0.0) {
            return Err(Failure::refused(format!("communication step {step} is not positive and finite")));
        }
        let time = self.progress.time;
        let slack = rounding(time, step);
        if !point.is_finite() || (point - time).abs() > slack {
            return Err(Failure::refused(format!(
                "communication point {point} is not the time {time} that the instance has reached"
            )));
        }
        let end = point + step;
        let stop = self.progress.experiment.and_then(|e| e.stop_time);
        if let Some(stop) = stop
            && end > stop + slack
        {
            return Err(Failure::refused(format!("the step from {point} to {end} goes beyond the stop time {stop}")));
        }
        if end == point {
            return Err(Failure::refused(format!("communication step {step} is too small to move the time {point}")));
        }
        match self.model.step(point, step) {
            Ok(()) => {
                self.progress.time = end;
                self.progress.state = State::StepComplete;
                self.progress.last_step = LastStep::default();
                Ok(())
            }
            Err(error) => self.step_failed(error, point - slack, end + slack),
        }
    }

    fn step_failed(&mut self, error: StepError, earliest: f64, latest: f64) -> Outcome {
        let text = error.to_string();
        if !(earliest..=latest).contains(&error.reached) {
            return Err(Failure::broken(format!("{text}; that time is not within the step")));
        }
        self.progress.time = error.reached;
        self.progress.state = State::StepFailed;
        self.progress.last_step =
            LastStep { status: Status::Discard, terminated: error.terminate, message: text.clone() };
        Err(Failure::Discarded(text))
    }

    pub(crate) fn step_status(&self, kind: StatusKind) -> Outcome<Status> {
        match kind {
            StatusKind::DoStep => Ok(self.progress.last_step.status),
            _ => no_such_status(),
        }
    }

    pub(crate) fn real_status(&self, kind: StatusKind) -> Outcome<f64> {
        match kind {
            StatusKind::LastSuccessfulTime => Ok(self.progress.time),
            _ => no_such_status(),
        }
    }

    pub(crate) fn integer_status(&self, _: StatusKind) -> Outcome<i32> {
        no_such_status()
    }

    pub(crate) fn boolean_status(&self, kind: StatusKind) -> Outcome<bool> {
        match kind {
            StatusKind::Terminated => Ok(self.progress.last_step.terminated),
            _ => no_such_status(),
        }
    }

    /// Steps never run in the background, so there is nothing pending to tell of; what can be told is
    /// how the last step ended.
    pub(crate) fn string_status(&self, kind: StatusKind) -> Outcome<String> {
        match kind {
            StatusKind::Pending if self.progress.last_step.message.is_empty() => {
                Ok("the last step was taken in full".into())
            }
            StatusKind::Pending => Ok(self.progress.last_step.message.clone()),
            _ => no_such_status(),
        }
    }
}

fn no_such_status<T>() -> Outcome<T> {
    Err(Failure::Discarded("there is no status of this kind and type".into()))
}

/// How far apart two times may lie that a host computed in different ways: `start + i * step`, or by
/// adding up. A millionth of the step, or a few units in the last place where the steps are tiny.
fn rounding(time: f64, step: f64) -> f64 {
    1e-6 * step + 16.0 * f64::EPSILON * time.abs()
}
