//! What a sensor of the pose shows.

use crate::scalar::Real;

/// A sensor of the pose: `p = G + R(φ) point` as seen in a frame that is turned by `angle` about the origin and in which lengths
/// are `1 + stretch` times as long, and `φ - angle`, each with a bias.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PoseSensor {
    /// Bias of what is shown, `[x, y, φ]` (m, rad).
    pub bias: [f64; 3],
    /// Angle `θ` (rad) by which its frame is turned counter-clockwise against the fixed frame.
    pub angle: f64,
    /// Relative error (1) of the lengths that it shows.
    pub stretch: f64,
    /// The point whose position it measures, in the body frame, from G (m).
    pub point: [f64; 2],
}

/// A vector turned by an angle (rad).
fn turned<S: Real>([x, y]: [S; 2], angle: S) -> [S; 2] {
    let (sin, cos) = angle.sin_cos();
    [x * cos - y * sin, x * sin + y * cos]
}

impl PoseSensor {
    /// Whether it shows the coordinates of G in the fixed frame, biases aside: each by itself.
    pub fn is_plain(&self) -> bool {
        self.angle == 0.0 && self.stretch == 0.0 && self.point == [0.0; 2]
    }

    fn arm<S: Real>(&self, phi: S) -> [S; 2] {
        turned(self.point.map(S::from), phi)
    }

    fn in_frame<S: Real>(&self, vector: [S; 2]) -> [S; 2] {
        turned(vector, S::from(-self.angle)).map(|v| v * S::from(1.0 + self.stretch))
    }

    /// What it shows of this pose.
    #[inline]
    pub fn shown<S: Real>(&self, pose: &[S; 3]) -> [S; 3] {
        let bias = self.bias;
        if self.is_plain() {
            return std::array::from_fn(|k| pose[k] + bias[k]);
        }
        let arm = self.arm(pose[2]);
        let [x, y] = self.in_frame([pose[0] + arm[0], pose[1] + arm[1]]);
        [x + bias[0], y + bias[1], pose[2] - self.angle + bias[2]]
    }

    /// The rate of what it shows, from pose and its rate.
    #[inline]
    pub fn shown_rate<S: Real>(&self, pose: &[S; 3], rate: &[S; 3]) -> [S; 3] {
        if self.is_plain() {
            return *rate;
        }
        let arm = self.arm(pose[2]);
        let [x, y] = self.in_frame([rate[0] - rate[2] * arm[1], rate[1] + rate[2] * arm[0]]);
        [x, y, rate[2]]
    }

    /// The pose of which it shows this.
    pub fn behind(&self, shown: &[f64; 3]) -> [f64; 3] {
        let [x, y, phi] = std::array::from_fn(|k| shown[k] - self.bias[k]);
        if self.is_plain() {
            return [x, y, phi];
        }
        let phi = phi + self.angle;
        let scale = 1.0 / (1.0 + self.stretch);
        let ([x, y], arm) = (turned([x * scale, y * scale], self.angle), self.arm(phi));
        [x - arm[0], y - arm[1], phi]
    }

    /// How the pose changes with what is shown on `axis`, at this pose.
    pub(crate) fn behind_by(&self, axis: usize, phi: f64) -> [f64; 3] {
        let arm = self.arm(phi);
        let (sin, cos) = self.angle.sin_cos();
        let (sin, cos) = (sin / (1.0 + self.stretch), cos / (1.0 + self.stretch));
        [[cos, sin, 0.0], [-sin, cos, 0.0], [arm[1], -arm[0], 1.0]][axis]
    }
}
