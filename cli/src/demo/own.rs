//! The demo of a model that is given: packed, driven from its start, compared, drawn.

use std::io::Write;
use std::path::Path;

use super::Made;
use super::drive::{STEP, agreement, drive};
use crate::failure::BadInput;
use crate::plot::{self, Figure, Style};
use crate::{fmu, model, terminal, whole};

/// Cables that it takes to hold a platform in the plane.
const FEWEST: usize = 3;
/// Steps of the run.
const STEPS: u32 = 1000;

/// Packs the model of `path`, drives its FMU from its start under the inputs of its start, and writes what came of it into `out`.
pub(super) fn tell(path: &Path, out: &Path) -> anyhow::Result<Vec<Made>> {
    let (text, model) = model::read(Some(path))?;
    let cables = model.parameters.cables();
    if cables < FEWEST {
        let found = format!("{cables} cables, expected {FEWEST} or more: fewer do not hold a platform in the plane");
        return Err(BadInput::in_file(path, found).into());
    }
    model::folder(out)?;
    let fmu_path = out.join("CablePlatform.fmu");
    fmu::pack(&text, &[], &fmu_path)?;
    let csv_path = out.join("run.csv");
    let run = drive(&fmu_path, &model, &csv_path, STEPS, |_, _| ())?;
    let mut panels = plot::motion_panels(&run.recording);
    let tensions: Vec<_> = (0..cables).map(plot::Channel::Tension).collect();
    panels.push(plot::cable_panel("tension", &run.recording, &tensions, Style::Joined));
    let svg_path = out.join("run.svg");
    let figure = Figure {
        title: format!("{cables} cables, from the start of the model under its inputs"),
        note: "Driven through FMI.".into(),
        panels,
    };
    whole::write(&svg_path, figure.to_svg())?;
    let mut out = terminal::out();
    writeln!(
        out,
        "Your robot of {cables} cables, in an FMU ({} real variables), is driven through FMI for {} s from the start of the",
        run.variables,
        f64::from(STEPS) * STEP
    )?;
    writeln!(out, "model, under the inputs of that start.\n{}", agreement(&run))?;
    writeln!(out, "What hides in recordings is shown on the paper's robot, by `cdpr demo` without --model.")?;
    Ok(vec![
        Made { path: fmu_path, what: "the FMU; load it in any FMI 2.0 tool" },
        Made { path: csv_path, what: "the run as the FMU gave it" },
        Made { path: svg_path, what: "the same as a picture" },
    ])
}
