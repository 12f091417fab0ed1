//! `model.toml`: parameters, start values and effects as people write them.

mod lines;
mod write;

use std::sync::Arc;

use serde::{Deserialize, Deserializer};
use toml::Spanned;

use self::lines::{line_at, line_of_key};
use crate::dynamics::Inputs;
use crate::effect::EffectSpec;
use crate::integrator::Solver;
use crate::parameter::check_tolerance;
use crate::parameters::{
    CableDamper, CableInertia, CableModel, CableParameters, Initialization, ParameterError, Parameters, pair,
};
use crate::per_cable::{MAX_CABLES, PerCable};
use crate::plant::{Plant, PlantError};
use crate::simulation::{DEFAULT_TOLERANCE, Simulation, Start, StartError};
use crate::winch::{WINCH_COMMANDS, WinchParameters};

/// A model: what `model.toml` says.
#[derive(Clone, Debug, PartialEq)]
pub struct Model {
    /// Geometry, inertia, cables.
    pub parameters: Parameters,
    /// Relative tolerance of the integrator.
    pub relative_tolerance: f64,
    /// Method of the integrator.
    pub solver: Solver,
    /// Start values; winch forces and disturbances of the file are the inputs' start values.
    pub start: Start,
    /// The effects.
    pub effects: Vec<EffectSpec>,
}

impl Default for Model {
    fn default() -> Self {
        Self {
            parameters: Parameters::default(),
            relative_tolerance: DEFAULT_TOLERANCE,
            solver: Solver::default(),
            start: Start::default(),
            effects: Vec::new(),
        }
    }
}

/// A `model.toml` that cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{}{message}", line.map_or(String::new(), |l| format!("line {l}: ")))]
pub struct ModelFileError {
    /// Line, from 1, where it is known.
    pub line: Option<usize>,
    /// The key, what was found and what was expected.
    pub message: String,
}

/// The file's keys, flat as they stand there.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Keys {
    cable_model: Option<CableModel>,
    cable_inertia: Option<CableInertia>,
    cable_damper: Option<CableDamper>,
    platform_mass: Option<f64>,
    platform_inertia: Option<f64>,
    #[serde(default, deserialize_with = "some_pair")]
    centre_of_mass: Option<[f64; 2]>,
    #[serde(default, deserialize_with = "some_pair")]
    gravity: Option<[f64; 2]>,
    anchor_radius: Option<f64>,
    attachment_radius: Option<f64>,
    anchor_angle: Option<PerCable<f64>>,
    attachment_angle: Option<PerCable<f64>>,
    cable_density: Option<f64>,
    youngs_modulus: Option<f64>,
    cable_area: Option<f64>,
    cable_damping: Option<f64>,
    #[serde(default)]
    winch: WinchParameters,
    relative_tolerance: Option<f64>,
    solver: Option<Solver>,
    #[serde(default)]
    cable: Vec<CableParameters>,
    initialization: Option<Initialization>,
    #[serde(default)]
    start: StartKeys,
    #[serde(default)]
    effect: Vec<Spanned<EffectSpec>>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct StartKeys {
    x: Option<f64>,
    y: Option<f64>,
    phi: Option<f64>,
    vx: Option<f64>,
    vy: Option<f64>,
    omega: Option<f64>,
    unstretched_length: Option<PerCable<f64>>,
    unstretched_length_rate: Option<PerCable<f64>>,
    winch_force: Option<PerCable<f64>>,
    winch_torque: Option<PerCable<f64>>,
    winch_speed: Option<PerCable<f64>>,
    winch_length: Option<PerCable<f64>>,
    disturbance_force_x: Option<f64>,
    disturbance_force_y: Option<f64>,
    disturbance_torque: Option<f64>,
}

fn some_pair<'de, D: Deserializer<'de>>(from: D) -> Result<Option<[f64; 2]>, D::Error> {
    pair(from).map(Some)
}

impl Model {
    /// Reads and checks a model file's text.
    ///
    /// # Errors
    /// Syntax, unknown keys, values of the wrong type or out of range: with the line, what was found and expected.
    pub fn from_toml(text: &str) -> Result<Self, ModelFileError> {
        Self::from_toml_with_plant(text).map(|(model, _)| model)
    }

