//! Recordings made ready for a search, whoever made them.

use std::collections::HashSet;
use std::hash::{DefaultHasher, Hash, Hasher};

use super::clock::{count_from_first_sample, date};
use super::read::check_observable;
use super::{FEWEST, Trial};

/// Rows in a row that only a copy repeats, noise and all.
const STRETCH: usize = 5;
/// Share of a recording's rows that may stand in another one by chance: instruments at rest that count in steps.
const BY_CHANCE: f64 = 0.05;

/// Makes recordings ready: channels without a number are left out, and an absolute clock counts from the first sample.
/// Returns remarks.
///
/// # Errors
/// What no search can use, with the recording's name: too few samples, times that do not increase, inputs that are no
/// numbers, no pose to be told, samples further apart than `horizon` (s), rows that stand in two recordings.
pub(crate) fn make_ready(train: &mut [Trial], holdout: &mut [Trial], horizon: f64) -> Result<Vec<String>, String> {
    for trial in train.iter_mut().chain(holdout.iter_mut()) {
        let wrong = |message: String| format!("{}: {message}", trial.name);
        if trial.len() < FEWEST {
            return Err(wrong(format!("{} samples, expected {FEWEST} or more", trial.len())));
        }
        if let Some(k) = (1..trial.len()).find(|k| trial.time[*k] <= trial.time[k - 1] || !trial.time[*k].is_finite()) {
            let [time, last] = [trial.time[k], trial.time[k - 1]];
            return Err(wrong(format!(
                "time is {time} in sample {}, expected more than {last}, the one before",
                k + 1
            )));
        }
        let finite = |k: &usize| {
            let inputs = &trial.inputs[*k];
            inputs.winch_force.iter().chain(&inputs.disturbance).all(|v| v.is_finite())
        };
        if let Some(k) = (0..trial.len()).find(|k| !finite(k)) {
            return Err(wrong(format!("an input of sample {} is no number, expected numbers throughout", k + 1)));
        }
        if trial.interval() > horizon {
            return Err(wrong(format!(
                "samples are {} s apart, expected at most {horizon} s; where `time` is in ms, write \
                 time = {{ column = \"time\", unit = \"ms\" }} in the map",
                trial.interval()
            )));
        }
        trial.drop_empty_channels();
        check_observable(trial).map_err(|message| format!("{}: {message}", trial.name))?;
    }
    let all: Vec<&Trial> = train.iter().chain(holdout.iter()).collect();
    for (at, trial) in all.iter().enumerate() {
        for other in &all[..at] {
            let share = repeated(trial, other);
            if share > BY_CHANCE {
                let why =
                    if at < train.len() { "each is to be given once" } else { "held-out data must not be fitted" };
                return Err(format!(
                    "{:.0} % of the rows of {} stand in {} as well; {why}: leave one out, or without --holdout let the \
                     last part of the longest recording be held out",
                    100.0 * share,
                    trial.name,
                    other.name
                ));
            }
        }
    }
    let since = count_from_first_sample(train, holdout);
    Ok(since.into_iter().map(|origin| format!("Times count from the first sample, {}.", date(origin))).collect())
}

/// Share of the stretches of rows of `trial` that stand in `other` as well. Rows that repeat do not count.
fn repeated(trial: &Trial, other: &Trial) -> f64 {
    if trial.channels != other.channels {
        return 0.0;
    }
    let known: HashSet<u64> = stretches(other).collect();
    let own: HashSet<u64> = stretches(trial).collect();
    own.intersection(&known).count() as f64 / own.len().max(1) as f64
}

/// Marks of the stretches of rows in which something changes from row to row.
fn stretches(trial: &Trial) -> impl Iterator<Item = u64> {
    let mark = |k: usize| {
        let mut hasher = DefaultHasher::new();
        let inputs = &trial.inputs[k];
        let values = inputs.winch_force.iter().chain(&inputs.disturbance).chain(&trial.measured[k]);
        values.for_each(|v| v.to_bits().hash(&mut hasher));
        hasher.finish()
    };
    let marks: Vec<u64> = (0..trial.len()).map(mark).collect();
    let stretches: Vec<u64> = marks
        .windows(STRETCH)
        .filter(|rows| rows.windows(2).all(|pair| pair[0] != pair[1]))
        .map(|rows| {
            let mut hasher = DefaultHasher::new();
            rows.hash(&mut hasher);
            hasher.finish()
        })
        .collect();
    stretches.into_iter()
}

#[cfg(test)]
mod tests {
    use std::slice::from_ref;

    use super::super::recording::record;
    use super::*;

    fn ready(train: &[Trial], holdout: &[Trial]) -> Result<Vec<String>, String> {
        make_ready(&mut train.to_vec(), &mut holdout.to_vec(), 5.0)
    }

    #[test]
    fn held_out_data_that_were_fitted_are_noticed() {
        let [run, other] = [1, 2].map(|seed| record(&[], 20.0, seed));
        assert_eq!(ready(from_ref(&run), from_ref(&other)), Ok(vec![]));
        // The same file, a part of it, and a part with its own clock.
        let mut part = run.part(50..120, "part.csv".into());
        part.time.iter_mut().for_each(|time| *time -= 5.0);
        for held in [run.clone(), part] {
            let error = ready(&[other.clone(), run.clone()], &[held]).unwrap_err();
            assert!(error.starts_with("100 % of the rows of"), "{error}");
            assert!(error.contains("held-out data must not be fitted"), "{error}");
        }
        let error = ready(&[run.clone(), run], &[other]).unwrap_err();
        assert!(error.contains("each is to be given once"), "{error}");
    }

    #[test]
    fn instruments_at_rest_that_count_in_steps_are_no_copies() {
        let mut run = record(&[], 20.0, 3);
        run.inputs = vec![run.inputs[0]; run.len()];
        let still = |digit: usize| {
            let mut still = run.clone();
            for (k, row) in still.measured.iter_mut().enumerate() {
                row.fill(0.0);
                row[0] = if (k / 7 + digit).is_multiple_of(2) { 0.01 } else { 0.0 };
            }
            still
        };
        assert_eq!(ready(&[still(0)], &[still(1)]), Ok(vec![]));
    }

    #[test]
    fn unix_times_are_said_to_count_from_the_first_sample() {
        let mut run = record(&[], 20.0, 4);
        run.time.iter_mut().for_each(|time| *time += 1_777_890_030.25);
        let mut train = [run];
        let remarks = make_ready(&mut train, &mut [], 5.0).unwrap();
        assert_eq!(remarks, ["Times count from the first sample, 2026-05-04T10:20:30.25Z."]);
        assert_eq!(train[0].time[0], 0.0);
        assert!((train[0].time[200] - 20.0).abs() < 1e-6);
    }

    #[test]
    fn milliseconds_read_as_seconds_are_noticed_by_the_sampling() {
        let mut run = record(&[], 20.0, 4);
        run.time.iter_mut().for_each(|time| *time *= 1e3);
        let error = ready(&[run], &[]).unwrap_err();
        assert!(error.contains("samples are 100 s apart, expected at most 5 s"), "{error}");
        assert!(error.contains("unit = \"ms\""), "{error}");
    }
}
