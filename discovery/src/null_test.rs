//! What chance would explain: candidates weighed against innovations that are shifted in time.
//!
//! If a candidate has nothing to do with the innovations, moving them in time against its signature changes nothing, so
//! the gain of the best candidate over many shifts is what chance gives. Shifted innovations keep their spectrum, their
//! tails and what one channel has to do with another. Innovations that still hold the work of a missing effect are not
//! white, and by chance they agree better with slow signatures than white ones: the test then errs on the safe side.
//!
//! A shift moves neither a mean nor a law of time alone, which shifted in time is itself again. The mean of the innovations
//! is therefore replaced by what their slowest waves say that it would be by chance, and laws of time alone are left out.
//! The test repeats the weighing only; what it counts as a false alarm would still have to survive refinement and the
//! held-out data. Neighbouring shifts are not independent: one in 99 tells no more than the order of magnitude.

use std::f64::consts::{SQRT_2, TAU};

use cdpr::effect::DependsOn;
use nalgebra::DMatrix;
use rayon::prelude::*;

use crate::candidates::Library;
use crate::data::Trial;
use crate::estimate::{Fit, for_trial};
use crate::kalman::{Keep, Randomness, filter};
use crate::outcome::NullTest;
use crate::regression::{Level, Penalty, rank};
use crate::whiten::{Forcing, whitened_rows};

/// Number of shifts.
const SHIFTS: usize = 99;
/// Smallest shift, either way round (s): longer than the memory of the filter and of the latent disturbances.
const SMALLEST: f64 = 5.0;
/// Slowest waves of the innovations from which the chance of a mean is taken.
const WAVES: usize = 5;
/// The golden ratio's fraction: its multiples fill a circle evenly.
const PHASE: f64 = 0.618_033_988_749_894_9;
/// Measurements that are multiplied at a time.
const BLOCK: usize = 256;

/// A weighing of candidates: the fit whose innovations they are to explain, their signatures along it, and the normal
/// equations at one size of the latent disturbances.
pub(crate) struct Weighing<'a> {
    pub(crate) fit: &'a Fit,
    pub(crate) trials: &'a [Trial],
    pub(crate) forcing: &'a [Forcing],
    pub(crate) library: &'a Library,
    pub(crate) level: &'a Level,
    pub(crate) randomness: &'a Randomness,
    pub(crate) penalty: Penalty,
}

impl Weighing<'_> {
    /// Repeats the weighing with shifted innovations; `threshold` is the gain from which a candidate would be looked at.
    /// `None` where a trial is too short.
    pub(crate) fn null_test(&self, threshold: f64) -> Option<NullTest> {
        let shifts: Vec<Vec<usize>> = self.trials.iter().map(shifts).collect::<Option<_>>()?;
        let parts: Vec<Shifted> = (0..self.trials.len()).into_par_iter().map(|t| self.shifted(t, &shifts[t])).collect();
        let mut level = Level { normal: self.level.normal.clone() };
        let found = self.gain(&level);
        let by_chance: Vec<f64> = (0..SHIFTS)
            .map(|i| {
                let pairs: usize = parts.iter().map(|p| p.pairs[i]).sum();
                // Where a gap meets a measurement nothing is added: the others stand for it.
                let scale = (level.normal.count as f64 / pairs.max(1) as f64).sqrt();
                for (c, slot) in level.normal.right.iter_mut().enumerate() {
                    *slot = scale * parts.iter().map(|p| f64::from(p.right[(c, i)])).sum::<f64>();
                }
                self.gain(&level)
            })
            .collect();
        Some(NullTest {
            shifts: SHIFTS,
            found,
            as_strong: by_chance.iter().filter(|gain| **gain >= found).count(),
            over_threshold: by_chance.iter().filter(|gain| **gain >= threshold).count(),
            largest: by_chance.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        })
    }

    /// Gain of the best candidate.
    fn gain(&self, level: &Level) -> f64 {
        let ranked = rank(self.library, std::slice::from_ref(level), self.penalty);
        let best = ranked.iter().find(|scored| !of_time_alone(self.library, scored.candidate));
        best.map_or(f64::NEG_INFINITY, |best| level.normal.minus_two_log_likelihood - best.score)
    }

    /// One trial's innovations, shifted in a circle and the same in all channels, on its whitened signatures.
    fn shifted(&self, t: usize, shifts: &[usize]) -> Shifted {
        let (linear, forcing) = (&self.fit.linear[t], &self.forcing[t]);
        let randomness = for_trial(self.randomness, &self.trials[t]);
        let filtered = filter(linear, &randomness, Keep::Innovations);
        let centred = centred(&filtered.whitened, linear.channels);
        let means = chance_means(&centred, linear.channels, t);
        let mut out = Shifted { right: DMatrix::zeros(forcing.columns, shifts.len()), pairs: vec![0; shifts.len()] };
        // A column a measurement, and a row a measurement, of the block at hand.
        let mut signatures = DMatrix::zeros(forcing.columns, BLOCK);
        let mut innovations = DMatrix::zeros(BLOCK, shifts.len());
        let mut filled = 0;
        whitened_rows(linear, &randomness, &filtered, forcing, |at, e| {
            for (slot, value) in signatures.column_mut(filled).iter_mut().zip(e) {
                *slot = *value as f32;
            }
            for (i, shift) in shifts.iter().enumerate() {
                let innovation = centred[(at + shift * linear.channels) % centred.len()];
                let mean = means[i][at % linear.channels];
                out.pairs[i] += usize::from(innovation.is_finite());
                innovations[(filled, i)] = if innovation.is_finite() { innovation + mean } else { 0.0 };
            }
            filled += 1;
            if filled == BLOCK {
                out.right.gemm(1.0, &signatures, &innovations, 1.0);
                filled = 0;
            }
        });
        out.right.gemm(1.0, &signatures.columns(0, filled), &innovations.rows(0, filled), 1.0);
        out
    }
}

