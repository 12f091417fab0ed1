//! Everything that can be set, with names, units and bounds in one list.

use cdpr::geometry::Geometry;
use cdpr::inverse::distribution;
use cdpr::model_file::Model;
use cdpr::parameters::Parameters;

use crate::reference::{Reference, smooth_step};

/// The controller's parameters. SI units, radians.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// The robot as the controller believes it to be: geometry, inertia and weight are used.
    pub robot: Parameters,
    /// Speed of the position loop (rad/s).
    pub position_bandwidth: f64,
    /// Damping ratio of the position loop.
    pub position_damping: f64,
    /// Speed of the orientation loop (rad/s).
    pub orientation_bandwidth: f64,
    /// Damping ratio of the orientation loop.
    pub orientation_damping: f64,
    /// Time constant of the low pass on the feedback (s).
    pub filter_time: f64,
    /// Where to be.
    pub reference: Reference,
    /// How strongly to pull.
    pub bounds: Bounds,
    /// How strongly to pull at the start (N).
    pub start_tension: f64,
    /// Time in which the pull rises from there to the mean (s).
    pub tautening_time: f64,
}

/// Bounds of the winch forces and where to be between them (N).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Smallest force.
    pub min: f64,
    /// The force that each winch should be near.
    pub mean: f64,
    /// Largest force.
    pub max: f64,
}

/// Mean and largest winch force by default, for each kilogram of the platform (N/kg): 20 and 60 kN for that of Table I.
const MEAN_PULL: f64 = 8.0;
const MOST_PULL: f64 = 24.0;
/// Radius of the circle by default, as a part of the farthest anchor's distance: 5 m in 900 m.
const CIRCLE_PER_SIZE: f64 = 1.0 / 180.0;

impl Default for Settings {
    fn default() -> Self {
        Self::of(&Model::default())
    }
}

impl Settings {
    /// Those to begin with for the robot of a model: it holds the pose of the model's start, pulls as the model's start
    /// does, and goes on to what suits the platform's mass.
    #[must_use]
    pub fn of(model: &Model) -> Self {
        let robot = model.parameters.clone();
        let usual = distribution::Bounds::of_mass(robot.platform_mass);
        let [mean, max] = [MEAN_PULL, MOST_PULL].map(|per_mass| per_mass * robot.platform_mass);
        let bounds = Bounds { min: usual.lower(), mean, max };
        let start = &model.start.inputs.winch_force;
        // Many masters pass no values on before the first step, and a jump in the winch forces makes the cables ring.
        let start_tension = start.iter().sum::<f64>() / start.len() as f64;
        Self {
            position_bandwidth: 0.4,
            position_damping: 0.8,
            orientation_bandwidth: 0.4,
            orientation_damping: 0.8,
            filter_time: 0.3,
            reference: Reference {
                set_point: model.start.pose,
                radius: CIRCLE_PER_SIZE * Geometry::new(&robot).size(),
                period: 60.0,
                ramp: 20.0,
            },
            bounds,
            start_tension: start_tension.clamp(bounds.min, bounds.max),
            tautening_time: 10.0,
            robot,
        }
    }

    /// The bounds a time `t` (s) after the start: the mean comes up from the tension at the start.
    #[must_use]
    pub fn bounds_at(&self, t: f64) -> Bounds {
        let [share, ..] = smooth_step(t, self.tautening_time);
        Bounds { mean: self.start_tension + share * (self.bounds.mean - self.start_tension), ..self.bounds }
    }

    /// What the list's bounds do not say.
    pub(crate) fn check(&self) -> Result<(), String> {
        let Bounds { min, mean, max } = self.bounds;
        if !(min < max && min <= mean && mean <= max) {
            return Err(format!("expected min_tension <= mean_tension <= max_tension, found {min}, {mean}, {max} N"));
        }
        let start = self.start_tension;
        if !(min <= start && start <= max) {
            return Err(format!(
                "expected start_tension from min_tension to max_tension, found {start} in {min} to {max} N"
            ));
        }
        Ok(())
    }
}

