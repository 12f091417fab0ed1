//! Inverse dynamics: the winch forces of a prescribed motion.
//!
//! The motion fixes the wrench that the cables exert on the platform, (26)-(28); redundancy is resolved by a tension
//! [`distribution`]; each cable's tension then fixes its winch force:
//!
//! - `rigid`, `massless_spring`: `u = T - ρ/2 (L L̈ - L² α̇² + L̇²)`, algebra (23), (36).
//! - `lumped_mass`: `u = T - ρ/2 (l l̈ - l² α̇² + l̇²)`, where the paid-out length follows from the tension. Without damping
//!   `l = L / (1 + T/EA)` and its rates are those of a flat system. With damping it is the stable solution of
//!   `l̇ = L̇ - (l/(b l)) (T - EA (L-l)/l)`, a pole near `-EA/(b l)`, and `l̈` the derivative of the right-hand side.
//!
//! Derivatives along the trajectory are exact: everything is evaluated on truncated Taylor series in time ([`Jet`]).
//! Effects count where the problem can be turned round; the others are refused by name.

pub mod distribution;
mod internal;
mod spline;
mod trajectory;
mod winch;
pub(crate) mod wrench;

pub use trajectory::{Ends, Motion, Samples, SplineTrajectory, Trajectory, TrajectoryError};

use std::sync::Arc;

use crate::dynamics::{Inputs, MAX_EFFECT_STATES};
use crate::effect::{EffectKind, EffectSpec, find};
use crate::formula::Variable;
use crate::integrator::{IntegrationError, Integrator};
use crate::kinematics::{self, CableKinematics};
use crate::parameters::{CableModel, ParameterError};
use crate::per_cable::PerCable;
use crate::plant::{CableEffect, Plant};
use distribution::{Bounds, DistributionError, Limits, Redundancy, Selection};
use internal::{InternalSystem, Layout};
use wrench::Prescribed;

/// Most runs in which the room inside the limits of the winch forces is found.
const ROOM_PASSES: usize = 6;
/// What may be missing of it (N).
const ROOM_LEFT: f64 = 1e-6;
/// How much more room is made than was missing.
const ROOM_FACTOR: f64 = 1.05;

/// A quantity with its first three derivatives in time.
pub type Jet = num_dual::Dual3_64;

/// Why there are no winch forces for a trajectory.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum InverseError {
    /// The effect cannot be turned round, whatever the trajectory.
    #[error("inverse dynamics cannot include effect `{effect}`: {reason}")]
    Refused {
        /// Id.
        effect: &'static str,
        /// Why.
        reason: &'static str,
    },
    /// The effect cannot be turned round at this instant.
    #[error(
        "at t = {time} s effect `{effect}`{} cannot be turned round: {reason}",
        cable.map_or(String::new(), |c| format!(" of cable {c}"))
    )]
    NotInvertible {
        /// Time (s).
        time: f64,
        /// Cable 1 to 4.
        cable: Option<usize>,
        /// Id.
        effect: &'static str,
        /// Why.
        reason: String,
    },
    /// The winch follows a speed or length with less force than the motion takes.
    #[error("at t = {time} s winch {cable} would pull with {force:.6} N, beyond its `force_limit` of {limit} N")]
    BeyondLimit {
        /// Time (s).
        time: f64,
        /// Cable, from 1.
        cable: usize,
        /// Force that it would take (N).
        force: f64,
        /// The limit (N).
        limit: f64,
    },
    /// No tensions.
    #[error("at t = {time} s: {error}")]
    Distribution {
        /// Time (s).
        time: f64,
        /// Why, with the wrench and the nearest feasible tensions.
        error: DistributionError,
    },
    /// No tensions, because of the limits of the winch forces.
    #[error(
        "at t = {time} s, with the tension of {} narrowed by the limits of the winch force: {error}",
        cables_named(.cables)
    )]
    Narrowed {
        /// Time (s).
        time: f64,
        /// The cables (from 1) whose tensions they narrow.
        cables: Vec<usize>,
        /// Why, with the wrench and the nearest feasible tensions.
        error: DistributionError,
    },
    /// The limits of a winch force and the bounds of its cable's tension exclude each other.
    #[error(
        "at t = {time} s winch {cable} keeps within the limits of its force with tensions from {least:.6} to {most:.6} N, \
         of which none is within the bounds of tension"
    )]
    NoTension {
        /// Time (s).
        time: f64,
        /// Cable, from 1.
        cable: usize,
        /// The least tension that the force's limits leave (N).
        least: f64,
        /// The largest (N).
        most: f64,
    },
    /// The trajectory leaves the space between the anchors.
    #[error("at t = {time} s: {error}")]
    Pose {
        /// Time (s).
        time: f64,
        /// What is wrong with the pose.
        error: ParameterError,
    },
    /// A time outside the trajectory, or times that do not increase.
    #[error("t = {time} s is outside the trajectory or not above the time before it")]
    Time {
        /// Time (s).
        time: f64,
    },
    /// The paid-out lengths could not be integrated.
    #[error("the paid-out lengths could not be integrated: {0}")]
    Integration(IntegrationError),
}

