//! `cdpr simulate`: the plant in this process, from a table of inputs to a table of results.

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::Context;
use cdpr::dynamics::Inputs;
use cdpr::integrator::Solver;
use cdpr::model_file::{Model, ModelError};
use cdpr::plant::PlantError;
use cdpr::signal::output_values;
use cdpr::simulation::{Outputs, Simulation, StartError};

use crate::csv_io::{self, ResultWriter};
use crate::failure::BadInput;
use crate::plot::{self, Recording};
use crate::progress::Progress;
use crate::whole::WholeFile;
use crate::{model, number, output, terminal};

/// End time where there is neither `--stop` nor an input table (s).
const STOP: f64 = 60.0;

/// More rows than this are taken for a slip of the pen.
const MOST_ROWS: f64 = 1e8;

/// Simulate a model and write a table of results.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  \
    cdpr simulate --pose 0.1,0.1,0.1 --stop 50 -o release.csv --plot release.svg\n  \
    cdpr simulate --model model.toml --input forces.csv --step 0.02 -o run.csv\n\n\
    The input table has a header and the columns time (s), winch_force[1] and so on (N; winch_torque, \
    winch_speed or winch_length where the model's [winch] is commanded by these) and any of \
    disturbance_force_x, disturbance_force_y (N), disturbance_torque (N m); without such a column the disturbance of \
    the model's [start] acts all the time. Inputs are held from row to row; the run begins at the first row's time. \
    Without a table the model's start values are held from time 0.\n\n\
    A row of results shows the inputs from its time on, and the outputs just before they change. It can be an input \
    table again.")]
pub(crate) struct Arguments {
    /// The model file; the default model without it
    #[arg(long, value_name = "FILE.toml")]
    model: Option<PathBuf>,
    /// Table of inputs
    #[arg(long, value_name = "FILE.csv")]
    input: Option<PathBuf>,
    /// Pose at the start in m, m, rad, instead of the model's
    #[arg(long, value_name = "X,Y,PHI", value_parser = number::pose, allow_hyphen_values = true)]
    pose: Option<[f64; 3]>,
    /// End time in s; without it the last row's of the input table, or 60
    #[arg(long, value_name = "T", value_parser = number::finite, allow_hyphen_values = true)]
    stop: Option<f64>,
    /// Time between rows of results in s; does not change the solution
    #[arg(long, value_name = "H", default_value = "0.01", value_parser = number::positive)]
    step: f64,
    /// Table of results
    #[arg(short, long, value_name = "OUT.csv", value_parser = output::table())]
    output: PathBuf,
    /// Picture of the run, as SVG or PNG by its name
    #[arg(long, value_name = "OUT.svg", value_parser = output::picture())]
    plot: Option<PathBuf>,
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    output::distinct(&[("--output", Some(&arguments.output)), ("--plot", arguments.plot.as_ref())])?;
    let (_, mut model) = model::read(arguments.model.as_deref())?;
    let command = model.parameters.winch.command;
    let inputs = match &arguments.input {
        Some(path) => csv_io::read_inputs(path, &model.start.inputs, command)?,
        None => vec![(0.0, model.start.inputs)],
    };
    let begin = inputs[0].0;
    let last = inputs[inputs.len() - 1].0;
    let stop = arguments.stop.unwrap_or(if last > begin { last } else { begin + STOP });
    if stop <= begin {
        return Err(BadInput(format!("--stop is {stop}, expected more than the start time {begin}")).into());
    }
    if (stop - begin) / arguments.step > MOST_ROWS {
        let message = format!("--step is {}, which makes more than {MOST_ROWS:e} rows", arguments.step);
        return Err(BadInput(message).into());
    }
    model.start.pose = arguments.pose.unwrap_or(model.start.pose);
    model.start.time = begin;
    model.start.inputs = inputs[0].1;
    let mut simulation = begin_simulation(&model)?;

    let mut table = ResultWriter::new(WholeFile::create(&arguments.output)?, model.parameters.cables(), command)?;
    // Begun before the run: whether it can be written shows at once.
    let picture = arguments.plot.as_deref().map(WholeFile::create).transpose()?;
    let mut recording = picture.is_some().then(|| Recording::new(model.parameters.cables()));
    let mut progress = Progress::new("simulating");
    let mut blocked = false;
    let schedule = Schedule { inputs: &inputs, begin, stop, step: arguments.step };
    let geometry = *simulation.plant().geometry();
    follow(&mut simulation, &schedule, |time, inputs, outputs| {
        if let (Some(i), false) = (geometry.blocked_cable(&outputs.pose), blocked) {
            blocked = true;
            let cable = i + 1;
            terminal::tell(&format!(
                "warning: cable {cable} runs through the platform from t = {time} s on, which the equations take no \
                 notice of"
            ));
        }
        table.row(time, &csv_io::input_values(inputs), &output_values(outputs))?;
        if let Some(recording) = &mut recording {
            recording.add(time, inputs, outputs);
        }
        progress.update((time - begin) / (stop - begin));
        Ok(())
    })?;
    drop(progress);
    if let (Solver::DormandPrince, Some(since)) = (simulation.solver(), simulation.stiff_since()) {
        terminal::tell(&format!(
            "warning: the model is stiff, as found at t = {since} s: the explicit solver took steps as short as its fastest \
             motion asks for; `solver = \"auto\"` or \"radau\" would not"
        ));
    }
    table.finish()?.finish()?;
    if let (Some(mut file), Some(recording)) = (picture, &recording) {
        let title = arguments.model.as_deref().map_or("default model".into(), Path::to_string_lossy);
        let title = terminal::plain(&title);
        let svg = plot::run_picture(&format!("Simulation, {title}"), recording).to_svg();
        file.write_all(&output::drawn(svg, file.path())?)?;
        file.finish()?;
    }
    Ok(())
}

/// The simulation of a model; a start that the user can put right is bad input.
pub(crate) fn begin_simulation(model: &Model) -> anyhow::Result<Simulation> {
    model.check().and_then(|()| model.simulation()).map_err(|error| match error {
        ModelError::Value(_)
        | ModelError::Plant(PlantError::Parameter(_) | PlantError::Effect(_))
        | ModelError::Start(StartError::Parameter(_)) => BadInput(error.to_string()).into(),
        _ => error.into(),
    })
}

/// Inputs held from row to row, and when results are wanted.
pub(crate) struct Schedule<'a> {
    pub(crate) inputs: &'a [(f64, Inputs)],
    pub(crate) begin: f64,
    pub(crate) stop: f64,
    pub(crate) step: f64,
}

