//! One cable's chain: command → pull → tension → rates, and back from tension to pull, length and command.
//!
//! It stands here once, for the plant's rates, their derivatives and inverse dynamics. The formulas of [`CableConstants`] are for
//! one of several cables at a time, so that the rates take them in loops over the cables; what effects change is a matter of one
//! [`Cable`]. [`Plant::residual`] states the physics a second time.

use crate::effect::{EffectKind, LawPart, PlatformContext, StrainContext, SwingContext, WinchContext};
use crate::kinematics::CableArrays;
use crate::parameters::{CableDamper, CableInertia, CableModel};
use crate::per_cable::{MAX_CABLES, PerCable};
use crate::plant::{CableEffect, CableEffects, Plant};
use crate::scalar::Real;

use super::{CableData, Inputs, elastic};

/// The cables' numbers, one array per quantity and with the products that every evaluation needs; zero beyond the last
/// cable, so that it adds nothing.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CableConstants {
    pub(crate) axial_stiffness: [f64; MAX_CABLES],
    pub(crate) damping: [f64; MAX_CABLES],
    /// As [`CableData::straight_density`].
    pub(crate) straight_density: [f64; MAX_CABLES],
    /// Axial mass per length (kg/m): `ρ/2` or `ρ`.
    pub(crate) axial_density: [f64; MAX_CABLES],
    drum_mass: [f64; MAX_CABLES],
    /// Factor of `rate²` in the axial bias (kg/m).
    pub(crate) rate_square: [f64; MAX_CABLES],
    /// Factor of `-(l α̇)²` in the axial bias (kg/m).
    pub(crate) turning_square: [f64; MAX_CABLES],
    /// 1 where the damper measures the strain's rate, 0 where the length's.
    strain_damper: [f64; MAX_CABLES],
}

impl CableConstants {
    pub(crate) fn new(cables: &[CableData]) -> Self {
        let each = |f: &dyn Fn(&CableData) -> f64| std::array::from_fn(|i| cables.get(i).map_or(0.0, f));
        Self {
            axial_stiffness: each(&|c| c.axial_stiffness),
            damping: each(&|c| c.damping),
            straight_density: each(&|c| c.straight_density),
            axial_density: each(&|c| c.axial_density()),
            drum_mass: each(&|c| c.drum_mass),
            rate_square: each(&|c| if c.inertia == CableInertia::Paper { 0.5 * c.density } else { 0.0 }),
            turning_square: each(&|c| 0.5 * c.acting_density()),
            strain_damper: each(&|c| f64::from(u8::from(c.damper == CableDamper::StrainRate))),
        }
    }

    /// Mass (kg) that moves with the winch end of cable `i` at this length (m).
    #[inline]
    pub(crate) fn axial_mass<S: Real>(&self, i: usize, length: S) -> S {
        length * self.axial_density[i] + self.drum_mass[i]
    }

    /// The axial force (N) that the cable's own motion takes beyond mass times acceleration, from the rate of its length and the
    /// speed across its end (m/s): `ρ/2 (rate² - l² α̇²)` in the paper's rod (23), `-ρ/2 l² α̇²` in a reeled cable.
    #[inline]
    pub(crate) fn axial_bias<S: Real>(&self, i: usize, rate: S, turning: S) -> S {
        rate * rate * self.rate_square[i] - turning * turning * self.turning_square[i]
    }

    /// Rate (m/s) at which a damper opens, at the strain `(L - l)/l` and the rates of chord and unstretched length: `L̇ - l̇` as the
    /// paper has it, `L̇ - l̇ L/l` where it measures strain.
    #[inline]
    pub(crate) fn opening<S: Real>(&self, i: usize, strain: S, speed: S, rate: S) -> S {
        speed - rate - rate * strain * self.strain_damper[i]
    }
}

/// A cable at one instant, as its own laws see it.
#[derive(Clone, Copy)]
pub(crate) struct Held<'y, S> {
    /// Time (s).
    pub(crate) time: S,
    /// Length and rate of the chord (m, m/s).
    pub(crate) chord: [S; 2],
    /// Unstretched length and the rate at which it leaves the winch (m, m/s).
    pub(crate) paid_out: [S; 2],
    /// `α̇` (rad/s).
    pub(crate) angular_rate: S,
    /// Whether it carries nothing.
    pub(crate) slack: bool,
    /// Its effects' own states.
    pub(crate) states: &'y [S],
}

