//! Sizes of what is random, by the method of scoring: Newton's method on the likelihood, with the information that is to be
//! expected in the place of its curvature, from how innovations and their variances change with each size (N. K. Gupta and
//! R. K. Mehra, Computational aspects of maximum likelihood estimation and reduction in sensitivity function calculations,
//! IEEE Transactions on Automatic Control 19, 1974). All sizes move at once: noise with memory, its time constant and white
//! noise can stand for one another, and by themselves would take many small steps.

use std::ops::RangeInclusive;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::expected::along_expected;
use super::sizing::{At, Size, Sizing};
use crate::data::Trial;
use crate::filter::estimate::{Fit, for_trial};
use crate::filter::kalman::{Keep, Run, STRETCH};
use crate::filter::path::LinearTrial;
use crate::filter::whiten::Normal;
use crate::model::randomness::Randomness;
use crate::weigh::criterion::EVIDENCE;
use crate::weigh::solve::{solve, solve_within};

/// Change of the logarithm of a size for its slopes.
const STEP: f64 = 1e-3;
/// Most that the logarithm of a size is promised to move in one round: a factor of three.
const MOST: f64 = 1.1;
/// Most rounds.
const ROUNDS: usize = 12;
/// Fall of `-2 log L` that a round must promise, and that a move must bring: a hundredth of what counts as evidence.
const LEAST: f64 = 0.01 * EVIDENCE;
/// How many times as long as promised a move may be, and is worth a look: the information to be expected makes too much of sizes that
/// stand for one another, and a look costs one run of the filter where new slopes take one more than there are sizes.
const LONGER: RangeInclusive<f64> = 1.2..=4.0;
/// Information on the logarithm of a size below which the data say nothing of it: its standard error is ten.
const NOTHING: f64 = 0.02;
/// Damping, as a share of the information: at first, by how much more after a move that fails, and the most.
const DAMPING: (f64, f64, f64) = (1e-3, 30.0, 100.0);

/// Slope of `-2 log L` by the logarithms of sizes, and its curvature as it is to be expected.
struct Slopes {
    slope: DVector<f64>,
    information: DMatrix<f64>,
}

impl Slopes {
    fn nothing(sizes: usize) -> Self {
        Self { slope: DVector::zeros(sizes), information: DMatrix::zeros(sizes, sizes) }
    }

    fn plus(mut self, other: &Self) -> Self {
        self.slope += &other.slope;
        self.information += &other.information;
        self
    }

    /// Takes up a measurement: its innovation, whitened, and by each size the slopes of that (before it was whitened, over its
    /// deviation) and of the logarithm of its variance.
    fn push(&mut self, whitened: f64, slopes: &[(f64, f64)]) {
        for (i, (moves, widens)) in slopes.iter().enumerate() {
            self.slope[i] += widens * (1.0 - whitened * whitened) + 2.0 * whitened * moves;
            for (j, (other_moves, other_widens)) in slopes[..=i].iter().enumerate() {
                self.information[(i, j)] += widens * other_widens + 2.0 * moves * other_moves;
            }
        }
    }

    /// Whether the data say anything of each size.
    fn told(&self) -> Vec<bool> {
        self.information.diagonal().iter().map(|information| *information > NOTHING).collect()
    }

    /// The slope of `-2 log L` along a move.
    fn along(&self, step: &[f64]) -> f64 {
        self.slope.iter().zip(step).map(|(slope, step)| slope * step).sum()
    }

