//! An effect cut into segments of time, and the courses that it may take through them.

use std::ops::Range;
use std::slice;
use std::sync::Arc;

use cdpr::effect::EffectSpec;
use rayon::prelude::*;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::data::Trial;
use crate::filter::error::FitError;
use crate::filter::estimate::Fit;
use crate::filter::kalman::{Keep, Randomness};
use crate::filter::whiten::{Acting, Forcing, Normal};
use crate::hypothesis::candidates::Combination;
use crate::hypothesis::stream::normals_of_parts;
use crate::strategy::policy::POLICY;
use crate::weigh::criterion::Penalty;
use crate::weigh::regression::{ladder, subset};

/// Where an effect is at work: stretches between edges, each with a size of its own.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Course {
    pub(super) stretches: Vec<(usize, usize)>,
    /// Amplitudes of the columns in each stretch.
    pub(super) sizes: Vec<Vec<f64>>,
    /// `-2 log L` with it.
    pub(super) value: f64,
    /// Mean square of the whitened innovations that are left with it: one where they are white.
    pub(super) left: f64,
}

/// An effect's part of the normal equations, its columns by segments of time, at each size of the latent forces.
pub(super) struct Segments {
    /// Columns of the effect.
    columns: usize,
    /// Times (s) between which they lie.
    pub(super) edges: Vec<f64>,
    pub(super) levels: Vec<Normal>,
}

impl Segments {
    /// The effects `at`, which are one in different stretches of time, taken out of `fit` and cut at `edges`.
    pub(super) fn of_standing(fit: &Fit, trials: &[Trial], at: &[usize], edges: Vec<f64>) -> Result<Self, FitError> {
        let whole = EffectSpec { from: None, until: None, ..fit.model.effects[at[0]].clone() };
        let mut reduced = fit.model.clone();
        let mut index = 0;
        reduced.effects.retain(|_| {
            index += 1;
            !at.contains(&(index - 1))
        });
        let without = Fit::new(&reduced, trials, &fit.randomness, Some(fit))?;
        Ok(Self::of(&without, trials, &whole, edges))
    }

    /// An effect that `without` lacks, cut at `edges`.
    pub(super) fn of(without: &Fit, trials: &[Trial], effect: &EffectSpec, edges: Vec<f64>) -> Self {
        let sizes = ladder(&without.randomness);
        let (variations, columns, alone) = (slice::from_ref(effect), [vec![(0, 1.0)]], 0..1);
        Self::of_each(without, trials, (variations, &columns), slice::from_ref(&alone), &edges, &sizes).remove(0)
    }

    /// Candidates that `without` lacks, each by itself cut at `edges`, at some sizes of the latent forces. The columns of each
    /// are combinations of variations, one range of them a candidate.
    pub(super) fn of_each(
        without: &Fit,
        trials: &[Trial],
        (variations, columns): (&[EffectSpec], &[Combination]),
        candidates: &[Range<usize>],
        edges: &[f64],
        sizes: &[Randomness],
    ) -> Vec<Self> {
        let segments = edges.len() - 1;
        let own = |of: &Range<usize>| of.start * segments..of.end * segments;
        let pairs_of = |of: &Range<usize>| {
            let own = own(of);
            own.clone().flat_map(move |a| (own.start..=a).map(move |b| (a, b)))
        };
        let pairs: Vec<(usize, usize)> = candidates.iter().flat_map(pairs_of).collect();
        let places: Vec<Arc<Places>> = trials.iter().map(|trial| Arc::new(Places::new(trial, edges))).collect();
        let cut = |forcing, t: usize| -> Box<dyn Acting> { Box::new(Cut { forcing, places: Arc::clone(&places[t]) }) };
        let levels = normals_of_parts(without, trials, (variations, columns), sizes, Some(&pairs), segments, cut);
        let of_candidate = |of: &Range<usize>| Self {
            columns: of.len(),
            levels: levels.iter().map(|level| level.picked(own(of))).collect(),
            edges: edges.to_vec(),
        };
        candidates.iter().map(of_candidate).collect()
    }

