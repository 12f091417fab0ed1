//! Where the cables begin and end.

use crate::parameters::{CABLES, ParameterError, Parameters};

/// Anchors in the fixed frame and attachment points in the body frame, equations (2) and (30).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Geometry {
    /// `A_i` (m), fixed frame.
    pub anchor: [[f64; 2]; CABLES],
    /// `B_i` (m), body frame with origin G.
    pub attachment: [[f64; 2]; CABLES],
}

impl Geometry {
    /// The circles of Table I.
    pub fn new(parameters: &Parameters) -> Self {
        let on_circle = |radius: f64, angle: f64| [radius * angle.cos(), radius * angle.sin()];
        Self {
            anchor: parameters.anchor_angle.map(|a| on_circle(parameters.anchor_radius, a)),
            attachment: parameters.attachment_angle.map(|a| on_circle(parameters.attachment_radius, a)),
        }
    }

    /// Largest distance of an anchor from the origin (m).
    pub fn size(&self) -> f64 {
        self.anchor.iter().map(|a| a[0].hypot(a[1])).fold(0.0, f64::max)
    }

    /// A length (m) that makes angles comparable with displacements: the largest arm, at least a thousandth of the size.
    pub fn attachment_scale(&self) -> f64 {
        self.attachment.iter().map(|b| b[0].hypot(b[1])).fold(1e-3 * self.size(), f64::max)
    }

    /// Checks a pose: the attachment points inside the anchors' polygon, no cable through the platform.
    ///
    /// # Errors
    /// Names the coordinate or cable, what was found and what was expected.
    pub fn check_pose(&self, pose: &[f64; 3]) -> Result<(), ParameterError> {
        for (name, value) in ["x", "y", "phi"].into_iter().zip(pose) {
            if !value.is_finite() {
                return Err(ParameterError::new(name, value, "a finite number"));
            }
        }
        let [sin, cos] = [pose[2].sin(), pose[2].cos()];
        let points = self.attachment.map(|b| [pose[0] + cos * b[0] - sin * b[1], pose[1] + sin * b[0] + cos * b[1]]);
        let hull = convex_hull(&self.anchor);
        for (i, p) in points.iter().enumerate() {
            if !strictly_inside(&hull, *p) {
                return Err(ParameterError::new(
                    "pose",
                    format!("[{}, {}, {}]", pose[0], pose[1], pose[2]),
                    format!(
                        "a pose inside the anchors; attachment point {} is at ({:.3}, {:.3}) m, outside their polygon",
                        i + 1,
                        p[0],
                        p[1]
                    ),
                ));
            }
        }
        let platform = convex_hull(&points);
        for i in 0..CABLES {
            if enters(&platform, self.anchor[i], points[i]) {
                return Err(ParameterError::new(
                    "pose",
                    format!("[{}, {}, {}]", pose[0], pose[1], pose[2]),
                    format!("cables clear of the platform; cable {} runs through it", i + 1),
                ));
            }
        }
        Ok(())
    }
}

impl Geometry {
    /// Whether every attachment point lies inside the polygon of the anchors at `pose` (m, rad). Does not allocate.
    pub fn holds(&self, pose: &[f64; 3]) -> bool {
        let [sin, cos] = [pose[2].sin(), pose[2].cos()];
        // The convex hull of four points is the union of their triangles.
        let triangles = [[0, 1, 2], [2, 3, 0], [1, 2, 3], [3, 0, 1]].map(|t| t.map(|i: usize| self.anchor[i]));
        self.attachment.iter().all(|b| {
            let p = [pose[0] + cos * b[0] - sin * b[1], pose[1] + sin * b[0] + cos * b[1]];
            triangles.iter().any(|[u, v, w]| {
                let sides = [cross(*u, *v, p), cross(*v, *w, p), cross(*w, *u, p)];
                cross(*u, *v, *w) != 0.0 && (sides.iter().all(|s| *s >= 0.0) || sides.iter().all(|s| *s <= 0.0))
            })
        })
    }
}

fn cross(o: [f64; 2], a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0])
}

/// Convex hull, counter-clockwise, by Andrew's monotone chain.
fn convex_hull(points: &[[f64; 2]; CABLES]) -> Vec<[f64; 2]> {
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let half = |points: &mut dyn Iterator<Item = [f64; 2]>| {
        let mut chain: Vec<[f64; 2]> = Vec::new();
        for p in points {
            while chain.len() >= 2 && cross(chain[chain.len() - 2], chain[chain.len() - 1], p) <= 0.0 {
                chain.pop();
            }
            chain.push(p);
        }
        chain.pop();
        chain
    };
    let mut hull = half(&mut sorted.iter().copied());
    hull.extend(half(&mut sorted.iter().rev().copied()));
    hull
}

fn strictly_inside(hull: &[[f64; 2]], p: [f64; 2]) -> bool {
    hull.len() >= 3 && (0..hull.len()).all(|k| cross(hull[k], hull[(k + 1) % hull.len()], p) > 0.0)
}

/// Whether the segment from `anchor` to the hull's vertex `end` passes through the hull's inside before its end.
fn enters(hull: &[[f64; 2]], anchor: [f64; 2], end: [f64; 2]) -> bool {
    if hull.len() < 3 {
        return false;
    }
    // A point a little before the end is inside exactly when the segment arrives from inside the convex hull.
    let near = [end[0] + 1e-6 * (anchor[0] - end[0]), end[1] + 1e-6 * (anchor[1] - end[1])];
    strictly_inside(hull, near)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pose_is_held_exactly_where_it_is_inside_the_anchors() {
        let turned = Parameters { anchor_angle: [-2.0, 0.9, -0.6, 2.2], ..Parameters::default() };
        for parameters in [Parameters::default(), turned] {
            let geometry = Geometry::new(&parameters);
            let hull = convex_hull(&geometry.anchor);
            let mut held = 0;
            for k in 0..2000_u32 {
                let at = |factor: f64| 2.0 * (f64::from(k) * factor).fract() - 1.0;
                let pose = [1000.0 * at(0.618_034), 1000.0 * at(0.754_878), 3.0 * at(0.569_840)];
                let [sin, cos] = [pose[2].sin(), pose[2].cos()];
                let inside = geometry.attachment.iter().all(|b| {
                    strictly_inside(&hull, [pose[0] + cos * b[0] - sin * b[1], pose[1] + sin * b[0] + cos * b[1]])
                });
                assert_eq!(geometry.holds(&pose), inside, "{pose:?}");
                held += u32::from(inside);
            }
            assert!((400..1600).contains(&held), "{held}");
        }
    }
}
