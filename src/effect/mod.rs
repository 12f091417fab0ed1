//! What the paper leaves out and a real cable robot has.
//!
//! One trait, [`Effect`], says what an effect is; each effect is one file here and one line in the list below.
//! An effect acts at one [`Stage`] of the plant. The order of the stages along the winch is fixed:
//! command → delay → saturation → dead band → lag → gain → bias → power limit → added force → losses → cable.

mod context;
mod entry;
mod law_part;
mod presliding;
mod site;
mod spec;

pub use cable_drag::AIR_DENSITY;
pub use context::{PlatformContext, StrainContext, SwingContext, WinchContext};
pub use entry::{EffectInfo, Law, LookAlike, ParameterInfo, Scope, TextInfo};
pub use law_part::LawPart;
pub use site::{Axis, DependsOn, Place, Site};
pub use spec::{EffectSpec, SpecError};

use entry::{parameter, signed};
use num_dual::Dual64;

use crate::dynamics::PlantData;
use crate::length_sensor::Drum;
use crate::per_cable::PerCable;
use crate::pose_sensor::PoseSensor;
use crate::scalar::Real;
use crate::winch::WinchCommand;

/// Where on the plant an effect acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Changes parameters once, when the plant is built.
    Parameters,
    /// Delays the winch command.
    CommandDelay,
    /// Transforms the winch command; lower numbers come first.
    Command(u8),
    /// Adds a pull to the winch force, depending on the winch's speed.
    WinchLoss,
    /// Changes the cable's elastic law.
    ElasticLaw,
    /// Adds a pull to the force of one winch (from 0), depending on anything a platform-side effect sees.
    WinchPull(usize),
    /// Adds a pull to the winch force, depending on the length that is paid out.
    WinchPosition,
    /// Adds a force across the cable.
    Transverse,
    /// Adds a wrench on the platform.
    PlatformWrench,
    /// Changes what the sensors show.
    Sensor,
}

/// What an effect is: its catalogue entry, and what it does at its stage. Every hook has a neutral default.
pub trait Effect: Sized {
    /// The catalogue entry.
    const INFO: EffectInfo;

    /// Why it cannot begin or end while the plant moves; `None` where it can. An effect that begins has its states where they
    /// change nothing.
    const ALWAYS: Option<&'static str> = None;

    /// Why inverse dynamics cannot turn it round; `None` where it can.
    const NO_INVERSE: Option<&'static str> = None;

    /// Whether it sets numbers that other effects scale, and so comes before them.
    const SETS_WHAT_OTHERS_SCALE: bool = false;

    /// Whether several can be at one place at one time, each for itself.
    const REPEATS: bool = false;

    /// Whether it gives a mass to the winch end of a cable that may have none without, and so decides which states there are.
    const GIVES_WINCH_MASS: bool = false;

    /// Whether what it adds is a function of time itself.
    const IN_TIME: bool = false;

    /// Whether it makes forces along one cable depend on lengths of others, or may.
    const COUPLES_CABLES: bool = false;

    /// The effect as specified; `spec.values` are in the order of `INFO.parameters` and within their bounds.
    ///
    /// # Errors
    /// When the text of an expression makes no sense.
    fn new(spec: &EffectSpec) -> Result<Self, SpecError>;

    /// Where it acts.
    fn stage(&self) -> Stage;

    /// Number of its own states (on each cable it acts on).
    fn states(&self) -> usize {
        0
    }

    /// Why it cannot be where winches are told this.
    ///
    /// # Errors
    /// What was found and what it takes.
    fn check_command(&self, _command: WinchCommand) -> Result<(), String> {
        Ok(())
    }

    /// Why it cannot be on a robot whose cables are at most so long (m).
    ///
    /// # Errors
    /// What was found and what it takes.
    fn check_length(&self, _longest: f64) -> Result<(), String> {
        Ok(())
    }

    /// [`Stage::Parameters`] and [`Stage::Transverse`]: change the plant's data; `cables` says which cables.
    fn change(&self, _data: &mut PlantData, _cables: &PerCable<bool>) {}

    /// [`Stage::CommandDelay`], and delayed pose sensors: the delay (s).
    fn delay(&self) -> f64 {
        0.0
    }

    /// [`Stage::Command`]: the winch force (N) behind this effect; writes the rates of its own states.
    fn command<S: Real>(&self, force: S, _states: &[S], _rates: &mut [S], _context: &WinchContext<S>) -> S {
        force
    }

    /// [`Stage::Command`]: start values of its own states, so that a constant `force` (N) passes without a transient.
    fn start_command(&self, _force: f64, _states: &mut [f64]) {}

    /// [`Stage::WinchLoss`]: pull added to the winch force (N) at a constant speed, positive against paying out.
    fn loss<S: Real>(&self, _force: S, _context: &WinchContext<S>) -> S {
        S::from(0.0)
    }

