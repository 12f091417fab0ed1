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
    readings.dedup_by(|next, last| *next - *last <= 1e-3 * noise);
    let first = readings.windows(2).map(|w| w[1] - w[0]).fold(f64::INFINITY, f64::min);
    // A reading's last digit is much of one count, and little of many.
    let count = readings.iter().fold(first, |count, reading| {
        let multiple = ((reading - readings[0]) / count).round();
        if multiple >= 1.0 { (reading - readings[0]) / multiple } else { count }
    });
    let whole = |v: &f64| {
        let multiple = (v - readings[0]) / count;
        (multiple - multiple.round()).abs() < 1e-3
    };
    // Noise of a tenth of a count hides it, one of many counts makes it superfluous.
    (count.is_finite() && count > 0.3 * noise && readings.iter().all(whole)).then_some(count)
}

/// The smallest step between different readings of column `j`; infinite where there is one reading alone.
pub(super) fn smallest_step(trial: &Trial, j: usize) -> f64 {
    let mut readings: Vec<f64> = trial.measured.iter().map(|row| row[j]).filter(|value| value.is_finite()).collect();
    readings.sort_by(f64::total_cmp);
    let steps = readings.windows(2).map(|pair| pair[1] - pair[0]);
    steps.filter(|step| *step > 0.0).fold(f64::INFINITY, f64::min)
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

    /// Lengths of 900 m in counts of 7.6 mm, with the six digits of a file.
    #[test]
    fn counts_are_seen_over_many_of_them() {
        let mut trial = record(&[], 20.0, 9);
        for (k, row) in trial.measured.iter_mut().enumerate() {
            let counted = 7.6234e-3 * ((880.0 + 0.01 * k as f64) / 7.6234e-3).round();
            row[3] = (counted * 1e6).round() * 1e-6;
        }
        let trials = [trial];
        let channel = trials[0].channels[3];
        let found = resolution(&trials, channel, 3e-3).expect("a count");
        assert!((found / 7.6234e-3 - 1.0).abs() < 1e-6, "{found}");
    }

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
