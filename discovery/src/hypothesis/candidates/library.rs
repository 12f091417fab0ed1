//! Candidates, and what they are made of.

use cdpr::effect::EffectSpec;

use crate::hypothesis::correction::leaves_enough;
use crate::model::sizes::Sizes;

/// A column of the regression: a weighted sum of simulated variations of the model.
pub(crate) type Combination = Vec<(usize, f64)>;

/// Turns the amplitudes of a candidate's columns into an effect; `None` where no parameter values have them.
pub(super) type Build = Box<dyn Fn(&[f64]) -> Option<EffectSpec> + Send + Sync>;

/// One explanation.
pub(crate) struct Candidate {
    /// Id in the catalogue.
    pub(crate) id: &'static str,
    /// Cable, or all.
    pub(crate) cable: Option<usize>,
    /// Its columns.
    pub(crate) columns: Vec<usize>,
    /// Parameters found by trying several values rather than by regression.
    pub(crate) tried: usize,
    build: Build,
    /// Sizes of the robot that it corrects, if any.
    sizes: Option<Sizes>,
}

impl Candidate {
    /// The effect with these amplitudes; none where it would not be itself.
    pub(crate) fn effect(&self, amplitudes: &[f64]) -> Option<EffectSpec> {
        let known = amplitudes.iter().all(|a| a.is_finite());
        let itself = |spec: &EffectSpec| self.sizes.is_none_or(|sizes| leaves_enough(spec, &sizes));
        known.then(|| (self.build)(amplitudes)).flatten().filter(|spec| spec.check().is_ok() && itself(spec))
    }
}

/// Variations to simulate, columns made of them, and candidates made of columns.
#[derive(Default)]
pub(crate) struct Library {
    /// Cables of the robot.
    pub(super) cables: usize,
    /// Sizes of the robot, where candidates correct what is given of it.
    pub(super) sizes: Option<Sizes>,
    /// Each variation is one effect added to the model.
    pub(crate) variations: Vec<EffectSpec>,
    pub(crate) columns: Vec<Combination>,
    pub(crate) candidates: Vec<Candidate>,
    /// Columns of what is free beside every candidate, and what is known of their amplitudes beforehand: errors of the survey, and
    /// parameters of what was found, move along when a candidate comes in.
    pub(crate) beside: Vec<(usize, Known)>,
}

/// What is known of an amplitude beforehand: its mean, and the inverse of its variance.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Known {
    pub(crate) mean: f64,
    pub(crate) precision: f64,
}

impl Library {
    pub(super) fn new(cables: usize) -> Self {
        Self { cables, ..Self::default() }
    }

    /// The columns of one candidate alone, in its order, and what they are made of.
    pub(crate) fn only(&self, candidate: usize) -> Self {
        self.of_columns(&self.candidates[candidate].columns)
    }

    /// These columns alone, in their order, and what they are made of.
    pub(crate) fn of_columns(&self, columns: &[usize]) -> Self {
        let mut used: Vec<usize> = columns.iter().flat_map(|c| &self.columns[*c]).map(|(at, _)| *at).collect();
        used.sort_unstable();
        used.dedup();
        let place = |at: &usize| used.binary_search(at).unwrap_or_else(|_| unreachable!("it is one of those used"));
        let column = |c: &usize| self.columns[*c].iter().map(|(at, weight)| (place(at), *weight)).collect();
        Self {
            variations: used.iter().map(|at| self.variations[*at].clone()).collect(),
            columns: columns.iter().map(column).collect(),
            ..Self::new(self.cables)
        }
    }

    /// The candidates, with the columns and variations that they need alone.
    pub(super) fn in_use(mut self) -> Self {
        let mut used: Vec<usize> = self.candidates.iter().flat_map(|c| c.columns.iter().copied()).collect();
        used.sort_unstable();
        used.dedup();
        let place = |at: &usize| used.binary_search(at).unwrap_or_else(|_| unreachable!("it is one of those used"));
        for candidate in &mut self.candidates {
            candidate.columns.iter_mut().for_each(|column| *column = place(column));
        }
        Self { candidates: std::mem::take(&mut self.candidates), ..self.of_columns(&used) }
    }