    /// [`Stage::WinchLoss`]: the same of an effect that keeps states; writes their rates. They start at zero.
    fn loss_in<S: Real>(&self, force: S, _states: &[S], _rates: &mut [S], context: &WinchContext<S>) -> S {
        self.loss(force, context)
    }

    /// [`Stage::WinchLoss`]: size of its own states.
    fn loss_state_size(&self) -> f64 {
        1.0
    }

    /// [`Stage::ElasticLaw`], and [`Stage::Transverse`] with states: the parts of the elastic law that it changes; only their hooks
    /// are asked.
    fn law_parts(&self) -> &'static [LawPart] {
        &[]
    }

    /// [`Stage::ElasticLaw`]: factor on the unstretched length.
    fn length_factor<S: Real>(&self, _time: S) -> S {
        S::from(1.0)
    }

    /// [`Stage::ElasticLaw`]: strain that carries no elastic force.
    fn inelastic_strain<S: Real>(&self, _states: &[S]) -> S {
        S::from(0.0)
    }

    /// [`Stage::ElasticLaw`]: factor on the elastic tension at this elastic strain, chord (m) and axial stiffness (N).
    fn tension_factor<S: Real>(&self, _strain: S, _chord: S, _axial_stiffness: f64) -> S {
        S::from(1.0)
    }

    /// [`Stage::ElasticLaw`]: strain of the chord by the cable's shape, rising with tension (N), less and less steeply; `chord`
    /// and unstretched length in m.
    fn chord_strain<S: Real>(&self, _tension: S, _chord: S, _unstretched: S) -> S {
        S::from(0.0)
    }

    /// [`Stage::ElasticLaw`]: the same at plain numbers, and its derivative by the tension (1/N). Laws in which it is a matter of a few
    /// products say so: tension is found by iteration, at every evaluation.
    fn chord_strain_and_slope(&self, tension: f64, chord: f64, unstretched: f64) -> [f64; 2] {
        let strain = self.chord_strain(Dual64::new(tension, 1.0), chord.into(), unstretched.into());
        [strain.re, strain.eps]
    }

    /// [`Stage::ElasticLaw`]: tension (N) that its own states hold beside the spring.
    fn held_tension<S: Real>(&self, _states: &[S]) -> S {
        S::from(0.0)
    }

    /// [`Stage::ElasticLaw`]: rates of its own states.
    fn strain_rates<S: Real>(&self, _context: &StrainContext<S>, _states: &[S], _rates: &mut [S]) {}

    /// [`Stage::ElasticLaw`]: whether [`Effect::strain_rates`] depend on the rate of the strain.
    fn follows_strain_rate(&self) -> bool {
        false
    }

    /// [`Stage::ElasticLaw`]: start values of its own states at rest under `tension` (N).
    fn start_strain(&self, _tension: f64, _states: &mut [f64]) {}

    /// [`Stage::Transverse`]: force on the platform along `N` (N), from length (m) and angular rate (rad/s).
    fn transverse_force<S: Real>(&self, _length: S, _angular_rate: S) -> S {
        S::from(0.0)
    }

    /// [`Stage::Transverse`] with states: force on the platform along `N` (N); writes the rates of its own states.
    fn swing<S: Real>(&self, _context: &SwingContext<S>, _states: &[S], _rates: &mut [S]) -> S {
        S::from(0.0)
    }

    /// [`Stage::Transverse`] with states: values of its own states where the cable is straight and turns as its chord does.
    fn start_swing(&self, _length: f64, _angular_rate: f64, _states: &mut [f64]) {}

    /// [`Stage::Transverse`] with states: kinetic energy in its own states (J), at this length (m).
    fn swing_energy<S: Real>(&self, _length: S, _states: &[S]) -> S {
        S::from(0.0)
    }

    /// [`Stage::Transverse`] with states: by how much the bowed cable is longer than its chord (m).
    fn bowed_length<S: Real>(&self, _chord: S, _states: &[S]) -> S {
        S::from(0.0)
    }

    /// [`Stage::WinchPull`] and [`Stage::WinchPosition`]: pull added to the force of the winch of `cable` (from 0), in N.
    fn pull<S: Real>(&self, _context: &PlatformContext<'_, S>, _cable: usize) -> S {
        S::from(0.0)
    }

    /// [`Stage::PlatformWrench`]: force and torque `[f_x, f_y, τ]` on the platform (N, N m).
    fn wrench<S: Real>(&self, _context: &PlatformContext<'_, S>) -> [S; 3] {
        [S::from(0.0); 3]
    }

    /// [`Stage::Sensor`]: factor and bias of a measured length, `measured = factor · true + bias`.
    fn length_sensor(&self) -> (f64, f64) {
        (1.0, 0.0)
    }

    /// [`Stage::Sensor`]: changes the drum by which an unstretched length is measured.
    fn drum(&self, _drum: &mut Drum) {}

    /// [`Stage::Sensor`]: factor and bias (N) of a measured tension, as of a length.
    fn tension_sensor(&self) -> (f64, f64) {
        (1.0, 0.0)
    }

    /// [`Stage::Sensor`]: changes what is measured of the pose.
    fn pose_sensor(&self, _sensor: &mut PoseSensor) {}
}

