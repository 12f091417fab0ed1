//! Signatures: what a variation of the model would add to the states at each step and to the sensors at each sample.

use cdpr::dynamics::Inputs;
use cdpr::effect::EffectSpec;
use cdpr::model_file::Model;
use rayon::prelude::*;

use crate::data::{Channel, Trial};
use crate::kalman::Forcing;
use crate::late::{comes_late, late_forcing};
use crate::model::{Examined, LATENTS, disturb};
use crate::path::{LinearTrial, Trajectory};

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

/// Where the base plant, at each point of the trajectory, goes in one step, what its sensors show, its inputs as felt, and
/// its rates at both ends of each step.
struct Reference {
    next: Vec<f64>,
    shown: Vec<f64>,
    felt: Vec<Inputs>,
    slack: Vec<[bool; 4]>,
    rates: [Vec<f64>; 2],
}

/// Inputs felt during step `k`, and slack cables at its beginning.
fn conditions(simulation: &cdpr::simulation::Simulation) -> (Inputs, [bool; 4]) {
    let felt = simulation.inputs_at_plant();
    let slack = simulation.plant().slack_cables(simulation.time(), simulation.states(), &felt);
    (felt, slack)
}

fn reference(model: &Examined, trial: &Trial, trajectory: &Trajectory) -> Option<Reference> {
    let (n, m) = (model.states(), trial.channels.len());
    let steps = trial.len() - 1;
    let mut out = Reference {
        next: vec![0.0; steps * n],
        shown: vec![0.0; trial.len() * m],
        felt: Vec::with_capacity(trial.len()),
        slack: Vec::with_capacity(trial.len()),
        rates: [vec![0.0; steps * n], vec![0.0; steps * n]],
    };
    let mut simulation = model.simulation(trial, trajectory.states(0));
    let mut shown = Vec::new();
    for k in 0..trial.len() {
        simulation.nudge_states(trajectory.states(k));
        disturb(&mut simulation, &trial.inputs[k], trajectory.latents(k));
        model.measure(&simulation, &trial.channels, &mut shown);
        out.shown[k * m..(k + 1) * m].copy_from_slice(&shown);
        let (felt, slack) = conditions(&simulation);
        out.felt.push(felt);
        out.slack.push(slack);
        if k + 1 < trial.len() {
            for (end, rates) in out.rates.iter_mut().enumerate() {
                let (time, y) = (trial.time[k + end], trajectory.states(k + end));
                model.plant.rates(time, y, &felt, slack, &mut rates[k * n..(k + 1) * n]);
            }
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

/// Whether a variation acts through the rates of the states the base plant has, so that its forcing over a step follows
/// from the rates at both ends.
fn acts_through_rates(id: &str) -> bool {
    !(comes_late(id) || matches!(id, "cable_elasticity" | "cable_transverse_mode"))
}

/// Whether a variation only changes what the sensors show.
fn is_of_sensors(id: &str) -> bool {
    matches!(id, "length_sensor_bias" | "length_sensor_scale" | "pose_sensor_bias" | "pose_sensor_delay")
}

/// Whether a variation changes what the sensors show of the same states.
fn acts_on_sensors(id: &str, trial: &Trial, rigid: bool) -> bool {
    matches!(id, "anchor_offset" | "attachment_offset")
        || is_of_sensors(id)
        || (shows_tension(trial) && (rigid || id.starts_with("cable_")))
}

fn shows_tension(trial: &Trial) -> bool {
    trial.channels.iter().any(|c| matches!(c, Channel::Tension(_)))
}

/// As [`single`], by the trapezoidal rule on the difference of rates: an order faster, good to a few per cent where the
/// fastest mode turns by less than a radian in a sampling interval. Own states of the variation follow by the same rule, so
/// they must be slow. For weighing candidates, not for estimates.
fn quick(
    base: &Examined,
    varied: &Examined,
    linear: &LinearTrial,
    trial: &Trial,
    trajectory: &Trajectory,
    reference: &Reference,
    [plant, sensors]: [bool; 2],
) -> Option<Single> {
    let (n, m, w) = (base.states(), trial.channels.len(), linear.width());
    let mut out = Single { step: vec![0.0; (trial.len() - 1) * n], sensor: vec![0.0; trial.len() * m] };
    let map = state_map(base, varied)?;
    let mut y = varied.first_states(trial);
    start_effect_states(varied, trial, &mut y, base);
    let own: Vec<usize> = (0..y.len()).filter(|at| !map.contains(at)).collect();
    let simulation = varied.simulation(trial, &y);
    let mut shown = Vec::new();
    let mut rates = [vec![0.0; y.len()], vec![0.0; y.len()]];
    let take = |y: &mut [f64], k: usize| map.iter().zip(trajectory.states(k)).for_each(|(at, value)| y[*at] = *value);
    for k in 0..trial.len() {
        let (felt, slack) = (&reference.felt[k], reference.slack[k]);
        take(&mut y, k);
        if sensors {
            let e = varied.plant.evaluate(trial.time[k], &y, felt, slack);
            varied.measure_at(&simulation, &e, &y, &trial.channels, &mut shown);
            for j in 0..m {
                out.sensor[k * m + j] = (shown[j] - reference.shown[k * m + j]) as f32;
            }
        }
        if !plant || k + 1 == trial.len() {
            continue;
        }
        let half = 0.5 * linear.interval[k];
        let target = &mut out.step[k * n..(k + 1) * n];
        varied.plant.rates(trial.time[k], &y, felt, slack, &mut rates[0]);
        for c in 3..n {
            let difference = rates[0][map[c]] - reference.rates[0][k * n + c];
            if difference != 0.0 {
                let f = &linear.transition[k * n * w..(k + 1) * n * w];
                for (r, slot) in target.iter_mut().enumerate() {
                    *slot += (half * f[r * w + c] * difference) as f32;
                }
            }
        }
        take(&mut y, k + 1);
        own.iter().for_each(|at| y[*at] += 2.0 * half * rates[0][*at]);
        varied.plant.rates(trial.time[k + 1], &y, felt, slack, &mut rates[1]);
        own.iter().for_each(|at| y[*at] += half * (rates[1][*at] - rates[0][*at]));
        for (r, slot) in target.iter_mut().enumerate() {
            *slot += (half * (rates[1][map[r]] - reference.rates[1][k * n + r])) as f32;
        }
    }
    out.step.iter().chain(&out.sensor).all(|v| v.is_finite()).then_some(out)
}

/// Own states of a variation at rest, as at the start of a simulation.
fn start_effect_states(varied: &Examined, trial: &Trial, y: &mut [f64], base: &Examined) {
    let mut rest = varied.first_states(trial);
    rest[..6].copy_from_slice(&y[..6]);
    varied.plant.straighten(&mut rest);
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
    linear: &LinearTrial,
    trial: &Trial,
    trajectory: &Trajectory,
) -> Forcing {
    let (n, m, len, columns) = (base.states(), trial.channels.len(), trial.len(), variations.len());
    debug_assert_eq!(trajectory.width, n + LATENTS);
    let mut forcing =
        Forcing { columns, step: vec![0.0; (len - 1) * n * columns], sensor: vec![0.0; len * m * columns] };
    let Some(reference) = reference(base, trial, trajectory) else { return forcing };
    let singles: Vec<Option<Single>> = variations
        .par_iter()
        .map(|spec| {
            let mut varied = model.clone();
            varied.effects.push(spec.clone());
            if comes_late(&spec.id) && !shows_tension(trial) {
                let felt = |k: usize, cable: usize| reference.felt[k].winch_force[cable];
                let step = late_forcing(spec, linear, trial, trajectory, felt);
                return Some(Single { step, sensor: vec![0.0; len * m] });
            }
            Examined::new(&varied).ok().and_then(|v| {
                if acts_through_rates(&spec.id) {
                    let sensors = acts_on_sensors(&spec.id, trial, base.plant.unstretched_index(0).is_none());
                    let acts = [!is_of_sensors(&spec.id), sensors];
                    quick(base, &v, linear, trial, trajectory, &reference, acts)
                } else {
                    single(base, &v, trial, trajectory, &reference)
                }
            })
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
    let mut forcing =
        Forcing { columns, step: vec![0.0; (len - 1) * n * columns], sensor: vec![0.0; len * m * columns] };
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::{fitted, record};

    /// Forcing without a simulation of its own, against the difference of two simulations.
    #[test]
    fn quick_forcing_is_that_of_a_simulation() {
        let trials = [record(&[], 30.0, 3)];
        let fit = fitted(&[], &trials);
        let (base, trial, trajectory) = (&fit.examined, &trials[0], &fit.trajectories[0]);
        let reference = reference(base, trial, trajectory).unwrap();
        let late: [(&str, &[f64]); 4] = [
            ("winch_lag", &[0.2]),
            ("winch_delay", &[0.15]),
            ("cable_creep", &[3e8, 2.0]),
            ("cable_creep", &[3e8, 10.0]),
        ];
        for (id, values) in late {
            let spec = EffectSpec::new(id, Some(2), values).unwrap();
            let quick = forcing(&fit.model, base, std::slice::from_ref(&spec), &fit.linear[0], trial, trajectory);
            let varied = Model { effects: vec![spec], ..fit.model.clone() };
            let varied = Examined::new(&varied).unwrap();
            let whole = single(base, &varied, trial, trajectory, &reference).unwrap();
            let product = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| f64::from(a * b)).sum::<f64>();
            let (own, other) = (product(&quick.step, &quick.step), product(&whole.step, &whole.step));
            let alike = product(&quick.step, &whole.step) / (own * other).sqrt();
            assert!(alike > 0.97, "{id} {values:?}: correlation {alike}");
            // At this sampling rate the fastest mode turns by more than a radian in an interval.
            assert!((0.8..1.25).contains(&(own / other).sqrt()), "{id} {values:?}: {own} {other}");
        }
    }
}
