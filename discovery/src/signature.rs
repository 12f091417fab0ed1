//! Signatures: what a variation of the model would add to the states at each step and to the sensors at each sample.

use cdpr::effect::EffectSpec;
use cdpr::model_file::Model;
use rayon::prelude::*;

use crate::data::Trial;
use crate::kalman::Forcing;
use crate::model::{Examined, LATENTS, disturb};
use crate::path::Trajectory;

/// What one variation adds: `states` numbers a step, `channels` a sample. `None` when it cannot be simulated.
struct Single {
    step: Vec<f32>,
    sensor: Vec<f32>,
}

/// Index in the varied plant of each state of the base plant.
fn state_map(base: &Examined, varied: &Examined) -> Option<Vec<usize>> {
    let mut map: Vec<usize> = (0..6).collect();
    for i in 0..4 {
        map.extend(base.plant.unstretched_index(i).map(|_| varied.plant.unstretched_index(i)).into_iter().flatten());
        map.extend(base.plant.rate_index(i).map(|_| varied.plant.rate_index(i)).into_iter().flatten());
        let start = varied.plant.effect_states(i).start;
        // New effects come last in the model, so their states come last on each cable.
        map.extend((0..base.plant.effect_states(i).len()).map(|k| start + k));
    }
    (map.len() == base.states()).then_some(map)
}

/// Where the base plant, at each point of the trajectory, goes in one step, and what its sensors show.
struct Reference {
    next: Vec<f64>,
    shown: Vec<f64>,
}

fn reference(model: &Examined, trial: &Trial, trajectory: &Trajectory) -> Option<Reference> {
    let (n, m) = (model.states(), trial.channels.len());
    let mut out = Reference { next: vec![0.0; (trial.len() - 1) * n], shown: vec![0.0; trial.len() * m] };
    let mut simulation = model.simulation(trial, trajectory.states(0));
    let mut shown = Vec::new();
    for k in 0..trial.len() {
        simulation.nudge_states(trajectory.states(k));
        disturb(&mut simulation, &trial.inputs[k], trajectory.latents(k));
        model.measure(&simulation, &trial.channels, &mut shown);
        out.shown[k * m..(k + 1) * m].copy_from_slice(&shown);
        if k + 1 < trial.len() {
            simulation.advance(trial.time[k + 1] - trial.time[k]).ok()?;
            out.next[k * n..(k + 1) * n].copy_from_slice(simulation.states());
        }
    }
    Some(out)
}

fn single(
    base: &Examined,
    varied: &Examined,
    trial: &Trial,
    trajectory: &Trajectory,
    reference: &Reference,
) -> Option<Single> {
    let map = state_map(base, varied)?;
    let (n, m) = (base.states(), trial.channels.len());
    let mut out = Single { step: vec![0.0; (trial.len() - 1) * n], sensor: vec![0.0; trial.len() * m] };
    // Own states of the varied plant begin at rest under the first sample and then follow the trajectory.
    let mut y = varied.first_states(trial);
    let mut simulation = varied.simulation(trial, &y);
    let mut shown = Vec::new();
    for k in 0..trial.len() {
        let x = trajectory.states(k);
        y.copy_from_slice(simulation.states());
        for (value, at) in x.iter().zip(&map) {
            y[*at] = *value;
        }
        if k == 0 {
            start_effect_states(varied, trial, &mut y, base);
        }
        simulation.nudge_states(&y);
        disturb(&mut simulation, &trial.inputs[k], trajectory.latents(k));
        varied.measure(&simulation, &trial.channels, &mut shown);
        for j in 0..m {
            out.sensor[k * m + j] = (shown[j] - reference.shown[k * m + j]) as f32;
        }
        if k + 1 < trial.len() {
            simulation.advance(trial.time[k + 1] - trial.time[k]).ok()?;
            for (r, at) in map.iter().enumerate() {
                out.step[k * n + r] = (simulation.states()[*at] - reference.next[k * n + r]) as f32;
            }
        }
    }
    out.step.iter().chain(&out.sensor).all(|v| v.is_finite()).then_some(out)
}

