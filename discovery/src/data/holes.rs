//! Stretches of a recording in which nobody knows the winch forces: rows are missing, or the log of the forces stood still while the machine
//! went on. What the forces did there no model can tell: a recording ends before such a stretch, and another one begins behind it. Where but
//! a row or two are missing and forces change evenly, they go straight from the row before to the one behind.

use std::ops::Range;

use super::clean::{median, noise_by_differences};
use super::counts::smallest_step;
use super::{FEWEST, Trial};

/// How many times as long as nearly all steps of a recording one is that lacks rows.
const LONG: f64 = 3.0;
/// By how much longer than usual (median) a step is at least that lacks a row or two, as a share.
const LACKS: f64 = 0.5;
/// How many times as far beyond the usual one as 99 of 100 steps are below it at most: stamps that jitter make steps shorter as well, and rows
/// that are missing do not.
const BEYOND_JITTER: f64 = 1.5;
/// How many times as far from the row before as from halfway between its neighbours forces are (medians) that change evenly. What is held, or
/// jumps, is as far from either.
const EVENLY: f64 = 3.0;
/// The share of steps, changes of forces and stretches of unchanged forces that are usual in a recording.
const USUAL: f64 = 0.99;
/// Deviations of its noise, and its steps where it counts, by which a channel must have gone on while forces stood still: else the machine
/// may have done so as well.
const MOVES: f64 = 6.0;

/// A recording without the stretches in which its winch forces are not known, as recordings of its parts, and how long (s) those are.
/// Parts of too few samples are left out as well; a recording of which no part has enough stays as it is.
pub(crate) fn cut_at_holes(trial: &Trial) -> (Vec<Trial>, Vec<f64>) {
    let holes = holes(trial);
    let mut known = Vec::new();
    let mut from = 0;
    for hole in &holes {
        known.push(from..hole.start.max(from));
        // Rows may be missing where the log stands still.
        from = from.max(hole.end);
    }
    known.push(from..trial.len());
    let parts: Vec<Trial> =
        known.into_iter().filter(|part| part.len() >= FEWEST).map(|part| named(trial, part)).collect();
    if holes.is_empty() || parts.is_empty() {
        return (vec![trial.clone()], Vec::new());
    }
    let long = |hole: &Range<usize>| trial.time[hole.end] - trial.time[hole.start - 1];
    let lengths = holes.iter().map(long).collect();
    (parts, lengths)
}

/// The samples `part` as a trial that is called after the whole and by its times.
fn named(trial: &Trial, part: Range<usize>) -> Trial {
    let [first, last] = [part.start, part.end - 1].map(|k| trial.time[k]);
    let mut out = trial.part(part, format!("{}, {first:.1} s to {last:.1} s", trial.name));
    out.drop_empty_channels();
    out
}

/// A recording with a row for each that is missing by itself or with one other, where its forces change evenly: with the forces in between,
/// and nothing measured; and how many rows those are.
pub(crate) fn with_rows_between(trial: &Trial) -> (Trial, usize) {
    let steps: Vec<f64> = trial.time.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let mut sorted = steps.clone();
    sorted.sort_by(f64::total_cmp);
    let at = |share: f64| sorted.get((share * sorted.len() as f64) as usize).copied().unwrap_or(0.0);
    let interval = at(0.5);
    // Of a log that has no step of its own nobody knows what it lacks.
    let regular = at(0.75) < (1.0 + LACKS) * interval && at(0.25) > interval / (1.0 + LACKS);
    if !regular || !changes_evenly(trial) {
        return (trial.clone(), 0);
    }
    let jitter = (interval - at(1.0 - USUAL)) / interval;
    let shortest = (1.0 + LACKS.max(BEYOND_JITTER * jitter)) * interval;
    let longest = LONG * usual(steps.clone());
    let mut out = Trial { time: Vec::new(), inputs: Vec::new(), measured: Vec::new(), ..trial.clone() };
    for k in 0..trial.len() {
        out.time.push(trial.time[k]);
        out.inputs.push(trial.inputs[k]);
        out.measured.push(trial.measured[k].clone());
        let lacks = |step: &&f64| **step > shortest && **step <= longest;
        let Some(step) = steps.get(k).filter(lacks) else { continue };
        let rows = (step / interval).round().max(1.0) as usize;
        for row in 1..rows {
            let share = row as f64 / rows as f64;
            let mut inputs = trial.inputs[k];
            for winch in 0..trial.cables() {
                let (before, behind) = (trial.inputs[k].winch_force[winch], trial.inputs[k + 1].winch_force[winch]);
                inputs.winch_force[winch] = before + share * (behind - before);
            }
            out.time.push(trial.time[k] + share * step);
            out.inputs.push(inputs);
            out.measured.push(vec![f64::NAN; trial.channels.len()]);
        }
    }
    let rows = out.len() - trial.len();
    (out, rows)
}

