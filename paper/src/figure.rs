//! Line charts in panels: drawn as SVG, and the PNG made from it.

use std::path::Path;
use std::sync::{Arc, LazyLock, Once};

use crate::CABLES;
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::{FontStyle, register_font};
use resvg::{tiny_skia, usvg};

use crate::PaperError;
use crate::thin::thin;

/// Colours that keep apart for colour-blind readers (Okabe and Ito).
pub(crate) const BLUE: RGBColor = RGBColor(0, 114, 178);
pub(crate) const ORANGE: RGBColor = RGBColor(213, 94, 0);
pub(crate) const GREEN: RGBColor = RGBColor(0, 158, 115);
const PURPLE: RGBColor = RGBColor(170, 80, 150);
const CABLE_COLOURS: [RGBColor; CABLES] = [BLUE, ORANGE, GREEN, PURPLE];

const INK: RGBColor = RGBColor(40, 40, 40);
const GRID: RGBColor = RGBColor(228, 228, 228);

/// One line.
pub(crate) struct Line {
    pub(crate) label: String,
    pub(crate) colour: RGBColor,
    /// Drawn as dashes, for a line that lies upon another.
    dashed: bool,
    points: Vec<(f64, f64)>,
}

impl Line {
    pub(crate) fn new(label: &str, colour: RGBColor, time: &[f64], value: impl IntoIterator<Item = f64>) -> Self {
        let points = time.iter().copied().zip(value).filter(|(_, v)| v.is_finite()).collect();
        Self { label: label.to_owned(), colour, dashed: false, points }
    }

    /// Lines of the four cables, `value(i)` that of cable `i` from 0; cables that cannot be told apart share one.
    pub(crate) fn of_cables<I: IntoIterator<Item = f64>>(time: &[f64], value: impl Fn(usize) -> I) -> Vec<Self> {
        let values: [Vec<f64>; CABLES] = std::array::from_fn(|i| value(i).into_iter().collect());
        let (low, high) = values
            .iter()
            .flatten()
            .filter(|v| v.is_finite())
            .fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(*v), b.max(*v)));
        let alike = |i: usize, k: usize| {
            let apart = values[i].iter().zip(&values[k]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            apart < 0.01 * (high - low)
        };
        let mut groups: Vec<Vec<usize>> = Vec::new();
        for i in 0..CABLES {
            match groups.iter_mut().find(|g| alike(g[0], i)) {
                Some(group) => group.push(i),
                None => groups.push(vec![i]),
            }
        }
        let named = |group: &Vec<usize>| {
            let numbers: Vec<String> = group.iter().map(|i| (i + 1).to_string()).collect();
            let label = format!("cable{} {}", if group.len() > 1 { "s" } else { "" }, numbers.join(", "));
            Self::new(&label, CABLE_COLOURS[group[0]], time, values[group[0]].iter().copied())
        };
        groups.iter().map(named).collect()
    }

    pub(crate) fn dashed(mut self) -> Self {
        self.dashed = true;
        self
    }

    pub(crate) fn unlabelled(mut self) -> Self {
        self.label.clear();
        self
    }
}

/// One pair of axes over time.
pub(crate) struct Panel {
    pub(crate) y_label: String,
    pub(crate) lines: Vec<Line>,
}

impl Panel {
    pub(crate) fn new(y_label: &str, lines: Vec<Line>) -> Self {
        Self { y_label: y_label.to_owned(), lines }
    }
}

/// A column of panels over one time axis.
pub(crate) struct Column {
    pub(crate) title: String,
    pub(crate) panels: Vec<Panel>,
}

impl Column {
    /// First and last time of all its lines.
    fn time_range(&self) -> (f64, f64) {
        let times = self.panels.iter().flat_map(|p| &p.lines).flat_map(|l| &l.points).map(|p| p.0);
        let (first, last) = times.fold((f64::INFINITY, 0.0_f64), |(a, b), t| (a.min(t), b.max(t)));
        (first.min(last), last.max(first.min(last) + 1e-9))
    }
}

/// A figure: columns of panels under one title.
pub(crate) struct Figure {
    pub(crate) title: String,
    pub(crate) columns: Vec<Column>,
}

