//! An FMU driven through FMI, beside the same model in this process.

use std::path::Path;

use cdpr::model_file::Model;
use cdpr::signal::{input_names, output_names, output_values};

use super::importer::Fmu;
use crate::csv_io::ResultWriter;
use crate::plot::Recording;
use crate::progress::Progress;
use crate::simulate;
use crate::whole::WholeFile;

/// Communication step (s).
pub(super) const STEP: f64 = 0.01;

/// What came of a run.
pub(super) struct Run {
    pub(super) recording: Recording,
    /// Largest difference between FMU and in-process run over all outputs.
    pub(super) in_process: f64,
    /// Real variables of the FMU.
    pub(super) variables: usize,
}

/// Drives the FMU of `model` from its start under its inputs for so many steps, writes what it shows to `table`, and hands it with
/// the time (s) to `each`.
pub(super) fn drive(
    path: &Path,
    model: &Model,
    table: &Path,
    steps: u32,
    mut each: impl FnMut(f64, &[f64]),
) -> anyhow::Result<Run> {
    let (cables, command) = (model.parameters.cables(), model.parameters.winch.command);
    let mut table = ResultWriter::new(WholeFile::create(table)?, cables, command)?;
    let fmu = Fmu::open(path)?;
    let mut slave = fmu.instantiate("demo")?;
    // The start pose is in the model; set through FMI all the same, as an importer would.
    for (name, value) in ["x", "y", "phi"].into_iter().zip(model.start.pose) {
        slave.set_real(name, value)?;
    }
    slave.initialise()?;
    let mut in_process = simulate::begin_simulation(model)?;
    let mut run = Run { recording: Recording::new(cables), in_process: 0.0, variables: slave.variables() };
    let mut progress = Progress::new("driving the FMU");
    let (inputs, outputs) = (input_names(cables, command), output_names(cables));
    for k in 0..=steps {
        if k > 0 {
            let begin = f64::from(k - 1) * STEP;
            slave.step(begin, STEP)?;
            in_process.advance_to(begin + STEP)?;
        }
        let time = f64::from(k) * STEP;
        let shown = slave.get_reals(&outputs)?;
        table.row(time, &slave.get_reals(&inputs)?, &shown)?;
        run.recording.add(time, &in_process.inputs(), &in_process.outputs());
        let own = output_values(&in_process.outputs());
        run.in_process = shown.iter().zip(&own).map(|(a, b)| (a - b).abs()).fold(run.in_process, f64::max);
        each(time, &shown);
        progress.update(f64::from(k) / f64::from(steps));
    }
    drop(progress);
    table.finish()?.finish()?;
    Ok(run)
}

/// A line on how the FMU and the run in this process agree.
pub(super) fn agreement(run: &Run) -> String {
    match run.in_process {
        0.0 => "The same run in this process gives the same numbers to the last bit.".to_owned(),
        difference => format!("The same run in this process differs by at most {difference:.1e}."),
    }
}
