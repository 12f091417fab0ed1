//! Where the cables begin and end.

use crate::parameters::{ParameterError, Parameters};
use crate::per_cable::PerCable;

/// Anchors in the fixed frame and attachment points in the body frame, equations (2) and (30).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Geometry {
    /// `A_i` (m), fixed frame.
    pub anchor: PerCable<[f64; 2]>,
    /// `B_i` (m), body frame with origin G.
    pub attachment: PerCable<[f64; 2]>,
    /// Radius `r_i` (m) of the pulley about `A_i` that the cable leaves on a tangent; it runs clockwise round the pulley towards
    /// the platform where `r_i > 0`, counter-clockwise where `r_i < 0`. Zero: the cable begins in `A_i`.
    pub pulley_radius: PerCable<f64>,
    /// Whether the platform must stay between the anchors, because nothing but the cables holds it; in gravity it may hang
    /// below them.
    pub between_anchors: bool,
}

impl Geometry {
    /// The points that the parameters give: coordinates, or the circles of Table I by (2) and (1) at `φ = 0`.
    pub fn new(parameters: &Parameters) -> Self {
        let circles;
        let cables = if parameters.cable.is_empty() {
            circles = parameters.on_circles();
            &circles
        } else {
            &parameters.cable
        };
        Self {
            anchor: PerCable::from_fn(cables.len(), |i| cables[i].anchor),
            attachment: PerCable::from_fn(cables.len(), |i| cables[i].attachment),
            pulley_radius: PerCable::filled(cables.len(), 0.0),
            between_anchors: parameters.gravity == [0.0; 2],
        }
    }

    /// Number of cables.
    pub fn cables(&self) -> usize {
        self.anchor.len()
    }

    /// Largest distance of an anchor from the origin (m).
    pub fn size(&self) -> f64 {
        self.anchor.iter().map(|a| a[0].hypot(a[1])).fold(0.0, f64::max)
    }

    /// A length (m) that makes angles comparable with displacements: the largest arm, at least a thousandth of the size.
    pub fn attachment_scale(&self) -> f64 {
        self.attachment.iter().map(|b| b[0].hypot(b[1])).fold(1e-3 * self.size(), f64::max)
    }

    /// Checks a pose: the attachment points inside the anchors' polygon (without gravity), no cable through the platform. The paper has
    /// no such limit; its figures stay within.
    ///
    /// # Errors
    /// Names the coordinate or cable, what was found and what was expected.
    pub fn check_pose(&self, pose: &[f64; 3]) -> Result<(), ParameterError> {
        for (name, value) in ["x", "y", "phi"].into_iter().zip(pose) {
            if !value.is_finite() {
                return Err(ParameterError::new(name, value, "a finite number"));
            }
        }
        let fail = |expected: String| {
            Err(ParameterError::new("pose", format!("[{}, {}, {}]", pose[0], pose[1], pose[2]), expected))
        };
        let points = self.attachment_points(pose);
        if self.between_anchors && !spread(&self.anchor) {
            return fail(
                "anchors around it: they lie on one line, and without gravity nothing else holds it".to_owned(),
            );
        }
        if let Some(i) = points.iter().position(|p| self.between_anchors && !inside(&self.anchor, *p)) {
            let [x, y] = points[i];
            return fail(format!(
                "a pose inside the anchors; attachment point {} is at ({x:.3}, {y:.3}) m, outside their polygon",
                i + 1
            ));
        }
        let length = |i: &usize| (points[*i][0] - self.anchor[*i][0]).hypot(points[*i][1] - self.anchor[*i][1]);
        if let Some(i) = (0..points.len()).find(|i| length(i) <= self.pulley_radius[*i].abs()) {
            return fail(format!("a pose with a length in every cable; cable {} begins where it ends", i + 1));
        }
        match self.blocked_cable(pose) {
            Some(i) => fail(format!("cables clear of the platform; cable {} runs through it", i + 1)),
            None => Ok(()),
        }
    }

