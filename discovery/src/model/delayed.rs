//! Signals at other instants than their samples': what a late channel shows.

/// How late a channel is against its stamps: by so many samples, and the rest of a sample.
///
/// A while ago is another state where the cables' vibration turns by more than a radian in that time: what is shown is taken
/// for what was at the sample nearest to when it was so, of which its state says it to first order.
#[derive(Clone, Copy)]
pub(crate) struct Clock {
    late: f64,
    samples: isize,
}

impl Clock {
    pub(crate) fn new(late: f64, interval: f64) -> Self {
        Self { late, samples: (late / interval).round() as isize }
    }

    /// The row with what is shown of sample `k`.
    pub(crate) fn row(self, k: usize, len: usize) -> Option<usize> {
        k.checked_add_signed(self.samples).filter(|row| *row < len)
    }

    /// When it was so (s), near to sample `k`.
    pub(crate) fn instant(self, time: &[f64], k: usize) -> Option<f64> {
        self.row(k, time.len()).map(|row| time[row] - self.late)
    }

    /// How long before sample `k` that was (s).
    pub(crate) fn rest(self, time: &[f64], k: usize) -> f64 {
        self.instant(time, k).map_or(0.0, |instant| time[k] - instant)
    }
}

/// Slopes in time of `channels` numbers a sample, from the neighbours on both sides.
pub(crate) fn rates(time: &[f64], shown: &[f64], channels: usize) -> Vec<f64> {
    let len = time.len();
    (0..len * channels)
        .map(|at| {
            let (k, j) = (at / channels, at % channels);
            let (before, after) = (k.saturating_sub(1), (k + 1).min(len - 1));
            (shown[after * channels + j] - shown[before * channels + j]) / (time[after] - time[before])
        })
        .collect()
}

/// What a smooth signal was a while before each sample.
pub(crate) fn earlier(time: &[f64], signal: &[f64], late: f64) -> Vec<f64> {
    at_instants(time, signal, time.iter().map(|t| t - late))
}

/// What a smooth signal is at some instants: by cubic polynomials between samples, along its slope before and after them.
pub(crate) fn at_instants(time: &[f64], signal: &[f64], instants: impl Iterator<Item = f64>) -> Vec<f64> {
    let slope = rates(time, signal, 1);
    let last = time.len() - 1;
    instants
        .map(|then| {
            let k = time.partition_point(|t| *t <= then).clamp(1, last) - 1;
            let h = time[k + 1] - time[k];
            let s = (then - time[k]) / h;
            if !(0.0..=1.0).contains(&s) {
                let end = if s < 0.0 { k } else { k + 1 };
                return signal[end] + slope[end] * (then - time[end]);
            }
            let (a, b) = (signal[k], signal[k + 1]);
            let (da, db) = (h * slope[k], h * slope[k + 1]);
            let cubic = 2.0 * (a - b) + da + db;
            let square = 3.0 * (b - a) - 2.0 * da - db;
            a + s * (da + s * (square + s * cubic))
        })
        .collect()
}
