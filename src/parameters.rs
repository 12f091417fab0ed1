//! The parameters of the plant: Tables I and II of the paper, every one changeable.

use std::f64::consts::PI;

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};

use crate::parameter::check_ranges;
use crate::per_cable::{MAX_CABLES, PerCable};
use crate::winch::WinchParameters;

/// Which model of a cable's axial behaviour the plant uses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CableModel {
    /// Inextensible cable, equations (23), (28). No cable state.
    Rigid,
    /// Spring and damper without a mass of its own, equations (36)-(42). State: the unstretched length `l`.
    MasslessSpring,
    /// Lumped mass on the winch side of the spring and damper, Fig. 5(b). States: `l` and its rate.
    #[default]
    LumpedMass,
}

/// How the mass of the paid-out cable enters the equations.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CableInertia {
    /// As the paper has it, (15) and (23): axial force `ρ/2 (L L̈ - L² α̇² + L̇²)`.
    #[default]
    Paper,
    /// A cable reeled out at constant density: axial force `ρ (L L̈ - ½ L² α̇²)`.
    Reeled,
    /// The cable has no mass, neither along nor across.
    None,
}

/// What the cables' damper measures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CableDamper {
    /// As the paper has it, (33): `b (L̇ - l̇)`. A cable reeled out at constant strain `ε` feels `b ε l̇`, which can feed a
    /// slow oscillation of a soft cable.
    #[default]
    LengthRate,
    /// The strain's rate: `b l ε̇ = b (L̇ - l̇ L/l)`.
    StrainRate,
}

/// How the states get their start values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Initialization {
    /// Pose and twist as given; every spring starts carrying its winch force.
    #[default]
    FromWinchForces,
    /// Every state as given.
    FromStates,
    /// The pose at rest under the given forces, searched from the given pose.
    StaticEquilibrium,
}

/// One cable given by coordinates: a `[[cable]]` table of `model.toml`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CableParameters {
    /// Anchor `A_i` in the fixed frame (m).
    #[serde(deserialize_with = "pair")]
    pub anchor: [f64; 2],
    /// Attachment point `B_i` in the body frame (m).
    #[serde(deserialize_with = "pair")]
    pub attachment: [f64; 2],
    /// Its own Young's modulus (Pa); the robot's where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub youngs_modulus: Option<f64>,
    /// Its own cross-section area (m²); the robot's where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub area: Option<f64>,
    /// Its own mass per unstretched length (kg/m); the robot's where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub density: Option<f64>,
    /// Its own damping `b l` (N s); the robot's where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub damping: Option<f64>,
    /// Radius of this winch's drum (m).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub drum_radius: Option<f64>,
    /// Turns of this winch's motor to a turn of its drum.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gear_ratio: Option<f64>,
    /// Inertia of this winch's rotor (kg m²).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rotor_inertia: Option<f64>,
}

/// Two numbers, no more: an array by itself would take the first two and leave the rest unread.
pub(crate) fn pair<'de, D: Deserializer<'de>>(from: D) -> Result<[f64; 2], D::Error> {
    let values = Vec::<f64>::deserialize(from)?;
    values.try_into().map_err(|values: Vec<f64>| D::Error::invalid_length(values.len(), &"two numbers"))
}

impl CableParameters {
    /// A cable between these points (m) with the robot's properties.
    pub fn between(anchor: [f64; 2], attachment: [f64; 2]) -> Self {
        Self {
            anchor,
            attachment,
            youngs_modulus: None,
            area: None,
            density: None,
            damping: None,
            drum_radius: None,
            gear_ratio: None,
            rotor_inertia: None,
        }
    }
}

