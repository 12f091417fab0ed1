//! `CablePlatform.fmu`: the plant of this project.

use cdpr::effect::{CATALOGUE, EffectInfo, EffectSpec};
use cdpr::fmi2::CablePlatform;
use cdpr::model_file::Model;
use cdpr_drawing::Robot;
use fmi2_export::ModelError;
use minijinja::context;
use serde::Serialize;

use crate::{Binary, Fmu, PackError, Platform, documentation, probe};

/// The package that [`cross::build`](crate::cross::build) builds for other platforms.
pub const PACKAGE: &str = "cable-platform-fmu";

/// Names, licences and licence texts of the libraries in the plant's binary.
pub const THIRD_PARTY: &str = include_str!(concat!(env!("OUT_DIR"), "/third-party.txt"));

/// The shared library for the host, built with this one.
const LIBRARY: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/cable_platform.library"));

/// The FMU of the plant that `model_toml` describes, complete but for the binaries.
///
/// ```
/// # fn main() -> Result<(), cdpr_fmu_build::PackError> {
/// # let folder = tempfile::tempdir().unwrap();
/// # let path = folder.path().join("CablePlatform.fmu");
/// use cdpr_fmu_build::cable_platform;
///
/// cable_platform::fmu("platform_mass = 4000.0")?
///     .binary(cable_platform::host_binary()?)?
///     .write(&path)?;
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// [`PackError::Model`] where `model_toml` is no valid model.
pub fn fmu(model_toml: &str) -> Result<Fmu, PackError> {
    let model = Model::from_toml(model_toml).map_err(|error| ModelError::new(error.to_string()))?;
    Fmu::of::<CablePlatform>([("model.toml", model_toml)])?
        .section(
            "What it models",
            &(drawing(&model)? + include_str!("../../modelDescription/documentation/model.html")),
        )
        .section("Start at rest, and a step loop", include_str!("../../modelDescription/documentation/loop.html"))
        .section("Change it", include_str!("../../modelDescription/documentation/change.html"))
        .section("Equations", include_str!("../../modelDescription/documentation/equations.html"))
        .section("Effects", &effects(&model)?)
        .section("Sources", include_str!("../../modelDescription/documentation/sources.html"))
        .icon(include_bytes!("../../modelDescription/model.png"))
        .licence("LICENSE-APACHE.txt", include_str!("../../LICENSE-APACHE"))?
        .licence("LICENSE-MIT.txt", include_str!("../../LICENSE-MIT"))?
        .licence("third-party.txt", THIRD_PARTY)
}

/// The binary for the machine that this program was built for.
///
/// # Errors
/// [`PackError::UnknownTarget`] where FMI 2.0 has no folder for that machine.
pub fn host_binary() -> Result<Binary, PackError> {
    let platform = Platform::host().ok_or_else(|| PackError::UnknownTarget {
        found: format!("{} {}", std::env::consts::ARCH, std::env::consts::OS),
        expected: Platform::ALL.map(Platform::folder).join(", "),
    })?;
    Binary::new(platform, LIBRARY.to_vec())
}

/// The robot at its start pose, as a figure.
fn drawing(model: &Model) -> Result<String, PackError> {
    let plant = model.plant().map_err(|error| ModelError::new(error.to_string()))?;
    let geometry = plant.geometry();
    let robot = Robot { anchors: &geometry.anchor, attachments: &geometry.attachment, pose: model.start.pose };
    Ok(format!(
        "<figure>\n{}<figcaption>The robot at its start pose. The number on a cable is the index in \
         <code>winch_force[i]</code>, <code>tension[i]</code> and the like; arrows are the fixed frame and the platform's \
         own.</figcaption>\n</figure>\n",
        robot.svg()
    ))
}

/// Whether an FMU can be checked on this machine: a binary is loaded from the temporary folder, as in packing. To be
/// asked before long work that ends in packing.
///
/// # Errors
/// [`PackError::TemporaryFolder`] where the folder is missing, full or mounted noexec.
pub fn try_temporary_folder() -> Result<(), PackError> {
    probe::try_folder(&host_binary()?)
}

/// An effect of the model, as the documentation shows it.
#[derive(Serialize)]
struct Present<'a> {
    id: &'a str,
    title: &'a str,
    place: String,
    equation: &'a str,
    values: Vec<String>,
    source: &'a str,
}

/// An entry of the catalogue, as the documentation shows it.
#[derive(Serialize)]
struct Known {
    id: &'static str,
    title: &'static str,
    equation: &'static str,
    parameters: Vec<Parameter>,
    validity: &'static str,
    source: &'static str,
}

#[derive(Serialize)]
struct Parameter {
    name: &'static str,
    unit: &'static str,
}

/// The documentation's section on effects: those of the model, then the catalogue.
fn effects(model: &Model) -> Result<String, PackError> {
    let present: Vec<_> = model
        .effects
        .iter()
        .filter_map(|spec| Some(present(spec, CATALOGUE.iter().find(|info| info.id == spec.id)?)))
        .collect();
    let known: Vec<_> = CATALOGUE
        .iter()
        .map(|info| Known {
            id: info.id,
            title: info.title,
            equation: info.equation,
            parameters: (info.parameters.iter().map(|p| Parameter { name: p.name, unit: p.unit }))
                .chain(info.texts.iter().map(|t| Parameter { name: t.name, unit: "text" }))
                .collect(),
            validity: info.validity,
            source: info.source,
        })
        .collect();
    documentation::render(include_str!("effects.html.jinja"), context! { present, known })
}

fn present<'a>(spec: &'a EffectSpec, info: &'a EffectInfo) -> Present<'a> {
    let place = match (spec.cable, &spec.target, &spec.channel) {
        (Some(cable), _, Some(channel)) => format!("{channel}[{cable}]"),
        (Some(cable), _, None) => format!("cable {cable}"),
        (None, Some(target), _) => target.clone(),
        (None, None, Some(channel)) => channel.clone(),
        (None, None, None) => "the whole".into(),
    };
    let numbers = info.parameters.iter().zip(&spec.values);
    let times = [("from", spec.from), ("until", spec.until)];
    let times = times.into_iter().filter_map(|(key, time)| Some(format!("{key} = {:?} s", time?)));
    Present {
        id: info.id,
        title: info.title,
        place,
        equation: spec.expression.as_deref().unwrap_or(info.equation),
        values: numbers.map(|(p, value)| format!("{} = {value:?} {}", p.name, p.unit)).chain(times).collect(),
        source: info.source,
    }
}