/// Cables (from 1) as an error names them.
fn cables_named(cables: &[usize]) -> String {
    let numbers: Vec<String> = cables.iter().map(usize::to_string).collect();
    format!("{} {}", if cables.len() == 1 { "cable" } else { "cables" }, numbers.join(", "))
}

/// The answer at one instant. SI units.
#[derive(Clone, Debug, PartialEq)]
pub struct Instant {
    /// Time (s).
    pub time: f64,
    /// The prescribed motion.
    pub motion: Motion,
    /// Wrench that the tensions exert `[f_x, f_y, τ]` (N, N m).
    pub wrench: [f64; 3],
    /// Tensions `T_i` (N).
    pub tension: PerCable<f64>,
    /// Their rates (N/s).
    pub tension_rate: PerCable<f64>,
    /// Which cables sit at a bound.
    pub selection: Selection,
    /// Paid-out (unstretched) lengths `l_i` (m); the cable length in a rigid cable.
    pub unstretched: PerCable<f64>,
    /// Their rates (m/s).
    pub unstretched_rate: PerCable<f64>,
    /// Their accelerations (m/s²).
    pub unstretched_acceleration: PerCable<f64>,
    /// Winch forces `u_i` (N), pull-positive.
    pub winch_force: PerCable<f64>,
    /// What the winches are told, in the unit of the model's command: the forces, torques (N m), speeds (m/s) or lengths (m).
    pub command: PerCable<f64>,
    /// The plant's states at this instant, laid out as in [`Plant::rates`]: a forward simulation from here stays on the
    /// trajectory.
    pub states: Vec<f64>,
}

impl Instant {
    /// The plant's inputs at this instant.
    pub fn inputs(&self) -> Inputs {
        Inputs { winch_force: self.command, disturbance: self.motion.disturbance.map(|d| d[0]) }
    }
}

/// Inverse dynamics of a plant along a trajectory.
#[derive(Clone)]
pub struct InverseDynamics<'a> {
    plant: Arc<Plant>,
    trajectory: &'a dyn Trajectory,
    redundancy: &'a dyn Redundancy,
    /// The least and the largest winch force (N).
    forces: Option<[f64; 2]>,
    /// How far inside them (N) the tensions aim, for what their own change takes.
    room: [f64; 2],
    layout: Layout,
}

/// Everything algebraic at one instant.
struct Rigid {
    motion: Motion,
    prescribed: Prescribed<Jet>,
    length: PerCable<Jet>,
    speed: PerCable<Jet>,
    acceleration: PerCable<Jet>,
    angular_rate: PerCable<Jet>,
    wrench: [f64; 3],
    tension: PerCable<Jet>,
    selection: Selection,
}