/// Whether winch forces go from row to row evenly, so that one that is missing is in between.
fn changes_evenly(trial: &Trial) -> bool {
    let force = |k: usize, winch: usize| trial.inputs[k].winch_force[winch];
    let median_of = |distance: &dyn Fn(usize, usize) -> f64| {
        let rows = 1..trial.len().saturating_sub(1);
        median(
            rows.flat_map(|k| (0..trial.cables()).map(move |winch| (k, winch)))
                .map(|(k, winch)| distance(k, winch))
                .collect(),
        )
    };
    let held = median_of(&|k, winch| (force(k, winch) - force(k - 1, winch)).abs());
    let even = median_of(&|k, winch| (force(k, winch) - 0.5 * (force(k - 1, winch) + force(k + 1, winch))).abs());
    held > EVENLY * even
}

/// The samples of which the winch forces are not known, one stretch after the other, each with known ones on both sides: none where the
/// samples themselves are missing.
fn holes(trial: &Trial) -> Vec<Range<usize>> {
    let steps: Vec<f64> = trial.time.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let longest = LONG * usual(steps.clone());
    let mut holes: Vec<Range<usize>> = (1..trial.len()).filter(|k| steps[k - 1] > longest).map(|k| k..k).collect();
    holes.extend(still(trial, longest));
    holes.sort_by_key(|hole| (hole.start, hole.end));
    holes
}

/// What nearly all are no larger than.
fn usual(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let at = (USUAL * values.len() as f64) as usize;
    values.get(at.min(values.len().saturating_sub(1))).copied().unwrap_or(0.0)
}

/// The stretches longer than `longest` (s), and far longer than other such, in which the forces of all winches repeat to the last digit, as
/// they do not elsewhere, and behind which they go on with a jump, while the machine has moved.
fn still(trial: &Trial, longest: f64) -> Vec<Range<usize>> {
    let forces = |k: usize| &trial.inputs[k].winch_force;
    let mut runs: Vec<Range<usize>> = Vec::new();
    for k in 1..trial.len() {
        match runs.last_mut() {
            Some(run) if run.end == k && forces(k) == forces(k - 1) => run.end = k + 1,
            _ if forces(k) == forces(k - 1) => runs.push(k..k + 1),
            _ => runs.push(k..k),
        }
    }
    let most = LONG * usual(runs.iter().map(|run| 1.0 + run.len() as f64).collect());
    let change = |k: usize| {
        let pairs = forces(k).iter().zip(forces(k - 1).iter());
        pairs.map(|(now, before)| (now - before).abs()).fold(0.0, f64::max)
    };
    let changes = usual((1..trial.len()).map(change).filter(|change| *change > 0.0).collect());
    let noise: Vec<f64> =
        (0..trial.channels.len()).map(|j| noise_by_differences(trial, j).max(0.5 * smallest_step(trial, j))).collect();
    let moved = |run: &Range<usize>| {
        let gone = |j: usize| (trial.measured[run.end][j] - trial.measured[run.start - 1][j]).abs();
        (0..trial.channels.len()).any(|j| gone(j) > MOVES * noise[j])
    };
    let is_hole = |run: &Range<usize>| {
        1.0 + run.len() as f64 > most
            && run.end < trial.len()
            && trial.time[run.end] - trial.time[run.start - 1] > longest
            && change(run.end) > changes
            && moved(run)
    };
    runs.into_iter().filter(is_hole).collect()
}

#[cfg(test)]
mod tests {
    use super::super::recording::{noise, record};
    use super::*;

    /// The recording without these samples.
    fn without(trial: &Trial, lost: Range<usize>) -> Trial {
        let mut out = trial.part(0..lost.start, trial.name.clone());
        let rest = trial.part(lost.end..trial.len(), String::new());
        out.time.extend(rest.time);
        out.inputs.extend(rest.inputs);
        out.measured.extend(rest.measured);
        out
    }

    #[test]
    fn a_recording_ends_before_missing_rows_and_another_begins_behind_them() {
        let whole = record(&[], 40.0, 4);
        let trial = without(&without(&whole, 250..290), 100..105);
        let (parts, lengths) = cut_at_holes(&trial);
        let expected = [0..100, 105..250, 290..whole.len()].map(|part| whole.time[part].to_vec());
        assert_eq!(parts.iter().map(|part| part.time.clone()).collect::<Vec<_>>(), expected);
        let interval = whole.interval();
        assert!((lengths[0] - 6.0 * interval).abs() < 1e-9 && (lengths[1] - 41.0 * interval).abs() < 1e-9);
        assert!(parts[1].name.ends_with(&format!(", {:.1} s to {:.1} s", whole.time[105], whole.time[249])));
        // One row or two, or rows missing everywhere, are no hole.
        assert_eq!(cut_at_holes(&without(&whole, 100..102)).0.len(), 1);
        let mut thin = whole.clone();
        for k in (0..19).rev() {
            thin = without(&thin, 20 * k + 5..20 * k + 11);
        }
        assert_eq!(cut_at_holes(&thin).0.len(), 1);
    }

