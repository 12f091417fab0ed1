//! The one table of variables: names, value references, units, causality, start values.
//!
//! Value references are fixed: time 0, inputs from 1 (torques from 72, speeds from 76, lengths from 80), outputs from 10
//! (winches' from 64), derivatives from 50, parameters from 100,
//! parameters of effects from 1000, states of effects from 2000, and what belongs to a fifth or further cable from 10000. The table does not change with the cable model, so
//! that the model can be chosen by a parameter.

use std::collections::BTreeSet;

use fmi2_export::description::{
    DefaultExperiment, Enumeration, Initial, Kind, LogCategory, ModelDescription, Variable,
};
use fmi2_export::{ModelError, Value};

use super::parameters::{parameter_reference, reference};
use super::role::{Choice, Role, State};
use super::{IDENTIFIER, dependencies, units};
use crate::effect::{EffectSpec, Stage, acts_on};
use crate::model_file::Model;
use crate::parameter::{REALS, RealParameter};
use crate::plant::Plant;
use crate::signal::{DISTURBANCES, Facts, Signal, indexed};
use crate::simulation::Start;
use crate::winch::WinchCommand;

/// Category of the integrator's statistics.
pub(super) const LOG_SOLVER: &str = "logSolver";
/// Category of cables that go slack or taut.
pub(super) const LOG_EVENTS: &str = "logEvents";

/// The description, and what each of its variables stands for.
#[derive(Clone, Debug)]
pub(super) struct Table {
    pub(super) description: ModelDescription,
    pub(super) roles: Vec<Role>,
}

impl Table {
    /// The table of `model`, whose start values are final; `plant` is its plant.
    ///
    /// # Errors
    /// The table breaks a rule of FMI, as where a start value is beyond its bounds.
    pub(super) fn new(model: &Model, plant: &Plant) -> Result<Self, ModelError> {
        let mut table = Self { description: header(model), roles: Vec::new() };
        table.inputs(model);
        table.outputs(model);
        table.rates();
        table.effect_states(model, plant);
        table.parameters(model);
        table.effect_parameters(model);
        table.later_outputs(model);
        table.choice(Choice::Solver, model);
        table.units();
        dependencies::declare(&mut table, model, plant);
        table.description.validate().map_err(|error| ModelError::new(error.to_string()))?;
        Ok(table)
    }

    /// Index of the variable that stands for `role`.
    pub(super) fn find(&self, role: Role) -> Option<usize> {
        self.roles.iter().position(|r| *r == role)
    }

    fn add(&mut self, role: Role, variable: Variable) {
        self.description.add(variable);
        self.roles.push(role);
    }

    fn inputs(&mut self, model: &Model) {
        let start = model.start.inputs;
        let time = Variable::real("time", 0).independent().unit("s").quantity("Time").described("Time");
        self.add(Role::Time, time);
        for i in 0..model.parameters.cables() {
            let variable = command(model.parameters.winch.command, i).input().start(start.winch_force[i]);
            self.add(Role::WinchForce(i), variable);
        }
        for (k, facts) in DISTURBANCES.iter().enumerate() {
            let variable = of_facts(facts, facts.name, 5 + k as u32).input().start(start.disturbance[k]);
            self.add(Role::Disturbance(k), variable.described(facts.description));
        }
    }

    fn outputs(&mut self, model: &Model) {
        let cables = model.parameters.cables();
        for signal in Signal::all(cables).into_iter().filter(|signal| !came_later(*signal)) {
            self.add(signal.into(), output(signal, &model.start));
        }
        for i in 0..cables {
            let variable = Variable::boolean(indexed("slack", i), reference(0, i)).output();
            self.add(Role::Slack(i), variable.described(format!("Cable {} carries nothing", i + 1)));
        }
    }

    /// The derivative of each state among the outputs.
    fn rates(&mut self) {
        let states: Vec<(usize, State)> = self.states().collect();
        for (index, state) in states {
            let reference = match state {
                State::Pose(k) => 50 + k as u32,
                State::Twist(k) => 53 + k as u32,
                State::UnstretchedLength(i) => reference(56, i),
                State::UnstretchedRate(i) => reference(60, i),
                // They come after the outputs, with their states.
                State::Effect(..) => continue,
            };
            self.add_rate(index, state, reference);
        }
    }

