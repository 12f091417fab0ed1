//! The plant: parameters and effects put together, with the layout of its states.

mod assembly;
mod cost;
mod rest;

use std::sync::OnceLock;

use assembly::Assembly;

use crate::clearance::Clearance;
use crate::dynamics::{CableConstants, CableData, ElasticLaw, Inputs, MAX_EFFECT_STATES, PlantData};
use crate::effect::{EffectKind, EffectSpec, SpecError, Stage};
use crate::geometry;
use crate::kinematics::CableEnds;
use crate::length_sensor::LengthSensor;
use crate::parameters::{CableModel, ParameterError, Parameters};
use crate::pose_sensor::PoseSensor;
use crate::scalar::Real;
use crate::winch::WinchCommand;

/// A model that cannot be built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlantError {
    /// A parameter out of its range.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// An effect that makes no sense.
    #[error(transparent)]
    Effect(#[from] SpecError),
    /// The same effect twice on one cable at one time.
    #[error(
        "effect `{id}` is given twice for {place}, and both are in force {during}; expected one entry, or times `from` and \
         `until` that do not overlap"
    )]
    Twice {
        /// Id.
        id: String,
        /// The cable, or the whole plant.
        place: String,
        /// When both are in force.
        during: String,
    },
    /// More effect states on one cable than are kept.
    #[error("cable {cable} has {found} effect states, expected {MAX_EFFECT_STATES} or fewer")]
    TooManyStates {
        /// Cable, from 1.
        cable: usize,
        /// States found.
        found: usize,
    },
}

/// An effect on one cable, and where its states begin among the cable's effect states.
pub(crate) type CableEffect = (EffectKind, usize);

/// The effects of one cable, sorted by stage.
#[derive(Clone, Debug, Default)]
pub(crate) struct CableEffects {
    pub(crate) command: Vec<CableEffect>,
    pub(crate) loss: Vec<CableEffect>,
    pub(crate) pull: Vec<EffectKind>,
    pub(crate) law: ElasticLaw,
    pub(crate) transverse: Vec<EffectKind>,
    pub(crate) swing: Vec<CableEffect>,
    pub(crate) states: usize,
    /// Dead time of the winch command (s).
    pub(crate) delay: f64,
    pub(crate) unstretched_sensor: LengthSensor,
    /// Measured length of the chord as `(factor, bias)` of the true one.
    pub(crate) length_sensor: (f64, f64),
    /// The measured tension likewise.
    pub(crate) tension_sensor: (f64, f64),
}

impl CableEffects {
    /// What the sensor of the chord's length shows of this length (m).
    #[inline]
    pub(crate) fn shown_length<S: Real>(&self, length: S) -> S {
        let (factor, bias) = self.length_sensor;
        length * factor + bias
    }

    /// What the sensor of the tension shows of this tension (N).
    #[inline]
    pub(crate) fn shown_tension<S: Real>(&self, tension: S) -> S {
        let (factor, bias) = self.tension_sensor;
        tension * factor + bias
    }

    /// Whether nothing changes the cable's equations; its numbers may be changed.
    pub(crate) fn is_empty(&self) -> bool {
        self.command.is_empty()
            && self.loss.is_empty()
            && self.pull.is_empty()
            && self.law.is_empty()
            && self.transverse.is_empty()
            && self.swing.is_empty()
    }
}

/// Where an effect keeps its own states on one cable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EffectStates {
    /// Index among the plant's effects.
    pub effect: usize,
    /// Where it acts on the cable.
    pub stage: Stage,
    /// The cable (from 0).
    pub cable: usize,
    /// First of its states within [`Plant::effect_states`] of that cable.
    pub first: usize,
    /// Number of its states there.
    pub count: usize,
}

