//! The analysis as text.

use std::fmt::Write as _;
use std::path::Path;

use cdpr::dynamics::Inputs;
use cdpr::inverse::distribution::Distribution;
use cdpr::inverse::{Instant, InverseError};
use cdpr::kinematics;
use cdpr::model_file::Model;
use cdpr::plant::Plant;
use cdpr::statics::workspace::{RequiredWrenches, feasibility};
use cdpr::statics::{self, Mode, Stiffness};
use cdpr::winch::WinchCommand;
use nalgebra::Matrix3;

use super::map::Map;
use super::{bounds, infeasible, singular_values};
use crate::inverse::elastic;

/// Text in sections.
#[derive(Default)]
pub(super) struct Text {
    text: String,
}

/// Six digits, in columns.
fn row(values: impl IntoIterator<Item = f64>) -> String {
    // Rounding of a zero is a zero.
    values.into_iter().map(|v| format!("{:>14}", number(v))).collect()
}

fn number(value: f64) -> String {
    if value.abs() < 1e-9 {
        "0".to_owned()
    } else if (1e-3..1e6).contains(&value.abs()) {
        format!("{value:.*}", (5 - value.abs().log10().floor() as i32).clamp(0, 6) as usize)
    } else {
        format!("{value:.5e}")
    }
}

/// A ratio as it is shown beside others, to a millionth: what is less is nothing that could be seen in a motion.
fn to_a_millionth(ratio: f64) -> f64 {
    (1e6 * ratio).round() / 1e6
}

impl Text {
    fn section(&mut self, title: &str) {
        let blank = if self.text.is_empty() { "" } else { "\n" };
        let _ = writeln!(self.text, "{blank}{title}");
    }

    fn line(&mut self, line: impl std::fmt::Display) {
        let _ = writeln!(self.text, "  {line}");
    }

    pub(super) fn note(&mut self, note: &str) {
        self.section(note);
    }

    fn matrix(&mut self, name: &str, matrix: &Matrix3<f64>) {
        for r in 0..3 {
            let name = if r == 0 { name } else { "" };
            self.line(format!("{name:<22}{}", row(matrix.row(r).iter().copied())));
        }
    }

    pub(super) fn geometry(&mut self, plant: &Plant, pose: &[f64; 3]) {
        self.section(&format!("pose [{}, {}] m, {} rad", pose[0], pose[1], pose[2]));
        let cables = kinematics::cables(plant.geometry(), pose, &[0.0; 3]);
        self.line("cable      length (m)   angle (rad)   J_M: dL/dx         dL/dy     dL/dφ (m)");
        for (i, cable) in cables.iter().enumerate() {
            let values = [cable.length, cable.angle()].into_iter().chain(cable.jacobian_row());
            self.line(format!("{}    {}", i + 1, row(values)));
        }
        let values = singular_values(plant, pose);
        self.line(format!("singular values of J_M, angle times attachment radius: {}", row(values.iter().copied())));
        if let [largest, .., smallest] = values[..] {
            self.line(format!("condition number: {}", number(largest / smallest)));
        }
    }

    pub(super) fn feasibility(
        &mut self,
        plant: &Plant,
        pose: &[f64; 3],
        distribution: &Distribution,
        required: &RequiredWrenches,
    ) {
        let found = feasibility(plant.geometry(), pose, &distribution.bounds, required);
        self.section(&format!("wrench feasibility, tensions {}", bounds(distribution)));
        let closure =
            if found.closure { "any wrench can be made with enough tension" } else { "not every wrench can be made" };
        self.line(format!("wrench closure         {}: {closure}", if found.closure { "yes" } else { "no" }));
        self.line(format!("balance                {} (smallest over largest internal tension)", number(found.balance)));
        let feasible = if found.margin >= 0.0 { "yes" } else { "no" };
        let [x, y, torque] = required.half_width;
        self.line(format!(
            "wrenches asked for     {feasible}: [{x}, {y}] N, {torque} N m either way about what holds the pose"
        ));
        self.line(format!(
            "capacity margin        {} N to the border of the wrenches that can be made (torque over attachment radius)",
            number(found.margin)
        ));
    }

    pub(super) fn held(&mut self, held: &Instant, command: WinchCommand) {
        self.section("held at rest");
        let told = (command != WinchCommand::Force).then(|| format!("   {} ({})", command.input(), command.unit()));
        self.line(format!(
            "cable     tension (N)  winch force   unstretched (m){}",
            told.as_deref().unwrap_or_default()
        ));
        for i in 0..held.tension.len() {
            let told = told.as_ref().map(|_| held.command[i]);
            let values = [held.tension[i], held.winch_force[i], held.unstretched[i]].into_iter().chain(told);
            self.line(format!("{}    {}", i + 1, row(values)));
        }
    }

    pub(super) fn not_held(&mut self, error: &InverseError) {
        self.section("held at rest");
        self.line(format!("no: {error}"));
        if let Some(found) = infeasible(error) {
            self.line(format!("wrench asked for     {}", row(found.wrench)));
            self.line(format!("nearest tensions     {}", row(found.nearest_tension)));
            self.line(format!("their wrench         {}", row(found.nearest_wrench)));
        }
    }

