//! What is known of the first states of a trial before anything is measured.

use cdpr::dynamics::{Inputs, Jacobian};
use cdpr::kinematics::cables;
use cdpr::per_cable::PerCable;

use crate::data::Trial;
use crate::filter::path::{Trajectory, scale};
use crate::model::examined::Examined;
use crate::model::sizes::{Sizes, usual_force};

/// The first states as they are guessed: they deviate from a trajectory's by a mean, with a covariance.
///
/// Pose and twist may be anywhere near. A cable is where it carries its winch's force at the chord that the pose makes, and its end
/// moves with the chord, as they do wherever a robot was running before: the two go together. Of each by itself half a metre more or
/// less would be as likely as what a cable stretches, a fraction of a millimetre on a small stiff robot, so that noise decided which
/// cables begin slack.
#[derive(Clone, Debug)]
pub(crate) struct Prior {
    pub(crate) mean: Vec<f64>,
    /// By rows.
    pub(crate) covariance: Vec<f64>,
}

/// Share of the usual force by which a tension differs from its winch's force as a recording begins (one standard deviation): by
/// what friction and inertia take.
const OFF_REST: f64 = 0.25;

impl Prior {
    /// Of a guess of the first pose and twist, for a trajectory whose first states feel these inputs, with these cables slack.
    pub(super) fn new(
        model: &Examined,
        trial: &Trial,
        trajectory: &Trajectory,
        guess: &[f64],
        felt: &Inputs,
        slack: &PerCable<bool>,
    ) -> Self {
        let (n, plant, time) = (model.states(), &model.plant, trial.time[0]);
        let at = trajectory.states(0);
        let mut mean: Vec<f64> = guess.iter().zip(at).map(|(guess, at)| guess - at).collect();
        let mut own = scale(model);
        // A platform turns as fast as its attachments move.
        own[5] = own[3] / Sizes::of_plant(plant.data()).arm;
        // What a deviation of the platform does to each state, beside its own.
        let mut moved = vec![[0.0; 6]; n];
        (0..6).for_each(|axis| moved[axis][axis] = own[axis]);
        own[..6].fill(0.0);
        let mut jacobian = Jacobian::default();
        jacobian.update(plant, time, at, felt, slack);
        let [pose, twist] = [0, 3].map(|first| std::array::from_fn(|axis| at[first + axis]));
        let force = OFF_REST * usual_force(std::slice::from_ref(trial));
        for (i, chord) in cables(plant.geometry(), &pose, &twist).iter().enumerate() {
            let Some(length) = plant.unstretched_index(i) else { continue };
            let states = &at[plant.effect_states(i)];
            let at_rest = plant.unstretched_length_for(i, time, chord.length, felt.winch_force[i].max(0.0), states);
            let (row, share) = (chord.jacobian_row(), at_rest / chord.length);
            let by_platform = |first: usize, deviations: &[[f64; 6]]| -> [f64; 6] {
                std::array::from_fn(|k| share * (0..3).map(|axis| row[axis] * deviations[first + axis][k]).sum::<f64>())
            };
            let shift =
                |first: usize, mean: &[f64]| share * (0..3).map(|axis| row[axis] * mean[first + axis]).sum::<f64>();
            own[length] = chord.length * force / plant.data().cables[i].axial_stiffness;
            moved[length] = by_platform(0, &moved);
            mean[length] = at_rest - at[length] + shift(0, &mean);
            if let Some(rate) = plant.rate_index(i) {
                let stiffness = -jacobian.by_state[rate * n + length];
                own[rate] = own[length] * stiffness.max(0.0).sqrt();
                moved[rate] = by_platform(3, &moved);
                mean[rate] = share * chord.speed - at[rate] + shift(3, &mean);
            }
        }
        let covariance = |r: usize, c: usize| {
            let together: f64 = moved[r].iter().zip(&moved[c]).map(|(a, b)| a * b).sum();
            if r == c { together + own[r].powi(2) } else { together }
        };
        let covariance = (0..n * n).map(|at| covariance(at / n, at % n)).collect();
        Self { mean, covariance }
    }
}

#[cfg(test)]
mod tests {
    use cdpr::model_file::Model;
    use nalgebra::DMatrix;

    use super::*;
    use crate::data::recording::{Bench, record_on};
    use crate::filter::estimate::{Fit, noise_of_data};
    use crate::instruments::latents::first_randomness;

    /// A length was off by two metres of its 2.4, or its tension by as much as is usual, whatever the pose was: noise of half of what
    /// the cables stretch had some of them begin slack, and trajectories ran away from there.
    #[test]
    fn a_small_stiff_robot_settles() {
        let bench = Bench::stiff();
        let model = Model { parameters: bench.parameters.clone(), ..Model::default() };
        for seed in [3, 4, 5] {
            let trials = [record_on(&bench, &[], 12.0, seed)];
            let randomness = first_randomness(&model, &trials, &noise_of_data(&trials)).without_latents();
            let mut fit = Fit::new(&model, &trials, &randomness, None).unwrap();
            assert!(fit.settle(&trials, 6).unwrap() && fit.has_settled(), "seed {seed}");
        }
    }

    #[test]
    fn cables_are_at_rest_about_whatever_pose_there_is() {
        let bench = Bench::stiff();
        let trial = record_on(&bench, &[], 2.0, 3);
        let model = Examined::new(&Model { parameters: bench.parameters, ..Model::default() }).unwrap();
        let (n, guess) = (model.states(), model.first_states(&trial));
        let felt = trial.inputs[0];
        let at = |pose: [f64; 3]| {
            let mut values = guess.clone();
            values[..3].copy_from_slice(&pose);
            values.resize(n + model.latents(), 0.0);
            let trajectory = Trajectory { width: values.len(), values, states: n };
            Prior::new(&model, &trial, &trajectory, &guess, &felt, &PerCable::filled(4, false))
        };
        let off = [0.03, -0.02, 0.01];
        let (here, there) =
            (at([guess[0], guess[1], guess[2]]), at(std::array::from_fn(|axis| guess[axis] + off[axis])));
        let covariance = DMatrix::from_row_slice(n, n, &here.covariance);
        let of_platform = covariance.view((0, 0), (6, 6)).into_owned();
        let usual = usual_force(std::slice::from_ref(&trial));
        for i in 0..4 {
            let (length, rate) = (model.plant.unstretched_index(i).unwrap(), model.plant.rate_index(i).unwrap());
            // The length that is expected at the pose of a guess is the same wherever a trajectory begins.
            let expected = |prior: &Prior| prior.mean[length];
            assert!((expected(&here) - expected(&there)).abs() < 1e-3, "{i}");
            let given_pose = |state: usize| {
                let row = covariance.view((state, 0), (1, 6)).into_owned();
                covariance[(state, state)]
                    - (&row * of_platform.clone().try_inverse().unwrap() * row.transpose())[(0, 0)]
            };
            let chord = cdpr::kinematics::cable_lengths(model.plant.geometry(), &[guess[0], guess[1], guess[2]])[i];
            let stretch = chord * OFF_REST * usual / model.plant.data().cables[i].axial_stiffness;
            assert!((given_pose(length).sqrt() / stretch - 1.0).abs() < 1e-3, "{i}");
            // As fast as the stretch goes and comes with 4 kg on the cable.
            let swing = (model.plant.data().cables[i].axial_stiffness / chord / 4.0).sqrt();
            assert!((given_pose(rate).sqrt() / (stretch * swing) - 1.0).abs() < 0.1, "{i}");
        }
    }
}
