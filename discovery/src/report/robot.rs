//! Drawing of the robot with the places marked.

use std::fmt::Write as _;

use super::data::{Located, Report, Robot};
use super::gather;
use super::number::{decimals, percent};
use super::place::{Axis, Part, Place};

/// Side of the square that the anchors' circle fills, in drawing units.
const SIZE: f64 = 300.0;
/// Margin for the winches' names.
const MARGIN: f64 = 46.0;
/// Share of the gap below which a place is not marked.
const LEAST: f64 = 0.05;
/// Smallest radius at which a platform can be made out, in drawing units.
const PLATFORM: f64 = 44.0;

/// The drawing and what its caption has to say about scale.
pub(super) struct Drawing {
    /// One `<svg>` element.
    pub(super) svg: String,
    /// How many times larger than the distances between winches the platform is drawn; 1 for true to scale.
    pub(super) enlarged: f64,
    /// The places marked, in words.
    pub(super) marked: Vec<String>,
}

/// A place to mark, with the text beside it.
struct Mark {
    place: Place,
    share: Option<f64>,
}

/// Draws the robot of the report, every place that is located or has an effect marked.
pub(super) fn draw(report: &Report) -> Drawing {
    let frame = Frame::new(&report.robot);
    let marks = marks(report);
    let full = SIZE + 2.0 * MARGIN;
    let mut svg = format!(
        "<svg class=\"robot\" viewBox=\"0 0 {full} {full}\" role=\"img\" aria-label=\"Drawing of the robot with the place marked\">"
    );
    frame.cables(&mut svg, &marks);
    frame.platform(&mut svg, &marks);
    frame.winches(&mut svg, &marks);
    frame.wrench(&mut svg, &marks);
    frame.axes(&mut svg);
    svg.push_str("</svg>");
    Drawing { svg, enlarged: frame.enlarged, marked: captions(report) }
}

/// The marked places in words, those of one effect put together.
fn captions(report: &Report) -> Vec<String> {
    let places: Vec<Located> =
        gather(&report.located, report.robot.anchors.len()).into_iter().filter(|l| l.share_of_gap >= LEAST).collect();
    let mut words: Vec<String> = places
        .iter()
        .map(|l| format!("{} ({} of the gap)", Place::parse(&l.place).noun(), percent(l.share_of_gap)))
        .collect();
    let effects = report.effects.iter().map(|e| e.place.as_str());
    for place in effects.chain(report.terms.iter().map(|t| t.target.as_str())) {
        // `platform` says nothing beside `platform.force_x`.
        let noun = Place::parse(place).noun();
        if !places.iter().any(|l| l.place.starts_with(place)) && !words.contains(&noun) {
            words.push(noun);
        }
    }
    words
}

fn marks(report: &Report) -> Vec<Mark> {
    let mut marks: Vec<Mark> = Vec::new();
    let located =
        report.located.iter().filter(|l| l.share_of_gap >= LEAST).map(|l| (l.place.as_str(), Some(l.share_of_gap)));
    let effects = report.effects.iter().map(|e| (e.place.as_str(), None));
    let terms = report.terms.iter().map(|t| (t.target.as_str(), None));
    for (text, share) in located.chain(effects).chain(terms) {
        let place = Place::parse(text);
        if !marks.iter().any(|m| m.place == place) {
            marks.push(Mark { place, share });
        }
    }
    marks
}

/// The robot in drawing units.
struct Frame {
    anchors: Vec<[f64; 2]>,
    attachments: Vec<[f64; 2]>,
    centre: [f64; 2],
    path: Vec<[f64; 2]>,
    radius: f64,
    enlarged: f64,
}

impl Frame {
    fn new(robot: &Robot) -> Frame {
        let reach =
            |points: &[[f64; 2]]| points.iter().flatten().fold(0.0_f64, |r, v| r.max(v.abs())).max(f64::MIN_POSITIVE);
        let scale = 0.5 * SIZE / reach(&robot.anchors);
        let body = robot.attachments.iter().fold(0.0_f64, |r, p| r.max(p[0].hypot(p[1])));
        let enlarged = if body > 0.0 { (PLATFORM / (scale * body)).max(1.0) } else { 1.0 };
        let [x, y, phi] = robot.pose;
        let place = |p: [f64; 2]| [MARGIN + 0.5 * SIZE + scale * p[0], MARGIN + 0.5 * SIZE - scale * p[1]];
        let centre = place([x, y]);
        let large = |dx: f64, dy: f64| [centre[0] + scale * enlarged * dx, centre[1] - scale * enlarged * dy];
        let (sin, cos) = phi.sin_cos();
        Frame {
            anchors: robot.anchors.iter().map(|p| place(*p)).collect(),
            attachments: robot
                .attachments
                .iter()
                .map(|b| large(cos * b[0] - sin * b[1], sin * b[0] + cos * b[1]))
                .collect(),
            path: robot.path.iter().map(|p| large(p[0] - x, p[1] - y)).collect(),
            centre,
            radius: scale * enlarged * body,
            enlarged,
        }
    }

