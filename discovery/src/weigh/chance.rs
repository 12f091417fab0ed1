//! What chance would explain: candidates weighed against innovations that are shifted.
//!
//! If a candidate has nothing to do with the innovations, moving them against its signature changes nothing, so the gain of
//! the best candidate over many shifts is what chance gives. What depends on the state is out of phase once the innovations
//! are shifted in time; a law of time alone, a mean or a wave, is not: its power stays where it was, and only a shift in
//! frequency moves it. So each control run shifts both, the time in a circle and the frequency by some of the slowest waves
//! of the trial: what is smooth in time and in frequency is as likely at the one place as at the other. Shifted innovations
//! keep their spectrum but for those waves, their tails and what one channel has to do with another. Innovations that still
//! hold the work of a missing effect are not white, and by chance they agree better with slow signatures than white ones: the
//! test then errs on the safe side.
//!
//! The test repeats the weighing only. Neighbouring shifts are not independent: one in 99 tells no more than the order of
//! magnitude.

use std::f64::consts::{SQRT_2, TAU};
use std::sync::Arc;

use nalgebra::DMatrix;
use rayon::prelude::*;

use crate::data::Trial;
use crate::filter::error::FitError;
use crate::filter::estimate::{Fit, for_trial};
use crate::filter::kalman::{Keep, Randomness, filter};
use crate::filter::path::LinearTrial;
use crate::filter::whiten::{Normal, Products, Whitening};
use crate::hypothesis::along::Along;
use crate::hypothesis::candidates::Library;
use crate::hypothesis::stream::Stream;
use crate::outcome::NullTest;
use crate::weigh::criterion::Penalty;
use crate::weigh::regression::{Beside, Level, all_pairs, rank};

/// Number of shifts.
const SHIFTS: usize = 99;
/// Smallest shift, either way round (s): longer than the memory of the filter and of the latent disturbances.
const SMALLEST: f64 = 5.0;
/// Waves over a trial by which frequencies are shifted, from one on: few, for a spectrum is smooth over few.
const WAVES: usize = 5;
/// The golden ratio's fraction: its multiples fill a circle evenly.
const PHASE: f64 = 0.618_033_988_749_894_9;
/// Measurements that are multiplied at a time.
const BLOCK: usize = 256;

/// A weighing of candidates: the fit whose innovations they are to explain, at one size of the latent disturbances.
pub(crate) struct Weighing<'a> {
    pub(crate) fit: &'a Fit,
    pub(crate) trials: &'a [Trial],
    pub(crate) library: &'a Library,
    pub(crate) randomness: &'a Randomness,
}

/// What comes of weighing all candidates.
#[derive(Clone)]
pub(crate) struct Weighed {
    pub(crate) level: Level,
    /// The right side of the normal equations at every shift; none where a trial is too short.
    shifted: Option<Arc<Vec<Vec<f64>>>>,
    /// The variations that could not be simulated along the fit, and why.
    pub(crate) failures: Arc<Vec<(usize, FitError)>>,
}

impl Weighed {
    /// The weighing beside what shifted innovations make of it; `threshold` is the gain from which a candidate would be
    /// looked at.
    pub(crate) fn null_test(&self, library: &Library, penalty: Penalty, threshold: f64) -> Option<NullTest> {
        Some(self.chance(library, penalty)?.against(gain(library, &self.level, penalty), threshold))
    }

    /// What the best candidate gains from innovations that are shifted.
    pub(crate) fn chance(&self, library: &Library, penalty: Penalty) -> Option<Chance> {
        let gain_at = |right: &Vec<f64>| {
            let normal = Normal { right: right.clone(), ..self.level.normal.clone() };
            gain(library, &Level { normal }, penalty)
        };
        Some(Chance { gains: self.shifted.as_ref()?.par_iter().map(gain_at).collect() })
    }
}

/// Gain of the best candidate.
fn gain(library: &Library, level: &Level, penalty: Penalty) -> f64 {
    let ranked = rank(library, std::slice::from_ref(level), penalty);
    ranked.first().map_or(f64::NEG_INFINITY, |best| level.normal.minus_two_log_likelihood - best.score)
}