impl<'y, S: Real> Held<'y, S> {
    /// Cable `i` of those of an instant.
    #[inline(always)]
    pub(super) fn of<const LANES: usize>(
        k: &CableArrays<S, LANES>,
        i: usize,
        time: S,
        paid_out: [S; 2],
        slack: bool,
        states: &'y [S],
    ) -> Self {
        Self { time, chord: [k.length[i], k.speed[i]], paid_out, angular_rate: k.angular_rate[i], slack, states }
    }
}

/// One cable of a plant.
#[derive(Clone, Copy)]
pub(crate) struct Cable<'a> {
    pub(crate) data: &'a CableData,
    pub(crate) effects: &'a CableEffects,
    constants: &'a CableConstants,
    number: usize,
}

impl Plant {
    /// The chain of cable `number` (from 0).
    #[inline(always)]
    pub(crate) fn chain(&self, number: usize) -> Cable<'_> {
        let (data, effects) = (&self.data.cables[number], &self.cable[number]);
        Cable { data, effects, constants: &self.constants, number }
    }

    /// The forces (N) that the drives make of their commands.
    pub(crate) fn drive_forces(&self, time: f64, y: &[f64], u: &Inputs, slack: &PerCable<bool>) -> PerCable<f64> {
        if !self.has.servo {
            return u.winch_force;
        }
        let e = self.evaluate(time, y, u, slack);
        PerCable::from_fn(self.cables(), |i| {
            let k = &e.kinematics[i];
            let (chord, paid_out) = ([k.length, k.speed], [e.unstretched[i], e.unstretched_rate[i]]);
            let states = self.effect_states_in(i, y);
            let held = Held { time, chord, paid_out, angular_rate: k.angular_rate, slack: slack[i], states };
            self.chain(i).drive(u.winch_force[i], &held)
        })
    }
}

