//! The law: feed-forward of the reference, feedback of the pose, and the inertia and weight of the robot.

use cdpr::dynamics::Inputs;
use cdpr::inverse::distribution::{self, Distribution, DistributionError, Objective, structure_matrix};
use cdpr::parameters::{CableModel, Parameters};
use cdpr::per_cable::PerCable;
use cdpr::plant::{Plant, PlantError};
use nalgebra::{Matrix3, Vector3};

use crate::reference::Motion;
use crate::settings::{Bounds, Settings};

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

/// The robot as the controller believes it to be: the plant with rigid cables and without effects.
#[derive(Debug)]
pub struct Robot {
    plant: Plant,
}

/// What the winches are told.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pull {
    /// Forces within the bounds (N).
    pub force: PerCable<f64>,
    /// Do they give the wanted acceleration? Where no forces within the bounds do, these come nearest.
    pub feasible: bool,
}

impl Robot {
    /// The robot with these parameters.
    ///
    /// # Errors
    /// Parameters that no plant can have.
    pub fn new(parameters: &Parameters) -> Result<Self, PlantError> {
        let rigid = Parameters { cable_model: CableModel::Rigid, ..parameters.clone() };
        Plant::new(rigid, vec![]).map(|plant| Self { plant })
    }

    /// Winch forces within `bounds` nearest to their mean under which the robot has this acceleration (m/s², rad/s²).
    ///
    /// # Errors
    /// Fewer than three cables, or cables that cannot give three independent wrenches at the measured pose.
    pub fn winch_forces(
        &self,
        bounds: &Bounds,
        measured: &Measurement,
        acceleration: &[f64; 3],
    ) -> Result<Pull, DistributionError> {
        let structure = structure_matrix(self.plant.geometry(), &measured.pose);
        let within = distribution::Bounds::new(bounds.min, bounds.max)
            .map_err(|error| DistributionError::NotSolved(error.to_string()))?;
        let nearest = Distribution { objective: Objective::Near(bounds.mean), bounds: within };
        match nearest.tensions(&structure, &self.wrench(measured, acceleration).into()) {
            Ok(force) => Ok(Pull { force, feasible: true }),
            Err(DistributionError::Infeasible(found)) => Ok(Pull { force: found.nearest_tension, feasible: false }),
            Err(error) => Err(error),
        }
    }

    /// The wrench (N, N, N m) of the winch forces that this acceleration takes.
    ///
    /// The plant's accelerations are `a = a₀ + M⁻¹ w`, `a₀` those without forces, `M` the inertia of platform and cables at this
    /// pose: the plant is asked for both, so that whatever it has (weight, centre of mass, cables' inertia) is in it.
    fn wrench(&self, measured: &Measurement, acceleration: &[f64; 3]) -> Vector3<f64> {
        let robot = self.plant.parameters();
        let free = self.acceleration(measured, [0.0; 3]);
        let mass = [robot.platform_mass, robot.platform_mass, robot.platform_inertia];
        let inverse = Matrix3::from_columns(&std::array::from_fn::<_, 3, _>(|k| {
            let mut wrench = [0.0; 3];
            wrench[k] = mass[k];
            (self.acceleration(measured, wrench) - free) / mass[k]
        }));
        let missing = Vector3::from(*acceleration) - free;
        // A mass matrix is positive definite, so it has an inverse.
        inverse.lu().solve(&missing).unwrap_or_else(|| Vector3::from(mass).component_mul(&missing))
    }

    /// Acceleration of the platform under this wrench alone.
    fn acceleration(&self, measured: &Measurement, wrench: [f64; 3]) -> Vector3<f64> {
        let cables = self.plant.cables();
        let (states, inputs) =
            ([measured.pose, measured.twist].concat(), Inputs { disturbance: wrench, ..Inputs::none(cables) });
        let mut rates = [0.0; 6];
        self.plant.rates(0.0, &states, &inputs, &PerCable::filled(cables, false), &mut rates);
        Vector3::new(rates[3], rates[4], rates[5])
    }
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
    use std::f64::consts::TAU;

    use cdpr::parameters::CableParameters;

