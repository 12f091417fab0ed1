//! The final fit's normal equations, block by block of time: derivatives by the parameters of effects and by clocks.

use cdpr::effect::EffectSpec;
use cdpr::model_file::Model;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::data::Trial;
use crate::filter::estimate::{Fit, for_trial};
use crate::filter::path::LinearTrial;
use crate::filter::whiten::{Forcing, Normal, whitened_rows};
use crate::hypothesis::along::Along;
use crate::hypothesis::parameter::Free;
use crate::hypothesis::parameter::free_values;
use crate::hypothesis::signature::Varied;
use crate::hypothesis::survey::regularise;
use crate::instruments::clocks::Clocks;
use crate::model::examined::Examined;
use crate::outcome::Block;
use crate::weigh::proposal::varied_models;
use crate::weigh::solve::solve;

/// Blocks of time over all trials, as far as they are long enough.
const BLOCKS: f64 = 8.0;
/// Shortest block (s): several times the correlation time of the latent disturbances.
const SHORTEST: f64 = 8.0;
/// Parts of each block, by which it is told how much more sums over time scatter than they would by white noise.
const PARTS: usize = 3;
/// Neighbours on each side that a part may have something in common with (W. K. Newey and K. D. West, Econometrica 55 (1987),
/// 703).
const NEIGHBOURS: usize = 2;
/// Step by which an expression is scaled for its derivative.
const EXPRESSION_STEP: f64 = 1e-3;

/// What a column of derivatives belongs to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Column {
    Parameter(Free),
    /// The relative size of an expression, by the effect's index.
    Expression(usize),
    /// The delay of a clock, by its place among those that are set.
    Clock(usize),
}

impl Column {
    pub(crate) fn effect(self) -> Option<usize> {
        match self {
            Self::Parameter(free) => Some(free.effect),
            Self::Expression(effect) => Some(effect),
            Self::Clock(_) => None,
        }
    }
}

/// Normal equations of the final fit.
pub(crate) struct ByBlock {
    pub(crate) columns: Vec<Column>,
    pub(crate) blocks: Vec<Block>,
    /// Those of each block.
    pub(crate) normals: Vec<Normal>,
    /// Those of its parts.
    parts: Vec<Normal>,
}

impl ByBlock {
    /// With the parameters of the effects from index `first` on.
    pub(crate) fn new(fit: &Fit, trials: &[Trial], first: usize) -> Self {
        let (mut columns, varied) = derivatives(fit, first);
        let clocks = Clocks::set(&fit.randomness, trials);
        columns.extend((0..clocks.count()).map(Column::Clock));
        let blocks = blocks(trials);
        let linear = fit.linear(trials);
        let parts: Vec<Vec<Normal>> = (0..trials.len())
            .into_par_iter()
            .map(|t| {
                let forcing = clocks.after(&Along::new(fit, &linear, trials, t), &varied);
                parts(fit, &linear[t], &trials[t], &forcing, &blocks[t])
            })
            .collect();
        let parts = parts.concat();
        let whole = |parts: &[Normal]| {
            parts.iter().fold(Normal::empty(columns.len()), |mut whole, part| {
                whole.add(part);
                whole
            })
        };
        let normals = parts.chunks(PARTS).map(whole).collect();
        Self { columns, blocks: blocks.concat(), normals, parts }
    }

    /// The trial that a part belongs to.
    fn trial(&self, part: usize) -> usize {
        self.blocks[part / PARTS].trial
    }

    /// Standard errors of parameters and clocks, with their columns.
    ///
    /// Where a law is not quite right, or the noise not quite as it is taken to be, the slopes of the likelihood scatter more
    /// over time than white noise makes them; the errors are wider by that (P. J. Huber, Proc. Fifth Berkeley Symposium
    /// (1967) 1, 221; K.-Y. Liang and S. L. Zeger, Biometrika 73 (1986), 13). They are never smaller than white noise makes
    /// them.
    pub(crate) fn standard_errors(&self, model: &Model) -> Vec<(Column, f64)> {
        let kept: Vec<usize> =
            (0..self.columns.len()).filter(|c| !matches!(self.columns[*c], Column::Expression(_))).collect();
        let n = self.columns.len();
        let mut normal = Normal::empty(kept.len());
        for part in &self.parts {
            normal.add(&Normal {
                columns: kept.len(),
                gram: kept.iter().flat_map(|r| kept.iter().map(move |c| part.gram[r * n + c])).collect(),
                right: kept.iter().map(|c| part.right[*c]).collect(),
                ..part.clone()
            });
        }
        let parameters = kept.iter().map(|c| match self.columns[*c] {
            Column::Parameter(free) => Some(free),
            Column::Expression(_) | Column::Clock(_) => None,
        });
        let known = regularise(&mut normal, model, parameters);
        let (_, covariance) = solve(&normal);
        let live: Vec<usize> = (0..kept.len()).filter(|c| covariance[(*c, *c)].is_finite()).collect();
        let inverse = DMatrix::from_fn(live.len(), live.len(), |r, c| covariance[(live[r], live[c])]);
        let spread = (normal.total / normal.count.max(1) as f64).max(1.0);
        // Slopes that are not quite zero in sum are no scatter.
        let slopes: Vec<DVector<f64>> = self
            .parts
            .iter()
            .map(|part| {
                let share = part.count as f64 / normal.count.max(1) as f64;
                DVector::from_fn(live.len(), |c, _| part.right[kept[live[c]]] - share * normal.right[live[c]])
            })
            .collect();
        let mut scatter = DMatrix::zeros(live.len(), live.len());
        for (at, slope) in slopes.iter().enumerate() {
            scatter += slope * slope.transpose();
            for apart in 1..=NEIGHBOURS {
                let Some(next) = slopes.get(at + apart).filter(|_| self.trial(at) == self.trial(at + apart)) else {
                    break;
                };
                let weight = 1.0 - apart as f64 / (NEIGHBOURS + 1) as f64;
                scatter += weight * (slope * next.transpose() + next * slope.transpose());
            }
        }
        // As many degrees of freedom as parameters are lost, but for those that something is known of beforehand.
        let lost =
            self.parts.len() as f64 / (self.parts.len() as f64 - (live.len() - known.min(live.len())) as f64).max(1.0);
        let wide = &inverse * scatter * &inverse * lost;
        let error = |(at, c): (usize, &usize)| {
            let error = live
                .iter()
                .position(|live| *live == at)
                .map_or(f64::INFINITY, |l| (spread * inverse[(l, l)]).max(wide[(l, l)]).sqrt());
            (self.columns[*c], error)
        };
        kept.iter().enumerate().map(error).collect()
    }
}

