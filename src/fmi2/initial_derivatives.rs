//! Directional derivatives in Initialization Mode: of what initialisation computes, with respect to what it starts from.
//!
//! The way from start values and parameters to outputs leads through the model's checks, the plant's construction and,
//! with `static_equilibrium`, a search. Dual numbers do not go that way, so these are central differences, extrapolated to
//! width zero (C. J. F. Ridders, *Accurate computation of F'(x) and F'(x) F''(x)*, Advances in Engineering Software 4
//! (1982), 75-76).

use fmi2_export::description::Kind;
use fmi2_export::{Experiment, ModelError};

use super::values::{input_field, no_real_variable, read, start_field};
use super::{CablePlatform, Role};
use crate::model_file::Model;
use crate::parameter::REALS;

/// The widest difference, as part of a known's value or, where that is larger, its nominal value.
const WIDEST: f64 = 1e-2;
/// Each difference is this much narrower than the last.
const NARROWER: f64 = 0.5;
/// Differences at most. Below a width of `WIDEST * NARROWER^11 = 5e-6` rounding takes more than narrowness gives.
const DIFFERENCES: usize = 12;

impl CablePlatform {
    /// `out = d(unknowns)/d(knowns) * seed` of the initialisation for `experiment`.
    pub(super) fn along_starts(
        &mut self,
        experiment: Experiment,
        unknowns: &[usize],
        knowns: &[usize],
        seed: &[f64],
        out: &mut [f64],
    ) -> Result<(), ModelError> {
        let roles = |indices: &[usize]| -> Vec<Role> { indices.iter().map(|k| self.shared.roles[*k]).collect() };
        let unknowns = roles(unknowns);
        let direction: Vec<(Role, f64)> =
            roles(knowns).into_iter().zip(seed.iter().copied()).filter(|(_, seed)| *seed != 0.0).collect();
        let model = self.settled(experiment);
        let mut widest = f64::INFINITY;
        for ((role, seed), index) in roles(knowns).iter().zip(seed).zip(knowns) {
            let value = *field(&mut model.clone(), *role)?;
            let nominal = match &self.shared.description.variables[*index].kind {
                Kind::Real(real) => real.nominal.unwrap_or(1.0),
                _ => 1.0,
            };
            widest = widest.min(WIDEST * value.abs().max(nominal) / seed.abs());
        }
        if direction.is_empty() {
            out.fill(0.0);
            return Ok(());
        }
        let difference = |width: f64| -> Result<Vec<f64>, ModelError> {
            let ahead = self.started(&model, &direction, width, &unknowns)?;
            let behind = self.started(&model, &direction, -width, &unknowns)?;
            Ok(ahead.iter().zip(behind).map(|(a, b)| (a - b) / (2.0 * width)).collect())
        };
        out.copy_from_slice(&extrapolated(difference, widest)?);
        Ok(())
    }

    /// The values of `unknowns` with the start moved along `direction` by `amount`.
    fn started(
        &self,
        model: &Model,
        direction: &[(Role, f64)],
        amount: f64,
        unknowns: &[Role],
    ) -> Result<Vec<f64>, ModelError> {
        let mut model = model.clone();
        for (role, seed) in direction {
            *field(&mut model, *role)? += amount * seed;
        }
        let plant = self.checked(&model)?;
        let simulation = model.simulation_of(plant).map_err(|e| ModelError::new(e.to_string()))?;
        self.same_states(&simulation)?;
        let evaluation = simulation.evaluate();
        let mut values = vec![0.0; unknowns.len()];
        match read(&simulation, &evaluation, unknowns.iter().copied(), &mut values) {
            None => Ok(values),
            Some(_) => Err(no_real_variable()),
        }
    }
}

/// Where a start value, parameter, input or the start time is kept.
fn field(model: &mut Model, role: Role) -> Result<&mut f64, ModelError> {
    let none = || ModelError::new("in initialization mode derivatives are with respect to what can be set there");
    match role {
        Role::Time => Ok(&mut model.start.time),
        Role::WinchForce(_) | Role::Disturbance(_) => input_field(&mut model.start.inputs, role).ok_or_else(none),
        Role::State(state) => start_field(&mut model.start, state).ok_or_else(none),
        Role::Parameter(place, i) => {
            (REALS[place].field)(model, i).ok_or_else(|| ModelError::new("the model has no such parameter"))
        }
        Role::EffectParameter(effect, k) => model.effects[effect].number(k).ok_or_else(none),
        _ => Err(none()),
    }
}

/// The limit of central differences at width zero, each entry from the widths that agree best.
///
/// Widths at which a start is refused, as beyond a bound, are passed over.
fn extrapolated(difference: impl Fn(f64) -> Result<Vec<f64>, ModelError>, widest: f64) -> Result<Vec<f64>, ModelError> {
    let mut refused = ModelError::new("no width was tried");
    // The last row of Neville's scheme: entry k is free of the first k even powers of the width.
    let mut row: Vec<Vec<f64>> = Vec::new();
    let mut best: Vec<(f64, f64)> = Vec::new();
    let mut width = widest;
    for _ in 0..DIFFERENCES {
        match difference(width) {
            Err(error) => {
                refused = error;
                row.clear();
            }
            Ok(first) => {
                if best.is_empty() {
                    best = first.iter().map(|value| (*value, f64::INFINITY)).collect();
                }
                let mut next = vec![first];
                let mut power = 1.0;
                for (k, before) in row.iter().enumerate() {
                    power /= NARROWER * NARROWER;
                    let better: Vec<f64> =
                        next[k].iter().zip(before).map(|(a, b)| (power * a - b) / (power - 1.0)).collect();
                    for (i, best) in best.iter_mut().enumerate() {
                        let doubt = (better[i] - next[k][i]).abs().max((better[i] - before[i]).abs());
                        if doubt < best.1 {
                            *best = (better[i], doubt);
                        }
                    }
                    next.push(better);
                }
                row = next;
            }
        }
        width *= NARROWER;
    }
    // One difference alone says nothing of how good it is.
    if best.is_empty() || best.iter().any(|(_, doubt)| doubt.is_infinite()) {
        return Err(ModelError::new(format!("the start cannot be moved along this direction both ways: {refused}")));
    }
    Ok(best.into_iter().map(|(value, _)| value).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_extrapolated_to_twelve_digits() {
        let f = |x: f64| x.exp() * (3.0 * x).sin();
        let slope = |x: f64| x.exp() * ((3.0 * x).sin() + 3.0 * (3.0 * x).cos());
        for x in [-1.0, 0.3, 2.0] {
            let found = extrapolated(|h| Ok(vec![(f(x + h) - f(x - h)) / (2.0 * h), 0.0]), 0.1).unwrap();
            assert!((found[0] - slope(x)).abs() < 1e-12 * slope(x).abs(), "{} {}", found[0], slope(x));
            assert_eq!(found[1], 0.0);
        }
    }

    #[test]
    fn widths_beyond_a_bound_are_passed_over() {
        let near = |h: f64| if h > 1e-3 { Err(ModelError::new("too far")) } else { Ok(vec![2.0 + h * h]) };
        assert!((extrapolated(near, 1e-2).unwrap()[0] - 2.0).abs() < 1e-12);
        let error = extrapolated(|_| Err(ModelError::new("at its bound")), 1e-2).unwrap_err();
        assert!(error.message.contains("both ways: at its bound"), "{error}");
    }
}
