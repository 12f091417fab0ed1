//! Directional derivatives and output derivatives, exact by dual numbers.

use fmi2_export::ModelError;

use super::role::Instant;
use super::values::input_field;
use super::{CablePlatform, Role, State};
use crate::dynamics::Inputs;
use crate::plant::Plant;
use crate::simulation::Direction;

impl CablePlatform {
    /// `out = d(unknowns)/d(knowns) * seed`.
    pub(super) fn along(
        &mut self,
        unknowns: &[usize],
        knowns: &[usize],
        seed: &[f64],
        out: &mut [f64],
    ) -> Result<(), ModelError> {
        let shared = &self.shared;
        let roles = |indices: &[usize]| -> Vec<Role> { indices.iter().map(|index| shared.roles[*index]).collect() };
        let (unknowns, knowns) = (roles(unknowns), roles(knowns));
        let simulation = self.running()?;
        let plant = simulation.plant().at(simulation.time());
        let mut states = vec![0.0; plant.dimension()];
        let (mut time, mut inputs) = (0.0, Inputs::none(plant.cables()));
        for (role, seed) in knowns.into_iter().zip(seed) {
            match role {
                Role::Time => time += seed,
                Role::WinchForce(_) | Role::Disturbance(_) => {
                    if let Some(field) = input_field(&mut inputs, role) {
                        *field += seed;
                    }
                }
                Role::State(state) => {
                    for (index, by) in places(plant, simulation.states(), state).into_iter().flatten() {
                        states[index] += by * seed;
                    }
                }
                _ => return Err(ModelError::new("derivatives are with respect to inputs, states and time")),
            }
        }
        self.derivatives(&Direction { time, states: &states, inputs }, &unknowns, out)
    }

    /// The rate of an output along the motion.
    pub(super) fn rate(&mut self, role: Role) -> Result<f64, ModelError> {
        let simulation = self.running()?;
        let (states, inputs) = (simulation.rates(), simulation.input_slopes());
        let mut rate = [0.0];
        self.derivatives(&Direction { time: 1.0, states: &states, inputs }, &[role], &mut rate)?;
        Ok(rate[0])
    }

    /// Derivatives along one direction; hosts ask for several unknowns one after the other, and it is evaluated once for them.
    fn derivatives(&mut self, direction: &Direction<'_>, unknowns: &[Role], out: &mut [f64]) -> Result<(), ModelError> {
        let kept = self.tangent.take().filter(|tangent| tangent.is_along(direction));
        let simulation = self.running()?;
        let tangent = kept.unwrap_or_else(|| Box::new(simulation.tangent(direction)));
        let plant = simulation.plant().at(simulation.time());
        let instant = Instant {
            shown: tangent.shown(plant),
            states: &tangent.states,
            acceleration: Some(&tangent.unstretched_acceleration),
            plant,
        };
        for (role, out) in unknowns.iter().zip(out) {
            let value = instant
                .real(*role)
                .ok_or_else(|| ModelError::new("derivatives are of real outputs and derivatives of states"))?;
            *out = value.eps;
        }
        self.tangent = Some(tangent);
        Ok(())
    }
}

/// The states that change with one as it is shown, and how; none where it is no state of this plant.
fn places(plant: &Plant, y: &[f64], state: State) -> [Option<(usize, f64)>; 3] {
    let one = |index: usize| [Some((index, 1.0)), None, None];
    let length = |i: usize| plant.unstretched_index(i).map(|at| (at, y[at]));
    match state {
        State::Pose(k) => {
            let by = plant.pose_sensor.behind_by(k, y[2]);
            std::array::from_fn(|axis| (by[axis] != 0.0).then_some((axis, by[axis])))
        }
        State::Twist(k) => one(3 + k),
        State::UnstretchedLength(i) => {
            let sensor = &plant.cable[i].unstretched_sensor;
            let Some((at, length)) = length(i) else { return [None; 3] };
            let rate = plant.rate_index(i).map(|at| (at, sensor.rate_by_shown(length, y[at])));
            [Some((at, 1.0 / sensor.slope(length))), rate, None]
        }
        State::UnstretchedRate(i) => {
            let slope = length(i).map_or(1.0, |(_, length)| plant.cable[i].unstretched_sensor.slope(length));
            [plant.rate_index(i).map(|at| (at, 1.0 / slope)), None, None]
        }
        State::Effect(i, k) => one(plant.effect_states(i).start + k),
    }
}
