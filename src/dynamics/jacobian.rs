//! The derivatives of the plant's rates as dense matrices, for those outside who linearise.

use crate::per_cable::{MAX_CABLES, PerCable};
use crate::plant::Plant;

use super::Inputs;
use super::linearisation::Linearisation;
use super::matrix3::{combine, inverse, product};

/// `∂f/∂y` and `∂f/∂u` of the plant's rates `f` at one instant, by rows.
///
/// Left out is what an expression says of other cables than its own, and of cables' own states where it is a force on the platform.
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
        let plant = plant.at(time);
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
        let mut by_command = [[0.0; 3]; MAX_CABLES];
        let mut set = |column: usize, force: [f64; 3]| {
            let acceleration = product(&inverse_mass, &force);
            for (r, a) in acceleration.iter().enumerate() {
                self.by_state[(3 + r) * n + column] = *a;
            }
        };
        for c in 0..3 {
            set(c, l.force_by_pose.map(|row| row[c]));
            set(3 + c, l.force_by_twist.map(|row| row[c]));
        }
        for ((block, &first), by_command) in l.cables.iter().zip(&plant.offset).zip(&mut by_command) {
            let wrench = |along: f64, across: f64| combine(-along, &block.row, across, &block.normal);
            for (c, state) in block.states.iter().enumerate() {
                set(first + c, wrench(state.tension, state.transverse));
            }
            let [along, across] = block.force_by_command;
            *by_command = product(&inverse_mass, &wrench(along, across));
        }
        for c in 0..3 {
            self.by_state[c * n + 3 + c] = 1.0;
            for r in 0..3 {
                self.by_input[(3 + r) * inputs + c] = inverse_mass[r][c];
            }
        }
        for (i, acceleration) in by_command.iter().enumerate().take(plant.cables()) {
            for (r, a) in acceleration.iter().enumerate() {
                self.by_input[(3 + r) * inputs + 3 + i] = *a;
            }
        }
        // The accelerations above also act on the cables' own states.
        let along = |matrix: &[f64], columns: usize, row: &[f64; 3], column: usize| -> f64 {
            (0..3).map(|k| row[k] * matrix[(3 + k) * columns + column]).sum()
        };
        for (i, (block, &first)) in l.cables.iter().zip(&plant.offset).enumerate() {
            for (r, state) in block.states.iter().enumerate() {
                let by = state.rate_by_acceleration;
                for c in 0..n {
                    self.by_state[(first + r) * n + c] = by * along(&self.by_state, n, &block.row, c);
                }
                for c in 0..inputs {
                    self.by_input[(first + r) * inputs + c] = by * along(&self.by_input, inputs, &block.row, c);
                }
                let row = &mut self.by_state[(first + r) * n..(first + r + 1) * n];
                for c in 0..3 {
                    row[c] += state.rate_by_pose[c];
                    row[3 + c] += state.rate_by_twist[c];
                }
                let own = row[first..first + block.states.len()].iter_mut();
                own.zip(&state.rate_by_state).for_each(|(entry, by)| *entry += by);
                self.by_input[(first + r) * inputs + 3 + i] += state.rate_by_command;
            }
        }
    }
}
