//! The motion that is timed: a robot under control, on a circle.

use std::f64::consts::TAU;

use cdpr::dynamics::Inputs;
use cdpr::geometry::Geometry;
use cdpr::inverse::distribution::structure_matrix;
use nalgebra::{DMatrix, DVector, Vector3};

/// Communication step (s); winch forces are held over it.
pub(crate) const STEP: f64 = 0.01;
/// Steps of one turn: 60 s.
pub(crate) const STEPS: usize = 6000;
const RADIUS: f64 = 5.0;
/// Of every cable (N).
const PRETENSION: f64 = 2e4;
/// Mass and inertia of the platform with its share of the cables, in the middle (kg, kg m²).
const INERTIA: Vector3<f64> = Vector3::new(2822.0, 2822.0, 3.89e5);
/// Of the loop (rad/s), its damping ratio, and the time constant of the low pass that keeps it off the cables' modes (s).
const BANDWIDTH: f64 = 0.4;
const DAMPING: f64 = 0.8;
const LOW_PASS: f64 = 0.3;

/// Pose, twist and acceleration at step `k`: once round, from rest to rest.
fn reference(k: usize) -> [Vector3<f64>; 3] {
    let w = TAU / (STEP * STEPS as f64);
    let phase = w * STEP * k as f64;
    let (angle, rate, bend) = (phase - phase.sin(), w * (1.0 - phase.cos()), w * w * phase.sin());
    let out = RADIUS * Vector3::new(angle.cos(), angle.sin(), 0.0);
    let on = RADIUS * Vector3::new(-angle.sin(), angle.cos(), 0.0);
    [out, rate * on, bend * on - rate * rate * out]
}

/// Where the platform is at first, at rest.
pub(crate) fn start_pose() -> [f64; 3] {
    reference(0)[0].into()
}

/// A PD law towards the reference, with tensions about the pretension.
pub(crate) struct Control {
    geometry: Geometry,
    feedback: Vector3<f64>,
}

impl Control {
    pub(crate) fn new(geometry: Geometry) -> Self {
        Self { geometry, feedback: Vector3::zeros() }
    }

    /// The inputs from step `k` on, by what the pose and its rates (the first six states) are there.
    pub(crate) fn inputs(&mut self, k: usize, states: &[f64]) -> Inputs {
        let [pose, twist, acceleration] = reference(k);
        let at = |from: usize| Vector3::from_column_slice(&states[from..from + 3]);
        let wanted = BANDWIDTH * (BANDWIDTH * (pose - at(0)) + 2.0 * DAMPING * (twist - at(3)));
        self.feedback += (1.0 - (-STEP / LOW_PASS).exp()) * (wanted - self.feedback);
        let wrench = INERTIA.component_mul(&(acceleration + self.feedback));
        let structure = structure_matrix(&self.geometry, &at(0).into());
        let structure = DMatrix::from_fn(3, structure.ncols(), |row, cable| structure[(row, cable)]);
        let inverse = structure.clone().pseudo_inverse(1e-9).expect("a number of no sign");
        let pretension = DVector::from_element(structure.ncols(), PRETENSION);
        let rest = DVector::from_column_slice(wrench.as_slice()) - &structure * &pretension;
        let forces = pretension + inverse * rest;
        let mut inputs = Inputs::none(4);
        inputs.winch_force.iter_mut().zip(&forces).for_each(|(slot, force)| *slot = *force);
        inputs
    }
}
