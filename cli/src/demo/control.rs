//! A pose controller of the ordinary kind, for the recordings: an observer of the pose, a spring and a damper towards
//! the reference, and tensions near a mean. It knows the robot's geometry and masses, and nothing of what is hidden.

use cdpr::dynamics::Inputs;
use cdpr::geometry::Geometry;
use cdpr::inverse::distribution::{Bounds, Distribution, Objective, structure_matrix};
use cdpr::parameters::Parameters;

/// Speed of the control loop (rad/s) and its damping ratio.
const LOOP: (f64, f64) = (0.5, 0.8);
/// Speed of the observer (rad/s): slow against the cables' vibration at 13 rad/s.
const OBSERVER: f64 = 2.0;
/// Mean tension (N).
const PRETENSION: f64 = 20e3;
/// Forces are commanded in steps of this (N), as a drive does.
const FORCE_STEP: f64 = 1e-3;

/// Pose (m, rad), its rate and its acceleration.
pub(super) type Reference = [[f64; 3]; 3];

/// The controller's memory.
pub(super) struct Controller {
    geometry: Geometry,
    /// Mass (kg, kg, kg m²) of the platform with its share of the cables.
    mass: [f64; 3],
    distribution: Distribution,
    pose: [f64; 3],
    twist: [f64; 3],
    acceleration: [f64; 3],
}

impl Controller {
    /// A controller that finds the platform at rest at `pose`.
    pub(super) fn new(robot: &Parameters, pose: [f64; 3]) -> anyhow::Result<Self> {
        // Of each of four cables at right angles, a half of its mass moves along with the platform and a third across.
        let cables = robot.cable_density * robot.anchor_radius * 5.0 / 3.0;
        let mass = robot.platform_mass + cables;
        Ok(Self {
            geometry: Geometry::new(robot),
            mass: [mass, mass, robot.platform_inertia],
            distribution: Distribution {
                objective: Objective::MidTension,
                bounds: Bounds::new(0.0, 2.0 * PRETENSION)?,
            },
            pose,
            twist: [0.0; 3],
            acceleration: [0.0; 3],
        })
    }

    /// Winch forces until the next measurement in `step` (s), from this one.
    pub(super) fn forces(&mut self, measured: [f64; 3], wanted: &Reference, step: f64) -> anyhow::Result<Inputs> {
        let (speed, damping) = LOOP;
        for k in 0..3 {
            let predicted = self.pose[k] + step * self.twist[k];
            let surprise = measured[k] - predicted;
            self.pose[k] = predicted + 1.4 * OBSERVER * step * surprise;
            self.twist[k] += step * (self.acceleration[k] + OBSERVER * OBSERVER * surprise);
            self.acceleration[k] = wanted[2][k]
                + speed * speed * (wanted[0][k] - self.pose[k])
                + 2.0 * damping * speed * (wanted[1][k] - self.twist[k]);
        }
        let wrench = std::array::from_fn(|k| self.mass[k] * self.acceleration[k]);
        let tensions = self.distribution.tensions(&structure_matrix(&self.geometry, &self.pose), &wrench)?;
        Ok(Inputs { winch_force: tensions.map(|t| (t / FORCE_STEP).round() * FORCE_STEP), disturbance: [0.0; 3] })
    }
}
