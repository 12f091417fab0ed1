//! Stiffness of the platform: geometric part from tension, elastic part from the cables' stretch.

use nalgebra::{Matrix3, Vector3};
use num_dual::Dual64;

use super::StaticsError;
use crate::dynamics::MAX_EFFECT_STATES;
use crate::geometry::Geometry;
use crate::inverse::wrench::{Prescribed, required};
use crate::kinematics;
use crate::parameters::CableModel;
use crate::per_cable::PerCable;
use crate::plant::Plant;

/// Stiffness `K = -∂w/∂X` of the platform by its causes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stiffness {
    /// By tension in turning cables: what is left when the winches hold their forces.
    pub geometric: Matrix3<f64>,
    /// By the cables' stretch at fixed unstretched lengths; zero where the winches hold their forces.
    pub elastic: Matrix3<f64>,
    /// By effects that act on the platform itself (an umbilical); need not be symmetric.
    pub effects: Matrix3<f64>,
}

impl Stiffness {
    /// The sum of all.
    pub fn total(&self) -> Matrix3<f64> {
        self.geometric + self.elastic + self.effects
    }
}

/// Geometric stiffness of the cables at `pose` under `tension` (N): `Σ T_i ∂²L_i/∂X²`, the slope of (26), (27) at
/// constant tension.
///
/// `∂²L/∂X² = n nᵀ/L - diag(0, 0, E·S)` with `n = [-S_y, S_x, E·S]`, the row of `L J_α` (9).
pub fn geometric_stiffness(geometry: &Geometry, pose: &[f64; 3], tension: &PerCable<f64>) -> Matrix3<f64> {
    let cables = kinematics::cables(geometry, pose, &[0.0; 3]);
    let mut stiffness = Matrix3::zeros();
    for (cable, tension) in cables.iter().zip(tension) {
        let normal = Vector3::from(cable.normal_row());
        stiffness += normal * normal.transpose() * (tension / cable.span);
        stiffness[(2, 2)] -= tension * cable.arm_dot_direction;
    }
    stiffness
}

/// Elastic stiffness of the cables at `pose`: `J_Mᵀ diag(k) J_M` with `k_i = ∂T_i/∂L_i` (N/m) at fixed unstretched length,
/// by (32).
pub fn elastic_stiffness(geometry: &Geometry, pose: &[f64; 3], axial: &PerCable<f64>) -> Matrix3<f64> {
    let cables = kinematics::cables(geometry, pose, &[0.0; 3]);
    cables.iter().zip(axial).fold(Matrix3::zeros(), |sum, (cable, k)| {
        let row = Vector3::from(cable.jacobian_row());
        sum + row * row.transpose() * *k
    })
}

/// Tension (N), before it is cut off at zero, and its slope (N/m) over the length of a cable with this unstretched length.
///
/// States of the elastic law (creep) are held at `states`.
pub(super) fn tension_and_slope(
    plant: &Plant,
    cable: usize,
    time: f64,
    length: f64,
    unstretched: f64,
    states: &[f64; MAX_EFFECT_STATES],
) -> (f64, f64) {
    let states = states.map(Dual64::from);
    let length = Dual64::from_re(length).derivative();
    let tension = plant.chain(cable).spring(time.into(), length, unstretched.into(), &states);
    (tension.re, tension.eps)
}

/// Stiffness of the platform at rest at `pose` (m, rad) with these tensions (N), by its causes: `-∂w/∂X` of (26), (27), (32).
///
/// The elastic part is that of locked winches: unstretched lengths such that the cables carry the tensions, creep settled
/// and then held. A cable without tension is slack and has none.
///
/// # Errors
/// [`StaticsError::Rigid`].
pub fn stiffness(
    plant: &Plant,
    time: f64,
    pose: &[f64; 3],
    tension: &PerCable<f64>,
) -> Result<Stiffness, StaticsError> {
    let plant = plant.at(time);
    let geometry = plant.geometry();
    let lengths = kinematics::cable_lengths(geometry, pose);
    let mut axial = PerCable::filled(plant.cables(), 0.0);
    for i in (0..plant.cables()).filter(|i| tension[*i] > 0.0) {
        if plant.data().cables[i].model == CableModel::Rigid {
            return Err(StaticsError::Rigid);
        }
        let mut states = [0.0; MAX_EFFECT_STATES];
        plant.start_effect_states(i, tension[i], tension[i], &mut states);
        let unstretched = plant.unstretched_length_for(i, time, lengths[i], tension[i], &states);
        axial[i] = tension_and_slope(plant, i, time, lengths[i], unstretched, &states).1;
    }
    Ok(Stiffness {
        geometric: geometric_stiffness(geometry, pose, tension),
        elastic: elastic_stiffness(geometry, pose, &axial),
        effects: effect_stiffness(plant, time, pose),
    })
}

/// Stiffness by the effects on the platform, exact by dual numbers.
pub(super) fn effect_stiffness(plant: &Plant, time: f64, pose: &[f64; 3]) -> Matrix3<f64> {
    let mut stiffness = Matrix3::zeros();
    let zero = [Dual64::from(0.0); 3];
    for column in 0..3 {
        let mut moved = pose.map(Dual64::from_re);
        moved[column].eps = 1.0;
        let at_rest = Prescribed { time: time.into(), pose: moved, twist: zero, acceleration: zero, disturbance: zero };
        let cables = kinematics::cables(plant.geometry(), &at_rest.pose, &at_rest.twist);
        // At rest the wrench that the cables must exert is minus that of everything else.
        let wrench = required(plant, &at_rest, &cables);
        for row in 0..3 {
            stiffness[(row, column)] = wrench[row].eps;
        }
    }
    stiffness
}