/// What holds of an effect whatever its numbers: the constants of [`Effect`].
#[derive(Clone, Copy, Debug, Default)]
pub struct Nature {
    /// Why it cannot begin or end while the plant moves; `None` where it can.
    pub always: Option<&'static str>,
    /// Several can be at one place at one time.
    pub repeats: bool,
    pub(crate) gives_winch_mass: bool,
    pub(crate) in_time: bool,
    pub(crate) couples_cables: bool,
}

impl Nature {
    fn of<E: Effect>() -> Self {
        Self {
            always: E::ALWAYS,
            repeats: E::REPEATS,
            gives_winch_mass: E::GIVES_WINCH_MASS,
            in_time: E::IN_TIME,
            couples_cables: E::COUPLES_CABLES,
        }
    }
}

macro_rules! catalogue {
    ($($module:ident :: $effect:ident),* $(,)?) => {
        $(mod $module; pub use $module::$effect;)*

        /// Every effect of the catalogue, in one type for static dispatch.
        #[derive(Clone, Debug)]
        #[expect(missing_docs, reason = "each variant is the type of the same name")]
        pub enum EffectKind { $($effect($effect)),* }

        /// The catalogue, in the order of its documentation.
        pub static CATALOGUE: &[EffectInfo] = &[$(<$effect as Effect>::INFO),*];

        impl EffectInfo {
            /// What holds of the effect whatever its numbers; nothing of an entry that is not the catalogue's.
            pub fn nature(&self) -> Nature {
                $(if self.id == <$effect as Effect>::INFO.id {
                    return Nature::of::<$effect>();
                })*
                Nature::default()
            }
        }

        impl EffectKind {
            /// The effect as specified.
            ///
            /// # Errors
            /// When the id is unknown or the text of an expression makes no sense.
            pub fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
                $(if spec.id == <$effect as Effect>::INFO.id {
                    return <$effect as Effect>::new(spec).map(Self::$effect);
                })*
                Err(SpecError::unknown_id(&spec.id))
            }
        }

        macro_rules! dispatch {
            ($self:ident, $e:ident => $call:expr) => {
                match $self { $(Self::$effect($e) => $call),* }
            };
        }
    };
}

catalogue! {
    cable_elasticity::CableElasticity,
    cable_stiffness::CableStiffness,
    cable_damping::CableDamping,
    cable_creep::CableCreep,
    cable_hysteresis::CableHysteresis,
    cable_stiffening::CableStiffening,
    cable_sag::CableSag,
    cable_catenary::CableCatenary,
    cable_thermal_expansion::CableThermalExpansion,
    cable_drag::CableDrag,
    cable_wind::CableWind,
    cable_transverse_mode::CableTransverseMode,
    cable_axial_mass::CableAxialMass,
    winch_coulomb_friction::WinchCoulombFriction,
    winch_viscous_friction::WinchViscousFriction,
    winch_stribeck_friction::WinchStribeckFriction,
    pulley_capstan_loss::PulleyCapstanLoss,
    pulley_wrap_friction::PulleyWrapFriction,
    pulley_radius::PulleyRadius,
    winch_torque_ripple::WinchTorqueRipple,
    winch_force_gain::WinchForceGain,
    winch_force_bias::WinchForceBias,
    winch_dead_band::WinchDeadBand,
    winch_lag::WinchLag,
    winch_delay::WinchDelay,
    winch_saturation::WinchSaturation,
    winch_power_limit::WinchPowerLimit,
    winch_drum_inertia::WinchDrumInertia,
    platform_mass::PlatformMass,
    platform_inertia::PlatformInertia,
    platform_com_offset::PlatformComOffset,
    platform_linear_drag::PlatformLinearDrag,
    platform_quadratic_drag::PlatformQuadraticDrag,
    platform_rotational_damping::PlatformRotationalDamping,
    steady_wind::SteadyWind,
    periodic_gust::PeriodicGust,
    umbilical::Umbilical,
    anchor_offset::AnchorOffset,
    anchor_compliance::AnchorCompliance,
    attachment_offset::AttachmentOffset,
    length_sensor_bias::LengthSensorBias,
    length_sensor_scale::LengthSensorScale,
    winch_drum_eccentricity::WinchDrumEccentricity,
    winch_drum_layers::WinchDrumLayers,
    tension_sensor_gain::TensionSensorGain,
    tension_sensor_bias::TensionSensorBias,
    pose_sensor_bias::PoseSensorBias,
    pose_sensor_delay::PoseSensorDelay,
    pose_sensor_frame::PoseSensorFrame,
    pose_sensor_scale::PoseSensorScale,
    expression::Expression,
}

