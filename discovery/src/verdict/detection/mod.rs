//! What would not have been seen: for every law of the catalogue the smallest size that these data would have shown.
//!
//! The signature of a law, whitened by the filter and projected clear of what the fit leaves free, has a length `|s|` for each
//! unit of the law's size: `1/|s|` is the standard error that an estimate of the size would have (A. S. Willsky and H. L. Jones,
//! IEEE Transactions on Automatic Control 21 (1976)). The search takes up what makes the criterion fall by enough on the training
//! data, what predicts the held-out data better, and what shrinks the gap there. The limit is the size at which all three
//! happen in 99 of 100 repetitions, in the direction in which a vector shows least. It is that of a law by itself, along the
//! motion as recorded; a law of another shape has another one.

mod free_run;
mod motion;
mod reading;
#[cfg(test)]
mod tests;
mod visibility;

use std::cmp::Ordering;

use cdpr::effect::{EffectSpec, ParameterInfo, Scope};
use nalgebra::DMatrix;
use rayon::prelude::*;

use crate::data::{Channel, Trial};
use crate::filter::estimate::{Fit, for_trial};
use crate::filter::kalman::{Keep, Run};
use crate::filter::whiten::{Forcing, Normal, Products, Whitening};
use crate::hypothesis::along::Along;
use crate::hypothesis::candidates::{Candidate, Library, Situation, catalogue};
use crate::hypothesis::extension::count_in_use;
use crate::hypothesis::parameter::free_parameters;
use crate::hypothesis::signature::{Varied, sensitivities};
use crate::hypothesis::stream::Stream;
use crate::model::sizes::Sizes;
use crate::outcome::DetectionLimit;
use crate::strategy::candidates::situation;
use crate::strategy::context::Context;
use crate::strategy::fitted::Fitted;
use crate::verdict::{POLICY, Reach};
use crate::weigh::criterion::EVIDENCE;
use crate::weigh::proposal::varied_models;

use free_run::{Course, FreeRuns, Runs};
use motion::{is_of_motion, moves};
pub(crate) use reading::Reading;
use reading::{Kind, readings, untypical};
use visibility::{Asked, Visibility};

/// Frequency (rad/s) of a gust where the data have no peak: the middle of what is typical.
pub(crate) const GUST: f64 = 0.7;

/// For every law that the final model lacks, the smallest size that the data would have shown.
pub(crate) fn detection_limits(context: &Context<'_>, fitted: &Fitted) -> Vec<DetectionLimit> {
    let mut situation = situation(context, &fitted.train);
    if situation.peaks.is_empty() {
        situation.peaks.push(GUST);
    }
    situation.peaks.truncate(1);
    let library = catalogue(&fitted.train.model, &situation);
    let groups = groups(&library);
    let candidates: Vec<usize> = groups.iter().flatten().map(|(at, _)| *at).collect();
    let seen = visibility(context, fitted, &library, &candidates);
    let bounds = Bounds { sizes: Sizes::of(&fitted.train.model.parameters), force: situation.mean_tension };
    let moves = moves(&context.evidence.train, &fitted.train.randomness);
    let gravity = fitted.train.model.parameters.gravity != [0.0; 2];
    let mut out = Vec::new();
    let mut first = 0;
    for group in groups {
        let seen = &seen[first..first + group.len()];
        first += group.len();
        let all: Vec<Limit> = group
            .iter()
            .zip(seen)
            .map(|((at, reading), seen)| limit(context, &library.candidates[*at], reading, seen))
            .map(|limit| if moves { limit } else { limit.at_rest(gravity) })
            .collect();
        out.extend(shown(all, &situation).into_iter().map(|limit| bounds.judged(limit)));
    }
    out
}

/// The limit of a candidate, read in one way.
fn limit(context: &Context<'_>, candidate: &Candidate, reading: &Reading, seen: &Visibility) -> Limit {
    let unit: Vec<f64> = (0..candidate.columns.len()).map(|c| f64::from(u8::from(c == reading.columns[0]))).collect();
    let effect = candidate.effect(&unit);
    let parameters = effect.as_ref().map_or(1, |e| count_in_use(e).max(1));
    let asked = Asked {
        train: EVIDENCE + context.penalty.of(parameters.max(candidate.columns.len() + candidate.tried)),
        holdout: context.policy.helps * EVIDENCE,
        gap: POLICY.scatter,
    };
    let amplitude = seen.scaled(&reading.columns, &reading.scale).needed(&asked);
    let size = reading.size(candidate, amplitude);
    Limit { effect, reading: reading.clone(), amplitude, size, inverse: reading.is_inverse(candidate) }
}

