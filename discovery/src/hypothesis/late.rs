//! Winch forces that come late: what a lag or a dead time would do to the force at a winch.

use std::ops::Range;

use cdpr::effect::EffectSpec;

use crate::hypothesis::along::Along;
use crate::model::examined::WRENCH;

/// Late forces of winches, followed along a trajectory.
pub(crate) struct LateForces {
    of_winches: Vec<(usize, Lateness)>,
}

impl LateForces {
    pub(crate) fn new(spec: &EffectSpec, along: &Along<'_>) -> Self {
        let cables = spec.cable.map_or(0..along.linear.disturbances - WRENCH, |cable| cable - 1..cable);
        let lateness = |cable: usize| match spec.id.as_str() {
            "winch_lag" => Lateness::Lag(Lag { time_constant: spec.values[0], now: felt(along, 0, cable) }),
            _ => Lateness::Delay(Delay::new(spec.values[0], &along.trial.time, |k| command(along, k, cable))),
        };
        Self { of_winches: cables.map(|cable| (cable, lateness(cable))).collect() }
    }

    /// What lateness adds to the states, `states` numbers a step: the mean of a late force over each interval in place of the
    /// force that is felt there without it.
    ///
    /// The transition of the latent winch force says what a force held over an interval does; how a late force changes within
    /// the interval is not seen.
    pub(crate) fn advance(&mut self, along: &Along<'_>, samples: Range<usize>) -> Vec<f32> {
        let (linear, time) = (along.linear, &along.trial.time);
        let n = linear.states;
        let steps = samples.start..samples.end.min(linear.len - 1);
        let mut out = vec![0.0; steps.len() * n];
        for (cable, lateness) in &mut self.of_winches {
            let cable = *cable;
            for (k, out) in steps.clone().zip(out.chunks_exact_mut(n)) {
                let force = felt(along, k, cable);
                let late = match lateness {
                    Lateness::Lag(lag) => lag.mean(linear.interval[k], force),
                    // The latent force acts after the dead time.
                    Lateness::Delay(delay) => {
                        delay.mean(time, k, |k| command(along, k, cable)) + latent(along, k, cable)
                    }
                };
                let change = late - force;
                for (slot, slope) in out.iter_mut().zip(linear.column(k, n + WRENCH + cable)) {
                    *slot += (slope * change) as f32;
                }
            }
        }
        out
    }
}

/// The force at a winch as the plant feels it, with the latent one.
fn felt(along: &Along<'_>, k: usize, cable: usize) -> f64 {
    along.felt(k).winch_force[cable]
}

fn latent(along: &Along<'_>, k: usize, cable: usize) -> f64 {
    along.latents(k)[WRENCH + cable]
}

fn command(along: &Along<'_>, k: usize, cable: usize) -> f64 {
    felt(along, k, cable) - latent(along, k, cable)
}

/// How a force comes late.
enum Lateness {
    Lag(Lag),
    Delay(Delay),
}

/// A first-order lag, at rest at first.
struct Lag {
    time_constant: f64,
    /// What comes out of it.
    now: f64,
}

impl Lag {
    /// Mean over the next interval of what comes out of it, `force` held.
    fn mean(&mut self, interval: f64, force: f64) -> f64 {
        let Self { time_constant, now } = self;
        let decay = (-interval / *time_constant).exp();
        let mean = force + (*now - force) * *time_constant / interval * (1.0 - decay);
        *now = force + (*now - force) * decay;
        mean
    }
}

/// A dead time; before the first sample the force was what it is there.
struct Delay {
    dead_time: f64,
    /// The sample whose force comes out of it, and the integral of the force from the first sample to that one.
    at: usize,
    before: f64,
    /// The integral to what comes out at the end of the last interval.
    last: f64,
}

impl Delay {
    fn new(dead_time: f64, time: &[f64], force: impl Fn(usize) -> f64) -> Self {
        let mut delay = Self { dead_time, at: 0, before: 0.0, last: 0.0 };
        delay.last = delay.integral(time, time[0], force);
        delay
    }

    /// Integral of the force from the first sample to what comes out at `t`, which never falls.
    fn integral(&mut self, time: &[f64], t: f64, force: impl Fn(usize) -> f64) -> f64 {
        let t = t - self.dead_time;
        if t < time[0] {
            return force(0) * (t - time[0]);
        }
        while self.at + 1 < time.len() && time[self.at + 1] <= t {
            self.before += force(self.at) * (time[self.at + 1] - time[self.at]);
            self.at += 1;
        }
        self.before + force(self.at) * (t - time[self.at])
    }

    /// Mean over interval `k`, the next one, of what comes out of it.
    fn mean(&mut self, time: &[f64], k: usize, force: impl Fn(usize) -> f64) -> f64 {
        let next = self.integral(time, time[k + 1], force);
        let mean = (next - self.last) / (time[k + 1] - time[k]);
        self.last = next;
        mean
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TIME: [f64; 5] = [1.0, 1.1, 1.2, 1.3, 1.4];

    #[test]
    fn a_dead_time_of_half_an_interval_mixes_two_samples() {
        let force = |k: usize| [4.0, 8.0, 2.0, 0.0, 0.0][k];
        let mut delay = Delay::new(0.05, &TIME, force);
        let means: Vec<f64> = (0..4).map(|k| delay.mean(&TIME, k, force)).collect();
        for (mean, expected) in means.iter().zip([4.0, 6.0, 5.0, 1.0]) {
            assert!((mean - expected).abs() < 1e-9, "{means:?}");
        }
    }

    /// The mean of a lag is the input minus `τ` times the growth of the output over the interval.
    #[test]
    fn a_lag_carries_its_input_over() {
        let (force, tau) = ([10.0, 30.0, 30.0, -5.0, 0.0], 0.2_f64);
        let mut lag = Lag { time_constant: tau, now: force[0] };
        let means: Vec<f64> = force[..4].iter().map(|force| lag.mean(0.1, *force)).collect();
        let mut output = 10.0;
        for (mean, input) in means.iter().zip(force) {
            let next = input + (output - input) * (-0.1 / tau).exp();
            assert!((mean - (input - tau * (next - output) / 0.1)).abs() < 1e-9, "{means:?}");
            output = next;
        }
    }
}
