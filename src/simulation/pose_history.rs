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
        if !self.active() {
            return None;
        }
        let next = self.points.partition_point(|(t, _)| *t <= time);
        if next == 0 || next == self.points.len() {
            let (_, y) = if next == 0 { self.points.front()? } else { self.points.back()? };
            return Some([y[0], y[1], y[2]]);
        }
        let ((t0, a), (t1, b)) = (self.points[next - 1], self.points[next]);
        let h = t1 - t0;
        let s = (time - t0) / h;
        Some(std::array::from_fn(|k| {
            let (p0, p1, m0, m1) = (a[k], b[k], a[k + 3] * h, b[k + 3] * h);
            let (s2, s3) = (s * s, s * s * s);
            p0 * (2.0 * s3 - 3.0 * s2 + 1.0) + m0 * (s3 - 2.0 * s2 + s) + p1 * (3.0 * s2 - 2.0 * s3) + m1 * (s3 - s2)
        }))
    }
}
