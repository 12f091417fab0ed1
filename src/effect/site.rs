//! Where on the robot an effect acts, and what it depends on.

use std::fmt;

use super::{EffectSpec, SpecError, expression};
use crate::formula::Variable;

/// Where an effect acts, as its catalogue entry says it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Site {
    /// The winch of its cable.
    Winch,
    /// Its cable.
    Cable,
    /// The anchor of its cable.
    Anchor,
    /// The attachment of its cable.
    Attachment,
    /// The platform, always on these axes of its wrench.
    Platform(&'static [Axis]),
    /// The platform, on the axes that its parameters are the components of, `[f_x, f_y, τ]` (N, N m).
    PlatformComponents,
    /// The platform, along the angle (rad, from the x axis) that is its parameter of this index.
    PlatformAlong(usize),
    /// The sensor of a length of its cable, `unstretched_length` unless its `channel` says otherwise.
    LengthSensor,
    /// The sensor of the tension of its cable.
    TensionSensor,
    /// The sensor of the pose.
    PoseSensor,
    /// What its `target` names.
    Target,
}

/// An axis of the wrench on the platform.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// Force along x.
    ForceX,
    /// Force along y.
    ForceY,
    /// Torque.
    Torque,
}

/// What the force, length or reading that an effect adds changes with. None of them: it is constant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DependsOn {
    /// How fast the winch, the cable or the platform moves.
    Speed,
    /// Which way it moves, whatever its speed.
    Direction,
    /// The cable's tension or the winch's force.
    Tension,
    /// The pose, or a length that follows from it.
    Position,
    /// The acceleration.
    Acceleration,
    /// Time, or the past.
    Time,
    /// The commands.
    Input,
}

/// A place on the robot. Cables count from 1; `None` is all of them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// An axis of the platform's wrench.
    Platform(Axis),
    /// A winch.
    Winch(Option<usize>),
    /// A cable.
    Cable(Option<usize>),
    /// The anchor of a cable.
    Anchor(Option<usize>),
    /// The attachment of a cable.
    Attachment(Option<usize>),
    /// The sensor of something of a cable, by its channel.
    CableSensor(String, Option<usize>),
    /// The sensor of the pose.
    PoseSensor,
}

/// Component of a wrench, relative to the largest, below which an axis does not count.
const SMALL: f64 = 0.1;
/// Arm (m) at which a torque is compared with a force: the attachments' distance from the platform's centre.
const ARM: f64 = 10.0;

impl EffectSpec {
    /// The places on which it acts.
    ///
    /// # Errors
    /// Unknown id, or an expression without a target that exists.
    pub fn places(&self) -> Result<Vec<Place>, SpecError> {
        let value = |index: usize| self.values.get(index).copied().unwrap_or(0.0);
        Ok(match self.info()?.site {
            Site::Winch => vec![Place::Winch(self.cable)],
            Site::Cable => vec![Place::Cable(self.cable)],
            Site::Anchor => vec![Place::Anchor(self.cable)],
            Site::Attachment => vec![Place::Attachment(self.cable)],
            Site::Platform(axes) => axes.iter().copied().map(Place::Platform).collect(),
            Site::PlatformComponents => along([value(0), value(1), value(2) / ARM]),
            Site::PlatformAlong(angle) => along([value(angle).cos(), value(angle).sin(), 0.0]),
            Site::LengthSensor => {
                let channel = self.channel.as_deref().unwrap_or("unstretched_length");
                vec![Place::CableSensor(channel.to_owned(), self.cable)]
            }
            Site::TensionSensor => vec![Place::CableSensor("tension".to_owned(), self.cable)],
            Site::PoseSensor => vec![Place::PoseSensor],
            Site::Target => vec![expression::place(self)?],
        })
    }

    /// What it depends on; for an expression, what its variables are.
    ///
    /// # Errors
    /// Unknown id, or an expression that cannot be read.
    pub fn depends_on(&self) -> Result<Vec<DependsOn>, SpecError> {
        let info = self.info()?;
        if info.site != Site::Target {
            return Ok(info.depends_on.to_vec());
        }
        let mut list = Vec::new();
        for variable in expression::formula(self)?.variables() {
            let on = DependsOn::of(variable);
            if !list.contains(&on) {
                list.push(on);
            }
        }
        Ok(list)
    }
}

/// The axes on which a wrench of such components is not small; all of them where it is zero.
fn along(components: [f64; 3]) -> Vec<Place> {
    let largest = components.iter().fold(0.0_f64, |largest, c| largest.max(c.abs()));
    let axes = [Axis::ForceX, Axis::ForceY, Axis::Torque].into_iter().zip(components);
    axes.filter(|(_, c)| c.abs() >= SMALL * largest).map(|(axis, _)| Place::Platform(axis)).collect()
}