impl Schedule<'_> {
    /// Times that differ by rounding are one instant.
    fn same(&self, a: f64, b: f64) -> bool {
        (a - b).abs() <= 1e-9 * self.step.min(1.0) + 4.0 * f64::EPSILON * a.abs()
    }

    /// Time of row `k` of the results; `None` after the last.
    fn row(&self, k: u64) -> Option<f64> {
        let time = self.begin + k as f64 * self.step;
        if self.same(time, self.stop) {
            return Some(time);
        }
        if time < self.stop {
            return Some(time);
        }
        // The end is a row, even between the grid's points.
        let before = self.begin + k.saturating_sub(1) as f64 * self.step;
        (before < self.stop && !self.same(before, self.stop)).then_some(self.stop)
    }
}

/// Runs through the schedule. `take` gets every row: time, inputs from then on, outputs just before they change.
pub(crate) fn follow(
    simulation: &mut Simulation,
    schedule: &Schedule<'_>,
    mut take: impl FnMut(f64, &Inputs, &Outputs) -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    let mut next = 0;
    let mut inputs = schedule.inputs[0].1;
    for k in 0.. {
        let Some(time) = schedule.row(k) else { break };
        // Changes between the rows, then those that fall on this one.
        while let Some((change, values)) = schedule.inputs.get(next)
            && *change < time
            && !schedule.same(*change, time)
        {
            advance_to(simulation, *change)?;
            simulation.set_inputs(*values);
            inputs = *values;
            next += 1;
        }
        advance_to(simulation, time)?;
        let outputs = simulation.outputs();
        while let Some((change, values)) = schedule.inputs.get(next)
            && (*change <= time || schedule.same(*change, time))
        {
            simulation.set_inputs(*values);
            inputs = *values;
            next += 1;
        }
        take(time, &inputs, &outputs)?;
    }
    Ok(())
}

fn advance_to(simulation: &mut Simulation, time: f64) -> anyhow::Result<()> {
    if time > simulation.time() {
        simulation.advance_to(time).context("the simulation cannot go on")?;
        let y = simulation.states();
        anyhow::ensure!(
            simulation.plant().geometry().holds(&[y[0], y[1], y[2]]),
            "the platform leaves the space between the anchors before t = {time} s, at x = {:.3} m, y = {:.3} m",
            y[0],
            y[1]
        );
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(schedule: &Schedule<'_>) -> Vec<f64> {
        (0..).map_while(|k| schedule.row(k)).collect()
    }

    #[test]
    fn the_end_is_a_row_once() {
        let inputs = [(0.0, Inputs::none(4))];
        let schedule = |stop, step| Schedule { inputs: &inputs, begin: 0.0, stop, step };
        assert_eq!(rows(&schedule(1.0, 0.25)), [0.0, 0.25, 0.5, 0.75, 1.0]);
        assert_eq!(rows(&schedule(1.0, 0.4)), [0.0, 0.4, 0.8, 1.0]);
        assert_eq!(rows(&schedule(0.5, 2.0)), [0.0, 0.5]);
        assert_eq!(rows(&schedule(0.3, 0.1)).len(), 4);
        assert_eq!(rows(&schedule(60.0, 0.01)).len(), 6001);
    }

    #[test]
    fn inputs_change_between_rows_and_on_them() {
        let force = |f: f64| Inputs { winch_force: [f, 1000.0, 1000.0, 1000.0].into(), disturbance: [0.0; 3] };
        let inputs = [(0.0, force(1000.0)), (0.15, force(1500.0)), (0.3, force(2000.0))];
        let run = |step: f64| {
            let mut simulation = Model::default().simulation().unwrap();
            let mut last = None;
            let mut shown = Vec::new();
            let schedule = Schedule { inputs: &inputs, begin: 0.0, stop: 0.6, step };
            follow(&mut simulation, &schedule, |_, inputs, outputs| {
                shown.push(inputs.winch_force[0]);
                last = Some(*outputs);
                Ok(())
            })
            .unwrap();
            (shown, last.unwrap())
        };
        let (shown, coarse) = run(0.2);
        assert_eq!(shown, [1000.0, 1500.0, 2000.0, 2000.0]);
        let (shown, fine) = run(0.1);
        assert_eq!(shown[3], 2000.0, "the change at 0.3 falls on the row at 0.30000000000000004");
        for i in 0..4 {
            assert!((coarse.tension[i] - fine.tension[i]).abs() < 1e-4, "{coarse:?} {fine:?}");
        }
    }
}