impl Cable<'_> {
    /// Mass (kg) that moves with the winch end at this length (m).
    #[inline(always)]
    pub(crate) fn axial_mass<S: Real>(&self, length: S) -> S {
        self.constants.axial_mass(self.number, length)
    }

    /// The axial force (N) that the motion of an end takes: its length, rate and acceleration (m, m/s, m/s²), as the cable turns.
    /// It is tension less pull, (23).
    #[inline(always)]
    pub(crate) fn axial_force<S: Real>(&self, [length, rate, acceleration]: [S; 3], angular_rate: S) -> S {
        let bias = self.constants.axial_bias(self.number, rate, length * angular_rate);
        bias + self.axial_mass(length) * acceleration
    }

    /// The force (N) that the drive makes of its command: the command itself, or that of a servo that follows it within its
    /// limit.
    #[inline(always)]
    pub(crate) fn drive<S: Real>(&self, command: S, held: &Held<'_, S>) -> S {
        if self.data.winch.command.is_servo() { self.servo(command, held) } else { command }
    }

    /// Out of the way of the evaluation, which few models interrupt by it.
    #[inline(never)]
    fn servo<S: Real>(&self, command: S, held: &Held<'_, S>) -> S {
        let winch = &self.data.winch;
        let [length, rate] = held.paid_out;
        let wanted = winch.wanted(command, length, rate);
        let force = self.carried(held) - self.axial_force([length, rate, wanted], held.angular_rate);
        if force.re().abs() > winch.force_limit { S::from(winch.force_limit.copysign(force.re())) } else { force }
    }

    /// What a servo that sees this `tension` (N) and is to pull with `force` (N) is told, in the unit of its command: it wants the
    /// acceleration that its force would make of the tension and the mass that it knows.
    pub(crate) fn servo_command<S: Real>(&self, force: S, tension: S, [length, rate]: [S; 2], angular_rate: S) -> S {
        let own = self.axial_force([length, rate, S::from(0.0)], angular_rate);
        self.data.winch.command_for((tension - own - force) / self.axial_mass(length), length, rate)
    }

    /// The force (N) that effects add behind the command.
    #[inline]
    pub(crate) fn added<S: Real>(&self, context: &PlatformContext<'_, S>) -> S {
        self.effects.pull.iter().fold(S::from(0.0), |sum, kind| sum + kind.pull(context, self.number))
    }

    /// The winch's pull (N) on the cable under `command` (N) and the force `added` behind it, and the rates of the states of its
    /// command and its losses.
    #[inline]
    pub(crate) fn pull<S: Real>(
        &self,
        command: S,
        added: S,
        context: &WinchContext<S>,
        states: &[S],
        rates: &mut [S],
    ) -> S {
        let mut force = command;
        for (kind, at) in &self.effects.command {
            force = kind.command(force, &states[*at..], &mut rates[*at..], context);
        }
        force += added;
        let lost =
            |sum, (kind, at): &CableEffect| sum + kind.loss_in(force, &states[*at..], &mut rates[*at..], context);
        self.effects.loss.iter().fold(force, lost)
    }

    /// Elastic tension (N), before it is cut off at zero, at this chord and unstretched length (m).
    #[inline(always)]
    pub(crate) fn spring<S: Real>(&self, time: S, chord: S, unstretched: S, states: &[S]) -> S {
        elastic::tension(self.data, &self.effects.law, time, chord, unstretched, states)
    }

    /// The unstretched length (m) at which the cable carries `tension` (N) at rest, as [`elastic::unstretched_length`].
    pub(crate) fn unstretched_length<S: Real>(&self, time: S, chord: S, tension: S, states: &[S]) -> S {
        elastic::unstretched_length(self.data, &self.effects.law, time, chord, tension, states)
    }

    /// Damper's force (N), (33), at length and rate of the chord and the cable's own.
    #[inline(always)]
    pub(crate) fn damper<S: Real>(&self, [chord, speed]: [S; 2], [unstretched, rate]: [S; 2]) -> S {
        let strain = (chord - unstretched) / unstretched;
        self.constants.opening(self.number, strain, speed, rate) * self.data.damping / unstretched
    }

    /// Tension (N) of a cable with a mass at its winch end: spring and damper, nothing where it is slack.
    #[inline(always)]
    pub(crate) fn carried<S: Real>(&self, held: &Held<'_, S>) -> S {
        if held.slack {
            return S::from(0.0);
        }
        let spring = self.spring(held.time, held.chord[0], held.paid_out[0], held.states);
        spring + self.damper(held.chord, held.paid_out)
    }

    /// The rate (m/s) at which cable is paid out between a `spring` (N) and the `tension` (N) at the platform's end, the damper
    /// carrying the rest: the last row of (37), (40), solved.
    #[inline(always)]
    pub(crate) fn paid_out_rate<S: Real>(&self, spring: S, tension: S, [chord, speed]: [S; 2], unstretched: S) -> S {
        let (opening, strain) =
            ((tension - spring) * unstretched / self.data.damping, (chord - unstretched) / unstretched);
        (speed - opening) / (strain * self.constants.strain_damper[self.number] + 1.0)
    }

    /// Rates of the states of the elastic law under `tension` (N).
    #[inline(never)]
    pub(crate) fn law_rates<S: Real>(&self, tension: S, held: &Held<'_, S>, rates: &mut [S]) {
        let follow = self.effects.law.that_change(LawPart::Rates);
        if follow.is_empty() {
            return;
        }
        let ([chord, speed], [unstretched, rate]) = (held.chord, held.paid_out);
        let strained = !held.slack && self.data.model != CableModel::Rigid;
        let strain_rate = if strained { (speed - rate * chord / unstretched) / unstretched } else { S::from(0.0) };
        let context = StrainContext { tension, strain_rate };
        for (kind, at) in follow {
            kind.strain_rates(&context, &held.states[*at..], &mut rates[*at..]);
        }
    }

    /// Force (N) of effects on the platform across the cable of this straight part (m), under this tension and pull (N).
    #[inline(never)]
    pub(crate) fn across<S: Real>(&self, span: S, tension: S, pull: S, held: &Held<'_, S>, rates: &mut [S]) -> S {
        let turning = held.angular_rate;
        let still = |sum, kind: &EffectKind| sum + kind.transverse_force(span, turning);
        let mut force = self.effects.transverse.iter().fold(S::from(0.0), still);
        if !self.effects.swing.is_empty() {
            let tension = swing_tension(self.data.model, tension, pull, held.slack);
            let context = SwingContext { length: span, angular_rate: turning, tension };
            for (kind, at) in &self.effects.swing {
                force += kind.swing(&context, &held.states[*at..], &mut rates[*at..]);
            }
        }
        force
    }
}

/// The tension (N) of a cable that swings: where tension depends on the acceleration, the winch's pull stands for it.
#[inline]
pub(crate) fn swing_tension<S: Real>(model: CableModel, tension: S, pull: S, slack: bool) -> S {
    let tension = if model == CableModel::LumpedMass { tension } else { pull };
    if slack || tension.re() < 0.0 { S::from(0.0) } else { tension }
}