    use super::*;

    /// Cables all around a platform of 0.3 m, in light gravity, each with a density of its own.
    fn around(cables: usize) -> Parameters {
        let at = |radius: f64, angle: f64| [radius * angle.cos(), radius * angle.sin()];
        let cable = |i: usize| CableParameters {
            density: Some(0.01 * (1.0 + i as f64)),
            ..CableParameters::between(
                at(3.0, TAU * (i as f64 + 0.4) / cables as f64),
                at(0.3, TAU * (i as f64 + [1.9, -1.1][i % 2]) / cables as f64),
            )
        };
        Parameters {
            platform_mass: 10.0,
            platform_inertia: 0.5,
            centre_of_mass: [0.02, -0.01],
            gravity: [0.1, -0.5],
            cable: (0..cables).map(cable).collect(),
            ..Parameters::default()
        }
    }

    /// The plant's own equations, asked what acceleration comes of the forces.
    fn check(robot: Parameters, bounds: &Bounds, motions: &[[[f64; 3]; 3]]) {
        let cables = robot.cables();
        let plant = Plant::new(Parameters { cable_model: CableModel::Rigid, ..robot.clone() }, vec![]).unwrap();
        let robot = Robot::new(&robot).unwrap();
        for &[pose, twist, acceleration] in motions {
            let found = robot.winch_forces(bounds, &Measurement { pose, twist }, &acceleration).unwrap();
            assert!(found.feasible, "{cables} cables at {pose:?}");
            assert!(found.force.iter().all(|force| (bounds.min - 1e-9..=bounds.max + 1e-9).contains(force)));
            let inputs = Inputs { winch_force: found.force, ..Inputs::none(cables) };
            let mut rates = [0.0; 6];
            plant.rates(0.0, &[pose, twist].concat(), &inputs, &PerCable::filled(cables, false), &mut rates);
            for k in 0..3 {
                let error = rates[3 + k] - acceleration[k];
                assert!(error.abs() < 1e-12, "{cables} cables, {k}: {} for {}", rates[3 + k], acceleration[k]);
            }
        }
    }

    #[test]
    fn the_forces_give_the_acceleration_in_the_plant() {
        let settings = Settings::default();
        let motions = [
            [[0.0; 3], [0.0; 3], [0.0; 3]],
            [[3.0, -4.0, 0.02], [0.5, -0.3, 0.01], [0.05, 0.02, -0.003]],
            [[-80.0, 120.0, 0.2], [4.0, 3.0, -0.1], [-0.6, 0.4, 0.02]],
        ];
        check(settings.robot, &settings.bounds, &motions);
    }

    #[test]
    fn the_forces_give_the_acceleration_whatever_the_number_of_cables() {
        let bounds = Bounds { min: 1.0, mean: 50.0, max: 400.0 };
        let motions = [[[0.0; 3], [0.0; 3], [0.0; 3]], [[0.1, -0.2, 0.05], [0.2, 0.1, -0.3], [0.3, -0.2, 0.1]]];
        for cables in 4..=12 {
            check(around(cables), &bounds, &motions);
        }
    }

    #[test]
    fn an_impossible_wrench_is_given_as_near_as_the_bounds_let_it_and_said_so() {
        let settings = Settings::default();
        let robot = Robot::new(&settings.robot).unwrap();
        let measured = Measurement { pose: [-400.0, 0.0, 0.0], twist: [0.0; 3] };
        let found = robot.winch_forces(&settings.bounds, &measured, &[60.0, 0.0, 0.0]).unwrap();
        assert!(!found.feasible);
        assert!(found.force.iter().all(|f| (settings.bounds.min..=settings.bounds.max).contains(f)));
    }

    #[test]
    fn two_cables_are_too_few_and_told_so() {
        let robot = Robot::new(&around(2)).unwrap();
        let bounds = Bounds { min: 1.0, mean: 50.0, max: 400.0 };
        let error = robot.winch_forces(&bounds, &Measurement::default(), &[0.0; 3]).unwrap_err();
        assert_eq!(error, DistributionError::TooFewCables { found: 2 });
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