    /// Of forces that are held, as by an open loop, or that jump, what was missing is not in between.
    #[test]
    fn single_rows_that_are_missing_are_in_between_where_forces_change_evenly() {
        let whole = record(&[], 40.0, 4);
        let lost = [40, 80, 81, 200];
        let gaps = |whole: &Trial| lost.iter().rev().fold(whole.clone(), |trial, k| without(&trial, *k..k + 1));
        let (filled, rows) = with_rows_between(&gaps(&whole));
        assert_eq!((rows, filled.len()), (lost.len(), whole.len()));
        for k in 0..whole.len() {
            let missing = lost.contains(&k);
            assert!((filled.time[k] - whole.time[k]).abs() < 1e-9);
            assert!(filled.measured[k].iter().all(|value| value.is_nan() == missing));
            let off =
                |winch: usize| (filled.inputs[k].winch_force[winch] / whole.inputs[k].winch_force[winch] - 1.0).abs();
            assert!((0..4).all(|winch| off(winch) < if missing { 2e-3 } else { 1e-12 }), "{k}");
        }
        let [mut held, mut jumps] = [0; 2].map(|_| whole.clone());
        for k in 0..whole.len() {
            held.inputs[k] = held.inputs[k / 10 * 10];
            jumps.inputs[k].winch_force[k % 4] += 500.0;
            jumps.inputs[k].winch_force[(k / 2) % 4] -= 500.0;
        }
        for trial in [held, jumps] {
            assert_eq!(with_rows_between(&gaps(&trial)).1, 0);
        }
        // Stamps that jitter by a fifth of a step.
        let mut jitters = whole.clone();
        let interval = whole.interval();
        jitters
            .time
            .iter_mut()
            .zip(noise(whole.len(), 7))
            .for_each(|(time, white)| *time += 0.2 * interval * white.clamp(-2.4, 2.4));
        assert_eq!(with_rows_between(&jitters).1, 0);
        // Readings by the event, as far from each other as chance has it.
        let mut chance = gaps(&whole);
        for (k, time) in chance.time.iter_mut().enumerate() {
            *time += 0.09 * (k as f64 * 2.4).sin();
        }
        assert_eq!(with_rows_between(&chance).1, 0);
    }

    #[test]
    fn too_few_samples_are_no_part_and_a_recording_of_such_parts_stays_whole() {
        let whole = record(&[], 40.0, 4);
        let trial = without(&without(&whole, 100..120), 60..80);
        let (parts, _) = cut_at_holes(&trial);
        assert_eq!(parts.iter().map(Trial::len).collect::<Vec<_>>(), [60, whole.len() - 120]);
        let short = without(&without(&whole.part(0..110, "short".into()), 75..85), 30..40);
        let (parts, lengths) = cut_at_holes(&short);
        assert_eq!((parts.len(), parts[0].len(), lengths.len()), (1, short.len(), 0));
    }

    #[test]
    fn a_log_that_stood_still_is_a_hole_where_the_machine_moved() {
        let whole = record(&[], 40.0, 4);
        let [mut all, mut forces] = [0; 2].map(|_| whole.clone());
        for k in 150..190 {
            all.inputs[k] = all.inputs[149];
            all.measured[k] = all.measured[149].clone();
            forces.inputs[k] = forces.inputs[149];
        }
        for trial in [all, forces] {
            let (parts, lengths) = cut_at_holes(&trial);
            let expected = [0..150, 190..whole.len()].map(|part| whole.time[part].to_vec());
            assert_eq!(parts.iter().map(|part| part.time.clone()).collect::<Vec<_>>(), expected);
            assert_eq!(lengths.len(), 1);
        }
        // With rows missing while it stands still.
        let mut both = whole.clone();
        for k in 150..190 {
            both.inputs[k] = both.inputs[149];
        }
        let (parts, lengths) = cut_at_holes(&without(&both, 160..170));
        let expected = [0..150, 190..whole.len()].map(|part| whole.time[part].to_vec());
        assert_eq!(parts.iter().map(|part| part.time.clone()).collect::<Vec<_>>(), expected);
        assert_eq!(lengths.len(), 2);
        // At rest until a controller begins, and commands that are held as long as they are.
        let [mut rest, mut held] = [0; 2].map(|_| whole.clone());
        for k in 0..150 {
            rest.inputs[k] = rest.inputs[0];
            rest.measured[k] = rest.measured[0].clone();
        }
        for k in 0..held.len() {
            held.inputs[k] = held.inputs[k / 40 * 40];
        }
        for trial in [rest, held] {
            assert_eq!(cut_at_holes(&trial).0.len(), 1);
        }
    }
}