const COLUMN_WIDTH: u32 = 560;
const PANEL_HEIGHT: u32 = 190;
const LEGEND_HEIGHT: f64 = 18.0;
const LINE_WIDTH: f64 = 1.8;
/// The drawing library rounds to whole units; a unit is a quarter of a pixel.
const UNITS: f64 = 4.0;
/// Pixels of the PNG in one of the SVG.
const ENLARGED: u32 = 2;

/// The font of the PNG, whatever the machine has.
static FONTS: LazyLock<Arc<usvg::fontdb::Database>> = LazyLock::new(|| {
    let mut fonts = usvg::fontdb::Database::new();
    fonts.load_font_data(dejavu::sans::regular().to_vec());
    fonts.set_sans_serif_family("DejaVu Sans");
    Arc::new(fonts)
});

/// An SVG as PNG, with two pixels for each of its own; texts in DejaVu Sans.
///
/// # Errors
/// Text that is no SVG, or a picture without an area.
pub fn png(svg: &str) -> Result<Vec<u8>, String> {
    let options = usvg::Options { fontdb: FONTS.clone(), ..usvg::Options::default() };
    let tree = usvg::Tree::from_str(svg, &options).map_err(|e| e.to_string())?;
    let size = tree.size().to_int_size();
    let mut pixels = tiny_skia::Pixmap::new(ENLARGED * size.width(), ENLARGED * size.height())
        .ok_or_else(|| "it has no area".to_owned())?;
    let scale = tiny_skia::Transform::from_scale(ENLARGED as f32, ENLARGED as f32);
    resvg::render(&tree, scale, &mut pixels.as_mut());
    pixels.encode_png().map_err(|e| e.to_string())
}

impl Figure {
    fn size(&self) -> (u32, u32) {
        let rows = self.columns.iter().map(|c| c.panels.len()).max().unwrap_or(1) as u32;
        (COLUMN_WIDTH * self.columns.len() as u32, 90 + PANEL_HEIGHT * rows)
    }

    /// Writes `NAME.svg` and `NAME.png` (twice the pixels) into `folder`.
    pub(crate) fn write(&self, folder: &Path, name: &str) -> Result<(), PaperError> {
        let failed = |what: String| PaperError::Figure(format!("{name}: {what}"));
        let svg = self.svg().map_err(failed)?;
        let png = png(&svg).map_err(failed)?;
        crate::write_whole(&folder.join(format!("{name}.svg")), svg.as_bytes())?;
        crate::write_whole(&folder.join(format!("{name}.png")), &png)
    }

    fn svg(&self) -> Result<String, String> {
        static FONT: Once = Once::new();
        FONT.call_once(|| {
            // A font that is part of the program is known to be one. It is for measuring: the viewer draws with its own.
            let _ = register_font("sans-serif", FontStyle::Normal, dejavu::sans::regular());
        });
        let (width, height) = self.size();
        let (fine_width, fine_height) = (width * UNITS as u32, height * UNITS as u32);
        let mut svg = String::new();
        {
            let area = SVGBackend::with_string(&mut svg, (fine_width, fine_height)).into_drawing_area();
            self.draw(&area, UNITS)?;
        }
        // The size is in pixels, the content in units; sharp turns of a line have no spikes.
        let drawn = format!("<svg width=\"{fine_width}\" height=\"{fine_height}\"");
        let wanted = format!("<svg width=\"{width}\" height=\"{height}\" stroke-linejoin=\"round\"");
        Ok(svg.replacen(&drawn, &wanted, 1))
    }