impl<'a> InverseDynamics<'a> {
    /// The problem of driving `plant` along `trajectory`, redundancy resolved by `redundancy`: (28) or (41) solved for the
    /// forces.
    ///
    /// # Errors
    /// [`InverseError::Refused`] for effects that cannot be turned round: dead times, swinging cables, what begins or ends along
    /// the trajectory, and expressions on the platform that depend on what is sought.
    pub fn new(
        plant: Arc<Plant>,
        trajectory: &'a dyn Trajectory,
        redundancy: &'a dyn Redundancy,
    ) -> Result<Self, InverseError> {
        let [first, last] = trajectory.span();
        let switches = |spec: &EffectSpec| [spec.from, spec.until].iter().flatten().any(|t| first < *t && *t <= last);
        let mut switched = plant.effects().iter().filter(|spec| switches(spec));
        if let Some(info) = switched.find_map(|spec| find(&spec.id)) {
            return Err(InverseError::Refused {
                effect: info.id,
                reason: "it begins or ends along the trajectory; ask for the trajectory before and after",
            });
        }
        let plant =
            if plant.next_switch(f64::NEG_INFINITY).is_some() { Arc::new(plant.at(first).clone()) } else { plant };
        for (cable, data) in plant.cable.iter().zip(&plant.data().cables) {
            if let Some((kind, reason)) = cable.command.iter().find_map(|(kind, _)| Some((kind, kind.no_inverse()?))) {
                return Err(InverseError::Refused { effect: kind.info().id, reason });
            }
            if cable.delay > 0.0 {
                return Err(InverseError::Refused {
                    effect: "winch_delay",
                    reason: "leave it out and send the forces earlier by the dead time",
                });
            }
            if cable.command.iter().filter(|(kind, _)| kind.states() > 0).count() > 1
                || cable.command.iter().any(|(kind, _)| kind.states() > 1)
            {
                return Err(InverseError::Refused {
                    effect: "winch_lag",
                    reason: "more than one lag in a row needs more derivatives than are kept",
                });
            }
            let follows = |(kind, _): &&CableEffect| kind.follows_strain_rate();
            let undamped = data.model != CableModel::Rigid && data.damping == 0.0;
            if let Some((kind, _)) = cable.law.iter().find(follows).filter(|_| undamped) {
                return Err(InverseError::Refused {
                    effect: kind.info().id,
                    reason: "it takes a cable with damping, by which the length has a rate",
                });
            }
            if !cable.swing.is_empty() {
                return Err(InverseError::Refused {
                    effect: "cable_transverse_mode",
                    reason: "a cable that swings on has no forces that follow from the motion alone",
                });
            }
        }
        for kind in &plant.wrench {
            let EffectKind::Expression(expression) = kind else { continue };
            let sought = |v| {
                matches!(v, Variable::WinchForce(_) | Variable::UnstretchedLength(_) | Variable::UnstretchedRate(_))
            };
            if expression.formula().uses(sought) {
                return Err(InverseError::Refused {
                    effect: "expression",
                    reason: "a term on the platform that depends on winch forces or unstretched lengths",
                });
            }
        }
        let lagged = plant.cable.iter().any(|c| c.command.iter().any(|(kind, _)| kind.states() > 0));
        if lagged && plant.winch_terms_use_forces() {
            return Err(InverseError::Refused {
                effect: "expression",
                reason: "a term on a winch that depends on winch forces, together with a lag",
            });
        }
        let layout = Layout::new(&plant);
        Ok(Self { plant, trajectory, redundancy, forces: None, room: [0.0; 2], layout })
    }

    /// The same with winch forces from `least` to `most` (N), which may be infinite. They narrow the bounds of each tension by what
    /// the cable's inertia and the winch's losses take at that instant.
    ///
    /// In elastic cables the force also depends on how fast the tension changes; for that [`InverseDynamics::with_room`] leaves room.
    ///
    /// # Errors
    /// `most` not above `least`.
    pub fn within_forces(mut self, least: f64, most: f64) -> Result<Self, ParameterError> {
        if least.is_nan() || most.is_nan() || most <= least {
            return Err(ParameterError::new("force_max", most, format!("a number above `force_min` ({least})")));
        }
        self.forces = Some([least, most]);
        Ok(self)
    }

