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

/// Where an effect acts, as places of `discovery.json`, and what it depends on.
pub(crate) fn places(effect: &cdpr::effect::EffectSpec) -> (Vec<String>, Vec<&'static str>) {
    let indexed = |kind: &str| match effect.cable {
        Some(cable) => vec![format!("{kind}[{cable}]")],
        None => (1..=4).map(|i| format!("{kind}[{i}]")).collect(),
    };
    let platform = |axes: &[&str]| axes.iter().map(|a| format!("platform.{a}")).collect::<Vec<_>>();
    let value = |k: usize| effect.values.get(k).copied().unwrap_or(0.0);
    match effect.id.as_str() {
        "cable_elasticity" | "cable_stiffness" | "cable_stiffening" | "cable_sag" => {
            (indexed("cable"), vec!["tension"])
        }
        "cable_damping" => (indexed("cable"), vec!["speed"]),
        "cable_creep" => (indexed("cable"), vec!["tension", "time"]),
        "cable_thermal_expansion" => (indexed("cable"), vec!["time"]),
        "cable_drag" => (indexed("cable"), vec!["speed"]),
        "cable_transverse_mode" => (indexed("cable"), vec!["acceleration", "tension"]),
        "cable_axial_mass" => (indexed("cable"), vec!["acceleration"]),
        "winch_coulomb_friction" => (indexed("winch"), vec!["direction"]),
        "winch_stribeck_friction" => (indexed("winch"), vec!["direction", "speed"]),
        "winch_viscous_friction" => (indexed("winch"), vec!["speed"]),
        "pulley_capstan_loss" => (indexed("winch"), vec!["direction", "tension"]),
        "winch_force_gain" | "winch_saturation" => (indexed("winch"), vec!["tension"]),
        "winch_force_bias" => (indexed("winch"), vec![]),
        "winch_lag" | "winch_delay" => (indexed("winch"), vec!["input", "time"]),
        "winch_drum_inertia" => (indexed("winch"), vec!["acceleration"]),
        "platform_mass" => (platform(&["force_x", "force_y"]), vec!["acceleration"]),
        "platform_inertia" => (platform(&["torque"]), vec!["acceleration"]),
        "platform_com_offset" => (platform(&["force_x", "force_y", "torque"]), vec!["acceleration"]),
        "platform_linear_drag" | "platform_quadratic_drag" => (platform(&["force_x", "force_y"]), vec!["speed"]),
        "platform_rotational_damping" => (platform(&["torque"]), vec!["speed"]),
        "steady_wind" => {
            let sizes = [value(0).abs(), value(1).abs(), value(2).abs() / 10.0];
            let largest = sizes.iter().copied().fold(0.0, f64::max);
            let axes: Vec<&str> = ["force_x", "force_y", "torque"]
                .into_iter()
                .zip(sizes)
                .filter(|(_, s)| *s > 0.1 * largest)
                .map(|(a, _)| a)
                .collect();
            (platform(&axes), vec![])
        }
        "periodic_gust" => {
            let mut axes = Vec::new();
            if value(3).cos().abs() > 0.1 {
                axes.push("force_x");
            }
            if value(3).sin().abs() > 0.1 {
                axes.push("force_y");
            }
            (platform(&axes), vec!["time"])
        }
        "umbilical" => (platform(&["force_x", "force_y"]), vec!["position", "speed"]),
        "anchor_offset" => (indexed("cable"), vec!["position"]),
        "attachment_offset" => (indexed("cable"), vec!["position"]),
        "length_sensor_bias" => {
            let channel = effect.channel.as_deref().unwrap_or("unstretched_length");
            (indexed(&format!("sensor.{channel}")), vec![])
        }
        "length_sensor_scale" => (indexed("sensor.unstretched_length"), vec!["position"]),
        "pose_sensor_bias" => (vec!["sensor.pose".to_owned()], vec![]),
        "pose_sensor_delay" => (vec!["sensor.pose".to_owned()], vec!["speed"]),
        "expression" => {
            let text = effect.expression.as_deref().unwrap_or("");
            let mut on = Vec::new();
            let has = |names: &[&str]| names.iter().any(|n| contains_name(text, n));
            if has(&["x", "y", "phi"]) {
                on.push("position");
            }
            if has(&["vx", "vy", "omega"]) || text.contains("unstretched_length_rate") {
                on.push("speed");
            }
            if has(&["time"]) {
                on.push("time");
            }
            if text.contains("winch_force") {
                on.push("tension");
            }
            (effect.target.iter().cloned().collect(), on)
        }
        _ => (Vec::new(), Vec::new()),
    }
}

/// Whether `name` stands in a formula as a whole word.
fn contains_name(text: &str, name: &str) -> bool {
    text.split(|c: char| !(c.is_ascii_alphanumeric() || c == '_')).any(|word| word == name)
}
