//! The elements of the picture as text.

use std::fmt::Write as _;

/// Colours told apart by nearly everybody, for light ground and for dark.
const STYLE: &str = "\
.robot-ground{fill:#fff}.robot-grid{stroke:#ececec}.robot-tick,.robot-note{fill:#555}\
.robot-area-filled{fill:#a9d8b8}.robot-area-pale{fill:#e0f2e6}\
.robot-area-outlined,.robot-area-dashed{fill:none;stroke:#117733;stroke-width:1.8}.robot-area-dashed{stroke-dasharray:5 4}\
.robot-axis{stroke:#8a8a8a;fill:none}.robot-axis-name{fill:#555}\
.robot-frame{fill:none;stroke:#9aa4b0;stroke-width:1.2;stroke-dasharray:6 5}\
.robot-cable{stroke:#0072b2;stroke-width:2}.robot-winch{fill:#24313f}\
.robot-platform{fill:#f3d9c3;stroke:#b3541e;stroke-width:2.5;stroke-linejoin:round}\
.robot-joint{fill:#b3541e}.robot-body{stroke:#7a3209;stroke-width:1.6;fill:none}\
.robot-angle{stroke:#7a3209;fill:none;stroke-dasharray:3 3}.robot-angle-name{fill:#7a3209}\
.robot-badge{fill:#fff;stroke:#0072b2;stroke-width:1.6}.robot-number{fill:#111;font-weight:600}\n\
@media (prefers-color-scheme:dark){.robot-ground{fill:#16181c}.robot-grid{stroke:#2c3036}\
.robot-area-filled{fill:#245a3a}.robot-area-pale{fill:#1b3427}.robot-area-outlined,.robot-area-dashed{stroke:#7fd19b}\
.robot-tick,.robot-note,.robot-axis-name{fill:#aaa}.robot-axis{stroke:#777}.robot-frame{stroke:#67727f}\
.robot-cable,.robot-badge{stroke:#56b4e9}.robot-winch{fill:#d5dbe2}.robot-platform{fill:#54321c;stroke:#ff9457}\
.robot-joint,.robot-angle-name{fill:#ffb88f}.robot-body,.robot-angle{stroke:#ffb88f}\
.robot-badge{fill:#16181c}.robot-number{fill:#eee}}\n";

/// An `<svg>` element as it grows.
pub(crate) struct Picture {
    text: String,
}

impl Picture {
    pub(crate) fn new([width, height]: [f64; 2], title: &str) -> Self {
        let text = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width:.0} {height:.0}\" width=\"{width:.0}\" \
             height=\"{height:.0}\" role=\"img\" font-family=\"system-ui, 'Segoe UI', 'DejaVu Sans', sans-serif\" \
             font-size=\"13\">\n<title>{title}</title>\n<style>\n{STYLE}</style>\n<rect class=\"robot-ground\" \
             width=\"100%\" height=\"100%\"/>\n"
        );
        Self { text }
    }

    pub(crate) fn finish(mut self) -> String {
        self.text.push_str("</svg>\n");
        self.text
    }

    /// `steps` as in the attribute `d`.
    pub(crate) fn path(&mut self, class: &str, steps: &str) {
        self.add(&format!("<path class=\"{class}\" d=\"{steps}\"/>"));
    }

    pub(crate) fn line(&mut self, class: &str, [x1, y1]: [f64; 2], [x2, y2]: [f64; 2]) {
        self.path(class, &format!("M{x1:.1} {y1:.1}L{x2:.1} {y2:.1}"));
    }

    /// A line with a head at its second end.
    pub(crate) fn arrow(&mut self, class: &str, from: [f64; 2], to: [f64; 2]) {
        let length = (to[0] - from[0]).hypot(to[1] - from[1]).max(f64::MIN_POSITIVE);
        let [ux, uy] = [0, 1].map(|k| (to[k] - from[k]) / length);
        let corner = |side: f64| [to[0] - 8.0 * ux - 4.0 * side * uy, to[1] - 8.0 * uy + 4.0 * side * ux];
        let ([ax, ay], [bx, by]) = (corner(1.0), corner(-1.0));
        let ([x1, y1], [x2, y2]) = (from, to);
        self.add(&format!(
            "<path class=\"{class}\" d=\"M{x1:.1} {y1:.1}L{x2:.1} {y2:.1}M{ax:.1} {ay:.1}L{x2:.1} {y2:.1}L{bx:.1} {by:.1}\"/>"
        ));
    }

    pub(crate) fn polygon(&mut self, class: &str, points: &[[f64; 2]]) {
        let corners: Vec<String> = points.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
        self.add(&format!("<polygon class=\"{class}\" points=\"{}\"/>", corners.join(" ")));
    }

    pub(crate) fn circle(&mut self, class: &str, [x, y]: [f64; 2], radius: f64) {
        self.add(&format!("<circle class=\"{class}\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius}\"/>"));
    }

    /// From the right of `centre` to the direction `[cos, sin]`, the shorter way; `clockwise` in the picture.
    pub(crate) fn arc(&mut self, class: &str, [x, y]: [f64; 2], radius: f64, [cos, sin]: [f64; 2], clockwise: bool) {
        let (start, end) = (x + radius, [x + radius * cos, y - radius * sin]);
        self.add(&format!(
            "<path class=\"{class}\" d=\"M{start:.1} {y:.1}A{radius:.1} {radius:.1} 0 0 {} {:.1} {:.1}\"/>",
            u8::from(clockwise),
            end[0],
            end[1]
        ));
    }

    /// `content` is numbers and letters, nothing that would need escaping.
    pub(crate) fn text(&mut self, class: &str, [x, y]: [f64; 2], anchor: &str, content: &str) {
        self.add(&format!(
            "<text class=\"{class}\" x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{content}</text>"
        ));
    }

    fn add(&mut self, element: &str) {
        let _ = writeln!(self.text, "{element}");
    }
}

/// Four digits, no zeros at the end.
pub(crate) fn number(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let digits = 3 - value.abs().log10().floor() as i32;
    if !(0..=9).contains(&digits) {
        return if digits < 0 { format!("{value:.0}") } else { format!("{value:.3e}") };
    }
    let text = format!("{value:.*}", digits as usize);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::number;

    #[test]
    fn numbers_are_short() {
        for (value, text) in
            [(0.0, "0"), (-0.1, "-0.1"), (636.396, "636.4"), (0.30000000000000004, "0.3"), (12000.0, "12000")]
        {
            assert_eq!(number(value), text);
        }
    }
}
