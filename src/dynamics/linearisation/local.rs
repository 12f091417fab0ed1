//! One cable seen on its own: tension, transverse force and the rates of its own states, by the few quantities through which the
//! rest of the plant reaches it.

use num_dual::DualSVec64;

use crate::effect::{PlatformContext, WinchContext};
use crate::parameters::{CableDamper, CableModel};
use crate::per_cable::PerCable;
use crate::plant::{Plant, axial_states};
use crate::scalar::Real;

use super::super::{Evaluation, Held, Inputs, MAX_EFFECT_STATES};
use super::BLOCK;

/// What reaches a cable from outside: length `L`, its rate, angular rate, acceleration `L̈`, winch force, direction `α`.
pub(super) const OUTSIDE: usize = 6;
/// Place of `L̈` among them; a cable of lumped mass does not feel it.
const ACCELERATION: usize = 3;
/// Place of `α` among them; felt by what acts across a cable that leaves a pulley, whose straight part changes with it.
const DIRECTION: usize = 5;

/// A derivative by what reaches the cable, then by its own states.
pub(super) type Row = [f64; OUTSIDE + BLOCK];

/// One cable's first derivatives.
#[derive(Clone, Copy, Debug)]
pub(super) struct Derivatives {
    /// The transverse force itself (N).
    pub(super) transverse: f64,
    pub(super) tension_by: Row,
    pub(super) transverse_by: Row,
    pub(super) rates_by: [Row; BLOCK],
}

/// A cable seen on its own, the rest of the plant frozen.
pub(super) struct Local<'a> {
    pub(super) plant: &'a Plant,
    pub(super) cable: usize,
    pub(super) time: f64,
    pub(super) u: &'a Inputs,
    pub(super) slack: bool,
    pub(super) pose: [f64; 3],
    pub(super) twist: [f64; 3],
    pub(super) evaluation: &'a Evaluation,
    /// `L̈` (m/s²).
    pub(super) acceleration: f64,
    /// The cable's own states.
    pub(super) own: [f64; BLOCK],
}

/// Quantities by which derivatives are taken at once: those of a cable of lumped mass with four states of its own.
const AT_ONCE: usize = 8;

type Gradient = DualSVec64<AT_ONCE>;

/// The quantity of this column, with its derivative if that is among those `taken`.
fn seeded(value: f64, column: usize, taken: &[usize]) -> Gradient {
    let quantity = Gradient::from(value);
    match taken.iter().position(|one| *one == column) {
        Some(at) => quantity.derivative(at),
        None => quantity,
    }
}

/// The derivatives that a result carries.
pub(super) fn derivatives<const N: usize>(result: &DualSVec64<N>) -> [f64; N] {
    result.eps.0.map_or([0.0; N], |eps| eps.data.0[0].map(finite))
}

/// A derivative for Newton's matrix, which may be approximate: none where there is none, as of a root at zero.
fn finite(derivative: f64) -> f64 {
    if derivative.is_finite() { derivative } else { 0.0 }
}

struct LocalRates<S> {
    tension: S,
    transverse: S,
    rates: [S; BLOCK],
}