/// Geometry, inertia and cable properties. SI units, radians. Defaults are Tables I and II with `A = 4e-4 m²`.
///
/// Where the cables begin and end is said in one of two ways: on two circles, as in Table I, or by coordinates in `cable`.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameters {
    /// Which cable model, see [`CableModel`].
    pub cable_model: CableModel,
    /// Which cable inertia, see [`CableInertia`].
    pub cable_inertia: CableInertia,
    /// What the damper measures, see [`CableDamper`].
    pub cable_damper: CableDamper,
    /// Mass `M` of the platform (kg).
    pub platform_mass: f64,
    /// Moment of inertia `I_M` of the platform about its centre of mass (kg m²).
    pub platform_inertia: f64,
    /// Centre of mass of the platform in the body frame, from its reference point G (m).
    pub centre_of_mass: [f64; 2],
    /// Acceleration by gravity, on the platform (m/s²); the cables are straight and their weight is left out.
    pub gravity: [f64; 2],
    /// Cables by coordinates; where there are any, the two circles are not used.
    pub cable: Vec<CableParameters>,
    /// Radius `R_A` of the circle of anchors `A_i` (m).
    pub anchor_radius: f64,
    /// Radius `R_B` of the circle of attachment points `B_i` (m).
    pub attachment_radius: f64,
    /// Angles `θ_Ai` of the anchors (rad).
    pub anchor_angle: PerCable<f64>,
    /// Angles `θ_Bi` of the attachment points in the body frame (rad).
    pub attachment_angle: PerCable<f64>,
    /// Cable mass per unstretched length `ρ` (kg/m).
    pub cable_density: f64,
    /// Effective Young's modulus `E` (Pa).
    pub youngs_modulus: f64,
    /// Cross-section area `A` (m²).
    pub cable_area: f64,
    /// Damping `b l` (N s): the damping coefficient is `b = cable_damping / l`.
    pub cable_damping: f64,
    /// The winches: what they are told, drums, gears, rotors, servos.
    pub winch: WinchParameters,
}

impl Default for Parameters {
    fn default() -> Self {
        Self {
            cable_model: CableModel::LumpedMass,
            cable_inertia: CableInertia::Paper,
            cable_damper: CableDamper::LengthRate,
            platform_mass: 2500.0,
            platform_inertia: 3.5e5,
            centre_of_mass: [0.0; 2],
            gravity: [0.0; 2],
            cable: Vec::new(),
            anchor_radius: 900.0,
            attachment_radius: 10.0,
            anchor_angle: [-0.75 * PI, -0.25 * PI, 0.25 * PI, 0.75 * PI].into(),
            attachment_angle: [-0.25 * PI, -0.75 * PI, 0.75 * PI, 0.25 * PI].into(),
            cable_density: 0.215,
            youngs_modulus: 38e9,
            cable_area: 4e-4,
            cable_damping: 20_000.0,
            winch: WinchParameters::default(),
        }
    }
}

/// A parameter that no plant can have.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("`{key}` is {found}, expected {expected}")]
pub struct ParameterError {
    /// The key as it stands in `model.toml`.
    pub key: String,
    /// The value found, as text.
    pub found: String,
    /// What would have been accepted.
    pub expected: String,
}

impl ParameterError {
    pub(crate) fn new(key: impl Into<String>, found: impl ToString, expected: impl Into<String>) -> Self {
        Self { key: key.into(), found: found.to_string(), expected: expected.into() }
    }
}

/// `Ok` when `value` is finite and within `[lower, upper]`.
pub(crate) fn check_range(key: &str, value: f64, lower: f64, upper: f64) -> Result<(), ParameterError> {
    if value.is_finite() && value >= lower && value <= upper {
        return Ok(());
    }
    let expected = match (lower.is_finite(), upper.is_finite()) {
        (true, true) => format!("a number from {lower} to {upper}"),
        (true, false) => format!("a finite number, {lower} or more"),
        (false, true) => format!("a finite number, {upper} or less"),
        (false, false) => "a finite number".to_owned(),
    };
    Err(ParameterError::new(key, value, expected))
}

