//! Noise of each channel, and outliers, from the data alone.

use crate::data::Trial;

/// Samples further than this many standard deviations from their neighbours are outliers.
const OUTLIER: f64 = 6.0;

/// Median of the finite values; `NAN` where there are none.
pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    values.retain(|v| v.is_finite());
    if values.is_empty() {
        return f64::NAN;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Noise of column `j` by the fourth differences of its numbers: a smooth signal leaves almost nothing there.
///
/// The differences are divided ones, scaled so that white noise of size one leaves one: the numbers need not be in every row,
/// nor at equal distances. Robust (median absolute deviation), so gaps and outliers do not count.
pub(crate) fn noise_by_differences(trial: &Trial, j: usize) -> f64 {
    let known = (0..trial.len()).filter(|k| trial.measured[*k][j].is_finite());
    let (times, values): (Vec<f64>, Vec<f64>) = known.map(|k| (trial.time[k], trial.measured[k][j])).unzip();
    white_noise(&times, &values)
}

/// The same of a signal by its samples.
pub(crate) fn white_noise(times: &[f64], values: &[f64]) -> f64 {
    let rows: Vec<usize> = (0..times.len()).collect();
    let differences = rows.windows(5).map(|rows| {
        let (mut difference, mut square) = (0.0, 0.0);
        for a in rows {
            let others = rows.iter().filter(|b| *b != a);
            // In shares of the whole, so that nothing overflows.
            let apart = |b: &usize| (times[*a] - times[*b]) / (times[rows[4]] - times[rows[0]]);
            let weight = 1.0 / others.map(apart).product::<f64>();
            difference += weight * values[*a];
            square += weight * weight;
        }
        difference.abs() / square.sqrt()
    });
    median(differences.collect()) / 0.674_489_750_2
}

/// Turns outliers into gaps; returns how many.
///
/// A sample is an outlier when it is far from the straight line through the medians of its neighbours on both sides,
/// against the noise and against what its neighbours themselves do, here and in the whole recording: where a machine
/// accelerates, all are off the line.
pub(crate) fn remove_outliers(trial: &mut Trial) -> usize {
    let mut removed = 0;
    let n = trial.len();
    for j in 0..trial.channels.len() {
        // A slow channel has its neighbours some rows away.
        let reach = 3 * trial.stride(j);
        let noise = noise_by_differences(trial, j).max(trial.channels[j].noise_floor());
        let column: Vec<f64> = trial.measured.iter().map(|row| row[j]).collect();
        // Distance from the mean of the medians of three numbers before and after: straight motion cancels.
        let distance: Vec<f64> = (0..n)
            .map(|k| {
                if k < reach || k + reach >= n {
                    return f64::NAN;
                }
                let before = median(column[k - reach..k].to_vec());
                let after = median(column[k + 1..=k + reach].to_vec());
                column[k] - 0.5 * (before + after)
            })
            .collect();
        let usual = 1.4826 * median(distance.iter().map(|d| d.abs()).collect());
        let limit = OUTLIER * usual.max(1.2 * noise);
        let around = |k: usize| {
            let neighbours = (k.saturating_sub(reach)..(k + reach + 1).min(n)).filter(|i| *i != k);
            1.4826 * median(neighbours.map(|i| distance[i].abs()).collect())
        };
        for (k, row) in trial.measured.iter_mut().enumerate() {
            if distance[k].abs() > limit && distance[k].abs() > OUTLIER * around(k) {
                row[j] = f64::NAN;
                removed += 1;
            }
        }
    }
    removed
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::Channel;
    use cdpr::dynamics::Inputs;

    /// A slow sine with noise of a small linear congruential generator, one outlier and one gap.
    fn trial(noise: f64) -> Trial {
        let mut seed = 12345_u64;
        let mut uniform = || {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64
        };
        let n = 2000;
        let measured: Vec<Vec<f64>> = (0..n)
            .map(|k| {
                let gauss: f64 = (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
                vec![(0.01 * k as f64).sin() + noise * gauss]
            })
            .collect();
        let mut trial = Trial {
            name: "test".into(),
            time: (0..n).map(|k| 0.02 * k as f64).collect(),
            inputs: vec![Inputs::none(4); n],
            channels: vec![Channel::Pose(0)],
            measured,
            taken_off: Vec::new(),
            undone: Vec::new(),
        };
        trial.measured[500][0] += 0.2;
        trial.measured[700][0] = f64::NAN;
        trial
    }

    #[test]
    fn noise_is_found_under_motion_and_outliers() {
        let noise = noise_by_differences(&trial(0.005), 0);
        assert!((noise / 0.005 - 1.0).abs() < 0.06, "{noise}");
    }

    /// A channel with a number in every second, third or fourth row only, as of a slower instrument in the same table.
    #[test]
    fn a_slow_channel_has_its_noise_and_its_outliers() {
        for every in 2..=4 {
            let mut data = trial(0.005);
            for k in (0..data.len()).filter(|k| k % every != 0) {
                data.measured[k][0] = f64::NAN;
            }
            let outlier = 500 / every * every;
            data.measured[outlier][0] += if outlier == 500 { 0.0 } else { 0.2 };
            let noise = noise_by_differences(&data, 0);
            // 500 numbers say it to some 8 %.
            assert!((noise / 0.005 - 1.0).abs() < 0.25, "every {every}: {noise}");
            assert_eq!(remove_outliers(&mut data), 1, "every {every}");
            assert!(data.measured[outlier][0].is_nan(), "every {every}");
        }
    }

    #[test]
    fn only_the_outlier_is_removed() {
        let mut data = trial(0.005);
        assert_eq!(remove_outliers(&mut data), 1);
        assert!(data.measured[500][0].is_nan());
    }

    /// A drive that goes at a constant speed most of the time lost all samples at which it accelerated.
    #[test]
    fn a_machine_that_accelerates_is_no_outlier() {
        let mut data = trial(0.0);
        let (mut position, mut speed) = (0.0, 0.0);
        for (k, row) in data.measured.iter_mut().enumerate() {
            // A tenth of the time it speeds up, a tenth it slows down.
            speed += [0.002, 0.0, 0.0, 0.0, 0.0, -0.002, 0.0, 0.0, 0.0, 0.0][k / 40 % 10];
            position += 0.02 * speed;
            row[0] = position;
        }
        assert_eq!(remove_outliers(&mut data), 0);
        for k in [20, 220, 300, 415] {
            data.measured[k][0] += 0.01;
        }
        assert_eq!(remove_outliers(&mut data), 4);
        assert!([20, 220, 300, 415].iter().all(|k| data.measured[*k][0].is_nan()));
    }
}
