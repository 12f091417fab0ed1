//! How what the sensors show follows the states.

use cdpr::simulation::Simulation;

use crate::data::{Channel, Trial};
use crate::model::examined::{Examined, Moment};
use crate::model::state_size::effect_state_scale;

/// Shares of the robot's reach by which the platform and a cable's length are moved for differences.
const MOVED: f64 = 1e-3 / 900.0;
const STRETCHED: f64 = 1e-4 / 900.0;

/// Steps by which states are moved for differences: far above the integrator's error, far below curvature.
fn difference_steps(model: &Examined) -> Vec<f64> {
    let reach = model.plant.geometry().size();
    let mut steps = vec![STRETCHED * reach; model.states()];
    steps[..6].copy_from_slice(&[MOVED * reach, MOVED * reach, 1e-4, 1e-3, 1e-3, 1e-4]);
    for i in 0..model.plant.cables() {
        for at in model.plant.effect_states(i) {
            steps[at] = 1e-3 * effect_state_scale(model, i, at);
        }
    }
    steps
}

/// Slopes of what the sensors show, those that are zero all the time left out.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Slopes {
    /// The states that each channel shows anything of.
    pub(crate) shows: Vec<Vec<usize>>,
    /// Slopes by these, channel after channel and sample after sample.
    pub(crate) values: Vec<f64>,
}

impl Slopes {
    /// Of `∂h/∂x`, `channels × states` a sample.
    pub(crate) fn of(all: &[f64], channels: usize, states: usize) -> Self {
        let rows = |j: usize| all.chunks_exact(states).skip(j).step_by(channels);
        let shows = |j: usize| (0..states).filter(|c| rows(j).any(|slopes| slopes[*c] != 0.0)).collect();
        let shows: Vec<Vec<usize>> = (0..channels).map(shows).collect();
        let of_row = |(at, slopes)| -> Vec<f64> {
            let slopes: &[f64] = slopes;
            let at: usize = at;
            shows[at % channels].iter().map(|c| slopes[*c]).collect()
        };
        Self { values: all.chunks_exact(states).enumerate().flat_map(of_row).collect(), shows }
    }

    /// Those of parts of a trial that follow one another.
    pub(crate) fn joined(parts: Vec<Self>) -> Self {
        let mut shows = parts.first().map_or_else(Vec::new, |part| part.shows.clone());
        for part in &parts {
            for (all, own) in shows.iter_mut().zip(&part.shows) {
                all.extend(own);
                all.sort_unstable();
                all.dedup();
            }
        }
        let mut values = Vec::with_capacity(parts.iter().map(|part| part.values.len()).sum());
        for part in parts {
            if part.shows == shows {
                values.extend(part.values);
                continue;
            }
            let mut own = part.values.iter();
            let samples = part.values.len() / part.shows.iter().map(Vec::len).sum::<usize>().max(1);
            for _ in 0..samples {
                for (all, shown) in shows.iter().zip(&part.shows) {
                    let slope = |c: &usize| if shown.contains(c) { own.next().copied().unwrap_or(0.0) } else { 0.0 };
                    values.extend(all.iter().map(slope));
                }
            }
        }
        Self { shows, values }
    }
}

/// How the sensors follow the states, by differences.
pub(crate) struct SensorSlopes<'a> {
    model: &'a Examined,
    channels: &'a [Channel],
    steps: Vec<f64>,
    moved: Vec<f64>,
    shown: Vec<f64>,
}

impl<'a> SensorSlopes<'a> {
    pub(crate) fn new(model: &'a Examined, trial: &'a Trial) -> Self {
        Self { model, channels: &trial.channels, steps: difference_steps(model), moved: Vec::new(), shown: Vec::new() }
    }

    /// Writes `∂h/∂x` at a moment at which the sensors show `shown`.
    pub(crate) fn at(&mut self, simulation: &Simulation, moment: &Moment<'_>, shown: &[f64], slopes: &mut [f64]) {
        let n = moment.y.len();
        for c in 0..n {
            self.moved.clear();
            self.moved.extend_from_slice(moment.y);
            self.moved[c] += self.steps[c];
            let moved = Moment { y: &self.moved, ..*moment };
            self.model.measure_at(simulation, &moved, self.channels, &mut self.shown);
            for (j, (moved, shown)) in self.shown.iter().zip(shown).enumerate() {
                slopes[j * n + c] = (moved - shown) / self.steps[c];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use cdpr::effect::EffectSpec;
    use cdpr::model_file::Model;

    use super::*;
    use crate::data::recording::record;

    #[test]
    fn plain_slopes_of_sensors_are_those_by_differences() {
        let scale = EffectSpec::new("length_sensor_scale", Some(3), &[0.01]).unwrap();
        let anchor = EffectSpec::new("anchor_offset", Some(1), &[1.0, -2.0]).unwrap();
        for rigid in [false, true] {
            let mut model = Model { effects: vec![scale.clone(), anchor.clone()], ..Model::default() };
            if rigid {
                model.parameters.cable_model = cdpr::parameters::CableModel::Rigid;
            }
            let examined = Examined::new(&model).unwrap();
            let mut trial = record(&[], 1.0, 5);
            trial.channels = (0..3).map(Channel::Pose).chain((0..4).map(Channel::CableLength)).collect();
            trial.channels.extend((0..4).map(Channel::UnstretchedLength));
            let (n, m) = (examined.states(), trial.channels.len());
            let mut x = vec![0.0; n];
            x[..6].copy_from_slice(&[3.0, -4.0, 0.05, 0.2, -0.1, 0.01]);
            (0..4).filter_map(|i| examined.plant.unstretched_index(i)).for_each(|at| x[at] = 636.0);
            let simulation = examined.simulation(&trial, 0, &x);
            let (felt, slack) = (simulation.inputs_at_plant(), simulation.slack());
            let (mut shown, mut plain, mut other) = (Vec::new(), vec![1.0; n * m], vec![0.0; n * m]);
            let moment = Moment { time: 0.0, y: &x, felt: &felt, slack };
            let e = examined.measure_at(&simulation, &moment, &trial.channels, &mut shown);
            assert!(examined.sensor_slopes(0.0, &e, &trial.channels, &mut plain));
            SensorSlopes::new(&examined, &trial).at(&simulation, &moment, &shown, &mut other);
            for (at, (plain, other)) in plain.iter().zip(&other).enumerate() {
                let (channel, state) = (trial.channels[at / n], at % n);
                assert!((plain - other).abs() < 1e-3 * (1.0 + other.abs()), "{channel:?} by {state}: {plain} {other}");
            }
        }
    }

    #[test]
    fn slopes_of_parts_are_those_of_the_whole() {
        // Two channels and three states; the second state shows later on, the third never.
        let all = [1.0, 0.0, 0.0, 0.0, 0.5, 0.0, 2.0, 0.0, 0.0, 0.0, 0.25, 0.0, 3.0, 4.0, 0.0, 0.0, 0.125, 0.0];
        let whole = Slopes::of(&all, 2, 3);
        assert_eq!(whole.shows, [vec![0, 1], vec![1]]);
        assert_eq!(whole.values, [1.0, 0.0, 0.5, 2.0, 0.0, 0.25, 3.0, 4.0, 0.125]);
        let parts = [&all[..12], &all[12..]].map(|part| Slopes::of(part, 2, 3));
        assert_eq!(parts[0].shows, [vec![0], vec![1]]);
        assert_eq!(Slopes::joined(parts.to_vec()), whole);
    }
}