    fn states(&self) -> impl Iterator<Item = (usize, State)> + '_ {
        self.roles.iter().enumerate().filter_map(|(index, role)| match role {
            Role::State(state) => Some((index, *state)),
            _ => None,
        })
    }

    fn add_rate(&mut self, index: usize, state: State, reference: u32) {
        let of = &self.description.variables[index];
        let name = format!("der({})", of.name);
        let text = format!("Time derivative of {}", of.name);
        let (unit, nominal) = match &of.kind {
            Kind::Real(real) => (real.unit.clone().unwrap_or_default(), real.nominal.unwrap_or(1.0)),
            _ => (String::new(), 1.0),
        };
        let unit = match unit.strip_suffix("/s") {
            Some(first) => format!("{first}/s2"),
            None => format!("{unit}/s"),
        };
        let variable = real(&name, reference, &unit, "", nominal).derivative_of_state(index).described(text);
        self.add(Role::Rate(state), variable);
    }

    fn effect_states(&mut self, model: &Model, plant: &Plant) {
        let mut reference = 2000;
        for place in plant.states_of_effects() {
            let spec = &model.effects[place.effect];
            for k in 0..place.count {
                let (unit, nominal) = match (place.stage, k) {
                    (Stage::Command(_), _) => ("N", 1e3),
                    (Stage::WinchLoss, _) => ("m", 1e-3),
                    (Stage::Transverse, 0) => ("m", 0.1),
                    (Stage::Transverse, _) => ("m/s", 0.1),
                    _ => ("1", 1e-4),
                };
                let on_cable = |other: &EffectSpec| acts_on(other.cable, plant.cables())[place.cable];
                let owner = format!("effect.{}[{}]", spec.id, place.cable + 1);
                let mut name = format!("{}.state", entry(&owner, model, place.effect, on_cable));
                if place.count > 1 {
                    name = indexed(&name, k);
                }
                let state = State::Effect(place.cable, place.first + k);
                let text = format!("State of effect {} on cable {}", spec.id, place.cable + 1);
                self.add(Role::State(state), real(&name, reference, unit, "", nominal).described(text));
                self.add_rate(self.roles.len() - 1, state, reference + 1);
                reference += 2;
            }
        }
    }

    fn parameters(&mut self, model: &Model) {
        // The accessors of the list lend mutably.
        let mut model = model.clone();
        for (place, parameter) in REALS.iter().enumerate() {
            for i in 0..parameter.count(model.parameters.cables()) {
                if let Some(start) = (parameter.field)(&mut model, i) {
                    self.add(Role::Parameter(place, i), real_parameter(place, i, *start));
                }
            }
        }
        for choice in [Choice::CableModel, Choice::CableInertia, Choice::Initialization] {
            self.choice(choice, &model);
        }
    }

    fn choice(&mut self, choice: Choice, model: &Model) {
        let place = Choice::ALL.iter().position(|which| *which == choice).expect("all choices are among them");
        let enumeration = &enumerations()[place];
        let variable = Variable::enumeration(choice.variable(), place as u32, &enumeration.name)
            .parameter()
            .start_value(Value::Integer(choice.get(model)))
            .described(enumeration.description.clone().unwrap_or_default());
        self.add(Role::Choice(choice), variable);
    }

    fn effect_parameters(&mut self, model: &Model) {
        let mut reference = 1000;
        for (effect, spec) in model.effects.iter().enumerate() {
            let Ok(info) = spec.info() else { continue };
            for (k, parameter) in info.parameters.iter().enumerate() {
                let name = self.parameter_name(model, effect, k);
                let nominal = 0.5 * (parameter.typical.0.abs() + parameter.typical.1.abs());
                let mut variable = real(&name, reference, parameter.unit, "", nominal)
                    .parameter()
                    .start(spec.values[k])
                    .described(format!("{}: {}", info.title, parameter.description));
                if parameter.min.is_finite() {
                    variable = variable.min(parameter.min);
                }
                if parameter.max.is_finite() {
                    variable = variable.max(parameter.max);
                }
                self.add(Role::EffectParameter(effect, k), variable);
                reference += 1;
            }
            let times = [(spec.from, "time at which it begins"), (spec.until, "time at which it ends")];
            for (k, (time, text)) in (info.parameters.len()..).zip(times) {
                if let Some(time) = time {
                    let variable = real(&self.parameter_name(model, effect, k), reference, "s", "Time", 1.0)
                        .parameter()
                        .start(time)
                        .described(format!("{}: {text}", info.title));
                    self.add(Role::EffectParameter(effect, k), variable);
                    reference += 1;
                }
            }
        }
    }

    /// What was added later, behind all else, so that the variables before keep their places.
    fn later_outputs(&mut self, model: &Model) {
        let all = Signal::all(model.parameters.cables());
        for signal in all.into_iter().filter(|signal| came_later(*signal)) {
            self.add(signal.into(), output(signal, &model.start));
        }
    }

    /// The variable of an effect's parameter; with the channel in it where one sensor effect has both channels, and with its
    /// number where an effect has several entries, each with its time.
    fn parameter_name(&self, model: &Model, effect: usize, parameter: usize) -> String {
        let spec = &model.effects[effect];
        let name = spec.variable_name(parameter).unwrap_or_default();
        let Some((owner, after)) = name.rsplit_once('.') else { return name };
        let mut owner = entry(owner, model, effect, |other| other.cable == spec.cable);
        if let Some(channel) = &spec.channel
            && self.description.find(&format!("{owner}.{after}")).is_some()
        {
            owner = format!("{owner}.{channel}");
        }
        format!("{owner}.{after}")
    }

    /// Every unit that a variable names, once.
    fn units(&mut self) {
        let names: BTreeSet<&str> = self
            .description
            .variables
            .iter()
            .filter_map(|variable| match &variable.kind {
                Kind::Real(real) => real.unit.as_deref(),
                _ => None,
            })
            .collect();
        self.description.units = names.into_iter().filter_map(units::unit).collect();
    }
}

