//! Drawing a figure.

use std::fmt::Write as _;

use super::axis::Axis;
use super::{Figure, Line, Panel, Scale, Style};

const WIDTH: f64 = 880.0;
const LEFT: f64 = 78.0;
const RIGHT: f64 = 92.0;
const TOP: f64 = 24.0;
const PANEL: f64 = 128.0;
const GAP: f64 = 44.0;
const BOTTOM: f64 = 48.0;
/// Least distance between two names at the ends of lines.
const NAME_HEIGHT: f64 = 15.0;

/// Colours told apart by nearly everybody (Okabe and Ito), for light and dark ground.
const COLOURS: [(&str, &str); 5] =
    [("#0072b2", "#56b4e9"), ("#d55e00", "#ff9457"), ("#009e73", "#2fd6a5"), ("#a2498a", "#e79bd0"), ("#555", "#bbb")];

/// The text of the SVG file.
pub(super) fn draw(figure: &Figure) -> String {
    let head = TOP + if figure.note.is_empty() { 28.0 } else { 48.0 };
    let height = head + figure.panels.len() as f64 * (PANEL + GAP) - GAP + 18.0 + BOTTOM;
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" width=\"{WIDTH}\" \
         height=\"{height}\" role=\"img\" font-family=\"system-ui, 'Segoe UI', 'DejaVu Sans', sans-serif\" \
         font-size=\"12\">\n<title>{}</title>\n<style>\n{}</style>\n<rect class=\"ground\" width=\"100%\" \
         height=\"100%\"/>\n",
        escaped(&figure.title),
        style()
    );
    text(&mut out, "title", LEFT, TOP + 6.0, "start", &figure.title);
    if !figure.note.is_empty() {
        text(&mut out, "note", LEFT, TOP + 26.0, "start", &figure.note);
    }
    let times = figure.panels.iter().flat_map(|p| &p.lines).flat_map(|l| &l.points).map(|p| p[0]);
    let time = Axis::over(times, (LEFT, WIDTH - RIGHT), Scale::Linear, true);
    let mut top = head + 18.0;
    for (k, panel) in figure.panels.iter().enumerate() {
        draw_panel(&mut out, panel, &time, top, k + 1 == figure.panels.len());
        top += PANEL + GAP;
    }
    out.push_str("</svg>\n");
    out
}

fn style() -> String {
    let mut css = String::from(
        ".ground{fill:#fff}.title{font-size:16px;font-weight:600;fill:#111}.note{fill:#555}.head{font-weight:600;\
         fill:#222}.tick{fill:#555}.grid{stroke:#e4e4e4}.frame{stroke:#999;fill:none}\n\
         .line{fill:none;stroke-width:1.6;stroke-linejoin:round}.ring{fill:none;stroke-width:1.6}\n",
    );
    let colours = |css: &mut String, pick: fn(&(&'static str, &'static str)) -> &'static str| {
        for (k, pair) in COLOURS.iter().enumerate() {
            let colour = pick(pair);
            let _ = writeln!(css, ".s{k}{{stroke:{colour}}}.t{k}{{fill:{colour}}}");
        }
    };
    colours(&mut css, |pair| pair.0);
    css.push_str(
        "@media (prefers-color-scheme:dark){.ground{fill:#16181c}.title{fill:#eee}.note,.tick{fill:#aaa}\
         .head{fill:#ddd}.grid{stroke:#2c3036}.frame{stroke:#666}\n",
    );
    colours(&mut css, |pair| pair.1);
    css.push_str("}\n");
    css
}

fn draw_panel(out: &mut String, panel: &Panel, time: &Axis, top: f64, last: bool) {
    let bottom = top + PANEL;
    let values = panel.lines.iter().flat_map(|l| &l.points).map(|p| p[1]);
    let axis = Axis::over(values, (bottom, top), panel.scale, false);
    text(out, "head", LEFT, top - 8.0, "start", &panel.title);
    for (value, label) in axis.ticks(5) {
        if let Some(y) = axis.at(value) {
            let _ = writeln!(out, "<path class=\"grid\" d=\"M{LEFT} {y:.1}H{}\"/>", WIDTH - RIGHT);
            text(out, "tick", LEFT - 8.0, y + 4.0, "end", &label);
        }
    }
    for (value, label) in time.ticks(10) {
        if let Some(x) = time.at(value) {
            let _ = writeln!(out, "<path class=\"grid\" d=\"M{x:.1} {top}V{bottom}\"/>");
            if last {
                text(out, "tick", x, bottom + 18.0, "middle", &label);
            }
        }
    }
    let width = WIDTH - LEFT - RIGHT;
    let _ = writeln!(out, "<rect class=\"frame\" x=\"{LEFT}\" y=\"{top}\" width=\"{width}\" height=\"{PANEL}\"/>");
    for line in &panel.lines {
        draw_line(out, line, time, &axis);
    }
    draw_names(out, panel, &axis, top, bottom);
    if last {
        text(out, "tick", 0.5 * (LEFT + WIDTH - RIGHT), bottom + 38.0, "middle", "time (s)");
    }
}

