//! Recorded winch forces that jump away for some rows and back again, as where a logger writes nothing, 0 or −999 for a reading that it lost.
//!
//! A winch may do so as well, on purpose; whether it did only the plant tells.

use super::Trial;
use super::clean::median;

/// Rows before and rows after that tell what a force is around a row: more than half of each must be right.
const AROUND: usize = 10;
/// How many times as far as forces usually are from the median around them (robust standard deviation) a lost one is, and as those right before
/// and after it.
const BEYOND: f64 = 10.0;
/// The least that is usual, as a share of what the force is: of one that hardly changes every change would be unusual.
const LEAST: f64 = 1e-3;

/// A trial with straight lines in the place of forces that jump away and back, and in how many rows each winch's did.
pub(crate) fn with_forces_between(trial: &Trial) -> (Trial, Vec<usize>) {
    let mut out = trial.clone();
    let counts = (0..trial.cables()).map(|winch| {
        let force: Vec<f64> = trial.inputs.iter().map(|inputs| inputs.winch_force[winch]).collect();
        let lost = out_of_place(&force);
        let count = lost.iter().filter(|lost| **lost).count();
        let known: Vec<usize> = (0..force.len()).filter(|k| !lost[*k]).collect();
        for (k, inputs) in out.inputs.iter_mut().enumerate().filter(|(k, _)| lost[*k]) {
            // Those near the ends are known.
            let next = known.partition_point(|known| *known < k);
            let (a, b) = (known[next - 1], known[next]);
            let share = (trial.time[k] - trial.time[a]) / (trial.time[b] - trial.time[a]);
            inputs.winch_force[winch] = force[a] + share * (force[b] - force[a]);
        }
        count
    });
    let counts = counts.collect();
    (out, counts)
}

/// Whether each force is no force of this winch: away from those around it, by one number as long as it is, and out of the range of all others
/// by more than that is wide, or a number that most of those away are, several, to the last digit, and no other is. What else jumps is a
/// command, and so is what fades, as where a controller begins.
fn out_of_place(force: &[f64]) -> Vec<bool> {
    let off = off_from_around(force);
    let away = away(force, &off);
    let others = || force.iter().zip(&away).filter(|(_, away)| !**away).map(|(force, _)| *force);
    let (least, most) = others().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), force| (a.min(force), b.max(force)));
    let all = away.iter().filter(|away| **away).count();
    let again = |value: f64| {
        let same = force.iter().zip(&away).filter(|(force, away)| **away && **force == value).count();
        same > 1 && 2 * same > all
    };
    let stands_out = |value: f64| {
        let beyond = (least - value).max(value - most) > most - least;
        beyond || (again(value) && !others().any(|other| other == value))
    };
    // As long as it is away it is one number, and what goes on before and after is as usual.
    let sudden = |k: usize| {
        let before = (0..k).rev().find(|at| !away[*at]);
        let after = (k..force.len()).find(|at| !away[*at]);
        let run = before.map_or(0, |at| at + 1)..after.unwrap_or(force.len());
        force[run].iter().all(|other| *other == force[k])
            && before.into_iter().chain(after).all(|at| BEYOND * off[at] < off[k])
    };
    (0..force.len()).map(|k| away[k] && stands_out(force[k]) && sudden(k)).collect()
}

/// How far each force is from the median of those before it and of those after it, whichever is nearer.
fn off_from_around(force: &[f64]) -> Vec<f64> {
    let off = |k: usize| {
        let sides = [k.saturating_sub(AROUND)..k, k + 1..(k + AROUND + 1).min(force.len())];
        let from = sides.map(|side| (force[k] - median(force[side].to_vec())).abs());
        from[0].min(from[1])
    };
    (0..force.len()).map(off).collect()
}

/// Whether each force is as far `off` as is not usual around it, nor in the whole recording. Near the ends a step looks the same, and none is.
fn away(force: &[f64], off: &[f64]) -> Vec<bool> {
    let around = |k: usize| k.saturating_sub(AROUND)..(k + AROUND + 1).min(force.len());
    let usual = 1.4826 * median(off.to_vec());
    let least = LEAST * median(force.iter().map(|force| force.abs()).collect());
    let limit = |k: usize| BEYOND * usual.max(least).max(1.4826 * median(off[around(k)].to_vec()));
    let inside = |k: usize| k >= AROUND && k + AROUND < force.len();
    (0..force.len()).map(|k| inside(k) && off[k] > limit(k)).collect()
}

#[cfg(test)]
mod tests {
    use super::super::recording::record;
    use super::*;

    #[test]
    fn what_a_logger_lost_is_between_what_was_before_and_after() {
        let clean = record(&[], 40.0, 4);
        let mut trial = clean.clone();
        let rows = [40, 41, 42, 45, 100, 101, 200];
        rows.iter().for_each(|k| trial.inputs[*k].winch_force[1] = 0.0);
        trial.inputs[300].winch_force[3] = -999.0;
        let (filled, counts) = with_forces_between(&trial);
        assert_eq!(counts, [0, 7, 0, 1]);
        for (k, (filled, clean)) in filled.inputs.iter().zip(&clean.inputs).enumerate() {
            for winch in 0..4 {
                let (filled, clean) = (filled.winch_force[winch], clean.winch_force[winch]);
                let lost = (winch == 1 && rows.contains(&k)) || (winch == 3 && k == 300);
                assert!(if lost { (filled / clean - 1.0).abs() < 0.02 } else { filled == clean }, "{k} {winch}");
            }
        }
    }

    /// A step, a force that is held for long at one of two values, and commands that jump within the range of all. In logs of a real robot
    /// hundreds of rows are of that kind.
    #[test]
    fn forces_that_change_for_good_and_commands_that_jump_are_as_recorded() {
        let clean = record(&[], 40.0, 4);
        let [mut step, mut square, mut jumps] = [0; 3].map(|_| clean.clone());
        for (k, inputs) in jumps.inputs.iter_mut().enumerate() {
            let wide = 18e3 + 20.0 * k as f64;
            inputs.winch_force[0] = if k % 30 == 20 { wide - 2e3 } else { wide };
        }
        step.inputs[200..].iter_mut().for_each(|inputs| inputs.winch_force[0] += 5e3);
        for (k, inputs) in square.inputs.iter_mut().enumerate() {
            inputs.winch_force[0] = if k / 25 % 2 == 0 { 18e3 } else { 22e3 };
        }
        // As a real robot's controller began.
        let mut begins = clean.clone();
        for (inputs, force) in
            begins.inputs.iter_mut().zip([15e3; 122].into_iter().chain([145e3, 134e3, 104e3, 50e3]).chain([15e3; 275]))
        {
            inputs.winch_force[0] = force;
        }
        for trial in [clean, step, square, jumps, begins] {
            let (filled, counts) = with_forces_between(&trial);
            assert_eq!(counts, [0; 4]);
            assert_eq!(filled.inputs, trial.inputs);
        }
    }
}
