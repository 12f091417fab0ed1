//! Times as recordings give them.

use jiff::{Timestamp, civil::DateTime, tz::TimeZone};

use super::Trial;

/// Seconds from 1970 to a date and time as of ISO 8601, with a zone or, without one, as in UTC; `None` for another text.
pub(super) fn seconds_since_1970(text: &str) -> Option<f64> {
    // A plain number is none, though 20260504 could be read as a date.
    if !text.contains(':') {
        return None;
    }
    let stamp = match text.parse::<Timestamp>() {
        Ok(stamp) => stamp,
        Err(_) => text.parse::<DateTime>().ok()?.to_zoned(TimeZone::UTC).ok()?.timestamp(),
    };
    Some(stamp.as_second() as f64 + f64::from(stamp.subsec_nanosecond()) * 1e-9)
}

/// Time (s) from which a clock does not count from the experiment but from an epoch. Numbers of that size are also so coarse
/// (1e-8 s) that steps of samples are not the same any more.
const EPOCH: f64 = 1e8;

/// Lets times of an absolute clock (Unix time, dates) count from the first sample of all recordings, which it returns.
///
/// All recordings keep one clock, so that laws of time stay in phase from one to the other. Other clocks are left alone: a
/// law of time in the model counts by them.
pub(crate) fn count_from_first_sample(train: &mut [Trial], holdout: &mut [Trial]) -> Option<f64> {
    let first = |trials: &[Trial]| trials.iter().filter_map(|t| t.time.first().copied()).fold(f64::INFINITY, f64::min);
    let origin = first(train).min(first(holdout));
    if !(origin.is_finite() && origin >= EPOCH) {
        return None;
    }
    for trial in train.iter_mut().chain(holdout) {
        trial.time.iter_mut().for_each(|time| *time -= origin);
    }
    Some(origin)
}

/// A time since 1970 as a date.
pub(crate) fn date(seconds: f64) -> String {
    let milliseconds = (1e3 * seconds).round() as i64;
    Timestamp::from_millisecond(milliseconds).map_or_else(|_| format!("{seconds} s"), |stamp| stamp.to_string())
}

#[cfg(test)]
mod tests {
    use cdpr::dynamics::Inputs;

    use super::*;

    #[test]
    fn dates_of_all_forms_are_seconds() {
        let unix = 1_777_890_030.25;
        for text in [
            "2026-05-04T10:20:30.25Z",
            "2026-05-04 10:20:30.25",
            "2026-05-04T12:20:30.250000+02:00",
            "2026-05-04T10:20:30.25",
        ] {
            assert_eq!(seconds_since_1970(text), Some(unix), "{text}");
        }
        for text in ["12.5", "10:20:30", "1e9", "", "20260504", "2026-13-04T10:20:30"] {
            assert_eq!(seconds_since_1970(text), None, "{text}");
        }
        assert_eq!(date(unix), "2026-05-04T10:20:30.25Z");
    }

    #[test]
    fn unix_time_counts_from_the_first_sample_and_other_clocks_are_left_alone() {
        let trial = |start: f64| Trial {
            name: String::new(),
            time: vec![start, start + 0.5],
            inputs: vec![Inputs::none(4); 2],
            channels: Vec::new(),
            measured: vec![Vec::new(); 2],
            taken_off: Vec::new(),
            undone: Vec::new(),
        };
        let (mut train, mut holdout) = ([trial(1.7e9 + 60.0)], [trial(1.7e9)]);
        assert_eq!(count_from_first_sample(&mut train, &mut holdout), Some(1.7e9));
        assert_eq!((train[0].time[1], holdout[0].time[0]), (60.5, 0.0));
        let mut train = [trial(5000.0)];
        assert_eq!(count_from_first_sample(&mut train, &mut []), None);
        assert_eq!(train[0].time[0], 5000.0);
    }
}