/// What each of `candidates` does, clear of the parameters that are free in the fit.
fn visibility(context: &Context<'_>, fitted: &Fitted, library: &Library, candidates: &[usize]) -> Vec<Visibility> {
    let varied = varied_models(&fitted.train.model, &free_parameters(&fitted.train.model, context.free_from));
    let varied: Vec<Varied> = varied.into_iter().flatten().collect();
    let e = context.evidence;
    let own = library.of_columns(&columns_of(library, candidates));
    let (blocks, columns) = (places(library, candidates), own.columns.len());
    let wanted = pairs(&blocks, columns, varied.len());
    let train = with_free(&fitted.train, &e.train, &own, &varied, &wanted);
    let nuisance = nuisance(&train, columns);
    let train = cleared(&train, &nuisance);
    let (held, runs) = held_out(context, fitted, &own, &varied, &nuisance, &blocks);
    let reaches = [context.reaches.main, context.reaches.long];
    let gram = |normal: &Normal, block: &[usize]| {
        DMatrix::from_fn(block.len(), block.len(), |a, b| normal.gram[block[a] * normal.columns + block[b]])
    };
    let of = |(at, block): (usize, &Vec<usize>)| Visibility {
        train: gram(&train, block),
        holdout: gram(&held, block),
        gaps: runs.iter().zip(&reaches).map(|(runs, reach)| (runs[at].clone(), floor(fitted, *reach))).collect(),
    };
    blocks.iter().enumerate().map(of).collect()
}

/// What a library's columns, clear of what varies freely, do to the innovations of held-out data, and those of each of
/// `blocks` to free runs over either horizon.
fn held_out(
    context: &Context<'_>,
    fitted: &Fitted,
    library: &Library,
    varied: &[Varied],
    nuisance: &DMatrix<f64>,
    blocks: &[Vec<usize>],
) -> (Normal, [Vec<FreeRuns>; 2]) {
    let (fit, trials) = (&fitted.holdout, &context.evidence.holdout);
    let reaches = [context.reaches.main, context.reaches.long];
    let noises = reaches.map(|reach| {
        let spread = fitted.instruments.as_ref().map(|randomness| fit.spread(trials, randomness, reach.horizon));
        spread.unwrap_or_else(|| context.evidence.noise.clone())
    });
    let columns = library.columns.len();
    let wanted = pairs(blocks, columns, 0);
    let groups = groups_of_blocks(blocks);
    let mut normal = Normal::empty(columns);
    let mut out = reaches.map(|_| blocks.iter().map(|block| FreeRuns::empty(block.len())).collect::<Vec<_>>());
    let linear = fit.linear(trials);
    for (t, trial) in trials.iter().enumerate() {
        let along = Along::new(fit, &linear, trials, t);
        let free = sensitivities(&along, varied);
        let randomness = for_trial(&fit.randomness, trial);
        let all = Channel::all(trial.cables());
        let course = |at: usize| {
            let of = |c: &Channel| all.iter().position(|a| a == c).map_or(f64::NAN, |c| noises[at][c]);
            let noise = trial.channels.iter().map(of).collect();
            Course::new(along.linear, trial, &randomness, noise, reaches[at].horizon)
        };
        let courses = [course(0), course(1)];
        let mut runs: Vec<Runs<'_>> =
            courses.iter().flat_map(|course| groups.iter().map(|group| Runs::new(course, group))).collect();
        let mut whitening = Whitening::new(along.linear, &randomness, columns);
        let mut products = Products::new(columns, Some(&wanted));
        let mut filter = Run::new(along.linear, &randomness);
        let mut stream = Stream::new(&along, (&library.variations, &library.columns));
        while let Some(samples) = stream.stretch() {
            let own = stream.advance(samples.end);
            let signatures =
                if free.columns == 0 { own } else { clear(&own.beside(&free.part(along.linear, &samples)), nuisance) };
            whitening.advance(&signatures, samples.end, |_, innovation, e| products.push(e, innovation));
            let filtered = filter.advance(samples.end, Keep::Gains);
            runs.par_iter_mut().for_each(|runs| runs.advance(&signatures, &filtered, &samples));
        }
        let mut part = products.normal(whitening.minus_two_log_likelihood());
        part.silence(&stream.silent());
        normal.add(&part);
        let mut found = runs.into_iter().flat_map(Runs::done);
        out.iter_mut().flatten().zip(&mut found).for_each(|(sum, part)| sum.add(&part));
    }
    (normal, out)
}