/// Own states of a variation at rest, as at the start of a simulation.
fn start_effect_states(varied: &Examined, trial: &Trial, y: &mut [f64], base: &Examined) {
    let rest = varied.first_states(trial);
    for i in 0..4 {
        let known = base.plant.effect_states(i).len();
        for at in varied.plant.effect_states(i).skip(known) {
            y[at] = rest[at];
        }
    }
}

/// The forcing of every variation (as columns, in order) along a trajectory. A variation that cannot be simulated, or is
/// no plant at all, has a column of zeros.
pub(crate) fn forcing(
    model: &Model,
    base: &Examined,
    variations: &[EffectSpec],
    trial: &Trial,
    trajectory: &Trajectory,
    done: &(dyn Fn() + Sync),
) -> Forcing {
    let (n, m, len, columns) = (base.states(), trial.channels.len(), trial.len(), variations.len());
    debug_assert_eq!(trajectory.width, n + LATENTS);
    let mut forcing = Forcing { columns, step: vec![0.0; (len - 1) * n * columns], sensor: vec![0.0; len * m * columns] };
    let Some(reference) = reference(base, trial, trajectory) else { return forcing };
    let singles: Vec<Option<Single>> = variations
        .par_iter()
        .map(|spec| {
            let mut varied = model.clone();
            varied.effects.push(spec.clone());
            let out = Examined::new(&varied).ok().and_then(|v| single(base, &v, trial, trajectory, &reference));
            done();
            out
        })
        .collect();
    for (c, single) in singles.iter().enumerate() {
        let Some(single) = single else { continue };
        for (at, value) in single.step.iter().enumerate() {
            forcing.step[at * columns + c] = *value;
        }
        for (at, value) in single.sensor.iter().enumerate() {
            forcing.sensor[at * columns + c] = *value;
        }
    }
    forcing
}

/// The forcing of a change from one model to another with the same states, scaled by `1/size`: a parameter's sensitivity.
pub(crate) fn difference(
    base: &Examined,
    varied: &[(Examined, f64)],
    trial: &Trial,
    trajectory: &Trajectory,
) -> Forcing {
    let (n, m, len, columns) = (base.states(), trial.channels.len(), trial.len(), varied.len());
    let mut forcing = Forcing { columns, step: vec![0.0; (len - 1) * n * columns], sensor: vec![0.0; len * m * columns] };
    let Some(reference) = reference(base, trial, trajectory) else { return forcing };
    let singles: Vec<Option<Single>> =
        varied.par_iter().map(|(v, _)| single(base, v, trial, trajectory, &reference)).collect();
    for (c, (single, (_, size))) in singles.iter().zip(varied).enumerate() {
        let Some(single) = single else { continue };
        let scale = (1.0 / size) as f32;
        for (at, value) in single.step.iter().enumerate() {
            forcing.step[at * columns + c] = value * scale;
        }
        for (at, value) in single.sensor.iter().enumerate() {
            forcing.sensor[at * columns + c] = value * scale;
        }
    }
    forcing
}

/// Columns as weighted sums of variations.
pub(crate) fn combine(forcing: &Forcing, combinations: &[Vec<(usize, f64)>]) -> Forcing {
    let sum = |values: &[f32]| -> Vec<f32> {
        let rows = values.len() / forcing.columns.max(1);
        let mut out = vec![0.0; rows * combinations.len()];
        for row in 0..rows {
            let from = &values[row * forcing.columns..(row + 1) * forcing.columns];
            let to = &mut out[row * combinations.len()..(row + 1) * combinations.len()];
            for (slot, combination) in to.iter_mut().zip(combinations) {
                *slot = combination.iter().map(|(at, weight)| from[*at] * *weight as f32).sum();
            }
        }
        out
    };
    Forcing { columns: combinations.len(), step: sum(&forcing.step), sensor: sum(&forcing.sensor) }
}