impl DependsOn {
    /// The kind of dependence that a variable of a formula is.
    fn of(variable: Variable) -> Self {
        match variable {
            Variable::Time => Self::Time,
            Variable::Pose(_) | Variable::CableLength(_) | Variable::UnstretchedLength(_) => Self::Position,
            Variable::Twist(_) | Variable::CableSpeed(_) | Variable::UnstretchedRate(_) => Self::Speed,
            Variable::WinchForce(_) => Self::Tension,
            Variable::Disturbance(_) => Self::Input,
        }
    }

    /// Its name in `discovery.json`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Speed => "speed",
            Self::Direction => "direction",
            Self::Tension => "tension",
            Self::Position => "position",
            Self::Acceleration => "acceleration",
            Self::Time => "time",
            Self::Input => "input",
        }
    }
}

impl Place {
    /// The same part of every cable where it is that of all of them, `cables` in number; else itself.
    pub fn one_by_one(&self, cables: usize) -> Vec<Self> {
        let each = |of: &dyn Fn(Option<usize>) -> Self| (1..=cables).map(|cable| of(Some(cable))).collect();
        match self {
            Self::Winch(None) => each(&Self::Winch),
            Self::Cable(None) => each(&Self::Cable),
            Self::Anchor(None) => each(&Self::Anchor),
            Self::Attachment(None) => each(&Self::Attachment),
            Self::CableSensor(channel, None) => each(&|cable| Self::CableSensor(channel.clone(), cable)),
            single => vec![single.clone()],
        }
    }
}