/// Parameters and effects, checked and ready to be evaluated. Immutable; shared by any number of simulations.
#[derive(Clone, Debug)]
pub struct Plant {
    parameters: Parameters,
    effects: Vec<EffectSpec>,
    pub(crate) data: PlantData,
    pub(crate) cable: Vec<CableEffects>,
    pub(crate) wrench: Vec<EffectKind>,
    pub(crate) pose_sensor: PoseSensor,
    pub(crate) pose_delay: f64,
    states_of_effects: Vec<EffectStates>,
    /// Index of each cable's first state.
    pub(crate) offset: Vec<usize>,
    dimension: usize,
    pub(crate) constants: CableConstants,
    pub(crate) ends: CableEnds,
    clearance: Clearance,
    pub(crate) has: Has,
    /// It has nothing of that.
    pub(crate) plain: bool,
    /// Winch forces do nothing but accelerate the ends of their own cables.
    pub(crate) pulls_apart: bool,
    /// The plant between the times at which effects begin or end: each from when on (s), the first before all time. Empty where
    /// none does; then this plant is the one there is.
    phases: Vec<(f64, Self)>,
    fingerprint: OnceLock<u64>,
}

/// What there is to compute, so that an evaluation passes over the rest.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Has {
    /// Effects that add a wrench on the platform or a force along a cable.
    pub(crate) force: bool,
    /// Effects on an elastic law.
    pub(crate) law: bool,
    /// Effects that are a force across a cable.
    pub(crate) across: bool,
    /// Winches that make their own force to follow a speed or a length.
    pub(crate) servo: bool,
    /// Winches that are commanded by torque.
    pub(crate) torque: bool,
    /// Cables that leave pulleys of finite radius.
    pub(crate) pulley: bool,
    /// Cables with a mass at the platform's end.
    pub(crate) end_mass: bool,
    /// Cables whose tension depends on the platform's acceleration (rigid, massless spring).
    pub(crate) platform_side: bool,
    /// Effects with states of their own.
    pub(crate) states: bool,
}

impl Has {
    /// Whether every cable has its length and rate for states and no others, so that they follow each other.
    #[inline(always)]
    pub(crate) fn only_pairs(self) -> bool {
        !(self.platform_side || self.states)
    }
}

#[cfg(test)]
thread_local! {
    /// Plants that this thread has built: each compiles its formulas anew, so they are to be few.
    pub(crate) static BUILT: std::cell::Cell<usize> = const { std::cell::Cell::new(0) };
}

impl Plant {
    /// Puts parameters and effects together.
    ///
    /// # Errors
    /// A parameter or effect out of range, an effect twice on one cable at one time, too many effect states, an effect that begins or
    /// ends and with which the plant has other states than without.
    pub fn new(parameters: Parameters, effects: Vec<EffectSpec>) -> Result<Self, PlantError> {
        #[cfg(test)]
        BUILT.set(BUILT.get() + 1);
        parameters.check()?;
        check_unique(&effects)?;
        let mut plant = Self::at_time(parameters, effects, None)?;
        let mut switches: Vec<f64> = plant.effects.iter().flat_map(|spec| [spec.from, spec.until]).flatten().collect();
        if switches.is_empty() {
            return Ok(plant);
        }
        switches.push(f64::NEG_INFINITY);
        switches.sort_by(f64::total_cmp);
        switches.dedup();
        for from in switches {
            let phase = Self::at_time(plant.parameters.clone(), plant.effects.clone(), Some(from))?;
            let same = |(a, b): (&CableData, &CableData)| a.model == b.model;
            if !phase.data.cables.iter().zip(&plant.data.cables).all(same) {
                let switched = |spec: &&EffectSpec| {
                    spec.is_switched() && spec.info().is_ok_and(|info| info.nature().gives_winch_mass)
                };
                let id = plant.effects.iter().find(switched).map_or("", |spec| spec.id.as_str());
                let message = "takes no `from` and no `until` here: without it the cable has no mass, and other states";
                return Err(SpecError::new(id, message).into());
            }
            plant.phases.push((from, phase));
        }
        Ok(plant)
    }

