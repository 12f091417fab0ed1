//! Checks on the final model: gaps, whiteness, where and when.

use cdpr::per_cable::PerCable;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::data::{Channel, Trial};
use crate::filter::estimate::Fit;
use crate::filter::kalman::{Keep, Randomness};
use crate::outcome::{BeforeAfter, Compared, HorizonGap, Latents, Whiteness};
use crate::strategy::fitted::{Evidence, Fitted};
use crate::verdict::gap::{GapSum, gap, predict};
use crate::verdict::{POLICY, attainable};

/// Lags of the whiteness test.
const LAGS: usize = 20;
/// Autocorrelation (root mean square over the lags) that is of no practical weight.
const TOLERATED_CORRELATION: f64 = 0.02;

/// Length of the blocks by which "when" is told (s).
const BLOCK: f64 = 2.0;

/// Gaps of both models over these horizons (s), on training and held-out data, in units of the noise with what was found;
/// where the `instruments` have more, of how far the right model would be from the measurements.
pub(crate) fn horizon_gaps(
    base: &Fitted,
    fitted: &Fitted,
    evidence: &Evidence,
    horizons: &[f64],
    instruments: Option<&Randomness>,
) -> Vec<HorizonGap> {
    let noise = &fitted.train.randomness.noise;
    let sets = [(&base.train, &fitted.train, &evidence.train), (&base.holdout, &fitted.holdout, &evidence.holdout)];
    let cables = base.train.examined.plant.cables();
    let of_horizon = |horizon: &f64| {
        let sums = |fit: &Fit, trials: &[Trial]| {
            let predictions = predict(fit, trials, *horizon);
            match instruments {
                Some(randomness) => gap(trials, &predictions, &fit.spread(trials, randomness, *horizon)),
                None => gap(trials, &predictions, noise),
            }
        };
        let [train, holdout] = sets.map(|(before, after, trials)| [sums(before, trials), sums(after, trials)]);
        let pair = |[before, after]: &[GapSum; 2]| BeforeAfter { before: before.total(), after: after.total() };
        let channel = |at: usize, channel: Channel| {
            let of = |[before, after]: &[GapSum; 2]| {
                Some(BeforeAfter { before: before.channel(at)?, after: after.channel(at)? })
            };
            of(&train).map(|train| (channel, train, of(&holdout)))
        };
        let channels = Channel::all(cables).into_iter().enumerate().filter_map(|(at, c)| channel(at, c)).collect();
        let attainable = match instruments {
            Some(_) => 1.0,
            None => attainable(&fitted.holdout, &evidence.holdout, noise, *horizon),
        };
        let judged = attainable <= POLICY.farthest;
        let scatter = holdout[1].scatter(&holdout[0]);
        let (train, holdout) = (pair(&train), pair(&holdout));
        HorizonGap { horizon: *horizon, train, holdout, attainable, scatter, judged, channels }
    };
    horizons.iter().map(of_horizon).collect()
}

/// Ljung-Box test of each channel's innovations, for what they have more than the noise is taken to have: where they have
/// less at a frequency, nothing is left there.
///
/// The limit is the 99.9 % point of chi-square, plus what a root mean square autocorrelation of two per cent gives: with
/// ten thousand samples a deviation of no practical weight would otherwise count.
pub(crate) fn whiteness(fit: &Fit, trials: &[Trial], noise: &[f64]) -> Vec<Whiteness> {
    let filtered = fit.filter(trials, &fit.randomness, Keep::Innovations);
    let chi = ChiSquared::new(LAGS as f64).map_or(45.3, |d| d.inverse_cdf(0.999));
    let mut out = Vec::new();
    for (at, channel) in Channel::all(fit.examined.plant.cables()).into_iter().enumerate() {
        let (mut count, mut power) = (0, 0.0);
        let mut lagged = [0.0; LAGS];
        for (trial, f) in trials.iter().zip(&filtered) {
            let Some(j) = trial.channels.iter().position(|c| *c == channel) else { continue };
            let m = trial.channels.len();
            // The first tenth is the filter's own transient.
            let innovations = (trial.len() / 10..trial.len()).map(|k| f.whitened[k * m + j]);
            // A slow channel has its readings some rows apart.
            let e: Vec<f64> = innovations.filter(|innovation| innovation.is_finite()).collect();
            for (k, v) in e.iter().enumerate() {
                count += 1;
                power += v * v;
                for (lag, sum) in lagged.iter_mut().enumerate().take(k) {
                    *sum += v * e[k - lag - 1];
                }
            }
        }
        if count > 10 * LAGS {
            let n = count as f64;
            let correlation = of_excess(power / n, &lagged.map(|sum| sum / n));
            let q = n
                * (n + 2.0)
                * correlation.iter().enumerate().map(|(l, r)| r.powi(2) / (n - l as f64 - 1.0)).sum::<f64>();
            let limit = chi + LAGS as f64 * n * TOLERATED_CORRELATION.powi(2);
            out.push(Whiteness { channel, noise: noise[at], samples: count, statistic: q, limit });
        }
    }
    out
}

