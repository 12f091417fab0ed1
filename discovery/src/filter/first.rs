//! A first trajectory, from measurements alone.

use crate::data::line::{line, straight};
use crate::data::{Channel, Trial};
use crate::filter::path::Trajectory;
use crate::model::examined::{Examined, gauss_newton_pose};

/// Poses by straight lines through what is measured, of coordinates that are not by the lengths; cables at rest under their commands.
pub(super) fn first_trajectory(model: &Examined, trial: &Trial, first: &[f64]) -> Trajectory {
    let n = model.states();
    let width = n + model.latents();
    let mut values = vec![0.0; trial.len() * width];
    let mut last = first.to_vec();
    for (k, (pose, twist)) in motion(model, trial, first).into_iter().enumerate() {
        let row = &mut values[k * width..(k + 1) * width];
        row[..n].copy_from_slice(&last);
        row[..3].copy_from_slice(&pose);
        row[3..6].copy_from_slice(&twist);
        let cables = cdpr::kinematics::cables(model.plant.geometry(), &pose, &twist);
        for i in 0..cables.len() {
            let Some(at) = model.plant.unstretched_index(i) else { continue };
            let tension = trial.inputs[k].winch_force[i].max(0.0);
            let range = model.plant.effect_states(i);
            let mut states = [0.0; cdpr::dynamics::MAX_EFFECT_STATES];
            states[..range.len()].copy_from_slice(&row[range]);
            row[at] = model.plant.unstretched_length_for(i, trial.time[k], cables[i].length, tension, &states);
            if let Some(rate) = model.plant.rate_index(i) {
                row[rate] = cables[i].speed;
            }
        }
        last.copy_from_slice(&row[..n]);
    }
    Trajectory { values, width, states: n }
}

/// Pose and twist at each sample, from those of `first` on where too little is measured for a line.
fn motion(model: &Examined, trial: &Trial, first: &[f64]) -> Vec<([f64; 3], [f64; 3])> {
    let halves: Vec<usize> = (0..trial.channels.len()).map(|j| straight(trial, j)).collect();
    let column = |wanted: Channel| trial.channels.iter().position(|c| *c == wanted);
    let measured: [Option<usize>; 3] = std::array::from_fn(|axis| column(Channel::Pose(axis)));
    let around =
        |j: usize, k: usize| line(trial, j, k.saturating_sub(halves[j])..(k + halves[j] + 1).min(trial.len()), k);
    let [mut pose, mut twist]: [[f64; 3]; 2] = [0, 3].map(|at| std::array::from_fn(|axis| first[at + axis]));
    let mut motion = Vec::with_capacity(trial.len());
    for k in 0..trial.len() {
        let lines = measured.map(|j| around(j?, k));
        if measured.iter().any(Option::is_none) {
            let lengths = model.lengths(|channel| Some(around(column(channel)?, k)?.0), &trial.inputs[k]);
            let known = lines.map(|line| Some(line?.0));
            let found = gauss_newton_pose(model.plant.geometry(), &lengths, &known, pose);
            if found.iter().all(|coordinate| coordinate.is_finite()) {
                pose = found;
            }
        }
        for (axis, (value, slope)) in lines.into_iter().enumerate().filter_map(|(axis, line)| Some((axis, line?))) {
            (pose[axis], twist[axis]) = (value, slope);
        }
        motion.push((pose, twist));
    }
    let half = halves.iter().copied().max().unwrap_or(1);
    for axis in (0..3).filter(|axis| measured[*axis].is_none()) {
        let poses: Vec<f64> = motion.iter().map(|(pose, _)| pose[axis]).collect();
        for (k, (_, twist)) in motion.iter_mut().enumerate() {
            let [from, to] = [k.saturating_sub(half), (k + half).min(poses.len() - 1)];
            if to > from {
                twist[axis] = (poses[to] - poses[from]) / (trial.time[to] - trial.time[from]);
            }
        }
    }
    motion
}

#[cfg(test)]
mod tests {
    use cdpr::model_file::Model;

    use super::*;
    use crate::data::recording::{Bench, of_channels, record_on};

    /// Coordinates that are not measured stood still where others went by lines, and were those of a tenth of a second before: cables of a
    /// small robot were off by more than they stretch.
    #[test]
    fn a_pose_that_is_measured_in_part_or_by_lengths_alone_is_where_it_is_and_moves() {
        let bench = Bench::stiff();
        let whole = record_on(&bench, &[], 6.0, 3);
        let model = Examined::new(&Model { parameters: bench.parameters, ..Model::default() }).unwrap();
        let on = |channels: &[usize]| {
            let trial = of_channels(&whole, channels);
            first_trajectory(&model, &trial, &model.first_states(&trial))
        };
        let all = on(&[0, 1, 2, 3, 4, 5, 6]);
        for channels in [&[0, 1, 3, 4, 5, 6][..], &[3, 4, 5, 6]] {
            let part = on(channels);
            for k in (0..whole.len()).step_by(20) {
                for (coordinate, within) in [(0, 1e-3), (1, 1e-3), (2, 5e-3), (3, 0.05), (4, 0.05), (5, 0.2)] {
                    let off = part.states(k)[coordinate] - all.states(k)[coordinate];
                    assert!(off.abs() < within, "{channels:?} {k} {coordinate}: {off}");
                }
            }
        }
    }

    #[test]
    fn a_gap_keeps_the_pose_before_it() {
        let mut trial = record_on(&Bench::large(), &[], 20.0, 3);
        let model = Examined::new(&Model::default()).unwrap();
        trial.measured[60..100].iter_mut().for_each(|row| row.fill(f64::NAN));
        let path = first_trajectory(&model, &trial, &model.first_states(&trial));
        assert_eq!(path.states(80)[..6], path.states(70)[..6]);
        assert!(path.values.iter().all(|value| value.is_finite()));
    }
}
