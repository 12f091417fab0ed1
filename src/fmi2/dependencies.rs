//! What each output and derivative depends on: the union over all cable models.

use fmi2_export::description::{Dependency, DependencyKind};

use super::role::{Choice, Role, State};
use super::table::Table;
use crate::effect::{DependsOn, Site, Stage};
use crate::model_file::Model;
use crate::parameter::REALS;
use crate::per_cable::PerCable;
use crate::plant::Plant;
use crate::signal::Signal;
use crate::winch::WinchCommand;

/// Writes the dependencies into the table.
pub(super) fn declare(table: &mut Table, model: &Model, plant: &Plant) {
    let knowns = Knowns::new(table, model, plant);
    for index in 0..table.roles.len() {
        let role = table.roles[index];
        let variable = &mut table.description.variables[index];
        variable.dependencies = knowns.of(role).map(sorted);
        variable.initial_dependencies = knowns.initially(role).map(sorted);
    }
}

fn sorted(mut list: Vec<Dependency>) -> Vec<Dependency> {
    list.sort_by_key(|d| d.index);
    list
}

/// Indices of the knowns, by what they are, and what this model's effects let depend on what.
struct Knowns {
    pose: [usize; 3],
    twist: [usize; 3],
    length: PerCable<usize>,
    rate: PerCable<usize>,
    force: PerCable<usize>,
    disturbance: [usize; 3],
    effects: Vec<EffectState>,
    initialization: usize,
    /// Parameters that the pose at rest depends on: geometry, effects, the way of initialisation.
    rest: Vec<usize>,
    /// Time, where something depends on it.
    time: Option<usize>,
    /// Everything on one cable can depend on the axial states of the others.
    coupled: bool,
    /// The shown pose is not the present one.
    late_pose: bool,
    /// The shown position depends on the whole pose.
    pose_in_frame: bool,
}

struct EffectState {
    index: usize,
    state: State,
    cable: usize,
    /// The winch's command passes through the effect.
    command: bool,
    /// The effect moves across its cable and acts on the platform.
    swings: bool,
    /// The winch's pull depends on it.
    pull: bool,
}

impl Knowns {
    fn new(table: &Table, model: &Model, plant: &Plant) -> Self {
        let at = |role: Role| table.find(role).expect("the table has every state and input");
        let infos = || model.effects.iter().filter_map(|effect| effect.info().ok());
        let sensed = |on: DependsOn| infos().any(|info| info.site == Site::PoseSensor && info.depends_on.contains(&on));
        let effects = plant.states_of_effects().iter().flat_map(|place| {
            (0..place.count).map(move |k| {
                let state = State::Effect(place.cable, place.first + k);
                let command = matches!(place.stage, Stage::Command(_));
                let swings = place.stage == Stage::Transverse;
                let pull = command || place.stage == Stage::WinchLoss;
                EffectState { index: at(Role::State(state)), state, cable: place.cable, command, swings, pull }
            })
        });
        // A drum's radius and gear count where they turn torques into forces.
        let torque = model.parameters.winch.command == WinchCommand::Torque;
        let rest = table.roles.iter().enumerate().filter(|(_, role)| match role {
            Role::Parameter(place, _) if REALS[*place].of_drive() => torque,
            // Geometry, and weight: the platform's mass and gravity.
            Role::Parameter(place, _) => ["m", "rad", "kg", "m/s2"].contains(&REALS[*place].unit),
            Role::EffectParameter(..) | Role::Choice(Choice::Initialization) => true,
            _ => false,
        });
        let over_cables = |index: &dyn Fn(usize) -> usize| PerCable::from_fn(plant.cables(), index);
        let in_time = infos().any(|info| info.nature().in_time) || plant.next_switch(f64::NEG_INFINITY).is_some();
        Self {
            pose: std::array::from_fn(|k| at(Role::State(State::Pose(k)))),
            twist: std::array::from_fn(|k| at(Role::State(State::Twist(k)))),
            length: over_cables(&|i| at(Role::State(State::UnstretchedLength(i)))),
            rate: over_cables(&|i| at(Role::State(State::UnstretchedRate(i)))),
            force: over_cables(&|i| at(Role::WinchForce(i))),
            disturbance: std::array::from_fn(|k| at(Role::Disturbance(k))),
            effects: effects.collect(),
            initialization: at(Role::Choice(Choice::Initialization)),
            rest: rest.map(|(index, _)| index).collect(),
            time: in_time.then(|| at(Role::Time)),
            coupled: infos().any(|info| info.nature().couples_cables),
            late_pose: sensed(DependsOn::Speed),
            pose_in_frame: sensed(DependsOn::Position),
        }
    }

