//! Work against precision, a panel for each case.

use std::collections::BTreeMap;
use std::path::Path;

use plotters::prelude::*;
use plotters::style::{FontStyle, register_font};

use crate::race::Outcomes;

const PANEL: (u32, u32) = (430, 320);
const COLUMNS: usize = 2;
/// Height of the row with the methods' names.
const NAMES: u32 = 44;
const COLOURS: [RGBColor; 8] = [
    RGBColor(200, 30, 30),
    RGBColor(240, 140, 0),
    RGBColor(30, 90, 200),
    RGBColor(90, 170, 230),
    RGBColor(40, 140, 60),
    RGBColor(130, 130, 130),
    RGBColor(60, 60, 60),
    RGBColor(120, 60, 160),
];

/// Writes the plot of all cases.
pub(crate) fn work_precision(cases: &[Outcomes], file: &Path) -> Result<(), String> {
    if cases.is_empty() {
        return Ok(());
    }
    draw(cases, file).map_err(|error| error.to_string())
}

fn draw(cases: &[Outcomes], file: &Path) -> Result<(), Box<dyn std::error::Error>> {
    register_font("sans-serif", FontStyle::Normal, dejavu::sans::regular()).map_err(|_| "the font cannot be read")?;
    let rows = cases.len().div_ceil(COLUMNS);
    let size = (PANEL.0 * COLUMNS as u32, NAMES + PANEL.1 * rows as u32);
    let root = SVGBackend::new(file, size).into_drawing_area();
    root.fill(&WHITE)?;
    let mut methods: Vec<&str> = Vec::new();
    for outcome in cases.iter().flat_map(|case| &case.outcomes) {
        if !methods.contains(&outcome.name.as_str()) {
            methods.push(&outcome.name);
        }
    }
    let (names, panels) = root.split_vertically(NAMES);
    for (place, method) in methods.iter().enumerate() {
        let (column, row) = (place % 4, place / 4);
        let at = (30 + 205 * column as i32, 12 + 18 * row as i32);
        let colour = COLOURS[place % COLOURS.len()];
        names.draw(&PathElement::new(vec![(at.0, at.1 + 6), (at.0 + 18, at.1 + 6)], colour.stroke_width(3)))?;
        names.draw(&Text::new(*method, (at.0 + 24, at.1), ("sans-serif", 12)))?;
    }
    for (panel, case) in panels.split_evenly((rows, COLUMNS)).iter().zip(cases) {
        let mut lines = BTreeMap::<&str, Vec<(f64, f64)>>::new();
        for outcome in &case.outcomes {
            if let Ok(error) = outcome.error {
                lines.entry(&outcome.name).or_default().push((error.max(1e-15), 1e6 * outcome.time[1]));
            }
        }
        let all = || lines.values().flatten();
        let range = |value: fn(&(f64, f64)) -> f64| {
            let (low, high) = all().map(value).fold((f64::INFINITY, 0.0_f64), |(a, b), v| (a.min(v), b.max(v)));
            0.7 * low..1.4 * high
        };
        let mut chart = ChartBuilder::on(panel)
            .caption(&case.title, ("sans-serif", 15))
            .margin(8)
            .x_label_area_size(34)
            .y_label_area_size(48)
            .build_cartesian_2d(range(|p| p.0).log_scale(), range(|p| p.1).log_scale())?;
        chart
            .configure_mesh()
            .x_desc("largest error (m)")
            .y_desc("µs a step")
            .x_label_formatter(&|value| format!("{value:.0e}"))
            .light_line_style(WHITE)
            .draw()?;
        for (place, method) in methods.iter().enumerate() {
            let Some(points) = lines.get_mut(method) else { continue };
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
            let colour = COLOURS[place % COLOURS.len()];
            chart.draw_series(LineSeries::new(points.iter().copied(), colour.stroke_width(2)))?;
            chart.draw_series(points.iter().map(|point| Circle::new(*point, 3, colour.filled())))?;
        }
    }
    root.present()?;
    Ok(())
}
