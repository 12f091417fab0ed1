//! Line charts in panels, drawn alike as SVG and PNG.

use std::path::Path;
use std::sync::Once;

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::{FontStyle, register_font};

use crate::PaperError;

/// Colours that keep apart for colour-blind readers (Okabe and Ito).
pub(crate) const BLUE: RGBColor = RGBColor(0, 114, 178);
pub(crate) const ORANGE: RGBColor = RGBColor(213, 94, 0);
pub(crate) const GREEN: RGBColor = RGBColor(0, 158, 115);
pub(crate) const PURPLE: RGBColor = RGBColor(170, 80, 150);
pub(crate) const CABLE_COLOURS: [RGBColor; 4] = [BLUE, ORANGE, GREEN, PURPLE];

const INK: RGBColor = RGBColor(40, 40, 40);
const GRID: RGBColor = RGBColor(228, 228, 228);

/// One line.
pub(crate) struct Line {
    pub(crate) label: String,
    pub(crate) colour: RGBColor,
    /// Drawn as dashes, for a line that lies upon another.
    pub(crate) dashed: bool,
    pub(crate) points: Vec<(f64, f64)>,
}

impl Line {
    pub(crate) fn new(label: &str, colour: RGBColor, time: &[f64], value: impl IntoIterator<Item = f64>) -> Self {
        let points = time.iter().copied().zip(value).filter(|(_, v)| v.is_finite()).collect();
        Self { label: label.to_owned(), colour, dashed: false, points }
    }

    pub(crate) fn dashed(mut self) -> Self {
        self.dashed = true;
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

/// A figure: columns of panels under one title.
pub(crate) struct Figure {
    pub(crate) title: String,
    pub(crate) columns: Vec<Column>,
}

const COLUMN_WIDTH: u32 = 560;
const PANEL_HEIGHT: u32 = 190;
const LEGEND_HEIGHT: f64 = 18.0;

impl Figure {
    fn size(&self) -> (u32, u32) {
        let rows = self.columns.iter().map(|c| c.panels.len()).max().unwrap_or(1) as u32;
        (COLUMN_WIDTH * self.columns.len() as u32, 90 + PANEL_HEIGHT * rows)
    }

    /// Writes `NAME.svg` and `NAME.png` (twice the pixels) into `folder`.
    pub(crate) fn write(&self, folder: &Path, name: &str) -> Result<(), PaperError> {
        static FONT: Once = Once::new();
        FONT.call_once(|| {
            // A font that is part of the program is known to be one.
            let _ = register_font("sans-serif", FontStyle::Normal, dejavu::sans::regular());
        });
        let failed = |what: String| PaperError::Figure(format!("{name}: {what}"));
        let (width, height) = self.size();
        let mut svg = String::new();
        {
            let area = SVGBackend::with_string(&mut svg, (width, height)).into_drawing_area();
            self.draw(&area, 1.0).map_err(failed)?;
        }
        crate::write_whole(&folder.join(format!("{name}.svg")), svg.as_bytes())?;
        let path = folder.join(format!("{name}.png"));
        let beside = folder.join(format!(".{name}.part.png"));
        {
            let area = BitMapBackend::new(&beside, (2 * width, 2 * height)).into_drawing_area();
            self.draw(&area, 2.0).map_err(failed)?;
        }
        std::fs::rename(&beside, &path).map_err(|error| PaperError::Write { path, error })
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
                draw_panel(&this, panel, scale, k == last)?;
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

fn tick(value: f64, step: f64) -> String {
    if value == 0.0 || value.abs() < 1e-9 * step {
        return "0".to_owned();
    }
    if value.abs() >= 1e5 || value.abs() < 1e-3 {
        let power = value.abs().log10().floor();
        let mantissa = value / 10f64.powf(power);
        let digits = ((power - step.abs().log10()).ceil().max(0.0) as usize).min(6);
        return format!("{mantissa:.digits$}e{power}");
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
        let style = line.colour.stroke_width(px(1.8) as u32);
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
    scale: f64,
    with_time: bool,
) -> Result<(), String> {
    let px = |v: f64| (v * scale).round() as u32;
    let text = |e: &dyn std::fmt::Display| e.to_string();
    let all = || panel.lines.iter().flat_map(|l| l.points.iter());
    let (left, right) = (all().map(|p| p.0).fold(f64::INFINITY, f64::min), all().map(|p| p.0).fold(0.0, f64::max));
    let (low, high) = limits(all().map(|p| p.1));
    let step = (high - low) / 5.0;
    draw_legend(area, panel, scale)?;
    let mut chart = ChartBuilder::on(area)
        .margin_right(px(18.0))
        .margin_top(px(LEGEND_HEIGHT))
        .margin_left(px(6.0))
        .x_label_area_size(if with_time { px(40.0) } else { px(16.0) })
        .y_label_area_size(px(74.0))
        .build_cartesian_2d(left.min(right)..right.max(left + 1e-9), low..high)
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
        .y_desc(panel.y_label.as_str())
        .x_label_formatter(&x_format)
        .y_label_formatter(&y_format);
    if with_time {
        mesh.x_desc("time (s)");
    }
    mesh.draw().map_err(|e| text(&e))?;
    for line in &panel.lines {
        let style = line.colour.stroke_width(px(1.8));
        let points = line.points.iter().copied();
        let (dash, gap) = (px(7.0), px(6.0));
        if line.dashed {
            chart.draw_series(DashedLineSeries::new(points, dash, gap, style)).map_err(|e| text(&e))?;
        } else {
            chart.draw_series(LineSeries::new(points, style)).map_err(|e| text(&e))?;
        }
    }
    Ok(())
}