    fn cables(&self, svg: &mut String, marks: &[Mark]) {
        for (i, (a, b)) in self.anchors.iter().zip(&self.attachments).enumerate() {
            let class = if on(marks, Part::Cable, i) { "cable marked" } else { "cable" };
            line(svg, class, *a, *b);
            // Beside the cable, on the side away from the crossing.
            let beside = |along: f64| {
                let p = [a[0] + along * (b[0] - a[0]), a[1] + along * (b[1] - a[1])];
                let side = if a[0] < self.centre[0] { -1.0 } else { 1.0 };
                ([p[0] + 14.0 * side, p[1] + 5.0], if side < 0.0 { "end" } else { "start" })
            };
            let on_cable = share(marks, |place| match place {
                Place::Part(Part::Cable | Part::Attachment, index) => *index == Some(i + 1),
                _ => false,
            });
            if let Some(share) = on_cable {
                let (p, anchor) = beside(0.68);
                label(svg, p, anchor, &percent(share));
            }
            let on_its_sensor = share(marks, |place| matches!(place, Place::Sensor(_, Some(n)) if *n == i + 1));
            if let Some(share) = on_its_sensor {
                let (p, anchor) = beside(0.4);
                label(svg, p, anchor, &percent(share));
            }
            if on_sensor(marks, i) {
                let middle = [0.6 * a[0] + 0.4 * b[0], 0.6 * a[1] + 0.4 * b[1]];
                let _ = write!(
                    svg,
                    "<rect class=\"sensor marked\" x=\"{:.1}\" y=\"{:.1}\" width=\"14\" height=\"14\"/>",
                    middle[0] - 7.0,
                    middle[1] - 7.0
                );
            }
        }
    }

    fn platform(&self, svg: &mut String, marks: &[Mark]) {
        let mut corners = self.attachments.clone();
        let angle = |p: &[f64; 2]| (p[1] - self.centre[1]).atan2(p[0] - self.centre[0]);
        corners.sort_by(|a, b| angle(a).total_cmp(&angle(b)));
        let points: Vec<String> = corners.iter().map(|p| format!("{:.1},{:.1}", p[0], p[1])).collect();
        let marked = marks.iter().any(|m| matches!(m.place, Place::Platform(_) | Place::Sensor(_, None)));
        let class = if marked { "platform marked" } else { "platform" };
        let _ = write!(svg, "<polygon class=\"{class}\" points=\"{}\"/>", points.join(" "));
        if self.path.len() > 1 {
            let d: Vec<String> = self.path.iter().map(|p| format!("{:.1},{:.1}", p[0], p[1])).collect();
            let _ = write!(svg, "<polyline class=\"path\" points=\"{}\"/>", d.join(" "));
        }
        for (i, p) in self.attachments.iter().enumerate() {
            let marked = on(marks, Part::Attachment, i);
            circle(svg, if marked { "joint marked" } else { "joint" }, *p, if marked { 7.0 } else { 3.0 });
        }
        circle(svg, "joint", self.centre, 2.5);
    }

    fn winches(&self, svg: &mut String, marks: &[Mark]) {
        let middle = MARGIN + 0.5 * SIZE;
        let near = SIZE / 6.0;
        for (i, p) in self.anchors.iter().enumerate() {
            let marked = on(marks, Part::Winch, i) || on(marks, Part::Anchor, i);
            if marked {
                circle(svg, "halo", *p, 17.0);
            }
            circle(svg, if marked { "winch marked" } else { "winch" }, *p, 8.0);
            // At the edges names have the margin for them; between, there is room where the winch is.
            let (x, anchor) = if p[0] < middle - near {
                (4.0, "start")
            } else if p[0] > middle + near {
                (SIZE + 2.0 * MARGIN - 4.0, "end")
            } else {
                (p[0], "middle")
            };
            let above = p[1] < middle;
            let y = if above { p[1] - 24.0 } else { p[1] + 34.0 };
            let class = if marked { "name marked" } else { "name" };
            let share = share(marks, |place| match place {
                Place::Part(Part::Winch | Part::Anchor, index) => *index == Some(i + 1),
                _ => false,
            });
            let share = share.map_or_else(String::new, |s| format!(": {}", percent(s)));
            let _ = write!(
                svg,
                "<text class=\"{class}\" x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">winch {}{share}</text>",
                i + 1
            );
        }
    }

