//! Laws of the catalogue that are not looked for themselves, for near by another law is what they look like: they are reached from
//! that one, where it leaves something, and where it leaves nothing the user is told of them.

use std::f64::consts::{FRAC_PI_2, TAU};

use cdpr::dynamics::PlantData;
use cdpr::effect::{AIR_DENSITY, EffectSpec};
use cdpr::geometry::Geometry;
use cdpr::kinematics::{self, CableKinematics};
use cdpr::model_file::Model;
use nalgebra::{Matrix2, Vector2};

use crate::hypothesis::extension::{at_work_like, value_of};

/// C_d d (m) of cables in a wind from which a steady force is read as one.
const DRAG_AREA_PER_LENGTH: f64 = 0.01;

/// A wind on cables, for the same force and the same damping, in multiples of one on the platform: of a platform the force grows by
/// 2/|w| of itself with its speed; of a cable, whose points move in proportion to their distance from the anchor, by 4/(3|w|).
const AS_FAST: f64 = 2.0 / 3.0;

/// The laws that `found` may stand for in this model, each from where it does the same; none where that is beyond its bounds, where it
/// cannot be what is there.
pub(crate) fn stood_for(found: &EffectSpec, model: &Model) -> Vec<EffectSpec> {
    let laws = [wind_on_cables(found, model), compliance(found, model), pulley(found, model)];
    laws.into_iter().flatten().map(|law| at_work_like(law, found)).collect()
}

/// The law of the catalogue that a term is, by its form: a wave of a winch's force along what it has paid out is torque ripple.
pub(crate) fn law_of_term(term: &EffectSpec) -> Option<EffectSpec> {
    let cable: usize = term.target.as_deref()?.strip_prefix("winch[")?.strip_suffix(']')?.parse().ok()?;
    let text: String = term.expression.as_deref()?.split_whitespace().collect();
    let (amplitude, wave) = text.split_once('*')?;
    let (angle, ahead) = match wave.strip_prefix("sin(") {
        Some(angle) => (angle, 0.0),
        None => (wave.strip_prefix("cos(")?, FRAC_PI_2),
    };
    let (number, phase) = angle.strip_suffix(')')?.split_once(&format!("*unstretched_length[{cable}]"))?;
    let phase: f64 = if phase.is_empty() { 0.0 } else { phase.parse().ok()? };
    let (amplitude, number): (f64, f64) = (amplitude.parse().ok()?, number.parse().ok()?);
    let turned = phase + ahead + if amplitude < 0.0 { 0.5 * TAU } else { 0.0 };
    let phase = turned - TAU * (turned / TAU).round();
    let law = EffectSpec::new("winch_torque_ripple", Some(cable), &[amplitude.abs(), TAU / number, phase]).ok()?;
    Some(at_work_like(law, term))
}

/// Compliance of an anchor, from a cable that is softer: as soft in the middle.
fn compliance(found: &EffectSpec, model: &Model) -> Option<EffectSpec> {
    if found.id != "cable_stiffness" {
        return None;
    }
    let (cable, factor) = (found.cable?, value_of(found, "factor")?);
    let plant = PlantData::new(&model.parameters);
    let length = in_the_middle(&plant.geometry).nth(cable - 1)?.length;
    let stiffness = plant.cables.get(cable - 1)?.axial_stiffness * (1.0 + factor) / (-factor * length);
    (factor < 0.0).then(|| EffectSpec::new("anchor_compliance", Some(cable), &[stiffness]).ok())?
}

/// A pulley of finite radius, from an anchor off across its cable: the cable leaves it there.
fn pulley(found: &EffectSpec, model: &Model) -> Option<EffectSpec> {
    if found.id != "anchor_offset" {
        return None;
    }
    let cable = found.cable?;
    let normal = normal(&in_the_middle(&Geometry::new(&model.parameters)).nth(cable - 1)?);
    let across = normal[0] * value_of(found, "x")? + normal[1] * value_of(found, "y")?;
    EffectSpec::new("pulley_radius", Some(cable), &[across]).ok()
}

/// Wind on the cables, from drag of the platform in wind or from a steady force: the same force on the platform at rest in the middle.
fn wind_on_cables(found: &EffectSpec, model: &Model) -> Option<EffectSpec> {
    let size = |[x, y]: [f64; 2]| x.hypot(y);
    let (force, speed) = match found.id.as_str() {
        "platform_quadratic_drag" => {
            let wind = [value_of(found, "wind_x")?, value_of(found, "wind_y")?];
            let coefficient = value_of(found, "coefficient")?;
            (wind.map(|part| coefficient * size(wind) * part), Some(AS_FAST * size(wind)))
        }
        "steady_wind" => ([value_of(found, "force_x")?, value_of(found, "force_y")?], None),
        _ => return None,
    };
    // The force grows with the square of the wind.
    let newton = wind_that_gives(force.map(|part| part / size(force)), &Geometry::new(&model.parameters))?;
    let faster = speed.map_or((size(force) / DRAG_AREA_PER_LENGTH).sqrt(), |speed| speed / size(newton));
    let [x, y] = newton.map(|part| faster * part);
    let law = EffectSpec::new("cable_wind", None, &[x, y, size(force) / faster.powi(2)]).ok()?;
    law.values.iter().all(|value| value.is_finite()).then_some(law)
}

/// The wind (m/s) that gives a force (N) on the platform in the middle, at rest, with cables of C_d d = 1 m.
fn wind_that_gives(force: [f64; 2], geometry: &Geometry) -> Option<[f64; 2]> {
    let force = Vector2::from(force);
    let mut wind = force;
    // The force is the gradient of a convex function of the wind.
    for _ in 0..60 {
        let (given, slope) = on_cables(wind, geometry);
        // Along cables that all lie across it the wind has no slope.
        let slope = slope + 1e-9 * slope.trace() * Matrix2::identity();
        wind += slope.try_inverse()? * (force - given);
    }
    ((on_cables(wind, geometry).0 - force).norm() < 1e-6 * force.norm()).then(|| wind.into())
}

