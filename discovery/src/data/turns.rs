//! How often a machine turns back.

use crate::data::{Channel, Trial};

/// Share of the deviation of a channel by which it must go back for a turn.
const BACK: f64 = 0.3;
/// The same in multiples of its noise: more than it spans in a recording.
const ABOVE_NOISE: f64 = 10.0;

/// Mean time (s) between turns of the measured position that turns least often, given the noise by channel of [`Channel::all`]:
/// infinite where one does not turn at all, or none is measured.
pub(crate) fn turning_time(trials: &[Trial], noise: &[f64]) -> f64 {
    let all = Channel::all(trials.first().map_or(0, Trial::cables));
    let positions = all.iter().zip(noise).filter(|(channel, _)| {
        matches!(channel, Channel::Pose(_) | Channel::UnstretchedLength(_) | Channel::CableLength(_))
    });
    let of_channel = |(channel, noise): (&Channel, &f64)| {
        let (mut time, mut count) = (0.0, 0);
        for trial in trials {
            let Some(j) = trial.channels.iter().position(|c| c == channel) else { continue };
            let values: Vec<f64> = trial.measured.iter().map(|row| row[j]).filter(|v| v.is_finite()).collect();
            time += trial.time[trial.len() - 1] - trial.time[0];
            count += turns(&values, *noise);
        }
        (time > 0.0).then(|| time / count as f64)
    };
    positions.filter_map(of_channel).max_by(f64::total_cmp).unwrap_or(f64::INFINITY)
}

/// How often a signal goes back after it went on.
fn turns(values: &[f64], noise: f64) -> usize {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let deviation = (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / count).sqrt();
    let far = (BACK * deviation).max(ABOVE_NOISE * noise);
    let Some(first) = values.first() else { return 0 };
    // The furthest so far in the direction in which it goes; at first in both.
    let (mut most, mut least, mut up, mut turns) = (*first, *first, None, 0);
    for value in values {
        (most, least) = (value.max(most), value.min(least));
        if up != Some(false) && *value < most - far {
            turns += usize::from(up.is_some());
            (up, least) = (Some(false), *value);
        } else if up != Some(true) && *value > least + far {
            turns += usize::from(up.is_some());
            (up, most) = (Some(true), *value);
        }
    }
    turns
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::data::recording::noise;

    #[test]
    fn a_sine_turns_twice_a_period_whatever_its_noise() {
        let sine = |noise: &[f64]| -> Vec<f64> {
            noise.iter().enumerate().map(|(k, noise)| (TAU * (k as f64 + 7.0) / 100.0).sin() + noise).collect()
        };
        let noisy = |size: f64| -> Vec<f64> { noise(1000, 5).map(|white| size * white).collect() };
        for size in [0.0, 0.01, 0.05] {
            assert_eq!(turns(&sine(&noisy(size)), size), 20, "{size}");
        }
        assert_eq!(turns(&noisy(0.1), 0.1), 0);
    }

    /// The position that turns least often counts, over all trials, and forces do not.
    #[test]
    fn the_slowest_position_says_how_often_a_machine_turns() {
        let trial = |periods: [f64; 2], duration: f64| {
            let time: Vec<f64> = (0..=1000).map(|k| f64::from(k) * duration / 1000.0).collect();
            let row = |t: &f64| periods.map(|period| (TAU * t / period).sin()).to_vec();
            let measured = time.iter().map(row).collect();
            let inputs = vec![cdpr::dynamics::Inputs::none(4); time.len()];
            let channels = vec![Channel::Pose(0), Channel::UnstretchedLength(2)];
            Trial { name: String::new(), time, inputs, channels, measured, taken_off: vec![], undone: Vec::new() }
        };
        let noise = vec![0.0; Channel::all(4).len()];
        let both = [trial([2.0, 8.0], 20.0), trial([2.0, 4.0], 20.0)];
        // Five turns and ten.
        assert!((turning_time(&both, &noise) - 40.0 / 15.0).abs() < 1e-9);
        assert!(turning_time(&[trial([2.0, 1e9], 20.0)], &noise).is_infinite());
        let nowhere = Trial { channels: vec![Channel::Tension(0), Channel::Tension(1)], ..trial([2.0, 8.0], 20.0) };
        assert!(turning_time(&[nowhere], &noise).is_infinite());
    }
}