    /// The best amplitudes in each of `stretches`, at the size of the latent forces that does best with them.
    pub(super) fn along(&self, stretches: &[(usize, usize)]) -> Option<Course> {
        let (segments, columns) = (self.edges.len() - 1, self.columns);
        let unknowns = stretches.len() * columns;
        // Rows of the normal equations that make an unknown.
        let rows = |unknown: usize| {
            let ((from, until), column) = (stretches[unknown / columns], unknown % columns);
            column * segments + from..column * segments + until
        };
        let mut best: Option<Course> = None;
        for level in &self.levels {
            let mut small = Normal::empty(unknowns);
            for a in 0..unknowns {
                small.right[a] = level.right[rows(a)].iter().sum();
                for b in 0..unknowns {
                    let row = |r: usize| level.gram[r * level.columns..][rows(b)].iter().sum::<f64>();
                    small.gram[a * unknowns + b] = rows(a).map(row).sum();
                }
            }
            let all: Vec<usize> = (0..unknowns).collect();
            let Some(solved) = subset(&small, &all) else { continue };
            let value = level.minus_two_log_likelihood - solved.drop;
            if best.as_ref().is_none_or(|best| value < best.value) {
                let sizes = solved.amplitudes.chunks(columns).map(<[f64]>::to_vec).collect();
                let left = (level.total - solved.drop) / level.count.max(1) as f64;
                best = Some(Course { stretches: stretches.to_vec(), sizes, value, left });
            }
        }
        best
    }

    /// The best of `courses` by `-2 log L`.
    pub(super) fn best(&self, courses: impl IntoIterator<Item = Vec<(usize, usize)>>) -> Option<Course> {
        let all: Vec<Vec<(usize, usize)>> = courses.into_iter().collect();
        all.into_par_iter().filter_map(|stretches| self.along(&stretches)).min_by(|a, b| a.value.total_cmp(&b.value))
    }
}

/// The segment of each sample, and of each step: what acts over a step belongs where its middle is.
struct Places {
    segments: usize,
    of_sample: Vec<usize>,
    of_step: Vec<usize>,
}

impl Places {
    fn new(trial: &Trial, edges: &[f64]) -> Self {
        let segments = edges.len() - 1;
        let segment = |time: f64| edges[1..segments].partition_point(|edge| *edge <= time);
        Self {
            segments,
            of_sample: trial.time.iter().map(|time| segment(*time)).collect(),
            of_step: trial.time.windows(2).map(|ends| segment(0.5 * (ends[0] + ends[1]))).collect(),
        }
    }
}

/// Each column cut into one for each segment of time.
struct Cut {
    forcing: Forcing,
    places: Arc<Places>,
}

impl Cut {
    /// Writes each number of the columns into its segment.
    fn spread(&self, values: &[f32], segment: usize, out: &mut [f32]) {
        out.fill(0.0);
        out.iter_mut().skip(segment).step_by(self.places.segments).zip(values).for_each(|(slot, value)| *slot = *value);
    }
}

impl Acting for Cut {
    fn columns(&self) -> usize {
        self.forcing.columns * self.places.segments
    }

    fn at_sample(&self, k: usize, sensor: &mut [f32]) {
        let (count, at) = (sensor.len() / self.places.segments, k - self.forcing.first);
        self.spread(&self.forcing.sensor[at * count..(at + 1) * count], self.places.of_sample[k], sensor);
    }

    fn over_step(&self, k: usize, step: &mut [f32]) {
        let (count, at) = (step.len() / self.places.segments, k - self.forcing.first);
        self.spread(&self.forcing.step[at * count..(at + 1) * count], self.places.of_step[k], step);
    }
}

/// First and last time of the trials together (s).
pub(super) fn span(trials: &[Trial]) -> (f64, f64) {
    trials.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(first, last), trial| {
        (first.min(trial.time[0]), last.max(trial.time[trial.len() - 1]))
    })
}

/// Edges of so many segments of the same length.
pub(super) fn even(trials: &[Trial], segments: usize) -> Vec<f64> {
    let (first, last) = span(trials);
    (0..=segments).map(|k| first + (last - first) * k as f64 / segments as f64).collect()
}

/// Edges of so many segments of the same length, and those times in between at which something is sudden: what changes
/// where a thing is, as an anchor that slips, is known by that instant, for a steady force at random follows it before and after.
pub(super) fn edges(fit: &Fit, trials: &[Trial], segments: usize) -> Vec<f64> {
    let mut edges = even(trials, segments);
    edges.extend(sudden(fit, trials));
    edges.sort_by(f64::total_cmp);
    edges.dedup();
    edges
}