/// The name of an effect's variables, numbered from the second entry of the same effect `there` on.
fn entry(owner: &str, model: &Model, effect: usize, there: impl Fn(&EffectSpec) -> bool) -> String {
    let spec = &model.effects[effect];
    let alike = |other: &&EffectSpec| other.id == spec.id && other.channel == spec.channel && there(other);
    match model.effects[..effect].iter().filter(alike).count() {
        0 => owner.to_owned(),
        before => format!("{owner}.entry{}", before + 1),
    }
}

/// The input that commands winch `i`.
fn command(command: WinchCommand, i: usize) -> Variable {
    let winch = i + 1;
    let (first, quantity, nominal, text) = match command {
        WinchCommand::Force => (1, "Force", 1e3, format!("Force of winch {winch} on its cable, positive when pulling")),
        WinchCommand::Torque => {
            (72, "Torque", 1e3, format!("Torque of the motor of winch {winch}, positive when pulling"))
        }
        WinchCommand::Speed => (76, "Velocity", 1.0, format!("Speed that winch {winch} is to pay out at")),
        WinchCommand::Length => (80, "Length", 1e3, format!("Length that winch {winch} is to have paid out")),
    };
    real(&indexed(command.input(), i), reference(first, i), command.unit(), quantity, nominal).described(text)
}

fn header(model: &Model) -> ModelDescription {
    let mut description = ModelDescription::new(IDENTIFIER, IDENTIFIER);
    description.description = Some(match model.parameters.cables() {
        4 => "Planar cable-driven parallel robot with four elastic cables".into(),
        cables => format!("Planar cable-driven parallel robot with {cables} elastic cables"),
    });
    description.author = Some("The cdpr authors".into());
    description.version = Some(env!("CARGO_PKG_VERSION").into());
    description.copyright = Some("Copyright (c) 2026 The cdpr authors".into());
    description.license = Some("MIT OR Apache-2.0".into());
    description.generation_tool = Some(concat!("cdpr ", env!("CARGO_PKG_VERSION")).into());
    description.enumerations = enumerations().into();
    description.log_categories = vec![
        LogCategory { name: LOG_SOLVER.into(), description: "What the integration has cost so far".into() },
        LogCategory { name: LOG_EVENTS.into(), description: "Cables that go slack or taut".into() },
    ];
    description.default_experiment = Some(DefaultExperiment {
        start_time: Some(0.0),
        stop_time: Some(60.0),
        tolerance: Some(model.relative_tolerance),
        step_size: Some(0.01),
    });
    description
}

