//! Where friction turns within sampling intervals, by the integrator's own steps.

use crate::hypothesis::friction::turning_speed;
use crate::model::examined::Examined;

/// The winches whose friction turns its sign: the place of their rates among the states, and over which speed (m/s) it does.
pub(super) struct Turning(Vec<(usize, f64)>);

/// Share of a friction by which it may turn within a part of a step, whose slopes are then on a line.
const MOST_TURNED: f64 = 0.25;

impl Turning {
    pub(super) fn of(model: &Examined) -> Self {
        let plant = &model.plant;
        let of_cable = |i: usize| {
            let speeds = plant.effects().iter().filter(|effect| effect.cable.is_none_or(|cable| cable == i + 1));
            let speed = speeds.filter_map(turning_speed).reduce(f64::min)?;
            Some((plant.rate_index(i)?, speed))
        };
        Self((0..plant.cables()).filter_map(of_cable).collect())
    }

    /// Whether friction turns by more than it may between two points.
    fn turns(&self, from: &[f64], to: &[f64]) -> bool {
        let turned = |(at, speed): &(usize, f64)| ((to[*at] / speed).tanh() - (from[*at] / speed).tanh()).abs();
        self.0.iter().any(|winch| turned(winch) > MOST_TURNED)
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
    pub(super) fn push(&mut self, from: &[f64], path: &[f64], turning: &Turning) {
        if !turning.0.is_empty() {
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
