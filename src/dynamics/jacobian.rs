//! The derivatives of the plant's rates as dense matrices, for those outside who linearise.

use crate::per_cable::PerCable;
use crate::plant::Plant;

use super::Inputs;
use super::linearisation::Linearisation;
use super::matrix3::{inverse, product};

/// `∂f/∂y` and `∂f/∂u` of the plant's rates `f` at one instant, by rows.
///
/// As exact as Newton's method needs them: the derivatives of the mass matrix and of centrifugal and Coriolis forces are
/// left out, and so is what an expression says of other cables than its own.
#[derive(Clone, Debug, Default)]
pub struct Jacobian {
    /// Number of states.
    pub dimension: usize,
    /// `∂f/∂y`, `dimension` rows and columns.
    pub by_state: Vec<f64>,
    /// `∂f/∂u`, 3 + n columns: disturbance `[f_Dx, f_Dy, τ_D]` (per N, per N m), then the winch forces (per N).
    pub by_input: Vec<f64>,
    linearisation: Linearisation,
}

impl Jacobian {
    /// Differentiates `plant` at time `time` (s), states `y`, inputs `u`, with the cables in `slack` carrying nothing.
    pub fn update(&mut self, plant: &Plant, time: f64, y: &[f64], u: &Inputs, slack: &PerCable<bool>) {
        let n = plant.dimension();
        let inputs = 3 + plant.cables();
        let e = plant.evaluate(time, y, u, slack);
        self.linearisation.linearise(plant, time, y, u, &e);
        self.dimension = n;
        for (matrix, columns) in [(&mut self.by_state, n), (&mut self.by_input, inputs)] {
            matrix.clear();
            matrix.resize(n * columns, 0.0);
        }
        let l = &self.linearisation;
        let inverse_mass = inverse(&l.mass);
        let mut set = |column: usize, force: [f64; 3]| {
            let acceleration = product(&inverse_mass, &force);
            for (r, a) in acceleration.iter().enumerate() {
                self.by_state[(3 + r) * n + column] = *a;
            }
        };
        for c in 0..3 {
            let mut force = l.force_by_pose.map(|row| row[c]);
            for (block, kinematics) in l.cables.iter().zip(&e.kinematics) {
                let (row, normal) = (&block.jacobian, &block.normal);
                for (k, slot) in force.iter_mut().enumerate() {
                    let by_turning = normal[k] * block.by_turning[1] - row[k] * block.by_turning[0];
                    *slot += by_turning * block.turning_by_pose[c] + normal[k] * block.transverse_by_length * row[c]
                        - block.transverse * row[k] * normal[c] / kinematics.length;
                }
                if c == 2 {
                    force[2] += block.transverse * row[2];
                }
            }
            set(c, force);
            set(3 + c, l.force_by_twist.map(|row| row[c]));
        }
        for (block, &first) in l.cables.iter().zip(&plant.offset) {
            for c in 0..block.size {
                let (along, across) = (block.tension_by_state[c], block.transverse_by_state[c]);
                set(first + c, std::array::from_fn(|k| block.normal[k] * across - block.jacobian[k] * along));
            }
        }
        for c in 0..3 {
            self.by_state[c * n + 3 + c] = 1.0;
            for r in 0..3 {
                self.by_input[(3 + r) * inputs + c] = inverse_mass[r][c];
            }
        }
        for (i, (block, &first)) in l.cables.iter().zip(&plant.offset).enumerate() {
            let acceleration = product(&inverse_mass, &block.jacobian.map(|j| -j * block.tension_by_command));
            for (r, a) in acceleration.iter().enumerate() {
                self.by_input[(3 + r) * inputs + 3 + i] = *a;
            }
            for r in 0..block.size {
                let row = &mut self.by_state[(first + r) * n..(first + r + 1) * n];
                let [length, speed, turning] = block.rates_by_motion[r];
                for c in 0..3 {
                    row[c] =
                        length * block.jacobian[c] + speed * block.curvature[c] + turning * block.turning_by_pose[c];
                    row[3 + c] = speed * block.jacobian[c] + turning * block.normal_over_length[c];
                }
                row[first..first + block.size].copy_from_slice(&block.rates_by_state[r][..block.size]);
                self.by_input[(first + r) * inputs + 3 + i] = block.rates_by_command[r];
            }
        }
    }
}
