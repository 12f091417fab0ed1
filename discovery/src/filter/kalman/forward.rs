//! Trajectories from the data alone, by a filter that runs forward with the model itself.

use crate::data::Trial;
use crate::filter::error::FitError;
use crate::filter::kalman::{Keep, Randomness, Run, Standing};
use crate::filter::path::{Trajectory, linearise};
use crate::filter::variation::Moving;
use crate::model::delayed::Clock;
use crate::model::examined::{Examined, disturb};

/// The states and latents after the measurements of each sample, of an extended Kalman filter: `model` is linearised where it stands,
/// and simulated from there to the next sample.
///
/// A linear model of friction that turns its sign within a sample holds for that sample only if the winch turns as it does there. Along
/// a line through the data it does not; here each step begins where the model itself has come, put right by what was just measured.
/// Commands before a sample are not known to its simulation, so a dead time acts as if there were none: it is a place to begin.
///
/// # Errors
/// When the model cannot be simulated from where a sample leaves it.
pub(crate) fn forward(
    model: &Examined,
    trial: &Trial,
    first: &[f64],
    randomness: &Randomness,
) -> Result<Trajectory, FitError> {
    let (n, len) = (model.states(), trial.len());
    let width = n + model.latents();
    let (on_time, late) = on_time(model, trial, &randomness.late);
    let mut values = vec![0.0; len * width];
    let mut row = vec![0.0; width];
    row[..n].copy_from_slice(first);
    let (moving, mut standing) = (Moving::all(model), None::<Standing>);
    for k in 0..len - 1 {
        let part = on_time.part(k..k + 2, trial.name.clone());
        let interval = trial.time[k + 1] - trial.time[k];
        // Where the next sample is to first order: what is late shows how fast it changes. All of its latents are a deviation.
        let mut two = [&row[..], &row[..n], &vec![0.0; width - n]].concat();
        moving.iter().for_each(|moving| two[width + moving.position] += interval * row[moving.rate]);
        let linear = linearise(model, &part, &Trajectory { values: two, width, states: n }, first, &late)?;
        let mut run = Run::new(&linear, randomness);
        if let Some(standing) = standing {
            run.standing = standing;
        }
        run.standing.next = 0;
        let filtered = run.advance(1, Keep::Innovations);
        row.iter_mut().zip(filtered.updated(0)).for_each(|(value, deviation)| *value += deviation);
        values[k * width..(k + 1) * width].copy_from_slice(&row);
        let mut simulation = model.simulation(trial, k, &row[..n]);
        disturb(&mut simulation, &trial.inputs[k], &row[n..]);
        simulation.advance(interval).map_err(FitError::Simulation)?;
        row[..n].copy_from_slice(simulation.states());
        row[n..].copy_from_slice(&run.standing.x[n..width]);
        run.standing.x[..width].fill(0.0);
        standing = Some(run.standing);
    }
    values[(len - 1) * width..].copy_from_slice(&row);
    Ok(Trajectory { values, width, states: n })
}

/// A trial with what late channels show in the row of the sample that it was so at, and how late they are from there (s).
fn on_time(model: &Examined, trial: &Trial, late: &[f64]) -> (Trial, Vec<f64>) {
    let mut on_time = trial.clone();
    let interval = trial.interval();
    let rest = late.iter().enumerate().map(|(j, late)| {
        let by_model = model.late(trial.channels[j]);
        let clock = Clock::new(late + by_model, interval);
        for (k, row) in on_time.measured.iter_mut().enumerate() {
            row[j] = clock.row(k, trial.len()).map_or(f64::NAN, |from| trial.measured[from][j]);
        }
        clock.within(interval) - by_model
    });
    let rest = rest.collect();
    (on_time, rest)
}

#[cfg(test)]
mod tests {
    use cdpr::effect::EffectSpec;

    use super::*;
    use crate::data::recording::{Bench, fitted, fitted_on, record, record_on};
    use crate::filter::estimate::{Fit, for_trial};

    /// How far the positions of a trajectory are from what the filter knows along another one, two seconds after the start and later,
    /// in standard deviations of this, at most. Cables that ring go on for longer.
    fn distance(fit: &Fit, trial: &Trial, trajectory: &Trajectory) -> f64 {
        let randomness = for_trial(&fit.randomness, trial);
        let linear = fit.linear(std::slice::from_ref(trial));
        let filtered = Run::new(&linear[0], &randomness).advance(trial.len(), Keep::Covariance);
        let rows = trajectory.states + randomness.processes();
        let lengths = (0..fit.examined.plant.cables()).filter_map(|i| fit.examined.plant.unstretched_index(i));
        let positions: Vec<usize> = (0..3).chain(lengths).collect();
        let of_sample = |k: usize| {
            let (own, known) = (fit.trajectories[0].row(k), filtered.updated(k));
            let off = |c: usize| (own[c] + known[c] - trajectory.row(k)[c]).abs();
            let deviation = |c: usize| filtered.covariance[(k * rows + c) * filtered.stride + c].sqrt();
            positions.iter().map(|c| off(*c) / deviation(*c)).fold(0.0, f64::max)
        };
        (20..trial.len() - 1).map(of_sample).fold(0.0, f64::max)
    }

    #[test]
    fn it_is_where_the_filter_is_along_the_trajectory_that_settles() {
        // A pose that is late by a sample and a third, or not.
        let late = EffectSpec::new("pose_sensor_delay", None, &[0.13]).unwrap();
        for effects in [Vec::new(), vec![late]] {
            let trials = [record(&effects, 20.0, 6)];
            let mut fit = fitted(&effects, &trials);
            fit.settle(&trials, 10).unwrap();
            let randomness = for_trial(&fit.randomness, &trials[0]);
            let begun = forward(&fit.examined, &trials[0], &fit.first[0], &randomness).unwrap();
            let apart = distance(&fit, &trials[0], &begun);
            // The start is known to a metre, where the model is not as linear as it is along the trajectory that settles.
            assert!(apart < 1.5, "{apart}");
        }
    }

    /// A loss at pulleys that turns its sign within 2 mm/s, on cables that ring: from a line through the data, whole moves and slow ones
    /// have not settled after twenty.
    #[test]
    fn friction_that_turns_its_sign_within_a_sample_settles_from_there() {
        let bench = Bench::ringing();
        let loss = EffectSpec::new("pulley_capstan_loss", None, &[0.015, 0.002]).unwrap();
        let trials = [record_on(&bench, std::slice::from_ref(&loss), 8.0, 5)];
        let mut line = fitted_on(&bench, std::slice::from_ref(&loss), &trials);
        line.randomness = line.randomness.without_latents();
        let stays = line.settle(&trials, 20).unwrap();
        let mut begun = Fit::forward(&line.model, &trials, &line.randomness).unwrap();
        begun.settle(&trials, 4).unwrap();
        assert!(begun.has_settled());
        assert!(!stays && !line.has_settled(), "the recording is too easy");
    }
}