    /// The best move of the sizes within these ranges, damped, and the fall of `-2 log L` that it promises.
    fn step(&self, damping: f64, ranges: &[RangeInclusive<f64>]) -> (Vec<f64>, f64) {
        let n = self.slope.len();
        let mut normal = Normal::empty(n);
        for (r, c) in (0..n).flat_map(|r| (0..n).map(move |c| (r, c))) {
            let damped = if r == c { 1.0 + damping } else { 1.0 };
            normal.gram[r * n + c] = damped * self.information[(r.max(c), r.min(c))];
        }
        normal.right.iter_mut().zip(&self.slope).for_each(|(slot, slope)| *slot = -slope);
        let unknown = self.told().into_iter().enumerate().filter(|(_, told)| !told);
        normal.silence(&unknown.map(|(at, _)| at).collect::<Vec<usize>>());
        let step = solve_within(&normal, &solve(&normal).0, ranges);
        let promise = 0.5 * normal.drop(&step);
        (step, promise)
    }
}

/// Where, in moves of one, the parabola is least that begins with this slope and has come to this `change` after one; no further than a
/// move may be longer.
fn least_along(slope: f64, change: f64) -> f64 {
    let bend = change - slope;
    if bend > 0.0 { (-0.5 * slope / bend).min(*LONGER.end()) } else { *LONGER.end() }
}

/// A model linearised along each trial, and what is random there.
type Varied = (Option<Vec<LinearTrial>>, Randomness);

impl Sizing<'_> {
    /// The most likely `sizes` that are reached from a place.
    pub(super) fn most_likely(&self, fit: &Fit, sizes: &[Size], from: At) -> At {
        self.likely_enough(fit, sizes, from, f64::INFINITY)
    }

    /// The same as far as it may come to a `-2 log L` of `enough`: what all rounds that are left do not bring, where each brings what
    /// the next one promises, is not looked for.
    pub(super) fn likely_enough(&self, fit: &Fit, sizes: &[Size], mut best: At, enough: f64) -> At {
        let (first, more, most) = DAMPING;
        let mut damping = first;
        let mut sizes = sizes.to_vec();
        for round in 0..ROUNDS {
            let least = LEAST.max((best.value - enough) / (ROUNDS - round) as f64);
            let slopes = self.slopes(fit, &sizes, &best.randomness);
            let ranges: Vec<RangeInclusive<f64>> =
                sizes.iter().map(|size| self.range_of_move(&best.randomness, *size)).collect();
            let begin = best.value;
            while damping <= most {
                let (step, promise) = slopes.step(damping, &ranges);
                if promise < least {
                    return best;
                }
                let moved = |times: f64| {
                    let scaled = |randomness: Randomness, (size, step): (&Size, &f64)| {
                        self.scaled(&randomness, *size, (times * step).exp())
                    };
                    self.at(fit, sizes.iter().zip(&step).fold(best.randomness.clone(), scaled))
                };
                let next = moved(1.0);
                if next.value < best.value {
                    let times = least_along(slopes.along(&step), next.value - best.value);
                    let further = LONGER.contains(&times).then(|| moved(times));
                    best = further.filter(|further| further.value < next.value).unwrap_or(next);
                    damping = (damping / more).max(first);
                    break;
                }
                damping *= more;
            }
            if begin - best.value < LEAST {
                return best;
            }
            let mut told = slopes.told().into_iter();
            sizes.retain(|_| told.next().is_some_and(|told| told));
        }
        best
    }

    /// By how much the logarithm of a size may move in one round: not beyond a bound at which it is.
    fn range_of_move(&self, from: &Randomness, size: Size) -> RangeInclusive<f64> {
        let [down, up] =
            [-MOST, MOST].map(|step| if self.scaled(from, size, step.exp()).same(from) { 0.0 } else { step });
        down..=up
    }

    fn slopes(&self, fit: &Fit, sizes: &[Size], from: &Randomness) -> Slopes {
        // Away from a bound where a size is at one.
        let varied = |size: &Size| {
            let moved = [STEP, -STEP].map(|step| (step, self.scaled(from, *size, step.exp())));
            moved.into_iter().find(|(_, randomness)| !randomness.same(from))
        };
        let varied: Vec<Option<(f64, Randomness)>> = sizes.iter().map(varied).collect();
        let steps: Vec<Option<f64>> = varied.iter().map(|varied| varied.as_ref().map(|(step, _)| *step)).collect();
        let all = std::iter::once(from.clone()).chain(varied.into_iter().flatten().map(|(_, randomness)| randomness));
        let all: Vec<Varied> = all.map(|randomness| self.along(fit, randomness)).collect();
        let own = fit.linear(self.trials);
        let of_trial = |(t, trial): (usize, &Trial)| {
            let runs: Vec<(&LinearTrial, Randomness)> = all
                .iter()
                .map(|(linear, randomness)| (&linear.as_ref().unwrap_or(&own)[t], for_trial(randomness, trial)))
                .collect();
            of_trial(&runs, &steps)
        };
        let parts: Vec<Slopes> = self.trials.par_iter().enumerate().map(of_trial).collect();
        parts.iter().fold(Slopes::nothing(sizes.len()), Slopes::plus)
    }

    /// Where the recorded forces have a white error, the models along those that are to be expected.
    fn along(&self, fit: &Fit, randomness: Randomness) -> Varied {
        if randomness.white_input() > 0.0 {
            let (linear, randomness) = along_expected(fit, self.trials, &randomness);
            return (Some(linear), randomness);
        }
        (None, randomness)
    }
}

