//! Everything that can be set, with names, units and bounds in one list.

use cdpr::geometry::Geometry;
use cdpr::parameters::Parameters;

use crate::reference::{Reference, smooth_step};
use crate::tension::Bounds;

/// The controller's parameters. SI units, radians.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// The robot as the controller believes it to be: geometry and inertia are used.
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

impl Default for Settings {
    fn default() -> Self {
        Self {
            robot: Parameters::default(),
            position_bandwidth: 0.4,
            position_damping: 0.8,
            orientation_bandwidth: 0.4,
            orientation_damping: 0.8,
            filter_time: 0.3,
            reference: Reference { set_point: [0.0; 3], radius: 5.0, period: 60.0, ramp: 20.0 },
            bounds: Bounds { min: 1e3, mean: 20e3, max: 60e3 },
            // What the plant's springs carry by default. Many masters pass no values on before the first step, and a
            // jump in the winch forces makes the cables ring.
            start_tension: 1e3,
            tautening_time: 10.0,
        }
    }
}

impl Settings {
    /// Anchors and attachment points.
    #[must_use]
    pub fn geometry(&self) -> Geometry {
        Geometry::new(&self.robot)
    }

    /// The bounds a time `t` (s) after the start: the mean comes up from the tension at the start.
    #[must_use]
    pub fn bounds_at(&self, t: f64) -> Bounds {
        let [share, ..] = smooth_step(t, self.tautening_time);
        Bounds { mean: self.start_tension + share * (self.bounds.mean - self.start_tension), ..self.bounds }
    }

    /// What the list's bounds do not say.
    pub(crate) fn check(&self) -> Result<(), String> {
        self.robot.check().map_err(|error| error.to_string())?;
        let Bounds { min, mean, max } = self.bounds;
        if !(min <= mean && mean <= max) {
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
pub(crate) struct Setting {
    pub(crate) name: &'static str,
    pub(crate) unit: &'static str,
    pub(crate) description: &'static str,
    /// Smallest value, where there is one.
    pub(crate) min: Option<f64>,
    /// May it change while the simulation runs?
    pub(crate) tunable: bool,
    pub(crate) place: fn(&mut Settings) -> &mut f64,
}

const fn setting(
    name: &'static str,
    unit: &'static str,
    min: Option<f64>,
    description: &'static str,
    place: fn(&mut Settings) -> &mut f64,
) -> Setting {
    Setting { name, unit, description, min, tunable: false, place }
}

const fn tunable(setting: Setting) -> Setting {
    Setting { tunable: true, ..setting }
}

const ANCHOR: &str = "Angle of the anchor on its circle";
const ATTACHMENT: &str = "Angle of the attachment point on its circle, in the body frame";

/// A value above zero that stands for "greater than zero" in a table that only knows "at least".
const POSITIVE: Option<f64> = Some(1e-6);
const NOT_NEGATIVE: Option<f64> = Some(0.0);

/// All settings, in the order of the FMU's parameters.
pub(crate) const SETTINGS: [Setting; 29] = [
    setting("platform_mass", "kg", POSITIVE, "Mass of the platform", |s| &mut s.robot.platform_mass),
    setting("platform_inertia", "kg.m2", POSITIVE, "Moment of inertia of the platform", |s| {
        &mut s.robot.platform_inertia
    }),
    setting("anchor_radius", "m", POSITIVE, "Radius of the circle of anchors", |s| &mut s.robot.anchor_radius),
    setting("attachment_radius", "m", POSITIVE, "Radius of the circle of attachment points", |s| {
        &mut s.robot.attachment_radius
    }),
    setting("anchor_angle[1]", "rad", None, ANCHOR, |s| &mut s.robot.anchor_angle[0]),
    setting("anchor_angle[2]", "rad", None, ANCHOR, |s| &mut s.robot.anchor_angle[1]),
    setting("anchor_angle[3]", "rad", None, ANCHOR, |s| &mut s.robot.anchor_angle[2]),
    setting("anchor_angle[4]", "rad", None, ANCHOR, |s| &mut s.robot.anchor_angle[3]),
    setting("attachment_angle[1]", "rad", None, ATTACHMENT, |s| &mut s.robot.attachment_angle[0]),
    setting("attachment_angle[2]", "rad", None, ATTACHMENT, |s| &mut s.robot.attachment_angle[1]),
    setting("attachment_angle[3]", "rad", None, ATTACHMENT, |s| &mut s.robot.attachment_angle[2]),
    setting("attachment_angle[4]", "rad", None, ATTACHMENT, |s| &mut s.robot.attachment_angle[3]),
    setting("cable_density", "kg/m", NOT_NEGATIVE, "Cable mass per length", |s| &mut s.robot.cable_density),
    setting("position_bandwidth", "rad/s", POSITIVE, "Speed of the position loop", |s| &mut s.position_bandwidth),
    setting("position_damping", "1", NOT_NEGATIVE, "Damping ratio of the position loop", |s| &mut s.position_damping),
    setting("orientation_bandwidth", "rad/s", POSITIVE, "Speed of the orientation loop", |s| {
        &mut s.orientation_bandwidth
    }),
    setting("orientation_damping", "1", NOT_NEGATIVE, "Damping ratio of the orientation loop", |s| {
        &mut s.orientation_damping
    }),
    setting("filter_time", "s", NOT_NEGATIVE, "Time constant of the low pass on the feedback", |s| &mut s.filter_time),
    tunable(setting("set_point_x", "m", None, "Centre of the circle", |s| &mut s.reference.set_point[0])),
    tunable(setting("set_point_y", "m", None, "Centre of the circle", |s| &mut s.reference.set_point[1])),
    tunable(setting("set_point_phi", "rad", None, "Orientation", |s| &mut s.reference.set_point[2])),
    setting("circle_radius", "m", NOT_NEGATIVE, "Radius of the circle; 0: hold the set point", |s| {
        &mut s.reference.radius
    }),
    setting("circle_period", "s", POSITIVE, "Time of one turn", |s| &mut s.reference.period),
    setting("ramp_time", "s", NOT_NEGATIVE, "Time in which the circle grows to its size", |s| &mut s.reference.ramp),
    setting("min_tension", "N", NOT_NEGATIVE, "Smallest winch force", |s| &mut s.bounds.min),
    setting("mean_tension", "N", NOT_NEGATIVE, "Winch force to be near", |s| &mut s.bounds.mean),
    setting("max_tension", "N", NOT_NEGATIVE, "Largest winch force", |s| &mut s.bounds.max),
    setting("start_tension", "N", NOT_NEGATIVE, "Winch force to be near at the start", |s| &mut s.start_tension),
    setting("tautening_time", "s", NOT_NEGATIVE, "Time in which it rises to the mean", |s| &mut s.tautening_time),
];