/// The last samples before the innovations of all trials together are more than chance has in a recording, the most unlikely
/// ones first.
fn sudden(fit: &Fit, trials: &[Trial]) -> Vec<f64> {
    let filtered = fit.filter(trials, &fit.randomness, Keep::Innovations);
    let (first, last) = span(trials);
    let longest = trials.iter().max_by_key(|trial| trial.len()).map_or(&[][..], |trial| &trial.time);
    let samples = longest.len() as f64;
    let half: Vec<f64> = trials.iter().map(|trial| 0.5 * trial.interval()).collect();
    // A sample of each trial, those at the same time together.
    let at = |time: f64| {
        let (mut power, mut count) = (0.0, 0);
        for ((trial, filtered), half) in trials.iter().zip(&filtered).zip(&half) {
            let k = trial.time.partition_point(|t| *t < time - half);
            let channels = trial.channels.len();
            let Some(row) = filtered.whitened.get(k * channels..(k + 1) * channels) else { continue };
            for value in row.iter().filter(|value| value.is_finite()) {
                power += value * value;
                count += 1;
            }
        }
        ChiSquared::new(f64::from(count)).map_or(1.0, |chi| chi.sf(power))
    };
    // The first tenth is the filter's own transient.
    let from = longest.len() / 10;
    let unlikely: Vec<(f64, usize)> = (from.max(1)..longest.len())
        .into_par_iter()
        .map(|k| (at(longest[k]), k))
        .filter(|(chance, _)| chance * samples < POLICY.sudden)
        .collect();
    // What is sudden shakes the plant for a while: of samples that lie close together it is the first.
    let shaken = unlikely.chunk_by(|(_, a), (_, b)| b - a <= POLICY.sudden_apart);
    let least = |shaken: &[(f64, usize)]| shaken.iter().fold(f64::INFINITY, |least, (chance, _)| least.min(*chance));
    let mut found: Vec<(f64, usize)> = shaken.map(|shaken| (least(shaken), shaken[0].1)).collect();
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    found.truncate(POLICY.most_sudden);
    let segment = (last - first) / POLICY.segments as f64;
    let edge = first + segment..last - segment;
    found.into_iter().map(|(_, k)| longest[k - 1]).filter(|time| edge.contains(time)).collect()
}

/// Kinds of courses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kind {
    From,
    Until,
    Between,
    Change,
}

impl Kind {
    pub(super) const ALL: [Self; 4] = [Self::From, Self::Until, Self::Between, Self::Change];

    /// All courses of the kind over so many segments.
    pub(super) fn courses(self, segments: usize) -> Vec<Vec<(usize, usize)>> {
        let inner = 1..segments;
        match self {
            Self::From => inner.map(|at| vec![(at, segments)]).collect(),
            Self::Until => inner.map(|at| vec![(0, at)]).collect(),
            Self::Between => {
                inner.flat_map(|from| (from + 1..segments).map(move |until| vec![(from, until)])).collect()
            }
            Self::Change => inner.map(|at| vec![(0, at), (at, segments)]).collect(),
        }
    }
}

/// What a course costs beyond an effect of so many parameters that is always there.
pub(super) fn price(course: &Course, segments: usize, parameters: usize, penalty: Penalty) -> f64 {
    let inner = |edge: usize| usize::from(edge > 0 && edge < segments);
    match &course.stretches[..] {
        [(from, until)] => penalty.of_times(inner(*from) + inner(*until)),
        _ => penalty.of_times(1) + penalty.of(parameters),
    }
}

/// An effect in the stretches of a course, `sized` by its amplitudes in each.
pub(super) fn entries(
    course: &Course,
    edges: &[f64],
    sized: impl Fn(&[f64]) -> Option<EffectSpec>,
) -> Option<Vec<EffectSpec>> {
    let inner = |edge: usize| (edge > 0 && edge < edges.len() - 1).then(|| edges[edge]);
    let entry = |((from, until), amplitudes): (&(usize, usize), &Vec<f64>)| {
        sized(amplitudes)?.during(inner(*from), inner(*until)).ok()
    };
    course.stretches.iter().zip(&course.sizes).map(entry).collect()
}

/// `effect` multiplied in those of its parameters that are sizes, where its law allows it.
pub(super) fn multiplied(effect: &EffectSpec, by: f64) -> EffectSpec {
    let mut sized = EffectSpec { from: None, until: None, ..effect.clone() };
    if let Ok(info) = effect.info() {
        let sizes = sized.values.iter_mut().zip(info.parameters).filter(|(_, parameter)| !parameter.shape);
        sizes.for_each(|(value, _)| *value *= by);
    }
    if sized.check().is_ok() { sized } else { effect.clone() }
}
