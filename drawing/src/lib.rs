//! The robot as a picture: frame, cables by number, platform and axes, as one SVG text.
//!
//! For any geometry with two cables or more, and areas of the plane beneath it. Nothing here knows of models or files: what
//! is drawn are points.

mod area;
mod layout;
mod paint;

pub use area::{Area, Look};
use layout::Layout;
use paint::{Picture, number};

/// Winches in the frame, attachment points on the platform, and where the platform is.
#[derive(Clone, Copy, Debug)]
pub struct Robot<'a> {
    /// Where each cable leaves its winch (m, fixed frame).
    pub anchors: &'a [[f64; 2]],
    /// Where each cable holds the platform, in the order of `anchors` (m, body frame).
    pub attachments: &'a [[f64; 2]],
    /// Position of the platform and its angle (m, m, rad).
    pub pose: [f64; 3],
}

impl Robot<'_> {
    /// Draws the robot as one `<svg>` element, to stand in a page or alone in a file.
    ///
    /// A platform too small to be made out is drawn larger than the frame; the line below the picture then says by how
    /// much. Classes begin with `robot`, so that a page's own styles stay apart.
    ///
    /// # Panics
    /// If a number is not finite, or `anchors` and `attachments` differ in length.
    #[must_use]
    pub fn svg(&self) -> String {
        self.svg_on(&[])
    }

    /// The same on these areas, which are named below the picture.
    ///
    /// # Panics
    /// As [`Robot::svg`], and if an area has not the cells that it should have.
    #[must_use]
    pub fn svg_on(&self, areas: &[Area]) -> String {
        assert_eq!(self.anchors.len(), self.attachments.len(), "a cable has two ends");
        let all = self.anchors.iter().chain(self.attachments).flatten().chain(&self.pose);
        assert!(all.clone().all(|v| v.is_finite()), "a point is somewhere");
        let layout = Layout::new(self, areas);
        let [x, y, phi] = self.pose.map(number);
        let title = format!("Robot with {} cables at x = {x} m, y = {y} m, φ = {phi} rad", self.anchors.len());
        let mut picture = Picture::new(layout.size, &title);
        for area in areas {
            area.paint(&mut picture, &layout);
        }
        axes(&mut picture, &layout);
        picture.polygon("robot-frame", &layout.frame);
        for (from, to) in layout.cables() {
            picture.line("robot-cable", from, to);
        }
        platform(&mut picture, &layout, self.pose[2]);
        for anchor in &layout.anchors {
            picture.circle("robot-winch", *anchor, 6.0);
        }
        for (i, place) in layout.numbers.iter().enumerate() {
            picture.circle("robot-badge", *place, layout::BADGE);
            picture.text("robot-number", [place[0], place[1] + 4.5], "middle", &(i + 1).to_string());
        }
        let scale = if layout.enlarged > 1.0 {
            format!("; platform drawn {} times larger than the frame", number(layout.enlarged))
        } else {
            String::new()
        };
        let note = format!("x = {x} m, y = {y} m, φ = {phi} rad{scale}");
        picture.text("robot-note", [0.5 * layout.size[0], layout.note], "middle", &note);
        for (k, area) in areas.iter().enumerate() {
            area.name(&mut picture, &layout, k);
        }
        picture.finish()
    }
}

/// Ticks in metres along the left and lower edge, and the fixed frame's axes through its origin.
fn axes(picture: &mut Picture, layout: &Layout) {
    let [[left, top], [right, bottom]] = layout.field;
    for (value, x) in layout.ticks(0) {
        picture.line("robot-grid", [x, top], [x, bottom]);
        picture.text("robot-tick", [x, bottom + 18.0], "middle", &number(value));
    }
    for (value, y) in layout.ticks(1) {
        picture.line("robot-grid", [left, y], [right, y]);
        picture.text("robot-tick", [left - 8.0, y + 4.0], "end", &number(value));
    }
    let origin = layout.place([0.0, 0.0]);
    picture.arrow("robot-axis", [left, origin[1]], [right + 12.0, origin[1]]);
    picture.arrow("robot-axis", [origin[0], bottom], [origin[0], top - 12.0]);
    picture.text("robot-axis-name", [right + 16.0, origin[1] + 4.0], "start", "x (m)");
    picture.text("robot-axis-name", [origin[0] + 8.0, top - 8.0], "start", "y (m)");
}