    /// The same with the plant that was built to check the file.
    pub(crate) fn from_toml_with_plant(text: &str) -> Result<(Self, Arc<Plant>), ModelFileError> {
        let keys: Keys = toml::from_str(text).map_err(|e| {
            let line = e.span().map(|span| line_at(text, span.start));
            // The parser says what it found and expected; the key stands on the line.
            let found = line.and_then(|l| text.lines().nth(l - 1)).unwrap_or_default();
            let key = found.split_once('=').map(|(key, _)| key.trim());
            let key = key.or_else(|| Some(found.trim()).filter(|table| table.starts_with('[')));
            let message = match key {
                Some(key) if !e.message().contains(key) => format!("`{key}`: {}", e.message()),
                _ => e.message().to_owned(),
            };
            ModelFileError { line, message }
        })?;
        let default = Parameters::default();
        let circles = keys.anchor_angle.is_some() || keys.attachment_angle.is_some();
        let circles = circles || keys.anchor_radius.is_some() || keys.attachment_radius.is_some();
        if circles && !keys.cable.is_empty() {
            let message = "`[[cable]]` tables and the circles (`anchor_radius`, `attachment_radius`, `anchor_angle`, \
                           `attachment_angle`) both say where the cables are; expected one of the two";
            return Err(ModelFileError { line: line_of_key(text, "cable"), message: message.to_owned() });
        }
        let parameters = Parameters {
            cable_model: keys.cable_model.unwrap_or(default.cable_model),
            cable_inertia: keys.cable_inertia.unwrap_or(default.cable_inertia),
            cable_damper: keys.cable_damper.unwrap_or(default.cable_damper),
            platform_mass: keys.platform_mass.unwrap_or(default.platform_mass),
            platform_inertia: keys.platform_inertia.unwrap_or(default.platform_inertia),
            centre_of_mass: keys.centre_of_mass.unwrap_or(default.centre_of_mass),
            gravity: keys.gravity.unwrap_or(default.gravity),
            cable: keys.cable,
            anchor_radius: keys.anchor_radius.unwrap_or(default.anchor_radius),
            attachment_radius: keys.attachment_radius.unwrap_or(default.attachment_radius),
            anchor_angle: keys.anchor_angle.unwrap_or(default.anchor_angle),
            attachment_angle: keys.attachment_angle.unwrap_or(default.attachment_angle),
            cable_density: keys.cable_density.unwrap_or(default.cable_density),
            youngs_modulus: keys.youngs_modulus.unwrap_or(default.youngs_modulus),
            cable_area: keys.cable_area.unwrap_or(default.cable_area),
            cable_damping: keys.cable_damping.unwrap_or(default.cable_damping),
            winch: keys.winch,
        };
        let cables = parameters.cables();
        if !(2..=MAX_CABLES).contains(&cables) {
            let plural = if cables == 1 { "" } else { "s" };
            let message = format!("{cables} cable{plural}, expected 2 to {MAX_CABLES}");
            return Err(ModelFileError { line: line_of_key(text, "cable"), message });
        }
        let start = Start::pulling(cables);
        let s = keys.start;
        let per_cable = |key: &str, given: Option<PerCable<f64>>, default: PerCable<f64>| match given {
            Some(given) if given.len() != cables => Err(ModelFileError {
                line: line_of_key(text, key),
                message: format!("`{key}` has {} entries, expected {cables}, one for each cable", given.len()),
            }),
            given => Ok(given.unwrap_or(default)),
        };
        let or = |value: Option<f64>| value.unwrap_or(0.0);
        let command = parameters.winch.command;
        let mut commanded = None;
        for (kind, given) in
            WINCH_COMMANDS.into_iter().zip([s.winch_force, s.winch_torque, s.winch_speed, s.winch_length])
        {
            let Some(given) = given else { continue };
            if kind != command {
                let message = format!(
                    "`{}` is no input of winches commanded by {}, expected `{}` ({})",
                    kind.input(),
                    command.name(),
                    command.input(),
                    command.unit()
                );
                return Err(ModelFileError { line: line_of_key(text, kind.input()), message });
            }
            commanded = Some(per_cable(command.input(), Some(given), given)?);
        }
        let lengths =
            s.unstretched_length.map(|given| per_cable("unstretched_length", Some(given), given)).transpose()?;
        let way = if command.is_servo() { Initialization::FromStates } else { Initialization::default() };
        let mut model = Self {
            parameters,
            relative_tolerance: keys.relative_tolerance.unwrap_or(DEFAULT_TOLERANCE),
            solver: keys.solver.unwrap_or_default(),
            start: Start {
                time: 0.0,
                initialization: keys.initialization.unwrap_or(way),
                pose: [or(s.x), or(s.y), or(s.phi)],
                twist: [or(s.vx), or(s.vy), or(s.omega)],
                unstretched_length: start.unstretched_length,
                unstretched_length_rate: per_cable(
                    "unstretched_length_rate",
                    s.unstretched_length_rate,
                    start.unstretched_length_rate,
                )?,
                inputs: Inputs {
                    winch_force: start.inputs.winch_force,
                    disturbance: [or(s.disturbance_force_x), or(s.disturbance_force_y), or(s.disturbance_torque)],
                },
            },
            effects: keys.effect.iter().map(|e| e.get_ref().clone()).collect(),
        };
        let lines: Vec<usize> = keys.effect.iter().map(|e| line_at(text, e.span().start)).collect();
        let plant = model.plant().map_err(ModelError::from);
        let checked = plant.and_then(|plant| {
            model.start = model.start.with_defaults(&plant, [commanded, lengths])?;
            model.check_values()?;
            model.check_start(&plant)?;
            Ok(plant)
        });
        let plant = checked.map_err(|error| ModelFileError {
            line: match &error {
                ModelError::Plant(PlantError::Parameter(e)) | ModelError::Value(e) => {
                    // Angles are as many as the others: either key may be the one that stands there.
                    line_of_key(text, &e.key).or_else(|| line_of_key(text, "attachment_angle"))
                }
                ModelError::Plant(PlantError::Effect(e)) => line_of_effect(&model, &lines, &e.id),
                ModelError::Plant(PlantError::Twice { id, .. }) => line_of_effect(&model, &lines, id),
                ModelError::Plant(PlantError::TooManyStates { .. }) | ModelError::Start(_) => None,
            },
            message: match &error {
                ModelError::Value(e) if e.key == "pose" => {
                    format!("{error}; `x`, `y` and `phi` under [start] say where it begins")
                }
                _ => error.to_string(),
            },
        })?;
        Ok((model, plant))
    }