impl Weighing<'_> {
    /// Weighs the candidates against the innovations as they are and shifted.
    pub(crate) fn weigh(&self) -> Weighed {
        let shifts: Option<Vec<Vec<Shift>>> = (0..self.trials.len()).map(|t| shifts(&self.trials[t], t)).collect();
        let pairs = all_pairs(self.library);
        let linear = self.fit.linear(self.trials);
        let of_trial = |t: usize| {
            let shifts = shifts.as_ref().map_or(&[][..], |shifts| &shifts[t]);
            self.shifted(&linear, t, shifts, &pairs)
        };
        let parts: Vec<Part> = (0..self.trials.len()).into_par_iter().map(of_trial).collect();
        let mut normal = Normal::empty(self.library.columns.len());
        parts.iter().for_each(|part| normal.add(&part.normal));
        let shifted = |i: usize| -> Vec<f64> {
            let pairs: usize = parts.iter().map(|part| part.shifted.pairs[i]).sum();
            // Where a gap meets a measurement nothing is added: the others stand for it.
            let scale = (normal.count as f64 / pairs.max(1) as f64).sqrt();
            let sum = |c: usize| parts.iter().map(|part| f64::from(part.shifted.right[(c, i)])).sum::<f64>();
            (0..normal.columns).map(|c| scale * sum(c)).collect()
        };
        let mut shifted = shifts.map(|_| (0..SHIFTS).map(shifted).collect::<Vec<_>>());
        let beside = Beside::new(self.library, &normal);
        beside.take_from(&mut normal);
        shifted.iter_mut().flatten().for_each(|right| beside.take_from_right(right));
        let shifted = shifted.map(Arc::new);
        let failures = Arc::new(parts.into_iter().flat_map(|part| part.failures).collect());
        Weighed { level: Level { normal }, shifted, failures }
    }

    /// The normal equations of one trial, and its innovations, shifted the same in all channels, on its whitened signatures.
    fn shifted(&self, linear: &[LinearTrial], t: usize, shifts: &[Shift], pairs: &[(usize, usize)]) -> Part {
        let along = Along::new(self.fit, linear, self.trials, t);
        let (linear, columns) = (along.linear, self.library.columns.len());
        let randomness = for_trial(self.randomness, &self.trials[t]);
        let filtered = filter(linear, &randomness, Keep::Innovations);
        let whitened: Vec<f32> = filtered.whitened.iter().map(|v| *v as f32).collect();
        let wave = wave(linear.len);
        let mut out = Shifted { right: DMatrix::zeros(columns, shifts.len()), pairs: vec![0; shifts.len()] };
        // A column a measurement, and a row a measurement, of the block at hand.
        let mut signatures = DMatrix::zeros(columns, BLOCK);
        let mut innovations = DMatrix::zeros(BLOCK, shifts.len());
        let mut filled = 0;
        let mut products = Products::new(columns, Some(pairs));
        let mut visit = |at: usize, innovation: f64, e: &[f64]| {
            products.push(e, innovation);
            for (slot, value) in signatures.column_mut(filled).iter_mut().zip(e) {
                *slot = *value as f32;
            }
            for (i, shift) in shifts.iter().enumerate() {
                let innovation = whitened[(at + shift.samples * linear.channels) % whitened.len()];
                let factor = wave[shift.phase(at / linear.channels, linear.len)];
                out.pairs[i] += usize::from(innovation.is_finite());
                innovations[(filled, i)] = if innovation.is_finite() { factor * innovation } else { 0.0 };
            }
            filled += 1;
            if filled == BLOCK {
                out.right.gemm(1.0, &signatures, &innovations, 1.0);
                filled = 0;
            }
        };
        let mut stream = Stream::new(&along, (&self.library.variations, &self.library.columns));
        let mut whitening = Whitening::new(linear, &randomness, columns);
        while let Some(samples) = stream.stretch() {
            whitening.advance(&stream.advance(samples.end), samples.end, &mut visit);
        }
        out.right.gemm(1.0, &signatures.columns(0, filled), &innovations.rows(0, filled), 1.0);
        let mut normal = products.normal(whitening.minus_two_log_likelihood());
        let silent = stream.silent();
        normal.silence(&silent);
        silent.into_iter().for_each(|column| out.right.row_mut(column).fill(0.0));
        Part { normal, shifted: out, failures: stream.failures().collect() }
    }
}

/// What comes of one trial.
struct Part {
    normal: Normal,
    shifted: Shifted,
    failures: Vec<(usize, FitError)>,
}

/// What the best candidate gains by chance, in every control run.
pub(crate) struct Chance {
    pub(crate) gains: Vec<f64>,
}

impl Chance {
    /// What was `found`, as a fall of the information criterion, beside it; `threshold` as in [`NullTest`].
    pub(crate) fn against(&self, found: f64, threshold: f64) -> NullTest {
        NullTest {
            shifts: self.gains.len(),
            found,
            as_strong: self.gains.iter().filter(|gain| **gain >= found).count(),
            over_threshold: self.gains.iter().filter(|gain| **gain >= threshold).count(),
            largest: self.gains.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        }
    }
}