    /// The same with tensions that aim so far inside the limits of the winch forces that what the tensions' own change takes in elastic
    /// cables has room at these times (s). The room is the same all along the motion, so that it changes no tension's rate. Where
    /// there are no tensions with that room, or no end to it as at a kink, none is left, and forces may be beyond their limits.
    ///
    /// # Errors
    /// As [`InverseDynamics::run`].
    pub fn with_room(mut self, times: &[f64], relative_tolerance: f64) -> Result<Self, InverseError> {
        let Some([least, most]) = self.forces else { return Ok(self) };
        for pass in 0..ROOM_PASSES {
            let mut beyond = [0.0_f64; 2];
            let run = self.each::<InverseError>(times, relative_tolerance, |instant| {
                for force in instant.winch_force {
                    beyond = [beyond[0].max(least - force), beyond[1].max(force - most)];
                }
                Ok(())
            });
            match run {
                Err(error) if pass == 0 => return Err(error),
                Err(_) => break,
                Ok(()) if beyond.iter().all(|force| *force <= ROOM_LEFT) => return Ok(self),
                Ok(()) => (0..2).for_each(|side| self.room[side] += ROOM_FACTOR * beyond[side]),
            }
        }
        self.room = [0.0; 2];
        Ok(self)
    }

    /// Number of internal states: paid-out lengths of damped elastic cables, and states of elastic laws.
    pub fn internal_dimension(&self) -> usize {
        self.layout.dimension()
    }

    /// Internal states at `time` (s) on the slow solution, where the fast pole has long decayed; creep has settled.
    ///
    /// # Errors
    /// As [`InverseDynamics::at`].
    pub fn start(&self, time: f64) -> Result<Vec<f64>, InverseError> {
        let rigid = self.rigid(time)?;
        let mut states = vec![0.0; self.layout.dimension()];
        self.layout.start(&self.plant, &rigid.elastic(), &mut states);
        Ok(states)
    }

    /// Rates of the internal states at `time` (s): the last row of (37), (40) solved for the paid-out rate.
    ///
    /// # Errors
    /// As [`InverseDynamics::at`].
    pub fn internal_rates(&self, time: f64, states: &[f64], rates: &mut [f64]) -> Result<(), InverseError> {
        let rigid = self.rigid(time)?;
        self.layout.rates(&self.plant, &rigid.elastic(), states, rates);
        Ok(())
    }

    /// Pose, wrench and tensions at `time` (s), with derivatives.
    fn rigid(&self, time: f64) -> Result<Rigid, InverseError> {
        let [first, last] = self.trajectory.span();
        let slack = 1e-9 * (last - first);
        if !(time >= first - slack && time <= last + slack) {
            return Err(InverseError::Time { time });
        }
        let motion = self.trajectory.motion(time);
        let pose = motion.derivative(0);
        self.plant.geometry().check_pose(&pose).map_err(|error| InverseError::Pose { time, error })?;
        let prescribed = Prescribed {
            time: Jet::new(time, 1.0, 0.0, 0.0),
            pose: motion.jets(0),
            twist: motion.jets(1),
            acceleration: motion.jets(2),
            disturbance: motion.disturbance_jets(),
        };
        let cables = kinematics::cables(self.plant.geometry(), &prescribed.pose, &prescribed.twist);
        let omega = prescribed.twist[2];
        let wrench = wrench::required(&self.plant, &prescribed, &cables);
        let rows = distribution::rows(&cables);
        let structure = nalgebra::Matrix3xX::from_fn(rows.len(), |r, c| -rows[c][r].re);
        let asked = wrench.map(|w| w.re);
        let distribution = self.redundancy.distribution();
        let limits = self.limits(&distribution.bounds, &prescribed, &cables)?;
        let real = limits.map(|limits| limits.map(|limit| limit.re));
        let at = |error| {
            let bounds = [distribution.bounds.lower(), distribution.bounds.upper()];
            let cables: Vec<usize> = (0..real.len()).filter(|i| real[*i] != bounds).map(|i| i + 1).collect();
            if cables.is_empty() {
                InverseError::Distribution { time, error }
            } else {
                InverseError::Narrowed { time, cables, error }
            }
        };
        let (selection, tension) = self.redundancy.select_within(&structure, &asked, &real).map_err(at)?;
        let tension = distribution.lift(&rows, &wrench, &limits, (&selection, &tension)).map_err(at)?;
        Ok(Rigid {
            motion,
            length: cables.map(|c| c.length),
            speed: cables.map(|c| c.speed),
            acceleration: cables.map(|c| c.length_acceleration(&prescribed.acceleration, omega)),
            angular_rate: cables.map(|c| c.angular_rate),
            wrench: asked,
            tension,
            selection,
            prescribed,
        })
    }

