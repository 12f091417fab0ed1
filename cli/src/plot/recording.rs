//! A run, kept at the resolution of a picture.

use cdpr::dynamics::Inputs;
use cdpr::simulation::Outputs;

/// More points than this are thinned out.
const MOST_POINTS: usize = 2000;

/// A quantity that is recorded.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Channel {
    /// x, y (m), φ (rad).
    Pose(usize),
    /// Winch force (N).
    WinchForce(usize),
    /// Disturbance (N, N m).
    Disturbance(usize),
    /// Tension (N).
    Tension(usize),
    /// Unstretched length (m).
    UnstretchedLength(usize),
}

impl Channel {
    /// Its place among those of a robot with `cables` cables.
    fn place(self, cables: usize) -> usize {
        match self {
            Self::Pose(k) => k,
            Self::Disturbance(k) => 3 + k,
            Self::WinchForce(i) => 6 + i,
            Self::Tension(i) => 6 + cables + i,
            Self::UnstretchedLength(i) => 6 + 2 * cables + i,
        }
    }
}

/// The quantities of a run over time; however long the run, of limited size, with every peak in it.
pub(crate) struct Recording {
    traces: Vec<Trace>,
    cables: usize,
}

impl Recording {
    /// An empty one, of a robot with `cables` cables.
    pub(crate) fn new(cables: usize) -> Self {
        Self { traces: vec![Trace::default(); 6 + 3 * cables], cables }
    }

    /// Number of cables.
    pub(crate) fn cables(&self) -> usize {
        self.cables
    }

    /// Adds an instant.
    pub(crate) fn add(&mut self, time: f64, inputs: &Inputs, outputs: &Outputs) {
        let mut put = |channel: Channel, value: f64| self.traces[channel.place(self.cables)].add([time, value]);
        for k in 0..3 {
            put(Channel::Pose(k), outputs.pose[k]);
            put(Channel::Disturbance(k), inputs.disturbance[k]);
        }
        for i in 0..self.cables {
            put(Channel::WinchForce(i), inputs.winch_force[i]);
            put(Channel::Tension(i), outputs.tension[i]);
            put(Channel::UnstretchedLength(i), outputs.unstretched_length[i]);
        }
    }

    /// Time (s) and value of a quantity.
    pub(crate) fn points(&self, channel: Channel) -> Vec<[f64; 2]> {
        self.traces[channel.place(self.cables)].points()
    }
}

/// One quantity: the lowest and highest point of every stretch of `per_stretch` samples.
#[derive(Clone, Default)]
struct Trace {
    points: Vec<[f64; 2]>,
    /// The points of the stretch that is being filled: at most the first, the lowest, the highest and the last.
    stretch: Vec<[f64; 2]>,
    count: usize,
    doublings: u32,
}

impl Trace {
    fn add(&mut self, point: [f64; 2]) {
        self.stretch.push(point);
        self.count += 1;
        if self.stretch.len() > 4 {
            self.stretch = extremes(&self.stretch);
            self.stretch.push(point);
        }
        if self.count >= 1 << self.doublings {
            let stretch = std::mem::take(&mut self.stretch);
            self.points.extend(if stretch.len() > 2 { extremes(&stretch) } else { stretch });
            self.count = 0;
        }
        if self.points.len() > MOST_POINTS {
            let first = self.points[0];
            self.points = self.points.chunks(4).flat_map(extremes).collect();
            self.points[0] = first;
            self.doublings += 1;
        }
    }

    fn points(&self) -> Vec<[f64; 2]> {
        let mut points = self.points.clone();
        points.extend(&self.stretch);
        points.dedup_by_key(|p| p[0]);
        points
    }
}

/// Lowest and highest point, in order of time.
fn extremes(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let by_value = |a: &&[f64; 2], b: &&[f64; 2]| a[1].total_cmp(&b[1]);
    let mut found: Vec<[f64; 2]> =
        [points.iter().min_by(by_value), points.iter().max_by(by_value)].into_iter().flatten().copied().collect();
    found.sort_by(|a, b| a[0].total_cmp(&b[0]));
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_runs_are_kept_whole_and_long_ones_keep_their_peaks() {
        let mut trace = Trace::default();
        (0..1000).for_each(|k| trace.add([f64::from(k), f64::from(k % 7)]));
        assert_eq!(trace.points().len(), 1000);
        let mut trace = Trace::default();
        for k in 0..300_000 {
            trace.add([f64::from(k), if k == 123_456 { 9.0 } else { f64::from(k % 100) * 0.01 }]);
        }
        let points = trace.points();
        assert!(points.len() <= MOST_POINTS + 4, "{}", points.len());
        assert!(points.contains(&[123_456.0, 9.0]));
        assert_eq!(points[0], [0.0, 0.0]);
        assert!(points.is_sorted_by(|a, b| a[0] < b[0]));
    }
}
