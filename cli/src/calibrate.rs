//! `cdpr calibrate`: anchors, attachments, length offsets and the pose's frame from the kinematics of recordings.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::PathBuf;

use cdpr_discovery::calibrate::{CalibrateError, Calibration, Correction, TOLD, calibrate};
use cdpr_discovery::data::{ColumnMap, read_kinematics};

use crate::failure::BadInput;
use crate::{model, terminal, whole};

/// Correct a model's geometry by the kinematics of recordings.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  \
    cdpr calibrate --data slow.csv -o model.toml\n  \
    cdpr calibrate --data a.csv b.csv --model nominal.toml --map map.toml -o calibrated.toml\n\n\
    The recordings are those of cdpr discover. They need lengths: cable_length[i], or unstretched_length[i] with the forces of \
    winches commanded by force or a column tension[i], by which the cable is stretched; and x, y and phi, or more lengths than it takes \
    to tell those of them that are not measured. Slow motion through all of the workspace tells most.\n\n\
    Corrected are anchors, attachments and what each length counts from. What the recordings cannot tell apart is held at the \
    given value and named. More in docs/calibrate.md.")]
pub(crate) struct Arguments {
    /// Recordings
    #[arg(long, value_name = "FILE.csv", num_args = 1.., required = true)]
    data: Vec<PathBuf>,
    /// The model as it is; the default model without it
    #[arg(long, value_name = "FILE.toml")]
    model: Option<PathBuf>,
    /// Columns and units of the recordings, where they are not ours
    #[arg(long, value_name = "FILE.toml")]
    map: Option<PathBuf>,
    /// The corrected model
    #[arg(short, long, value_name = "FILE.toml")]
    output: PathBuf,
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let (_, base) = model::read(arguments.model.as_deref())?;
    let cables = base.parameters.cables();
    let map = match &arguments.map {
        Some(path) => ColumnMap::read(path, cables).map_err(|e| BadInput(e.to_string()))?,
        None => ColumnMap::default(),
    };
    let trials: Result<Vec<_>, BadInput> = arguments
        .data
        .iter()
        .map(|path| read_kinematics(path, &map, cables).map_err(|e| BadInput(e.to_string())))
        .collect();
    let found = calibrate(&base, &trials?).map_err(|error| match error {
        CalibrateError::Data(message) => anyhow::Error::from(BadInput(message)),
        other => other.into(),
    })?;
    let table = table(&found);
    let comments: String = table.lines().map(|line| format!("# {line}").trim_end().to_owned() + "\n").collect();
    let names: Vec<String> = arguments.data.iter().map(|path| path.display().to_string()).collect();
    let head = format!("# Geometry calibrated by {}:\n#\n{comments}\n", names.join(", "));
    whole::write(&arguments.output, head + &found.model.to_toml())?;
    let mut out = terminal::out();
    write!(out, "{table}")?;
    writeln!(out, "\nWritten: {}", arguments.output.display())?;
    Ok(out.flush()?)
}

/// The corrections and what is left, in columns. Lengths in mm: what is corrected is small.
fn table(found: &Calibration) -> String {
    let mut text = String::new();
    let mut line = |cells: [&str; 5]| {
        let [name, given, change, error, note] = cells;
        let row = format!("{name:<30} {given:>14} {change:>12} {error:>12}  {note}");
        let _ = writeln!(text, "{}", row.trim_end());
    };
    line(["", "given (m)", "change (mm)", "± (mm)", ""]);
    for Correction { name, given, change, standard_error, told } in &found.corrections {
        let note = if *told < TOLD { format!("{:.0} % told, the rest held", 100.0 * told) } else { String::new() };
        let in_mm = |v: f64| format!("{:.3}", 1e3 * v);
        line([name, &format!("{given:.6}"), &in_mm(*change), &in_mm(*standard_error), &note]);
    }
    let [x, y] = found.frame.shift;
    let (turn, turn_error) = found.frame.turn;
    let _ = writeln!(
        text,
        "\nThe anchors on the whole (the frame of the poses, where all moved alike): shifted by {:.3} ± {:.3} mm, {:.3} ± {:.3} mm, turned by {:.4} ± {:.4} mrad",
        1e3 * x.0,
        1e3 * x.1,
        1e3 * y.0,
        1e3 * y.1,
        1e3 * turn,
        1e3 * turn_error
    );
    for held in &found.held {
        let _ = writeln!(text, "Held, not told apart by these data: {held}");
    }
    let _ = writeln!(
        text,
        "\n{:<30} {:>14} {:>12} {:>12}",
        "misfit, root mean square", "before (mm)", "after (mm)", "samples"
    );
    for misfit in &found.misfits {
        let (before, after) = (1e3 * misfit.before, 1e3 * misfit.after);
        let _ = writeln!(text, "{:<30} {before:>14.3} {after:>12.3} {:>12}", misfit.channel.name(), misfit.samples);
    }
    if found.outliers > 0 {
        let _ = writeln!(text, "{} numbers are far off and left out of the misfits", found.outliers);
    }
    if found.widened > 1.05 {
        let _ = writeln!(
            text,
            "Errors are widened {:.1} times: what is left is more than white noise of the channels' size",
            found.widened
        );
    }
    for remark in &found.remarks {
        let _ = writeln!(text, "{remark}");
    }
    text
}
