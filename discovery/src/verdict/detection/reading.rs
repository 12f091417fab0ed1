//! How the amplitudes of a candidate's columns are read as sizes of its parameters.

use cdpr::effect::EffectSpec;

use crate::hypothesis::candidates::Candidate;

/// A way to read amplitudes: one size, in the unit of one parameter.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Reading {
    /// The candidate's columns that it is about, counted through its own.
    pub(crate) columns: Vec<usize>,
    /// Amplitude of each that makes a size of one; of one column that is not in proportion, one.
    pub(crate) scale: Vec<f64>,
    /// The parameter, or the first of those that are parts of one vector.
    pub(super) parameter: usize,
    /// What it is called.
    pub(super) name: String,
    pub(super) kind: Kind,
}

/// What the size is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// In proportion to the amplitude; of a vector its length.
    Proportional,
    /// As the effect of that amplitude has it.
    Law,
    /// The effect is there or it is not: what was tried is the size.
    Fixed,
}

/// The ways to read a candidate.
///
/// Columns of which each makes a part of one vector are read together, by unit. Columns that make one size between them (sine
/// and cosine) are as well. Else the first column is the law and the others extend it.
pub(super) fn readings(candidate: &Candidate) -> Vec<Reading> {
    let count = candidate.columns.len();
    let of = |at: usize, amplitude: f64| {
        let amplitudes: Vec<f64> = (0..count).map(|c| if c == at { amplitude } else { 0.0 }).collect();
        candidate.effect(&amplitudes)
    };
    let Some(first) = of(0, 1.0) else { return Vec::new() };
    let Ok(info) = first.info() else { return Vec::new() };
    let is_size = |k: &usize| !info.parameters[*k].shape && !info.parameters[*k].extension;
    let sizes: Vec<usize> = (0..info.parameters.len()).filter(is_size).collect();
    // The one size that each column makes.
    let makes = |at: usize| -> Option<(usize, f64)> {
        let spec = of(at, 1.0)?;
        let mut made = sizes.iter().map(|k| (*k, spec.values[*k])).filter(|(_, value)| *value != 0.0);
        made.next().filter(|_| made.next().is_none())
    };
    let made: Option<Vec<(usize, f64)>> = (0..count).map(makes).collect();
    if let Some(made) = made.filter(|made| made.len() > 1) {
        let mut out: Vec<Reading> = Vec::new();
        for (column, (parameter, value)) in made.into_iter().enumerate() {
            let unit = info.parameters[parameter].unit;
            match out.iter_mut().find(|known| info.parameters[known.parameter].unit == unit) {
                Some(known) => {
                    if known.parameter != parameter {
                        known.name = format!("{}, {}", known.name, info.parameters[parameter].name);
                    }
                    known.columns.push(column);
                    known.scale.push(1.0 / value);
                }
                None => out.push(Reading {
                    columns: vec![column],
                    scale: vec![1.0 / value],
                    parameter,
                    name: info.parameters[parameter].name.to_owned(),
                    kind: Kind::Proportional,
                }),
            }
        }
        return out;
    }
    let second = of(0, 2.0);
    let changes = |k: &usize| second.as_ref().is_some_and(|second| second.values[*k] != first.values[*k]);
    let parameter = sizes.iter().copied().find(changes).or((0..first.values.len()).find(changes));
    let (parameter, kind) = match parameter {
        Some(parameter) => (parameter, Kind::Law),
        None => (sizes.first().copied().unwrap_or(0), Kind::Fixed),
    };
    let name = info.parameters[parameter].name.to_owned();
    vec![Reading { columns: vec![0], scale: vec![1.0], parameter, name, kind }]
}

impl Reading {
    /// The size that a vector of amplitudes over the scale has, which is so long.
    pub(crate) fn size(&self, candidate: &Candidate, length: f64) -> f64 {
        // A size of one may be out of the law's range: a drum whose axis is a metre off.
        if self.kind == Kind::Proportional {
            return length;
        }
        let of = |amplitude: f64| {
            let mut amplitudes = vec![0.0; candidate.columns.len()];
            amplitudes[self.columns[0]] = amplitude * self.scale[0];
            Some(candidate.effect(&amplitudes)?.values[self.parameter])
        };
        let Some(unit) = of(1.0) else { return f64::INFINITY };
        if self.kind == Kind::Fixed {
            return unit;
        }
        // Where no such effect is proposed the law is taken to go on in proportion.
        match (of(length), of(2.0 * length)) {
            (Some(size), Some(twice)) if size != twice => size,
            _ => length * unit,
        }
    }

    /// Whether a stronger effect has a smaller size.
    pub(crate) fn is_inverse(&self, candidate: &Candidate) -> bool {
        self.kind == Kind::Law && self.size(candidate, 2.0) < self.size(candidate, 1.0)
    }
}

/// How far the shapes of an effect are from the middle of what is typical, as a sum of squares of natural logarithms.
pub(super) fn untypical(effect: &EffectSpec) -> f64 {
    let Ok(info) = effect.info() else { return f64::INFINITY };
    let shapes = info.parameters.iter().zip(&effect.values).enumerate();
    let shapes = shapes.filter(|(k, (p, _))| p.shape && p.typical.0 > 0.0 && effect.takes_part(*k));
    shapes.map(|(_, (p, value))| (value / (p.typical.0 * p.typical.1).sqrt()).ln().powi(2)).sum()
}
