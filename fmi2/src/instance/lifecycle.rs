//! From set-up to the end, and back.

use super::Instance;
use crate::failure::{Failure, Outcome};
use crate::model::{Experiment, Model};
use crate::snapshot::Progress;
use crate::state::State;

impl<M: Model> Instance<M> {
    pub(crate) fn setup_experiment(&mut self, experiment: Experiment) -> Outcome {
        experiment.check().map_err(Failure::refused)?;
        self.progress.experiment = Some(experiment);
        self.progress.time = experiment.start_time;
        Ok(())
    }

    pub(crate) fn enter_initialisation(&mut self) -> Outcome {
        let experiment = self.experiment()?;
        self.model.enter_initialisation(experiment).map_err(|error| Failure::broken(error.message))?;
        self.progress.state = State::Initialisation;
        Ok(())
    }

    pub(crate) fn exit_initialisation(&mut self) -> Outcome {
        let experiment = self.experiment()?;
        self.model.initialise(experiment).map_err(|error| Failure::broken(error.message))?;
        self.progress.state = State::StepComplete;
        Ok(())
    }

    pub(crate) fn terminate(&mut self) -> Outcome {
        self.progress.state = State::Terminated;
        Ok(())
    }

    pub(crate) fn reset(&mut self) -> Outcome {
        self.model.reset();
        self.progress = Progress::default();
        Ok(())
    }

    fn experiment(&self) -> Outcome<Experiment> {
        self.progress.experiment.ok_or_else(|| Failure::refused("fmi2SetupExperiment has not been called"))
    }
}