impl Local<'_> {
    pub(super) fn derivatives(&self) -> Derivatives {
        let plain = !self.plant.has.servo && self.plant.cable[self.cable].is_empty();
        if plain { self.plain() } else { self.with_effects() }
    }

    fn size(&self) -> usize {
        axial_states(self.plant.data.cables[self.cable].model) + self.plant.cable[self.cable].states
    }

    /// The derivatives of a cable without effects, in closed form.
    fn plain(&self) -> Derivatives {
        let data = &self.plant.data.cables[self.cable];
        let k = &self.evaluation.kinematics[self.cable];
        let nothing = [0.0; OUTSIDE + BLOCK];
        let mut d =
            Derivatives { transverse: 0.0, tension_by: nothing, transverse_by: nothing, rates_by: [nothing; BLOCK] };
        let (chord, speed) = (k.length, k.speed);
        let constants = &self.plant.constants;
        let (rate_square, turning_square) = (constants.rate_square[self.cable], constants.turning_square[self.cable]);
        let mass_slope = constants.axial_density[self.cable];
        let tension = self.evaluation.tension[self.cable];
        let strain_rate = data.damper == CableDamper::StrainRate;
        let [length, rate] = [self.own[0], self.own[1]];
        match data.model {
            CableModel::LumpedMass => {
                let inverse = 1.0 / length;
                let share = if strain_rate { chord / length } else { 1.0 };
                let damping = data.damping * inverse;
                let t = &mut d.tension_by;
                if !self.slack {
                    t[0] = data.axial_stiffness * inverse;
                    t[1] = damping;
                    t[OUTSIDE] = -(data.axial_stiffness * chord * inverse + damping * (speed - rate * share)) * inverse;
                    t[OUTSIDE + 1] = -damping * share;
                    if strain_rate {
                        t[0] -= damping * rate * inverse;
                        t[OUTSIDE] += damping * rate * share * inverse;
                    }
                }
                let mass = 1.0 / constants.axial_mass(self.cable, length);
                let acceleration = self.evaluation.unstretched_acceleration[self.cable];
                let across = 2.0 * turning_square * length * k.angular_rate;
                d.rates_by[0][OUTSIDE + 1] = 1.0;
                let r = &mut d.rates_by[1];
                r[0] = t[0] * mass;
                r[1] = t[1] * mass;
                r[2] = across * length * mass;
                r[4] = -mass;
                r[OUTSIDE] = (t[OUTSIDE] + across * k.angular_rate - acceleration * mass_slope) * mass;
                r[OUTSIDE + 1] = (t[OUTSIDE + 1] - 2.0 * rate_square * rate) * mass;
            }
            CableModel::Rigid | CableModel::MasslessSpring => {
                let t = &mut d.tension_by;
                if !self.slack {
                    let across = 2.0 * turning_square * chord;
                    t[0] = mass_slope * self.acceleration - across * k.angular_rate * k.angular_rate;
                    t[1] = 2.0 * rate_square * speed;
                    t[2] = -across * chord * k.angular_rate;
                    t[3] = constants.axial_mass(self.cable, chord);
                    t[4] = 1.0;
                }
                if data.model == CableModel::MasslessSpring {
                    let stiffness = data.axial_stiffness / length;
                    let lag = length / data.damping;
                    let share = if strain_rate { chord / length } else { 1.0 };
                    let pull = stiffness * (chord - length) - tension;
                    let r = &mut d.rates_by[0];
                    r[0] = (stiffness - t[0]) * lag;
                    r[1] = 1.0 - t[1] * lag;
                    for c in 2..OUTSIDE {
                        r[c] = -t[c] * lag;
                    }
                    r[OUTSIDE] = (pull - stiffness * chord) / data.damping;
                    if strain_rate {
                        // The rate is over the share L/l.
                        let rate = (speed + pull * lag) / share;
                        r[0] -= rate / length;
                        r[OUTSIDE] += rate * share / length;
                        r.iter_mut().for_each(|v| *v /= share);
                    }
                }
            }
        }
        d
    }

    /// The derivatives of a cable with effects or a servo, by dual numbers.
    fn with_effects(&self) -> Derivatives {
        let size = self.size();
        let k = &self.evaluation.kinematics[self.cable];
        let command = self.u.winch_force[self.cable];
        // The direction as a change from the present one.
        let outside = [k.length, k.speed, k.angular_rate, self.acceleration, command, 0.0];
        let nothing = [0.0; OUTSIDE + BLOCK];
        let mut d =
            Derivatives { transverse: 0.0, tension_by: nothing, transverse_by: nothing, rates_by: [nothing; BLOCK] };
        let effects = &self.plant.cable[self.cable];
        let felt = |column: &usize| match *column {
            ACCELERATION => self.plant.data.cables[self.cable].model != CableModel::LumpedMass,
            DIRECTION => k.pulley_radius != 0.0 && !(effects.transverse.is_empty() && effects.swing.is_empty()),
            _ => true,
        };
        let (mut columns, mut count) = ([0; OUTSIDE + BLOCK], 0);
        for column in (0..OUTSIDE + size).filter(felt) {
            columns[count] = column;
            count += 1;
        }
        for taken in columns[..count].chunks(AT_ONCE) {
            let outside = std::array::from_fn(|c| seeded(outside[c], c, taken));
            let own = std::array::from_fn(|c| seeded(self.own[c], OUTSIDE + c, taken));
            let by = self.rates(&outside, &own);
            let copy = |from: &Gradient, to: &mut Row| {
                for (column, derivative) in taken.iter().zip(derivatives(from)) {
                    to[*column] = derivative;
                }
            };
            d.transverse = by.transverse.re;
            copy(&by.tension, &mut d.tension_by);
            copy(&by.transverse, &mut d.transverse_by);
            for (from, to) in by.rates.iter().zip(&mut d.rates_by).take(size) {
                copy(from, to);
            }
        }
        d
    }

    fn rates<S: Real>(
        &self,
        &[length, speed, turning, acceleration, command, direction]: &[S; OUTSIDE],
        own: &[S; BLOCK],
    ) -> LocalRates<S> {
        let zero = S::from(0.0);
        let i = self.cable;
        let cable = self.plant.chain(i);
        let (data, effects) = (cable.data, cable.effects);
        let axial = axial_states(data.model);
        let mut states = [zero; MAX_EFFECT_STATES];
        states[..effects.states].copy_from_slice(&own[axial..axial + effects.states]);
        let mut rates = [zero; BLOCK];
        let mut effect_rates = [zero; MAX_EFFECT_STATES];
        let (unstretched, unstretched_rate) = match data.model {
            CableModel::Rigid => (length, speed),
            CableModel::MasslessSpring => (own[0], speed),
            CableModel::LumpedMass => (own[0], own[1]),
        };
        let time = S::from(self.time);
        let mut added = zero;
        if !effects.pull.is_empty() {
            let e = self.evaluation;
            let replaced = |values: PerCable<f64>, own: S| {
                let mut values = values.map(S::from);
                values[i] = own;
                values
            };
            let context = PlatformContext {
                time,
                geometry: &self.plant.data.geometry,
                pose: &self.pose.map(S::from),
                twist: &self.twist.map(S::from),
                inputs: &self.u.lift(),
                cable_length: &replaced(e.kinematics.map(|k| k.length), length),
                cable_speed: &replaced(e.kinematics.map(|k| k.speed), speed),
                unstretched_length: &replaced(e.unstretched, unstretched),
                unstretched_rate: &replaced(e.unstretched_rate, unstretched_rate),
            };
            added = cable.added(&context);
        }
        let (chord, paid_out) = ([length, speed], [unstretched, unstretched_rate]);
        let mut held = Held { time, chord, paid_out, angular_rate: turning, slack: self.slack, states: &states };
        let winch = WinchContext { time, speed: unstretched_rate };
        let pull = cable.pull(cable.drive(command, &held), added, &winch, &states, &mut effect_rates);
        let tension = match data.model {
            _ if self.slack => zero,
            CableModel::LumpedMass => cable.carried(&held),
            CableModel::Rigid | CableModel::MasslessSpring => {
                pull + cable.axial_force([length, speed, acceleration], turning)
            }
        };
        match data.model {
            CableModel::Rigid => {}
            CableModel::MasslessSpring => {
                let spring = cable.spring(time, length, unstretched, &states);
                rates[0] = cable.paid_out_rate(spring, tension, chord, unstretched);
                held.paid_out[1] = rates[0];
            }
            CableModel::LumpedMass => {
                let bias = cable.axial_force([unstretched, unstretched_rate, zero], turning);
                rates[0] = unstretched_rate;
                rates[1] = (tension - pull - bias) / cable.axial_mass(unstretched);
            }
        }
        cable.law_rates(tension, &held, &mut effect_rates);
        let k = &self.evaluation.kinematics[i];
        let span = length - (k.length - k.span) + direction * k.pulley_radius;
        let transverse = cable.across(span, tension, pull, &held, &mut effect_rates);
        rates[axial..axial + effects.states].copy_from_slice(&effect_rates[..effects.states]);
        LocalRates { tension, transverse, rates }
    }
}
