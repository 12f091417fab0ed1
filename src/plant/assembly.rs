//! A plant being put together: where each effect goes.

use super::{CableEffects, EffectStates};
use crate::dynamics::PlantData;
use crate::effect::{EffectKind, EffectSpec, Stage, acts_on};
use crate::length_sensor::Drum;
use crate::parameters::Parameters;
use crate::pose_sensor::PoseSensor;

/// What effects are put into.
pub(super) struct Assembly {
    pub(super) data: PlantData,
    pub(super) cable: Vec<CableEffects>,
    pub(super) wrench: Vec<EffectKind>,
    pub(super) pose_sensor: PoseSensor,
    pub(super) pose_delay: f64,
    pub(super) states_of_effects: Vec<EffectStates>,
}

impl Assembly {
    /// A plant without effects.
    pub(super) fn new(parameters: &Parameters) -> Self {
        let exact = (1.0, 0.0);
        let nothing = CableEffects { length_sensor: exact, tension_sensor: exact, ..CableEffects::default() };
        Self {
            data: PlantData::new(parameters),
            cable: vec![nothing; parameters.cables()],
            wrench: Vec::new(),
            pose_sensor: PoseSensor::default(),
            pose_delay: 0.0,
            states_of_effects: Vec::new(),
        }
    }

    /// Takes up the effect that `spec` tells of, the plant's number `effect`, at its stage. One that is not in force has its states
    /// all the same.
    pub(super) fn take(&mut self, effect: usize, spec: &EffectSpec, kind: EffectKind, in_force: bool) {
        let on = acts_on(spec.cable, self.cable.len());
        let stage = kind.stage();
        let mut first = vec![0; self.cable.len()];
        for i in (0..self.cable.len()).filter(|i| on[*i]) {
            first[i] = self.cable[i].states;
            self.cable[i].states += kind.states();
            if kind.states() > 0 {
                let place = EffectStates { effect, stage, cable: i, first: first[i], count: kind.states() };
                self.states_of_effects.push(place);
            }
        }
        if !in_force {
            return;
        }
        match stage {
            Stage::Parameters | Stage::Transverse => kind.change(&mut self.data, &on),
            Stage::PlatformWrench => self.wrench.push(kind.clone()),
            Stage::Sensor => {
                kind.pose_sensor(&mut self.pose_sensor);
                self.pose_delay += kind.delay();
            }
            Stage::CommandDelay
            | Stage::Command(_)
            | Stage::WinchLoss
            | Stage::ElasticLaw
            | Stage::WinchPull(_)
            | Stage::WinchPosition => {}
        }
        for (i, cable) in self.cable.iter_mut().enumerate().filter(|(i, _)| on[*i]) {
            cable.take(i, spec, &kind, first[i]);
        }
    }
}

impl CableEffects {
    /// Takes up an effect on cable `number` (from 0), whose states begin at `first`.
    fn take(&mut self, number: usize, spec: &EffectSpec, kind: &EffectKind, first: usize) {
        let (alone, placed) = (|| kind.clone(), || (kind.clone(), first));
        match kind.stage() {
            Stage::Parameters | Stage::PlatformWrench => {}
            Stage::CommandDelay => self.delay += kind.delay(),
            Stage::Command(_) => self.command.push(placed()),
            Stage::WinchLoss => self.loss.push(placed()),
            // Where the term has a cable, that is where it acts.
            Stage::WinchPull(winch) if winch != number => {}
            Stage::WinchPull(_) | Stage::WinchPosition => self.pull.push(alone()),
            Stage::ElasticLaw => self.law.push(placed()),
            Stage::Transverse if kind.states() > 0 => {
                // Its bow is a matter of the elastic law.
                self.law.push(placed());
                self.swing.push(placed());
            }
            Stage::Transverse => self.transverse.push(alone()),
            Stage::Sensor => self.take_sensor(spec, kind),
        }
    }

    /// A sensor behind those that there are.
    fn take_sensor(&mut self, spec: &EffectSpec, kind: &EffectKind) {
        let behind = |sensor: &mut (f64, f64), (factor, bias): (f64, f64)| {
            *sensor = (sensor.0 * factor, sensor.1 * factor + bias);
        };
        if spec.channel.as_deref() == Some("cable_length") {
            behind(&mut self.length_sensor, kind.length_sensor());
        } else {
            let sensor = &mut self.unstretched_sensor;
            let mut line = (sensor.factor, sensor.bias);
            behind(&mut line, kind.length_sensor());
            (sensor.factor, sensor.bias) = line;
            let mut drum = sensor.drum.unwrap_or_default();
            kind.drum(&mut drum);
            sensor.drum = (drum != Drum::default()).then_some(drum);
        }
        behind(&mut self.tension_sensor, kind.tension_sensor());
    }
}