/// Autocorrelation at the lags from one on of innovations with this variance and these autocovariances, in units of the
/// variance that they should have, where each frequency at which they have less than white noise of that variance is filled
/// up to it.
fn of_excess(variance: f64, lagged: &[f64; LAGS]) -> [f64; LAGS] {
    const FREQUENCIES: usize = 4 * LAGS;
    let angle = |f: usize, lag: usize| std::f64::consts::PI * (f as f64 + 0.5) * (lag + 1) as f64 / FREQUENCIES as f64;
    let density = |f: usize| {
        let sum: f64 = lagged.iter().enumerate().map(|(lag, c)| 2.0 * c * angle(f, lag).cos()).sum();
        (variance + sum).max(1.0)
    };
    let filled: Vec<f64> = (0..FREQUENCIES).map(density).collect();
    let total: f64 = filled.iter().sum();
    std::array::from_fn(|lag| filled.iter().enumerate().map(|(f, d)| d * angle(f, lag).cos()).sum::<f64>() / total)
}

/// Stretches of time in which `full` explains the measurements better than `reduced`, as `(trial, start, end)`.
///
/// A block counts when it gains more than a tenth of what the median gaining block does, and at least ten units of log
/// likelihood; neighbours are joined.
pub(crate) fn when(full: &Fit, reduced: &Fit, trials: &[Trial]) -> Vec<(usize, f64, f64)> {
    let [a, b] = [full, reduced].map(|fit| fit.filter(trials, &fit.randomness, Keep::Innovations));
    let mut gains = Vec::new();
    for (t, trial) in trials.iter().enumerate() {
        let m = trial.channels.len();
        let start = trial.time[0];
        for k in 0..trial.len() {
            let block = ((trial.time[k] - start) / BLOCK) as usize;
            for at in k * m..(k + 1) * m {
                if a[t].whitened[at].is_finite() {
                    let term = |w: f64, d: f64| w * w + 2.0 * d.ln();
                    let gain =
                        term(b[t].whitened[at], b[t].deviation[at]) - term(a[t].whitened[at], a[t].deviation[at]);
                    match gains.last_mut() {
                        Some((trial_, block_, sum)) if *trial_ == t && *block_ == block => *sum += gain,
                        _ => gains.push((t, block, gain)),
                    }
                }
            }
        }
    }
    let median = crate::data::clean::median(gains.iter().map(|g| g.2).filter(|g| *g > 0.0).collect());
    let limit = (0.1 * median).max(10.0);
    let mut out: Vec<(usize, f64, f64)> = Vec::new();
    for (t, block, gain) in gains {
        if gain > limit {
            let start = trials[t].time[0] + block as f64 * BLOCK;
            let end = (start + BLOCK).min(trials[t].time[trials[t].len() - 1]);
            match out.last_mut() {
                Some(last) if last.0 == t && (last.2 - start).abs() < 0.5 * BLOCK => last.2 = end,
                _ => out.push((t, start, end)),
            }
        }
    }
    out
}

/// Numbers in the order of [`Channel::all`], in that of a trial's channels.
fn of_channels(numbers: &[f64], trial: &Trial) -> Vec<f64> {
    let all = Channel::all(trial.cables());
    let of = |channel: &Channel| all.iter().position(|c| c == channel).map_or(f64::NAN, |at| numbers[at]);
    trial.channels.iter().map(of).collect()
}

/// Trials with predictions of both models over `horizon` (s), and how far the right model would be from them where the
/// `instruments` have more than white noise.
pub(crate) fn compared(
    base: &Fitted,
    fitted: &Fitted,
    evidence: &Evidence,
    horizon: f64,
    instruments: Option<&Randomness>,
) -> Vec<Compared> {
    let mut out = Vec::new();
    let sets = [(&evidence.train, &base.train, &fitted.train), (&evidence.holdout, &base.holdout, &fitted.holdout)];
    for (held, (trials, before, after)) in sets.into_iter().enumerate() {
        let (before_shown, after_shown) = (predict(before, trials, horizon), predict(after, trials, horizon));
        let spread = instruments.map(|randomness| after.spread(trials, randomness, horizon));
        let expected = spread.unwrap_or_else(|| fitted.train.randomness.noise.clone());
        for (t, (b, a)) in before_shown.into_iter().zip(after_shown).enumerate() {
            let trial = &trials[t];
            let rows = 0..trial.len();
            let (old, new) = (&before.trajectories[t], &after.trajectories[t]);
            let plant = &after.examined.plant;
            out.push(Compared {
                holdout: held == 1,
                before: b.shown,
                after: a.shown,
                restarts: a.restarts,
                expected: of_channels(&expected, trial),
                latents: rows.clone().map(|k| Latents::of(old.latents(k))).collect(),
                motion: rows.clone().map(|k| std::array::from_fn(|c| new.states(k)[c])).collect(),
                winch_speed: rows
                    .map(|k| {
                        let y = new.states(k);
                        let [pose, twist] = [[y[0], y[1], y[2]], [y[3], y[4], y[5]]];
                        let cables = cdpr::kinematics::cables(plant.geometry(), &pose, &twist);
                        PerCable::from_fn(cables.len(), |i| plant.rate_index(i).map_or(cables[i].speed, |at| y[at]))
                    })
                    .collect(),
                trial: trial.clone(),
            });
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is left of a force's error has no high frequencies, which the filter takes it to have in part.
    #[test]
    fn less_than_the_noise_at_some_frequencies_is_nothing_left() {
        let mut lagged = [0.0; LAGS];
        assert!(of_excess(1.0, &lagged).iter().all(|r| r.abs() < 1e-12));
        // Half the variance that is expected at high frequencies, all of it at low ones.
        lagged[0] = 0.125;
        assert!(of_excess(0.75, &lagged).iter().all(|r| r.abs() < 1e-12));
        // As much more than is expected.
        let more = of_excess(1.25, &lagged)[0];
        assert!((more - 0.1).abs() < 1e-3, "{more}");
    }
}
