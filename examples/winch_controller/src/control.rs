//! The law: feed-forward of the reference, feedback of the pose, and the inertia of platform and cables.

use cdpr::geometry::Geometry;
use cdpr::kinematics::{CableKinematics, cables};
use cdpr::parameters::Parameters;
use nalgebra::{Matrix3x4, Vector3};

use crate::reference::Motion;
use crate::settings::Settings;
use crate::tension::{Bounds, Distribution, distribute};

/// The measured motion of the platform.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Measurement {
    /// Pose `[x, y, φ]` (m, rad).
    pub pose: [f64; 3],
    /// Twist `[vx, vy, φ̇]` (m/s, rad/s).
    pub twist: [f64; 3],
}

/// The acceleration that the feedback asks for (m/s², rad/s²): a spring and a damper towards the reference, per mass.
#[must_use]
pub fn feedback(settings: &Settings, wanted: &Motion, measured: &Measurement) -> [f64; 3] {
    std::array::from_fn(|k| {
        let (bandwidth, damping) = if k < 2 {
            (settings.position_bandwidth, settings.position_damping)
        } else {
            (settings.orientation_bandwidth, settings.orientation_damping)
        };
        let error = wanted.pose[k] - measured.pose[k];
        let error_rate = wanted.twist[k] - measured.twist[k];
        bandwidth * (bandwidth * error + 2.0 * damping * error_rate)
    })
}

/// Winch forces (N) within `bounds` under which the robot, taken with rigid cables, has this acceleration; `None` where
/// the cables cannot give three independent wrenches.
#[must_use]
pub fn winch_forces(
    settings: &Settings,
    bounds: &Bounds,
    measured: &Measurement,
    acceleration: &[f64; 3],
) -> Option<Distribution> {
    let geometry: Geometry = settings.geometry();
    let cables = cables(&geometry, &measured.pose, &measured.twist);
    // A pull on the cable acts against the direction in which it lengthens.
    let structure = Matrix3x4::from_fn(|row, i| -cables[i].jacobian_row()[row]);
    let wrench = wrench(&settings.robot, &cables, measured.twist[2], acceleration);
    distribute(&structure, &wrench, bounds)
}

/// The wrench (N, N, N m) of the winch forces that this acceleration takes: equations (26)-(28) with (23) for the
/// cables' mass along and (20) across, solved for `-Σ u S`.
fn wrench(robot: &Parameters, cables: &[CableKinematics], omega: f64, acceleration: &[f64; 3]) -> Vector3<f64> {
    let mass = Vector3::new(robot.platform_mass, robot.platform_mass, robot.platform_inertia);
    let acceleration = Vector3::from(*acceleration);
    let mut wrench = mass.component_mul(&acceleration);
    for cable in cables {
        let along = Vector3::from(cable.jacobian_row());
        let across = Vector3::from(cable.normal_row());
        let length = cable.length;
        let lengthening = along.dot(&acceleration) + cable.length_acceleration_bias(omega);
        let swing = across.dot(&acceleration) + cable.normal_acceleration_bias(omega);
        let sweep = length * cable.angular_rate;
        let axial = 0.5 * robot.cable_density * (length * lengthening - sweep * sweep + cable.speed * cable.speed);
        let transverse = robot.cable_density / 3.0 * (length * swing + 3.0 * cable.speed * sweep);
        wrench += along * axial + across * transverse;
    }
    wrench
}

/// A first-order low pass for sampled values.
///
/// Elastic cables let the winch masses swing at about 13 rad/s, damped by a hundredth only; feedback that reaches so
/// far would drive them. The low pass turns it down and turns its phase away from there.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LowPass {
    /// The smoothed values.
    pub value: [f64; 3],
}

impl LowPass {
    /// Take a new sample that holds for `step` (s); `time` (s) is the time constant, 0 for none.
    pub fn update(&mut self, sample: &[f64; 3], step: f64, time: f64) {
        let share = if time > 0.0 { 1.0 - (-step / time).exp() } else { 1.0 };
        for (value, sample) in self.value.iter_mut().zip(sample) {
            *value += share * (sample - *value);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use cdpr::dynamics::Inputs;
    use cdpr::parameters::CableModel;
    use cdpr::plant::Plant;
    use cdpr::simulation::Simulation;

    use super::*;

    /// The plant's own equations, asked what acceleration comes of the forces.
    #[test]
    fn the_forces_give_the_acceleration_in_the_plant() {
        let robot = Parameters { cable_model: CableModel::Rigid, ..Parameters::default() };
        let plant = Arc::new(Plant::new(robot, vec![]).unwrap());
        let settings = Settings::default();
        for (pose, twist, acceleration) in [
            ([0.0; 3], [0.0; 3], [0.0; 3]),
            ([3.0, -4.0, 0.02], [0.5, -0.3, 0.01], [0.05, 0.02, -0.003]),
            ([-80.0, 120.0, 0.2], [4.0, 3.0, -0.1], [-0.6, 0.4, 0.02]),
        ] {
            let measured = Measurement { pose, twist };
            let found = winch_forces(&settings, &settings.bounds, &measured, &acceleration).unwrap();
            assert!(found.feasible);
            let inputs = Inputs { winch_force: found.force.into(), ..Inputs::none(4) };
            let y = [pose, twist].concat();
            let rates = Simulation::from_states(Arc::clone(&plant), 0.0, y, inputs, 1e-9).rates();
            for k in 0..3 {
                let error = rates[3 + k] - acceleration[k];
                assert!(error.abs() < 1e-12, "{k}: {} for {}", rates[3 + k], acceleration[k]);
            }
        }
    }

    #[test]
    fn the_low_pass_is_exact_for_a_held_sample() {
        let mut coarse = LowPass::default();
        let mut fine = LowPass::default();
        coarse.update(&[1.0, -2.0, 0.5], 0.3, 0.3);
        for _ in 0..30 {
            fine.update(&[1.0, -2.0, 0.5], 0.01, 0.3);
        }
        assert!((coarse.value[0] - (1.0 - (-1.0_f64).exp())).abs() < 1e-15);
        assert!((coarse.value[1] - fine.value[1]).abs() < 1e-14);
        coarse.update(&[3.0; 3], 0.01, 0.0);
        assert_eq!(coarse.value, [3.0; 3]);
    }
}