    /// Whether every attachment point lies inside the polygon of the anchors at `pose` (m, rad), where it has to.
    pub fn holds(&self, pose: &[f64; 3]) -> bool {
        !self.between_anchors || self.attachment_points(pose).into_iter().all(|p| inside(&self.anchor, p))
    }

    /// The first cable (from 0) that runs through the platform at `pose` (m, rad).
    pub fn blocked_cable(&self, pose: &[f64; 3]) -> Option<usize> {
        let points = self.attachment_points(pose);
        (0..points.len()).find(|i| {
            // A point a little before the end is inside exactly when the cable arrives from inside the platform.
            let (anchor, end) = (self.anchor[*i], points[*i]);
            inside(&points, [end[0] + 1e-6 * (anchor[0] - end[0]), end[1] + 1e-6 * (anchor[1] - end[1])])
        })
    }

    /// The attachment points in the fixed frame (m).
    fn attachment_points(&self, pose: &[f64; 3]) -> PerCable<[f64; 2]> {
        let [sin, cos] = [pose[2].sin(), pose[2].cos()];
        self.attachment.map(|b| [pose[0] + cos * b[0] - sin * b[1], pose[1] + sin * b[0] + cos * b[1]])
    }
}

fn cross(o: [f64; 2], a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0])
}

/// Whether `p` lies in the convex hull of `points`, its border included; points on one line have no inside.
///
/// `p` is outside exactly when all points lie within half a turn as seen from it: then one of them is the rightmost, with
/// every other to its left or straight behind it.
fn inside(points: &[[f64; 2]], p: [f64; 2]) -> bool {
    let apart = |a: [f64; 2], b: [f64; 2]| [b[0] - a[0], b[1] - a[1]];
    let rightmost = |q: [f64; 2]| {
        points.iter().all(|r| {
            let turn = cross(p, q, *r);
            let ([qx, qy], [rx, ry]) = (apart(p, q), apart(p, *r));
            turn > 0.0 || turn == 0.0 && qx * rx + qy * ry > 0.0
        })
    };
    spread(points) && !points.iter().any(|q| rightmost(*q))
}

/// Whether the points do not all lie on one line.
fn spread(points: &[[f64; 2]]) -> bool {
    let first = points[0];
    let other = points.iter().find(|q| **q != first);
    other.is_some_and(|second| points.iter().any(|r| cross(first, *second, *r) != 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hull_of_four_points_in_any_order() {
        let corners = [[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [0.0, 3.0]];
        for order in [[0, 1, 2, 3], [0, 2, 1, 3], [3, 1, 0, 2]] {
            let points = order.map(|k: usize| corners[k]);
            for (p, expected) in
                [([2.0, 1.5], true), ([3.9, 0.1], true), ([0.1, 2.9], true), ([4.1, 1.0], false), ([2.0, -0.1], false)]
            {
                assert_eq!(inside(&points, p), expected, "{order:?} {p:?}");
            }
        }
        let dented = [[0.0, 0.0], [4.0, 0.0], [0.0, 4.0], [1.0, 1.0]];
        assert!(inside(&dented, [1.9, 1.9]) && !inside(&dented, [2.1, 2.1]));
        assert!(!inside(&[[0.0, 0.0]; 4], [0.0, 0.0]), "a point has no inside");
    }

    #[test]
    fn poses_outside_the_anchors_and_through_the_platform_are_told() {
        let geometry = Geometry::new(&Parameters::default());
        assert_eq!(geometry.check_pose(&[100.0, -200.0, 0.5]), Ok(()));
        let outside = [630.0, 0.0, 0.0];
        assert!(!geometry.holds(&outside));
        assert!(geometry.check_pose(&outside).unwrap_err().expected.contains("inside the anchors"));
        // At an eighth of a turn the crossed cables lie along the platform's sides; beyond it they cross it.
        assert_eq!(geometry.blocked_cable(&[0.0, 0.0, 0.7]), None);
        assert!(geometry.blocked_cable(&[0.0, 0.0, 1.0]).is_some());
        assert!(geometry.check_pose(&[0.0, 0.0, 1.0]).unwrap_err().expected.contains("runs through it"));
    }
}
