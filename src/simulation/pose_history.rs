//! The poses of the recent past, for a delayed pose sensor.

use std::collections::VecDeque;

/// Pose and twist at points in time; between them a cubic through both.
#[derive(Clone, Debug)]
pub(super) struct PoseHistory {
    delay: f64,
    pub(super) points: VecDeque<(f64, [f64; 6])>,
}

impl PoseHistory {
    pub(super) fn new(delay: f64, time: f64, y: &[f64]) -> Self {
        let mut history = Self { delay, points: VecDeque::new() };
        history.push(time, y);
        history
    }

    pub(super) fn active(&self) -> bool {
        self.delay > 0.0
    }

    pub(super) fn push(&mut self, time: f64, y: &[f64]) {
        if !self.active() {
            return;
        }
        self.points.push_back((time, std::array::from_fn(|k| y[k])));
        while self.points.len() > 2 && self.points[1].0 <= time - self.delay {
            self.points.pop_front();
        }
    }

    /// The pose at `time`; before the first point the pose there. `None` when there is no history.
    pub(super) fn at(&self, time: f64) -> Option<[f64; 3]> {
        self.active().then(|| self.with_rate(time).0)
    }

    /// The rate of the pose at `time`; zero before the first point. `None` when there is no history.
    pub(super) fn rate_at(&self, time: f64) -> Option<[f64; 3]> {
        self.active().then(|| self.with_rate(time).1)
    }

    fn with_rate(&self, time: f64) -> ([f64; 3], [f64; 3]) {
        let next = self.points.partition_point(|(t, _)| *t <= time);
        if next == 0 {
            let (_, y) = self.points[0];
            return ([y[0], y[1], y[2]], [0.0; 3]);
        }
        let (t0, a) = self.points[next - 1];
        let Some((t1, b)) = self.points.get(next) else {
            return ([a[0], a[1], a[2]], [a[3], a[4], a[5]]);
        };
        let h = t1 - t0;
        let s = (time - t0) / h;
        let (s2, s3) = (s * s, s * s * s);
        let (mut pose, mut rate) = ([0.0; 3], [0.0; 3]);
        for k in 0..3 {
            let (p0, p1, m0, m1) = (a[k], b[k], a[k + 3] * h, b[k + 3] * h);
            pose[k] = p0 * (2.0 * s3 - 3.0 * s2 + 1.0)
                + m0 * (s3 - 2.0 * s2 + s)
                + p1 * (3.0 * s2 - 2.0 * s3)
                + m1 * (s3 - s2);
            rate[k] = (6.0 * (s2 - s) * (p0 - p1) + m0 * (3.0 * s2 - 4.0 * s + 1.0) + m1 * (3.0 * s2 - 2.0 * s)) / h;
        }
        (pose, rate)
    }
}
