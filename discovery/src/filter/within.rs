//! Where friction turns within sampling intervals, by the integrator's own steps.

use cdpr::geometry::Geometry;
use cdpr::kinematics::cables;

use crate::hypothesis::friction::turning_speed;
use crate::model::examined::Examined;

/// The winches whose friction turns its sign.
pub(super) struct Turning<'a> {
    geometry: &'a Geometry,
    winches: Vec<Winch>,
}

struct Winch {
    cable: usize,
    /// The place of its rate among the states; none where it moves as the chord does.
    rate: Option<usize>,
    /// Speed (m/s) over which its friction turns its sign.
    over: f64,
}

/// Share of a friction by which it may turn within a part of a step, whose slopes are then on a line.
const MOST_TURNED: f64 = 0.25;

impl<'a> Turning<'a> {
    pub(super) fn of(model: &'a Examined) -> Self {
        let plant = &model.plant;
        let of_cable = |cable: usize| {
            let acting = plant.effects().iter().filter(|effect| effect.cable.is_none_or(|of| of == cable + 1));
            let over = acting.filter_map(turning_speed).reduce(f64::min)?;
            Some(Winch { cable, rate: plant.rate_index(cable), over })
        };
        Self { geometry: plant.geometry(), winches: (0..plant.cables()).filter_map(of_cable).collect() }
    }

    /// Whether friction turns by more than it may between two points.
    fn turns(&self, from: &[f64], to: &[f64]) -> bool {
        self.turned(from).zip(self.turned(to)).any(|(before, after)| (after - before).abs() > MOST_TURNED)
    }

    /// How far the friction of each winch has turned at a point, from -1 to 1.
    fn turned(&self, y: &[f64]) -> impl Iterator<Item = f64> {
        let [pose, twist] = [0, 3].map(|at| std::array::from_fn(|axis| y[at + axis]));
        let chords = cables(self.geometry, &pose, &twist);
        self.winches.iter().map(move |Winch { cable, rate, over }| {
            let speed = rate.map_or(chords[*cable].speed, |at| y[at]);
            (speed / over).tanh()
        })
    }
}

/// Points within the steps from sample to sample of a trial: a time (s) and the states there, in their order.
#[derive(Clone, Debug, Default)]
pub(crate) struct Within {
    points: Vec<f64>,
    /// Where those of each step end.
    ends: Vec<usize>,
}

impl Within {
    /// Adds those of the next step: of the points that the integrator went through from a state on, the last before friction has
    /// turned by more than it may since the one before.
    pub(super) fn push(&mut self, from: &[f64], path: &[f64], turning: &Turning<'_>) {
        if !turning.winches.is_empty() {
            let (mut last, mut points) = (from, path.chunks_exact(from.len() + 1).peekable());
            while let (Some(point), Some(next)) = (points.next(), points.peek()) {
                if turning.turns(last, &next[1..]) {
                    self.points.extend_from_slice(point);
                    last = &point[1..];
                }
            }
        }
        self.ends.push(self.points.len());
    }

    /// Those of stretches of a trial that follow each other.
    pub(super) fn joined(parts: impl IntoIterator<Item = Self>) -> Self {
        let mut all = Self::default();
        for part in parts {
            let before = all.points.len();
            all.points.extend(part.points);
            all.ends.extend(part.ends.iter().map(|end| before + end));
        }
        all
    }

    /// Those of step `k`.
    pub(crate) fn step(&self, k: usize) -> &[f64] {
        &self.points[self.begin(k)..self.ends[k]]
    }

    pub(crate) fn step_mut(&mut self, k: usize) -> &mut [f64] {
        let begin = self.begin(k);
        &mut self.points[begin..self.ends[k]]
    }

    fn begin(&self, k: usize) -> usize {
        k.checked_sub(1).map_or(0, |before| self.ends[before])
    }

    pub(super) fn bytes(&self) -> usize {
        size_of_val(&self.points[..]) + size_of_val(&self.ends[..])
    }
}

#[cfg(test)]
mod tests {
    use cdpr::effect::EffectSpec;
    use cdpr::model_file::Model;
    use cdpr::parameters::{CableModel, CableParameters, Parameters};

    use super::*;

    /// A carriage on a rail, its motor's friction at work by the speed of the chord: it has no rate of its own.
    #[test]
    fn a_step_is_parted_where_friction_turns() {
        let cable = |x: f64, y: f64| CableParameters::between([x, y], [0.0, 0.0]);
        let parameters = Parameters {
            cable: vec![cable(10.0, 0.0), cable(-10.0, 0.5), cable(-10.0, -0.5)],
            cable_model: CableModel::Rigid,
            ..Parameters::default()
        };
        let friction = EffectSpec::new("winch_coulomb_friction", Some(1), &[20.0, 0.002]).expect("an effect");
        let state = |speed: f64| [0.0, 0.0, 0.0, speed, 0.0, 0.0];
        let path: Vec<f64> = [0.01, 0.002, -0.002, -0.01]
            .iter()
            .zip(1..)
            .fold(Vec::new(), |path, (speed, time)| [path, vec![f64::from(time)], state(*speed).to_vec()].concat());
        for (effects, kept) in [(vec![friction], &[2.0, 3.0][..]), (Vec::new(), &[])] {
            let model = Model { parameters: parameters.clone(), effects, ..Model::default() };
            let model = Examined::new(&model).expect("a model");
            let mut within = Within::default();
            // Once slow enough to turn, once too fast.
            within.push(&state(0.01), &path, &Turning::of(&model));
            within.push(&state(1.0), &[&[5.0][..], &state(0.9), &[6.0], &state(0.8)].concat(), &Turning::of(&model));
            let times: Vec<f64> = within.step(0).chunks_exact(7).map(|point| point[0]).collect();
            assert_eq!((&times[..], within.step(1)), (kept, &[][..]));
        }
    }
}