/// How the innovations of a trial are moved in one control run.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Shift {
    /// In time.
    samples: usize,
    /// In frequency, in waves over the trial.
    waves: usize,
    /// Phase of that wave at the start, as a share of a turn.
    start: f64,
}

impl Shift {
    /// The place in a turn of `len` at sample `k`.
    fn phase(&self, k: usize, len: usize) -> usize {
        (self.waves * k + (self.start * len as f64) as usize) % len
    }
}

/// A turn of `√2 cos`, which shifts frequencies up and down and keeps the mean square.
fn wave(len: usize) -> Vec<f32> {
    (0..len).map(|k| (SQRT_2 * (TAU * k as f64 / len as f64).cos()) as f32).collect()
}

/// Shifts of the trial of number `t`, in time evenly spread over it; `None` where it has no room for them.
fn shifts(trial: &Trial, t: usize) -> Option<Vec<Shift>> {
    let smallest = (SMALLEST / trial.interval()).ceil() as usize;
    let room = trial.len().checked_sub(2 * smallest).filter(|room| *room >= SHIFTS)?;
    let shift = |i: usize| Shift {
        samples: smallest + (2 * i + 1) * room / (2 * SHIFTS),
        waves: 1 + (i + t) % WAVES,
        // Phases that fill the circle evenly, other ones for each trial.
        start: (PHASE * ((i + 1) * (t + 1)) as f64).fract(),
    };
    Some((0..SHIFTS).map(shift).collect())
}

/// The right side of the normal equations at every shift.
struct Shifted {
    /// A row a signature, a column a shift.
    right: DMatrix<f32>,
    /// Measurements that met an innovation.
    pairs: Vec<usize>,
}

#[cfg(test)]
mod tests {
    use cdpr::effect::EffectSpec;

    use super::*;
    use crate::data::recording::{fitted, noise, record};
    use crate::filter::whiten::whitened_rows;
    use crate::hypothesis::candidates::{Situation, catalogue};
    use crate::hypothesis::stream::forcing;