    /// With those effects in force that are at `time` (s), or with all of them. Effects that are not in force have their states
    /// all the same.
    fn at_time(parameters: Parameters, effects: Vec<EffectSpec>, time: Option<f64>) -> Result<Self, PlantError> {
        let cables = parameters.cables();
        let mut assembly = Assembly::new(&parameters);
        let mut kinds = Vec::with_capacity(effects.len());
        for spec in &effects {
            spec.check_on(cables)?;
            kinds.push(EffectKind::new(spec)?);
        }
        // What sets the numbers that others scale comes first, whatever the order in the file.
        let mut order: Vec<usize> = (0..kinds.len()).collect();
        order.sort_by_key(|effect| !kinds[*effect].sets_what_others_scale());
        for effect in order {
            let spec = &effects[effect];
            let in_force = time.is_none_or(|time| spec.in_force(time));
            assembly.take(effect, spec, kinds[effect].clone(), in_force);
        }
        let Assembly { mut data, mut cable, wrench, pose_sensor, pose_delay, states_of_effects } = assembly;
        for effects in &mut cable {
            effects.command.sort_by_key(|(kind, _)| match kind.stage() {
                Stage::Command(order) => order,
                _ => u8::MAX,
            });
        }
        for c in &mut data.cables {
            // Without any mass at the winch the lumped model has no second state: its limit is the massless spring.
            if c.model == CableModel::LumpedMass && c.axial_density() + c.drum_mass == 0.0 {
                c.model = CableModel::MasslessSpring;
            }
        }
        // Effects that are never in force together need not make sense together.
        if time.is_some() || !effects.iter().any(EffectSpec::is_switched) {
            check_data(&data)?;
        }
        let mut dimension = 6;
        let mut offset = Vec::with_capacity(cables);
        for (data, effects) in data.cables.iter().zip(&cable) {
            offset.push(dimension);
            dimension += axial_states(data.model) + effects.states;
        }
        if let Some(i) = cable.iter().position(|c| c.states > MAX_EFFECT_STATES) {
            return Err(PlantError::TooManyStates { cable: i + 1, found: cable[i].states });
        }
        let on_cable = |c: &CableEffects| !(c.command.is_empty() && c.loss.is_empty() && c.pull.is_empty());
        let command = parameters.winch.command;
        // From any anchor to the far end of a platform at any other.
        let longest = 2.0 * (data.geometry.size() + data.geometry.attachment_scale());
        for (spec, kind) in effects.iter().zip(&kinds) {
            let checked = kind.check_command(command).and_then(|()| kind.check_length(longest));
            checked.map_err(|message| SpecError::new(&spec.id, message))?;
        }
        if command.is_servo() {
            check_servo(&data)?;
        }
        let has = Has {
            force: command.is_servo() || !wrench.is_empty() || cable.iter().any(on_cable),
            servo: command.is_servo(),
            torque: command == WinchCommand::Torque,
            law: cable.iter().any(|c| !c.law.is_empty()),
            across: cable.iter().any(|c| !(c.transverse.is_empty() && c.swing.is_empty())),
            pulley: data.geometry.pulley_radius.iter().any(|r| *r != 0.0),
            end_mass: data.cables.iter().any(|c| c.end_density != 0.0),
            states: cable.iter().any(|c| c.states > 0),
            platform_side: data.cables.iter().any(|c| c.model != CableModel::LumpedMass),
        };
        let reads_inputs = effects.iter().any(|spec| spec.expression.is_some());
        let by_force = !(has.servo || has.torque || reads_inputs || cable.iter().any(on_cable));
        let constants = CableConstants::new(&data.cables);
        let ends = CableEnds::new(&data.geometry);
        let clearance = Clearance::new(&data.geometry);
        Ok(Self {
            parameters,
            effects,
            data,
            cable,
            wrench,
            pose_sensor,
            pose_delay,
            states_of_effects,
            offset,
            dimension,
            constants,
            ends,
            clearance,
            has,
            plain: has == Has::default(),
            pulls_apart: by_force && !has.platform_side,
            phases: Vec::new(),
            fingerprint: OnceLock::new(),
        })
    }

    /// The plant with the effects that are in force at `time` (s). It has the same states at all times.
    #[inline]
    pub fn at(&self, time: f64) -> &Self {
        self.phases.iter().rev().find(|(from, _)| *from <= time).map_or(self, |(_, phase)| phase)
    }

