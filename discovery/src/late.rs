//! Winch forces that come late: what a lag or a dead time would do to the force at a winch.

use cdpr::effect::EffectSpec;

use crate::data::Trial;
use crate::model::WRENCH;
use crate::path::{LinearTrial, Trajectory};

/// Whether a variation only makes winch forces late.
pub(crate) fn comes_late(id: &str) -> bool {
    matches!(id, "winch_lag" | "winch_delay")
}

/// What lateness of a winch force adds to the states, `states` numbers a step: its mean over each interval in place of the
/// force that is felt there without it. `felt` is that force, with the latent one.
///
/// The transition of the latent winch force says what a force held over an interval does; how a late force changes within
/// the interval is not seen.
pub(crate) fn late_forcing(
    spec: &EffectSpec,
    linear: &LinearTrial,
    trial: &Trial,
    trajectory: &Trajectory,
    felt: impl Fn(usize, usize) -> f64,
) -> Vec<f32> {
    let n = linear.states;
    let mut out = vec![0.0; (trial.len() - 1) * n];
    let cables = spec.cable.map_or(0..linear.disturbances - WRENCH, |cable| cable - 1..cable);
    for cable in cables {
        let force: Vec<f64> = (0..trial.len()).map(|k| felt(k, cable)).collect();
        let late = match spec.id.as_str() {
            "winch_lag" => lagged(&force, &linear.interval, spec.values[0]),
            _ => {
                // The latent force acts after the dead time.
                let latent = |k: usize| trajectory.latents(k)[WRENCH + cable];
                let command: Vec<f64> = force.iter().enumerate().map(|(k, f)| f - latent(k)).collect();
                let mut late = delayed(&command, &trial.time, spec.values[0]);
                late.iter_mut().enumerate().for_each(|(k, f)| *f += latent(k));
                late
            }
        };
        for (k, late) in late.iter().enumerate() {
            let change = late - force[k];
            let slopes = linear.column(k, n + WRENCH + cable);
            for r in 0..n {
                let slope = slopes[r];
                out[k * n + r] += (slope * change) as f32;
            }
        }
    }
    out
}

/// Mean over each interval of a force behind a first-order lag, at rest at first.
fn lagged(force: &[f64], interval: &[f64], time_constant: f64) -> Vec<f64> {
    let mut now = force[0];
    let mean = |(h, f): (&f64, &f64)| {
        let decay = (-h / time_constant).exp();
        let mean = f + (now - f) * time_constant / h * (1.0 - decay);
        now = f + (now - f) * decay;
        mean
    };
    interval.iter().zip(force).map(mean).collect()
}

/// Mean over each interval of a force after a dead time; before the first sample it was what it is there.
fn delayed(force: &[f64], time: &[f64], dead_time: f64) -> Vec<f64> {
    let mut at = 0;
    let mut before = 0.0;
    // Integral of the force from the first sample to `t`; `t` never falls.
    let mut integral = |t: f64| {
        if t < time[0] {
            return force[0] * (t - time[0]);
        }
        while at + 1 < time.len() && time[at + 1] <= t {
            before += force[at] * (time[at + 1] - time[at]);
            at += 1;
        }
        before + force[at] * (t - time[at])
    };
    let mut last = integral(time[0] - dead_time);
    let means = time.windows(2).map(|pair| {
        let next = integral(pair[1] - dead_time);
        let mean = (next - last) / (pair[1] - pair[0]);
        last = next;
        mean
    });
    means.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const TIME: [f64; 5] = [1.0, 1.1, 1.2, 1.3, 1.4];

    #[test]
    fn a_dead_time_of_half_an_interval_mixes_two_samples() {
        let means = delayed(&[4.0, 8.0, 2.0, 0.0, 0.0], &TIME, 0.05);
        for (mean, expected) in means.iter().zip([4.0, 6.0, 5.0, 1.0]) {
            assert!((mean - expected).abs() < 1e-9, "{means:?}");
        }
    }

    /// The mean of a lag is the input minus `τ` times the growth of the output over the interval.
    #[test]
    fn a_lag_carries_its_input_over() {
        let (force, tau) = ([10.0, 30.0, 30.0, -5.0, 0.0], 0.2_f64);
        let means = lagged(&force, &[0.1; 4], tau);
        let mut output = 10.0;
        for (mean, input) in means.iter().zip(force) {
            let next = input + (output - input) * (-0.1 / tau).exp();
            assert!((mean - (input - tau * (next - output) / 0.1)).abs() < 1e-9, "{means:?}");
            output = next;
        }
    }
}