/// In the order of the value references.
fn enumerations() -> [Enumeration; 4] {
    let named = |name: &str, text: &str, items: [(&str, &str); 3]| Enumeration {
        description: Some(text.into()),
        ..Enumeration::new(name, items)
    };
    [
        named(
            "CableModel",
            "Axial behaviour of the cables",
            [
                ("rigid", "Inextensible"),
                ("massless_spring", "Spring and damper without a mass of their own"),
                ("lumped_mass", "Mass on the winch side of spring and damper"),
            ],
        ),
        named(
            "CableInertia",
            "How the mass of the cables enters",
            [
                ("paper", "A rod that stretches and gains mass"),
                ("reeled", "A cable reeled out at constant density"),
                ("none", "Cables without mass"),
            ],
        ),
        named(
            "Initialization",
            "How the states get their start values",
            [
                ("from_winch_forces", "Pose and velocities as set; every spring starts carrying its winch force"),
                ("from_states", "Every state as set"),
                ("static_equilibrium", "The pose at rest under the forces as set, searched from the pose as set"),
            ],
        ),
        named(
            "Solver",
            "Method of integration",
            [
                ("radau", "Implicit: Radau IIA of order 5, stable whatever the model"),
                (
                    "dormand_prince",
                    "Explicit: Dormand and Prince's pair of orders 5 and 4; slow where the model is stiff",
                ),
                ("auto", "Explicit or implicit, whichever costs less as it goes"),
            ],
        ),
    ]
}

/// Whether its variable stands behind all else in the table.
fn came_later(signal: Signal) -> bool {
    matches!(signal, Signal::Acceleration(_) | Signal::WinchAngle(_) | Signal::WinchRate(_))
}

/// The variable that shows a signal.
fn output(signal: Signal, start: &Start) -> Variable {
    let first = match signal {
        Signal::Pose(_) => 10,
        Signal::Twist(_) => 13,
        Signal::CableLength(_) => 20,
        Signal::UnstretchedLength(_) => 24,
        Signal::UnstretchedRate(_) => 28,
        Signal::Tension(_) => 32,
        Signal::Strain(_) => 36,
        Signal::CableAngle(_) => 40,
        Signal::Acceleration(_) => 44,
        Signal::WinchAngle(_) => 64,
        Signal::WinchRate(_) => 68,
    };
    let variable = |number: usize| of_facts(signal.facts(), &signal.name(), reference(first, number)).output();
    let variable = match signal {
        Signal::Pose(k) => variable(k).initial(Initial::Exact).start(start.pose[k]),
        Signal::Twist(k) => variable(k).initial(Initial::Exact).start(start.twist[k]),
        Signal::CableLength(i) => variable(i).min(0.0),
        Signal::UnstretchedLength(i) => {
            variable(i).min(0.0).initial(Initial::Approx).start(start.unstretched_length[i])
        }
        Signal::UnstretchedRate(i) => variable(i).initial(Initial::Approx).start(start.unstretched_length_rate[i]),
        Signal::Strain(i) => variable(i).min(-1.0),
        Signal::CableAngle(i) => variable(i).min(-std::f64::consts::PI).max(std::f64::consts::PI),
        Signal::Acceleration(k) => variable(k),
        Signal::Tension(i) | Signal::WinchAngle(i) | Signal::WinchRate(i) => variable(i),
    };
    let number = signal.cable().map_or_else(String::new, |i| (i + 1).to_string());
    variable.described(signal.facts().description.replace("{}", &number))
}

fn of_facts(facts: &Facts, name: &str, reference: u32) -> Variable {
    real(name, reference, facts.unit, facts.quantity, facts.nominal)
}

fn real(name: &str, reference: u32, unit: &str, quantity: &str, nominal: f64) -> Variable {
    let mut variable = Variable::real(name, reference).unit(unit).nominal(nominal);
    if !quantity.is_empty() {
        variable = variable.quantity(quantity);
    }
    match units::display(unit) {
        Some(display) => variable.display_unit(display),
        None => variable,
    }
}

/// The variable of the parameter at this place of the list.
fn real_parameter(place: usize, index: usize, start: f64) -> Variable {
    let parameter: &RealParameter = &REALS[place];
    let name = parameter.variable(index);
    let reference = reference(parameter_reference(place), index);
    let mut variable =
        real(&name, reference, parameter.unit, parameter.quantity, parameter.nominal).parameter().start(start);
    variable = match parameter.per_cable {
        true => variable.described(format!("{}, cable {}", parameter.description, index + 1)),
        false => variable.described(parameter.description),
    };
    if let Some(min) = parameter.range.least() {
        variable = variable.min(min);
    }
    if let Some(max) = parameter.range.greatest() {
        variable = variable.max(max);
    }
    variable
}