    /// The next time after `time` (s) at which an effect begins or ends.
    #[inline]
    pub fn next_switch(&self, time: f64) -> Option<f64> {
        self.phases.iter().map(|(from, _)| *from).find(|from| *from > time)
    }

    /// The parameters it was built from.
    pub fn parameters(&self) -> &Parameters {
        &self.parameters
    }

    /// The effects it was built from.
    pub fn effects(&self) -> &[EffectSpec] {
        &self.effects
    }

    /// The numbers that the equations use, parameter effects included; those of one time are those of [`Plant::at`] it.
    pub fn data(&self) -> &PlantData {
        &self.data
    }

    /// Anchors and attachment points, offsets included.
    pub fn geometry(&self) -> &geometry::Geometry {
        &self.data.geometry
    }

    /// As [`geometry::Geometry::holds`] at `pose` (m, rad), faster at most poses.
    pub(crate) fn holds(&self, pose: &[f64; 3]) -> bool {
        self.clearance.holds(&self.data.geometry, pose)
    }

    /// As [`geometry::Geometry::blocked_cable`] at `pose` (m, rad), faster at most poses.
    pub(crate) fn blocked_cable(&self, pose: &[f64; 3]) -> Option<usize> {
        self.clearance.blocked_cable(&self.data.geometry, pose)
    }

    /// Number of cables.
    #[inline]
    pub fn cables(&self) -> usize {
        self.data.cables.len()
    }

    /// Number of states.
    pub fn dimension(&self) -> usize {
        self.dimension
    }

    /// A number that differs between plants of different parameters or effects: which plant a saved state belongs to.
    pub(crate) fn fingerprint(&self) -> u64 {
        // FNV-1a over the text of the model; written once, so that saving stays cheap.
        *self.fingerprint.get_or_init(|| {
            let text = format!("{:?} {:?}", self.parameters, self.effects);
            text.bytes()
                .fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
        })
    }

    /// What is measured of the pose, delays aside.
    pub fn pose_sensor(&self) -> &PoseSensor {
        &self.pose_sensor
    }

    /// How what the sensors of `cable` (from 0) show changes with its length and with its unstretched length, at this unstretched
    /// length (m).
    pub fn length_sensor_slopes(&self, cable: usize, unstretched: f64) -> [f64; 2] {
        [self.cable[cable].length_sensor.0, self.cable[cable].unstretched_sensor.slope(unstretched)]
    }

    /// What they show of this length and this unstretched length (m).
    pub fn shown_lengths(&self, cable: usize, length: f64, unstretched: f64) -> [f64; 2] {
        [self.cable[cable].shown_length(length), self.cable[cable].unstretched_sensor.shown(unstretched)]
    }

    /// What they show too much (m).
    pub fn length_sensor_biases(&self, cable: usize) -> [f64; 2] {
        [self.cable[cable].length_sensor.1, self.cable[cable].unstretched_sensor.bias]
    }

    /// Index of the unstretched length of `cable` (from 0) among the states; `None` for a rigid cable.
    pub fn unstretched_index(&self, cable: usize) -> Option<usize> {
        (axial_states(self.data.cables[cable].model) > 0).then(|| self.offset[cable])
    }

    /// Whether a cable is wound in to its end: no equation holds where an unstretched length is not positive.
    pub(crate) fn wound_in(&self, y: &[f64]) -> bool {
        (0..self.cables()).any(|i| self.unstretched_index(i).is_some_and(|at| y[at] <= 0.0))
    }

    /// Index of the rate of the unstretched length of `cable` (from 0); `None` where it is no state.
    pub fn rate_index(&self, cable: usize) -> Option<usize> {
        (axial_states(self.data.cables[cable].model) > 1).then(|| self.offset[cable] + 1)
    }

    /// Range of the effect states of `cable` (from 0) among the states.
    pub fn effect_states(&self, cable: usize) -> std::ops::Range<usize> {
        let start = self.offset[cable] + axial_states(self.data.cables[cable].model);
        start..start + self.cable[cable].states
    }

