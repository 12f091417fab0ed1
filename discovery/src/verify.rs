//! Checks on the final model: gaps, whiteness, where and when.

use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::data::{Channel, Trial};
use crate::estimate::Fit;
use crate::gap::{GapSum, gap, predict};
use crate::kalman::Keep;
use crate::outcome::{BeforeAfter, HORIZONS, HorizonGap, Whiteness};

/// Lags of the whiteness test.
const LAGS: usize = 20;
/// Autocorrelation (root mean square over the lags) that is of no practical weight.
const TOLERATED_CORRELATION: f64 = 0.02;

/// Length of the blocks by which "when" is told (s).
const BLOCK: f64 = 2.0;

/// Gaps of one fit over all horizons.
pub(crate) fn gaps(fit: &Fit, trials: &[Trial], noise: &[f64]) -> Vec<GapSum> {
    HORIZONS.iter().map(|h| gap(trials, &predict(fit, trials, *h), noise)).collect()
}

/// Puts gaps of both models on both sets of trials together.
pub(crate) fn horizon_gaps(before: [&[GapSum]; 2], after: [&[GapSum]; 2]) -> Vec<HorizonGap> {
    HORIZONS
        .iter()
        .enumerate()
        .map(|(h, horizon)| {
            let pair = |set: usize| BeforeAfter { before: before[set][h].total(), after: after[set][h].total() };
            let channels = Channel::all()
                .into_iter()
                .enumerate()
                .filter_map(|(at, channel)| {
                    let of = |set: usize| {
                        Some(BeforeAfter { before: before[set][h].channel(at)?, after: after[set][h].channel(at)? })
                    };
                    of(0).map(|train| (channel, train, of(1)))
                })
                .collect();
            HorizonGap { horizon: *horizon, train: pair(0), holdout: pair(1), channels }
        })
        .collect()
}

/// Ljung-Box test of each channel's innovations.
///
/// The limit is the 99.9 % point of chi-square, plus what a root mean square autocorrelation of two per cent gives: with
/// ten thousand samples a deviation of no practical weight would otherwise count.
pub(crate) fn whiteness(fit: &Fit, trials: &[Trial], noise: &[f64]) -> Vec<Whiteness> {
    let filtered = fit.filter(trials, &fit.randomness, Keep::Innovations);
    let chi = ChiSquared::new(LAGS as f64).map_or(45.3, |d| d.inverse_cdf(0.999));
    let mut out = Vec::new();
    for (at, channel) in Channel::all().into_iter().enumerate() {
        let (mut count, mut power) = (0, 0.0);
        let mut lagged = [0.0; LAGS];
        for (trial, f) in trials.iter().zip(&filtered) {
            let Some(j) = trial.channels.iter().position(|c| *c == channel) else { continue };
            let m = trial.channels.len();
            // The first tenth is the filter's own transient.
            let e: Vec<f64> = (trial.len() / 10..trial.len()).map(|k| f.whitened[k * m + j]).collect();
            for (k, v) in e.iter().enumerate() {
                if v.is_finite() {
                    count += 1;
                    power += v * v;
                    for (lag, sum) in lagged.iter_mut().enumerate() {
                        if k > lag && e[k - lag - 1].is_finite() {
                            *sum += v * e[k - lag - 1];
                        }
                    }
                }
            }
        }
        if count > 10 * LAGS {
            let n = count as f64;
            let q = n
                * (n + 2.0)
                * lagged.iter().enumerate().map(|(l, s)| (s / power).powi(2) / (n - l as f64 - 1.0)).sum::<f64>();
            let limit = chi + LAGS as f64 * n * TOLERATED_CORRELATION.powi(2);
            out.push(Whiteness { channel, noise: noise[at], samples: count, statistic: q, limit });
        }
    }
    out
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
