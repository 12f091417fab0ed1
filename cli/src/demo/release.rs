//! First chapter: the paper's platform in an FMU, released and compared.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;

use cdpr::model_file::Model;
use cdpr::release::{RELEASE, RELEASE_POSE, ReleaseRow};
use cdpr::signal::{indexed, output_names};

use super::Made;
use super::drive::{Run, STEP, agreement, drive};
use crate::plot::{self, Figure, Line, Panel, Recording, Scale, Style};
use crate::{fmu, terminal, whole};

/// Cables of the robot that is released.
const CABLES: usize = 4;

/// Steps to the last row of the table.
const STEPS: u32 = 5000;

/// At a row of the table: time (s), and the largest difference in pose (m, rad), unstretched length (m), tension (N).
type Difference = (f64, [f64; 3]);

/// Builds the FMU, drives it through FMI, and writes what came of it into `out`.
pub(super) fn tell(out: &Path) -> anyhow::Result<Vec<Made>> {
    let mut model = Model::default();
    model.start.pose = RELEASE_POSE;
    let model_path = out.join("model.toml");
    let fmu_path = out.join("CablePlatform.fmu");
    let text = model.to_toml();
    whole::write(&model_path, &text)?;
    fmu::pack(&text, &[], &fmu_path)?;

    let csv_path = out.join("release.csv");
    let mut table = Vec::new();
    let run = drive(&fmu_path, &model, &csv_path, STEPS, |time, shown| {
        if let Some(row) = RELEASE.iter().find(|row| (row.time - time).abs() < 0.5 * STEP) {
            table.push((row.time, deviation(shown, row)));
        }
    })?;
    let svg_path = out.join("release.svg");
    whole::write(&svg_path, picture(&run.recording, &table).to_svg())?;
    report(&run, &table)?;
    Ok(vec![
        Made { path: fmu_path, what: "the FMU; load it in any FMI 2.0 tool" },
        Made { path: model_path, what: "the model inside" },
        Made { path: csv_path, what: "the release as the FMU gave it" },
        Made { path: svg_path, what: "the same as a picture" },
    ])
}

/// Largest difference of pose, unstretched lengths and tensions from a row of the table.
fn deviation(shown: &[f64], row: &ReleaseRow) -> [f64; 3] {
    let by_name: BTreeMap<String, f64> = output_names(CABLES).into_iter().zip(shown.iter().copied()).collect();
    let largest = |pairs: Vec<(String, f64)>| {
        pairs.into_iter().map(|(name, value)| (by_name[&name] - value).abs()).fold(0.0, f64::max)
    };
    let cables = |name: &str, values: [f64; CABLES]| {
        largest(values.into_iter().enumerate().map(|(i, value)| (indexed(name, i), value)).collect())
    };
    [
        largest(["x", "y", "phi"].map(String::from).into_iter().zip(row.pose).collect()),
        cables("unstretched_length", row.unstretched_length),
        cables("tension", row.tension),
    ]
}

fn picture(recording: &Recording, table: &[Difference]) -> Figure {
    let mut panels = plot::motion_panels(recording);
    let tensions: Vec<_> = (0..CABLES).map(plot::Channel::Tension).collect();
    panels.push(plot::cable_panel("tension", recording, &tensions, Style::Joined));
    let ring = |colour: usize, value: fn(&ReleaseRow, usize) -> f64, k: usize| Line {
        name: String::new(),
        points: RELEASE.iter().map(|row| [row.time, value(row, k)]).collect(),
        colour,
        style: Style::Rings,
    };
    for k in 0..2 {
        panels[0].lines.push(ring(k, |row, k| row.pose[k], k));
    }
    panels[1].lines.push(ring(0, |row, _| row.pose[2].to_degrees(), 2));
    for i in 0..CABLES {
        panels[2].lines.push(ring(i, |row, i| row.tension[i], i));
    }
    let names = ["pose (m, rad)", "length (m)", "tension (N)"];
    let lines = names.into_iter().enumerate().flat_map(|(k, name)| {
        let points: Vec<[f64; 2]> = table.iter().map(|(time, d)| [*time, d[k]]).collect();
        let line = |style, name: &str| Line { name: name.to_owned(), points: points.clone(), colour: k, style };
        [line(Style::Joined, name), line(Style::Rings, "")]
    });
    panels.push(Panel {
        title: "largest difference between FMU and table".into(),
        lines: lines.collect(),
        scale: Scale::Logarithmic,
    });
    Figure {
        title: "Released at x = y = 0.1 m, φ = 0.1 rad, every winch pulling 1 kN".into(),
        note: "Lines: the FMU. Rings: a table computed with an independent integrator.".into(),
        panels,
    }
}

fn report(run: &Run, table: &[Difference]) -> anyhow::Result<()> {
    let mut out = terminal::out();
    writeln!(out, "The platform of the paper, in an FMU ({} real variables), is released at", run.variables)?;
    writeln!(out, "x = y = 0.1 m, phi = 0.1 rad with every winch pulling 1000 N, and driven through FMI for 50 s.")?;
    writeln!(out)?;
    writeln!(out, "Largest difference from a table made with an independent integrator:")?;
    writeln!(out, "  {:>6}  {:>14}  {:>12}  {:>12}", "t (s)", "pose (m, rad)", "length (m)", "tension (N)")?;
    for (time, [pose, length, tension]) in table {
        writeln!(out, "  {time:>6}  {:>14}  {:>12}  {:>12}", small(*pose), small(*length), small(*tension))?;
    }
    writeln!(out, "(the table has 10 digits: 5e-12 in the pose, 5e-8 m, 5e-8 to 5e-7 N)")?;
    writeln!(out)?;
    writeln!(out, "{}", agreement(run))?;
    Ok(())
}

/// Two digits, or a plain zero.
fn small(value: f64) -> String {
    if value == 0.0 { "0".to_owned() } else { format!("{value:.1e}") }
}