    /// What the tensions may be: within the bounds, and such that the winch forces are within theirs.
    fn limits(
        &self,
        bounds: &Bounds,
        motion: &Prescribed<Jet>,
        cables: &PerCable<CableKinematics<Jet>>,
    ) -> Result<Limits<Jet>, InverseError> {
        let plant = &*self.plant;
        let mut limits = bounds.of_each(plant.cables()).map(|limits| limits.map(Jet::from));
        let Some([least, most]) = self.forces else { return Ok(limits) };
        let forces = [least + self.room[0], most - self.room[1]];
        let (lengths, speeds) = (cables.map(|c| c.length), cables.map(|c| c.speed));
        let inputs = Inputs { winch_force: cables.map(|_| Jet::from(0.0)), disturbance: motion.disturbance };
        let context = motion.context(plant.geometry(), &inputs, [&lengths, &speeds], [&lengths, &speeds]);
        for (i, [lower, upper]) in limits.iter_mut().enumerate() {
            let tension = |force: f64| winch::tension_under(plant, i, force, motion, &cables[i], &context);
            let [least, most] = forces.map(|force| if force.is_finite() { tension(force) } else { force.into() });
            if least.re > lower.re {
                *lower = least;
            }
            if most.re < upper.re {
                *upper = most;
            }
            if upper.re <= lower.re {
                let (time, cable) = (motion.time.re, i + 1);
                return Err(InverseError::NoTension { time, cable, least: least.re, most: most.re });
            }
        }
        Ok(limits)
    }

    /// The answer at `time` (s) for these internal states (see [`InverseDynamics::start`]): wrench (26), (27), tensions, winch
    /// forces (23), (36).
    ///
    /// # Errors
    /// A time outside the trajectory, a pose outside the anchors, no feasible tensions, an effect that cannot be turned
    /// round there.
    pub fn at(&self, time: f64, internal: &[f64]) -> Result<Instant, InverseError> {
        let plant = &*self.plant;
        let rigid = self.rigid(time)?;
        let elastic = self.layout.jets(plant, &rigid.elastic(), internal);
        let mut pull = rigid.tension;
        let (mut unstretched, mut rate, mut winch_speed) = (rigid.length, rigid.speed, rigid.speed);
        let mut acceleration = rigid.acceleration.map(|a| a.re);
        for i in 0..plant.cables() {
            let cable = &plant.data().cables[i];
            if cable.model != CableModel::Rigid {
                let l = elastic.unstretched[i];
                unstretched[i] = l;
                rate[i] = Jet::new(l.v1, l.v2, l.v3, 0.0);
                acceleration[i] = l.v2;
            }
            // The cable's inertia moves with its paid-out end, or with the platform where that end has no mass.
            let (length, speed, second) = if cable.model == CableModel::LumpedMass {
                let l = elastic.unstretched[i];
                winch_speed[i] = rate[i];
                (l, rate[i], Jet::new(l.v2, l.v3, 0.0, 0.0))
            } else {
                (rigid.length[i], rigid.speed[i], rigid.acceleration[i])
            };
            pull[i] -= plant.chain(i).axial_force([length, speed, second], rigid.angular_rate[i]);
        }
        let inputs = Inputs {
            winch_force: PerCable::filled(plant.cables(), Jet::from(0.0)),
            disturbance: rigid.prescribed.disturbance,
        };
        // As the forward evaluation has it: the rate is a state only where the paid-out end has a mass.
        let (chord, paid_out) = ([&rigid.length, &rigid.speed], [&unstretched, &winch_speed]);
        let context = rigid.prescribed.context(plant.geometry(), &inputs, chord, paid_out);
        let winch = winch::forces(plant, &pull, &context)?;
        let command = winch::commands(plant, &winch.force, &rigid, &unstretched)?;
        let mut states = vec![0.0; plant.dimension()];
        for k in 0..3 {
            states[k] = rigid.motion.pose[k][0];
            states[3 + k] = rigid.motion.pose[k][1];
        }
        for i in 0..plant.cables() {
            if let Some(at) = plant.unstretched_index(i) {
                states[at] = unstretched[i].re;
            }
            if let Some(at) = plant.rate_index(i) {
                states[at] = rate[i].re;
            }
            let range = plant.effect_states(i);
            let mut values: [f64; MAX_EFFECT_STATES] = winch.states[i];
            for (kind, at) in &plant.cable[i].law {
                for k in *at..*at + kind.states() {
                    values[k] = elastic.states[i][k].re;
                }
            }
            let n = range.len();
            states[range].copy_from_slice(&values[..n]);
        }
        Ok(Instant {
            time,
            motion: rigid.motion,
            wrench: rigid.wrench,
            tension: rigid.tension.map(|t| t.re),
            tension_rate: rigid.tension.map(|t| t.v1),
            selection: rigid.selection,
            unstretched: unstretched.map(|l| l.re),
            unstretched_rate: rate.map(|l| l.re),
            unstretched_acceleration: acceleration,
            winch_force: winch.force,
            command,
            states,
        })
    }