/// The gap of a model without fault in units of the noise by which it is measured.
fn floor(fitted: &Fitted, reach: Reach) -> f64 {
    if fitted.instruments.is_some() { 1.0 } else { reach.attainable }
}

/// A candidate's limit.
struct Limit {
    /// With the amplitude one.
    effect: Option<EffectSpec>,
    reading: Reading,
    /// Of the columns over the scale; infinite where it never shows.
    amplitude: f64,
    size: f64,
    inverse: bool,
}

impl Limit {
    /// The limit along a motion that is none.
    fn at_rest(mut self, gravity: bool) -> Self {
        if self.effect.as_ref().is_some_and(|effect| is_of_motion(effect, gravity)) {
            (self.amplitude, self.size) = (f64::INFINITY, f64::INFINITY);
        }
        self
    }
}

/// Candidates of one entry, each with one reading.
struct Group {
    key: Key,
    /// How many columns each has, and how far its shape is from what is typical.
    columns: usize,
    far: f64,
    members: Vec<(usize, Reading)>,
}

/// The candidates of each entry (an id on one cable, or on one sensor) with one reading, those of a typical shape alone.
fn groups(library: &Library) -> Vec<Vec<(usize, Reading)>> {
    let mut groups: Vec<Group> = Vec::new();
    for (at, candidate) in library.candidates.iter().enumerate() {
        let first = |c: usize| f64::from(u8::from(c == 0));
        let Some(effect) = candidate.effect(&(0..candidate.columns.len()).map(first).collect::<Vec<_>>()) else {
            continue;
        };
        // What stands for all cables at once shows earlier.
        if candidate.cable.is_none() && effect.info().is_ok_and(|info| info.scope == Scope::EachCable) {
            continue;
        }
        for reading in readings(candidate) {
            let key = (candidate.id, candidate.cable, effect.channel.clone(), reading.name.clone());
            // A law that is there or not has no shape beside its size.
            let far = if reading.kind == Kind::Fixed { 0.0 } else { untypical(&effect) };
            let columns = if reading.kind == Kind::Fixed { 0 } else { candidate.columns.len() };
            let new = Group { key, columns, far, members: vec![(at, reading)] };
            match groups.iter_mut().find(|known| known.key == new.key) {
                Some(known) => match new.columns.cmp(&known.columns).then(new.far.total_cmp(&known.far)) {
                    Ordering::Less => *known = new,
                    Ordering::Equal => known.members.extend(new.members),
                    Ordering::Greater => {}
                },
                None => groups.push(new),
            }
        }
    }
    groups.into_iter().map(|group| group.members).collect()
}

/// The candidates of the entries `id`, on `cable` or on each, with their readings.
pub(crate) fn readings_of(library: &Library, id: &str, cable: Option<usize>) -> Vec<(usize, Reading)> {
    let asked = |at: usize| {
        let candidate = &library.candidates[at];
        candidate.id == id && (cable.is_none() || candidate.cable == cable)
    };
    groups(library).into_iter().flatten().filter(|(at, _)| asked(*at)).collect()
}

