//! Where everything goes on the paper.

use crate::{Area, Robot};

/// Width of the field that the robot fills, in drawing units.
const FIELD: f64 = 520.0;
/// Space around the field: for ticks at the left and below, for the axes' names above and at the right.
const LEFT: f64 = 66.0;
const TOP: f64 = 40.0;
const RIGHT: f64 = 66.0;
const BOTTOM: f64 = 64.0;
/// Height of a line that names an area.
const LINE: f64 = 20.0;
/// A field is no flatter and no slimmer than this.
const FLATTEST: f64 = 0.4;
/// Part of the field left free at each side of the outermost point.
const BORDER: f64 = 0.04;
/// The least radius of a platform that can be made out, as part of the field's smaller side.
const PLATFORM: f64 = 0.11;
/// Least length of the body axes.
const BODY_AXES: f64 = 26.0;
/// Radius of a cable's number.
pub(crate) const BADGE: f64 = 11.0;

/// The robot in drawing units, y downwards.
pub(crate) struct Layout {
    /// Width and height of the picture.
    pub(crate) size: [f64; 2],
    /// Height of the line below the picture.
    pub(crate) note: f64,
    /// Upper left and lower right corner of the field.
    pub(crate) field: [[f64; 2]; 2],
    pub(crate) anchors: Vec<[f64; 2]>,
    pub(crate) attachments: Vec<[f64; 2]>,
    /// Corners of the winches' frame.
    pub(crate) frame: Vec<[f64; 2]>,
    /// Corners of the platform.
    pub(crate) platform: Vec<[f64; 2]>,
    /// The platform's own origin.
    pub(crate) centre: [f64; 2],
    /// How many times larger than the frame the platform is drawn.
    pub(crate) enlarged: f64,
    /// Where each cable's number stands.
    pub(crate) numbers: Vec<[f64; 2]>,
    /// Drawing units in a metre.
    scale: f64,
    /// The point (m) at the field's lower left corner.
    corner: [f64; 2],
    radius: f64,
}

impl Layout {
    pub(crate) fn new(robot: &Robot, areas: &[Area]) -> Self {
        let [x, y, phi] = robot.pose;
        let body = robot.attachments.iter().map(|b| b[0].hypot(b[1])).fold(0.0, f64::max);
        let inside = robot.anchors.iter().copied().chain(areas.iter().flat_map(|area| area.corners));
        let (low, high) = bounds(inside.chain([[0.0; 2], [x - body, y - body], [x + body, y + body]]));
        let extent = [0, 1].map(|k| high[k] - low[k]);
        let largest = if extent[0].max(extent[1]) > 0.0 { extent[0].max(extent[1]) } else { 1.0 };
        let side = extent.map(|e| e.max(FLATTEST * largest) * (1.0 + 2.0 * BORDER));
        let scale = FIELD / side[0].max(side[1]);
        let corner = [0, 1].map(|k| 0.5 * (low[k] + high[k] - side[k]));
        let field = side.map(|s| s * scale);
        let place = |p: [f64; 2]| [LEFT + scale * (p[0] - corner[0]), TOP + field[1] - scale * (p[1] - corner[1])];

        let enlarged = enlargement(robot, body, PLATFORM * side[0].min(side[1]));
        let (sin, cos) = phi.sin_cos();
        let attached =
            |b: &[f64; 2]| place([x + enlarged * (cos * b[0] - sin * b[1]), y + enlarged * (sin * b[0] + cos * b[1])]);
        let anchors: Vec<_> = robot.anchors.iter().map(|a| place(*a)).collect();
        let attachments: Vec<_> = robot.attachments.iter().map(attached).collect();
        Self {
            size: [LEFT + field[0] + RIGHT, TOP + field[1] + BOTTOM + LINE * areas.len() as f64],
            note: TOP + field[1] + BOTTOM - 10.0,
            field: [[LEFT, TOP], [LEFT + field[0], TOP + field[1]]],
            frame: around(&anchors),
            platform: around(&attachments),
            centre: place([x, y]),
            numbers: numbers(&anchors, &attachments),
            radius: scale * enlarged * body,
            anchors,
            attachments,
            enlarged,
            scale,
            corner,
        }
    }

    /// A point (m) of the fixed frame.
    pub(crate) fn place(&self, p: [f64; 2]) -> [f64; 2] {
        let [[left, _], [_, bottom]] = self.field;
        [left + self.scale * (p[0] - self.corner[0]), bottom - self.scale * (p[1] - self.corner[1])]
    }

    /// Where the name of an area stands: below all else, one a line.
    pub(crate) fn legend(&self, line: usize) -> [f64; 2] {
        [LEFT + 30.0, self.note + LINE * (line + 1) as f64]
    }

    /// Both ends of each cable.
    pub(crate) fn cables(&self) -> impl Iterator<Item = ([f64; 2], [f64; 2])> {
        self.anchors.iter().copied().zip(self.attachments.iter().copied())
    }

    /// Length of the body axes: well inside a platform that has room for them.
    pub(crate) fn reach(&self) -> f64 {
        (0.6 * self.radius).max(BODY_AXES)
    }

