//! Cables that leave pulleys of finite radius: geometry, the virtual work of it, statics.

use std::f64::consts::TAU;

use cdpr::effect::EffectSpec;
use cdpr::geometry::Geometry;
use cdpr::kinematics;
use cdpr::parameters::{CableInertia, CableModel, CableParameters, Parameters};
use cdpr::per_cable::PerCable;
use cdpr::plant::Plant;
use cdpr::statics;

use crate::random::Random;

/// A robot of a few metres, whose cables turn much, with a pulley of this radius on each.
fn plant(radius: f64) -> Plant {
    let cable = vec![
        CableParameters::between([-2.0, 1.5], [-0.2, 0.1]),
        CableParameters::between([2.0, 1.5], [0.2, 0.1]),
        CableParameters::between([2.0, -1.5], [0.2, -0.1]),
        CableParameters::between([-2.0, -1.5], [-0.2, -0.1]),
        CableParameters::between([0.0, 2.0], [0.0, 0.1]),
    ];
    let parameters = Parameters { cable, ..Parameters::default() };
    let pulleys = (radius != 0.0).then(|| EffectSpec::new("pulley_radius", None, &[radius]).unwrap());
    Plant::new(parameters, pulleys.into_iter().collect()).unwrap()
}

fn geometry(radius: f64) -> Geometry {
    *plant(radius).geometry()
}

fn pose(random: &mut Random) -> [f64; 3] {
    [random.within(-1.0, 1.0), random.within(-0.7, 0.7), random.within(-0.4, 0.4)]
}

/// Length from a point behind on the pulley, round it to the tangent point and straight to the attachment, by angles at the axis.
fn round_it(geometry: &Geometry, cable: usize, [x, y, phi]: [f64; 3]) -> (f64, f64) {
    let (anchor, body, radius) =
        (geometry.anchor[cable], geometry.attachment[cable], geometry.pulley_radius[cable].abs());
    let end = [x + phi.cos() * body[0] - phi.sin() * body[1], y + phi.sin() * body[0] + phi.cos() * body[1]];
    let (across, up) = (end[0] - anchor[0], end[1] - anchor[1]);
    let distance = across.hypot(up);
    let half_angle = (radius / distance).acos();
    // Seen from the axis the tangent point lies to the left of the attachment where the cable runs clockwise.
    let side = geometry.pulley_radius[cable].signum();
    let tangent = up.atan2(across) + side * half_angle;
    // It enters half a turn before the tangent point of the pose zero; modulo a turn.
    let home = (body[1] - anchor[1]).atan2(body[0] - anchor[0]);
    let home = home + side * (radius / (body[0] - anchor[0]).hypot(body[1] - anchor[1])).acos();
    let wrapped = (side * (home + side * 0.5 * TAU - tangent)).rem_euclid(TAU);
    (radius * wrapped - 0.5 * TAU * radius, distance * half_angle.sin())
}

#[test]
fn a_length_is_the_arc_on_the_pulley_and_the_tangent() {
    let mut random = Random(101);
    for radius in [0.15, -0.15, 0.4] {
        let geometry = geometry(radius);
        for _ in 0..50 {
            let pose = pose(&mut random);
            let cables = kinematics::cables(&geometry, &pose, &[0.0; 3]);
            for (i, cable) in cables.iter().enumerate() {
                let (arc, straight) = round_it(&geometry, i, pose);
                assert!((cable.span - straight).abs() < 1e-12, "{radius} {i}: {} {straight}", cable.span);
                assert!(
                    (cable.length - arc - straight).abs() < 1e-12,
                    "{radius} {i}: {} {arc} {straight}",
                    cable.length
                );
                assert!(cable.length != cable.span);
            }
        }
    }
}

/// Virtual work: a cable pulls along the gradient of its length. And its rates and accelerations are those of its length and angle.
#[test]
fn a_cable_pulls_along_the_gradient_of_its_length() {
    let mut random = Random(102);
    let geometry = geometry(0.3);
    for _ in 0..30 {
        let (pose, twist, acceleration) = (pose(&mut random), random.around::<3>(0.8), random.around::<3>(2.0));
        let cables = kinematics::cables(&geometry, &pose, &twist);
        let h = 1e-5;
        for axis in 0..3 {
            let moved = |by: f64| {
                let mut pose = pose;
                pose[axis] += by;
                kinematics::cable_lengths(&geometry, &pose)
            };
            let (ahead, behind) = (moved(h), moved(-h));
            for i in 0..5 {
                let gradient = (ahead[i] - behind[i]) / (2.0 * h);
                assert!((cables[i].jacobian_row()[axis] - gradient).abs() < 1e-9, "{i} {axis}");
            }
        }
        let (length, angle) = kinematics::accelerations(&geometry, &pose, &twist, &acceleration);
        let at = |t: f64| {
            let pose = std::array::from_fn(|k| pose[k] + t * twist[k] + 0.5 * t * t * acceleration[k]);
            let twist = std::array::from_fn(|k| twist[k] + t * acceleration[k]);
            kinematics::cables(&geometry, &pose, &twist)
        };
        let (ahead, behind) = (at(h), at(-h));
        for i in 0..5 {
            let rate = |of: &dyn Fn(&kinematics::CableKinematics) -> f64| (of(&ahead[i]) - of(&behind[i])) / (2.0 * h);
            assert!((rate(&|k| k.length) - cables[i].speed).abs() < 1e-8);
            assert!((rate(&|k| k.span) - cables[i].span_rate()).abs() < 1e-8);
            assert!((rate(&|k| k.angle()) - cables[i].angular_rate).abs() < 1e-8);
            assert!((rate(&|k| k.speed) - length[i]).abs() < 1e-7);
            assert!((rate(&|k| k.angular_rate) - angle[i]).abs() < 1e-7);
        }
    }
}