impl Parameters {
    /// The preset with the cross-section area as printed in Table II (4e-4 cm²), kept for the paper's figures only.
    pub fn as_printed() -> Self {
        Self { cable_area: 4e-8, ..Self::default() }
    }

    /// Number of cables.
    pub fn cables(&self) -> usize {
        if self.cable.is_empty() { self.anchor_angle.len() } else { self.cable.len() }
    }

    /// Axial stiffness `EA` (N) of a cable without properties of its own.
    pub fn axial_stiffness(&self) -> f64 {
        self.youngs_modulus * self.cable_area
    }

    /// The two circles as coordinates (m): `A_i` by (2), `B_i` by (1) at `φ = 0`.
    pub fn on_circles(&self) -> Vec<CableParameters> {
        let on_circle = |radius: f64, angle: f64| [radius * angle.cos(), radius * angle.sin()];
        let ends = self.anchor_angle.iter().zip(&self.attachment_angle);
        ends.map(|(a, b)| {
            CableParameters::between(on_circle(self.anchor_radius, *a), on_circle(self.attachment_radius, *b))
        })
        .collect()
    }

    /// Checks every value on its own.
    ///
    /// # Errors
    /// Names the key, the value found and what was expected.
    pub fn check(&self) -> Result<(), ParameterError> {
        check_ranges(self)?;
        if self.cable.is_empty() { self.check_circles() } else { self.check_cables() }?;
        if self.cable_model == CableModel::MasslessSpring && self.cable_damping == 0.0 {
            // l' = L' + (EA (L-l)/l - T) / b has no solution without damping.
            let expected = "a number greater than 0 where `cable_model` is \"massless_spring\"";
            return Err(ParameterError::new("cable_damping", 0, expected));
        }
        if self.winch.command.is_servo() && self.cable_model != CableModel::LumpedMass {
            return Err(ParameterError::new(
                "command",
                format!("{:?}", self.winch.command.name()),
                "\"force\" or \"torque\" unless `cable_model` is \"lumped_mass\": a servo moves the cable's winch end, \
                 which has no motion of its own in the others",
            ));
        }
        Ok(())
    }

    /// Checks the two circles.
    fn check_circles(&self) -> Result<(), ParameterError> {
        if self.attachment_radius >= self.anchor_radius {
            return Err(ParameterError::new(
                "attachment_radius",
                self.attachment_radius,
                format!("less than `anchor_radius` ({}): the anchors surround the platform", self.anchor_radius),
            ));
        }
        check_count("anchor_angle", self.anchor_angle.len())?;
        if self.attachment_angle.len() != self.anchor_angle.len() {
            return Err(ParameterError::new(
                "anchor_angle",
                format!("{} angles", self.anchor_angle.len()),
                format!("{}, as many as `attachment_angle` has", self.attachment_angle.len()),
            ));
        }
        Ok(())
    }

    /// Checks the cables given by coordinates.
    fn check_cables(&self) -> Result<(), ParameterError> {
        check_count("cable", self.cable.len())?;
        for (i, cable) in self.cable.iter().enumerate() {
            let key = |name: &str| format!("cable[{}].{name}", i + 1);
            let same = |other: &CableParameters| other.anchor == cable.anchor && other.attachment == cable.attachment;
            if let Some(twin) = self.cable[..i].iter().position(same) {
                return Err(ParameterError::new(
                    key("anchor"),
                    format!("{:?} with attachment {:?}", cable.anchor, cable.attachment),
                    format!("another anchor or attachment than cable {}: two cables in one place are one", twin + 1),
                ));
            }
        }
        Ok(())
    }
}

fn check_count(key: &str, count: usize) -> Result<(), ParameterError> {
    if (2..=MAX_CABLES).contains(&count) {
        Ok(())
    } else {
        Err(ParameterError::new(key, format!("{count} entries"), format!("2 to {MAX_CABLES}, one for each cable")))
    }
}