    fn draw<B: DrawingBackend>(&self, area: &DrawingArea<B, Shift>, scale: f64) -> Result<(), String> {
        let px = |v: f64| (v * scale).round() as u32;
        let text = |e: &dyn std::fmt::Display| e.to_string();
        area.fill(&WHITE).map_err(|e| text(&e))?;
        let title = ("sans-serif", 17.0 * scale).into_font().color(&INK);
        area.draw(&Text::new(self.title.as_str(), (px(16.0) as i32, px(12.0) as i32), title)).map_err(|e| text(&e))?;
        let (_, body) = area.split_vertically(px(38.0));
        for (column, area) in self.columns.iter().zip(body.split_evenly((1, self.columns.len()))) {
            let caption = ("sans-serif", 13.5 * scale).into_font().color(&INK);
            area.draw(&Text::new(column.title.as_str(), (px(16.0) as i32, px(2.0) as i32), caption))
                .map_err(|e| text(&e))?;
            let (_, panels) = area.split_vertically(px(24.0));
            let last = column.panels.len() - 1;
            // The lowest panel also carries the time axis.
            let (_, height) = panels.dim_in_pixel();
            let extra = px(24.0);
            let each = (height - extra) / column.panels.len() as u32;
            let mut rest = panels;
            for (k, panel) in column.panels.iter().enumerate() {
                let (this, below) = rest.split_vertically(if k == last { each + extra } else { each });
                draw_panel(&this, panel, column.time_range(), scale, k == last)?;
                rest = below;
            }
        }
        area.present().map_err(|e| text(&e))
    }
}

/// Limits a little beyond the values, round enough to read.
fn limits(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
    if !(low.is_finite() && high.is_finite()) {
        return (-1.0, 1.0);
    }
    // A flat line is shown as one: its rounding is not magnified to a picture.
    let least = 1e-9 * low.abs().max(high.abs()).max(1e-6);
    let margin = (0.07 * (high - low)).max(least);
    (low - margin, high + margin)
}

/// The power of ten that an axis is labelled in, so that its numbers are short.
fn exponent(low: f64, high: f64) -> i32 {
    let largest = low.abs().max(high.abs());
    if largest > 0.0 && !(0.02..1e5).contains(&largest) { 3 * (largest.log10() / 3.0).floor() as i32 } else { 0 }
}

/// `name (unit)` with the power of ten before the unit.
fn axis_label(label: &str, exponent: i32) -> String {
    if exponent == 0 {
        return label.to_owned();
    }
    let power: String = exponent
        .to_string()
        .chars()
        .map(|c| if c == '-' { '⁻' } else { SUPERSCRIPTS[c as usize - '0' as usize] })
        .collect();
    match label.strip_suffix(')').and_then(|l| l.rsplit_once('(')) {
        Some((name, unit)) => format!("{name}(10{power} {unit})"),
        None => format!("{label} (10{power})"),
    }
}

const SUPERSCRIPTS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];

/// A number on an axis whose ticks are about `step` apart.
fn tick(value: f64, step: f64) -> String {
    if value.abs() < 1e-9 * step {
        return "0".to_owned();
    }
    let digits = (-step.abs().log10()).ceil().clamp(0.0, 9.0) as usize;
    format!("{value:.digits$}")
}

/// Names of the lines in a strip above the axes, where they hide nothing.
fn draw_legend<B: DrawingBackend>(area: &DrawingArea<B, Shift>, panel: &Panel, scale: f64) -> Result<(), String> {
    let px = |v: f64| (v * scale).round() as i32;
    let font = ("sans-serif", 11.5 * scale).into_font().color(&INK);
    let mut left = px(86.0);
    for line in panel.lines.iter().filter(|l| !l.label.is_empty()) {
        let y = px(0.5 * LEGEND_HEIGHT);
        let style = line.colour.stroke_width(px(LINE_WIDTH) as u32);
        let strokes: &[(f64, f64)] = if line.dashed { &[(0.0, 8.0), (13.0, 21.0)] } else { &[(0.0, 21.0)] };
        for (from, to) in strokes {
            let ends = vec![(left + px(*from), y), (left + px(*to), y)];
            area.draw(&PathElement::new(ends, style)).map_err(|e| e.to_string())?;
        }
        let at = (left + px(26.0), y - px(4.0));
        area.draw(&Text::new(line.label.as_str(), at, font.clone())).map_err(|e| e.to_string())?;
        left += px(26.0 + 16.0 + 7.2 * line.label.chars().count() as f64);
    }
    Ok(())
}

