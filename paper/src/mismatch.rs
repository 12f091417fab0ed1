//! The model whose force rows pull while its moment row pushes.
//!
//! A program published with a later book on the same robot treats `F > 0` as a pull in its force rows and carries the
//! opposite sign in its moment row. With that mismatch all of x, y and φ oscillate, as the paper's Fig. 8 shows; with either
//! consistent sign one of them grows. That the figure came about this way is an inference, not a fact.
//!
//! Kept here, apart from the plant: no physics has it.

use crate::CABLES;
use cdpr::geometry::Geometry;
use cdpr::integrator::IntegrationError;
use cdpr::kinematics;
use cdpr::parameters::{CableModel, Parameters};
use nalgebra::{Matrix3, Vector3};

use crate::ode;

/// The robot with the tension's moment turned round.
#[derive(Clone, Debug)]
pub struct Mismatch {
    parameters: Parameters,
    geometry: Geometry,
    /// Sign of the tension's moment: -1 with the mismatch, 1 as it should be.
    moment_sign: f64,
}

impl Mismatch {
    /// The mismatch for these parameters; `rigid` and `lumped_mass` are known.
    pub fn new(parameters: Parameters) -> Self {
        Self::with_moment_sign(parameters, -1.0)
    }

    /// The same equations with the consistent sign: the plant, written a second time.
    pub fn consistent(parameters: Parameters) -> Self {
        Self::with_moment_sign(parameters, 1.0)
    }

    fn with_moment_sign(parameters: Parameters, moment_sign: f64) -> Self {
        let geometry = Geometry::new(&parameters);
        Self { parameters, geometry, moment_sign }
    }

    /// States at rest at `pose` (m, rad), every spring carrying `force` (N): pose, twist, then `l`, `l̇` of each elastic cable.
    pub fn start(&self, pose: [f64; 3], force: f64) -> Vec<f64> {
        let mut y = vec![0.0; 6];
        y[..3].copy_from_slice(&pose);
        if self.parameters.cable_model != CableModel::Rigid {
            for length in kinematics::cable_lengths(&self.geometry, &pose).iter() {
                y.extend([length / (1.0 + force / self.parameters.axial_stiffness()), 0.0]);
            }
        }
        y
    }

    /// Rates of the states under constant winch forces (N).
    pub fn rates(&self, y: &[f64], force: &[f64; CABLES], rates: &mut [f64]) {
        let p = &self.parameters;
        let (pose, twist) = ([y[0], y[1], y[2]], [y[3], y[4], y[5]]);
        let omega = twist[2];
        let mut mass = Matrix3::from_diagonal(&Vector3::new(p.platform_mass, p.platform_mass, p.platform_inertia));
        let mut wrench = Vector3::zeros();
        let turn = Vector3::new(1.0, 1.0, self.moment_sign);
        for (i, c) in kinematics::cables(&self.geometry, &pose, &twist).iter().enumerate() {
            let (row, normal) = (Vector3::from(c.jacobian_row()), Vector3::from(c.normal_row()));
            let along = row.component_mul(&turn);
            // Q = -ρ/3 (L² α̈ + 3 L L̇ α̇) along N.
            let across = p.cable_density / 3.0 * c.length;
            mass += normal * normal.transpose() * across;
            wrench -= normal * (across * (c.normal_acceleration_bias(omega) + 3.0 * c.speed * c.angular_rate));
            let half = 0.5 * p.cable_density;
            if p.cable_model == CableModel::Rigid {
                let inertia = half * c.length;
                let turning = c.length * c.angular_rate;
                let still = force[i]
                    + half * (c.speed * c.speed - turning * turning)
                    + inertia * c.length_acceleration_bias(omega);
                mass += along * row.transpose() * inertia;
                wrench -= along * still;
            } else {
                let (l, rate) = (y[6 + 2 * i], y[7 + 2 * i]);
                let spring = p.axial_stiffness() * (c.length - l) / l + p.cable_damping / l * (c.speed - rate);
                let tension = spring.max(0.0);
                wrench -= along * tension;
                let turning = l * c.angular_rate;
                rates[6 + 2 * i] = rate;
                rates[7 + 2 * i] = (tension - force[i] - half * (rate * rate - turning * turning)) / (half * l);
            }
        }
        let acceleration = mass.lu().solve(&wrench).unwrap_or_else(|| Vector3::repeat(f64::NAN));
        for k in 0..3 {
            rates[k] = twist[k];
            rates[3 + k] = acceleration[k];
        }
    }

    /// States at every multiple of `step` (s) up to `stop` (s), released at rest at `pose` under `force` (N) in each cable.
    ///
    /// # Errors
    /// When the integrator cannot go on.
    pub fn release(&self, pose: [f64; 3], force: f64, step: f64, stop: f64) -> Result<Vec<Vec<f64>>, IntegrationError> {
        self.run(&self.start(pose, force), &[force; CABLES], step, stop)
    }

    /// States at every multiple of `step` (s) up to `stop` (s), from `start` under constant winch forces (N).
    ///
    /// # Errors
    /// When the integrator cannot go on.
    pub fn run(
        &self,
        start: &[f64],
        force: &[f64; CABLES],
        step: f64,
        stop: f64,
    ) -> Result<Vec<Vec<f64>>, IntegrationError> {
        ode::integrate(|_, y, rates| self.rates(y, force, rates), start, step, stop, 1e-9)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use cdpr::dynamics::Inputs;
    use cdpr::plant::Plant;

    #[test]
    fn with_the_consistent_sign_it_is_the_plant() {
        for cable_model in [CableModel::Rigid, CableModel::LumpedMass] {
            let parameters = Parameters { cable_model, ..Parameters::default() };
            let model = Mismatch::consistent(parameters.clone());
            let plant = Plant::new(parameters, Vec::new()).unwrap();
            let mut y = model.start([3.0, -2.0, 0.2], 2e3);
            y[3..6].copy_from_slice(&[0.5, -0.3, 0.02]);
            let force = [1e3, 2e3, 1.5e3, 1.2e3];
            let (mut ours, mut theirs) = (vec![0.0; y.len()], vec![0.0; y.len()]);
            model.rates(&y, &force, &mut ours);
            let inputs = Inputs { winch_force: force.into(), disturbance: [0.0; 3] };
            plant.rates(0.0, &y, &inputs, &[false; CABLES].into(), &mut theirs);
            for (a, b) in ours.iter().zip(&theirs) {
                assert!((a - b).abs() < 1e-10 * (1.0 + b.abs()), "{cable_model:?}: {ours:?} {theirs:?}");
            }
        }
    }
}