    /// Checks every value and that a plant can be built.
    ///
    /// # Errors
    /// The first thing wrong.
    pub fn check(&self) -> Result<(), ModelError> {
        self.build().map(drop)
    }

    /// The plant of this model, whose every value is checked: all that a simulation of it takes, built once.
    ///
    /// # Errors
    /// The first thing wrong.
    pub fn build(&self) -> Result<Arc<Plant>, ModelError> {
        self.check_values()?;
        let plant = self.plant()?;
        self.check_start(&plant)?;
        Ok(plant)
    }

    /// Checks what can be checked without a plant.
    pub(crate) fn check_values(&self) -> Result<(), ModelError> {
        check_tolerance(self.relative_tolerance)?;
        let s = &self.start;
        let inputs = &s.inputs;
        let named = [
            ("x", &s.pose[..]),
            ("vx", &s.twist[..]),
            ("unstretched_length", &s.unstretched_length[..]),
            ("unstretched_length_rate", &s.unstretched_length_rate[..]),
            (self.parameters.winch.command.input(), &inputs.winch_force[..]),
            ("disturbance_force_x", &inputs.disturbance[..]),
        ];
        for (key, values) in named {
            if let Some(bad) = values.iter().find(|v| !v.is_finite()) {
                return Err(ParameterError::new(key, bad, "finite numbers").into());
            }
        }
        Ok(())
    }

    /// Checks the start against the model's plant.
    pub(crate) fn check_start(&self, plant: &Plant) -> Result<(), ModelError> {
        let s = &self.start;
        let start = s.behind_sensors(plant);
        plant.geometry().check_pose(&start.pose)?;
        start.check_initialization(plant)?;
        if s.initialization == Initialization::FromStates {
            for i in (0..plant.cables()).filter(|i| plant.unstretched_index(*i).is_some()) {
                if start.unstretched_length[i] <= 0.0 {
                    let found = s.unstretched_length[i];
                    let expected = "lengths greater than 0 where `initialization` is \"from_states\"";
                    return Err(ParameterError::new("unstretched_length", found, expected).into());
                }
            }
        }
        Ok(())
    }

