//! `cdpr inverse`: the winch forces of a prescribed motion.

use std::io::Write as _;
use std::path::PathBuf;

use cdpr::dynamics::Inputs;
use cdpr::inverse::{Ends, Instant, InverseDynamics, InverseError, SplineTrajectory, Trajectory};
use cdpr::model_file::Model;
use cdpr::parameters::{CableModel, Initialization};
use cdpr::signal::{indexed, input_names};
use cdpr::winch::WinchCommand;
use cdpr_fmu_build::whole_file;
use clap::ValueEnum;

use crate::csv_io::input_values;
use crate::failure::BadInput;
use crate::redundancy::Choice;
use crate::whole::{self, WholeFile};
use crate::{model, number, output, terminal, trajectory_csv};

/// More rows than this are taken for a slip of the pen.
const MOST_ROWS: f64 = 1e7;

/// Winch forces for a trajectory, tensions kept within bounds.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  \
    cdpr inverse --trajectory circle.csv --step 0.01 --held -o forces.csv --start circle.toml\n  \
    cdpr simulate --model circle.toml --input forces.csv -o run.csv\n\n\
    The trajectory is a table with the columns time (s), x, y (m), phi (rad); where given, vx, vy (m/s), omega (rad/s), and \
    with them ax, ay (m/s2), alpha (rad/s2); and any of disturbance_force_x, disturbance_force_y (N), disturbance_torque \
    (N m); without such a column the disturbance of the model's [start] acts all the time. The motion is met at every sample; between them it is a spline of degree 7. The forces are a table of inputs for cdpr \
    simulate, torques, speeds or lengths where these command the model's winches, with tensions and paid-out lengths beside them.\n\n\
    Where no tensions within the bounds make the motion, the command fails and says when, which wrench was asked for and \
    what comes nearest.")]
pub(crate) struct Arguments {
    /// The model file; the default model without it
    #[arg(long, value_name = "FILE.toml")]
    model: Option<PathBuf>,
    /// Table of the motion
    #[arg(long, value_name = "TRAJ.csv")]
    trajectory: PathBuf,
    /// How the motion ends where no rates are given
    #[arg(long, value_enum, default_value_t = EndChoice::Natural)]
    ends: EndChoice,
    /// Time between rows of the forces in s; without it the trajectory's own times
    #[arg(long, value_name = "H", value_parser = number::positive)]
    step: Option<f64>,
    /// Give each row the forces and disturbances of the middle of its time, for inputs held from row to row
    #[arg(long)]
    held: bool,
    #[command(flatten)]
    choice: Choice,
    /// Table of forces
    #[arg(short, long, value_name = "FORCES.csv", value_parser = output::table())]
    output: PathBuf,
    /// Also write the model with its start on the trajectory
    #[arg(long, value_name = "FILE.toml", value_parser = output::model())]
    start: Option<PathBuf>,
}

#[derive(Clone, Copy, ValueEnum)]
enum EndChoice {
    /// A piece of a longer motion
    Natural,
    /// At rest at both ends
    Rest,
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    output::distinct(&[("--output", Some(&arguments.output)), ("--start", arguments.start.as_ref())])?;
    let (_, mut model) = model::read(arguments.model.as_deref())?;
    let motion = trajectory_csv::read(&arguments.trajectory, model.start.inputs.disturbance)?;
    let trajectory_csv::Motion { samples, lines } = motion;
    let (_, redundancy) = arguments.choice.resolve(&model.parameters, None)?;
    let ends = match arguments.ends {
        EndChoice::Natural => Ends::Natural,
        EndChoice::Rest => Ends::Rest,
    };
    let trajectory =
        SplineTrajectory::new(&samples, ends).map_err(|error| BadInput::in_file(&arguments.trajectory, error))?;
    let plant = model.plant()?;
    for (pose, line) in samples.pose.iter().zip(&lines) {
        let bad = |error| BadInput::in_file(&arguments.trajectory, format!("line {line}: {error}"));
        plant.geometry().check_pose(pose).map_err(bad)?;
    }
    let times = match arguments.step {
        Some(step) => grid(trajectory.span(), step)?,
        None => samples.time,
    };
    let problem =
        InverseDynamics::new(plant, &trajectory, redundancy.as_ref()).map_err(|error| match &arguments.model {
            Some(path) => BadInput::in_file(path, error),
            None => BadInput(error.to_string()),
        })?;
    let mut forces = Forces::begin(arguments, model.parameters.cables(), model.parameters.winch.command)?;
    let done = if arguments.held {
        let mut row = None;
        let done = problem.each(&with_middles(&times), model.relative_tolerance, |instant| -> anyhow::Result<()> {
            // A row waits for the forces in the middle of its time; the last keeps its own.
            match row.take() {
                None => row = Some(instant),
                Some(begin) => forces.row(&begin, &instant.inputs())?,
            }
            Ok(())
        });
        done.and_then(|()| row.map_or(Ok(()), |last| forces.row(&last, &last.inputs())))
    } else {
        problem.each(&times, model.relative_tolerance, |instant| forces.row(&instant, &instant.inputs()))
    };
    done.map_err(|error| match error.downcast::<InverseError>() {
        Ok(error @ InverseError::Pose { .. }) => BadInput::in_file(&arguments.trajectory, error).into(),
        Ok(error) => anyhow::Error::from(error).context(arguments.trajectory.display().to_string()),
        Err(other) => other,
    })?;
    let summary = forces.finish()?;
    if let (Some(path), Some(first)) = (&arguments.start, &summary.first) {
        start_on(&mut model, first);
        whole::write(path, model.to_toml())?;
    }
    if let Some((time, cable, force)) = summary.pushed {
        terminal::tell(&format!(
            "warning: at t = {time} s the force of winch {} is {force:.1} N, and a winch cannot push. The tensions are \
             within their bounds, but the cable's own inertia takes more than they leave, most where they have a kink: raise \
             --tension-min, round the kinks with --smooth, or take --objective analytic-centre",
            cable + 1
        ));
    }
    // The table may have gone to standard output.
    if whole_file::is_stream(&arguments.output) { Ok(()) } else { summary.tell() }
}

