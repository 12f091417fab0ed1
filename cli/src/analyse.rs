//! `cdpr analyse`: statics and linear analysis of a pose.

mod map;
mod text;

use std::io::Write as _;
use std::path::PathBuf;
use std::sync::Arc;

use anyhow::Context;
use cdpr::geometry::Geometry;
use cdpr::inverse::distribution::{Bounds, Distribution, DistributionError, Redundancy, structure_matrix};
use cdpr::inverse::{Instant, InverseDynamics, InverseError, Motion, Trajectory};
use cdpr::model_file::Model;
use cdpr::plant::Plant;
use cdpr::simulation::{Simulation, load_at_rest};
use cdpr::statics::workspace::{MapPoints, RequiredWrenches, WorkspaceMap, anchor_rectangle};
use cdpr::statics::{self, LinearModel};
use cdpr_drawing::Robot;
use nalgebra::DMatrix;
use serde_json::{Value, json};

use crate::failure::BadInput;
use crate::redundancy::Choice;
use crate::{inverse, model, number, output, terminal, whole};
use map::Map;
use text::Text;

/// Most poses of a map: their table has some 2 GB.
const MOST_POSES: usize = 20_000_000;

/// Jacobian, equilibrium, stiffness, natural frequencies and modes, wrench feasibility.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  \
    cdpr analyse --pose 0,0,0\n  \
    cdpr analyse --model model.toml --pose 50,-20,0.1 --tension-min 5000 --linear linear.json\n  \
    cdpr analyse --pose 0,0,0 --wrench 2000,2000,20000 --workspace map.csv\n  \
    cdpr analyse --pose 0,0,0 --workspace map.csv --angles=-0.3,0.3,31 --plot workspace.svg\n  \
    cdpr analyse --pose 50,-20,0.3 --plot robot.svg\n  \
    cdpr analyse --pose 5,0,0 --pretension 20000 --start hold.toml\n\n\
    The pose is held against the model's disturbances by tensions within the bounds; stiffness, modes and the linear model \
    are those of this state. --start writes the model with this state as its start: from there a simulation, or an FMU \
    packed of it, is at rest under the winch forces in that file. The workspace map covers the rectangle of the \
    anchors, or --area, at the pose's orientation, or at all --angles; --plot then shows it under the robot.")]
pub(crate) struct Arguments {
    /// The model file; the default model without it
    #[arg(long, value_name = "FILE.toml")]
    model: Option<PathBuf>,
    /// Pose in m, m, rad
    #[arg(long, value_name = "X,Y,PHI", value_parser = number::pose, allow_hyphen_values = true)]
    pose: [f64; 3],
    #[command(flatten)]
    choice: Choice,
    /// Forces and torque that must be possible either way, in N, N, N m
    #[arg(long, value_name = "FX,FY,TAU", value_parser = number::pose, default_value = "0,0,0",
        allow_hyphen_values = true)]
    wrench: [f64; 3],
    /// Hold the pose by the tensions nearest to this one in N, instead of --objective
    #[arg(long, value_name = "N", value_parser = number::positive)]
    pretension: Option<f64>,
    /// Write the model with its start at rest at the pose
    #[arg(long, value_name = "FILE.toml", value_parser = output::model())]
    start: Option<PathBuf>,
    /// Write A, B, C, D with their names
    #[arg(long, value_name = "FILE.json", value_parser = output::json())]
    linear: Option<PathBuf>,
    /// Write a map of wrench feasibility
    #[arg(long, value_name = "FILE.csv", value_parser = output::table())]
    workspace: Option<PathBuf>,
    /// Orientations of the map, equally spaced, in rad
    #[arg(long, value_name = "FROM,TO,COUNT", value_parser = number::orientations, requires = "workspace",
        allow_hyphen_values = true)]
    angles: Option<number::Orientations>,
    /// Area of the map in m, the rectangle of the anchors without it
    #[arg(long, value_name = "X0,Y0,X1,Y1", value_parser = number::area, requires = "workspace",
        allow_hyphen_values = true)]
    area: Option<[[f64; 2]; 2]>,
    /// Draw the robot at the pose, on the map where there is one, as SVG or PNG by its name
    #[arg(long, value_name = "FILE.svg", value_parser = output::picture())]
    plot: Option<PathBuf>,
    /// Points of the map along each axis
    #[arg(long, value_name = "N", default_value = "61", value_parser = clap::value_parser!(u16).range(2..=2001))]
    points: u16,
}