/// The platform's outline, its body axes, and the angle between these and the frame's.
fn platform(picture: &mut Picture, layout: &Layout, phi: f64) {
    picture.polygon("robot-platform", &layout.platform);
    for point in &layout.attachments {
        picture.circle("robot-joint", *point, 3.5);
    }
    let [x, y] = layout.centre;
    let reach = layout.reach();
    let (sin, cos) = phi.sin_cos();
    picture.arrow("robot-body", [x, y], [x + reach * cos, y - reach * sin]);
    picture.arrow("robot-body", [x, y], [x - reach * sin, y - reach * cos]);
    // An angle too small to be seen needs no arc.
    let turn = sin.atan2(cos);
    if turn.abs() > 0.03 {
        picture.line("robot-angle", [x, y], [x + reach, y]);
        picture.arc("robot-angle", [x, y], 0.7 * reach, [cos, sin], turn < 0.0);
        let (half_sin, half_cos) = (0.5 * turn).sin_cos();
        let name = [x + (reach + 6.0) * half_cos, y - (reach + 6.0) * half_sin + 4.0];
        picture.text("robot-angle-name", name, "start", "φ");
    }
    picture.circle("robot-joint", [x, y], 2.5);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(robot: &Robot) -> String {
        let svg = robot.svg();
        roxmltree::Document::parse(&svg).unwrap_or_else(|e| panic!("{e}: {svg}"));
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        svg
    }

    /// Winches on an ellipse, cables to the opposite sides of the platform.
    fn ring(n: usize, size: f64, body: f64) -> (Vec<[f64; 2]>, Vec<[f64; 2]>) {
        let on = |k: usize, r: f64, turn: f64| {
            let angle = turn + std::f64::consts::TAU * k as f64 / n as f64;
            [r * angle.cos(), 0.7 * r * angle.sin()]
        };
        ((0..n).map(|k| on(k, size, 0.3)).collect(), (0..n).map(|k| on(k, body, 0.9)).collect())
    }

    #[test]
    fn every_number_of_cables_from_two_is_drawn_with_its_numbers() {
        for n in 2..=12 {
            for (size, body) in [(900.0, 10.0), (1.5, 0.4), (3.0, 0.0), (1e-3, 1e-4)] {
                let (anchors, attachments) = ring(n, size, body);
                for pose in [[0.0; 3], [0.3 * size, -0.2 * size, -2.0]] {
                    let svg = parsed(&Robot { anchors: &anchors, attachments: &attachments, pose });
                    assert_eq!(svg.matches("class=\"robot-cable\"").count(), n);
                    for i in 1..=n {
                        assert!(svg.contains(&format!(">{i}</text>")), "cable {i} of {n} has no number");
                    }
                }
            }
        }
    }

    #[test]
    fn a_platform_too_small_to_be_seen_is_enlarged_and_the_picture_says_so() {
        let (anchors, attachments) = ring(4, 900.0, 10.0);
        let small = parsed(&Robot { anchors: &anchors, attachments: &attachments, pose: [0.0; 3] });
        assert!(small.contains("times larger than the frame"), "{small}");
        let (anchors, attachments) = ring(4, 2.0, 0.5);
        let large = parsed(&Robot { anchors: &anchors, attachments: &attachments, pose: [0.0; 3] });
        assert!(!large.contains("times larger"), "{large}");
    }

    #[test]
    fn an_area_beyond_the_frame_has_room_and_a_name() {
        let (anchors, attachments) = ring(4, 2.0, 0.3);
        let robot = Robot { anchors: &anchors, attachments: &attachments, pose: [0.0; 3] };
        let cells = [true, false, true, true];
        let area =
            |look| Area { corners: [[-1.0, -6.0], [1.0, 0.0]], columns: 2, cells: &cells, look, name: "hanging" };
        let svg = robot.svg_on(&[area(Look::Filled), area(Look::Dashed)]);
        roxmltree::Document::parse(&svg).unwrap();
        assert_eq!(svg.matches(">hanging</text>").count(), 2, "{svg}");
        assert!(svg.contains(">-6</text>") && !robot.svg().contains(">-6</text>"), "{svg}");
        assert_eq!(svg.matches("class=\"robot-area-").count(), 4, "each area and its sample: {svg}");
    }

    #[test]
    fn points_in_one_line_and_in_one_place_are_drawn() {
        let line = [[-4.0, 3.0], [4.0, 3.0]];
        parsed(&Robot { anchors: &line, attachments: &[[0.0; 2]; 2], pose: [1.0, 1.0, 0.0] });
        parsed(&Robot { anchors: &line, attachments: &[[0.0; 2]; 2], pose: [0.0, 3.0, 0.0] });
        parsed(&Robot { anchors: &[[0.0; 2]; 3], attachments: &[[0.0; 2]; 3], pose: [0.0; 3] });
    }
}
