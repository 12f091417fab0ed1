//! Effects in words: the catalogue's name fit for the middle of a sentence, the place, the parameters with units.

use cdpr::effect::EffectSpec;

use crate::outcome::{Estimated, Found};
use crate::report;

/// The ends of catalogue titles that a place says better, and what takes their stead in front.
const ENDS: [(&str, &str); 14] = [
    (" in the winch", ""),
    (" of the winch force", "force "),
    (" of the winch encoder", ""),
    (" of the winch", ""),
    (" in the pulleys", ""),
    (" of the platform", ""),
    (" of the cables", ""),
    (" of a length sensor", ""),
    (" on the cables", ""),
    (" of the anchor", ""),
    (" of the tension sensor", ""),
    (" of the pose sensor", ""),
    (" given as an expression", ""),
    (" cable", ""),
];

/// First words of catalogue titles that a place says better.
const BEGINNINGS: [&str; 4] = ["platform ", "cable ", "anchor ", "attachment "];

/// Names that keep their capital.
const NAMES: [&str; 2] = ["Coulomb", "Stribeck"];

/// The catalogue's name of an effect for the middle of a sentence, without the place: `Coulomb friction`, `force gain
/// error`, `mass error since 40.0 s`.
#[must_use]
pub fn label(spec: &EffectSpec) -> String {
    match (spec.from, spec.until) {
        (None, None) => name(spec),
        (Some(from), None) => format!("{} since {from:.1}\u{a0}s", name(spec)),
        (None, Some(until)) => format!("{} until {until:.1}\u{a0}s", name(spec)),
        (Some(from), Some(until)) => format!("{} from {from:.1} to {until:.1}\u{a0}s", name(spec)),
    }
}

fn name(spec: &EffectSpec) -> String {
    let title = spec.info().map_or(spec.id.as_str(), |info| info.title);
    let mut text = title.to_owned();
    if !NAMES.iter().any(|name| text.starts_with(name)) {
        text = text.chars().take(1).flat_map(char::to_lowercase).chain(text.chars().skip(1)).collect();
    }
    for (end, front) in ENDS {
        if let Some(rest) = text.strip_suffix(end) {
            text = format!("{front}{rest}");
            break;
        }
    }
    match BEGINNINGS.iter().find_map(|word| text.strip_prefix(word)) {
        Some(rest) => rest.to_owned(),
        None => text,
    }
}

/// The place an effect acts on: `winch[3]`, `anchor[2]`, `cable` for all of them, `platform.torque`, `platform` for several of
/// its axes, `sensor.cable_length[1]`.
#[must_use]
pub fn place(spec: &EffectSpec) -> String {
    match spec.places().as_deref() {
        Ok([one]) => one.to_string(),
        Ok(_) => "platform".to_owned(),
        // What the catalogue does not have is nowhere; only its name can be said.
        Err(error) => error.id.clone(),
    }
}

/// An effect and its place, in the middle of a sentence: `Coulomb friction on winch 3`.
pub(crate) fn in_place(spec: &EffectSpec) -> String {
    report::phrase(&label(spec), &place(spec)).replace('\u{a0}', " ")
}

/// The law of an effect with the numbers found, in the shape that is in use: `F = 180 tanh(l̇/0.02)`.
#[must_use]
pub fn law(spec: &EffectSpec) -> String {
    let written = |info: &cdpr::effect::EffectInfo| (info.law)(&spec.values, &report::plain).replace('-', "−");
    spec.info().map_or_else(|error| error.id, written)
}

/// The standard errors of what was found, not a number where there is none.
#[must_use]
pub fn errors(found: &Found) -> Vec<f64> {
    found.standard_error.iter().map(|error| error.unwrap_or(f64::NAN)).collect()
}

/// The parameters of an effect with these standard errors, one after the other.
pub(crate) fn in_numbers(spec: &EffectSpec, standard_error: &[Option<f64>]) -> String {
    let number = |p: &report::Parameter| {
        format!("{} {}", p.name.replace('_', " "), report::quantity(&p.name, p.value, p.standard_error, &p.unit))
    };
    parameters(spec, standard_error).iter().map(number).collect::<Vec<_>>().join(", ")
}

/// The parameters of an effect with their units, in the order of the catalogue, without those that take no part in its law or that nothing
/// shows: none, where they may have either sign, with no error. A wind's torque on a point is.
#[must_use]
pub fn parameters(spec: &EffectSpec, standard_error: &[Option<f64>]) -> Vec<report::Parameter> {
    let Ok(info) = spec.info() else { return Vec::new() };
    info.parameters
        .iter()
        .zip(&spec.values)
        .enumerate()
        .filter(|(k, _)| spec.takes_part(*k))
        .map(|(k, (parameter, value))| {
            let standard_error = standard_error.get(k).copied().flatten().filter(|e| e.is_finite());
            (parameter, *value, standard_error)
        })
        .filter(|(parameter, value, error)| *value != 0.0 || error.is_some() || parameter.min >= 0.0)
        .map(|(parameter, value, standard_error)| report::Parameter {
            name: parameter.name.to_owned(),
            value,
            standard_error,
            unit: unit(parameter.unit),
        })
        .collect()
}

/// What was found in numbers: the parameters of the effect, and when it begins and ends.
#[must_use]
pub fn sizes(found: &Found) -> Vec<report::Parameter> {
    let time = |name: &str, time: Option<Estimated>| {
        let Estimated { value, standard_error } = time?;
        Some(report::Parameter { name: name.to_owned(), value, standard_error, unit: "s".to_owned() })
    };
    let times = [time("from", found.onset.from), time("until", found.onset.until)];
    parameters(&found.effect, &found.standard_error).into_iter().chain(times.into_iter().flatten()).collect()
}

