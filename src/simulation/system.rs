//! The plant as a system for the integrator.

use crate::dynamics::{Factors, Inputs, Linearisation, MAX_EFFECT_STATES, Margins};
use crate::integrator::{Complex64, Cost, MOST_STATES, System};
use crate::per_cable::{MAX_CABLES, PerCable};
use crate::plant::Plant;

/// The largest plant is none too large for the integrator.
const _: () = assert!(6 + MAX_CABLES * (2 + MAX_EFFECT_STATES) <= MOST_STATES);

/// Inputs linear in time from `start` on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct InputSegment {
    pub(super) start: f64,
    pub(super) value: Inputs,
    pub(super) slope: Inputs,
    /// Whether all slopes are zero.
    held: bool,
}

impl InputSegment {
    #[inline]
    pub(super) fn new(start: f64, value: Inputs, slope: Inputs) -> Self {
        Self { start, value, slope, held: slope.is_zero() }
    }

    /// Inputs that are held.
    #[inline]
    pub(super) fn held(start: f64, value: Inputs) -> Self {
        Self { start, value, slope: Inputs::none(value.winch_force.len()), held: true }
    }

    #[inline]
    pub(super) fn at(&self, time: f64) -> Inputs {
        if self.held {
            return self.value;
        }
        let s = time - self.start;
        Inputs {
            winch_force: PerCable::from_fn(self.value.winch_force.len(), |i| {
                self.value.winch_force[i] + s * self.slope.winch_force[i]
            }),
            disturbance: std::array::from_fn(|k| self.value.disturbance[k] + s * self.slope.disturbance[k]),
        }
    }
}

/// Newton matrix and its factors, kept from step to step.
#[derive(Clone, Debug)]
pub(super) struct Workspace {
    pub(super) nominal: Vec<f64>,
    pub(super) linearisation: Linearisation,
    /// Inputs and slack cables that the linearisation was made with.
    pub(super) linearised_inputs: Inputs,
    pub(super) linearised_slack: PerCable<bool>,
    factors: Factors,
    cost: Cost,
}

impl Workspace {
    pub(super) fn new(plant: &Plant) -> Self {
        let mut nominal = vec![1.0; plant.dimension()];
        plant.nominal(&mut nominal);
        Self {
            nominal,
            linearisation: Linearisation::new(plant),
            linearised_inputs: Inputs::none(plant.cables()),
            linearised_slack: PerCable::filled(plant.cables(), false),
            factors: Factors::new(&plant.states_of_cables()),
            cost: plant.cost(),
        }
    }
}

/// What the integrator sees: a plant under given inputs, with its cables slack or taut.
pub(super) struct PlantSystem<'a> {
    pub(super) plant: &'a Plant,
    pub(super) inputs: &'a InputSegment,
    pub(super) slack: &'a mut PerCable<bool>,
    pub(super) work: &'a mut Workspace,
    margins: Margins,
}

impl<'a> PlantSystem<'a> {
    pub(super) fn new(
        plant: &'a Plant,
        inputs: &'a InputSegment,
        slack: &'a mut PerCable<bool>,
        work: &'a mut Workspace,
    ) -> Self {
        Self { plant, inputs, slack, work, margins: Margins::NONE }
    }
}

impl System for PlantSystem<'_> {
    fn dimension(&self) -> usize {
        self.plant.dimension()
    }

    fn rates(&mut self, time: f64, y: &[f64], rates: &mut [f64]) {
        let moved;
        let inputs = if self.inputs.held {
            &self.inputs.value
        } else {
            moved = self.inputs.at(time);
            &moved
        };
        self.plant.rates_and_margins(time, y, inputs, self.slack, rates, &mut self.margins);
    }

    fn cost(&self) -> Cost {
        self.work.cost
    }

    fn scale(&self, _y: &[f64], scale: &mut [f64]) {
        scale.copy_from_slice(&self.work.nominal);
    }

    fn scale_changes(&self) -> bool {
        false
    }

    fn linearise(&mut self, time: f64, y: &[f64]) {
        let u = self.inputs.at(time);
        self.work.linearisation.update(self.plant, time, y, &u, self.slack);
        self.work.linearised_inputs = u;
        self.work.linearised_slack = *self.slack;
    }

    fn factor(&mut self, real: f64, complex: Complex64) {
        self.work.factors.update(&self.work.linearisation, real, complex);
    }

    fn solve_real(&mut self, b: &mut [f64]) {
        self.work.factors.solve_real(b);
    }

    fn solve_complex(&mut self, re: &mut [f64], im: &mut [f64]) {
        self.work.factors.solve_complex(re, im);
    }

    fn switches(&self) -> usize {
        self.plant.cables()
    }

    fn suspects_switch(&mut self) -> bool {
        let suspects = self.margins.may_be_negative(self.plant.cables());
        self.margins = Margins::NONE;
        suspects
    }

    fn switching_functions(&mut self, time: f64, y: &[f64], values: &mut [f64]) {
        let tension = self.plant.uncut_tensions(time, y, &self.inputs.at(time), self.slack);
        for ((value, tension), slack) in values.iter_mut().zip(tension).zip(&*self.slack) {
            *value = if *slack { -tension } else { tension };
        }
    }

    fn switch(&mut self, time: f64, y: &[f64]) {
        // At a crossing the tension is zero to rounding: each cable past it changes over.
        let inputs = self.inputs.at(time);
        *self.slack = if self.plant.has.platform_side {
            self.plant.slack_cables(time, y, &inputs)
        } else {
            self.plant.uncut_tensions(time, y, &inputs, self.slack).map(|t| t < 0.0)
        };
    }

    fn out_of_bounds(&self, y: &[f64]) -> Option<&'static str> {
        self.plant.wound_in(y).then_some("a cable is wound in to its end (its unstretched length is not positive)")
    }
}