/// Whether a candidate is a law of time alone, in phase with any shift.
pub(crate) fn of_time_alone(library: &Library, candidate: usize) -> bool {
    let variations = library.candidates[candidate].columns.iter().flat_map(|c| &library.columns[*c]);
    variations
        .map(|(at, _)| &library.variations[*at])
        .any(|spec| spec.depends_on().is_ok_and(|on| on == [DependsOn::Time]))
}

/// Innovations without the mean of their channel.
fn centred(whitened: &[f64], channels: usize) -> Vec<f32> {
    let mut out: Vec<f32> = whitened.iter().map(|v| *v as f32).collect();
    for j in 0..channels {
        let of_channel = || whitened.iter().skip(j).step_by(channels).filter(|v| v.is_finite());
        let mean = of_channel().sum::<f64>() / of_channel().count().max(1) as f64;
        out.iter_mut().skip(j).step_by(channels).for_each(|v| *v -= mean as f32);
    }
    out
}

/// For each shift a mean of every channel as it may come by chance: for white noise, and for whatever is smooth in
/// frequency, the mean is exchangeable with `√2` times the real part of a slow wave's amplitude at any phase.
fn chance_means(centred: &[f32], channels: usize, trial: usize) -> Vec<Vec<f32>> {
    let len = centred.len() / channels;
    let waves: Vec<Vec<[f64; 2]>> = (1..=WAVES)
        .map(|wave| {
            let mut sums = vec![[0.0; 2]; channels];
            let mut counts = vec![0; channels];
            for (k, row) in centred.chunks_exact(channels).enumerate() {
                let (sin, cos) = (TAU * (wave * k) as f64 / len as f64).sin_cos();
                for (j, value) in row.iter().enumerate().filter(|(_, value)| value.is_finite()) {
                    sums[j][0] += f64::from(*value) * cos;
                    sums[j][1] += f64::from(*value) * sin;
                    counts[j] += 1;
                }
            }
            sums.iter().zip(counts).map(|(s, n)| s.map(|v| SQRT_2 * v / f64::from(n.max(1)))).collect()
        })
        .collect();
    (0..SHIFTS)
        .map(|i| {
            // Phases that fill the circle evenly, other ones for each trial.
            let (sin, cos) = (TAU * (PHASE * (i + 1) as f64 * (trial + 1) as f64).fract()).sin_cos();
            waves[(i + trial) % WAVES].iter().map(|[a, b]| (cos * a + sin * b) as f32).collect()
        })
        .collect()
}

