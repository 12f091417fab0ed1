//! Instruments that count in steps.

use super::{Channel, Trial};

/// The smallest step between different readings, where all are multiples of it and it is no smaller than a share of the
/// noise that matters.
pub(crate) fn resolution(trials: &[Trial], channel: Channel, noise: f64) -> Option<f64> {
    let mut readings: Vec<f64> = Vec::new();
    for trial in trials {
        let Some(j) = trial.channels.iter().position(|c| *c == channel) else { continue };
        readings.extend(trial.measured.iter().map(|row| row[j]).filter(|v| v.is_finite()));
    }
    readings.sort_by(f64::total_cmp);
    let count =
        readings.windows(2).map(|w| w[1] - w[0]).filter(|step| *step > 1e-3 * noise).fold(f64::INFINITY, f64::min);
    let whole = |v: &f64| {
        let multiple = (v - readings[0]) / count;
        (multiple - multiple.round()).abs() < 1e-3
    };
    // Noise of a tenth of a count hides it, one of many counts makes it superfluous.
    (count.is_finite() && count > 0.3 * noise && readings.iter().all(whole)).then_some(count)
}

/// The standard deviation below which the white noise of a channel cannot be: what rounding to its counts leaves, evenly spread
/// over a count (B. Widrow and I. Kollár, Quantization Noise, 2008), and whatever the channel, its floor.
pub(crate) fn least_noise(trials: &[Trial], channel: Channel, noise: f64) -> f64 {
    let rounding = resolution(trials, channel, noise).map_or(0.0, |count| count / 12.0_f64.sqrt());
    rounding.max(channel.noise_floor())
}

#[cfg(test)]
mod tests {
    use super::super::recording::record;
    use super::*;

    #[test]
    fn counts_are_seen_and_digits_of_a_file_are_not() {
        let mut trial = record(&[], 20.0, 9);
        assert_eq!(resolution(std::slice::from_ref(&trial), Channel::Pose(0), 2e-3), None);
        trial.measured.iter_mut().for_each(|row| row[0] = 5e-3 * (row[0] / 5e-3).round());
        let count = resolution(std::slice::from_ref(&trial), Channel::Pose(0), 2e-3).expect("counts");
        assert!((count - 5e-3).abs() < 1e-9, "{count}");
        let least = least_noise(&[trial], Channel::Pose(0), 2e-3);
        assert!((least - 5e-3 / 12.0_f64.sqrt()).abs() < 1e-9, "{least}");
    }
}