    /// Round values (m) along an axis, with their places.
    pub(crate) fn ticks(&self, axis: usize) -> Vec<(f64, f64)> {
        let [low, high] = [0, 1].map(|end| self.field[end][axis]);
        let length = (high - low) / self.scale;
        let step = round_step(length.max(FIELD / self.scale * 0.7) / 6.0);
        let first = (self.corner[axis] / step).ceil();
        (0..)
            .map(|k| (first + f64::from(k)) * step)
            .take_while(|value| *value <= self.corner[axis] + length)
            .map(|value| (value, self.place([value, value])[axis]))
            .collect()
    }
}

/// How many times larger than the frame the platform is drawn, so that its radius is `wanted` (m).
///
/// A whole number, and never so large that the platform reaches half way to a winch.
fn enlargement(robot: &Robot, body: f64, wanted: f64) -> f64 {
    let [x, y, _] = robot.pose;
    let room = robot.anchors.iter().map(|a| (a[0] - x).hypot(a[1] - y)).fold(f64::INFINITY, f64::min);
    if body > 0.0 { (wanted.min(0.5 * room) / body).floor().max(1.0) } else { 1.0 }
}

/// The smallest of 1, 2, 5, 10, ... that is at least `least`.
fn round_step(least: f64) -> f64 {
    let decade = 10_f64.powf(least.log10().floor());
    [1.0, 2.0, 5.0].map(|m| m * decade).into_iter().find(|step| *step >= least).unwrap_or(10.0 * decade)
}

fn bounds(points: impl Iterator<Item = [f64; 2]>) -> ([f64; 2], [f64; 2]) {
    points.fold(([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]), |(low, high), p| {
        ([0, 1].map(|k| low[k].min(p[k])), [0, 1].map(|k| high[k].max(p[k])))
    })
}

/// The points in the order in which an outline goes through them: by their direction from their middle.
fn around(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let n = points.len() as f64;
    let middle = [0, 1].map(|k| points.iter().map(|p| p[k]).sum::<f64>() / n);
    let direction = |p: &[f64; 2]| (p[1] - middle[1]).atan2(p[0] - middle[0]);
    let mut points = points.to_vec();
    points.sort_by(|a, b| direction(a).total_cmp(&direction(b)));
    points
}

/// Each number stands on its own cable, where other cables and their numbers are far enough away.
fn numbers(anchors: &[[f64; 2]], attachments: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let along = |i: usize, t: f64| [0, 1].map(|k| anchors[i][k] + t * (attachments[i][k] - anchors[i][k]));
    let mut placed: Vec<[f64; 2]> = Vec::new();
    for i in 0..anchors.len() {
        // Room beside the cables and between the numbers count alike; more than a number needs is of no use.
        let room = |distances: &mut dyn Iterator<Item = f64>| distances.fold(1.5 * BADGE, f64::min);
        let free = |p: [f64; 2]| {
            let cables = (0..anchors.len()).filter(|k| *k != i).map(|k| to_segment(p, anchors[k], attachments[k]));
            let ends = [anchors[i], attachments[i]].map(|q| distance(p, q));
            room(&mut cables.chain(ends)) + room(&mut placed.iter().map(|q| 0.5 * distance(p, *q)))
        };
        // From the winch inwards; the first of the equally good.
        let tried = (3..=14).map(|k| along(i, 0.05 * f64::from(k)));
        let best = tried.reduce(|best, p| if free(p) > free(best) + 0.5 { p } else { best });
        placed.extend(best);
    }
    placed
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// Distance of a point from the line between two others.
fn to_segment(p: [f64; 2], a: [f64; 2], b: [f64; 2]) -> f64 {
    let along = [b[0] - a[0], b[1] - a[1]];
    let length = along[0] * along[0] + along[1] * along[1];
    let t = if length > 0.0 { ((p[0] - a[0]) * along[0] + (p[1] - a[1]) * along[1]) / length } else { 0.0 };
    let t = t.clamp(0.0, 1.0);
    distance(p, [a[0] + t * along[0], a[1] + t * along[1]])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_round_and_large_enough() {
        for (least, step) in [(0.9, 1.0), (1.0, 1.0), (1.1, 2.0), (230.0, 500.0), (0.006, 0.01)] {
            assert!((round_step(least) - step).abs() < 1e-12 * step, "{least}: {}", round_step(least));
        }
    }

    /// Two winches in each corner, a hand's breadth apart.
    #[test]
    fn numbers_of_cables_from_one_corner_do_not_cover_each_other() {
        let corners = [[-5.0, -3.0], [5.0, -3.0], [5.0, 3.0], [-5.0, 3.0]];
        let anchors: Vec<_> = corners.iter().flat_map(|c| [*c, [c[0] * 0.99, c[1]]]).collect();
        let attachments: Vec<_> =
            corners.iter().flat_map(|c| [[0.1 * c[0], 0.1 * c[1]], [-0.1 * c[0], 0.1 * c[1]]]).collect();
        let robot = Robot { anchors: &anchors, attachments: &attachments, pose: [1.0, -0.5, 0.2] };
        let places = Layout::new(&robot, &[]).numbers;
        for (i, a) in places.iter().enumerate() {
            for b in &places[..i] {
                assert!(distance(*a, *b) >= 2.0 * BADGE, "{places:?}");
            }
        }
    }

    #[test]
    fn the_frame_goes_round_the_winches_whatever_their_order() {
        let square = [[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]];
        let outline = around(&square);
        for (a, b) in outline.iter().zip(outline.iter().cycle().skip(1)) {
            assert_eq!(distance(*a, *b), 1.0, "{outline:?}");
        }
    }
}
