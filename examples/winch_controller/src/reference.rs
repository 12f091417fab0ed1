//! Where the platform should be: a point, or a circle around it that starts and grows smoothly.

use std::f64::consts::TAU;

/// Pose, twist and acceleration, each in x, y (m, s) and φ (rad, s).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motion {
    /// `[x, y, φ]`.
    pub pose: [f64; 3],
    /// Its rate.
    pub twist: [f64; 3],
    /// Its second rate.
    pub acceleration: [f64; 3],
}

/// A circle around a set point; without a radius, the set point itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reference {
    /// Set point `[x, y, φ]` (m, rad): the centre of the circle, and the orientation throughout.
    pub set_point: [f64; 3],
    /// Radius of the circle (m).
    pub radius: f64,
    /// Time of one turn (s).
    pub period: f64,
    /// Time in which the radius grows from nothing to its full size (s).
    pub ramp: f64,
}

impl Reference {
    /// The motion a time `t` (s) after the start: at rest in the set point at first, and with three smooth
    /// derivatives of the position ever after.
    #[must_use]
    pub fn at(&self, t: f64) -> Motion {
        let [r, r1, r2] = self.radius_at(t);
        let w = TAU / self.period;
        let (sin, cos) = (w * t).sin_cos();
        let [x, y, phi] = self.set_point;
        Motion {
            pose: [x + r * cos, y + r * sin, phi],
            twist: [r1 * cos - r * w * sin, r1 * sin + r * w * cos, 0.0],
            acceleration: [
                (r2 - r * w * w) * cos - 2.0 * r1 * w * sin,
                (r2 - r * w * w) * sin + 2.0 * r1 * w * cos,
                0.0,
            ],
        }
    }

    /// Radius and its two derivatives.
    fn radius_at(&self, t: f64) -> [f64; 3] {
        smooth_step(t, self.ramp).map(|share| self.radius * share)
    }
}

/// From 0 at `t = 0` to 1 at `t = time` (s), with its two derivatives: a step of fifth order, flat at both ends.
pub(crate) fn smooth_step(t: f64, time: f64) -> [f64; 3] {
    if time <= 0.0 || t >= time {
        return [1.0, 0.0, 0.0];
    }
    let s = (t / time).max(0.0);
    let value = s * s * s * (10.0 + s * (6.0 * s - 15.0));
    let slope = 30.0 * s * s * (1.0 - s) * (1.0 - s) / time;
    let bend = 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / (time * time);
    [value, slope, bend]
}

#[cfg(test)]
mod tests {
    use super::*;

    const CIRCLE: Reference = Reference { set_point: [1.0, -2.0, 0.1], radius: 5.0, period: 60.0, ramp: 20.0 };

    #[test]
    fn it_starts_at_rest_and_ends_on_the_circle() {
        let start = CIRCLE.at(0.0);
        assert_eq!(start, Motion { pose: [1.0, -2.0, 0.1], ..Motion::default() });
        for t in [20.0, 33.0, 80.0] {
            let [x, y, _] = CIRCLE.at(t).pose;
            assert!(((x - 1.0).hypot(y + 2.0) - 5.0).abs() < 1e-12);
        }
        let (a, b) = (CIRCLE.at(30.0).pose, CIRCLE.at(90.0).pose);
        assert!((a[0] - b[0]).abs() < 1e-12 && (a[1] - b[1]).abs() < 1e-12, "one turn in a period");
    }

    #[test]
    fn twist_and_acceleration_are_the_derivatives() {
        let h = 1e-4;
        for t in [0.5, 7.0, 19.9, 20.1, 45.0] {
            let (before, now, after) = (CIRCLE.at(t - h), CIRCLE.at(t), CIRCLE.at(t + h));
            for k in 0..3 {
                let twist = (after.pose[k] - before.pose[k]) / (2.0 * h);
                let acceleration = (after.twist[k] - before.twist[k]) / (2.0 * h);
                assert!((twist - now.twist[k]).abs() < 1e-8, "twist {k} at {t}");
                assert!((acceleration - now.acceleration[k]).abs() < 1e-8, "acceleration {k} at {t}");
            }
        }
    }

    #[test]
    fn without_a_radius_it_is_the_set_point() {
        let point = Reference { radius: 0.0, ..CIRCLE };
        assert_eq!(point.at(12.0).twist, [0.0; 3]);
        assert_eq!(point.at(12.0).pose, [1.0, -2.0, 0.1]);
    }
}