/// A unit as printed: `N.s2/m2` of FMI is `N s²/m²`.
pub(super) fn unit(fmi: &str) -> String {
    match fmi {
        "1" => "1".to_owned(),
        _ => fmi.replace('.', " ").replace('2', "²").replace('3', "³"),
    }
}

/// What was found, with its place: `Coulomb friction on winch 3`.
pub(super) fn heading(found: &Found) -> String {
    report::phrase(&label(&found.effect), &place(&found.effect))
}

#[cfg(test)]
mod tests {
    use cdpr::effect::{CATALOGUE, Scope};

    use super::*;

    fn spec(id: &str, cable: Option<usize>, values: &[f64]) -> EffectSpec {
        EffectSpec::new(id, cable, values).unwrap()
    }

    #[test]
    fn labels_read_well_before_their_place() {
        let cases = [
            (spec("winch_coulomb_friction", Some(3), &[100.0, 0.01]), "Coulomb friction on winch\u{a0}3"),
            (spec("winch_viscous_friction", None, &[100.0]), "viscous friction on all winches"),
            (spec("cable_wind", None, &[6.0, 0.0, 0.01]), "wind load through the cables on the platform"),
            (spec("winch_force_gain", Some(2), &[0.03]), "force gain error on winch\u{a0}2"),
            (spec("winch_delay", None, &[0.1]), "dead time on all winches"),
            (spec("pulley_capstan_loss", Some(1), &[0.01, 0.01]), "capstan loss on winch\u{a0}1"),
            (spec("cable_stiffness", Some(4), &[0.1]), "stiffness error in cable\u{a0}4"),
            (spec("cable_elasticity", None, &[1.5e7, 2e4]), "elasticity in all cables"),
            (spec("platform_mass", None, &[50.0]), "mass error on the platform"),
            (spec("platform_quadratic_drag", None, &[50.0, 0.0, 0.0]), "quadratic drag on the platform"),
            (spec("platform_inertia", None, &[50.0]), "inertia error on the platform's rotation"),
            (spec("anchor_offset", Some(2), &[0.1, 0.0]), "offset at anchor\u{a0}2"),
            (spec("length_sensor_scale", Some(2), &[0.001]), "scale error in the measured unstretched length\u{a0}2"),
            (spec("tension_sensor_gain", Some(2), &[0.02]), "gain error in the measured tension\u{a0}2"),
            (spec("pose_sensor_delay", None, &[0.1]), "delay in the measured pose"),
            (
                spec("winch_force_gain", Some(2), &[0.03]).during(Some(40.02), None).unwrap(),
                "force gain error since 40.0\u{a0}s on winch\u{a0}2",
            ),
            (
                spec("platform_mass", None, &[50.0]).during(Some(30.0), Some(55.0)).unwrap(),
                "mass error from 30.0 to 55.0\u{a0}s on the platform",
            ),
            (EffectSpec::expression("platform.torque", "3*phi").unwrap(), "term on the platform's rotation"),
        ];
        for (effect, expected) in cases {
            assert_eq!(report::phrase(&label(&effect), &place(&effect)), expected);
        }
    }

    #[test]
    fn units_are_printed_with_superscripts() {
        let drag = parameters(&spec("platform_quadratic_drag", None, &[50.0, 2.0, 0.0]), &[Some(1.5)]);
        assert_eq!((drag[0].unit.as_str(), drag[0].standard_error), ("N s²/m²", Some(1.5)));
        assert_eq!((drag[1].unit.as_str(), drag[1].standard_error), ("m/s", None));
        assert_eq!(parameters(&spec("winch_force_gain", None, &[0.1]), &[])[0].unit, "1");
    }

    /// A wind on a point held by cables had "torque 0 N m".
    #[test]
    fn what_nothing_shows_has_no_number() {
        let names = |id: &str, values: &[f64], error: &[Option<f64>]| {
            let all = parameters(&spec(id, None, values), error);
            all.into_iter().map(|parameter| parameter.name).collect::<Vec<_>>()
        };
        let wind = |error: &[Option<f64>]| names("steady_wind", &[1.0, 0.0, 0.0], error);
        assert_eq!(wind(&[Some(0.1), Some(0.1), None]), ["force_x", "force_y"]);
        assert_eq!(wind(&[Some(0.1), Some(0.1), Some(0.1)]), ["force_x", "force_y", "torque"]);
        // It may not be less.
        assert_eq!(names("umbilical", &[10.0, 0.0, 1.0, 1.0], &[]), ["stiffness", "damping", "x", "y"]);
    }

    /// Whatever the catalogue holds: a label of its own, and a place that the report can draw or say.
    #[test]
    fn every_effect_has_label_and_place() {
        for info in CATALOGUE.iter().filter(|info| info.id != "expression") {
            let values: Vec<f64> = info.parameters.iter().map(|p| p.typical.0.max(p.min)).collect();
            let cable = (info.scope == Scope::EachCable).then_some(2);
            let spec = EffectSpec::new(info.id, cable, &values).unwrap();
            let (label, place) = (label(&spec), place(&spec));
            // What acts on the cables and shows at the platform says both.
            let twice = label.contains("winch") || label.contains("cable") && place != "platform";
            assert!(!label.is_empty() && !twice, "{}: {label}", info.id);
            let known = ["platform", "winch", "cable", "anchor", "attachment", "sensor."];
            assert!(known.iter().any(|k| place.starts_with(k)), "{}: {place}", info.id);
            assert_eq!(cable.is_some(), place.ends_with("[2]"), "{}: {place}", info.id);
        }
    }
}