    /// The answer at each of `times` (s, increasing, within the trajectory), internal states integrated at
    /// `relative_tolerance` from their slow solution at the first.
    ///
    /// # Errors
    /// As [`InverseDynamics::at`]; a failed integration.
    pub fn run(&self, times: &[f64], relative_tolerance: f64) -> Result<Vec<Instant>, InverseError> {
        let mut answers = Vec::with_capacity(times.len());
        self.each::<InverseError>(times, relative_tolerance, |instant| {
            answers.push(instant);
            Ok(())
        })?;
        Ok(answers)
    }

    /// As [`InverseDynamics::run`], but each answer goes to `take` as soon as it is there, and none is kept.
    ///
    /// # Errors
    /// As [`InverseDynamics::run`], and those of `take`, which end the run.
    pub fn each<E: From<InverseError>>(
        &self,
        times: &[f64],
        relative_tolerance: f64,
        mut take: impl FnMut(Instant) -> Result<(), E>,
    ) -> Result<(), E> {
        let Some(first) = times.first() else { return Ok(()) };
        // The first time without an answer is told, before an integration stumbles somewhere in between.
        for &time in times {
            self.rigid(time)?;
        }
        let mut internal = self.start(*first)?;
        let mut integrator = Integrator::new(internal.len(), 0, relative_tolerance);
        let mut now = None;
        for &time in times {
            let before = now.replace(time).unwrap_or(f64::NEG_INFINITY);
            if time <= before {
                return Err(InverseError::Time { time }.into());
            }
            if before.is_finite() && !internal.is_empty() {
                let mut system = InternalSystem::new(self, &internal);
                let result = integrator.advance(&mut system, before, &mut internal, time - before);
                system.failure()?;
                result.map_err(InverseError::Integration)?;
            }
            take(self.at(time, &internal)?)?;
        }
        Ok(())
    }
}

impl Rigid {
    /// What the elastic side of the cables depends on.
    fn elastic(&self) -> internal::Drive {
        internal::Drive { time: self.prescribed.time, length: self.length, speed: self.speed, tension: self.tension }
    }
}

impl Plant {
    /// Whether some expression on a winch depends on winch forces.
    pub(crate) fn winch_terms_use_forces(&self) -> bool {
        self.cable.iter().flat_map(|c| &c.pull).any(|kind| match kind {
            EffectKind::Expression(e) => e.formula().uses(|v| matches!(v, Variable::WinchForce(_))),
            _ => false,
        })
    }
}

#[cfg(test)]
mod tests;