fn draw_line(out: &mut String, line: &Line, time: &Axis, axis: &Axis) {
    let colour = line.colour % COLOURS.len();
    let places = line.points.iter().filter_map(|p| Some((time.at(p[0])?, axis.at(p[1])?)));
    if line.style == Style::Rings {
        for (x, y) in places {
            let _ = writeln!(out, "<circle class=\"ring s{colour}\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3.5\"/>");
        }
        return;
    }
    let _ = write!(out, "<path class=\"line s{colour}\" d=\"");
    let mut before: Option<(f64, f64)> = None;
    for (x, y) in places {
        let place = ((x * 10.0).round() / 10.0, (y * 10.0).round() / 10.0);
        match before {
            None => drop(write!(out, "M{} {}", place.0, place.1)),
            Some(same) if same == place => continue,
            Some(_) if line.style == Style::Held => drop(write!(out, "H{}V{}", place.0, place.1)),
            Some(_) => drop(write!(out, "L{} {}", place.0, place.1)),
        }
        before = Some(place);
    }
    out.push_str("\"/>\n");
}

/// The lines' names at their ends, moved apart where they would overlap.
fn draw_names(out: &mut String, panel: &Panel, axis: &Axis, top: f64, bottom: f64) {
    let mut names: Vec<(f64, &Line)> = panel
        .lines
        .iter()
        .filter(|line| !line.name.is_empty())
        .filter_map(|line| Some((axis.at(line.points.iter().rev().find(|p| axis.at(p[1]).is_some())?[1])?, line)))
        .collect();
    names.sort_by(|a, b| a.0.total_cmp(&b.0));
    let places: Vec<f64> = names.iter().map(|name| name.0).collect();
    for (name, place) in names.iter_mut().zip(apart(&places, top, bottom)) {
        name.0 = place;
    }
    for (y, line) in names {
        let class = format!("t{}", line.colour % COLOURS.len());
        text(out, &class, WIDTH - RIGHT + 8.0, y + 4.0, "start", &line.name);
    }
}

/// The nearest places to these (ascending) that keep their distance: those too close share their middle.
fn apart(places: &[f64], top: f64, bottom: f64) -> Vec<f64> {
    // Blocks of names in touch: middle and count.
    let mut blocks: Vec<(f64, usize)> = Vec::new();
    for place in places {
        let mut block = (*place, 1);
        while let Some(&(middle, count)) = blocks.last()
            && block.0 - middle < 0.5 * NAME_HEIGHT * (count + block.1) as f64
        {
            blocks.pop();
            let (a, b) = (count as f64, block.1 as f64);
            block = ((a * middle + b * block.0) / (a + b), count + block.1);
        }
        blocks.push(block);
    }
    let spread = |(middle, count): (f64, usize)| {
        let half = 0.5 * NAME_HEIGHT * (count - 1) as f64;
        let middle = middle.min(bottom - half).max(top + half);
        (0..count).map(move |k| middle - half + k as f64 * NAME_HEIGHT)
    };
    blocks.into_iter().flat_map(spread).collect()
}

fn text(out: &mut String, class: &str, x: f64, y: f64, anchor: &str, content: &str) {
    let content = escaped(content);
    let _ =
        writeln!(out, "<text class=\"{class}\" x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{content}</text>");
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_keep_their_distance() {
        assert_eq!(apart(&[10.0, 50.0], 0.0, 100.0), [10.0, 50.0]);
        assert_eq!(apart(&[50.0, 50.0, 50.0], 0.0, 100.0), [35.0, 50.0, 65.0]);
        assert_eq!(apart(&[99.0, 100.0], 0.0, 100.0), [85.0, 100.0]);
        let places = apart(&[10.0, 12.0, 24.0, 90.0], 0.0, 100.0);
        assert!(places.windows(2).all(|w| w[1] - w[0] >= NAME_HEIGHT - 1e-9), "{places:?}");
    }

    #[test]
    fn the_picture_holds_what_it_is_given() {
        let line = |style| Line { name: "a < b".into(), points: vec![[0.0, 1.0], [1.0, 2.0]], colour: 7, style };
        let panel = |style| Panel { title: "q (m)".into(), lines: vec![line(style)], scale: Scale::Linear };
        let figure = Figure {
            title: "x & y".into(),
            note: String::new(),
            panels: vec![panel(Style::Joined), panel(Style::Held), panel(Style::Rings)],
        };
        let svg = figure.to_svg();
        for part in ["x &amp; y", "a &lt; b", "class=\"line", "H788", "<circle"] {
            assert!(svg.contains(part), "{part} is missing in {svg}");
        }
        roxmltree::Document::parse(&svg).unwrap();
    }
}
