//! The plant's states at a start and at rest.

use super::{CableEffect, Plant};
use crate::dynamics::{Inputs, MAX_EFFECT_STATES};
use crate::effect::{PlatformContext, WinchContext};
use crate::kinematics;
use crate::per_cable::PerCable;

impl Plant {
    /// A size for each state, by which errors are weighed: 1 m, 0.1 rad, 1 m/s, 0.1 rad/s, and for effect states the
    /// size of their start value under 1 kN, or what the effect says.
    pub(crate) fn nominal(&self, out: &mut [f64]) {
        let arm = self.data.geometry.attachment_scale();
        out[..6].copy_from_slice(&[1.0, 1.0, 1.0 / arm, 1.0, 1.0, 1.0 / arm]);
        for i in 0..self.cables() {
            out[self.offset[i]..self.effect_states(i).start].fill(1.0);
            let mut states = [0.0; MAX_EFFECT_STATES];
            self.start_effect_states(i, 1e3, 1e3, &mut states);
            let range = self.effect_states(i);
            for (slot, value) in out[range].iter_mut().zip(states) {
                *slot = if value == 0.0 { 1.0 } else { value.abs() };
            }
            let range = self.effect_states(i);
            for (kind, at) in self.cable[i].loss.iter().filter(|(kind, _)| kind.states() > 0) {
                out[range.start + at..][..kind.states()].fill(kind.loss_state_size());
            }
        }
    }

    /// Start values of the effect states of `cable` under a constant command and tension (N).
    pub(crate) fn start_effect_states(&self, cable: usize, command: f64, tension: f64, states: &mut [f64]) {
        let effects = &self.cable[cable];
        let mut force = command;
        for (kind, at) in &effects.command {
            kind.start_command(force, &mut states[*at..]);
            let context = WinchContext { time: 0.0, speed: 0.0 };
            force = kind.command(force, &states[*at..], &mut [0.0; MAX_EFFECT_STATES], &context);
        }
        for (kind, at) in &effects.law {
            kind.start_strain(tension, &mut states[*at..]);
        }
    }

    /// Puts the states of effects that are in force and were not in `before` to where they change nothing: a transformation of
    /// the command has settled on the forces (N) that the drives make, others have not begun to deform.
    pub(crate) fn begin_effects(&self, before: &Self, forces: &[f64], y: &mut [f64]) {
        for (i, (now, before)) in self.cable.iter().zip(&before.cable).enumerate() {
            let states = &mut y[self.effect_states(i)];
            let begins = |(kind, at): &CableEffect, before: &[CableEffect]| {
                kind.states() > 0 && !before.iter().any(|(_, there)| there == at)
            };
            for place in now.loss.iter().filter(|p| begins(p, &before.loss)) {
                states[place.1..][..place.0.states()].fill(0.0);
            }
            for place in now.law.iter().filter(|p| begins(p, &before.law)) {
                states[place.1..][..place.0.states()].fill(0.0);
            }
            let mut force = forces[i];
            for place in &now.command {
                let (kind, at) = place;
                if begins(place, &before.command) {
                    kind.start_command(force, &mut states[*at..]);
                }
                let context = WinchContext { time: 0.0, speed: 0.0 };
                force = kind.command(force, &states[*at..], &mut [0.0; MAX_EFFECT_STATES], &context);
            }
        }
    }

    /// Sets the states of swinging cables in `y` to those of straight ones that turn with the platform's motion in `y`.
    pub fn straighten(&self, y: &mut [f64]) {
        if !self.has.across {
            return;
        }
        let cables = kinematics::cables(&self.data.geometry, &[y[0], y[1], y[2]], &[y[3], y[4], y[5]]);
        for (i, cable) in cables.iter().enumerate() {
            let first = self.effect_states(i).start;
            for (kind, at) in &self.cable[i].swing {
                kind.start_swing(cable.span, cable.angular_rate, &mut y[first + at..]);
            }
        }
    }

    /// What platform-side effects see of the plant at rest at `pose` under these commands, handed to `look`.
    pub(crate) fn at_rest<R>(
        &self,
        time: f64,
        pose: &[f64; 3],
        inputs: &Inputs,
        look: impl FnOnce(&PlatformContext<'_, f64>) -> R,
    ) -> R {
        let geometry = &self.at(time).data.geometry;
        let lengths = kinematics::cables(geometry, pose, &[0.0; 3]).map(|c| c.length);
        let zero = PerCable::filled(self.cables(), 0.0);
        look(&PlatformContext {
            time,
            geometry,
            pose,
            twist: &[0.0; 3],
            inputs: &self.driven(inputs),
            cable_length: &lengths,
            cable_speed: &zero,
            unstretched_length: &lengths,
            unstretched_rate: &zero,
        })
    }

    /// Pulls (N) that the winches hold on their cables at rest under constant commands, all effects included.
    pub(crate) fn pulls_at_rest(&self, context: &PlatformContext<'_, f64>) -> PerCable<f64> {
        let plant = self.at(context.time);
        PerCable::from_fn(self.cables(), |i| {
            let cable = plant.chain(i);
            let mut states = [0.0; MAX_EFFECT_STATES];
            let command = context.inputs.winch_force[i];
            plant.start_effect_states(i, command, 0.0, &mut states);
            let winch = WinchContext { time: context.time, speed: 0.0 };
            cable.pull(command, cable.added(context), &winch, &states, &mut [0.0; MAX_EFFECT_STATES])
        })
    }

    /// The unstretched length (m) of `cable` (from 0) at which it carries `tension` (N) at rest, at this chord (m) and
    /// these effect states. Not positive where no length does: a sagging cable needs a tension.
    pub fn unstretched_length_for(&self, cable: usize, time: f64, chord: f64, tension: f64, states: &[f64]) -> f64 {
        self.at(time).chain(cable).unstretched_length(time, chord, tension, states)
    }

    /// The tension (N) of `cable` (from 0) at rest at this chord and unstretched length (m) and these effect states; less
    /// than zero where it would be slack.
    pub fn tension_for(&self, cable: usize, time: f64, chord: f64, unstretched: f64, states: &[f64]) -> f64 {
        self.at(time).chain(cable).spring(time, chord, unstretched, states)
    }
}
