//! The plant at the present instant, looked at once for all that a host reads of it.

use super::role::{Role, State};
use crate::dynamics::{Evaluation, strain};
use crate::signal::Signal;
use crate::simulation::Simulation;

/// What has been asked for of the present instant.
///
/// What hosts read at every step is made together, so that reading it is looking it up; all else, accelerations and angles among it,
/// takes an evaluation of the whole plant.
#[derive(Default)]
pub(super) struct Now {
    /// Pose and twist as they are shown, then of each cable the length, the unstretched length, its rate, the tension and the strain;
    /// by [`place`]. Whether they are of this instant.
    shown: Vec<f64>,
    is_shown: bool,
    /// Likewise.
    evaluation: Option<Box<Evaluation>>,
    is_evaluated: bool,
}

/// Values of the platform among those that are shown, and kinds of values of the cables.
const OF_PLATFORM: usize = 6;
const OF_CABLE: usize = 5;

/// In place of a [`place`]: the value is not among those made together. Beyond them all.
pub(super) const ELSEWHERE: usize = usize::MAX;

/// Where the value of `role` is among those made together, of a robot with so many cables, for [`Now::look_up`].
pub(super) fn place(role: Role, cables: usize) -> usize {
    let of_cable = |kind: usize, cable: usize| OF_PLATFORM + kind * cables + cable;
    match role {
        Role::State(State::Pose(axis)) => axis,
        Role::State(State::Twist(axis)) => 3 + axis,
        Role::Output(Signal::CableLength(i)) => of_cable(0, i),
        Role::State(State::UnstretchedLength(i)) => of_cable(1, i),
        Role::State(State::UnstretchedRate(i)) | Role::Rate(State::UnstretchedLength(i)) => of_cable(2, i),
        Role::Output(Signal::Tension(i)) => of_cable(3, i),
        Role::Output(Signal::Strain(i)) => of_cable(4, i),
        _ => ELSEWHERE,
    }
}

impl Now {
    /// The instant is past.
    pub(super) fn forget(&mut self) {
        (self.is_shown, self.is_evaluated) = (false, false);
    }

    /// Writes the values at these places to `values`, as `simulation` shows them now; `false` where one is not among those made
    /// together.
    pub(super) fn look_up(
        &mut self,
        simulation: &Simulation,
        places: impl Iterator<Item = usize>,
        values: &mut [f64],
    ) -> bool {
        if !self.is_shown {
            self.show(simulation);
            self.is_shown = true;
        }
        let shown = &self.shown[..];
        for (value, place) in values.iter_mut().zip(places) {
            match shown.get(place) {
                Some(known) => *value = *known,
                None => return false,
            }
        }
        true
    }

    fn show(&mut self, simulation: &Simulation) {
        let plant = simulation.plant().at(simulation.time());
        let cables = plant.cables();
        self.shown.resize(OF_PLATFORM + OF_CABLE * cables, 0.0);
        let (of_platform, of_cables) = self.shown.split_at_mut(OF_PLATFORM);
        let ([x, y, phi], [vx, vy, omega]) = (plant.pose_sensor.shown(&simulation.pose_seen()), simulation.twist());
        of_platform.copy_from_slice(&[x, y, phi, vx, vy, omega]);
        let (lengths, rest) = of_cables.split_at_mut(cables);
        let (unstretched, rest) = rest.split_at_mut(cables);
        let (rates, rest) = rest.split_at_mut(cables);
        let (tensions, strains) = rest.split_at_mut(cables);
        simulation.see_cables(|i, reading| {
            let (cable, length) = (&plant.cable[i], reading.unstretched);
            lengths[i] = cable.shown_length(reading.length);
            unstretched[i] = cable.unstretched_sensor.shown(length);
            rates[i] = cable.unstretched_sensor.shown_rate(length, reading.unstretched_rate);
            tensions[i] = cable.shown_tension(reading.tension);
            strains[i] = strain(reading.length, length);
        });
    }

    /// The evaluation of `simulation` now.
    pub(super) fn evaluation(&mut self, simulation: &Simulation) -> &Evaluation {
        match &mut self.evaluation {
            Some(evaluation) if !self.is_evaluated => simulation.evaluate_into(evaluation),
            _ => {}
        }
        self.is_evaluated = true;
        self.evaluation.get_or_insert_with(|| Box::new(simulation.evaluate()))
    }
}