/// One entry of the list.
#[derive(Debug)]
pub(crate) struct Setting {
    pub(crate) name: &'static str,
    pub(crate) unit: &'static str,
    pub(crate) description: &'static str,
    /// Smallest value, where there is one.
    pub(crate) min: Option<f64>,
    /// May it change while the simulation runs?
    pub(crate) tunable: bool,
    /// One for each cable, named `name[1]` to `name[n]`.
    pub(crate) per_cable: bool,
    /// Where it is kept, `None` where this robot has none; the cable is 0 where there is one for all.
    pub(crate) place: fn(&mut Settings, usize) -> Option<&mut f64>,
}

/// One number of the settings.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Entry {
    pub(crate) setting: &'static Setting,
    /// Cable, from 0.
    cable: usize,
}

impl Entry {
    pub(crate) fn name(&self) -> String {
        let name = self.setting.name;
        if self.setting.per_cable { format!("{name}[{}]", self.cable + 1) } else { name.to_owned() }
    }

    /// Where it is kept in settings that have it, as [`Settings::entries`] says.
    pub(crate) fn place<'a>(&self, settings: &'a mut Settings) -> &'a mut f64 {
        (self.setting.place)(settings, self.cable).expect("entries are those that the settings have")
    }
}

impl Settings {
    /// All numbers that these settings have, in the list's order.
    pub(crate) fn entries(&self) -> Vec<Entry> {
        let mut copy = self.clone();
        let cables = self.robot.cables();
        let count = |setting: &Setting| if setting.per_cable { cables } else { 1 };
        let all = SETTINGS.iter().flat_map(|setting| (0..count(setting)).map(move |cable| Entry { setting, cable }));
        all.filter(|entry| (entry.setting.place)(&mut copy, entry.cable).is_some()).collect()
    }
}

type Field = fn(&mut Settings, usize) -> Option<&mut f64>;

const fn setting(
    name: &'static str,
    unit: &'static str,
    min: Option<f64>,
    description: &'static str,
    place: Field,
) -> Setting {
    Setting { name, unit, description, min, tunable: false, per_cable: false, place }
}

const fn tunable(setting: Setting) -> Setting {
    Setting { tunable: true, ..setting }
}

const fn per_cable(setting: Setting) -> Setting {
    Setting { per_cable: true, ..setting }
}

/// The parameters of a robot whose cables lie on two circles.
fn circles(settings: &mut Settings) -> Option<&mut Parameters> {
    settings.robot.cable.is_empty().then_some(&mut settings.robot)
}

const ANCHOR: &str = "Angle of the anchor on its circle";
const ATTACHMENT: &str = "Angle of the attachment point on its circle, in the body frame";

/// A value above zero that stands for "greater than zero" in a table that only knows "at least".
const POSITIVE: Option<f64> = Some(1e-6);
const NOT_NEGATIVE: Option<f64> = Some(0.0);