    /// Arrows for the axes of the platform's wrench that are marked.
    fn wrench(&self, svg: &mut String, marks: &[Mark]) {
        let [x, y] = self.centre;
        let reach = self.radius + 34.0;
        let mut axes: Vec<(Axis, Option<f64>)> = Vec::new();
        for mark in marks {
            if let Place::Platform(Some(axis)) = mark.place {
                axes.push((axis, mark.share));
            }
        }
        for (axis, share) in axes {
            let text = share.map(percent).unwrap_or_default();
            match axis {
                Axis::ForceX => {
                    line(svg, "force", [x, y], [x + reach, y]);
                    head(svg, [x + reach + 8.0, y], 0.0);
                    label(svg, [x + reach + 12.0, y - 8.0], "middle", &text);
                }
                Axis::ForceY => {
                    line(svg, "force", [x, y], [x, y - reach]);
                    head(svg, [x, y - reach - 8.0], -90.0);
                    label(svg, [x + 12.0, y - reach], "start", &text);
                }
                Axis::Torque => {
                    let r = self.radius + 10.0;
                    let (ex, ey) = (x - 0.5 * r, y - 0.866 * r);
                    let _ = write!(
                        svg,
                        "<path class=\"force\" d=\"M{:.1} {y:.1}A{r:.1} {r:.1} 0 0 0 {ex:.1} {ey:.1}\"/>",
                        x + r
                    );
                    head(svg, [ex - 6.0, ey + 4.0], 148.0);
                    label(svg, [x - r - 4.0, y + 4.0], "end", &text);
                }
            }
        }
        // The platform as a whole, and its pose sensor: the share goes below.
        for mark in marks {
            if let (Place::Platform(None) | Place::Sensor(_, None), Some(share)) = (&mark.place, mark.share) {
                let text = percent(share);
                label(svg, [x, y + self.radius + 24.0], "middle", &text);
            }
        }
    }

    fn axes(&self, svg: &mut String) {
        let base = MARGIN + SIZE + 24.0;
        let left = 0.5 * (SIZE + 2.0 * MARGIN) - 14.0;
        line(svg, "axis", [left, base], [left + 30.0, base]);
        line(svg, "axis", [left, base], [left, base - 30.0]);
        let _ = write!(
            svg,
            "<text class=\"axis\" x=\"{:.1}\" y=\"{:.1}\">x</text><text class=\"axis\" x=\"{:.1}\" y=\"{:.1}\">y</text>",
            left + 34.0,
            base + 4.0,
            left - 4.0,
            base - 35.0
        );
    }
}

/// What the caption says about scale.
pub(super) fn scale_note(enlarged: f64) -> Option<String> {
    (enlarged > 1.05).then(|| {
        format!(
            "The platform and its path are drawn {} times larger than the distances between the winches.",
            decimals(enlarged, if enlarged < 10.0 { 1 } else { 0 })
        )
    })
}

/// Share of the gap of all marks at such a place; `None` where there is none.
fn share(marks: &[Mark], at: impl Fn(&Place) -> bool) -> Option<f64> {
    marks.iter().filter(|m| at(&m.place)).filter_map(|m| m.share).reduce(|a, b| a + b)
}

fn on(marks: &[Mark], part: Part, i: usize) -> bool {
    marks.iter().any(|m| match m.place {
        Place::Part(p, index) => p == part && index.is_none_or(|n| n == i + 1),
        _ => false,
    })
}

fn on_sensor(marks: &[Mark], i: usize) -> bool {
    marks.iter().any(|m| matches!(&m.place, Place::Sensor(_, Some(n)) if *n == i + 1))
}

fn line(svg: &mut String, class: &str, a: [f64; 2], b: [f64; 2]) {
    let _ = write!(
        svg,
        "<line class=\"{class}\" x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\"/>",
        a[0], a[1], b[0], b[1]
    );
}

fn circle(svg: &mut String, class: &str, p: [f64; 2], r: f64) {
    let _ = write!(svg, "<circle class=\"{class}\" cx=\"{:.1}\" cy=\"{:.1}\" r=\"{r}\"/>", p[0], p[1]);
}

/// An arrow head whose tip is at `p`, pointing `angle` degrees clockwise from the drawing's x axis.
fn head(svg: &mut String, p: [f64; 2], angle: f64) {
    let _ = write!(
        svg,
        "<path class=\"head\" transform=\"translate({:.1} {:.1}) rotate({angle})\" d=\"M0 0l-12 -6v12z\"/>",
        p[0], p[1]
    );
}

/// A marked text; numbers and names of the contract only, so nothing needs escaping.
fn label(svg: &mut String, p: [f64; 2], anchor: &str, text: &str) {
    if !text.is_empty() {
        let _ = write!(
            svg,
            "<text class=\"name marked\" x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"{anchor}\">{}</text>",
            p[0],
            p[1],
            super::escape(text)
        );
    }
}
