//! Reading and setting variables, under the rules of the table.

use std::ffi::{CStr, CString};

use super::{Instance, Named};
use crate::description::{BaseType, Causality, Kind, Variable};
use crate::failure::{Failure, Outcome};
use crate::model::{Model, Value};
use crate::state::State;

impl<M: Model> Instance<M> {
    /// How many variables of a type there are: no call has a reason to name more.
    pub(crate) fn count(&self, base: BaseType) -> usize {
        self.declared.lookup.count(base)
    }

    /// Read variables of one type; `take` gets each value with its place in `references`.
    pub(crate) fn read(
        &mut self,
        base: BaseType,
        references: &[u32],
        mut take: impl FnMut(usize, Value) -> Outcome,
    ) -> Outcome {
        for (place, &reference) in references.iter().enumerate() {
            let index = self.index(base, reference)?;
            let value = self.value(index)?;
            if base_type(&value) != base {
                return Err(self.wrong_type(base, index, &value));
            }
            take(place, value)?;
        }
        Ok(())
    }

    fn wrong_type(&self, base: BaseType, index: usize, value: &Value) -> Failure {
        let name = self.name(index);
        Failure::broken(format!("the model answered `{name}`, which is of type {base:?}, with {value:?}"))
    }

    /// Read Real variables, all of them at once; `take` gets the values.
    pub(crate) fn read_reals(&mut self, references: &[u32], take: impl FnOnce(&[f64])) -> Outcome {
        let (mut read, mut numbers) = (std::mem::take(&mut self.read), std::mem::take(&mut self.numbers));
        let outcome = self.look_up(&mut read, references).and_then(|()| self.read_named(read.indices(), &mut numbers));
        if outcome.is_ok() {
            take(&numbers);
        }
        (self.read, self.numbers) = (read, numbers);
        outcome
    }

    fn look_up(&self, named: &mut Named, references: &[u32]) -> Outcome {
        named.look_up(references, &self.declared).map_err(|reference| self.unknown(BaseType::Real, reference))
    }

    fn read_named(&mut self, indices: &[usize], numbers: &mut Vec<f64>) -> Outcome {
        if self.declared.independent.is_some_and(|time| indices.contains(&time)) {
            numbers.clear();
            for &index in indices {
                match self.value(index)? {
                    Value::Real(number) => numbers.push(number),
                    other => return Err(self.wrong_type(BaseType::Real, index, &other)),
                }
            }
            return Ok(());
        }
        numbers.resize(indices.len(), 0.0);
        self.model
            .get_reals(indices, numbers)
            .map_err(|(place, error)| Failure::refused(format!("`{}`: {error}", self.name(indices[place]))))?;
        // All of them, which is quicker than to stop at the first.
        if !numbers.iter().fold(true, |finite, number| finite & number.is_finite()) {
            for (index, number) in indices.iter().zip(numbers) {
                self.finite("", *index, *number)?;
            }
        }
        Ok(())
    }

    /// Read string variables into the instance's own memory.
    pub(crate) fn read_strings(&mut self, references: &[u32]) -> Outcome<&[CString]> {
        let mut strings = Vec::with_capacity(references.len());
        self.read(BaseType::String, references, |_, value| {
            if let Value::String(text) = value {
                strings.push(c_string(text)?);
            }
            Ok(())
        })?;
        self.strings = strings;
        Ok(&self.strings)
    }

    /// Keep one string for the host to read.
    pub(crate) fn keep_string(&mut self, text: String) -> Outcome<&CStr> {
        self.strings = vec![c_string(text)?];
        Ok(&self.strings[0])
    }

    /// Set variables of one type; `value` gives the value at each place. All are checked before any
    /// is set.
    pub(crate) fn write(
        &mut self,
        base: BaseType,
        references: &[u32],
        value: impl Fn(usize) -> Outcome<Value>,
    ) -> Outcome {
        let mut checked = std::mem::take(&mut self.checked);
        checked.clear();
        let outcome =
            self.check_values(base, references, value, &mut checked).and_then(|()| self.set_values(&mut checked));
        self.checked = checked;
        outcome
    }

    /// Set Real variables, all of them at once. All are checked before any is set.
    pub(crate) fn write_reals(&mut self, references: &[u32], values: &[f64]) -> Outcome {
        let (mut set, mut assignments) = (std::mem::take(&mut self.set), std::mem::take(&mut self.assignments));
        let outcome = self.look_up(&mut set, references).and_then(|()| {
            assignments.clear();
            assignments.extend(set.indices().iter().copied().zip(values.iter().copied()));
            self.check_reals(&set, &assignments)?;
            self.model
                .set_reals(&assignments)
                .map_err(|(place, error)| Failure::refused(format!("`{}`: {error}", self.name(assignments[place].0))))
        });
        (self.set, self.assignments) = (set, assignments);
        outcome
    }

    fn check_reals(&self, set: &Named, assignments: &[(usize, f64)]) -> Outcome {
        let running = matches!(self.progress.state, State::StepComplete | State::StepFailed);
        // What hosts do at every step needs no look at the table.
        if running && set.are_running_inputs() && assignments.iter().all(|(_, value)| value.is_finite()) {
            return Ok(());
        }
        for &(index, value) in assignments {
            let variable = &self.declared.table.variables[index];
            self.check_settable(variable)?;
            self.check_value(variable, &Value::Real(value))
                .map_err(|failure| Failure::refused(format!("`{}`: {failure}", variable.name)))?;
        }
        Ok(())
    }