fn grid([first, last]: [f64; 2], step: f64) -> anyhow::Result<Vec<f64>> {
    let count = ((last - first) / step * (1.0 + 1e-12)).floor();
    if count > MOST_ROWS {
        return Err(BadInput(format!("--step is {step}, which makes more than {MOST_ROWS:e} rows")).into());
    }
    let mut times: Vec<f64> = (0..=count as u64).map(|k| (first + k as f64 * step).min(last)).collect();
    if times.last().is_some_and(|t| last - t > 1e-9 * step) {
        times.push(last);
    }
    Ok(times)
}

/// The times with the middle of each stretch after its begin.
fn with_middles(times: &[f64]) -> Vec<f64> {
    let mut all: Vec<f64> = times.windows(2).flat_map(|pair| [pair[0], 0.5 * (pair[0] + pair[1])]).collect();
    all.extend(times.last());
    all
}

/// The table of forces being written.
struct Forces {
    csv: csv::Writer<WholeFile>,
    summary: Summary,
}

/// What is told of the forces in the end.
struct Summary {
    first: Option<Instant>,
    rows: usize,
    /// Rows with a tension at a bound.
    at_bound: usize,
    /// Least and largest tension (N).
    tension: [f64; 2],
    /// Least and largest winch force (N).
    force: [f64; 2],
    /// Where a winch is asked to push the most: time (s), cable (from 0), force (N).
    pushed: Option<(f64, usize, f64)>,
}

impl Forces {
    fn begin(arguments: &Arguments, cables: usize, command: WinchCommand) -> anyhow::Result<Self> {
        let mut csv = csv::Writer::from_writer(WholeFile::create(&arguments.output)?);
        let mut header = vec!["time".to_owned()];
        header.extend(input_names(cables, command));
        header.extend(["x", "y", "phi", "vx", "vy", "omega"].map(str::to_owned));
        for name in ["tension", "unstretched_length", "unstretched_length_rate"] {
            header.extend((0..cables).map(|i| indexed(name, i)));
        }
        csv.write_record(&header)?;
        let none = [f64::INFINITY, f64::NEG_INFINITY];
        Ok(Self {
            csv,
            summary: Summary { first: None, rows: 0, at_bound: 0, tension: none, force: none, pushed: None },
        })
    }

    /// Writes an instant with the inputs from then on.
    fn row(&mut self, instant: &Instant, inputs: &Inputs) -> anyhow::Result<()> {
        let mut row = vec![instant.time];
        row.extend(input_values(inputs));
        row.extend(instant.motion.derivative(0));
        row.extend(instant.motion.derivative(1));
        for values in [instant.tension, instant.unstretched, instant.unstretched_rate] {
            row.extend(values);
        }
        self.csv.write_record(row.iter().map(|value| format!("{value:?}")))?;
        let summary = &mut self.summary;
        summary.rows += 1;
        summary.at_bound += usize::from(instant.selection.iter().any(Option::is_some));
        for (range, values) in [(&mut summary.tension, instant.tension), (&mut summary.force, instant.winch_force)] {
            *range = values.iter().fold(*range, |[low, high], v| [low.min(*v), high.max(*v)]);
        }
        for (cable, &force) in instant.winch_force.iter().enumerate() {
            if force < summary.pushed.map_or(0.0, |(_, _, least)| least) {
                summary.pushed = Some((instant.time, cable, force));
            }
        }
        if summary.first.is_none() {
            summary.first = Some(instant.clone());
        }
        Ok(())
    }

    fn finish(self) -> anyhow::Result<Summary> {
        self.csv.into_inner().map_err(csv::IntoInnerError::into_error)?.finish()?;
        Ok(self.summary)
    }
}

/// Puts the model's start on an instant of a trajectory.
pub(crate) fn start_on(model: &mut Model, first: &Instant) {
    let start = &mut model.start;
    start.time = first.time;
    start.pose = first.motion.derivative(0);
    start.twist = first.motion.derivative(1);
    start.inputs = first.inputs();
    start.unstretched_length = first.unstretched;
    start.unstretched_length_rate = first.unstretched_rate;
    start.initialization = Initialization::FromStates;
}

impl Summary {
    fn tell(&self) -> anyhow::Result<()> {
        let Self { rows, at_bound, tension, force, .. } = self;
        let mut out = terminal::out();
        writeln!(out, "{rows} rows")?;
        writeln!(out, "tensions      {:.1} to {:.1} N, at a bound in {at_bound} rows", tension[0], tension[1])?;
        writeln!(out, "winch forces  {:.1} to {:.1} N", force[0], force[1])?;
        Ok(out.flush()?)
    }
}

/// Whether the plant's cables are elastic; what depends on it is said where it is missing.
pub(crate) fn elastic(model: &cdpr::plant::Plant) -> bool {
    model.data().cables.iter().all(|c| c.model != CableModel::Rigid)
}