    /// Ranges of the cables' own states among the states, those of effects included.
    pub(crate) fn states_of_cables(&self) -> Vec<std::ops::Range<usize>> {
        (0..self.cables()).map(|cable| self.offset[cable]..self.effect_states(cable).end).collect()
    }

    /// The states that belong to effects, in the order of the effects.
    pub fn states_of_effects(&self) -> &[EffectStates] {
        &self.states_of_effects
    }

    /// The commands as the winches make them: forces (N) in place of torques; the command of a servo stays what it is.
    pub fn driven<S: Real>(&self, commands: &Inputs<S>) -> Inputs<S> {
        let mut inputs = *commands;
        if self.has.torque {
            for (force, cable) in inputs.winch_force.iter_mut().zip(&self.data.cables) {
                *force *= cable.winch.force_per_command();
            }
        }
        inputs
    }
}

/// Axial states of a cable model.
pub(crate) fn axial_states(model: CableModel) -> usize {
    match model {
        CableModel::Rigid => 0,
        CableModel::MasslessSpring => 1,
        CableModel::LumpedMass => 2,
    }
}

fn check_unique(effects: &[EffectSpec]) -> Result<(), PlantError> {
    for (k, spec) in effects.iter().enumerate() {
        if spec.info()?.nature().repeats {
            continue;
        }
        let alike = |other: &&EffectSpec| {
            other.id == spec.id
                && (other.cable == spec.cable || other.cable.is_none() || spec.cable.is_none())
                && other.channel == spec.channel
        };
        if let Some((from, until)) = effects[..k].iter().filter(alike).find_map(|other| spec.common_time(other)) {
            let place = spec.cable.map_or("all cables or the whole plant".to_owned(), |c| format!("cable {c}"));
            let during = match (from, until) {
                (None, None) => "all the time".to_owned(),
                (Some(from), None) => format!("from {from} s on"),
                (None, Some(until)) => format!("until {until} s"),
                (Some(from), Some(until)) => format!("from {from} s until {until} s"),
            };
            return Err(PlantError::Twice { id: spec.id.clone(), place, during });
        }
    }
    Ok(())
}

/// A servo needs a winch end with a motion and a mass.
fn check_servo(data: &PlantData) -> Result<(), PlantError> {
    for (i, cable) in data.cables.iter().enumerate() {
        if cable.model != CableModel::LumpedMass {
            let key = format!("rotor_inertia of winch {}", i + 1);
            let expected = "greater than 0: a servo has nothing to move where cable and rotor have no mass";
            return Err(ParameterError::new(key, 0, expected).into());
        }
    }
    Ok(())
}

/// Effects can push a parameter out of its range; the plant as a whole must still make sense.
fn check_data(data: &PlantData) -> Result<(), ParameterError> {
    let positive = |key: &str, value: f64| {
        if value > 0.0 && value.is_finite() {
            Ok(())
        } else {
            Err(ParameterError::new(key, value, "greater than 0 with the effects included"))
        }
    };
    for i in 0..data.cables.len() {
        let (anchor, end) = (data.geometry.anchor[i], data.geometry.attachment[i]);
        let radius = data.geometry.pulley_radius[i];
        if radius != 0.0 && radius.abs() >= (end[0] - anchor[0]).hypot(end[1] - anchor[1]) {
            let key = format!("radius of pulley {}", i + 1);
            let expected = "less than the distance of anchor and attachment at the pose zero";
            return Err(ParameterError::new(key, radius, expected));
        }
    }
    positive("platform_mass", data.mass)?;
    positive("platform_inertia", data.inertia)?;
    for (i, cable) in data.cables.iter().enumerate() {
        positive(&format!("axial stiffness of cable {}", i + 1), cable.axial_stiffness)?;
        if cable.model == CableModel::MasslessSpring {
            positive(&format!("damping of cable {}", i + 1), cable.damping)?;
        }
    }
    Ok(())
}
