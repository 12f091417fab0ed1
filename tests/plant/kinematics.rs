//! Kinematics (1)-(16) against differences, dual numbers and itself.

use cdpr::geometry::Geometry;
use cdpr::kinematics::{
    ForwardKinematicsError, accelerations, angular_jacobian, cable_lengths, cables, forward_kinematics, jacobian,
};
use cdpr::parameters::Parameters;
use num_dual::Dual64;

use crate::random::Random;

fn pose(random: &mut Random) -> [f64; 3] {
    let [x, y]: [f64; 2] = random.around(300.0);
    [x, y, random.within(-0.7, 0.7)]
}

fn geometry() -> Geometry {
    Geometry::new(&Parameters::default())
}

#[test]
fn lengths_at_the_origin_are_known() {
    // Anchors and attachments of one cable lie at right angles as seen from the origin.
    for length in cable_lengths(&geometry(), &[0.0; 3]).iter() {
        assert!((length - (900.0_f64.powi(2) + 100.0).sqrt()).abs() < 1e-12 * length);
    }
}

#[test]
fn jacobians_are_the_derivatives_of_lengths_and_angles() {
    let (geometry, mut random) = (geometry(), Random(11));
    for _ in 0..200 {
        let pose = pose(&mut random);
        let (j, j_angle) = (jacobian(&geometry, &pose), angular_jacobian(&geometry, &pose));
        for axis in 0..3 {
            let seeded: [Dual64; 3] = std::array::from_fn(|k| Dual64::new(pose[k], f64::from(u8::from(k == axis))));
            let dual = cables(&geometry, &seeded, &[Dual64::from(0.0); 3]);
            for i in 0..4 {
                assert!((dual[i].length.eps - j[(i, axis)]).abs() < 1e-13 * (1.0 + j[(i, axis)].abs()));
                assert!((dual[i].angle().eps - j_angle[(i, axis)]).abs() < 1e-14);
            }
            let step = 1e-4;
            let (mut ahead, mut behind) = (pose, pose);
            ahead[axis] += step;
            behind[axis] -= step;
            let (a, b) = (cable_lengths(&geometry, &ahead), cable_lengths(&geometry, &behind));
            for i in 0..4 {
                assert!(((a[i] - b[i]) / (2.0 * step) - j[(i, axis)]).abs() < 1e-7);
            }
        }
    }
}

/// (12) and (14) along a motion of constant acceleration, by second derivatives of lengths and angles.
#[test]
fn accelerations_are_second_derivatives() {
    let (geometry, mut random) = (geometry(), Random(12));
    for _ in 0..200 {
        let pose = pose(&mut random);
        let twist: [f64; 3] = [random.within(-5.0, 5.0), random.within(-5.0, 5.0), random.within(-0.5, 0.5)];
        let acceleration: [f64; 3] = [random.within(-2.0, 2.0), random.within(-2.0, 2.0), random.within(-0.2, 0.2)];
        let (length, angle) = accelerations(&geometry, &pose, &twist, &acceleration);
        // First derivatives in time by the twist, the second by dual numbers in time.
        let moving: [Dual64; 3] = std::array::from_fn(|k| Dual64::new(pose[k], twist[k]));
        let speeding: [Dual64; 3] = std::array::from_fn(|k| Dual64::new(twist[k], acceleration[k]));
        let dual = cables(&geometry, &moving, &speeding);
        for i in 0..4 {
            assert!((dual[i].speed.eps - length[i]).abs() < 1e-12 * (1.0 + length[i].abs()), "cable {i}");
            assert!((dual[i].angular_rate.eps - angle[i]).abs() < 1e-14, "cable {i}");
            assert!((dual[i].length.eps - dual[i].speed.re).abs() < 1e-13 * (1.0 + dual[i].speed.re.abs()));
        }
    }
}

#[test]
fn forward_kinematics_undoes_inverse_kinematics() {
    let (geometry, mut random) = (geometry(), Random(13));
    for _ in 0..300 {
        let pose = pose(&mut random);
        let lengths = cable_lengths(&geometry, &pose);
        let guess = [
            pose[0] + random.within(-20.0, 20.0),
            pose[1] + random.within(-20.0, 20.0),
            pose[2] + random.within(-0.3, 0.3),
        ];
        let found = forward_kinematics(&geometry, &lengths, guess, 1e-6).unwrap();
        for k in 0..3 {
            assert!((found[k] - pose[k]).abs() < 1e-8, "{pose:?} from {guess:?}: {found:?}");
        }
    }
}

#[test]
fn forward_kinematics_says_why_it_fails() {
    let geometry = geometry();
    let lengths = cable_lengths(&geometry, &[1.0, 2.0, 0.1]);
    let mut wrong = lengths;
    wrong[2] += 0.5;
    let error = forward_kinematics(&geometry, &wrong, [0.0; 3], 1e-3).unwrap_err();
    match error {
        ForwardKinematicsError::Inconsistent { residual, tolerance } => {
            assert!(residual > 0.05 && residual < 0.5 && tolerance == 1e-3, "{residual}");
        }
        other => panic!("{other}"),
    }
    for bad in [f64::NAN, -1.0, 0.0, f64::INFINITY] {
        let mut lengths = lengths;
        lengths[3] = bad;
        let error = forward_kinematics(&geometry, &lengths, [0.0; 3], 1e-3).unwrap_err();
        assert!(matches!(error, ForwardKinematicsError::BadLength { cable: 4, .. }), "{error}");
    }
    let error = forward_kinematics(&geometry, &lengths, [f64::NAN; 3], 1e-3).unwrap_err();
    assert!(matches!(error, ForwardKinematicsError::NotConverged { .. }), "{error}");
}

#[test]
fn poses_are_checked() {
    let geometry = geometry();
    geometry.check_pose(&[0.0; 3]).unwrap();
    geometry.check_pose(&[500.0, -400.0, 0.0]).unwrap();
    for (pose, part) in [
        ([f64::NAN, 0.0, 0.0], "finite"),
        ([900.0, 0.0, 0.0], "outside their polygon"),
        ([0.0, 0.0, 1.2], "runs through it"),
        ([500.0, -400.0, 0.3], "cable 1 runs through it"),
    ] {
        let error = geometry.check_pose(&pose).unwrap_err().to_string();
        assert!(error.contains(part), "{pose:?}: {error}");
    }
}