/// Id, cable, channel, name of the size.
type Key = (&'static str, Option<usize>, Option<String>, String);

/// What is told of the limits of one entry: where several sizes were tried, the one whose limit is nearest to what was tried.
fn shown(mut all: Vec<Limit>, situation: &Situation) -> Vec<Limit> {
    if all.first().is_some_and(|limit| limit.reading.kind == Kind::Fixed) {
        return fixed(all, situation);
    }
    let off = |limit: &Limit| limit.amplitude.ln().abs();
    all.sort_by(|a, b| off(a).total_cmp(&off(b)));
    all.truncate(1);
    all
}

/// Of laws that are there or not, the mildest that shows; of limits of a force, by the limit that the commands reach.
fn fixed(all: Vec<Limit>, situation: &Situation) -> Vec<Limit> {
    let mut by_parameter: Vec<Limit> = Vec::new();
    for mut limit in all {
        let Some(effect) = &limit.effect else { continue };
        let range = [0.0, 1.0].map(|share| situation.quantile(effect.cable, share));
        if let Ok(info) = effect.info() {
            let reached = |k: &usize| {
                info.parameters[*k].unit == "N" && range[0] <= effect.values[*k] && effect.values[*k] <= range[1]
            };
            let parameter = (0..effect.values.len()).find(reached).unwrap_or(limit.reading.parameter);
            (limit.reading.parameter, limit.size) = (parameter, effect.values[parameter]);
            limit.reading.name = info.parameters[parameter].name.to_owned();
            limit.inverse = limit.reading.name == "upper";
        }
        // More than what was tried would be another law.
        if limit.amplitude > 1.0 {
            (limit.amplitude, limit.size) = (f64::INFINITY, f64::INFINITY);
        }
        let same = |known: &&mut Limit| known.reading.parameter == limit.reading.parameter;
        match by_parameter.iter_mut().find(same) {
            Some(known)
                if known.amplitude.is_infinite()
                    || (limit.amplitude > known.amplitude && limit.amplitude.is_finite()) =>
            {
                *known = limit;
            }
            Some(_) => {}
            None => by_parameter.push(limit),
        }
    }
    by_parameter
}

/// Sizes beyond which a law is none of this robot.
struct Bounds {
    sizes: Sizes,
    /// Mean winch force (N).
    force: f64,
}

impl Bounds {
    /// The largest size worth speaking of, of a parameter: what is met in practice, and what the robot has of that unit.
    fn largest(&self, parameter: &ParameterInfo) -> f64 {
        let typical = parameter.typical.0.abs().max(parameter.typical.1.abs());
        let own = match parameter.unit {
            "N" => self.force,
            "N.m" => self.force * self.sizes.arm,
            "m" => self.sizes.arm,
            unit => self.sizes.of_unit(unit).unwrap_or(f64::INFINITY),
        };
        typical.min(own)
    }

    fn judged(&self, limit: Limit) -> DetectionLimit {
        let Limit { effect, reading, size, inverse, .. } = limit;
        let effect = effect.unwrap_or_else(|| unreachable!("a candidate that has a reading has an effect"));
        let info = effect.info().unwrap_or_else(|e| unreachable!("an effect of the catalogue: {e}"));
        let parameter = &info.parameters[reading.parameter];
        let excited = size.is_finite()
            && match (reading.kind, inverse) {
                (Kind::Fixed, _) => true,
                (_, true) => size >= parameter.typical.0,
                (_, false) => size.abs() <= self.largest(parameter),
            };
        let shape = |k: &usize| {
            let parameter = &info.parameters[*k];
            *k != reading.parameter && parameter.shape && parameter.typical.0 > 0.0 && effect.takes_part(*k)
        };
        let shape = (0..effect.values.len()).filter(shape).collect();
        DetectionLimit {
            parameter: reading.name,
            unit: parameter.unit,
            size: size.is_finite().then(|| size.abs()),
            at_most: inverse,
            excited,
            shape,
            effect,
        }
    }
}

/// The library's columns that candidates have, in the order of the candidates.
pub(crate) fn columns_of(library: &Library, candidates: &[usize]) -> Vec<usize> {
    candidates.iter().flat_map(|at| library.candidates[*at].columns.clone()).collect()
}

/// The places of each candidate's columns among those of all.
fn places(library: &Library, candidates: &[usize]) -> Vec<Vec<usize>> {
    let mut first = 0;
    let mut next = |count: usize| {
        first += count;
        (first - count..first).collect()
    };
    candidates.iter().map(|at| next(library.candidates[*at].columns.len())).collect()
}

/// Columns whose free runs are done together.
const TOGETHER: usize = 32;

/// Blocks that follow one another with about so many columns together.
fn groups_of_blocks(blocks: &[Vec<usize>]) -> Vec<&[Vec<usize>]> {
    let (mut groups, mut first, mut columns) = (Vec::new(), 0, 0);
    for (at, block) in blocks.iter().enumerate() {
        columns += block.len();
        if columns >= TOGETHER || at + 1 == blocks.len() {
            groups.push(&blocks[first..=at]);
            (first, columns) = (at + 1, 0);
        }
    }
    groups
}

/// The pairs of columns of which products are wanted: within a block, and of what is free (the last so many) with all.
fn pairs(blocks: &[Vec<usize>], columns: usize, free: usize) -> Vec<(usize, usize)> {
    let within = blocks.iter().flat_map(|block| block.iter().flat_map(|a| block.iter().map(|b| (*a, *b))));
    let mut out: Vec<(usize, usize)> = within.filter(|(a, b)| b <= a).collect();
    out.extend((columns..columns + free).flat_map(|a| (0..=a).map(move |b| (a, b))));
    out.sort_unstable();
    out.dedup();
    out
}

/// The normal equations of a library's columns, then of what varies freely, along a fit.
fn with_free(fit: &Fit, trials: &[Trial], library: &Library, varied: &[Varied], pairs: &[(usize, usize)]) -> Normal {
    let linear = fit.linear(trials);
    let columns = library.columns.len() + varied.len();
    let part = |t: usize| {
        let along = Along::new(fit, &linear, trials, t);
        let free = sensitivities(&along, varied);
        let randomness = for_trial(&fit.randomness, &trials[t]);
        let mut whitening = Whitening::new(along.linear, &randomness, columns);
        let mut products = Products::new(columns, Some(pairs));
        let mut stream = Stream::new(&along, (&library.variations, &library.columns));
        while let Some(samples) = stream.stretch() {
            let own = stream.advance(samples.end);
            let all = if free.columns == 0 { own } else { own.beside(&free.part(along.linear, &samples)) };
            whitening.advance(&all, samples.end, |_, innovation, e| products.push(e, innovation));
        }
        let mut normal = products.normal(whitening.minus_two_log_likelihood());
        normal.silence(&stream.silent());
        normal
    };
    let parts: Vec<Normal> = (0..trials.len()).into_par_iter().map(part).collect();
    let mut normal = Normal::empty(columns);
    parts.iter().for_each(|part| normal.add(part));
    normal
}

/// The normal equations of the first columns, with what the free ones after them make up for taken off.
fn cleared(normal: &Normal, nuisance: &DMatrix<f64>) -> Normal {
    let (free, columns) = nuisance.shape();
    let known = |value: f64| if value.is_finite() { value } else { 0.0 };
    let product = |a: usize, b: usize| known(normal.gram[a * normal.columns + b]);
    let of_free = DMatrix::from_fn(free, free, |a, b| product(columns + a, columns + b));
    let with_free = DMatrix::from_fn(free, columns, |a, c| product(columns + a, c));
    // Of own columns with the free ones, when half of what these make up for is taken off.
    let half = with_free - 0.5 * of_free * nuisance;
    let mut out = normal.picked(0..columns);
    for a in 0..columns {
        for b in 0..columns {
            let made_up = half.column(a).dot(&nuisance.column(b)) + half.column(b).dot(&nuisance.column(a));
            out.gram[a * columns + b] -= made_up;
        }
    }
    out
}

/// How much of each free parameter (after the first so many columns) makes up for a unit of each column.
fn nuisance(normal: &Normal, columns: usize) -> DMatrix<f64> {
    let free = normal.columns - columns;
    if free == 0 {
        return DMatrix::zeros(0, columns);
    }
    // A parameter that does nothing, or a law too sharp to be varied along the trajectory, makes up for nothing.
    let known = |value: f64| if value.is_finite() { value } else { 0.0 };
    let product = |a: usize, b: usize| known(normal.gram[a * normal.columns + b]);
    let size = |a: usize| Some(product(a, a).sqrt()).filter(|size| *size > 0.0).unwrap_or(1.0);
    let size: Vec<f64> = (columns..normal.columns).map(size).collect();
    let gram = DMatrix::from_fn(free, free, |a, b| product(columns + a, columns + b) / (size[a] * size[b]));
    let right = DMatrix::from_fn(free, columns, |a, c| product(columns + a, c) / size[a]);
    // Parameters that cannot be told apart make up for it together.
    let solved =
        gram.svd(true, true).solve(&right, 1e-9).unwrap_or_else(|e| unreachable!("both sides were decomposed: {e}"));
    DMatrix::from_fn(free, columns, |a, c| solved[(a, c)] / size[a])
}

/// The columns with what is free taken off, and without what is free.
fn clear(forcing: &Forcing, nuisance: &DMatrix<f64>) -> Forcing {
    let columns = forcing.columns - nuisance.nrows();
    let of = |values: &[f32]| -> Vec<f32> {
        let row = |row: &[f32]| -> Vec<f32> {
            let (own, free) = row.split_at(columns);
            let made_up = |c: usize| {
                free.iter()
                    .zip(nuisance.column(c).iter())
                    .filter(|(f, _)| f.is_finite())
                    .map(|(f, n)| f64::from(*f) * n)
                    .sum::<f64>()
            };
            own.iter().enumerate().map(|(c, value)| (f64::from(*value) - made_up(c)) as f32).collect()
        };
        values.chunks_exact(forcing.columns).flat_map(row).collect()
    };
    Forcing { first: forcing.first, columns, step: of(&forcing.step), sensor: of(&forcing.sensor) }
}