/// Force (N) of a wind on cables of C_d d = 1 m on the platform in the middle, at rest: half of what there is on each; and its slope.
fn on_cables(wind: Vector2<f64>, geometry: &Geometry) -> (Vector2<f64>, Matrix2<f64>) {
    let (mut force, mut slope) = (Vector2::zeros(), Matrix2::zeros());
    for cable in in_the_middle(geometry) {
        let normal = Vector2::from(normal(&cable));
        let (across, share) = (normal.dot(&wind), 0.25 * AIR_DENSITY * cable.span);
        force += share * across.abs() * across * normal;
        slope += 2.0 * share * across.abs() * normal * normal.transpose();
    }
    (force, slope)
}

fn in_the_middle(geometry: &Geometry) -> impl Iterator<Item = CableKinematics> + use<> {
    let cables = kinematics::cables(geometry, &[0.0; 3], &[0.0; 3]);
    (0..cables.len()).map(move |i| cables[i])
}

/// The direction across a cable, counter-clockwise from that towards the platform.
fn normal(cable: &CableKinematics) -> [f64; 2] {
    [-cable.direction[1], cable.direction[0]]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn effect(id: &str, cable: Option<usize>, values: &[f64]) -> EffectSpec {
        EffectSpec::new(id, cable, values).expect("an effect")
    }

    #[test]
    fn laws_that_are_not_looked_for_are_reached_from_what_they_look_like() {
        let model = Model::default();
        let only = |found: &EffectSpec| {
            let mut laws = stood_for(found, &model);
            assert_eq!(laws.len(), 1, "{found:?}: {laws:?}");
            laws.remove(0)
        };
        // A pulley of 0.5 m came out as this offset.
        let pulley = only(&effect("anchor_offset", Some(3), &[0.34939, -0.35761]));
        assert_eq!((pulley.id.as_str(), pulley.cable), ("pulley_radius", Some(3)));
        assert!((pulley.values[0] - 0.5).abs() < 1e-3, "{pulley:?}");
        let compliance = only(&effect("cable_stiffness", Some(2), &[-0.06]));
        let plant = PlantData::new(&model.parameters);
        let length = in_the_middle(&plant.geometry).nth(1).expect("a cable").length;
        let stiffness = plant.cables[1].axial_stiffness;
        let softer = 1.0 / (1.0 / stiffness + 1.0 / (compliance.values[0] * length));
        assert!((softer / stiffness - 0.94).abs() < 1e-12, "{compliance:?}");
        let on = |law: &EffectSpec| {
            let [x, y, area] = law.values[..3] else { panic!("{law:?}") };
            area * on_cables(Vector2::new(x, y), &plant.geometry).0
        };
        let wind = only(&effect("platform_quadratic_drag", None, &[4.0, 6.0, -3.0]));
        let speed = wind.values[0].hypot(wind.values[1]);
        assert!((on(&wind) - 4.0 * 45.0_f64.sqrt() * Vector2::new(6.0, -3.0)).norm() < 1e-3, "{wind:?}");
        assert!((speed - AS_FAST * 45.0_f64.sqrt()).abs() < 1e-9, "{wind:?}");
        assert!(!stood_for(&effect("steady_wind", None, &[300.0, 300.0, 0.0]), &model).is_empty());
        let steady = only(&effect("steady_wind", None, &[300.0, 400.0, 0.0]));
        assert!((on(&steady) - Vector2::new(300.0, 400.0)).norm() < 1e-3, "{steady:?}");
        assert_eq!(steady.values[2], DRAG_AREA_PER_LENGTH);
    }

    #[test]
    fn what_stands_for_nothing_else_stays_alone() {
        let alone = [
            effect("cable_stiffness", Some(2), &[0.06]),
            effect("cable_stiffness", None, &[-0.06]),
            effect("platform_quadratic_drag", None, &[4.0, 0.0, 0.0]),
            effect("winch_viscous_friction", Some(1), &[50.0]),
        ];
        assert!(alone.iter().all(|found| stood_for(found, &Model::default()).is_empty()));
    }

    #[test]
    fn a_wave_along_what_a_winch_has_paid_out_is_torque_ripple() {
        let law = |target: &str, text: &str| law_of_term(&EffectSpec::expression(target, text).expect("a term"));
        let ripple = |text: &str| law("winch[2]", text).unwrap_or_else(|| panic!("{text}")).values;
        let near = |a: &[f64], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9);
        let period = TAU / 4.8;
        assert!(near(&ripple("60*sin(4.8*unstretched_length[2] + 0.5)"), [60.0, period, 0.5]));
        assert!(near(&ripple("60*sin(4.8*unstretched_length[2] - 0.5)"), [60.0, period, -0.5]));
        assert!(near(&ripple("-60*cos(4.8*unstretched_length[2])"), [60.0, period, -FRAC_PI_2]));
        for (target, text) in [
            ("winch[1]", "60*sin(4.8*unstretched_length[2] + 0.5)"),
            ("platform.force_x", "60*sin(4.8*unstretched_length[2])"),
            ("winch[2]", "60*sin(4.8*time + 0.5)"),
            ("winch[2]", "60*unstretched_length[2]"),
            ("winch[2]", "vx*sin(4.8*unstretched_length[2])"),
        ] {
            assert!(law(target, text).is_none(), "{text}");
        }
    }
}