/// Towards a point the pulley leaves no trace, in proportion to its radius, and the side goes with the sign.
#[test]
fn a_small_pulley_is_a_point() {
    let pose = [0.3, -0.2, 0.1];
    let of = |radius: f64| kinematics::cables(&geometry(radius), &pose, &[0.2, -0.1, 0.3]);
    let point = of(0.0);
    for i in 0..5 {
        let [coarse, fine] = [1e-3, 1e-6].map(|r: f64| f64::abs(of(r)[i].length - point[i].length));
        assert!(coarse < 1e-3 && fine < 1.02e-3 * coarse + 1e-12, "{i}: {coarse} {fine}");
        let (left, right) = (of(1e-4)[i], of(-1e-4)[i]);
        let slope =
            |of: &dyn Fn(&kinematics::CableKinematics) -> f64| (of(&left) + of(&right) - 2.0 * of(&point[i])).abs();
        assert!(slope(&|k| k.length) < 1e-7 && slope(&|k| k.speed) < 1e-7 && slope(&|k| k.angular_rate) < 1e-7);
    }
}

/// The stiffness of cables that hold their tensions is how their wrench turns with the pose.
#[test]
fn geometric_stiffness_is_the_slope_of_the_wrench() {
    let plant = plant(0.35);
    let (pose, tension) = ([0.2, 0.3, -0.1], PerCable::from([300.0, 280.0, 410.0, 350.0, 220.0]));
    let wrench = |pose: &[f64; 3]| {
        let jacobian = kinematics::jacobian(plant.geometry(), pose);
        -jacobian.transpose() * nalgebra::DVector::from_fn(5, |i, _| tension[i])
    };
    let stiffness = statics::stiffness(&plant, 0.0, &pose, &tension).unwrap().geometric;
    let h = 1e-6;
    for axis in 0..3 {
        let moved = |by: f64| {
            let mut pose = pose;
            pose[axis] += by;
            wrench(&pose)
        };
        let slope = (moved(h) - moved(-h)) / (-2.0 * h);
        for row in 0..3 {
            assert!((stiffness[(row, axis)] - slope[row]).abs() < 1e-5, "{row} {axis}");
        }
    }
}

#[test]
fn a_pulley_that_reaches_the_platform_is_refused() {
    let cable = vec![
        CableParameters::between([-2.0, 1.5], [-0.2, 0.1]),
        CableParameters::between([2.0, 1.5], [0.2, 0.1]),
        CableParameters::between([0.0, -1.5], [0.0, -0.1]),
    ];
    let spec = EffectSpec::new("pulley_radius", Some(3), &[1.5]).unwrap();
    let error = Plant::new(Parameters { cable, ..Parameters::default() }, vec![spec]).unwrap_err().to_string();
    assert!(error.contains("pulley 3") && error.contains("less than"), "{error}");
}

/// Forces for a motion, and the motion under them again.
#[test]
fn the_plant_is_that_of_the_geometry() {
    // The acceleration of a platform on one taut cable is along the cable's row, whatever the model.
    for model in [CableModel::LumpedMass, CableModel::MasslessSpring] {
        let spec = EffectSpec::new("pulley_radius", None, &[5.0]).unwrap();
        let plant = crate::random::plant(
            model,
            CableInertia::None,
            &[spec, EffectSpec::new("winch_drum_inertia", None, &[10.0]).unwrap()],
        );
        let (y, u) = crate::random::state(&mut Random(8), &plant);
        let mut y = y;
        y[3..6].fill(0.0);
        let e = plant.evaluate(0.0, &y, &u, &[false, true, true, true].into());
        let row = e.kinematics[0].jacobian_row();
        let mass = [plant.data().mass, plant.data().mass, plant.data().inertia];
        for k in 0..3 {
            let expected = -e.tension[0] * row[k] / mass[k] + u.disturbance[k] / mass[k];
            assert!((e.acceleration[k] - expected).abs() < 1e-9 * (1.0 + expected.abs()), "{model:?} {k}");
        }
    }
}