impl Arguments {
    /// The workspace asked for.
    fn map(
        &self,
        geometry: &Geometry,
        bounds: &Bounds,
        required: impl Fn(&[f64; 3]) -> RequiredWrenches,
    ) -> Result<Map, BadInput> {
        let area = self.area.unwrap_or_else(|| anchor_rectangle(geometry));
        let phi = self.angles.as_ref().map_or_else(|| vec![self.pose[2]], |angles| angles.0.clone());
        let [[left, bottom], [right, top]] = area;
        if left == right || bottom == top {
            let found = format!("the anchors span [{left}, {right}] m in x and [{bottom}, {top}] m in y");
            return Err(BadInput(format!(
                "--workspace: {found}, which is no area; say which one by --area X0,Y0,X1,Y1"
            )));
        }
        let poses = usize::from(self.points).pow(2) * phi.len();
        if poses > MOST_POSES {
            let (points, angles) = (self.points, phi.len());
            return Err(BadInput(format!(
                "--points {points} at {angles} angles are {poses} poses, expected {MOST_POSES} or fewer"
            )));
        }
        let points = MapPoints::over(area, self.points.into(), phi);
        Ok(Map { area, found: WorkspaceMap::new(geometry, points, bounds, required) })
    }
}

/// A pose held for ever.
struct Still {
    pose: [f64; 3],
    disturbance: [f64; 3],
}

impl Trajectory for Still {
    fn span(&self) -> [f64; 2] {
        [0.0, 1.0]
    }

    fn motion(&self, _time: f64) -> Motion {
        let still = |v: f64| [v, 0.0, 0.0, 0.0, 0.0, 0.0];
        Motion { pose: self.pose.map(still), disturbance: self.disturbance.map(|d| [d, 0.0, 0.0, 0.0]) }
    }
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    output::distinct(&[
        ("--start", arguments.start.as_ref()),
        ("--linear", arguments.linear.as_ref()),
        ("--workspace", arguments.workspace.as_ref()),
        ("--plot", arguments.plot.as_ref()),
    ])?;
    let (_, mut model) = model::read(arguments.model.as_deref())?;
    let (distribution, redundancy) = arguments.choice.resolve(&model.parameters, arguments.pretension)?;
    // The robot as it is at the start: effects may begin or end later.
    let plant = Arc::new(model.plant()?.at(model.start.time).clone());
    plant.geometry().check_pose(&arguments.pose).map_err(|error| BadInput(format!("--pose: {error}")))?;
    if let Some(bad) = arguments.wrench.iter().find(|w| **w < 0.0) {
        return Err(BadInput(format!("--wrench has {bad}, expected half widths of 0 or more")).into());
    }
    let disturbance = model.start.inputs.disturbance;
    let required = |pose: &[f64; 3]| RequiredWrenches {
        centre: load_at_rest(&plant, 0.0, pose, &model.start.inputs).map(|load| -load),
        half_width: arguments.wrench,
    };
    let mut text = Text::default();
    text.geometry(&plant, &arguments.pose);
    text.feasibility(&plant, &arguments.pose, &distribution, &required(&arguments.pose));
    let held = hold(&plant, &arguments.pose, disturbance, redundancy.as_ref());
    let linear = match &held {
        Ok(instant) => Some(analyse_held(&mut text, &model, &plant, instant)?),
        Err(error) if arguments.linear.is_some() || arguments.start.is_some() => {
            let what = if arguments.linear.is_some() {
                "--linear: the pose is not held, so there is no linear model"
            } else {
                "--start: the pose is not held, so nothing starts at rest there"
            };
            return Err(anyhow::Error::from(error.clone()).context(what));
        }
        Err(error) => {
            text.not_held(error);
            None
        }
    };
    text.equilibrium(&model, &plant, &arguments.pose);
    let mut map = None;
    if let Some(path) = &arguments.workspace {
        let found = arguments.map(plant.geometry(), &distribution.bounds, required)?;
        whole::write(path, found.csv())?;
        text.map(&found, path);
        map = Some(found);
    }
    if let (Some(path), Some(linear)) = (&arguments.linear, &linear) {
        let json = serde_json::to_string_pretty(&linear_json(linear)).context("the linear model as JSON")?;
        whole::write(path, json + "\n")?;
        text.linear(path);
    }
    if let Some(path) = &arguments.plot {
        let geometry = plant.geometry();
        let robot = Robot { anchors: &geometry.anchor, attachments: &geometry.attachment, pose: arguments.pose };
        let svg = map.map_or_else(|| robot.svg(), |map| map.svg(&robot));
        whole::write(path, output::drawn(svg, path)?)?;
        text.drawing(path);
    }
    if let (Some(path), Ok(held)) = (&arguments.start, &held) {
        inverse::start_on(&mut model, held);
        whole::write(path, model.to_toml())?;
        text.start(path);
    }
    let mut out = terminal::out();
    out.write_all(text.finish().as_bytes())?;
    Ok(out.flush()?)
}

