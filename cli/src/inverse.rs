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

/// Share of a winch force by which it may be beyond a limit at which it lies.
const ROUNDING: f64 = 1e-6;

/// Winch forces for a trajectory, tensions and forces kept within bounds.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  \
    cdpr inverse --trajectory circle.csv --step 0.01 --held -o forces.csv --start circle.toml\n  \
    cdpr simulate --model circle.toml --input forces.csv -o run.csv\n\n\
    The trajectory is a table with the columns time (s), x, y (m), phi (rad); where given, vx, vy (m/s), omega (rad/s), and \
    with them ax, ay (m/s2), alpha (rad/s2); and any of disturbance_force_x, disturbance_force_y (N), disturbance_torque \
    (N m); without such a column the disturbance of the model's [start] acts all the time. The motion is met at every sample; between them it is a spline of degree 7. The forces are a table of inputs for cdpr \
    simulate, torques, speeds or lengths where these command the model's winches, with tensions and paid-out lengths beside them.\n\n\
    Where no tensions within the bounds make the motion with winch forces within theirs, the command fails and says when, which \
    wrench was asked for and what comes nearest. What a change of tension takes in an elastic cable comes on top of the force; the \
    tensions leave room for it where they can, and where they cannot, a warning says when and at which winch.")]
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
    /// Smallest winch force in N
    #[arg(long, value_name = "N", default_value = "0", value_parser = number::finite, allow_negative_numbers = true)]
    force_min: f64,
    /// Largest winch force in N; without it the model's force_limit where winches follow a speed or length, and none elsewhere
    #[arg(long, value_name = "N", value_parser = number::finite, allow_negative_numbers = true)]
    force_max: Option<f64>,
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
    let winch = model.parameters.winch;
    let own_limit = if winch.command.is_servo() { winch.force_limit } else { f64::INFINITY };
    let limits = [arguments.force_min, arguments.force_max.unwrap_or(own_limit)];
    let problem = problem.within_forces(limits[0], limits[1]).map_err(|error| {
        BadInput(error.to_string().replace("`force_min`", "--force-min").replace("`force_max`", "--force-max"))
    })?;
    let all = if arguments.held { with_middles(&times) } else { times };
    let failed = |error: InverseError| match error {
        InverseError::Pose { .. } => BadInput::in_file(&arguments.trajectory, error).into(),
        error => anyhow::Error::from(error).context(arguments.trajectory.display().to_string()),
    };
    let problem = problem.with_room(&all, model.relative_tolerance).map_err(failed)?;
    let mut forces = Forces::begin(arguments, model.parameters.cables(), winch.command, limits)?;
    let done = if arguments.held {
        let mut row = None;
        let done = problem.each(&all, model.relative_tolerance, |instant| -> anyhow::Result<()> {
            // A row waits for the forces in the middle of its time; the last keeps its own.
            match row.take() {
                None => row = Some(instant),
                Some(begin) => forces.row(&begin, &instant.inputs())?,
            }
            Ok(())
        });
        done.and_then(|()| row.map_or(Ok(()), |last| forces.row(&last, &last.inputs())))
    } else {
        problem.each(&all, model.relative_tolerance, |instant| forces.row(&instant, &instant.inputs()))
    };
    done.map_err(|error| error.downcast::<InverseError>().map_or_else(|other| other, failed))?;
    let summary = forces.finish()?;
    if let (Some(path), Some(first)) = (&arguments.start, &summary.first) {
        start_on(&mut model, first);
        whole::write(path, model.to_toml())?;
    }
    if let Some(beyond) = &summary.beyond {
        terminal::tell(&beyond.warning(limits));
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
    /// The least and the largest winch force (N).
    limits: [f64; 2],
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
    /// Where a winch force is farthest beyond its limits.
    beyond: Option<Beyond>,
}

/// A winch force beyond its limits.
struct Beyond {
    /// Time (s).
    time: f64,
    /// From 0.
    cable: usize,
    /// N.
    force: f64,
    /// By how much (N).
    excess: f64,
    /// Rows of which some force is.
    rows: usize,
}

impl Beyond {
    /// What is said of it.
    fn warning(&self, [least, most]: [f64; 2]) -> String {
        let Self { time, cable, force, rows, .. } = self;
        let winch = cable + 1;
        let limit = match force < &least {
            true if least == 0.0 => "and a winch cannot push".to_owned(),
            true => format!("below the {least} N of --force-min"),
            false => format!("above its limit of {most} N"),
        };
        format!(
            "warning: at t = {time} s the force of winch {winch} is {force:.1} N, {limit}; in {rows} rows some force is. No \
             tensions within the bounds leave room for how fast they change themselves, most where they have a kink: round the \
             kinks with --objective minimum-norm and --smooth, take --objective analytic-centre, or widen the tensions' bounds"
        )
    }
}

impl Forces {
    fn begin(arguments: &Arguments, cables: usize, command: WinchCommand, limits: [f64; 2]) -> anyhow::Result<Self> {
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
            limits,
            summary: Summary { first: None, rows: 0, at_bound: 0, tension: none, force: none, beyond: None },
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
        let [least, most] = self.limits;
        let excess = |force: f64| (least - force).max(force - most);
        let worst = instant.winch_force.iter().enumerate().max_by(|a, b| excess(*a.1).total_cmp(&excess(*b.1)));
        if let Some((cable, &force)) = worst.filter(|(_, force)| excess(**force) > ROUNDING * force.abs().max(1.0)) {
            let rows = summary.beyond.as_ref().map_or(0, |beyond| beyond.rows) + 1;
            let found = Beyond { time: instant.time, cable, force, excess: excess(force), rows };
            match &mut summary.beyond {
                Some(beyond) if beyond.excess >= found.excess => beyond.rows = rows,
                beyond => *beyond = Some(found),
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
