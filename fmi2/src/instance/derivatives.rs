//! Derivatives of inputs and outputs with respect to time, and of unknowns with respect to knowns.

use super::Instance;
use crate::description::{BaseType, Causality, Initial, Variability, Variable};
use crate::failure::{Failure, Outcome};
use crate::model::Model;
use crate::state::State;

impl<M: Model> Instance<M> {
    pub(crate) fn set_input_derivatives(&mut self, references: &[u32], orders: &[i32], values: &[f64]) -> Outcome {
        if !self.declared.table.capabilities.can_interpolate_inputs {
            return Err(Failure::refused("this FMU does not interpolate inputs"));
        }
        let mut checked = Vec::with_capacity(references.len());
        for ((&reference, &order), &value) in references.iter().zip(orders).zip(values) {
            let index = self.continuous(reference, Causality::Input, "an input")?;
            let order = self.check_order(index, order, u32::MAX)?;
            if !value.is_finite() {
                return Err(Failure::refused(format!("`{}`: derivative {value} is not finite", self.name(index))));
            }
            checked.push((index, order, value));
        }
        for (index, order, value) in checked {
            self.model
                .set_input_derivative(index, order, value)
                .map_err(|error| Failure::refused(format!("`{}`: {error}", self.name(index))))?;
        }
        Ok(())
    }

    /// `take` gets each derivative with its place in `references`.
    pub(crate) fn output_derivatives(
        &mut self,
        references: &[u32],
        orders: &[i32],
        mut take: impl FnMut(usize, f64),
    ) -> Outcome {
        let capabilities = self.declared.table.capabilities;
        for (place, (&reference, &order)) in references.iter().zip(orders).enumerate() {
            let index = self.continuous(reference, Causality::Output, "an output")?;
            let order = self.check_order(index, order, capabilities.max_output_derivative_order)?;
            let value = self
                .model
                .output_derivative(index, order)
                .map_err(|error| Failure::refused(format!("`{}`: {error}", self.name(index))))?;
            take(place, self.finite("the derivative of ", index, value)?);
        }
        Ok(())
    }

    /// `d(unknowns)/d(knowns) * seed`, as long as `unknowns`.
    pub(crate) fn directional_derivative(
        &mut self,
        unknowns: &[u32],
        knowns: &[u32],
        seed: &[f64],
    ) -> Outcome<Vec<f64>> {
        if !self.declared.table.capabilities.provides_directional_derivative {
            return Err(Failure::refused("this FMU does not provide directional derivatives"));
        }
        let unknowns = self.roles(unknowns, "an unknown", Self::is_unknown)?;
        let knowns = self.roles(knowns, "a known", Self::is_known)?;
        if let Some(bad) = seed.iter().find(|value| !value.is_finite()) {
            return Err(Failure::refused(format!("seed {bad} is not finite")));
        }
        let mut out = vec![0.0; unknowns.len()];
        self.model.directional_derivative(&unknowns, &knowns, seed, &mut out)?;
        for (index, value) in unknowns.iter().zip(&out) {
            self.finite("the directional derivative of ", *index, *value)?;
        }
        Ok(out)
    }

    fn roles(
        &self,
        references: &[u32],
        role: &str,
        fits: impl Fn(&Self, usize, &Variable) -> bool,
    ) -> Outcome<Vec<usize>> {
        let to_index = |&reference: &u32| {
            let index = self.index(BaseType::Real, reference)?;
            if fits(self, index, &self.declared.table.variables[index]) {
                return Ok(index);
            }
            // Derivatives are of Real variables only, which a host may overlook: references count by type.
            Err(Failure::refused(format!(
                "the Real `{}` (value reference {reference}) is not {role} in state `{}`{}",
                self.name(index),
                self.progress.state.name(),
                self.namesake(BaseType::Real, reference)
            )))
        };
        references.iter().map(to_index).collect()
    }

    /// Outputs and state derivatives; in initialisation mode also its other unknowns.
    fn is_unknown(&self, index: usize, variable: &Variable) -> bool {
        variable.causality == Causality::Output
            || variable.derivative_of().is_some()
            || (self.progress.state == State::Initialisation && self.declared.is_initial_unknown[index])
    }

    /// Inputs, states and time; in initialisation mode also exact starts.
    fn is_known(&self, index: usize, variable: &Variable) -> bool {
        matches!(variable.causality, Causality::Input | Causality::Independent)
            || self.declared.is_state[index]
            || (self.progress.state == State::Initialisation && variable.effective_initial() == Some(Initial::Exact))
    }

    fn continuous(&self, reference: u32, causality: Causality, role: &str) -> Outcome<usize> {
        let index = self.index(BaseType::Real, reference)?;
        let variable = &self.declared.table.variables[index];
        if variable.causality == causality && variable.variability == Variability::Continuous {
            Ok(index)
        } else {
            Err(Failure::refused(format!("`{}` is not {role} that changes continuously", variable.name)))
        }
    }

    fn check_order(&self, index: usize, order: i32, highest: u32) -> Outcome<u32> {
        u32::try_from(order).ok().filter(|order| (1..=highest).contains(order)).ok_or_else(|| {
            Failure::refused(format!("`{}`: derivatives of order {order} are not supported", self.name(index)))
        })
    }
}