    /// The plant of this model, whatever its start.
    ///
    /// # Errors
    /// See [`Plant::new`].
    pub fn plant(&self) -> Result<Arc<Plant>, PlantError> {
        Plant::new(self.parameters.clone(), self.effects.clone()).map(Arc::new)
    }

    /// A simulation of this model from its start, whose values are what the sensors show.
    ///
    /// # Errors
    /// The plant cannot be built, or there is no start state.
    pub fn simulation(&self) -> Result<Simulation, ModelError> {
        self.simulation_of(self.plant()?)
    }

    /// The same with its plant as built before.
    ///
    /// # Errors
    /// There is no start state.
    pub fn simulation_of(&self, plant: Arc<Plant>) -> Result<Simulation, ModelError> {
        let start = self.start.behind_sensors(&plant);
        Ok(Simulation::new(plant, &start, self.relative_tolerance)?.with_solver(self.solver))
    }
}

/// What [`Model::check`] finds.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ModelError {
    /// The plant cannot be built.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// A start value or setting is out of range.
    #[error(transparent)]
    Value(#[from] ParameterError),
    /// There is no start state.
    #[error(transparent)]
    Start(#[from] StartError),
}

fn line_of_effect(model: &Model, lines: &[usize], id: &str) -> Option<usize> {
    let last = model.effects.iter().rposition(|e| e.id == id)?;
    lines.get(last).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_written_model_reads_back() {
        let mut model = Model::default();
        model.parameters.platform_mass = 2600.5;
        model.solver = Solver::DormandPrince;
        model.start.pose = [0.1, -0.2, 0.3];
        model.effects = vec![
            EffectSpec::new("winch_coulomb_friction", Some(3), &[250.0, 0.01]).unwrap(),
            EffectSpec::expression("platform.force_x", "-34.8*x*abs(y)").unwrap(),
        ];
        let text = model.to_toml();
        assert_eq!(Model::from_toml(&text).unwrap(), model, "{text}");
    }

    #[test]
    fn a_model_reads_back_whatever_commands_its_winches() {
        for (command, expected) in [("force", 1e3), ("torque", 400.0), ("speed", 0.0), ("length", 899.996)] {
            let text =
                format!("[winch]\ncommand = \"{command}\"\ndrum_radius = 0.8\ngear_ratio = 2.0\nrotor_inertia = 1.5");
            let model = Model::from_toml(&text).unwrap();
            let start = model.start.inputs.winch_force;
            assert!((start[3] - expected).abs() < 1e-2 * (1.0 + expected), "{command}: {start:?}");
            assert_eq!(Model::from_toml(&model.to_toml()).unwrap(), model, "{}", model.to_toml());
            let tension = model.simulation().unwrap().outputs().tension;
            assert!(tension.iter().all(|t| (t - 1e3).abs() < 1e-4), "{command}: {tension:?}");
        }
    }

    /// A model of three cables to one point, the third from this anchor and with this said beside it.
    fn three(anchor: &str, more: &str) -> String {
        let cable = |anchor: &str| format!("[[cable]]\nanchor = {anchor}\nattachment = [0.0, 1.0]\n");
        format!("\n{}{}{}{more}", cable("[-1.0, 1.0]"), cable("[1.0, 1.0]"), cable(anchor))
    }

    /// A winch of 400 N was to hold the 1 kN that each cable had at the start, and paid out until it could.
    #[test]
    fn a_servo_starts_with_no_more_than_it_can_hold() {
        let model = Model::from_toml("[winch]\ncommand = \"speed\"\nforce_limit = 400.0").unwrap();
        let mut simulation = model.simulation().unwrap();
        simulation.advance(1.0).unwrap();
        let tension = simulation.outputs().tension;
        assert!(tension.iter().all(|t| (t - 200.0).abs() < 1e-3), "{tension:?}");
    }

    /// The line of a pair was not found: its error names an axis.
    #[test]
    fn errors_in_pairs_name_their_line() {
        for (text, expected) in [
            ("platform_mass = 1.0\ngravity = [0.0, inf]", "line 2: `gravity (y)` is inf"),
            ("centre_of_mass = [nan, 0.0]", "line 1: `centre_of_mass (x)` is NaN"),
            (&three("[0.0, nan]", ""), "line 9: `cable[3].anchor (y)` is NaN"),
            ("[winch]\nbandwidth = -1.0", "line 2: `bandwidth` is -1, expected a finite number greater than 0"),
        ] {
            let error = Model::from_toml(text).unwrap_err().to_string();
            assert!(error.starts_with(expected), "{error}");
        }
    }

    #[test]
    fn errors_name_line_and_key() {
        for (text, line, part) in [
            ("platform_mass = 1.0\nplatform_mas = 2.0", Some(2), "platform_mas"),
            ("\nplatform_mass = -1.0", Some(2), "`platform_mass` is -1, expected"),
            ("platform_mass = \"heavy\"", Some(1), "`platform_mass`: invalid type: string"),
            ("cable_model = \"elastic\"", Some(1), "rigid"),
            ("solver = \"euler\"", Some(1), "dormand_prince"),
            ("[[effect]]\nid = \"nothing\"", Some(1), "winch_coulomb_friction"),
            ("[[effect]]\nid = \"winch_lag\"", Some(1), "no `time_constant`"),
            ("[start]\nx = 1\ny = 1000.0", Some(2), "inside the anchors"),
            ("[start]\n\nphi = 1.2", Some(3), "cable"),
            ("anchor_angle = [0.0, 1.0]", Some(1), "`anchor_angle` is 2 angles, expected 4"),
            ("attachment_angle = [0.0, 1.0, 2.0]", Some(1), "`anchor_angle` is 4 angles, expected 3"),
            ("[start]\nwinch_force = [1.0, 2.0]", Some(2), "`winch_force` has 2 entries, expected 4"),
            ("[[cable]]\nanchor = [0.0, 1.0]\nattachment = [0.0, 0.0]", Some(1), "1 cable, expected 2 to 12"),
            ("[start]\nwinch_force = [1.0, 1.0, 1.0, 1.0, 1.0]", Some(2), "`winch_force` has 5 entries, expected 4"),
            ("[start]\nunstretched_length = []", Some(2), "`unstretched_length`"),
            ("\ngravity = [0.0, -9.81, 0.0]", Some(2), "`gravity`: invalid length 3, expected two numbers"),
            ("centre_of_mass = [1.0]", Some(1), "`centre_of_mass`: invalid length 1"),
            ("[[cable]]\nanchor = [0.0, 1.0, 2.0]\nattachment = [0.0, 0.0]", Some(2), "`anchor`: invalid length 3"),
            ("[winch]\ncommand = \"volts\"", Some(2), "torque"),
            ("[winch]\n\ndrum_radius = 0.0", Some(3), "`drum_radius` is 0, expected a finite number greater than 0"),
            (
                "[winch]\ncommand = \"speed\"\n[start]\nwinch_force = [1.0, 1.0, 1.0, 1.0]",
                Some(4),
                "expected `winch_speed`",
            ),
            ("cable_model = \"rigid\"\n[winch]\ncommand = \"length\"", Some(3), "lumped_mass"),
            ("initialization = \"static_equilibrium\"\n[winch]\ncommand = \"speed\"", Some(1), "from_states"),
            ("cable_inertia = \"none\"\n[winch]\ncommand = \"speed\"", None, "rotor_inertia of winch 1"),
            ("platform_mass = ", Some(1), ""),
            ("[cable]\nanchor = [1.0, 1.0]", Some(1), "`[cable]`: invalid type"),
            ("winch = 3", Some(1), "invalid type: integer `3`, expected a table [winch]"),
            (&three("[-1.0, -1.0]", "area = -1.0"), Some(11), "`cable[3].area` is -1, expected"),
            (&three("[1.0, 1.0]", ""), Some(9), "two cables in one place are one"),
            (&three("[-1.0, -1.0]", "[start]\nx = 7.0"), Some(12), "`x`, `y` and `phi` under [start] say where"),
            (&three("[3.0, 1.0]", ""), None, "they lie on one line, and without gravity nothing else holds it"),
        ] {
            let error = Model::from_toml(text).unwrap_err();
            assert_eq!(error.line, line, "{text:?}: {error}");
            assert!(error.to_string().contains(part), "{text:?}: {error}");
        }
    }
}
