//! Angles that are shown within one turn, and jump by a turn where they leave it.

use std::f64::consts::TAU;

use super::clean::median;
use super::{Channel, Trial};

/// How far (in turns) an angle may be from where it was a row before, less whole turns, where it has jumped by these.
const NEAR: f64 = 0.1;

/// Takes whole turns off the platform's angle where it jumps by them, so that it goes on; returns at how many places.
pub(crate) fn unwrap(trial: &mut Trial) -> usize {
    let Some(j) = trial.channels.iter().position(|channel| *channel == Channel::Pose(2)) else { return 0 };
    let known: Vec<usize> = (0..trial.len()).filter(|k| trial.measured[*k][j].is_finite()).collect();
    let shown: Vec<f64> = known.iter().map(|k| trial.measured[*k][j] / TAU).collect();
    let change: Vec<f64> = shown.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let jumps = |change: f64| change.round() != 0.0 && (change - change.round()).abs() < NEAR;
    let turns: Vec<f64> = change.iter().map(|change| if jumps(*change) { change.round() } else { 0.0 }).collect();
    // Numbers that are no angles in radians change by as much all the time.
    if turns.is_empty() || median(change.iter().map(|change| change.abs()).collect()) > 0.1 * NEAR {
        return 0;
    }
    // As most rows have it, so that a single reading that is off by a turn is put right and not all behind it.
    let mut turn = 0.0;
    let mut off = vec![0.0];
    off.extend(turns.iter().map(|more| {
        turn += more;
        turn
    }));
    let usual = median(off.clone());
    for (k, turns) in known.iter().zip(&off) {
        trial.measured[*k][j] -= TAU * (turns - usual);
    }
    turns.iter().filter(|turns| **turns != 0.0).count()
}

#[cfg(test)]
mod tests {
    use super::super::recording::record;
    use super::*;

    /// About the turn's end, a turn later from some row on, and a single reading that is off by a turn, with a gap beside it.
    #[test]
    fn an_angle_goes_on_where_it_jumps_by_a_turn() {
        let clean = record(&[], 40.0, 4);
        let middle = median(clean.measured.iter().map(|row| row[2]).collect());
        let [mut about, mut later, mut single] = [0; 3].map(|_| clean.clone());
        for (k, row) in about.measured.iter_mut().enumerate() {
            row[2] += if row[2] < middle { TAU } else { 0.0 };
            if k > 250 {
                later.measured[k][2] -= TAU;
            }
        }
        single.measured[99][2] = f64::NAN;
        single.measured[100][2] += 2.0 * TAU;
        for mut trial in [about, later, single] {
            assert!(unwrap(&mut trial) > 0);
            // Whole turns of all are none.
            let whole = ((trial.measured[0][2] - clean.measured[0][2]) / TAU).round() * TAU;
            for (row, clean) in trial.measured.iter().zip(&clean.measured) {
                assert!(row[2].is_nan() || (row[2] - whole - clean[2]).abs() < 1e-12);
                assert_eq!(row[..2], clean[..2]);
            }
        }
        let mut same = clean.clone();
        assert_eq!(unwrap(&mut same), 0);
        assert_eq!(same.measured, clean.measured);
    }

    /// Degrees read as radians, which may change by 6 from row to row.
    #[test]
    fn what_is_no_angle_in_radians_is_left_alone() {
        let mut trial = record(&[], 40.0, 4);
        trial.measured.iter_mut().enumerate().for_each(|(k, row)| row[2] = 30.0 * (k as f64 * 0.3).sin());
        let before = trial.measured.clone();
        assert_eq!(unwrap(&mut trial), 0);
        assert_eq!(trial.measured, before);
    }
}