/// All settings, in the order of the FMU's parameters; those of the robot under the names that the plant has.
static SETTINGS: [Setting; 32] = [
    setting("platform_mass", "kg", POSITIVE, "Mass of the platform", |s, _| Some(&mut s.robot.platform_mass)),
    setting("platform_inertia", "kg.m2", POSITIVE, "Moment of inertia of the platform", |s, _| {
        Some(&mut s.robot.platform_inertia)
    }),
    setting("centre_of_mass_x", "m", None, "Centre of mass along x of the body frame", |s, _| {
        Some(&mut s.robot.centre_of_mass[0])
    }),
    setting("centre_of_mass_y", "m", None, "Centre of mass along y of the body frame", |s, _| {
        Some(&mut s.robot.centre_of_mass[1])
    }),
    setting("gravity_x", "m/s2", None, "Gravity along x", |s, _| Some(&mut s.robot.gravity[0])),
    setting("gravity_y", "m/s2", None, "Gravity along y", |s, _| Some(&mut s.robot.gravity[1])),
    setting("anchor_radius", "m", POSITIVE, "Radius of the circle of anchors", |s, _| {
        circles(s).map(|robot| &mut robot.anchor_radius)
    }),
    setting("attachment_radius", "m", POSITIVE, "Radius of the circle of attachment points", |s, _| {
        circles(s).map(|robot| &mut robot.attachment_radius)
    }),
    per_cable(setting("anchor_angle", "rad", None, ANCHOR, |s, i| circles(s)?.anchor_angle.get_mut(i))),
    per_cable(setting("attachment_angle", "rad", None, ATTACHMENT, |s, i| circles(s)?.attachment_angle.get_mut(i))),
    per_cable(setting("anchor_x", "m", None, "Anchor along x", |s, i| Some(&mut s.robot.cable.get_mut(i)?.anchor[0]))),
    per_cable(setting("anchor_y", "m", None, "Anchor along y", |s, i| Some(&mut s.robot.cable.get_mut(i)?.anchor[1]))),
    per_cable(setting("attachment_x", "m", None, "Attachment point along x of the body frame", |s, i| {
        Some(&mut s.robot.cable.get_mut(i)?.attachment[0])
    })),
    per_cable(setting("attachment_y", "m", None, "Attachment point along y of the body frame", |s, i| {
        Some(&mut s.robot.cable.get_mut(i)?.attachment[1])
    })),
    setting("cable_density", "kg/m", NOT_NEGATIVE, "Cable mass per length", |s, _| Some(&mut s.robot.cable_density)),
    per_cable(setting("own_density", "kg/m", NOT_NEGATIVE, "Mass per length of this cable alone", |s, i| {
        s.robot.cable.get_mut(i)?.density.as_mut()
    })),
    setting("position_bandwidth", "rad/s", POSITIVE, "Speed of the position loop", |s, _| {
        Some(&mut s.position_bandwidth)
    }),
    setting("position_damping", "1", NOT_NEGATIVE, "Damping ratio of the position loop", |s, _| {
        Some(&mut s.position_damping)
    }),
    setting("orientation_bandwidth", "rad/s", POSITIVE, "Speed of the orientation loop", |s, _| {
        Some(&mut s.orientation_bandwidth)
    }),
    setting("orientation_damping", "1", NOT_NEGATIVE, "Damping ratio of the orientation loop", |s, _| {
        Some(&mut s.orientation_damping)
    }),
    setting("filter_time", "s", NOT_NEGATIVE, "Time constant of the low pass on the feedback", |s, _| {
        Some(&mut s.filter_time)
    }),
    tunable(setting("set_point_x", "m", None, "Centre of the circle", |s, _| Some(&mut s.reference.set_point[0]))),
    tunable(setting("set_point_y", "m", None, "Centre of the circle", |s, _| Some(&mut s.reference.set_point[1]))),
    tunable(setting("set_point_phi", "rad", None, "Orientation", |s, _| Some(&mut s.reference.set_point[2]))),
    setting("circle_radius", "m", NOT_NEGATIVE, "Radius of the circle; 0: hold the set point", |s, _| {
        Some(&mut s.reference.radius)
    }),
    setting("circle_period", "s", POSITIVE, "Time of one turn", |s, _| Some(&mut s.reference.period)),
    setting("ramp_time", "s", NOT_NEGATIVE, "Time in which the circle grows to its size", |s, _| {
        Some(&mut s.reference.ramp)
    }),
    setting("min_tension", "N", NOT_NEGATIVE, "Smallest winch force", |s, _| Some(&mut s.bounds.min)),
    setting("mean_tension", "N", NOT_NEGATIVE, "Winch force to be near", |s, _| Some(&mut s.bounds.mean)),
    setting("max_tension", "N", NOT_NEGATIVE, "Largest winch force", |s, _| Some(&mut s.bounds.max)),
    setting("start_tension", "N", NOT_NEGATIVE, "Winch force to be near at the start", |s, _| {
        Some(&mut s.start_tension)
    }),
    setting("tautening_time", "s", NOT_NEGATIVE, "Time in which it rises to the mean", |s, _| {
        Some(&mut s.tautening_time)
    }),
];