mod kind;

/// The catalogue entry of `id`.
pub fn find(id: &str) -> Option<&'static EffectInfo> {
    CATALOGUE.iter().find(|info| info.id == id)
}

/// For each cable, whether a spec for `cable` acts on each.
pub(crate) fn acts_on(cable: Option<usize>, cables: usize) -> PerCable<bool> {
    PerCable::from_fn(cables, |i| cable.is_none_or(|c| c == i + 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_law_has_the_numbers_of_its_parameters() {
        for info in CATALOGUE {
            // Numbers of which none is another's sum; extensions left out.
            let value = |k: usize, p: &ParameterInfo| if p.extension { 0.0 } else { 1.75 * 10.0_f64.powi(k as i32) };
            let values: Vec<f64> = info.parameters.iter().enumerate().map(|(k, p)| value(k, p)).collect();
            let law = (info.law)(&values, &|v| format!("<{v}>"));
            for (parameter, value) in info.parameters.iter().zip(&values) {
                let sum = info.id == "winch_stribeck_friction" && parameter.name == "static";
                let shown = if sum { value - values[0] } else { *value };
                let there = parameter.extension || law.contains(&format!("<{shown}>"));
                assert!(there, "{}: {} is not in {law}", info.id, parameter.name);
            }
        }
    }

    #[test]
    fn the_law_of_friction_has_the_shape_in_use() {
        let law = |id: &str, values: &[f64]| {
            let spec = EffectSpec::new(id, Some(1), values).unwrap();
            (spec.info().unwrap().law)(&spec.values, &|v| format!("{}", (1e4 * v).round() / 1e4))
        };
        let id = "winch_coulomb_friction";
        assert_eq!(law(id, &[180.0, 0.02]), "F = 180 tanh(l̇/0.02)");
        assert_eq!(
            law(id, &[100.0, 0.02, 0.25, -0.1]),
            "F = 85 tanh(l̇/0.02) + 25 (2/π) arctan(π/2 l̇/0.02) - 10 l̇/√(l̇² + 0.02²)"
        );
        assert_eq!(law(id, &[100.0, 0.02, 0.0, 0.0, 2e4, 500.0]), "20000 z + 500 ż, ż = l̇ - 20000 z |l̇|/F, F = 100");
        assert_eq!(
            law(id, &[100.0, 0.02, 0.25, 0.0, 0.0, 0.0, 0.0, 0.1]),
            "F = 100 s (1 + 0.1 s), s = 0.75 tanh(l̇/0.02) + 0.25 (2/π) arctan(π/2 l̇/0.02)"
        );
        let id = "winch_stribeck_friction";
        assert_eq!(law(id, &[80.0, 100.0, 0.1, 5.0]), "F = [80 + 20 exp(-(l̇/0.1)²)] tanh(l̇/0.01) + 5 l̇");
        assert_eq!(
            law(id, &[80.0, 100.0, 0.1, 5.0, 0.0, 2e4, 0.0, 0.0, -0.1]),
            "20000 z + 5 l̇, ż = l̇ - 20000 z |l̇|/F, F = [80 + 20 exp(-(l̇/0.1)²)] (1 - 0.1 sign(l̇))"
        );
        assert_eq!(law(id, &[80.0, 60.0, 0.1, 0.0, 0.03]), "F = [80 - 20 exp(-(l̇/0.1)²)] tanh(l̇/0.03)");
        assert_eq!(law("winch_force_gain", &[-0.03]), "u (1 - 0.03)");
    }

    /// The height of a profile that a wind does not have was estimated, and the wind did not move.
    #[test]
    fn parameters_that_do_nothing_take_no_part() {
        let part = |exponent: f64| {
            let wind = EffectSpec::new("cable_wind", None, &[6.0, -3.0, 0.015, exponent]).expect("an effect");
            (0..wind.values.len()).map(|k| wind.takes_part(k)).collect::<Vec<_>>()
        };
        assert_eq!(part(0.0), [true, true, true, false, false, false]);
        assert_eq!(part(0.15), [true; 6]);
        for info in CATALOGUE {
            let others = info.parameters.iter().flat_map(|p| [p.idle_beside, p.idle_without, p.in_product_with]);
            for other in others.flatten() {
                assert!(info.parameters.iter().any(|p| p.name == other), "{}: {other}", info.id);
            }
        }
    }
}