/// What one trial says: `runs` of the filter as it is and with each size that can be moved by its step.
fn of_trial(runs: &[(&LinearTrial, Randomness)], steps: &[Option<f64>]) -> Slopes {
    let mut out = Slopes::nothing(steps.len());
    let mut running: Vec<Run<'_>> = runs.iter().map(|(linear, randomness)| Run::new(linear, randomness)).collect();
    let len = runs[0].0.len;
    let mut slopes = vec![(0.0, 0.0); steps.len()];
    for first in (0..len).step_by(STRETCH) {
        let end = (first + STRETCH).min(len);
        let filtered: Vec<_> = running.par_iter_mut().map(|run| run.advance(end, Keep::Innovations)).collect();
        let (plain, varied) = (&filtered[0], &filtered[1..]);
        for (at, whitened) in plain.whitened.iter().enumerate().filter(|(_, whitened)| whitened.is_finite()) {
            let deviation = plain.deviation[at];
            let mut varied = varied.iter();
            for (slopes, step) in slopes.iter_mut().zip(steps) {
                if let Some((step, other)) = step.and_then(|step| Some((step, varied.next()?))) {
                    let ratio = other.deviation[at] / deviation;
                    *slopes = ((other.whitened[at] * ratio - whitened) / step, 2.0 * ratio.ln() / step);
                }
            }
            out.push(*whitened, &slopes);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::recording::{fitted, noise, record};
    use crate::model::randomness::Memory;
    use crate::weigh::criterion::Penalty;

    /// Recordings whose x has first-order noise of 10 mm with a time constant of 0.8 s, and a fit that knows of such noise.
    fn wandering() -> ([Trial; 2], Fit) {
        let trials = [71, 72].map(|seed| {
            let mut trial = record(&[], 40.0, seed);
            let decay = (-trial.interval() / 0.8).exp();
            let mut wander = 0.0;
            let white = noise(trial.len(), seed);
            for (row, white) in trial.measured.iter_mut().zip(white) {
                wander = decay * wander + 0.01 * (1.0 - decay * decay).sqrt() * white;
                row[0] += wander;
            }
            trial
        });
        let mut fit = fitted(&[], &trials);
        let memory = Memory { channel: 0, deviation: 0.01, time: 0.8, drift: false };
        fit.randomness = fit.randomness.without_latents().with_memory(memory);
        (trials, fit)
    }

    const SIZES: [Size; 4] = [Size::Memory(0), Size::Time(0), Size::WhiteOf(0), Size::Jitter];

    /// `(x - a)²`, which begins with the slope `-2 a` and changes by `1 - 2 a` in a move of one.
    #[test]
    fn a_move_goes_on_to_where_the_parabola_is_least() {
        for a in [0.5, 1.0, 3.0] {
            assert_eq!(least_along(-2.0 * a, 1.0 - 2.0 * a), a);
        }
        // Beyond what is looked at, and where nothing bends.
        assert_eq!([least_along(-20.0, -19.0), least_along(-2.0, -2.0)], [*LONGER.end(); 2]);
    }

    #[test]
    fn slopes_are_those_of_the_likelihood() {
        let (trials, fit) = wandering();
        let noise = fit.randomness.noise.clone();
        let sizing = Sizing::new(&trials, &noise, Penalty::NONE).with_any_error_of_forces();
        let from = Randomness { jitter: 2e-3, input: 20.0, ..fit.randomness.clone() };
        for size in SIZES.into_iter().chain([Size::Input]) {
            let found = sizing.slopes(&fit, &[size], &from).slope[0];
            let value = |step: f64| sizing.at(&fit, sizing.scaled(&from, size, step.exp())).value;
            let expected = (value(1e-3) - value(-1e-3)) / 2e-3;
            assert!((found - expected).abs() < 0.02 * expected.abs() + 0.5, "{size:?}: {found} {expected}");
        }
    }

    /// Noise at the least that it can be goes up and not down, also where other channels are not measured.
    #[test]
    fn a_size_at_its_bound_moves_away_from_it() {
        let (trials, fit) = wandering();
        let noise = fit.randomness.noise.clone();
        let sizing = Sizing::new(&trials, &noise, Penalty::NONE);
        assert!(noise.iter().any(|noise| noise.is_nan()));
        let mut bounded = fit.randomness.clone();
        bounded.least_noise[0] = bounded.noise[0];
        assert_eq!(sizing.range_of_move(&bounded, Size::WhiteOf(0)), 0.0..=MOST);
        assert_eq!(sizing.range_of_move(&bounded, Size::Memory(0)), -MOST..=MOST);
        let of_noise = sizing.slopes(&fit, &[Size::WhiteOf(0)], &bounded).slope[0];
        assert!(of_noise.abs() > 1.0, "{of_noise}");
    }

    #[test]
    fn the_most_likely_sizes_are_found_from_three_times_off() {
        let (trials, fit) = wandering();
        let noise = fit.randomness.noise.clone();
        let sizing = Sizing::new(&trials, &noise, Penalty::NONE);
        let mut off = fit.randomness.clone();
        (off.memory[0].deviation, off.memory[0].time) = (0.03, 0.25);
        off.noise[0] *= 3.0;
        let found = sizing.most_likely(&fit, &SIZES, sizing.at(&fit, off));
        let truth = sizing.at(&fit, fit.randomness.clone());
        assert!(found.value < truth.value, "{} {}", found.value, truth.value);
        let memory = found.randomness.memory[0];
        assert!((memory.deviation / 0.01).ln().abs() < 0.5 && (memory.time / 0.8).ln().abs() < 0.7, "{memory:?}");
        for size in SIZES {
            for factor in [0.9, 1.1] {
                let other = sizing.at(&fit, sizing.scaled(&found.randomness, size, factor));
                assert!(other.value > found.value - 2.0 * LEAST, "{size:?}");
            }
        }
    }

    /// Where ten times what the sizes can bring is asked for, and where all that they bring is.
    #[test]
    fn what_cannot_be_reached_is_not_looked_for() {
        let (trials, fit) = wandering();
        let noise = fit.randomness.noise.clone();
        let sizing = Sizing::new(&trials, &noise, Penalty::NONE);
        let mut off = fit.randomness.clone();
        off.memory[0].deviation = 0.03;
        let begin = sizing.at(&fit, off);
        let best = sizing.most_likely(&fit, &SIZES, begin.clone()).value;
        let come_to = |enough: f64| sizing.likely_enough(&fit, &SIZES, begin.clone(), enough).value;
        assert_eq!(come_to(best - 1e6), begin.value);
        assert!(come_to(best) < best + EVIDENCE, "{} {best}", come_to(best));
    }
}