/// Shifts of a trial in samples, evenly spread over it; `None` where it has no room for them.
fn shifts(trial: &Trial) -> Option<Vec<usize>> {
    let smallest = (SMALLEST / trial.interval()).ceil() as usize;
    let room = trial.len().checked_sub(2 * smallest).filter(|room| *room >= SHIFTS)?;
    Some((0..SHIFTS).map(|i| smallest + (2 * i + 1) * room / (2 * SHIFTS)).collect())
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
    use crate::candidates::{Situation, catalogue};
    use crate::data::recording::{fitted, noise, record};
    use crate::regression::levels;
    use crate::round::Signatures;

    /// Calls `look` with the weighing of the catalogue on the default model.
    fn weigh<T>(trials: &[Trial], look: impl FnOnce(&Weighing<'_>) -> T) -> T {
        let fit = fitted(&[], trials);
        let library = catalogue(&fit.model, &Situation::of(trials));
        let Signatures { library, forcing } = Signatures::new(&fit, trials, library);
        let randomness = &fit.randomness;
        let levels = levels(&fit, trials, &forcing, &library, std::slice::from_ref(randomness));
        let (level, penalty) = (&levels[0], Penalty::new(levels[0].normal.count));
        look(&Weighing { fit: &fit, trials, forcing: &forcing, library: &library, level, randomness, penalty })
    }

    fn test(missing: &[(&str, &[f64])]) -> NullTest {
        let effects: Vec<EffectSpec> =
            missing.iter().map(|(id, values)| EffectSpec::new(id, None, values).expect("an effect")).collect();
        let trials = [record(&effects, 30.0, 11), record(&effects, 24.0, 12)];
        weigh(&trials, |weighing| weighing.null_test(10.0)).expect("room for shifts")
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
        let noise: Vec<f32> = noise(7 * 1000, 31).map(|v| v as f32).collect();
        let means = chance_means(&noise, 7, 1);
        let square: f32 = means.iter().flatten().map(|m| m * m).sum::<f32>() / (7 * SHIFTS) as f32;
        let expected = 7.0 / noise.len() as f32;
        assert!((0.5..2.0).contains(&(square / expected)), "{square} {expected}");
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
        let all = shifts(&trial).expect("shifts");
        assert_eq!(all.len(), SHIFTS);
        assert!(all[0] >= 50 && all[SHIFTS - 1] <= trial.len() - 50, "{all:?}");
        assert!(all.windows(2).all(|pair| pair[1] > pair[0]), "{all:?}");
        assert_eq!(shifts(&trial.part(0..190, String::new())), None);
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
        weigh(&trials, |weighing| {
            let shifts = [0, 77, 250];
            let sums = weighing.shifted(0, &shifts);
            let randomness = for_trial(weighing.randomness, &trials[0]);
            let filtered = filter(&weighing.fit.linear[0], &randomness, Keep::Innovations);
            let centred = centred(&filtered.whitened, 7);
            let means = chance_means(&centred, 7, 0);
            let columns = weighing.forcing[0].columns;
            let mut expected = vec![vec![0.0; columns]; 3];
            let mut pairs = [0; 3];
            whitened_rows(&weighing.fit.linear[0], &randomness, &filtered, &weighing.forcing[0], |at, e| {
                let (k, j) = (at / 7, at % 7);
                for (i, shift) in shifts.iter().enumerate() {
                    let innovation = f64::from(centred[(k + shift) % trials[0].len() * 7 + j] + means[i][j]);
                    if innovation.is_finite() {
                        pairs[i] += 1;
                        expected[i].iter_mut().zip(e).for_each(|(slot, e)| *slot += e * innovation);
                    }
                }
            });
            assert_eq!(sums.pairs, pairs);
            assert_eq!(pairs[0], weighing.level.normal.count);
            assert!(pairs[1] < pairs[0]);
            for (c, i) in (0..columns).flat_map(|c| (0..3).map(move |i| (c, i))) {
                let size = weighing.level.normal.gram[c * columns + c].sqrt();
                let error = f64::from(sums.right[(c, i)]) - expected[i][c];
                assert!(error.abs() < 1e-3 * (1.0 + size), "column {c}, shift {i}: {error}");
            }
        });
    }
}