/// The columns and their varied models.
fn derivatives(fit: &Fit, first: usize) -> (Vec<Column>, Vec<Varied>) {
    let free = free_values(&fit.model, first);
    let parameters = free.iter().zip(varied_models(&fit.model, &free));
    let parameters = parameters.filter_map(|(free, varied)| Some((Column::Parameter(*free), varied?)));
    let expressions = (first..fit.model.effects.len()).filter_map(|at| {
        let spec = &fit.model.effects[at];
        let text = format!("{}*({})", 1.0 + EXPRESSION_STEP, spec.expression.as_ref()?);
        let mut model = fit.model.clone();
        model.effects[at] = EffectSpec::expression(spec.target.as_ref()?, &text).ok()?;
        let examined = Examined::new(&model).ok()?;
        let varied = Varied { examined, effect: model.effects[at].id.clone(), size: EXPRESSION_STEP };
        Some((Column::Expression(at), varied))
    });
    parameters.chain(expressions).unzip()
}

/// Blocks of about the same length that do not reach over the end of a trial.
fn blocks(trials: &[Trial]) -> Vec<Vec<Block>> {
    let duration = |trial: &Trial| trial.time[trial.len() - 1] - trial.time[0];
    let total: f64 = trials.iter().map(duration).sum();
    let of_trial = |(at, trial): (usize, &Trial)| {
        let length = duration(trial);
        let count = (BLOCKS * length / total).round().min((length / SHORTEST).floor()).max(1.0);
        let edge = |k: f64| trial.time[0] + length * k / count;
        (0..count as usize)
            .map(|k| Block {
                trial: at,
                start: edge(k as f64),
                end: edge(k as f64 + 1.0),
                size: f64::NAN,
                standard_error: f64::INFINITY,
            })
            .collect()
    };
    trials.iter().enumerate().map(of_trial).collect()
}

/// The normal equations of the parts of each block of a trial.
fn parts(fit: &Fit, linear: &LinearTrial, trial: &Trial, forcing: &Forcing, blocks: &[Block]) -> Vec<Normal> {
    let randomness = for_trial(&fit.randomness, trial);
    let mut normals = vec![Normal::empty(forcing.columns); PARTS * blocks.len()];
    whitened_rows(linear, &randomness, forcing, |at, innovation, e| {
        let time = trial.time[at / linear.channels];
        let block = blocks.iter().position(|b| time < b.end).unwrap_or(blocks.len() - 1);
        let Block { start, end, .. } = blocks[block];
        let part = (PARTS as f64 * (time - start) / (end - start)) as usize;
        normals[PARTS * block + part.min(PARTS - 1)].push(e, innovation);
    });
    normals.iter_mut().for_each(Normal::mirror);
    normals
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::recording::{fitted, noise, record};

    /// Found drag and its standard error, where the position wanders beside its white noise by so much (m).
    fn drag(wander: f64, seed: u64) -> (f64, f64) {
        let drag = EffectSpec::new("platform_linear_drag", None, &[60.0]).expect("an effect");
        let mut trial = record(std::slice::from_ref(&drag), 120.0, seed);
        let mut wandered = 0.0;
        for (row, step) in trial.measured.iter_mut().zip(noise(trial.time.len(), 7 * seed)) {
            wandered = 0.98 * wandered + 0.2 * wander * step;
            row[0] += wandered;
        }
        let trials = [trial];
        let mut fit = fitted(&[drag], &trials);
        fit.randomness = fit.randomness.without_latents();
        fit.randomness.noise = crate::filter::estimate::noise_of_data(&trials);
        let by_block = ByBlock::new(&fit, &trials, 0);
        let normal = by_block.normals.iter().fold(Normal::empty(1), |mut sum, normal| {
            sum.add(normal);
            sum
        });
        let change = normal.right[0] / normal.gram[0];
        (change, by_block.standard_errors(&fit.model)[0].1)
    }

    #[test]
    fn errors_are_wider_where_the_noise_has_memory_that_is_not_known() {
        let drags: Vec<(f64, f64)> = (50..62).map(|seed| drag(0.01, seed)).collect();
        let (_, white) = drag(0.0, 50);
        let over = |error: &dyn Fn(f64) -> f64| {
            let squares: f64 = drags.iter().map(|(change, wide)| (change / error(*wide)).powi(2)).sum();
            (squares / drags.len() as f64).sqrt()
        };
        let (by_white, by_scatter) = (over(&|_| white), over(&|wide| wide));
        assert!(by_white > 5.0 && by_scatter < 2.0, "{by_white} {by_scatter} {drags:?}");
    }
}
