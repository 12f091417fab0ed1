//! Whether the platform is where it may be, told at a glance at most poses: looking at every pair of points after every step would
//! take a tenth of it.

use crate::geometry::Geometry;
use crate::per_cable::PerCable;

/// What is known of a geometry at all poses. Where that does not decide, [`Geometry::holds`] and [`Geometry::blocked_cable`] do.
#[derive(Clone, Debug)]
pub(crate) struct Clearance {
    /// Middle of the anchors (m), and how far the platform may be from it with all its points inside their polygon.
    middle: [f64; 2],
    reach: f64,
    /// At each attachment point, in the body frame, the directions (m) square to the platform's edges there, in which no other point lies
    /// farther out: a cable that leaves to one of these sides is clear of the platform. Zero where there is none.
    outward: PerCable<[[f64; 2]; 2]>,
    /// Part of a cable along `outward` (m²) that rounding may leave of none.
    rounding: f64,
}

fn apart(from: [f64; 2], to: [f64; 2]) -> [f64; 2] {
    [to[0] - from[0], to[1] - from[1]]
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

fn middle(points: &[[f64; 2]]) -> [f64; 2] {
    [0, 1].map(|axis| points.iter().map(|p| p[axis]).sum::<f64>() / points.len() as f64)
}

/// How far `from` is from the nearest line through two of `points` that has all of them on one side.
fn distance_to_border(points: &[[f64; 2]], from: [f64; 2]) -> f64 {
    let mut least = f64::INFINITY;
    for a in points {
        for b in points {
            let along = apart(*a, *b);
            let (across, length) = ([-along[1], along[0]], along[0].hypot(along[1]));
            if length > 0.0 && points.iter().all(|p| dot(across, apart(*a, *p)) >= 0.0) {
                least = least.min(dot(across, apart(*a, from)) / length);
            }
        }
    }
    if least.is_finite() { least } else { 0.0 }
}

impl Clearance {
    pub(crate) fn new(geometry: &Geometry) -> Self {
        let (anchors, points) = (&geometry.anchor, &geometry.attachment);
        let middle_of_anchors = middle(anchors);
        let arm = points.iter().map(|b| b[0].hypot(b[1])).fold(0.0, f64::max);
        let outward = points.map(|b| {
            let edges = points.iter().map(|other| apart(b, *other));
            let normals = edges.flat_map(|[x, y]| [[-y, x], [y, -x]]);
            let mut outermost =
                normals.filter(|n| *n != [0.0; 2] && points.iter().all(|r| dot(*n, apart(b, *r)) <= 0.0));
            let first = outermost.next().unwrap_or_default();
            let along_another = |n: &[f64; 2]| n[0] * first[1] != n[1] * first[0] || dot(*n, first) < 0.0;
            [first, outermost.find(along_another).unwrap_or_default()]
        });
        let size = geometry.size() + arm;
        let rounding = 1e-9 * size;
        Self {
            middle: middle_of_anchors,
            reach: distance_to_border(anchors, middle_of_anchors) - arm - rounding,
            outward,
            rounding: rounding * size,
        }
    }

    /// Whether the platform at `pose` (m, rad) stays between the anchors, where it has to, as [`Geometry::holds`] says.
    pub(crate) fn holds(&self, geometry: &Geometry, pose: &[f64; 3]) -> bool {
        let away = apart(self.middle, [pose[0], pose[1]]);
        self.reach > 0.0 && dot(away, away) < self.reach * self.reach || geometry.holds(pose)
    }

    /// The first cable (from 0) that runs through the platform at `pose` (m, rad), as [`Geometry::blocked_cable`] says.
    pub(crate) fn blocked_cable(&self, geometry: &Geometry, pose: &[f64; 3]) -> Option<usize> {
        let (sin, cos) = pose[2].sin_cos();
        let clear = |i: usize| {
            let [x, y] = apart([pose[0], pose[1]], geometry.anchor[i]);
            let cable = apart(geometry.attachment[i], [cos * x + sin * y, cos * y - sin * x]);
            self.outward[i].iter().any(|outward| dot(*outward, cable) > self.rounding)
        };
        if (0..geometry.cables()).all(clear) { None } else { geometry.blocked_cable(pose) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameters::Parameters;

    fn geometries() -> Vec<Geometry> {
        let circles = Geometry::new(&Parameters::default());
        let shaped = |attachment: [[f64; 2]; 4]| Geometry { attachment: attachment.into(), ..circles };
        vec![
            circles,
            // A dent, a point within, two points in one, a line.
            shaped([[10.0, 0.0], [0.0, 10.0], [-10.0, 0.0], [1.0, 1.0]]),
            shaped([[10.0, 0.0], [0.0, 30.0], [-10.0, 0.0], [0.0, 2.0]]),
            shaped([[10.0, 0.0], [0.0, 10.0], [10.0, 0.0], [-10.0, -10.0]]),
            shaped([[10.0, 0.0], [5.0, 0.0], [-5.0, 0.0], [-10.0, 0.0]]),
            Geometry { anchor: [[0.0, 0.0], [900.0, 10.0], [300.0, 200.0], [20.0, 500.0]].into(), ..circles },
            Geometry { anchor: [[0.0, 0.0]; 4].into(), ..circles },
        ]
    }

    #[test]
    fn what_is_told_at_a_glance_is_what_all_points_say() {
        let (mut held, mut clear, mut count) = (0, 0, 0);
        for (which, geometry) in geometries().into_iter().enumerate() {
            let clearance = Clearance::new(&geometry);
            for k in 0..20_000 {
                let draw = |step: f64| (f64::from(k) * step).fract() - 0.5;
                let pose = [1600.0 * draw(0.754_877_666), 1600.0 * draw(0.569_840_291), 7.0 * draw(0.381_966_011)];
                let (holds, blocked) = (geometry.holds(&pose), geometry.blocked_cable(&pose));
                assert_eq!(clearance.holds(&geometry, &pose), holds, "{which}: {pose:?}");
                assert_eq!(clearance.blocked_cable(&geometry, &pose), blocked, "{which}: {pose:?}");
                (held, clear) = (held + u32::from(holds), clear + u32::from(blocked.is_none()));
                count += 1;
            }
        }
        // Poses of all kinds were among them.
        assert!([held, clear].iter().all(|some| (count / 10..count - count / 10).contains(some)), "{held}, {clear}");
    }

    #[test]
    fn near_the_middle_a_glance_is_enough() {
        let clearance = Clearance::new(&Geometry::new(&Parameters::default()));
        assert!(clearance.reach > 300.0, "{clearance:?}");
        assert!(clearance.outward.iter().flatten().all(|outward| *outward != [0.0; 2]), "{clearance:?}");
    }
}