    fn check_values(
        &self,
        base: BaseType,
        references: &[u32],
        value: impl Fn(usize) -> Outcome<Value>,
        checked: &mut Vec<(usize, Value)>,
    ) -> Outcome {
        for (place, &reference) in references.iter().enumerate() {
            let index = self.index(base, reference)?;
            let variable = &self.declared.table.variables[index];
            self.check_settable(variable)?;
            let value = value(place)
                .and_then(|value| {
                    self.check_value(variable, &value)?;
                    Ok(value)
                })
                .map_err(|failure| Failure::refused(format!("`{}`: {failure}", variable.name)))?;
            checked.push((index, value));
        }
        Ok(())
    }

    fn set_values(&mut self, checked: &mut Vec<(usize, Value)>) -> Outcome {
        for (index, value) in checked.drain(..) {
            if let Err(error) = self.model.set(index, value) {
                return Err(Failure::refused(format!("`{}`: {error}", self.name(index))));
            }
        }
        Ok(())
    }

    fn check_settable(&self, variable: &Variable) -> Outcome {
        let state = self.progress.state;
        let settable = match state {
            State::Instantiated => variable.settable_before_initialisation(),
            State::Initialisation => variable.settable_in_initialisation(),
            State::StepComplete | State::StepFailed => variable.settable_while_stepping(),
            State::Terminated | State::Error => false,
        };
        if settable {
            return Ok(());
        }
        Err(Failure::refused(format!(
            "`{}` (causality {}, variability {}{}) cannot be set in state `{}`",
            variable.name,
            variable.causality.name(),
            variable.variability.name(),
            variable.effective_initial().map_or(String::new(), |initial| format!(", initial {}", initial.name())),
            state.name()
        )))
    }

    /// Finite and, unless it is an input, within the table's bounds. The bounds of an input tell tools
    /// what to expect; a simulation should not end because a signal brushed past one.
    fn check_value(&self, variable: &Variable, value: &Value) -> Outcome {
        match (&variable.kind, value) {
            (Kind::Real(_), Value::Real(number)) if !number.is_finite() => {
                Err(Failure::refused(format!("{number} is not finite")))
            }
            (Kind::Enumeration { type_name, .. }, &Value::Integer(number)) => self.check_item(type_name, number),
            _ if variable.causality == Causality::Input => Ok(()),
            (Kind::Real(real), &Value::Real(number)) => check_bounds(number, real.min, real.max),
            (Kind::Integer(integer), &Value::Integer(number)) => check_bounds(number, integer.min, integer.max),
            _ => Ok(()),
        }
    }

    fn check_item(&self, type_name: &str, number: i32) -> Outcome {
        let enumerations = &self.declared.table.enumerations;
        let known = enumerations
            .iter()
            .find(|e| e.name == type_name)
            .is_some_and(|e| e.items.iter().any(|item| item.value == number));
        if known {
            Ok(())
        } else {
            Err(Failure::refused(format!("{number} is not the value of an item of `{type_name}`")))
        }
    }

    /// Index of the variable behind a value reference.
    pub(super) fn index(&self, base: BaseType, reference: u32) -> Outcome<usize> {
        self.declared.lookup.index(base, reference).ok_or_else(|| self.unknown(base, reference))
    }

    #[cold]
    fn unknown(&self, base: BaseType, reference: u32) -> Failure {
        let namesake = self.namesake(base, reference);
        Failure::refused(format!("no variable of type {base:?} has the value reference {reference}{namesake}"))
    }

    /// Who else has this value reference, for messages: each base type counts its own.
    pub(super) fn namesake(&self, base: BaseType, reference: u32) -> String {
        let others = BaseType::ALL.into_iter().filter(|other| *other != base);
        others
            .filter_map(|other| Some((other, self.declared.lookup.index(other, reference)?)))
            .map(|(other, index)| format!("; as {other:?} it is `{}`", self.name(index)))
            .collect()
    }

    fn value(&mut self, index: usize) -> Outcome<Value> {
        if self.declared.independent == Some(index) {
            return Ok(Value::Real(self.progress.time));
        }
        let value =
            self.model.get(index).map_err(|error| Failure::refused(format!("`{}`: {error}", self.name(index))))?;
        match value {
            Value::Real(number) => Ok(Value::Real(self.finite("", index, number)?)),
            _ => Ok(value),
        }
    }

    /// `number` if it is one: a host that is handed NaN or infinity with `fmi2OK` carries it on into other models.
    pub(super) fn finite(&self, what: &str, index: usize, number: f64) -> Outcome<f64> {
        if number.is_finite() {
            return Ok(number);
        }
        let name = self.name(index);
        Err(Failure::refused(format!(
            "{what}`{name}` is {number} at t = {} s; inputs or states are beyond what the model can compute",
            self.progress.time
        )))
    }
}

fn check_bounds<T: PartialOrd + std::fmt::Display>(number: T, min: Option<T>, max: Option<T>) -> Outcome {
    match (min, max) {
        (Some(min), _) if number < min => Err(Failure::refused(format!("{number} is below the minimum {min}"))),
        (_, Some(max)) if number > max => Err(Failure::refused(format!("{number} is above the maximum {max}"))),
        _ => Ok(()),
    }
}

fn base_type(value: &Value) -> BaseType {
    match value {
        Value::Real(_) => BaseType::Real,
        Value::Integer(_) => BaseType::Integer,
        Value::Boolean(_) => BaseType::Boolean,
        Value::String(_) => BaseType::String,
    }
}

fn c_string(text: String) -> Outcome<CString> {
    CString::new(text).map_err(|_| Failure::refused("the text holds a NUL, which C cannot carry"))
}