/// `winch[3]`, or `winch` for all of them; `platform.force_x`, `sensor.cable_length[1]`, `sensor.pose`.
impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (name, cable) = match self {
            Self::Platform(Axis::ForceX) => ("platform.force_x", None),
            Self::Platform(Axis::ForceY) => ("platform.force_y", None),
            Self::Platform(Axis::Torque) => ("platform.torque", None),
            Self::Winch(cable) => ("winch", *cable),
            Self::Cable(cable) => ("cable", *cable),
            Self::Anchor(cable) => ("anchor", *cable),
            Self::Attachment(cable) => ("attachment", *cable),
            Self::PoseSensor => ("sensor.pose", None),
            Self::CableSensor(channel, cable) => {
                write!(f, "sensor.")?;
                (channel.as_str(), *cable)
            }
        };
        f.write_str(name)?;
        cable.map_or(Ok(()), |cable| write!(f, "[{cable}]"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dynamics::Inputs;
    use crate::effect::{CATALOGUE, EffectKind, ParameterInfo, PlatformContext, Scope, Stage, WinchContext};
    use crate::geometry::Geometry;
    use crate::parameters::Parameters;

    /// An effect of the catalogue at the most that is typical of it, on cable 2 where it takes one; without extensions but those that
    /// other parameters need.
    fn typical(info: &'static crate::effect::EffectInfo) -> EffectSpec {
        let needed = |name: &str| info.parameters.iter().any(|p| p.idle_without == Some(name));
        let left_out = |p: &ParameterInfo| p.extension && !needed(p.name);
        let value = |p: &ParameterInfo| if left_out(p) { p.min.max(0.0) } else { p.typical.1.min(p.max) };
        let values: Vec<f64> = info.parameters.iter().map(value).collect();
        let cable = (info.scope == Scope::EachCable).then_some(2);
        EffectSpec::new(info.id, cable, &values).unwrap_or_else(|error| panic!("{error}"))
    }

    fn catalogue() -> impl Iterator<Item = (&'static crate::effect::EffectInfo, EffectSpec)> {
        CATALOGUE.iter().filter(|info| info.site != Site::Target).map(|info| (info, typical(info)))
    }

    #[test]
    fn every_effect_has_a_place_and_one_on_a_cable_has_its_number() {
        for (info, spec) in catalogue() {
            let places = spec.places().unwrap();
            assert!(!places.is_empty(), "{}", info.id);
            for place in &places {
                let numbered = place.to_string().ends_with("[2]");
                assert_eq!(numbered, info.scope == Scope::EachCable, "{}: {place}", info.id);
            }
            let stage = EffectKind::new(&spec).unwrap().stage();
            let fits = match stage {
                Stage::CommandDelay | Stage::Command(_) | Stage::WinchLoss | Stage::WinchPosition => {
                    info.site == Site::Winch
                }
                Stage::ElasticLaw => matches!(info.site, Site::Cable | Site::Anchor),
                Stage::Transverse => info.site == Site::Cable,
                Stage::Sensor => matches!(info.site, Site::LengthSensor | Site::TensionSensor | Site::PoseSensor),
                Stage::PlatformWrench => info.id.starts_with("platform") || info.scope == Scope::Whole,
                Stage::Parameters | Stage::WinchPull(_) => true,
            };
            assert!(fits, "{} at {stage:?} says {:?}", info.id, info.site);
        }
    }

    /// Pose, twist and time of a platform on its way, and what an effect adds to its wrench there.
    fn wrench(kind: &EffectKind, pose: [f64; 3], twist: [f64; 3], time: f64) -> [f64; 3] {
        let lengths = [900.0; 4];
        kind.wrench(&PlatformContext {
            time,
            geometry: &Geometry::new(&Parameters::default()),
            pose: &pose,
            twist: &twist,
            inputs: &Inputs::none(4),
            cable_length: &lengths,
            cable_speed: &[0.1; 4],
            unstretched_length: &lengths,
            unstretched_rate: &[0.1; 4],
        })
    }

    #[test]
    fn forces_on_the_platform_act_where_they_say_and_depend_on_what_they_say() {
        let ([pose, twist], time) = ([[3.0, -2.0, 0.1], [0.4, 0.3, 0.02]], 1.7);
        let mut seen = 0;
        for (info, spec) in catalogue() {
            let kind = EffectKind::new(&spec).unwrap();
            if kind.stage() != Stage::PlatformWrench {
                continue;
            }
            seen += 1;
            let here = wrench(&kind, pose, twist, time);
            let said = spec.places().unwrap();
            assert_eq!(said, along([here[0], here[1], here[2] / ARM]), "{}: {here:?}", info.id);
            let elsewhere = |pose, twist, time| wrench(&kind, pose, twist, time) != here;
            let found = [
                (DependsOn::Position, elsewhere([5.0, 1.0, -0.2], twist, time)),
                (DependsOn::Speed, elsewhere(pose, [-0.2, 0.9, -0.05], time)),
                (DependsOn::Time, elsewhere(pose, twist, 2.9)),
            ];
            for (on, does) in found {
                assert_eq!(info.depends_on.contains(&on), does, "{}: {on:?}", info.id);
            }
        }
        assert!(seen >= 6, "{seen}");
    }

    #[test]
    fn losses_of_the_winch_depend_on_what_they_say() {
        for (info, spec) in catalogue() {
            let kind = EffectKind::new(&spec).unwrap();
            if kind.stage() != Stage::WinchLoss {
                continue;
            }
            let loss = |force: f64, speed: f64| kind.loss(force, &WinchContext { time: 0.0, speed });
            let says = |on| info.depends_on.contains(&on);
            assert_eq!(says(DependsOn::Tension), loss(2e4, 1.0) != loss(1e4, 1.0), "{}", info.id);
            // Speeds well beyond the turn of the sign.
            let faster = (loss(2e4, 4.0) - loss(2e4, 2.0)).abs() > 1e-6 * loss(2e4, 2.0).abs();
            assert_eq!(says(DependsOn::Speed), faster, "{}", info.id);
            let turns = loss(2e4, 0.3) * loss(2e4, -0.3) < 0.0;
            assert_eq!(says(DependsOn::Speed) || says(DependsOn::Direction), turns, "{}", info.id);
        }
    }

    #[test]
    fn a_term_depends_on_what_its_variables_are() {
        let on = |text: &str| EffectSpec::expression("winch[2]", text).unwrap().depends_on().unwrap();
        assert_eq!(on("3*unstretched_length[2]"), [DependsOn::Position]);
        assert_eq!(on("12*sin(0.5*cable_length[1]) + x"), [DependsOn::Position]);
        assert_eq!(on("time*vx"), [DependsOn::Time, DependsOn::Speed]);
        assert_eq!(on("winch_force[1] + cable_speed[3] + disturbance_torque").len(), 3);
        // `exp` holds an x, and is none.
        assert_eq!(on("exp(time)"), [DependsOn::Time]);
        assert_eq!(on("7"), []);
        let term = EffectSpec::expression("platform.torque", "x").unwrap();
        assert_eq!(term.places().unwrap(), [Place::Platform(Axis::Torque)]);
    }

    #[test]
    fn a_wind_acts_on_the_axes_along_which_it_blows() {
        let places = |id: &str, values: &[f64]| EffectSpec::new(id, None, values).unwrap().places().unwrap();
        let [x, y, torque] = [Axis::ForceX, Axis::ForceY, Axis::Torque].map(Place::Platform);
        assert_eq!(places("steady_wind", &[0.0, 80.0, 20.0]), std::slice::from_ref(&y));
        assert_eq!(places("steady_wind", &[1.0, 80.0, 500.0]), [y.clone(), torque]);
        assert_eq!(places("periodic_gust", &[50.0, 1.0, 0.0, 0.02]), [x]);
        assert_eq!(places("periodic_gust", &[50.0, 1.0, 0.0, -1.57]), [y]);
    }

    #[test]
    fn all_of_them_are_each_of_them() {
        let one_by_one = |place: Place| place.one_by_one(3).iter().map(Place::to_string).collect::<Vec<_>>();
        assert_eq!(one_by_one(Place::Winch(None)), ["winch[1]", "winch[2]", "winch[3]"]);
        assert_eq!(one_by_one(Place::Cable(Some(2))), ["cable[2]"]);
        let sensor = Place::CableSensor("cable_length".to_owned(), None);
        assert_eq!(sensor.to_string(), "sensor.cable_length");
        assert_eq!(one_by_one(sensor)[0], "sensor.cable_length[1]");
    }
}