    /// At communication points; `None` for what is no unknown.
    fn of(&self, role: Role) -> Option<Vec<Dependency>> {
        Some(match role {
            Role::State(state) => self.shown(state.signal()?),
            Role::Output(signal) => self.shown(signal),
            Role::Rate(State::UnstretchedLength(i) | State::UnstretchedRate(i)) | Role::Slack(i) => self.along_cable(i),
            Role::Rate(State::Pose(k)) if self.pose_in_frame && k < 2 => {
                let mut list = on(&self.twist);
                list.push(Dependency::on(self.pose[2]));
                list
            }
            Role::Rate(State::Pose(k)) => vec![constant(self.twist[k])],
            Role::Rate(State::Twist(_)) => self.everything(),
            Role::Rate(state @ State::Effect(i, _)) => {
                let command = self.effects.iter().any(|e| e.state == state && e.command);
                if command { self.along_command(i) } else { self.along_cable(i) }
            }
            Role::Time
            | Role::WinchForce(_)
            | Role::Disturbance(_)
            | Role::Parameter(..)
            | Role::EffectParameter(..)
            | Role::Choice(_) => return None,
        })
    }

    /// What a signal depends on.
    fn shown(&self, signal: Signal) -> Vec<Dependency> {
        match signal {
            Signal::Pose(_) if self.late_pose => Vec::new(),
            Signal::Pose(k) => vec![constant(self.pose[k])],
            Signal::Twist(k) => vec![constant(self.twist[k])],
            // In rigid cables the length follows from the pose, in the others it is a state.
            Signal::UnstretchedLength(i) => {
                let mut list = on(&self.pose);
                list.push(Dependency::of_kind(self.length[i], DependencyKind::Fixed));
                list
            }
            Signal::CableLength(_) | Signal::CableAngle(_) => on(&self.pose),
            Signal::Strain(i) | Signal::WinchAngle(i) => {
                let mut list = on(&self.pose);
                list.push(Dependency::on(self.length[i]));
                list
            }
            Signal::UnstretchedRate(i) | Signal::Tension(i) | Signal::WinchRate(i) => self.along_cable(i),
            Signal::Acceleration(_) => self.everything(),
        }
    }

    fn everything(&self) -> Vec<Dependency> {
        let mut list = self.platform_and_inputs();
        list.extend(on(&self.length));
        list.extend(on(&self.rate));
        list.extend(self.effects_where(|_| true));
        list
    }

    /// What tension and winch speed depend on: in rigid cables on the accelerations, hence on all inputs; but on the
    /// axial states of this cable only.
    fn along_cable(&self, i: usize) -> Vec<Dependency> {
        if self.coupled {
            return self.everything();
        }
        let mut list = self.platform_and_inputs();
        list.extend(on(&[self.length[i], self.rate[i]]));
        list.extend(self.effects_where(|e| e.pull || e.swings || e.cable == i));
        list
    }

    /// What a transformation of the winch's command depends on.
    fn along_command(&self, i: usize) -> Vec<Dependency> {
        let mut list = on(&[self.force[i]]);
        list.extend(self.effects_where(|e| e.command && e.cable == i));
        list
    }

    fn platform_and_inputs(&self) -> Vec<Dependency> {
        let mut list = on(&self.pose);
        list.extend(on(&self.twist));
        list.extend(on(&self.force));
        list.extend(on(&self.disturbance));
        list.extend(self.time.map(Dependency::on));
        list
    }

    fn effects_where(&self, keep: impl Fn(&EffectState) -> bool) -> impl Iterator<Item = Dependency> {
        self.effects.iter().filter(move |e| keep(e)).map(|e| Dependency::on(e.index))
    }

    /// In initialisation mode, where it is less than everything; `static_equilibrium` moves the start pose.
    fn initially(&self, role: Role) -> Option<Vec<Dependency>> {
        match role {
            Role::Rate(State::Pose(k)) => Some(on(&[self.twist[k], self.initialization])),
            Role::Output(Signal::CableLength(_) | Signal::CableAngle(_)) => {
                let mut list = on(&self.pose);
                list.extend(on(&self.force));
                list.extend(on(&self.disturbance));
                list.extend(on(&self.rest));
                list.extend(self.time.map(Dependency::on));
                Some(list)
            }
            _ => None,
        }
    }
}

fn on(indices: &[usize]) -> Vec<Dependency> {
    indices.iter().copied().map(Dependency::on).collect()
}

fn constant(index: usize) -> Dependency {
    Dependency::of_kind(index, DependencyKind::Constant)
}