    pub(super) fn stiffness(&mut self, geometric: &Matrix3<f64>, all: Option<&Stiffness>) {
        self.section("stiffness -∂w/∂[x, y, φ] (N/m, N, N m)");
        self.matrix("geometric", geometric);
        match all {
            Some(all) => {
                self.matrix("elastic", &all.elastic);
                if all.effects.amax() > 0.0 {
                    self.matrix("effects", &all.effects);
                }
                self.matrix("winches locked", &all.total());
            }
            None => self.line("elastic               rigid cables: infinite"),
        }
        let stable = |k: &Matrix3<f64>| {
            let symmetric = (k + k.transpose()) * 0.5;
            if symmetric.symmetric_eigenvalues().min() > 0.0 { "stable" } else { "unstable in some direction" }
        };
        self.line(format!(
            "winches holding their forces: {}",
            stable(&(geometric + all.map_or(Matrix3::zeros(), |a| a.effects)))
        ));
        if let Some(all) = all {
            self.line(format!("winches locked: {}", stable(&all.total())));
        }
    }

    pub(super) fn modes(&mut self, title: &str, modes: &[Mode], names: &[String]) {
        self.section(&format!("modes, {title}"));
        self.line("     period (s)  damping ratio  frequency (rad/s)   mostly in");
        for mode in modes {
            let first = if mode.oscillates() {
                row([mode.period(), to_a_millionth(mode.damping_ratio())])
            } else if mode.is_neutral() {
                format!("{:>28}", "stays where it is put")
            } else {
                let way = if mode.is_unstable() { "grows" } else { "decays" };
                format!("{:>28}", format!("{way} in {} s", number(mode.time_constant())))
            };
            let mut parts: Vec<(f64, &str)> = mode
                .shape
                .iter()
                .zip(names)
                .filter(|(_, name)| !matches!(name.as_str(), "vx" | "vy" | "omega") && !name.contains("_rate"))
                .map(|(v, name)| (v.norm(), name.as_str()))
                .collect();
            parts.sort_by(|a, b| b.0.total_cmp(&a.0));
            let largest = parts.first().map_or(0.0, |p| p.0);
            let mostly: Vec<&str> = parts.iter().filter(|p| p.0 > 0.3 * largest).take(5).map(|p| p.1).collect();
            let mostly = mostly.join(", ").replace("unstretched_length", "l");
            self.line(format!("{first}{}   {mostly}", row([mode.natural_frequency()])));
        }
    }

    pub(super) fn equilibrium(&mut self, model: &Model, plant: &Plant, pose: &[f64; 3]) {
        let inputs = &plant.driven(&model.start.inputs);
        let command = model.parameters.winch.command;
        if command.is_servo() {
            self.section(&format!("winches follow a {}: no equilibrium under given forces", command.name()));
        } else {
            self.under_forces(plant, pose, &model.start.inputs, inputs);
        }
        let lengths = &model.start.unstretched_length;
        if !elastic(plant) || lengths.iter().any(|l| *l <= 0.0) {
            return;
        }
        self.section(&format!(
            "equilibrium with winches locked at the model's unstretched lengths [{}] m",
            lengths.iter().copied().map(number).collect::<Vec<_>>().join(", ")
        ));
        match statics::locked_equilibrium(plant, 0.0, lengths, &inputs.disturbance, *pose) {
            Ok(found) => {
                self.at_rest(&found.pose, &found.stiffness);
                self.line(format!(
                    "tensions [{}] N",
                    found.tension.iter().copied().map(number).collect::<Vec<_>>().join(", ")
                ));
            }
            Err(error) => self.line(format!("none: {error}")),
        }
    }

    /// The equilibrium under these commands, which make the forces `inputs`.
    fn under_forces(&mut self, plant: &Plant, pose: &[f64; 3], commands: &Inputs, inputs: &Inputs) {
        self.section(&format!(
            "equilibrium under the model's winch forces [{}] N",
            inputs.winch_force.iter().copied().map(number).collect::<Vec<_>>().join(", ")
        ));
        match statics::static_equilibrium(plant, 0.0, *pose, commands) {
            Ok(found) => {
                self.at_rest(&found, &statics::geometric_stiffness(plant.geometry(), &found, &inputs.winch_force));
            }
            Err(error) => self.line(format!("none: {error}")),
        }
    }

    /// A pose at rest, and whether it is stable.
    fn at_rest(&mut self, [x, y, phi]: &[f64; 3], stiffness: &Matrix3<f64>) {
        let symmetric = (stiffness + stiffness.transpose()) * 0.5;
        let stable = if symmetric.symmetric_eigenvalues().min() > 0.0 { "stable" } else { "unstable" };
        self.line(format!("[{}, {}] m, {} rad; {stable}", number(*x), number(*y), number(*phi)));
    }

    pub(super) fn map(&mut self, map: &Map, path: &Path) {
        let [[left, bottom], [right, top]] = map.area.map(|corner| corner.map(number));
        let area = format!("share of the area from ({left}, {bottom}) to ({right}, {top}) m");
        self.section(&format!("workspace at {}, {area}", map.orientations()));
        let parts = map.parts().map(|part| part.map(|p| format!("{:>10.1} %", 100.0 * p)));
        let [closure, feasible] = if map.found.points.phi.len() == 1 {
            parts.map(|[every, _]| every)
        } else {
            self.line("                       at every one      at some");
            parts.map(|[every, some]| format!("{every} {some}"))
        };
        self.line(format!("wrench closure         {closure}"));
        self.line(format!("wrenches asked for     {feasible}"));
        self.line(format!("map                    {}", path.display()));
    }

    pub(super) fn linear(&mut self, path: &Path) {
        self.section(&format!("A, B, C, D are in {}", path.display()));
    }

    pub(super) fn drawing(&mut self, path: &Path) {
        self.section(&format!("the robot is drawn in {}", path.display()));
    }

    pub(super) fn start(&mut self, path: &Path) {
        self.section(&format!("the model that starts at rest there is in {}", path.display()));
    }

    pub(super) fn finish(self) -> String {
        self.text
    }
}