    /// Calls `look` with the weighing of the catalogue on the default model.
    fn weigh<T>(trials: &[Trial], look: impl FnOnce(&Weighing<'_>, Penalty) -> T) -> T {
        let fit = fitted(&[], trials);
        let library = catalogue(&fit.model, &Situation::of(trials));
        let count = trials.iter().flat_map(|trial| trial.measured.iter().flatten()).filter(|v| v.is_finite()).count();
        let (randomness, penalty) = (&fit.randomness, Penalty::new(count));
        look(&Weighing { fit: &fit, trials, library: &library, randomness }, penalty)
    }

    fn test(missing: &[(&str, &[f64])]) -> NullTest {
        let effects: Vec<EffectSpec> =
            missing.iter().map(|(id, values)| EffectSpec::new(id, None, values).expect("an effect")).collect();
        let trials = [record(&effects, 30.0, 11), record(&effects, 24.0, 12)];
        let look = |weighing: &Weighing<'_>, penalty| weighing.weigh().null_test(weighing.library, penalty, 10.0);
        weigh(&trials, look).expect("room for shifts")
    }

    #[test]
    fn nothing_missing_is_no_better_than_chance() {
        let test = test(&[]);
        assert!(test.as_strong > 4, "{test:?}");
        assert_eq!(test.over_threshold, 0, "{test:?}");
        assert!(test.found < 0.0, "{test:?}");
    }

    #[test]
    fn chance_does_not_do_what_a_missing_effect_does() {
        let test = test(&[("platform_linear_drag", &[60.0])]);
        assert_eq!(test.as_strong, 0, "{test:?}");
        assert!(test.found > 2.0 * test.largest, "{test:?}");
    }

    /// Of white noise of unit size the mean of `n` numbers has the variance `1/n`.
    #[test]
    fn means_by_chance_are_as_large_as_those_of_noise() {
        let (trial, wave) = (record(&[], 30.0, 1), wave(301));
        let shifts = shifts(&trial, 0).expect("shifts");
        let mut square = 0.0;
        for seed in 0..20 {
            let noise: Vec<f64> = noise(trial.len(), seed).collect();
            for shift in &shifts {
                let moved =
                    |k: usize| noise[(k + shift.samples) % noise.len()] * f64::from(wave[shift.phase(k, noise.len())]);
                let mean = (0..noise.len()).map(moved).sum::<f64>() / noise.len() as f64;
                square += mean * mean / (20 * SHIFTS) as f64;
            }
        }
        let ratio = square * trial.len() as f64;
        assert!((0.8..1.25).contains(&ratio), "{ratio}");
    }

    /// Shifted in time alone a mean and a wave are again themselves, and chance would explain all of them.
    #[test]
    fn a_shift_in_frequency_moves_a_law_of_time_alone() {
        let trial = record(&[], 30.0, 1);
        let (len, wave) = (trial.len(), wave(trial.len()));
        let power = |values: &dyn Fn(usize) -> f64, waves: f64| {
            let turn = |k: usize| TAU * waves * k as f64 / len as f64;
            let sum =
                (0..len).fold([0.0; 2], |[c, s], k| [c + values(k) * turn(k).cos(), s + values(k) * turn(k).sin()]);
            sum[0].hypot(sum[1]) / len as f64
        };
        for waves in [0.0, 7.0] {
            let law = |k: usize| (TAU * waves * (k % len) as f64 / len as f64).cos();
            for shift in shifts(&trial, 0).expect("shifts") {
                let in_time = power(&|k| law(k + shift.samples), waves);
                let in_both = power(&|k| law(k + shift.samples) * f64::from(wave[shift.phase(k, len)]), waves);
                assert!(in_time > 0.2, "{waves} {shift:?}: {in_time}");
                assert!(in_both < 1e-3, "{waves} {shift:?}: {in_both}");
            }
        }
    }

    /// A shift cannot move a constant; its own mean is no chance.
    #[test]
    fn a_constant_is_told_from_chance() {
        let test = test(&[("steady_wind", &[60.0, 0.0, 0.0])]);
        assert_eq!((test.as_strong, test.over_threshold), (0, 0), "{test:?}");
        assert!(test.found > 10.0, "{test:?}");
    }

    #[test]
    fn shifts_are_spread_over_the_trial_and_short_trials_have_none() {
        let trial = record(&[], 30.0, 1);
        let all = shifts(&trial, 0).expect("shifts");
        assert_eq!(all.len(), SHIFTS);
        assert!(all[0].samples >= 50 && all[SHIFTS - 1].samples <= trial.len() - 50, "{all:?}");
        assert!(all.windows(2).all(|pair| pair[1].samples > pair[0].samples), "{all:?}");
        assert!((1..=WAVES).all(|waves| all.iter().any(|shift| shift.waves == waves)), "{all:?}");
        assert_eq!(shifts(&trial.part(0..190, String::new()), 0), None);
    }

    /// Blocks, gaps and the end of the circle, against the sum as it is written.
    #[test]
    fn the_sums_are_those_of_a_circle_with_gaps() {
        let mut trial = record(&[], 30.0, 21);
        for (k, row) in trial.measured.iter_mut().enumerate() {
            for (j, value) in row.iter_mut().enumerate() {
                if (7 * k + 3 * j) % 10 == 0 || (100..130).contains(&k) && j < 3 {
                    *value = f64::NAN;
                }
            }
        }
        let trials = [trial];
        weigh(&trials, |weighing, _| {
            let shift = |samples, waves, start| Shift { samples, waves, start };
            let linear = weighing.fit.linear(&trials);
            let shifts = [shift(0, 0, 0.0), shift(77, 1, 0.3), shift(250, 5, 0.9)];
            let Part { normal, shifted: sums, .. } =
                weighing.shifted(&linear, 0, &shifts, &all_pairs(weighing.library));
            let randomness = for_trial(weighing.randomness, &trials[0]);
            let filtered = filter(&linear[0], &randomness, Keep::Innovations);
            let wave = wave(trials[0].len());
            let columns = weighing.library.columns.len();
            let along = Along::new(weighing.fit, &linear, weighing.trials, 0);
            let all = forcing(&along, (&weighing.library.variations, &weighing.library.columns));
            let mut expected = vec![vec![0.0; columns]; 3];
            let mut pairs = [0; 3];
            whitened_rows(along.linear, &randomness, &all, |at, _, e| {
                let (k, j) = (at / 7, at % 7);
                for (i, shift) in shifts.iter().enumerate() {
                    let place = (k + shift.samples) % trials[0].len() * 7 + j;
                    let factor = f64::from(wave[shift.phase(k, trials[0].len())]);
                    let innovation = filtered.whitened[place] * factor;
                    if innovation.is_finite() {
                        pairs[i] += 1;
                        expected[i].iter_mut().zip(e).for_each(|(slot, e)| *slot += e * innovation);
                    }
                }
            });
            assert_eq!(sums.pairs, pairs);
            assert_eq!(pairs[0], normal.count);
            assert!(pairs[1] < pairs[0]);
            for (c, i) in (0..columns).flat_map(|c| (0..3).map(move |i| (c, i))) {
                let size = normal.gram[c * columns + c].sqrt();
                let error = f64::from(sums.right[(c, i)]) - expected[i][c];
                assert!(error.abs() < 1e-3 * (1.0 + size), "column {c}, shift {i}: {error}");
            }
        });
    }
}