/// The plant at rest at `pose`, held by tensions within the bounds.
fn hold(
    plant: &Arc<Plant>,
    pose: &[f64; 3],
    disturbance: [f64; 3],
    redundancy: &dyn Redundancy,
) -> Result<Instant, InverseError> {
    let still = Still { pose: *pose, disturbance };
    let problem = InverseDynamics::new(plant.clone(), &still, redundancy)?;
    problem.at(0.0, &problem.start(0.0)?)
}

fn analyse_held(text: &mut Text, model: &Model, plant: &Arc<Plant>, held: &Instant) -> anyhow::Result<LinearModel> {
    let pose = held.motion.derivative(0);
    let simulation =
        Simulation::from_states(plant.clone(), 0.0, held.states.clone(), held.inputs(), model.relative_tolerance);
    let linear = LinearModel::of(&simulation);
    let command = plant.parameters().winch.command;
    text.held(held, command);
    let geometric = statics::geometric_stiffness(plant.geometry(), &pose, &held.tension);
    let stiffness =
        inverse::elastic(plant).then(|| statics::stiffness(plant, 0.0, &pose, &held.tension)).transpose()?;
    text.stiffness(&geometric, stiffness.as_ref());
    let follow = format!("winches following their {}", command.name());
    let held_by = if command.is_servo() { &follow } else { "winches holding their forces" };
    text.modes(held_by, &statics::force_controlled_modes(plant, &linear)?, &linear.state_names);
    if inverse::elastic(plant) {
        let locked = statics::locked_model(plant, 0.0, &pose, &held.tension)?.modes()?;
        text.modes("winches locked", &locked, &linear.state_names[..6]);
    } else {
        text.note("winches locked: rigid cables allow no motion");
    }
    Ok(linear)
}

fn linear_json(model: &LinearModel) -> Value {
    let rows = |m: &DMatrix<f64>| -> Vec<Vec<f64>> { m.row_iter().map(|r| r.iter().copied().collect()).collect() };
    json!({
        "schema": 1,
        "time": model.time,
        "states": model.state_names,
        "inputs": model.input_names,
        "outputs": model.output_names,
        "x": model.state,
        "dx": model.rate,
        "u": model.input,
        "y": model.output,
        "A": rows(&model.a),
        "B": rows(&model.b),
        "C": rows(&model.c),
        "D": rows(&model.d),
    })
}

/// The structure matrix's singular values, torques divided by the attachment radius.
fn singular_values(plant: &Plant, pose: &[f64; 3]) -> Vec<f64> {
    let mut structure = structure_matrix(plant.geometry(), pose);
    structure.row_mut(2).scale_mut(1.0 / plant.geometry().attachment_scale());
    structure.singular_values().iter().copied().collect()
}

/// Why no tensions hold the pose, as the distribution has it.
fn infeasible(error: &InverseError) -> Option<&cdpr::inverse::distribution::Infeasible> {
    match error {
        InverseError::Distribution { error: DistributionError::Infeasible(found), .. } => Some(found),
        _ => None,
    }
}

/// The bounds as text.
fn bounds(distribution: &Distribution) -> String {
    format!("{} to {} N", distribution.bounds.lower(), distribution.bounds.upper())
}