fn draw_panel<B: DrawingBackend>(
    area: &DrawingArea<B, Shift>,
    panel: &Panel,
    (left, right): (f64, f64),
    scale: f64,
    with_time: bool,
) -> Result<(), String> {
    let px = |v: f64| (v * scale).round() as u32;
    let text = |e: &dyn std::fmt::Display| e.to_string();
    let all = || panel.lines.iter().flat_map(|l| l.points.iter());
    let (low, high) = limits(all().map(|p| p.1));
    let power = exponent(low, high);
    let unit = 10f64.powi(power);
    let (low, high) = (low / unit, high / unit);
    let step = (high - low) / 5.0;
    draw_legend(area, panel, scale)?;
    let mut chart = ChartBuilder::on(area)
        .margin_right(px(18.0))
        .margin_top(px(LEGEND_HEIGHT))
        .margin_left(px(6.0))
        .x_label_area_size(if with_time { px(40.0) } else { px(16.0) })
        .y_label_area_size(px(74.0))
        .build_cartesian_2d(left..right, low..high)
        .map_err(|e| text(&e))?;
    let label = ("sans-serif", 12.0 * scale).into_font().color(&INK);
    let y_format = |v: &f64| tick(*v, step);
    let x_format = |v: &f64| tick(*v, (right - left) / 10.0);
    let mut mesh = chart.configure_mesh();
    mesh.x_labels(if with_time { 8 } else { 0 })
        .y_labels(5)
        .light_line_style(TRANSPARENT)
        .bold_line_style(GRID.stroke_width(px(1.0)))
        .axis_style(INK.stroke_width(px(1.0)))
        .label_style(label.clone())
        .axis_desc_style(label.clone())
        .y_desc(axis_label(&panel.y_label, power))
        .x_label_formatter(&x_format)
        .y_label_formatter(&y_format);
    if with_time {
        mesh.x_desc("time (s)");
    }
    mesh.draw().map_err(|e| text(&e))?;
    let (width, height) = chart.plotting_area().dim_in_pixel();
    let pixel = ((right - left) / f64::from(width) * scale, (high - low) / f64::from(height) * scale);
    for line in &panel.lines {
        let style = line.colour.stroke_width(px(LINE_WIDTH));
        let points: Vec<(f64, f64)> = line.points.iter().map(|(t, v)| (*t, v / unit)).collect();
        let points = thin(&points, pixel);
        let (dash, gap) = (px(7.0), px(6.0));
        if line.dashed {
            chart.draw_series(DashedLineSeries::new(points, dash, gap, style)).map_err(|e| text(&e))?;
        } else {
            chart.draw_series(LineSeries::new(points, style)).map_err(|e| text(&e))?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_numbers_are_labelled_in_powers_of_ten() {
        assert_eq!(axis_label("strain", exponent(0.0, 6.58e-5)), "strain (10⁻⁶)");
        assert_eq!(axis_label("Δx (m)", exponent(-8e-7, 0.0)), "Δx (10⁻⁹ m)");
        assert_eq!(axis_label("tension (N)", exponent(1300.0, 1700.0)), "tension (N)");
        assert_eq!(axis_label("x (m)", exponent(0.0, 0.0)), "x (m)");
    }

    #[test]
    fn panels_of_a_column_share_the_longest_time() {
        let panel = |end: f64| Panel::new("x", vec![Line::new("", BLUE, &[0.0, end], [0.0, 1.0])]);
        let column = Column { title: String::new(), panels: vec![panel(5.0), panel(3.0)] };
        assert_eq!(column.time_range(), (0.0, 5.0));
    }

    #[test]
    fn cables_that_lie_upon_each_other_share_a_line() {
        let lines = Line::of_cables(&[0.0, 1.0], |i| [0.0, if i % 2 == 1 { 2.0 } else { f64::from(i as u8) }]);
        let labels: Vec<&str> = lines.iter().map(|l| l.label.as_str()).collect();
        assert_eq!(labels, ["cable 1", "cables 2, 3, 4"]);
    }

    #[test]
    fn numbers_have_the_digits_that_tell_ticks_apart() {
        assert_eq!(tick(65.8, 0.1), "65.8");
        assert_eq!(tick(-0.05, 0.05), "-0.05");
        assert_eq!(tick(1e-15, 0.05), "0");
        assert_eq!(tick(350.0, 35.0), "350");
    }
}