    /// The same with one more column of what is free beside every candidate.
    pub(crate) fn set_beside(&mut self, variation: EffectSpec, known: Known) {
        self.variations.push(variation);
        let column = self.column(vec![(self.variations.len() - 1, 1.0)]);
        self.beside.push((column, known));
    }

    /// What tells a candidate from every other one: its id and cable, of a term also its target and text.
    pub(crate) fn name(&self, candidate: &Candidate) -> String {
        let term = candidate.columns.first().and_then(|column| self.columns[*column].first()).and_then(|(at, _)| {
            let spec = &self.variations[*at];
            Some(format!("{} {}", spec.target.as_deref()?, spec.expression.as_deref()?))
        });
        format!("{} {:?} {}", candidate.id, candidate.cable, term.unwrap_or_default())
    }

    /// One more variation: its place.
    pub(super) fn vary(&mut self, id: &str, cable: Option<usize>, values: &[f64]) -> usize {
        self.variations
            .push(EffectSpec::new(id, cable, values).unwrap_or_else(|e| unreachable!("a variation of our own: {e}")));
        self.variations.len() - 1
    }

    /// One more column: its place.
    pub(super) fn column(&mut self, combination: Combination) -> usize {
        self.columns.push(combination);
        self.columns.len() - 1
    }

    /// One more candidate.
    pub(super) fn candidate(
        &mut self,
        id: &'static str,
        cable: Option<usize>,
        columns: Vec<usize>,
        tried: usize,
        build: Build,
    ) {
        self.candidates.push(Candidate { id, cable, columns, tried, build, sizes: self.sizes });
    }

    /// For each single cable and, as their sum, for all cables: one column per set of values; `build` makes parameter
    /// values of the amplitudes.
    pub(super) fn each_cable(
        &mut self,
        id: &'static str,
        variations: &[Vec<f64>],
        tried: usize,
        build: impl Fn(&[f64]) -> Option<Vec<f64>> + Clone + Send + Sync + 'static,
    ) {
        if !possible(id, Some(1), variations) {
            return;
        }
        let mut by_cable = Vec::new();
        for cable in 1..=self.cables {
            let sims: Vec<usize> = variations.iter().map(|values| self.vary(id, Some(cable), values)).collect();
            let columns: Vec<usize> = sims.iter().map(|s| self.column(vec![(*s, 1.0)])).collect();
            let b = build.clone();
            let make = move |a: &[f64]| b(a).and_then(|values| EffectSpec::new(id, Some(cable), &values).ok());
            self.candidate(id, Some(cable), columns, tried, Box::new(make));
            by_cable.push(sims);
        }
        let columns =
            (0..variations.len()).map(|v| self.column(by_cable.iter().map(|sims| (sims[v], 1.0)).collect())).collect();
        let make = move |a: &[f64]| build(a).and_then(|values| EffectSpec::new(id, None, &values).ok());
        self.candidate(id, None, columns, tried, Box::new(make));
    }

    /// The same for what acts on the robot as a whole.
    pub(super) fn whole(
        &mut self,
        id: &'static str,
        variations: &[Vec<f64>],
        tried: usize,
        build: impl Fn(&[f64]) -> Option<Vec<f64>> + Send + Sync + 'static,
    ) {
        if !possible(id, None, variations) {
            return;
        }
        let columns = variations
            .iter()
            .map(|values| {
                let sim = self.vary(id, None, values);
                self.column(vec![(sim, 1.0)])
            })
            .collect();
        let make = move |a: &[f64]| build(a).and_then(|values| EffectSpec::new(id, None, &values).ok());
        self.candidate(id, None, columns, tried, Box::new(make));
    }
}

/// Whether an effect can have these values, which come from the model and the data: a cable without mass has no transverse mode.
pub(super) fn possible(id: &str, cable: Option<usize>, variations: &[Vec<f64>]) -> bool {
    variations.iter().all(|values| EffectSpec::new(id, cable, values).is_ok())
}

/// Share of the winch forces by which forces at a winch are varied.
pub(super) const SMALL: f64 = 2.5e-3;

/// One parameter in proportion to one amplitude.
pub(super) fn proportional(size: f64) -> impl Fn(&[f64]) -> Option<Vec<f64>> + Clone + Send + Sync + 'static {
    move |a| Some(vec![a[0] * size])
}
