//! What the instruments of a fit ask for, kept for a while: a search asks it of the model as given and of what stands, and comes back to
//! both.

use std::collections::VecDeque;
use std::sync::{Mutex, MutexGuard, PoisonError};

use cdpr::model_file::Model;

use crate::filter::kalman::Randomness;
use crate::strategy::fitted::Fitted;

/// Answers that are kept, the last ones: each holds the trajectories of a fit, 60 MB of one to an hour at 100 Hz.
const KEPT: usize = 4;

/// A fit and what its instruments ask for; `None` where they ask for nothing.
struct Answer {
    model: Model,
    randomness: Randomness,
    scores: [f64; 2],
    asked_for: Option<Fitted>,
}

impl Answer {
    /// Whether it is that of `fitted`: a model with the same random parts on the same trajectories is as likely to the last digit.
    fn is_of(&self, fitted: &Fitted) -> bool {
        self.scores == scores(fitted)
            && self.model == fitted.train.model
            && self.randomness.same(&fitted.train.randomness)
    }
}

fn scores(fitted: &Fitted) -> [f64; 2] {
    [fitted.score, fitted.holdout_score]
}

/// The answers so far.
#[derive(Default)]
pub(crate) struct Asked(Mutex<VecDeque<Answer>>);

impl Asked {
    /// What the instruments of `fitted` ask for, where that is known. Its gaps may count by other instruments.
    pub(crate) fn answer(&self, fitted: &Fitted) -> Option<Option<Fitted>> {
        self.locked().iter().find(|answer| answer.is_of(fitted)).map(|answer| answer.asked_for.clone())
    }

    pub(crate) fn keep(&self, fitted: &Fitted, asked_for: Option<&Fitted>) {
        let Fitted { train, .. } = fitted;
        let answer = Answer {
            model: train.model.clone(),
            randomness: train.randomness.clone(),
            scores: scores(fitted),
            asked_for: asked_for.cloned(),
        };
        let mut answers = self.locked();
        answers.push_front(answer);
        answers.truncate(KEPT);
    }

    fn locked(&self) -> MutexGuard<'_, VecDeque<Answer>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::strategy::fixture::{begun, effect, evidence};

    #[test]
    fn an_answer_is_that_of_the_same_fit() {
        let evidence = evidence(&[], 91);
        let (context, standing) = begun(&evidence, &Model::default());
        let (asked, base) = (Asked::default(), &standing.fit);
        assert!(asked.answer(base).is_none());
        asked.keep(base, None);
        assert!(asked.answer(base).is_some_and(|answer| answer.is_none()));
        let mut quieter = base.clone();
        quieter.train.randomness.noise[0] *= 0.9;
        let drag = Model { effects: vec![effect("platform_linear_drag", None, &[1.0])], ..Model::default() };
        let drag = context.fit(&drag, base).expect("a fit");
        for other in [&quieter, &drag] {
            assert!(asked.answer(other).is_none());
        }
        asked.keep(&drag, Some(base));
        assert!(asked.answer(&drag).flatten().is_some_and(|answer| answer.score == base.score));
        // The oldest goes.
        (1..KEPT).for_each(|_| asked.keep(&drag, None));
        assert!(asked.answer(base).is_none() && asked.answer(&drag).is_some_and(|answer| answer.is_none()));
    }
}
